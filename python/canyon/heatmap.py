"""Maps of error, visibility and DOP over a city."""

from __future__ import annotations

import os
import tempfile
import weakref
from typing import Any, Dict, List, Mapping, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _canyon
from ._canyon import City, Scenario, map_layers
from .errors import InputError, Interrupted
from .scenario import Settings

__all__ = ["CELL_STATES", "HeatMap", "heatmap", "map_layers"]

CELL_STATES: Tuple[str, ...] = ("computed", "inside building", "under terrain", "outside area", "no terrain")
"""Meanings of the numbers of :attr:`HeatMap.state`; 255: not computed."""


class _Tiles:
    """The engine's part of a map: shared by copies, omitted from pickles."""

    def __init__(self, handle: "Optional[_canyon.Map]") -> None:
        self.handle = handle

    def __deepcopy__(self, memo: Any) -> "_Tiles":
        return self

    def __reduce__(self) -> Tuple[Any, ...]:
        return _Tiles, (None,)


class HeatMap:
    """A map of a city. A pickled map has its arrays, but cannot :meth:`write`.

    Attributes
    ----------
    layers : dict
        Name to float32 array of shape (time, altitude, row, column); NaN: no value.
    state : (altitude, row, column) array
        Index into :data:`CELL_STATES` of each cell.
    east_m, north_m : arrays
        Centres of columns and rows in the city's frame; row 0 is the southernmost.
    times : array of datetime64, UTC
    altitudes_m : list of float
    cells_computed, wall_s : int, float
        Cells (times altitudes and times) of this call, and its wall time.
    """

    def __init__(self, handle: "_canyon.Map", folder: "tempfile.TemporaryDirectory[str] | None") -> None:
        self._tiles = _Tiles(handle)
        if folder is not None:
            weakref.finalize(handle, folder.cleanup)  # the writers read tiles from there
        values = handle.values()
        self.layers: Dict[str, NDArray[np.float32]] = values["layers"]
        self.state: NDArray[np.uint8] = values["state"]
        self.east_m: NDArray[np.float64] = values["east_m"]
        self.north_m: NDArray[np.float64] = values["north_m"]
        self.times: NDArray[np.datetime64] = values["time"]
        self.altitudes_m: List[float] = values["altitude_m"]
        self.cells_computed: int = values["cells_computed"]
        self.wall_s: float = values["wall_s"]
        self._about: Dict[str, Tuple[str, str]] = values["about"]

    def __getitem__(self, layer: str) -> NDArray[np.float32]:
        return self.layers[layer]

    def __repr__(self) -> str:
        return f"<canyon.HeatMap: {', '.join(self.layers)}; {' x '.join(map(str, self.state.shape))} cells>"

    def to_xarray(self) -> Any:
        """An ``xarray.Dataset`` with units; xarray is imported here."""
        import xarray

        axes = ("time", "altitude", "y", "x")
        data: Dict[str, Any] = {
            name: (axes, values, {"units": self._about[name][0], "long_name": self._about[name][1]})
            for name, values in self.layers.items()
        }
        data["cell_state"] = (axes[1:], self.state, {"flag_meanings": " ".join(s.replace(" ", "_") for s in CELL_STATES)})
        coordinates = {
            "time": ("time", self.times, {"standard_name": "time"}),
            "altitude": ("altitude", self.altitudes_m, {"units": "m"}),
            "y": ("y", self.north_m, {"units": "m", "standard_name": "projection_y_coordinate"}),
            "x": ("x", self.east_m, {"units": "m", "standard_name": "projection_x_coordinate"}),
        }
        return xarray.Dataset(data, coordinates, {"Conventions": "CF-1.10", "source": f"Canyon {_canyon.__version__}"})

    def write(self, path: "str | os.PathLike[str]", format: Optional[str] = None) -> None:
        """Writes the map like `canyon heatmap`.

        Parameters
        ----------
        path : path
            A file for NetCDF, a folder for the others.
        format : {"netcdf", "geotiff", "png"}, optional
            "netcdf" for names with extension .nc, else "png".
        """
        name = os.fspath(path)
        if self._tiles.handle is None:
            raise InputError("a pickled map has no tiles", "write it in the process that made it, or use to_xarray()")
        self._tiles.handle.write(name, format or ("netcdf" if name.endswith(".nc") else "png"))


