"""`terrain-gl fly`: a flight over a map, as a film or a folder of pictures."""

import contextlib
import os
import sys
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np

from ..basics.exceptions import TerrainError, UsageError
from ..camera import Vector
from ..film import parts
from ..film.journal import FlightJournal
from ..film.path import CameraPath
from ..film.record import CODECS, FPS, Recorder, is_folder, picture_name
from ..film.tour import FOV_DEG, tour
from ..heightmap import Heightmap, ground_m
from ..renderer.options import NO_SKY
from . import effects, frames, options, overlays, report, stores, values
from .scene import open_scene

SECONDS = 12.0
MAX_FRAMES = 1_000_000
SUMMARISED = ("triangles", "patches", "certified_max_error_px", "certified_jump_px", "max_error_px", "rms_error_px")


def add(commands: options.Commands) -> None:
    """Add the command."""
    command = options.add_command(
        commands,
        "fly",
        frames.FlyOptions,
        run,
        help="a flight over a map as a film, or as a folder of pictures",
        description="Fly over a map along a path of keyframes; without a path, on a tour that stays above the ground.\n"
        "docs/flight.md describes path files. The same command continues an interrupted .mp4 or folder of pictures.",
        example="fly canyon -o canyon.mp4 --size 1280x720 --seconds 20",
    )
    options.add_map(command)
    options.add_output(command, f"film: {', '.join(CODECS)} (extra [video]); or a folder of PNGs, FRAMES/")
    group = command.add_argument_group("flight")
    group.add_argument(
        "--path", metavar="FILE", dest="keyframes", help="keyframes, .json (default: a tour around the map)"
    )
    group.add_argument("--seconds", type=values.positive, metavar="S", help="how long (default: the path's, or 12)")
    group.add_argument("--fps", type=values.positive, metavar="N", default=FPS, help="frames a second (default: 30)")
    group.add_argument("--measure", action="store_true", help="measure the error of every frame, too")
    options.add_workers(group)
    overlays.add(command)
    overlays.add_furniture(command)
    options.add_rendering(command, moving=True)
    options.add_facts(command)
    stores.add_options(command)


def run(asked: frames.FlyOptions) -> int:
    """Run the command."""
    path = asked.output.path
    if asked.frame.sky == NO_SKY:
        raise UsageError("--sky none: frames of a flight have no alpha; draw single pictures with shot")
    if asked.output.facts and not is_folder(path):
        raise UsageError("--facts: a film has no room for them: name a folder of pictures, FRAMES/")
    asked = overlays.with_ground(asked)
    width, height = (max(2, side & ~1) for side in asked.camera.size)
    if path.lower().endswith(".mp4") and (width, height) != asked.camera.size:
        report.note(f"--size: an .mp4 has even sides: {width}x{height}")
        asked = replace(asked, camera=replace(asked.camera, size=(width, height)))
    can_continue = is_folder(path) or _has_parts(path)
    journal = FlightJournal(path, frames.identity(asked), asked.output.facts) if can_continue else None
    if is_folder(path):
        asked = replace(asked, output=replace(asked.output, path=""))  # the checks that follow are for files
    with Recorder(path, asked.fps, journal.done if journal else None) as recorder:
        try:
            about, incomplete = _record(recorder, journal, asked)
        except KeyboardInterrupt:
            recorder.cancel()
            _tell_what_is_left(recorder)
            raise
    report.say(asked.output.json, _text(report.shown(path), about))
    return stores.status_of(incomplete)


