"""Runs of whole scenarios."""

from __future__ import annotations

import functools
import os
from typing import Any, Dict, List, Mapping, NamedTuple, Optional, Sequence, Tuple, Union

import numpy as np
from numpy.typing import NDArray

from . import _canyon
from ._canyon import City, Epoch, Scenario, as_scenario
from .errors import InputError, Interrupted
from .models import Models
from .scenario import Settings
from .tables import Table

__all__ = [
    "Barometer",
    "Correlation",
    "Epoch",
    "Inertial",
    "Magnetometer",
    "Run",
    "Simulation",
    "Wheels",
    "correlation",
    "simulate",
]


class Correlation(NamedTuple):
    """Outputs of a channel's correlators for one satellite. Arrays are NumPy's."""

    time_s: NDArray[np.float64]  #: from the run's beginning [s], (epochs,)
    delay_m: NDArray[np.float64]  #: relative to the line of sight [m], (delays,)
    values: NDArray[np.complex128]  #: relative to a clear line of sight at an isotropic antenna, (epochs, delays)
    measured_m: NDArray[np.float64]  #: delay of the code loop [m], (epochs,); NaN while the signal is not tracked


class Inertial(NamedTuple):
    """Samples of an inertial sensor, n of them. Arrays are NumPy's; axes are the sensor's (``sensors.imu.axes``)."""

    time_s: NDArray[np.float64]  #: end of the sample's interval, from the run's beginning [s], (n,)
    stated_s: NDArray[np.float64]  #: the time reported by the sensor [s], (n,); NaN: lost sample
    specific_force: NDArray[np.float64]  #: measured [m/s^2], (n, 3); NaN: lost sample
    angular_rate: NDArray[np.float64]  #: measured [rad/s], (n, 3); NaN: lost sample
    true_specific_force: NDArray[np.float64]  #: mean over the interval [m/s^2], (n, 3)
    true_angular_rate: NDArray[np.float64]  #: mean over the interval, against inertial space [rad/s], (n, 3)
    place: NDArray[np.float64]  #: position of the sensor at `time_s`: latitude, longitude [deg], height [m], (n, 3)
    velocity: NDArray[np.float64]  #: east, north, up [m/s], (n, 3)
    attitude: NDArray[np.float64]  #: roll (left side up), pitch (nose up), heading from north, clockwise [deg], (n, 3)
    temperature: NDArray[np.float64]  #: of the sensor [K], (n,); NaN: lost sample


class Wheels(NamedTuple):
    """Samples of ``sensors.wheels``, n of them; columns are left and right. Arrays are NumPy's."""

    time_s: NDArray[np.float64]  #: end of the sample's interval, from the run's beginning [s], (n,)
    speed: NDArray[np.float64]  #: measured [m/s], (n, 2)
    ticks: NDArray[np.float64]  #: counted since the beginning, (n, 2); NaN without ticks
    true_speed: NDArray[np.float64]  #: mean over the interval [m/s], (n, 2)


class Barometer(NamedTuple):
    """Samples of ``sensors.barometer``, n of them. Arrays are NumPy's, (n,)."""

    time_s: NDArray[np.float64]  #: from the run's beginning [s]
    pressure: NDArray[np.float64]  #: measured [Pa]
    altitude: NDArray[np.float64]  #: with this pressure in the standard atmosphere [m]
    temperature: NDArray[np.float64]  #: of the air [K]
    sensor_temperature: NDArray[np.float64]  #: of the sensor [K]
    true_pressure: NDArray[np.float64]  #: of the air [Pa]
    true_height: NDArray[np.float64]  #: of the sensor above mean sea level [m]


class Magnetometer(NamedTuple):
    """Samples of ``sensors.magnetometer``, n of them. Arrays are NumPy's; axes are the sensor's."""

    time_s: NDArray[np.float64]  #: from the run's beginning [s], (n,)
    field: NDArray[np.float64]  #: measured [uT], (n, 3)
    true_field: NDArray[np.float64]  #: the Earth's [uT], (n, 3)


