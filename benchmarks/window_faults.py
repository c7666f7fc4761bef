"""Faults that users have found in the window, each tried again with real events under Xvfb: the state after each.

    python benchmarks/window_faults.py FOLDER [MAP [LETTERS]]    alpine-30m, all; a screenshot of each goes to FOLDER

A line for each fault says what the window does today. If the fault is there again, the script ends with an error and a
screenshot. It needs Xvfb and xdotool. Random events are in window_events.py; docs/viewer_pictures.py draws the pictures
of the chapter again, and a test compares their numbers.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1] / "tests" / "viewer"))
from screen import Screen  # noqa: E402
from tour import TELLING, Tour  # noqa: E402

SIZE = (1280, 720)
FAR_M = 1e7  # no camera leaves a map of this size by more


class Faults(Tour):
    """Each fault is a method; `run` takes them in the order in which they stand here."""

    only = ""  # letters of the faults that are tried; all by default
    patience_s = 240  # on a busy machine

    def run(self):
        """Try all."""
        self.does(lambda s: s.get("measured") and not s["busy"])
        self.screen.do("search", "--sync", "--name", self.state["title"].split(".")[0], "windowfocus")
        self.start = self.state["eye"]
        for name, fault in vars(Faults).items():
            if name.startswith("fault_") and name[6] in (self.only or name):
                print(f"{name[6]}  {fault.__doc__.splitlines()[0]}\n   {fault(self)}", flush=True)

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
        self.does(lambda s: len(s["achieved"]) == 2)
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
        self.does(lambda s: s["drawing"], "key", "ctrl+r")
        self.does(lambda s: any(" left;" in text for text in s["texts"]))
        told = next(text for text in self.state["texts"] if " left;" in text)
        begun_s = time.monotonic()
        self.does(lambda s: s["contour_m"] == 0.0, "key", "shift+c")
        took_s = time.monotonic() - begun_s
        self.shoot("film", settled=False)
        self.does(lambda s: not s["drawing"] and s["contour_m"] is None, "key", "shift+c", "sleep", 1, "key", "Escape")
        return f"it says {told!r}; a key is followed after {took_s:.1f} s"

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


def main(folder: str, name: str = "alpine-30m", only: str = "") -> int:
    """Try all faults in one window, or those whose letters are in `only`."""
    Faults.only = only
    with tempfile.TemporaryDirectory() as made:
        cwd = Path(made)
        screen = Screen(cwd)
        try:
            with screen.running(TELLING, name, f"{SIZE[0]}x{SIZE[1]}", "shaded", cwd=cwd) as process:
                Faults(screen, process, cwd, SIZE, Path(folder)).run()
        finally:
            screen.server.terminate()
            screen.server.wait()
    return 0


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
