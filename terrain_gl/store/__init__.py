"""Stores: maps larger than memory, as a Zarr v3 group with heights and error records for every level.

pyramid                     sizes of levels, arrays and shards
format                      the arrays on disk, and the store's description
opened                      a store as a map to draw
job, voids, water           the state of a build; voids filled and water found, shard by shard
tasks, scheduling, build    from a source to a store, in parallel and resumable
cache                       stores of large rasters, made at first use
"""

from ..basics.inputs import is_store
from .build import build
from .checking import check
from .format import MissingTileError
from .opened import StoredMap

__all__ = ["MissingTileError", "StoredMap", "build", "check", "is_store"]