def heatmap(
    scenario: Union[Scenario, Settings],
    city: Optional[City] = None,
    *,
    box: Optional[Sequence[float]] = None,
    spacing_m: float = 2.0,
    altitudes_m: Union[float, Sequence[float], None] = None,
    altitude_kind: str = "terrain",
    times: Any = None,
    layers: Sequence[str] = (),
    model: Optional[str] = None,
    receiver: str = "",
    draws: int = 64,
    receivers: str = "steady_state",
    path_nodes_m: float = 6.0,
    limits: Optional[Mapping[str, Any]] = None,
    threads: int = 0,
    folder: "str | os.PathLike[str] | None" = None,
) -> HeatMap:
    """A map of a receiver's errors, visibility and DOP at every cell.

    Parameters
    ----------
    scenario : Scenario, dict or path
        Its city, sky and a receiver; needs no trajectory.
    city : City, optional
        Instead of the scenario's own.
    box : (west_m, south_m, east_m, north_m), optional
        Part of the city's frame; else the built-up area.
    spacing_m : float
        Width of a cell.
    altitudes_m : float or sequence, optional
        Of the antenna, above the terrain, or above the ellipsoid (`altitude_kind`). Default: the trajectory's height
        above the terrain, else 15.
    times : optional
        One or several instants, or text as for ``canyon heatmap --times``; else the scenario's start.
    layers : sequence of str
        Of :func:`map_layers`, or "all" (except rtk_...); default: error without noise, satellites in sight, HDOP.
    model : str, optional
        Model level instead of the scenario's propagation: "mirror", "specular", ...
    draws : int
        Number of noise samples, for layers over samples.
    receivers : {"steady_state", "run"}
        State of receivers with signal strength in cells: the steady state of their loops and
        fixes, or a run for each, about twelve times slower (docs/heatmap.md).
    path_nodes_m : float
        With "steady_state", spacing of the points for which far paths are searched; 0: every cell.
    limits : mapping, optional
        Limits of layers for planners: "error_m", "alert_m", "protection_factor", "rtk_s"
        (docs/heatmap.md).
    folder : path, optional
        Stores finished tiles: the same call continues from them.

    Raises
    ------
    Interrupted
        On Ctrl-C, with the finished tiles as ``result``.

    Examples
    --------
    >>> import canyon
    >>> scenario = canyon.Scenario(
    ...     city={"synthetic": {"blocks_east": 2, "blocks_north": 2, "seed": 7},
    ...           "origin": {"latitude_deg": 22.3, "longitude_deg": 114.17, "height_m": 0}},
    ...     start="2026-06-01T08:00:00Z", sky={"systems": ["GPS"]})
    >>> sky = canyon.heatmap(scenario, spacing_m=10, altitudes_m=2, layers=["satellites_los"])
    >>> sky["satellites_los"].shape == (1, 1) + sky.state.shape[1:]
    True
    """
    altitudes = [float(a) for a in np.atleast_1d(altitudes_m)] if altitudes_m is not None else []
    handle = _canyon.Map(
        scenario, city, box, spacing_m, altitudes,
        altitude_kind, times, list(layers), model or "", receiver, draws, receivers, path_nodes_m, dict(limits or {}),
    )
    kept = None if folder is not None else tempfile.TemporaryDirectory(prefix="canyon-map-")
    finished = handle.run(os.fspath(folder) if folder is not None else os.path.join(kept.name, "tiles"), threads)  # type: ignore[union-attr]
    result = HeatMap(handle, kept)
    if not finished:
        raise Interrupted("interrupted: the map has holes", result)
    return result
