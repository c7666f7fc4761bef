"""Texts of the window: why a patch is drawn as it is, and a line for each side of a split picture."""

import numpy as np

from ..basics.words import metres
from ..renderer.frame import Stats
from ..renderer.methods import EVERY_POST
from ..renderer.options import FrameOptions
from ..verify.explain import Choice, Explanation
from .frame_stats import bound_words, error_name

HEADINGS = ("drawn as", "posts apart", "error", "on screen", "")


def title(patch: Explanation) -> str:
    """The kind of the patch, in a line."""
    t, step = patch.chosen.segments, patch.chosen.step
    quads = "one quad" if t == 1 else f"{t} × {t} quads"
    return f"A patch of {quads}, {step:g} post{'s' * (step > 1)} apart"


def plain(patch: Explanation) -> str:
    """The accuracy of the patch, without technical terms."""
    if patch.hidden_by:
        return f"hidden by the ridge at {_place(patch.hidden_by)}, so not drawn"
    allowed = f"; {patch.tolerance_px:.3g} px allowed" if np.isfinite(patch.tolerance_px) else ""
    return f"drawn at most {bound_px(patch):.2g} px off{allowed}" if patch.in_picture else "outside the picture"


def bound_px(patch: Explanation) -> float:
    """The bound of the patch on the screen, its cut edges included."""
    return max(patch.bound_px, patch.chosen.px)


def rows(patch: Explanation, near: bool = False) -> list[tuple[str, str, str, str, str]]:
    """The levels that the patch could have, one in each row under `HEADINGS`; or only those `near` the chosen one."""
    at = patch.choices.index(patch.chosen)
    told = []
    for choice in patch.choices[max(at - 1, 0) : at + 2] if near else patch.choices:
        error = metres(_error_m(patch, choice))
        told.append(
            (f"T = {choice.segments}", f"{choice.step:g}", error, f"{choice.px:.3g} px", _verdict(patch, choice))
        )
    return told


def reasons(patch: Explanation) -> list[str]:
    """Why the patch has its level, in sentences."""
    error = metres(_error_m(patch, patch.chosen))
    if not patch.in_picture:
        return ["The patch is outside the view that the levels were chosen for. So its error does not matter."]
    if patch.hidden_by:
        return [
            f"The ridge at {_place(patch.hidden_by)} hides the whole patch from the eye. So no triangle is drawn.",
            "Its level was chosen all the same, because it decides how its neighbours' edges are cut.",
        ]
    if patch.chosen.max_m == 0:
        return ["The triangles are the true surface. So the error is zero."]
    what = "The largest error of its surface" if patch.metric == "max" else "The RMS error of its surface"
    limit = "The level is what the budget of triangles allows."
    if np.isfinite(patch.tolerance_px):
        limit = f"The tolerance is {patch.tolerance_px:.3g} px."
    sentences = [
        f"The nearest corner of its bounding box has a depth of {metres(patch.nearest_m)}. There, one metre of height"
        f" is at most {patch.px_per_m:.3g} px.",
        f"{what} is at most {error} (from the tables), so at most {patch.chosen.px:.3g} px. {limit}",
    ]
    if bound_px(patch) > patch.chosen.px:
        edges = "Edges next to finer patches are cut more finely."
        sentences.append(f"{edges} With them the patch stays within {patch.bound_px:.3g} px.")
    return sentences


def _place(place: tuple[float, float]) -> str:
    return f"{place[0]:,.0f} m east, {place[1]:,.0f} m north of the corner"


def side_line(
    options: FrameOptions,
    stats: Stats,
    is_preview: bool,
    measured_px: dict[str, float] | None,
    is_short: bool = False,
) -> str:
    """A line about a side of a split picture: what the user requested, triangles, bound and achieved error."""
    tolerance = f"{options.max_error_px:.3g} px {options.metric}" if options.max_error_px else ""
    budget = f"{options.triangles:,} triangles {options.metric}" if options.triangles else tolerance
    asked = "every post" if options.method in EVERY_POST else f"{options.method}, {budget}"
    bound = "preview" if is_preview else bound_words(stats, ".3g")
    found = ""
    if measured_px:
        found = f", {error_name(measured_px)} {measured_px['max']:.3g} px"
        if "rms" in measured_px and not is_short:
            found += f" (RMS {measured_px['rms']:.2g} px)"
    return f"{asked}: {stats['triangles']:,} triangles, {bound}{found}"


def _error_m(patch: Explanation, choice: Choice) -> float:
    return choice.rms_m if patch.metric == "rms" else choice.max_m


def _verdict(patch: Explanation, choice: Choice) -> str:
    if choice == patch.chosen:
        return "chosen, hidden" if patch.hidden_by else "drawn"
    if choice.px > patch.tolerance_px:
        return "too coarse"
    finer = patch.choices.index(choice) > patch.choices.index(patch.chosen)
    return "finer than needed" if finer else "enough, but a neighbour is finer"
