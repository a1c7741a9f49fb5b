"""Cities: triangles, their surfaces, and rays."""

from __future__ import annotations

import copyreg
import os
import tempfile
import weakref
from pathlib import Path
from typing import Any, Callable, Dict, MutableMapping, NamedTuple, Tuple

from ._canyon import City

__all__ = ["City", "CityObject", "PLACEMENTS"]

PLACEMENTS: Tuple[str, ...] = ("free", "inside building", "under terrain", "unknown")
"""Meanings of the numbers of :meth:`City.placement`."""


class CityObject(NamedTuple):
    """A range of triangles of one object: a building, the terrain, a tree."""

    name: str
    surface: str
    """"building", "terrain", "foliage" or "vehicle"."""
    first_triangle: int
    triangle_count: int


KEPT: MutableMapping[City, Dict[str, Any]] = weakref.WeakKeyDictionary()  # results of properties of cities


def _unpacked(file: bytes, seed: int) -> City:
    with tempfile.TemporaryDirectory(prefix="canyon-city-") as folder:
        path = os.path.join(folder, "city.canyon")
        Path(path).write_bytes(file)
        return City._read(path, seed)  # unchanged; load() would assign facades again


def _packed(city: City) -> Tuple[Callable[..., City], Tuple[Any, ...]]:
    with tempfile.TemporaryDirectory(prefix="canyon-city-") as folder:
        path = os.path.join(folder, "city.canyon")
        city.save(path)
        return _unpacked, (Path(path).read_bytes(), city._seed)


copyreg.pickle(City, _packed)