class _Epochs:
    """The epochs of a run, and their tables, each made once. Copies share them; a pickle has only the tables."""

    def __init__(
        self, receivers: List[str], tables: Sequence[str], simulation: "Optional[Simulation]",
        epochs: List[List[Epoch]], made: Dict[Tuple[int, str], Table],
    ) -> None:
        self.receivers, self.tables, self.simulation, self._epochs, self._made = receivers, tables, simulation, epochs, made

    def of(self, receiver: int) -> List[Epoch]:
        if self.simulation is None:
            raise InputError("a pickled run has no epochs", "use its tables, or write files in the process of the run")
        return self._epochs[receiver]

    def table(self, name: str, receiver: int) -> Table:
        if (receiver, name) not in self._made:
            if name == "paths" and name not in self.tables:
                raise InputError("the run has not stored its paths", "run it with paths=True")
            about = {"receiver": self.receivers[receiver], "source": f"Canyon {_canyon.__version__}"}
            _canyon.columns(name)  # an unknown name is the first error
            self._made[receiver, name] = Table(name, _canyon.table(self.of(receiver), name), about)
        return self._made[receiver, name]

    def __deepcopy__(self, memo: Any) -> "_Epochs":
        return self

    def __reduce__(self) -> Tuple[Any, ...]:
        for receiver in range(len(self.receivers)):
            for name in self.tables:
                self.table(name, receiver)
        return _Epochs, (self.receivers, self.tables, None, [], self._made)


class Run:
    """Results of the receivers of a scenario, epoch by epoch.

    A run can be pickled with its tables and metrics, without its epochs.

    Attributes
    ----------
    receivers : list of str
    warnings : list of str
        Warnings about the run.
    summaries : list of dict
        Metrics of each receiver by the names of docs/reference/columns.md: fixes, percentiles of errors [m], fractions [1], ...
    interrupted : bool
        Whether Ctrl-C ended it early.
    wall_s : float
        Wall time of the engine [s].
    """

    def __init__(self, simulation: "Simulation", result: Dict[str, Any], paths: bool = False) -> None:
        tables = ("epochs", "satellites", "signals") + (("paths",) if paths else ())
        self._count = len(result["epochs"][0])
        self.receivers = simulation.receivers
        self._epochs = _Epochs(self.receivers, tables, simulation, result["epochs"], {})
        self.summaries: List[Dict[str, Any]] = result["summaries"]
        self.warnings: List[str] = result["warnings"]
        self.interrupted: bool = result["interrupted"]
        self.wall_s: float = result["wall_s"]

    def _index(self, receiver: Union[int, str]) -> int:
        return index_of_receiver(receiver, self.receivers)

    def epochs_of(self, receiver: Union[int, str] = 0) -> List[Epoch]:
        """The epochs of a receiver, in order."""
        return self._epochs.of(self._index(receiver))

    def table(self, name: str = "epochs", receiver: Union[int, str] = 0) -> Table:
        """A table of a receiver, made once.

        Parameters
        ----------
        name : {"epochs", "satellites", "signals", "paths"}
            Paths exist if the run stored them (``paths=True``); else :class:`canyon.InputError`.
        receiver : int or str
            Index or name.
        """
        return self._epochs.table(name, self._index(receiver))

    @property
    def epochs(self) -> Table:
        """Table: Truth, fix, error and DOP of the first receiver's epochs."""
        return self.table("epochs")

    @property
    def satellites(self) -> Table:
        """Table: Every satellite above the horizon at every epoch of the first receiver."""
        return self.table("satellites")

    @property
    def signals(self) -> Table:
        """Table: Every signal of the first receiver's satellites at every epoch."""
        return self.table("signals")

    @property
    def paths(self) -> Table:
        """Table: Every path to the first receiver at every epoch; of a run with ``paths=True``."""
        return self.table("paths")

    @property
    def summary(self) -> Dict[str, Any]:
        """dict: Metrics of the first receiver, by the names of docs/reference/columns.md."""
        return self.summaries[0]

    def to_pandas(self, name: str = "epochs", receiver: Union[int, str] = 0) -> Any:
        """A table as a ``pandas.DataFrame``."""
        return self.table(name, receiver).to_pandas()

    def to_xarray(self, name: str = "epochs", receiver: Union[int, str] = 0) -> Any:
        """A table as an ``xarray.Dataset`` with units and CF names."""
        return self.table(name, receiver).to_xarray()

    def write(
        self, path: "str | os.PathLike[str]", format: Optional[str] = None, receiver: Union[int, str] = 0
    ) -> None:
        """Writes a receiver's epochs like `canyon simulate`; the file is complete or absent.

        Parameters
        ----------
        path : path
            Extensions define the default format: .obs, .rnx, .nmea, .ubx, .rtcm3, .kml, .geojson, .nav,
            and the names of docs/reference/columns.md.
        format : str, optional
            One of :func:`canyon.formats`, or "navigation".
        receiver : int or str
        """
        index = self._index(receiver)
        epochs = self._epochs.of(index)
        assert self._epochs.simulation is not None
        self._epochs.simulation._write(index, epochs, path, format or "")

    def __len__(self) -> int:
        return self._count

    def __repr__(self) -> str:
        return f"<canyon.Run: {len(self)} epochs of {', '.join(self.receivers)}>"


