"""Skies, and the paths of their signals to many positions."""

from __future__ import annotations

from typing import Any, Mapping, Optional, Sequence, Tuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ._canyon import City, Sky, Tracer

__all__ = ["PATH_KINDS", "Sky", "Trace", "Tracer", "VISIBILITIES", "trace"]

VISIBILITIES: Tuple[str, ...] = ("LOS", "LOS+multipath", "NLOS", "blocked")
"""Meanings of the numbers in ``visibility``."""
PATH_KINDS: Tuple[str, ...] = ("direct", "reflected", "diffracted", "diffuse", "spoofed")
"""Meanings of the numbers in ``kind``."""


Trace = NDArray[np.void]


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
    """Traces satellites' signals to many positions.

    Parameters
    ----------
    city : City
    places : (n, 3) array [m]
        Antenna positions, east, north, up. A row-major float64 array is not copied.
    sky : Sky
        Its satellites; or `directions` instead.
    times : time or sequence of n times
        One for all positions, or one for each.
    satellites : list of str, optional
        Selection, in the order of the result's columns; default: all of the sky.
    directions : (m, 3) array, optional
        Unit vectors, east, north, up: satellites in these directions at every position.
    propagation : dict, optional
        The keys below ``propagation:`` in a scenario.
    threads : int
        0: as many as cores.
    paths : bool
        Whether to return every path too.

    Returns
    -------
    numpy.ndarray
        Structured, shape (n, m): ``visibility`` (index into :data:`VISIBILITIES`), ``excess_m`` (excess of
        the shortest path, NaN: blocked), ``azimuth_rad``, ``elevation_rad`` (NaN below the horizon),
        ``above_horizon``, ``placement`` (index into :data:`canyon.PLACEMENTS`), ``paths`` (their number).
    numpy.ndarray
        With `paths`: a row for each path, with ``place``, ``satellite`` (indices), ``kind``, ``order``,
        ``excess_m``, ``arrival`` (unit vector, direction of arrival), ``point`` and ``far_point`` of reflection
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
