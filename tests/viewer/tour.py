"""A tour of the real window with real wheel, drags and keys: python tests/viewer/tour.py FOLDER [MAP].

Each step acts like a user, waits until the window has followed, checks that no panels overlap, and saves the screen as
FOLDER/WIDTHxHEIGHT/NUMBER-name.png. It needs Xvfb and xdotool. tests/viewer/test_tour.py takes the same steps on a
small map.
"""

import itertools
import json
import math
import sys
import tempfile
import time
from pathlib import Path

import numpy as np
from screen import Screen, end_of

from terrain_gl.files.maps import open_map
from terrain_gl.image import write_image

TELLING = Path(__file__).with_name("telling.py")
SIZES = ((1280, 720), (1000, 600))


class Tour:
    """The steps, each a method; `run` takes them in the order in which they stand here."""

    patience_s = 120

    def __init__(self, screen, process, cwd, size, shots):
        self.screen, self.process, self.cwd, self.size, self.shots = screen, process, cwd, size, shots
        self.number = 0
        self.start = []  # the eye of the first view
        self.at = round(0.62 * size[0]), round(0.7 * size[1])  # a place on the land

    @property
    def state(self):
        path = self.cwd / "state.json"
        return json.loads(path.read_text(encoding="utf-8")) if path.exists() else {}

    def does(self, condition, *words):
        """Run xdotool, and wait until the state is as it should be."""
        if words:
            self.screen.do(*words)

        def holds():
            assert self.process.poll() is None, self.process.communicate()[1]
            now = self.state
            return now.get("eye") and condition(now)

        try:
            self.screen.wait(holds, f"{words} after picture {self.number}", self.patience_s)
        except AssertionError:
            self.save("failed")
            raise

    def point_at(self, x, y):
        """Move the cursor."""
        self.does(lambda s: s["cursor"] == [x, y], "mousemove", x, y)

    def click_on(self, label, down=0.0):
        """Click on a control, or as many of its heights below it."""
        left, top, right, bottom = self.place_of(label)
        y = (top + bottom) / 2 + down * (bottom - top)
        self.screen.do("mousemove", round(left + 12), round(y), "sleep", 0.2, "click", 1, "sleep", 0.3)

    def choose(self, label, down):
        """Open a list, and choose what stands so many heights of the control below it."""
        self.click_on(label)
        self.does(lambda s: s["list"])
        self.click_on(label, down)
        self.does(lambda s: not s["list"])

    def place_of(self, label):
        """Left, top, right and bottom of a control that keeps its place."""
        before = None
        while True:
            self.does(lambda s: label in s["places"])
            now = self.state["places"][label]
            if now == before:
                return now
            before = now
            time.sleep(0.5)

    def overlaps(self):
        """Pairs of panels that overlap."""
        return [
            (a[0], b[0])
            for a, b in itertools.combinations(self.state["windows"], 2)
            if max(a[1], b[1]) < min(a[3], b[3]) - 0.5 and max(a[2], b[2]) < min(a[4], b[4]) - 0.5
        ]

    def shoot(self, name, settled=True):
        """Save the screen, when the picture is complete and nothing overlaps."""
        if settled:
            self.does(lambda s: not s["busy"] and not s["moving"])
        self.screen.do("sleep", 1)  # panels take a few frames to find their size
        self.screen.wait(lambda: self.overlaps() == [], f"panels apart: {self.overlaps()}", 20)
        self.number += 1
        self.save(name)

    def save(self, name):
        """Save the screen as it is."""
        width, height = self.size
        self.shots.mkdir(parents=True, exist_ok=True)
        pixels = self.screen.pixels()[:height, :width].astype(np.uint8)
        write_image(self.shots / f"{self.number:02d}-{name}.png", pixels)

    def run(self):
        """All steps, then Esc until the window closes."""
        for name, step in vars(Tour).items():
            if name.startswith("step_"):
                step(self)
        while self.process.poll() is None:
            self.screen.do("key", "Escape", "sleep", 0.5)
        assert end_of(self.process) == (0, "", [])

    def home(self):
        """Back to the first view, with the cursor on the land."""
        self.does(lambda s: not s["moving"] and s["eye"] == self.start, "key", "Home")
        self.point_at(*self.at)

    # --- What a user does ---------------------------------------------------------------------------------------------

    def step_first(self):
        """The first picture: north, scale, and the place under the cursor; the title is the map's."""
        self.does(lambda s: s.get("measured"))
        self.screen.do("search", "--sync", "--name", self.state["title"].split(".")[0], "windowfocus")
        self.point_at(*self.at)
        self.does(lambda s: s["place"] and any("height" in text for text in s["texts"]))
        self.start = self.state["eye"]
        self.shoot("first")

    def step_wheel(self):
        """The wheel comes nearer to the place under the cursor, and the speed follows the height."""
        before = self.state
        near = 0.6 * math.dist(before["eye"], before["place"])
        self.does(lambda s: math.dist(s["eye"], before["place"]) < near, "click", "--repeat", 3, "--delay", 80, 4)
        self.does(lambda s: math.dist(s["place"], before["place"]) < 0.02 * math.dist(s["eye"], s["place"]))
        assert self.state["speed"] < before["speed"]
        self.shoot("wheel")
        self.home()

    def step_pan(self):
        """A middle drag moves the land with the cursor, level."""
        before, (x, y) = self.state, self.at
        self.screen.do("mousemove", x, y, "mousedown", 2, "mousemove", x - 60, y + 20, "mousemove", x - 120, y + 30)
        self.does(lambda s: math.dist(s["eye"], before["eye"]) > 1, "mouseup", 2)
        assert self.state["eye"][2] == before["eye"][2]
        self.shoot("pan")
        self.home()

    def step_double_click(self):
        """A double click flies there."""
        before = self.state
        near = 0.7 * math.dist(before["eye"], before["place"])
        click = "click", "--repeat", 2, "--delay", 60, 1
        self.does(lambda s: not s["moving"] and math.dist(s["eye"], before["place"]) < near, *click)
        assert not self.state["explained"]
        self.shoot("double-click")
        self.home()

    def step_orbit(self):
        """In orbit a drag turns around the middle of the picture; then flying again."""
        self.does(lambda s: s["mode"] == "orbit", "key", "v")
        before, (x, y) = self.state, self.at
        self.screen.do("mousedown", 1, "mousemove", x - 80, y, "mousemove", x - 160, y - 30, "mouseup", 1)
        self.does(lambda s: math.dist(s["eye"], before["eye"]) > 1)
        self.shoot("orbit")
        self.does(lambda s: s["mode"] == "fly", "key", "Home")
        self.home()

    def step_views(self):
        """The list of views travels: straight down."""
        self.fold("Detail", "Understand")
        self.fold("Camera")
        self.choose("view", 3.1)  # the third of the list: from above
        self.does(lambda s: s["elevation"] < -89)
        self.shoot("views")
        self.fold("Camera")
        self.home()

    def fold(self, *sections):
        """Open or close sections of the panel by clicks on their titles."""
        for section in sections:
            self.does(lambda s: not s["busy"])  # else the panel may still move
            was_open = self.state["opened"][section]
            self.click_on(section)
            self.does(lambda s, name=section, before=was_open: s["opened"][name] is not before)

    def step_files(self):
        """Ctrl O lists the folder's maps; the map that is chosen is shown, with its name in the title."""
        start = self.state["title"]
        self.does(lambda s: s["folder"], "key", "ctrl+o")
        self.place_of("other.npy")
        self.shoot("files")
        self.click_on("other.npy")
        self.does(lambda s: s["title"] == "other.npy")
        self.screen.do("search", "--sync", "--name", "other.npy")
        self.fold("Map")
        self.shoot("recent")
        self.choose("recent", 2.1)
        self.does(lambda s: s["title"] == start and not s["busy"])
        self.fold("Map")
        self.home()

    def step_contours(self):
        """Contour lines."""
        self.does(lambda s: s["contour_m"] == 0.0, "key", "shift+c")
        self.shoot("contours")

    def step_ruler(self):
        """The ruler: three clicks, a profile; Esc puts it away."""
        (x, y), width = self.at, self.size[0]
        self.does(lambda s: s["ruler"], "key", "shift+r")
        for i, (dx, dy) in enumerate(((-0.2, 0.1), (0.1, 0.12), (0.25, 0.02)), 1):
            at = round(x + dx * width), round(y + dy * self.size[1])
            self.does(lambda s, i=i: s["corners"] == i, "mousemove", *at, "click", 1)
        self.does(lambda s: any("along the ground" in text for text in s["texts"]) and "profile" in s["places"])
        self.shoot("ruler")
        self.does(lambda s: not s["ruler"], "key", "Escape")
        self.does(lambda s: s["contour_m"] is None, "key", "shift+c")
        self.screen.do("mousemove", *self.at)

    def step_click(self):
        """A click explains: the height and plain words first."""
        self.does(lambda s: s["explained"] or "explanation" in s["message"], "click", 1)
        self.does(lambda s: any("height" in text for text in s["texts"]))
        self.shoot("click")
        self.does(lambda s: not s["explained"], "key", "Escape") if self.state["explained"] else None

    def step_split(self):
        """A split picture: equal triangles on both sides, and the colours of their errors."""
        self.does(lambda s: len(s["sides"]) == 2 and s["style"] == "error", "key", "t")
        self.does(lambda s: min(s["sides"]) > 0.7 * max(s["sides"]))
        self.shoot("split")
        self.does(lambda s: len(s["sides"]) == 1 and s["style"] != "error", "key", "t")

    def step_record(self):
        """A recording, and its film, which is drawn afterwards."""
        self.does(lambda s: s["recording"], "key", "r")
        self.does(lambda s: s["moving"], "keydown", "d")
        self.screen.do("sleep", 0.5)
        self.shoot("recording", settled=False)
        self.screen.do("keyup", "d")
        self.does(lambda s: s["drawing"] and not s["recording"], "key", "r")
        self.does(lambda s: any("drawing the film" in text for text in s["texts"]))
        self.shoot("film", settled=False)
        self.patience_s *= 5  # every frame in full quality
        self.does(lambda s: not s["drawing"] and "saved" in s["message"])
        self.patience_s /= 5
        assert list(self.cwd.glob("*-001.mp4")) or list(self.cwd.glob("*-001/frame-00001.png"))
        self.shoot("filmed")
        self.home()

    def step_strokes(self):
        """A stroke is unsaved land, and the title says so; undone it is none."""
        x, y = self.at
        self.does(lambda s: "brush" in s["message"], "key", "b")
        self.screen.do("mousedown", 1, "mousemove", x + 30, y, "mousemove", x + 60, y, "sleep", 0.3, "mouseup", 1)
        self.does(lambda s: s["strokes"] == [1, 0] and s["title"].endswith("*"))
        self.shoot("stroke")
        self.does(lambda s: s["strokes"] == [0, 1] and not s["title"].endswith("*"), "key", "ctrl+z")
        self.shoot("undone")
        self.screen.do("key", "b")

    def step_all_sections(self):
        """All keys, and all sections of the panel at once."""
        self.screen.do("key", "h", "sleep", 1)
        self.shoot("keys")
        self.screen.do("key", "h", "sleep", 0.5)
        self.fold("Sculpt", "Picture")
        self.shoot("sections")
        assert self.state["error"] == "GL_NO_ERROR"


