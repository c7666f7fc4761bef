"""What the command line was told: one frozen record for each command, made once, when the words are parsed.

A record has a part for each concern. `told` fills all parts from the parser's values of the same names.
"""

import os
from argparse import Namespace
from dataclasses import dataclass, is_dataclass
from datetime import datetime
from typing import Any, TypeVar, get_type_hints, is_typeddict

from ..camera import Vector
from ..readers import Reading
from ..readers.raster import Spacing
from ..renderer.options import FrameOptions
from ..renderer.overlay import LABEL

Record = TypeVar("Record")
Drawn = TypeVar("Drawn", bound="DrawOptions")


@dataclass(frozen=True)
class MapOptions:
    """The map: a file, a store or a bundled name, and how its values are read."""

    reading: Reading = Reading()
    name: str = ""
    spacing_m: Spacing | None = None

    @property
    def source(self) -> tuple[str, Reading, Spacing | None]:
        """The arguments of `cache.stored`."""
        return self.name, self.reading, self.spacing_m


@dataclass(frozen=True)
class StoreOptions:
    """How a store is drawn. By default, for commands without these options, none is."""

    gpu_memory: int = 0  # MiB
    memory: int = 0  # MiB
    edits: str | None = None
    no_cache: bool = True


@dataclass(frozen=True)
class CameraOptions:
    """The camera, and the size of the picture."""

    view: str | None = None
    eye: Vector | None = None
    target: Vector | None = None
    up: Vector | None = None
    fov_deg: float | None = None
    at: tuple[float, ...] | None = None
    stand: tuple[float, ...] | None = None
    coordinates: str = "metres"
    size: tuple[int, int] = (1280, 720)

    @property
    def is_placed(self) -> bool:
        """Whether an option says where the camera is, or what it looks at."""
        return any((self.view, self.eye, self.target, self.at, self.stand))

    @property
    def given(self) -> dict[str, Any]:
        """The given fields of `Camera`, by name."""
        given = {"eye": self.eye, "target": self.target, "up": self.up, "fov_deg": self.fov_deg}
        return {name: value for name, value in given.items() if value is not None}


@dataclass(frozen=True)
class SunOptions:
    """The sun, by its direction or by the clock."""

    sun: tuple[float, float] | None = None
    time: datetime | None = None
    latitude: float | None = None
    longitude: float | None = None


@dataclass(frozen=True)
class LaidOptions:
    """What lies over the land, and over the picture."""

    overlay: tuple[str, ...] = ()
    overlay_colour: tuple[str, ...] = ()
    labels: str = LABEL
    furniture: bool = False
    title: str | None = None


@dataclass(frozen=True)
class OutputOptions:
    """Where results go, and the driver that makes them."""

    path: str = ""
    json: str | None = None
    facts: str | None = None  # the format of what pixels show, which is written beside the picture
    backend: str = "auto"

    def facts_beside(self, picture: str) -> str | None:
        """The file for what the pixels of a picture show; None if it was not asked for."""
        return f"{os.path.splitext(picture)[0]}.{self.facts}" if self.facts and picture else None


@dataclass(frozen=True)
class DrawOptions:
    """What all commands that draw are told."""

    map: MapOptions
    store: StoreOptions
    camera: CameraOptions
    light: SunOptions
    frame: FrameOptions
    laid: LaidOptions
    output: OutputOptions

    @property
    def files(self) -> list[str]:
        """The files that are read beside the map."""
        frame = self.frame
        files = frame.shading.sky, frame.material, frame.drape, self.store.edits, *self.laid.overlay
        return [path for path in files if path]


def told(record: type[Record], given: Namespace) -> Record:
    """A record, and its parts, from the parser's values of the same names. What was not given has the default."""
    values: dict[str, Any] = {}
    for name, kind in get_type_hints(record).items():
        is_part = is_dataclass(kind) or is_typeddict(kind) or hasattr(kind, "_fields")
        value = told(kind, given) if is_part else getattr(given, name, None)
        if value is not None:
            values[name] = tuple(value) if isinstance(value, list) else value
    return record(**values)
