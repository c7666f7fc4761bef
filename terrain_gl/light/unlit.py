"""The light of a paged map: there is none yet (docs/stores.md), so lit styles are drawn as "lambert"."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Any, cast

from ..terrain import Terrain
from .ground import HeightSums
from .lighting import Lighting


class Unlit:
    """Takes the place of `HeightSums` and `Lighting`, and does nothing."""

    bytes = 0
    is_there = False
    has_air = True
    defines: Mapping[str, object] = MappingProxyType({})

    def follow_steps(self, *_: Any) -> Iterator[float]:
        """There is nothing to make."""
        return iter(())

    def nothing(self, *_: Any) -> None:
        """There is nothing to bind, to make, to describe or to release."""

    bind = follow = describe = update = release = nothing


def light_of(terrain: Any) -> tuple[HeightSums, Lighting]:
    """The sums of heights and the light of a map."""
    if not isinstance(terrain, Terrain):
        return cast(HeightSums, Unlit()), cast(Lighting, Unlit())
    sums = HeightSums(terrain)
    return sums, Lighting(terrain, sums)