def index_of_receiver(receiver: Union[int, str], known: Sequence[str]) -> int:
    """Index of a receiver from its number or name."""
    if isinstance(receiver, str):
        if receiver not in known:
            raise InputError(f"the run has no receiver '{receiver}'", f"use one of {', '.join(known)}")
        return known.index(receiver)
    return range(len(known))[receiver]


class Simulation(_canyon.Simulation):
    """A prepared scenario: city loaded, sky selected, trajectory checked against both.

    Parameters
    ----------
    scenario : Scenario, dict or path
    city : City, optional
        A city shared by several simulations, instead of the scenario's own.
    models : Models or dict, optional
        User models for all receivers, or by receivers' names.

    Examples
    --------
    >>> import canyon
    >>> simulation = canyon.Simulation({
    ...     "city": {"open": True, "origin": {"latitude_deg": 48.1, "longitude_deg": 11.6, "height_m": 520}},
    ...     "start": "2026-06-01T08:00:00Z", "duration_s": 4,
    ...     "trajectory": {"position": {"east_m": 0, "north_m": 0, "up_m": 1.5}},
    ... })
    >>> [epoch.solved for epoch in simulation]
    [True, True, True, True, True]
    """

    def __init__(
        self,
        scenario: Union[Scenario, Settings],
        city: Optional[City] = None,
        *,
        models: Union[Models, Mapping[str, Models], None] = None,
    ) -> None:
        self.scenario = as_scenario(scenario)
        own = dict(models) if isinstance(models, Mapping) else models
        self._given = city, own
        super().__init__(self.scenario, city, own)

    def __reduce__(self) -> Tuple[Any, ...]:
        city, models = self._given
        return functools.partial(Simulation, models=models), (self.scenario, city)

    def run(self, threads: int = 0, paths: bool = False, out: "str | os.PathLike[str] | None" = None) -> Run:
        """Computes the complete run.

        Parameters
        ----------
        threads : int
            0: as many as cores. Results do not depend on it.
        paths : bool
            Store every path of every satellite: some kilobytes per epoch.
        out : path, optional
            A folder for the files requested in the scenario's ``outputs:``.

        Raises
        ------
        Interrupted
            On Ctrl-C, with the epochs until then as ``result``; files in `out` are complete.
        """
        result = Run(self, self._run(threads, paths, out), paths)
        if result.interrupted:
            raise Interrupted(f"interrupted: {len(result)} of {len(self)} epochs finished", result)
        return result

    def imu(self) -> Inertial:
        """The samples of the scenario's ``sensors.imu`` over the run, and the true motion.

        Raises
        ------
        InputError
            If the scenario has no ``sensors.imu``.

        Examples
        --------
        >>> import canyon
        >>> still = canyon.Simulation({
        ...     "city": {"open": True, "origin": {"latitude_deg": 48.1, "longitude_deg": 11.6, "height_m": 520}},
        ...     "start": "2026-06-01T08:00:00Z", "duration_s": 2,
        ...     "trajectory": {"position": {"east_m": 0, "north_m": 0, "up_m": 1.5}},
        ...     "sensors": {"imu": {"profile": "ideal", "rate_hz": 100}},
        ... }).imu()
        >>> still.specific_force.shape
        (200, 3)
        >>> still.specific_force[0].round(3).tolist()
        [0.0, 0.0, 9.807]
        """
        return Inertial(**self._sensor("imu"))

    def wheels(self) -> Wheels:
        """The samples of the scenario's ``sensors.wheels``; raises InputError if it has none."""
        return Wheels(**self._sensor("wheels"))

    def barometer(self) -> Barometer:
        """The samples of the scenario's ``sensors.barometer``; raises InputError if it has none."""
        return Barometer(**self._sensor("barometer"))

    def magnetometer(self) -> Magnetometer:
        """The samples of the scenario's ``sensors.magnetometer``; raises InputError if it has none."""
        return Magnetometer(**self._sensor("magnetometer"))


