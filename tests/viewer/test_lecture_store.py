"""The station about stores shows a store of the map, made in the background; then the map in memory comes back."""

import threading

import pytest
from viewers import changed, later, seen, settle, stroke, texts

pytest.importorskip("zarr")
from terrain_gl.store import cache
from terrain_gl.viewer import lecture_store

pytestmark = pytest.mark.slow


def at_last_station(app):
    viewer = app.viewer
    viewer.give_lecture()
    viewer.lecture.go_to(len(viewer.lecture.stations) - 1)
    return viewer


def test_a_store_is_made_and_shown_and_the_map_comes_back_as_it_was(app):
    viewer = app.viewer
    land, memory = viewer.scene.heightmap, viewer.scene.renderer
    at_last_station(app)
    later(app)
    assert "making a store" in viewer.progress.text and viewer.scene.heightmap is land
    settle(app)
    assert viewer.scene.is_paged and viewer.lecture.number == len(viewer.lecture.stations) - 1
    tiles, every = viewer.lecture._numbers()["tiles"], viewer.lecture._numbers()["all_tiles"]
    assert 1 <= int(tiles) <= int(every) and f"{tiles} of its {every}" in viewer.lecture.texts()[0][0]
    folder = viewer.lecture_store._folder.name
    store = seen(app)
    assert (viewer.scene.heightmap.part(slice(0, 9), slice(0, 9)) == land.heights[:9, :9]).all()
    app.key_down("left", "left")
    settle(app)
    assert viewer.scene.renderer is memory and viewer.scene.heightmap is land
    assert viewer.lecture.number == len(viewer.lecture.stations) - 2
    with pytest.raises(FileNotFoundError):
        next(iter(lecture_store.Path(folder).iterdir()))
    at_last_station(app)
    settle(app)
    assert viewer.scene.is_paged and changed(seen(app), store) < 0.01
    pose = viewer.scene.controller.pose
    viewer.lecture.end()
    settle(app)
    assert viewer.scene.renderer is memory and viewer.scene.controller.pose == pose


def wait_for_store(app):
    """Do frames until the store that is made ahead is there, with its tables."""
    store = app.viewer.lecture_store
    for _ in range(200):
        settle(app)
        later(app)
        if store.at_work:
            store._job.join()
        elif store._job:
            break
    assert store._job and store._job.renderer and not app.viewer.scene.is_paged


def test_the_store_is_made_while_the_station_before_is_at_rest(app):
    viewer = at_last_station(app)
    viewer.lecture.go_to(len(viewer.lecture.stations) - 2)
    wait_for_store(app)
    app.key_down("space", "space")  # the answer
    app.key_down("space", "space")
    later(app, 0.0)
    assert viewer.loader.job is viewer.lecture_store._job
    later(app, 0.0)
    assert viewer.scene.is_paged
    settle(app)
    assert viewer.lecture.texts()[0][0].startswith("This is a store")


def test_a_store_that_is_made_ahead_is_dropped_when_the_land_changes_or_the_lecture_ends(app):
    viewer = at_last_station(app)
    viewer.lecture.go_to(len(viewer.lecture.stations) - 2)
    wait_for_store(app)
    job = viewer.lecture_store._job
    stroke(viewer, (500, 420), (530, 420))
    assert viewer.sculpting.unsaved and viewer.lecture_store._job is None and job.renderer is None
    app.press("ctrl+z")
    wait_for_store(app)
    viewer.lecture.end()
    later(app)
    assert viewer.lecture_store._job is None


def test_a_station_that_is_left_early_makes_no_store(app, monkeypatch):
    gate, build = threading.Event(), lecture_store.build

    def slow(*arguments, progress, **options):
        gate.wait(60)
        progress(0.5)
        return build(*arguments, progress=progress, **options)

    monkeypatch.setattr(lecture_store, "build", slow)
    viewer = at_last_station(app)
    later(app)
    job = viewer.loader.job
    app.key_down("left", "left")
    later(app)
    assert viewer.loader.job is None
    gate.set()
    job.join()
    settle(app)
    assert not viewer.scene.is_paged and job.opened is None


def test_unsaved_strokes_and_a_missing_extra_are_told(app, monkeypatch):
    monkeypatch.setattr(cache, "is_possible", lambda: False)
    viewer = at_last_station(app)
    settle(app)
    assert "[store]" in viewer.lecture.texts()[0][0] in texts(app).replace("\n", " ") and not viewer.scene.is_paged
    monkeypatch.undo()
    viewer.lecture.go_to(0)
    settle(app)
    app.press("escape")
    viewer.scene.controller.home()
    viewer.sculpting.toggle()
    settle(app)
    stroke(viewer, (500, 420), (530, 420))
    assert viewer.sculpting.unsaved
    at_last_station(app)
    settle(app)
    assert "not saved" in viewer.lecture.texts()[0][0] and not viewer.scene.is_paged
    app.press("ctrl+z")
    viewer.lecture.go_to(0)
    settle(app)
    at_last_station(app)
    settle(app)
    assert viewer.scene.is_paged