def take(map_path, size, shots, style="shaded"):
    """The tour of a map in a window of a size; pictures go to `shots`."""
    with tempfile.TemporaryDirectory() as folder:
        cwd = Path(folder)
        (cwd / "maps").mkdir()
        here = cwd / "maps" / Path(map_path).name
        here.write_bytes(Path(map_path).read_bytes())
        np.save(cwd / "maps" / "other.npy", np.add.outer(np.sin(np.arange(65) / 9) * 20, np.arange(65.0)).astype("f4"))
        screen = Screen(cwd)
        try:
            with screen.running(TELLING, here, f"{size[0]}x{size[1]}", style, cwd=cwd) as process:
                Tour(screen, process, cwd, size, shots).run()
        finally:
            screen.server.terminate()
            screen.server.wait()


def main(folder, map_path=""):
    """The tour at each size; by default over the land of a bundled map, in a file that is not that map's."""
    with tempfile.TemporaryDirectory() as made:
        if not map_path:
            map_path = Path(made) / "land.npy"
            np.save(map_path, open_map("canyon-15m")[0].heights)
        for size in SIZES:
            shots = Path(folder) / f"{size[0]}x{size[1]}"
            take(map_path, size, shots)
            print(f"{shots}: {len(list(shots.glob('*.png')))} pictures")


if __name__ == "__main__":
    main(*sys.argv[1:])