def simulate(
    scenario: Union[Scenario, Settings],
    city: Optional[City] = None,
    *,
    models: Union[Models, Mapping[str, Models], None] = None,
    threads: int = 0,
    paths: bool = False,
    out: "str | os.PathLike[str] | None" = None,
) -> Run:
    """Runs a scenario: :class:`Simulation` and its :meth:`~Simulation.run` in one call.

    Examples
    --------
    >>> import canyon
    >>> run = canyon.simulate({
    ...     "city": {"open": True, "origin": {"latitude_deg": 48.1, "longitude_deg": 11.6, "height_m": 520}},
    ...     "start": "2026-06-01T08:00:00Z", "duration_s": 4,
    ...     "trajectory": {"position": {"east_m": 0, "north_m": 0, "up_m": 1.5}},
    ... })
    >>> run.summary["fixes"], run.epochs.units["error_east_m"]
    (5, 'm')
    >>> list(run.epochs["status"][:2])
    ['fix', 'fix']
    """
    return Simulation(scenario, city, models=models).run(threads, paths, out)


def correlation(
    scenario: Union[Scenario, Settings],
    satellite: str,
    city: Optional[City] = None,
    *,
    signal: str = "",
    receiver: int = 0,
    delays_m: Sequence[float] = (),
    bandwidth_hz: Optional[float] = None,
    threads: int = 0,
) -> Correlation:
    """Correlation function of a satellite's signal over a run, with all its paths.

    Parameters
    ----------
    satellite : str
        "G05", "E11", "C23".
    signal : str
        "L1CA", "E5a", "B1I"; default: the signal near L1.
    delays_m : sequence of float
        Ascending [m]; default: 301 from one chip before the line of sight to two after it.
    bandwidth_hz : float, optional
        Two-sided, of the front end; default: unlimited.

    Raises
    ------
    InputError
        For a satellite that is not in the sky, and a signal that the satellite does not send.

    Examples
    --------
    >>> import canyon
    >>> seen = canyon.correlation({
    ...     "city": {"open": True, "origin": {"latitude_deg": 48.1, "longitude_deg": 11.6, "height_m": 520}},
    ...     "start": "2026-06-01T08:00:00Z", "duration_s": 4, "sky": {"systems": ["GPS"]},
    ...     "trajectory": {"position": {"east_m": 0, "north_m": 0, "up_m": 1.5}},
    ... }, "G01")
    >>> seen.values.shape
    (5, 301)
    """
    found = Simulation(scenario, city)._correlation(
        satellite, signal, receiver, list(delays_m), bandwidth_hz, threads
    )
    return Correlation(**found)
