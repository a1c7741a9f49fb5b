"""Cities: triangles, the surfaces that they belong to, and rays through them."""

from __future__ import annotations

from typing import NamedTuple, Tuple

from ._canyon import City

__all__ = ["City", "CityObject", "PLACEMENTS"]

PLACEMENTS: Tuple[str, ...] = ("free", "inside building", "under terrain", "unknown")
"""Meanings of the numbers of :meth:`City.placement`."""


class CityObject(NamedTuple):
    """A run of triangles that belong together: a building, the terrain, a tree."""

    name: str
    surface: str
    """"building", "terrain", "foliage" or "vehicle"."""
    first_triangle: int
    triangle_count: int
