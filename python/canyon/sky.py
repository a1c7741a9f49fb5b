"""Skies, and what becomes of their signals at many places."""

from __future__ import annotations

from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import _canyon
from .city import City

__all__ = ["PATH_KINDS", "Sky", "Trace", "Tracer", "VISIBILITIES", "trace"]

VISIBILITIES: Tuple[str, ...] = ("LOS", "LOS+multipath", "NLOS", "blocked")
"""What the numbers in ``visibility`` mean."""
PATH_KINDS: Tuple[str, ...] = ("direct", "reflected", "diffracted", "diffuse", "spoofed")
"""What the numbers in ``kind`` mean."""


class Sky:
    """Satellites over a span of time.

    Parameters
    ----------
    begin, end : time
        Between which it is asked; `end` is `begin` where left out. Text such as ``"2026-06-01T08:00:00Z"``,
        ``datetime`` or ``numpy.datetime64`` (UTC).
    place : (latitude_deg, longitude_deg, height_m), optional
        From where frozen satellites are seen.
    **settings
        What stands below ``sky:`` in a scenario: ``navigation``, ``sp3``, ``nominal``, ``frozen``, ``systems``.

    Examples
    --------
    >>> import canyon
    >>> sky = canyon.Sky("2026-06-01T08:00:00Z", systems=["GPS"])
    >>> look = sky.look("2026-06-01T08:00:00Z", (48.1, 11.6, 520))
    >>> look["elevation_rad"].shape == (1, len(sky.satellites))
    True
    """

    def __init__(
        self, begin: Any, end: Any = None, place: Optional[Sequence[float]] = None, **settings: Any
    ) -> None:
        self._handle = _canyon.Sky.from_settings(settings, begin, end, None if place is None else tuple(place))

    @property
    def satellites(self) -> List[str]:
        """list of str: "G01", "E05", ..., those that it may know."""
        return self._handle.satellites

    @property
    def warnings(self) -> List[str]:
        """list of str: Stale ephemerides and their like."""
        return self._handle.warnings

    def look(self, times: Any, place: Sequence[float]) -> Dict[str, NDArray[np.float64]]:
        """Where all satellites stand, above the horizon or not.

        Parameters
        ----------
        times : time or sequence of times
        place : (latitude_deg, longitude_deg, height_m)

        Returns
        -------
        dict
            ``azimuth_rad`` (from north, clockwise), ``elevation_rad`` and ``range_m`` of shape
            (times, satellites), ``position_ecef_m`` with a further axis of 3; NaN without an ephemeris.
        """
        return self._handle.look(times, tuple(place))


Trace = NDArray[np.void]


class Tracer:
    """Traces satellites in one city. Its facets are prepared once.

    Parameters
    ----------
    city : City
    **propagation
        What stands below ``propagation:`` in a scenario: ``model``, ``reflection_order``, ...
    """

    def __init__(self, city: City, **propagation: Any) -> None:
        self._handle = _canyon.Tracer(city._handle, propagation or None)

    def at(
        self,
        places: ArrayLike,
        sky: Optional[Sky] = None,
        times: Any = None,
        satellites: Optional[Sequence[str]] = None,
        directions: Optional[ArrayLike] = None,
        threads: int = 0,
        paths: bool = False,
    ) -> Any:
        """Traces at places: see :func:`trace`, whose arguments these are."""
        if directions is not None:
            if sky is not None:
                raise TypeError("give a sky with times, or directions")
            return self._handle.towards(places, directions, threads, paths)
        if sky is None or times is None:
            raise TypeError("give a sky with times, or directions")
        return self._handle.at(sky._handle, places, times, satellites, threads, paths)


def trace(
    city: City,
    places: ArrayLike,
    sky: Optional[Sky] = None,
    times: Any = None,
    *,
    satellites: Optional[Sequence[str]] = None,
    directions: Optional[ArrayLike] = None,
    propagation: Optional[Mapping[str, Any]] = None,
    threads: int = 0,
    paths: bool = False,
) -> Any:
    """What becomes of satellites' signals at many places.

    Parameters
    ----------
    city : City
    places : (n, 3) array [m]
        Antennas, east, north, up. An array of float64 in rows is not copied.
    sky : Sky
        Whose satellites; or `directions` instead.
    times : time or sequence of n times
        One for all places, or one for each.
    satellites : list of str, optional
        Which ones, in the order of the result's columns; all of the sky's.
    directions : (m, 3) array, optional
        Unit vectors, east, north, up: satellites that stand there at every place.
    propagation : dict, optional
        What stands below ``propagation:`` in a scenario.
    threads : int
        0: as many as cores.
    paths : bool
        Whether every path is wanted as well.

    Returns
    -------
    numpy.ndarray
        Structured, shape (n, m): ``visibility`` (index into :data:`VISIBILITIES`), ``excess_m`` (detour of
        the shortest path, NaN where blocked), ``azimuth_rad``, ``elevation_rad`` (NaN below the horizon),
        ``above_horizon``, ``placement`` (index into :data:`canyon.PLACEMENTS`), ``paths`` (how many).
    numpy.ndarray
        With `paths`: a row for each path, with ``place``, ``satellite`` (indices), ``kind``, ``order``,
        ``excess_m``, ``arrival`` (unit, towards where it comes from), ``point`` and ``far_point`` of reflection
        [m], ``incidence_rad``, ``foliage_depth_m``.

    Examples
    --------
    >>> import canyon, numpy as np
    >>> city = canyon.City(
    ...     synthetic={"blocks_east": 2, "blocks_north": 2, "seed": 7},
    ...     origin={"latitude_deg": 22.3, "longitude_deg": 114.17, "height_m": 0},
    ... )
    >>> zenith = canyon.trace(city, [[0, 0, 2], [8, 1, 2]], directions=[[0, 0, 1]])
    >>> [canyon.VISIBILITIES[v] for v in zenith["visibility"][:, 0]]
    ['LOS', 'LOS']
    """
    tracer = Tracer(city, **dict(propagation or {}))
    return tracer.at(places, sky, times, satellites, directions, threads, paths)
