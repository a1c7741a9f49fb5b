"""Cities: triangles, what they are of, and rays through them."""

from __future__ import annotations

import os
from typing import Any, Dict, List, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _canyon
from .scenario import Scenario, Settings, as_scenario

__all__ = ["City", "CityObject", "PLACEMENTS"]

PLACEMENTS: Tuple[str, ...] = ("free", "inside building", "under terrain", "unknown")
"""What the numbers of :meth:`City.placement` mean."""


class CityObject(NamedTuple):
    """A run of triangles that belong together: a building, the terrain, a tree."""

    name: str
    surface: str
    """"building", "terrain", "foliage" or "vehicle"."""
    first_triangle: int
    triangle_count: int


class City:
    """A city: static surfaces in the east-north-up frame about its origin [m].

    Parameters
    ----------
    **settings
        What stands below ``city:`` in a scenario (docs/scenario.md): ``mesh``, ``file``, ``osm``, ``synthetic``
        or ``open``, and what belongs to them.

    Examples
    --------
    >>> import canyon
    >>> city = canyon.City(
    ...     synthetic={"blocks_east": 2, "blocks_north": 2, "seed": 7},
    ...     origin={"latitude_deg": 22.3, "longitude_deg": 114.17, "height_m": 0},
    ... )
    >>> city.triangles.shape[1], city.vertices.flags.writeable
    (3, False)
    >>> hit = city.cast([0, 0, 2], [1, 0.3, 0.05])
    >>> bool(hit["range_m"][0] > 0)
    True
    """

    def __init__(self, **settings: Any) -> None:
        self._handle = _canyon.City.from_settings(settings)

    @classmethod
    def _of(cls, handle: "_canyon.City") -> "City":
        city = cls.__new__(cls)
        city._handle = handle
        return city

    @classmethod
    def load(cls, path: "str | os.PathLike[str]", origin: Optional[Sequence[float]] = None) -> "City":
        """A city of any file that Canyon reads, by its name.

        Parameters
        ----------
        path : path
            OpenStreetMap, CityJSON, mesh, Gazebo world, or Canyon's own file (docs/city.md).
        origin : (latitude_deg, longitude_deg, height_m), optional
            Where a mesh's zero lies, or a map's shall.
        """
        return cls._of(_canyon.City.load(os.fspath(path), None if origin is None else tuple(origin)))

    @classmethod
    def from_osm(cls, files: Union[str, Sequence[str]], **settings: Any) -> "City":
        """A city of OpenStreetMap files.

        Parameters
        ----------
        files : path or list of paths
            OpenStreetMap (.osm, .osm.gz, .osm.bz2, .osm.pbf) or CityJSON.
        **settings
            Further keys below ``city:``: ``origin``, ``bbox``, ``terrain``, ... (docs/city.md).
        """
        names = [os.fspath(files)] if isinstance(files, (str, os.PathLike)) else [os.fspath(f) for f in files]
        return cls._of(_canyon.City.from_settings({"osm": names, **settings}))

    @classmethod
    def of_scenario(cls, scenario: Union[Scenario, Settings]) -> "City":
        """The city of a scenario: facades drawn and place moved as its seed says."""
        return cls._of(_canyon.City.of_scenario(as_scenario(scenario)._handle))

    def save(self, path: "str | os.PathLike[str]") -> None:
        """Writes Canyon's own city file (.canyon), which loads quickly."""
        self._handle.save(os.fspath(path))

    @property
    def name(self) -> str:
        """str: What the source calls it."""
        return self._handle.name

    @property
    def origin(self) -> Tuple[float, float, float]:
        """tuple: (latitude_deg, longitude_deg, height_m) of the frame's zero, WGS 84."""
        return self._handle.origin

    @property
    def notes(self) -> List[str]:
        """list of str: What the import dropped, guessed or repaired."""
        return self._handle.notes

    @property
    def summary(self) -> Dict[str, Any]:
        """dict: buildings, triangles, highest_roof_m, built_area_fraction [1], min_enu_m, max_enu_m, ..."""
        return self._handle.summary

    @property
    def objects(self) -> List[CityObject]:
        """list of CityObject: They cover all triangles, in order."""
        return [CityObject(*each) for each in self._handle.objects]

    @property
    def vertices(self) -> NDArray[np.float64]:
        """(n, 3) array [m]: East, north, up. The engine's own memory, read-only."""
        return self._handle.vertices

    @property
    def triangles(self) -> NDArray[np.uint32]:
        """(m, 3) array: Indices into :attr:`vertices`, counter-clockwise from outside. Read-only, not copied."""
        return self._handle.triangles

    @property
    def materials(self) -> NDArray[np.uint8]:
        """(m,) array: Index into :data:`canyon.MATERIALS` of each triangle. Read-only, not copied."""
        return self._handle.materials

    def object_of(self, triangle: int) -> CityObject:
        """The object that a triangle belongs to.

        Parameters
        ----------
        triangle : int
            Index into :attr:`triangles`, as :meth:`cast` gives it.
        """
        objects = self.objects
        starts = [each.first_triangle for each in objects]
        if not 0 <= triangle < len(self.triangles):
            raise IndexError(f"triangle {triangle} of {len(self.triangles)}")
        return objects[int(np.searchsorted(starts, triangle, side="right")) - 1]

    def placement(self, places: ArrayLike) -> NDArray[np.uint8]:
        """Whether places are free, inside a building or under the terrain: indices into :data:`PLACEMENTS`.

        Parameters
        ----------
        places : (n, 3) array [m]
            East, north, up.
        """
        return self._handle.placement(places)

    def terrain(self, places: ArrayLike) -> NDArray[np.float64]:
        """Height of the terrain [m] at places, NaN where there is none. The places' heights do not matter."""
        return self._handle.terrain(places)

    def cast(self, origins: ArrayLike, directions: ArrayLike) -> Dict[str, NDArray[Any]]:
        """First hits of rays.

        Parameters
        ----------
        origins, directions : (n, 3) array or (3,)
            As many of both, or one of either. Directions need no unit length.

        Returns
        -------
        dict
            ``range_m`` (n,), NaN without a hit; ``triangle`` (n,), -1 without; ``normal`` (n, 3).
        """
        return self._handle.cast(origins, directions)

    def enu_of(self, places: ArrayLike) -> NDArray[np.float64]:
        """East, north, up [m] of (latitude_deg, longitude_deg, height_m), (3,) or (n, 3)."""
        return self._handle.enu_of(places)

    def geodetic_of(self, enu: ArrayLike) -> NDArray[np.float64]:
        """(latitude_deg, longitude_deg, height_m) of east, north, up [m], (3,) or (n, 3)."""
        return self._handle.geodetic_of(enu)

    def __repr__(self) -> str:
        return f"<canyon.City {self.name!r}: {len(self.triangles)} triangles>"
