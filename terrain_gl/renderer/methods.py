"""The methods that draw a terrain: a registry from a method's name to the selector of its mesh.

The renderer, the options, the command line and the viewer read the names from `REGISTRY`.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module
from typing import Any, NamedTuple, Protocol, TypeVar

from ..basics.rect import Rect
from ..camera import Camera
from ..error import ErrorTables
from ..lod import EveryPost, Goal, RingsSelector, Selection, ViewBlock
from ..lod.every_post import TRUTH
from ..terrain import Terrain

CERTIFIED = "certified"
BASELINE = "baseline"
EXACT = "exact"


class Method(NamedTuple):
    """A line of the registry.

    Attributes
    ----------
    kind
        A CERTIFIED method is within the tolerance, a BASELINE certifies nothing, an EXACT method draws every post.
    factory
        "module:name" inside this package: a function or class that makes a `Selector` from `Selectors`. The module is
        imported when the method is first used.
    help
        A short description.
    """

    kind: str
    factory: str
    help: str


REGISTRY = {
    "sat": Method(CERTIFIED, "renderer.methods:rings_of_tables", "a clipmap, its detail chosen by summed-area tables"),
    "clipmap": Method(BASELINE, "comparison.clipmap:Clipmap", "geometry clipmaps"),
    "tessellated": Method(BASELINE, "comparison.tessellated:Tessellated", "clipmaps with hardware tessellation"),
    "full": Method(EXACT, "renderer.methods:every_post", "every post"),
    "truth": Method(EXACT, "renderer.methods:true_surface", "every post, bilinear in between"),
}
METHODS = tuple(REGISTRY)
REMOVED = {"quadtree": "method quadtree was removed before 1.0: use sat"}
BASELINES = tuple(name for name, method in REGISTRY.items() if method.kind == BASELINE)
EVERY_POST = tuple(name for name, method in REGISTRY.items() if method.kind == EXACT)


class Follower(Protocol):
    """An object that must follow edits of the terrain."""

    @property
    def bytes(self) -> int:
        """GPU memory in bytes."""

    def update(self, posts: Rect) -> None:
        """Follow an edit of the posts of columns x0 to x1 and rows y0 to y1, (x0, y0, x1, y1)."""

    def release(self) -> None:
        """Release GPU resources."""


class Selector(Follower, Protocol):
    """Chooses the mesh of a picture."""

    def select(self, camera: Camera, size: tuple[int, int], near_m: float, goal: Goal) -> Selection:
        """Choose the mesh for a picture of `size` (width, height)."""


Made = TypeVar("Made", bound=Follower)


class Selectors:
    """The selectors of one terrain, by method name. Each is made at its first use.

    Parameters
    ----------
    tables
        Error tables of the terrain.
    view
        The `View` block that all selectors write.
    """

    def __init__(self, tables: ErrorTables, view: ViewBlock) -> None:
        self.tables = tables
        self.view = view
        self._made: dict[Callable[[Selectors], Any], Any] = {}

    @property
    def terrain(self) -> Terrain:
        """The map."""
        return self.tables.terrain

    @property
    def bytes(self) -> int:
        """GPU memory of all selectors that were made."""
        return sum(made.bytes for made in self._made.values())

    def __getitem__(self, method: str) -> Selector:
        module, function = REGISTRY[method].factory.split(":")
        selector: Selector = self.shared(getattr(import_module(f"..{module}", __package__), function))
        return selector

    def shared(self, make: Callable[[Selectors], Made]) -> Made:
        """The result of `make`: made once, and shared by all selectors that need it."""
        if make not in self._made:
            self._made[make] = make(self)  # if `make` calls `shared` itself, that object is added first
        made: Made = self._made[make]
        return made

    def update(self, posts: Rect) -> None:
        """Follow an edit of the posts of columns x0 to x1 and rows y0 to y1, (x0, y0, x1, y1)."""
        for made in self._made.values():
            made.update(posts)

    def release(self) -> None:
        """Release GPU resources."""
        while self._made:
            self._made.popitem()[1].release()


def every_post(selectors: Selectors) -> EveryPost:
    """Every post in the picture: method "full"."""
    return EveryPost(selectors.tables, selectors.view)


def true_surface(selectors: Selectors) -> EveryPost:
    """Every post in the picture, and the bilinear surface between posts: method "truth"."""
    return EveryPost(selectors.tables, selectors.view, TRUTH)


def rings_of_tables(selectors: Selectors) -> RingsSelector:
    """The clipmap whose detail the summed-area tables decide: method "sat"."""
    return RingsSelector(selectors.tables, selectors.view)
