"""Faults that users have found in the window, each tried again with real events under Xvfb: the state after each.

    python benchmarks/window_faults.py FOLDER [MAP [LETTERS [TREE]]]    alpine-30m, all; screenshots go to FOLDER

A line for each fault says what the window does today. If the fault is there again, the script ends with an error and a
screenshot. TREE is a checkout of another commit, with a link glsl in its package: then the window is the one of that
commit, and nothing is demanded; letters d to k, and 9, work with older windows. It needs Xvfb, xdotool and python-xlib.
Random events are in window_events.py; docs/viewer_pictures.py draws the pictures of the chapter again, and a test
compares their numbers.
"""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).parents[1] / "tests" / each) for each in ("viewer", "")]
from screen import Screen  # noqa: E402
from tour import TELLING, Tour  # noqa: E402
from xdnd import drop  # noqa: E402

from terrain_gl.files.maps import open_map  # noqa: E402
from terrain_gl.image import read_image, write_image  # noqa: E402

SIZE = (1280, 720)
FAR_M = 1e7  # no camera leaves a map of this size by more


class Faults(Tour):
    """Each fault is a method; `run` takes them in the order in which they stand here."""

    only = ""  # letters of the faults that are tried in this window
    is_older = False  # whether the window is that of an older commit
    patience_s = 240  # on a busy machine

    def run(self):
        """Try all."""
        if self.only != "e":  # while a preview is shown, there is no state
            self.does(lambda s: s.get("bound") and not s["busy"])
            self.screen.do("search", "--sync", "--name", self.state["title"].split(".")[0], "windowfocus")
            self.start = self.state["eye"]
        for name, fault in vars(Faults).items():
            if name.startswith("fault_") and name[6] in self.only:
                print(f"{name[6]}  {fault.__doc__.splitlines()[0]}\n   {fault(self)}", flush=True)

    def tells(self, is_mended, told):
        """What is told, if the fault is mended; of an older window, also if it is not."""
        assert is_mended or self.is_older, told
        return told

    def dropped(self, path):
        """Drop a file on the middle of the land."""
        assert drop(self.screen.environment["DISPLAY"], self.at, [path])

    def longest_wait(self, holds):
        """Move the mouse until a condition of the state holds; returns the longest time until a motion was followed."""
        longest, begun, side = 0.0, time.monotonic(), 0
        while not holds(self.state) or time.monotonic() < begun + 2:
            side = 1 - side
            sent = time.monotonic()
            self.does(lambda s, x=self.at[0] + side: s["cursor"][0] == x, "mousemove", self.at[0] + side, self.at[1])
            longest = max(longest, time.monotonic() - sent)
            assert time.monotonic() < begun + self.patience_s, "it does not come to rest"
        return longest

    def fault_1_drag(self):
        """A middle drag from the land into the sky ended the program."""
        self.screen.do("mousemove", 800, 450, "mousedown", 2)
        for y in range(440, 50, -15):
            self.screen.do("mousemove", 800 + (450 - y) // 4, y)
        self.screen.do("mouseup", 2)
        self.does(lambda s: not s["busy"] and np.abs(s["eye"]).max() < FAR_M)
        self.shoot("drag-into-the-sky")
        moved_m = np.linalg.norm(np.subtract(self.state["eye"], self.start))
        self.home()
        return f"it goes on; the eye has moved {moved_m:,.0f} m, and Home brings it back"

    def fault_2_sun(self):
        """The sliders of the sun jumped once and then ignored the drag, because a message took the focus."""
        self.fold("Detail", "Understand", "Picture")
        left, top, right, bottom = self.place_of("sun azimuth")
        seen = []
        self.screen.do("mousemove", round(left + 0.15 * (right - left)), round((top + bottom) / 2), "mousedown", 1)
        for share in (0.25, 0.32, 0.39, 0.46):
            before = self.state["sun"]
            at = round(left + share * (right - left)), round((top + bottom) / 2)
            self.does(lambda s, before=before: s["sun"] != before, "mousemove", *at)
            time.sleep(1.0)  # light is computed meanwhile, and a message says so
            seen.append(self.state["sun"][0])
        self.screen.do("mouseup", 1)
        self.shoot("sun")
        self.fold("Detail", "Understand", "Picture")
        assert np.all(np.diff(seen) > 20), seen
        return f"the sun follows the whole drag: azimuths {', '.join(f'{each:.0f}°' for each in seen)}"

    def fault_3_split(self):
        """A new split came after seconds, black or cyan, with unequal triangles and no achieved error."""
        self.point_at(*self.at)
        begun = time.monotonic()
        self.does(lambda s: s["sketch"] and any("promises nothing" in text for text in s["texts"]), "key", "t")
        preview_s = time.monotonic() - begun
        self.save("preview")
        self.does(lambda s: len(s["achieved"]) == 2 and all(s["achieved"]))
        self.shoot("split")
        state = self.state
        less, more = sorted(state["sides"])
        assert more <= 1.02 * less and len(set(state["ends_px"])) == 1 and state["ends_px"][0]
        errors = [each["max"] for each in state["achieved"]]
        land = self.screen.pixels()[400:650, 350:1270]
        over = ((land[..., 0] < 90) & (land[..., 1:].min(-1) > 150)).mean()  # cyan
        assert over < 0.2 and np.ptp(land.max(-1)) > 60, over
        self.does(lambda s: len(s["ends_px"]) == 1, "key", "t")
        told = f"{less:,} and {more:,} triangles, one scale to {state['ends_px'][0]:g} px, achieved"
        told = f"a preview of both sides after {preview_s:.2f} s; {told} {errors[0]:.3g} and {errors[1]:.3g} px"
        return f"{told}; {100 * over:.0f} % of the land is over the scale"

    def fault_4_share(self):
        """At 1 px the bundled range took nine tenths of all its triangles."""
        self.does(lambda s: len(s["sides"]) == 1 and s["measured"] and not s["busy"])
        few, every = self.state["sides"][0], 2 * 1024**2
        assert few < 0.3 * every
        return f"{few:,} of {every:,} triangles, {100 * few / every:.0f} %"

    def fault_5_escape(self):
        """One Esc too many closed the window at once; type had one size; help was cut at 800 × 500."""
        self.does(lambda s: "Esc again" in s["message"], "key", "Escape")
        time.sleep(6)
        assert self.process.poll() is None
        self.does(lambda s: s["scale"] > 1, "key", "ctrl+plus")
        self.does(lambda s: s["scale"] == 1, "key", "ctrl+minus")
        self.does(lambda s: any("Help" in window[0] for window in s["windows"]), "key", "h")
        name = self.state["title"].split(".")[0]
        self.screen.do("search", "--name", name, "windowsize", 800, 500)
        self.does(lambda s: s["size"] == [800, 500] and not s["busy"])
        time.sleep(1)
        self.save("help-800x500")
        page = next(window for window in self.state["windows"] if "Help" in window[0])
        assert page[1] >= 0 and page[2] >= 0 and page[3] <= 800 and page[4] <= 500, page
        self.screen.do("key", "h", "search", "--name", name, "windowsize", *SIZE)
        self.does(lambda s: s["size"] == list(SIZE) and not s["busy"])
        return "the first Esc asks; Ctrl + and − change the type; the page of keys is inside a window of 800 × 500"

    def fault_6_tables(self):
        """A click on a patch did not show the table that chose it; with a hidden panel, legends had no numbers."""
        self.point_at(*self.at)
        self.does(lambda s: s["box"], "click", 1)
        self.shoot("patch")
        self.does(lambda s: not s["explained"], "key", "Escape")
        while self.state["style"] != "cracks":
            before = self.state["style"]
            self.does(lambda s, before=before: s["style"] != before, "key", "Tab")
        self.does(lambda s: not s["busy"] and any("cracks" in text for text in s["texts"]))
        self.does(lambda s: any("triangles, " in text for text in s["texts"]), "key", "i")
        self.shoot("cracks")
        counted = next(text for text in self.state["texts"] if "triangles, " in text)
        self.screen.do("key", "i")
        while self.state["style"] != "shaded":
            before = self.state["style"]
            self.does(lambda s, before=before: s["style"] != before, "key", "shift+Tab")
        return f"the click shows the box in the error table; without the panel the legend says: {counted}"

    def fault_7_contours(self):
        """Contour lines had no labels."""
        self.does(lambda s: not s["busy"] and any(label.endswith(" m") for label in s["labels"]), "key", "shift+c")
        self.shoot("contours")
        labels = [label for label in self.state["labels"] if label.endswith(" m")]
        self.does(lambda s: not s["labels"], "key", "shift+c")
        return f"{len(labels)} labels, such as {labels[0]}"

    def fault_8_lecture(self):
        """Esc ended the lecture, and nothing opened it again; questions had no answers; type was small."""
        self.does(lambda s: s["station"] == 0 and not s["busy"], "key", "ctrl+l")
        self.does(lambda s: any("A small part" in text for text in s["texts"]), "key", "space")
        self.does(lambda s: s["station"] == 1 and not s["busy"], "key", "space")
        self.shoot("station-2")
        self.does(lambda s: s["station"] is None, "key", "Escape")
        self.does(lambda s: s["station"] == 1 and not s["busy"], "key", "ctrl+l")
        self.does(lambda s: s["station"] is None, "key", "Escape")
        self.home()
        return "Space shows the answer, then station 2; after Esc, Ctrl L goes on there"

    def fault_9_film(self):
        """While a film was drawn, keys did nothing for 30 s, and no time left was said."""
        self.does(lambda s: s["recording"], "key", "r")
        self.screen.do("keydown", "d", "sleep", 1, "keyup", "d")
        self.does(lambda s: s["drawing"] and not s["recording"], "key", "r")
        self.does(lambda s: any("drawing the film" in text for text in s["texts"]))
        end_s = time.monotonic() + 60
        while not any(" left" in text for text in self.state["texts"]) and time.monotonic() < end_s:
            time.sleep(0.5)
        told = next((text for text in self.state["texts"] if "drawing the film" in text), "no line about the film")
        begun_s = time.monotonic()
        self.does(lambda s: s["labels"], "key", "shift+c")
        took_s = time.monotonic() - begun_s
        if self.state["drawing"]:
            self.does(lambda s: not s["drawing"], "key", "Escape")
        self.does(lambda s: s["contour_m"] is None, "key", "shift+c")
        self.home()
        told = f"it says {told!r}; the contour lines of a key are there after {took_s:.1f} s"
        return self.tells(" left" in told, told)

    def fault_a_explanation(self):
        """The explanation covered the patch that it explains; a tooltip resized the panel."""
        for x in (500, 1150):
            self.point_at(x, 500)
            self.does(lambda s: s["explained"], "click", 1)
            self.shoot(f"explained-{x}")
            _, left, top, right, bottom = next(each for each in self.state["windows"] if each[0].startswith("##patch"))
            assert not (left <= x <= right and top <= 500 <= bottom), (x, left, right)
            self.does(lambda s: not s["explained"], "key", "Escape")

        def panel():
            return next(each for each in self.state["windows"] if each[0].endswith("###panel"))

        heights = []
        for label in ("tolerance", "metric", "triangles", "method"):
            place = self.place_of(label)
            self.screen.do("mousemove", round(place[0] + 5), round(place[1] + 5), "sleep", 1)
            heights.append(panel()[4])
        assert len(set(heights)) == 1, heights
        return "at both sides it is beside the patch; the panel has one size under four controls with help"

    def fault_b_layers(self):
        """A track could not be added in the window; a GeoJSON file was told to use --trust."""
        east, north = 3000, 3000
        line = {"type": "LineString", "coordinates": [[east, north], [10 * east, 10 * north]]}
        (self.cwd / "way.geojson").write_text(json.dumps({"crs": None, **line}))
        self.fold("Detail", "Understand", "Layers")
        left, top, right, bottom = self.place_of("add")
        self.screen.do("mousemove", round(left + 20), round((top + bottom) / 2), "click", 1, "sleep", 0.5)
        self.screen.do("type", "--delay", 60, "way.geojson")
        self.does(lambda s: s["layers"] == ["way.geojson"], "key", "Return")
        told = self.state["message"]
        self.shoot("layers")
        self.fold("Detail", "Understand", "Layers")
        return f"the file is a layer: {told}"

    def fault_c_waits(self):
        """The window took no input for seconds, for example at 0.03 px. Today's longest frames, in seconds."""
        told = []
        for name, keys, back in (
            ("tolerance 1/32 px", ["minus"] * 10, ["plus"] * 10),
            ("style lod", ["Tab"], ["shift+Tab"]),
            ("split", ["t"], ["t"]),
            ("summed-area table", ["u"], ["u"]),
        ):
            begun_s = time.monotonic()
            for key in keys:
                self.screen.do("key", key)
            time.sleep(1)
            self.does(lambda s: not s["busy"] and s["measured"])
            slow = [seconds for at_s, seconds in self.state["slow"] if at_s >= begun_s]
            told.append(f"{name} {max(slow, default=0.1):.2f} of {time.monotonic() - begun_s:.0f}")
            for key in back:
                self.screen.do("key", key)
            time.sleep(1)
            self.does(lambda s: not s["busy"] and s["measured"])
        return "; ".join(told)

    def fault_d_promise(self):
        """The first map after a store: an achieved error of 28.8 px stood beside a bound of 1 px, without a word."""
        path = self.cwd / "land.npy"
        np.save(path, open_map("alpine-30m")[0].heights)
        self.dropped(path)
        self.does(lambda s: s["title"] == "land.npy" and s["measured"] and not s["busy"])
        self.shoot("after-a-store")
        bound_px, achieved_px = self.state["bound"], self.state["measured"]["max"]
        return self.tells(achieved_px <= bound_px, f"bound {bound_px:.3f} px, achieved {achieved_px:.3g} px")

    def fault_e_preview(self):
        """A map that was dropped during another map's preview kept the old camera, 520 m under the ground."""
        path = self.cwd / "land.npy"
        np.save(path, open_map("alpine-30m")[0].heights)
        self.screen.wait(lambda: np.ptp(self.screen.pixels()[300:600, 700:1200].max(-1)) > 60, "a preview", 240)
        assert "eye" not in self.state, "the preview is over"
        self.dropped(path)
        self.does(lambda s: s["title"] == "land.npy" and s["bound"] and not s["busy"])
        self.shoot("dropped")
        eye, height_m = self.state["eye"], self.state["height"]
        self.screen.do("search", "--sync", "--name", "land", "windowfocus", "key", "Home", "sleep", 3)
        self.does(lambda s: not s["moving"])
        away_m = float(np.linalg.norm(np.subtract(self.state["eye"], eye)))
        told = f"the eye is {height_m:,.0f} m over the ground, {away_m:,.0f} m from the first view of the new map"
        return self.tells(height_m > 0 and away_m == 0, told)

    def fault_f_saved(self):
        """P saved no heights of contours."""
        self.does(lambda s: s["labels"] and not s["busy"], "key", "shift+c")
        self.screen.do("key", "i", "mousemove", 5, 5, "sleep", 8)  # messages go
        self.does(lambda s: not s["busy"])
        self.save("shown")
        shown = self.screen.pixels()[60:600, 20:1220]
        self.screen.do("key", "p")
        self.screen.wait(lambda: list(self.cwd.glob("*-001.json")), "a picture", self.patience_s)
        time.sleep(2)
        whole = read_image(next(self.cwd.glob("*-001.png")))[..., :3]
        write_image(self.shots / f"{self.number:02d}-saved.png", whole)
        # white type in squares of 60 pixels, of which snow has less
        texts, saved = (
            (each.reshape(9, 60, -1, 60, 3).min(-1) > 235).sum((1, 3)) > 25 for each in (shown, whole[60:600, 20:1220])
        )
        self.screen.do("key", "i")
        self.does(lambda s: not s["labels"], "key", "shift+c")
        told = f"squares with heights: {texts.sum()} in the window, {(texts & saved).sum()} of them in the file"
        return self.tells((texts & saved).sum() > 0.8 * texts.sum(), told)

    def fault_g_brush(self):
        """B and a drag moved the camera until the brush was ready, up to 15 s."""
        (x, y), eye = self.at, self.state["eye"]
        self.screen.do("key", "b", "mousemove", x, y, "mousedown", 1)
        for step in range(1, 12):
            self.screen.do("mousemove", x + 10 * step, y, "sleep", 0.05)
        self.screen.do("mouseup", 1, "sleep", 1)
        self.does(lambda s: not s["busy"])
        moved_m = float(np.linalg.norm(np.subtract(self.state["eye"], eye)))
        strokes = self.state["strokes"][0]
        self.shoot("brush")
        self.screen.do("key", "b")
        self.does(lambda s: not s["strokes"][0], "key", "ctrl+z")
        self.home()
        return self.tells(moved_m == 0, f"the camera has moved {moved_m:,.0f} m; strokes: {strokes}")

    def fault_h_legends(self):
        """In a split, a legend was under the panel, and the other one out of the window."""
        self.does(lambda s: len(s["sides"]) == 2 and not s["busy"], "key", "t")
        self.shoot("legends")
        boxes = {name: box for name, *box in self.state["windows"]}
        panel = next(box for name, box in boxes.items() if name.endswith("###panel"))
        legends = [box for name, box in boxes.items() if name.startswith("##side")]
        is_free = all(box[0] >= panel[2] and box[2] <= SIZE[0] for box in legends) and len(legends) == 2
        told = ", ".join(f"{box[0]:.0f} to {box[2]:.0f}" for box in legends)
        self.does(lambda s: len(s["sides"]) == 1, "key", "t")
        return self.tells(is_free, f"the panel ends at column {panel[2]:.0f}; legends from {told} of {SIZE[0]}")

    def fault_i_scroll(self):
        """A section that was opened below the others was not scrolled into view."""
        self.fold("Map")
        before = set(self.state["places"])
        self.fold("Sculpt")
        time.sleep(2)
        own = [box for name, box in self.state["places"].items() if name not in before]
        panel = next(each for each in self.state["windows"] if each[0].endswith("###panel"))
        seen = sum(box[3] <= panel[4] for box in own)
        self.shoot("section")
        self.screen.do("key", "Home")
        return self.tells(own and seen == len(own), f"{seen} of {len(own)} controls of the section are in view")

    def fault_j_waits(self):
        """At 1/32 px, the window took no input for seconds. The longest time until the mouse was followed."""
        for _ in range(10):
            self.screen.do("key", "minus")
        longest_s = self.longest_wait(lambda s: not s["busy"] and s["measured"])
        return self.tells(longest_s < 2, f"{longest_s:.1f} s, with {self.state['sides'][0]:,} triangles")

    def fault_k_texts(self):
        """A dropped GeoJSON was told to use --trust; the line of the bound said "complete"; light had two names."""
        line = {"type": "LineString", "coordinates": [[3000, 3000], [30000, 30000]]}
        path = self.cwd / "way.geojson"
        path.write_text(json.dumps({"crs": None, **line}))
        before = self.state["message"]
        self.dropped(path)
        self.does(lambda s: s["message"] not in ("", before))
        told, texts = self.state["message"], self.state["texts"]
        bound = next(text for text in texts if "bound" in text)
        self.shoot("texts")
        is_mended = "trust" not in told and "complete" not in " ".join(texts)
        return self.tells(is_mended, f"dropped: {told!r}; {bound!r}")


def store_of_land(cwd: Path, environment: dict[str, str]) -> Path:
    """A small store, made by the program whose window is tried."""
    np.save(cwd / "first.npy", open_map("canyon-15m")[0].heights)
    build = [sys.executable, "-m", "terrain_gl", "build", "first.npy", "-o", "first.zarr"]
    subprocess.run(build, cwd=cwd, env=environment, check=True, capture_output=True)
    return cwd / "first.zarr"


def large_map(cwd: Path, environment: dict[str, str]) -> Path:
    """A map whose tables take so long that its preview is seen."""
    t = np.linspace(0, 60, 4097, dtype=np.float32)
    np.save(cwd / "large.npy", 900 * np.sin(t)[:, None] * np.cos(0.7 * t)[None, :])
    return cwd / "large.npy"


STARTS: dict[str, Callable[[Path, dict[str, str]], Path]] = {"d": store_of_land, "e": large_map}  # other maps by letter


def main(folder: str, name: str = "alpine-30m", only: str = "", tree: str = "") -> int:
    """Try the faults whose letters are in `only`, in one window; those that begin with another map, in their own."""
    letters = only or "".join(each[6] for each in vars(Faults) if each.startswith("fault_"))
    Faults.is_older = bool(tree)
    telling = Path(tree) / "tests/viewer/telling.py" if tree else TELLING
    for own in ["".join(each for each in letters if each not in STARTS), *filter(letters.count, STARTS)]:
        Faults.only = own
        with tempfile.TemporaryDirectory() as made:
            cwd = Path(made)
            screen = Screen(cwd)
            if tree:
                screen.environment["PYTHONPATH"] = tree
            try:
                start = STARTS[own](cwd, screen.environment) if own in STARTS else name
                with screen.running(telling, start, f"{SIZE[0]}x{SIZE[1]}", "shaded", cwd=cwd) as process:
                    Faults(screen, process, cwd, SIZE, Path(folder)).run()
            finally:
                screen.server.terminate()
                screen.server.wait()
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