def _record(
    recorder: Recorder, journal: FlightJournal | None, asked: frames.FlyOptions
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Draw and record all frames; returns the numbers of the flight, and the first frame with missing tiles, if any."""
    scene = open_scene(asked)
    effects.tell(asked, scene)
    fov_deg = scene.camera.fov_deg if asked.keyframes or asked.camera.fov_deg else FOV_DEG
    path = CameraPath.open(asked.keyframes, fov_deg) if asked.keyframes else tour(scene.heightmap, fov_deg)
    seconds = asked.seconds or path.seconds or SECONDS
    flight = frames.Flight(asked, scene, path, _count(seconds, asked.fps))
    numbers, shared = _fly(flight, recorder, journal)
    _tell_jumps(numbers, shared)
    about = {"map": scene.heightmap.name, "seconds": seconds, "fps": asked.fps, "length_m": path.length_m}
    about |= _places(scene.heightmap, [frame["eye"] for frame in numbers]) | {"summary": _summary(numbers)} | shared
    about["frames_without_land"] = sum(not frame.get("sees_land", True) for frame in numbers)
    if asked.laid.overlay:
        samples = np.sum([frame["overlay_samples"] for frame in numbers], 0).tolist()
        laid = overlays.of(asked.laid, scene.heightmap, silent=True)
        overlays.tell_unseen(asked.laid.overlay, scene.heightmap, laid, samples)
    with report.json_output(asked.output.json, about | {"frames": numbers}):
        recorder.close()
    lacking = next((frame for frame in numbers if not frame.get("complete", True)), {})
    return about, lacking | {"map": scene.heightmap.name}


def _count(seconds: float, fps: float) -> int:
    count = round(seconds * fps)
    if not 1 <= count <= MAX_FRAMES:
        raise UsageError(f"{seconds:g} s of {fps:g} frames a second are {count:,} frames: take 1 to {MAX_FRAMES:,}")
    return count


def _fly(
    flight: frames.Flight, recorder: Recorder, journal: FlightJournal | None
) -> tuple[list[dict[str, Any]], dict[str, Any]]:
    """Draw and record the missing frames; returns the numbers of each frame, and the numbers that all frames share."""
    noted: dict[int, Any] = {}
    if journal:
        journal.begin()
        noted |= journal.done
    with report.progress_bar("flying") as show, contextlib.closing(flight.frames(tuple(noted), show)) as drawn:
        for number, frame in drawn:
            noted[number] = {"frame": number, "time_s": number / flight.asked.fps} | frame.numbers, frame.about
            if journal:
                journal.add(number, noted[number])
            if frame.facts and (beside := flight.asked.output.facts_beside(picture_name(number))):
                frame.facts.write(os.path.join(recorder.path, beside))  # first: a frame is complete with its picture
            recorder.append(frame.image)
    return [noted[number][0] for number in sorted(noted)], noted[0][1]


def _tell_jumps(numbers: list[dict[str, Any]], shared: dict[str, Any]) -> None:
    """Add to each frame except the first how far a point may have jumped: docs/guarantee.md, section 10."""
    for before, frame in pairwise(numbers):
        both = [each["certified_max_error_px"] for each in (before, frame)]
        is_of_points = shared["certified_metric"] == "max" and None not in both
        frame["certified_jump_px"] = sum(both) if is_of_points else None


def _places(heightmap: Heightmap, way: Sequence[Vector]) -> dict[str, int]:
    """Number of frames with the eye outside the map, and under its surface."""
    eyes = np.array(way)
    inside = np.all((eyes[:, :2] >= 0) & (eyes[:, :2] <= heightmap.extent_m), axis=1)
    try:
        ground = ground_m(heightmap, eyes[:, :2])
    except TerrainError:  # a tile of a store is damaged; the numbers of each frame that needs it name it
        ground = np.full(len(eyes), np.nan)
    under = np.nan_to_num(ground, nan=-np.inf) > eyes[:, 2]
    return {"frames_outside": int(np.sum(~inside)), "frames_under_ground": int(np.sum(under))}


def _summary(frames: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Summary of all frames: median and maximum; for times, median and 99.9th percentile."""
    summary: dict[str, Any] = {"frames": len(frames)}
    for key in SUMMARISED:
        values = [frame[key] for frame in frames if frame.get(key) is not None]
        if values:
            summary[key] = {"median": float(np.median(values)), "max": max(values)}
    if "holes" in frames[0]:
        summary["holes"] = sum(frame["holes"] for frame in frames)
    times = {stage: [frame["ms"][stage] for frame in frames] for stage in ("lod", "draw", "shade", "frame")}
    ends = {"median": 50, "p999": 99.9}
    ms = {stage: {end: float(np.percentile(t, p)) for end, p in ends.items()} for stage, t in times.items()}
    return summary | {"ms": ms}


def _text(output: str, about: dict[str, Any]) -> str:
    """The flight in a few lines of text."""
    summary = about["summary"]
    count = summary["frames"]
    triangles = summary["triangles"]["median"]
    ms = summary["ms"]["frame"]
    error = report.certified(about, summary.get("certified_max_error_px", {}).get("max"))
    if "max_error_px" in summary:
        measured = "max_error_px" if about["certified_metric"] == "max" else "rms_error_px"
        error += f", measured {summary[measured]['max']:.3g} px, {summary['holes']} holes"
    if "certified_jump_px" in summary:
        error += f", jumps of at most {summary['certified_jump_px']['max']:.3g} px"
    text = f"{output}: {count:,} frames of {about['width']}x{about['height']}, {triangles:,.0f} triangles, {error}, "
    text += f"{ms['median']:.0f} ms a frame, 99.9 % within {ms['p999']:.0f} ms"
    for key, where in (("frames_outside", "outside the map"), ("frames_under_ground", "under ground")):
        if about[key]:
            text += f"\nnote: in {about[key]:,} frames the eye is {where}"
    if about["frames_without_land"]:
        text += f"\nnote: {about['frames_without_land']:,} frames show no land"
    return text


def _tell_what_is_left(recorder: Recorder) -> None:
    left = "nothing is written"
    count = recorder.frames
    if not is_folder(recorder.path):
        count = parts.kept(count) if _has_parts(recorder.path) else 0
    if count:
        left = f"{count} pictures are complete, and the same command continues"
    print(f"terrain-gl: {report.shown(recorder.path)}: stopped, {left}", file=sys.stderr)


def _has_parts(output: str) -> bool:
    """Whether a film is written in parts. Only an .mp4 is; other formats are for short films."""
    return output.lower().endswith(".mp4")
