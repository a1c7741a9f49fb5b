import os
from typing import Any, Dict, Iterator, List, Mapping, Optional, Sequence, Tuple, Union
import numpy as np
from numpy.typing import ArrayLike, NDArray
from .city import CityObject
__version__: str
_Path = Union[str, 'os.PathLike[str]']

class Scenario:
    """A checked scenario: city, sky, trajectory, receivers.

    Parameters
    ----------
    source : dict or str, optional
        The keys of docs/scenario.md as a dict, or as YAML text. Values may be NumPy scalars and arrays,
        ``datetime`` and paths. Names of files belong to the working folder.
    **keys
        Further keys, laid over `source`: mappings key by key, anything else replaced.

    Raises
    ------
    InputError
        For unknown keys (with the closest known one), wrong types, values out of range, and missing files.

    Examples
    --------
    >>> import canyon
    >>> scenario = canyon.Scenario(
    ...     city={"open": True, "origin": {"latitude_deg": 48.1, "longitude_deg": 11.6, "height_m": 520}},
    ...     start="2026-06-01T08:00:00Z",
    ...     duration_s=10,
    ...     trajectory={"position": {"east_m": 0, "north_m": 0, "up_m": 1.5}},
    ...     receivers=[{"name": "base", "profile": "survey"}],
    ... )
    >>> scenario.receivers
    ['base']
    >>> scenario.changed(seed=7).seed
    7
    """

    def __init__(self, source: Union[str, Mapping[str, Any], None]=None, /, **keys: Any) -> None:
        ...

    @staticmethod
    def load(path: _Path, **changes: Any) -> Scenario:
        """Reads a scenario file.

        Parameters
        ----------
        path : path
            A YAML file; names of files in it belong to its folder.
        **changes
            Keys laid over the file's, as in :meth:`changed`.
        """
        ...

    def changed(self, changes: Optional[Mapping[str, Any]]=None, /, **keys: Any) -> Scenario:
        """The scenario with other keys: mappings are merged key by key, anything else is replaced."""
        ...

    @property
    def settings(self) -> Dict[str, Any]:
        """dict: The keys as they were given, without defaults."""
        ...

    @property
    def yaml(self) -> str:
        """str: The effective scenario: profiles resolved, every default written out."""
        ...

    @property
    def receivers(self) -> List[str]:
        """list of str: Names of the receivers."""
        ...

    @property
    def seed(self) -> int:
        """int: Seed of all noise."""
        ...

    @property
    def warnings(self) -> List[str]:
        """list of str: Warnings about keys that may be meant otherwise."""
        ...

def as_scenario(scenario: Union[Scenario, _Path, Mapping[str, Any]]) -> Scenario:
    """A scenario from a scenario, a file's name, YAML text of several lines, or a dict."""
    ...

class City:
    """A city: static surfaces in the east-north-up frame about its origin [m].

    Parameters
    ----------
    **settings
        The keys below ``city:`` in a scenario (docs/scenario.md): ``mesh``, ``file``, ``osm``, ``synthetic``
        or ``open``, and those that belong to them.

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
        ...

    @staticmethod
    def load(path: _Path, origin: Optional[Sequence[float]]=None) -> City:
        """A city of any file that Canyon reads, by its name.

        Parameters
        ----------
        path : path
            OpenStreetMap, CityJSON, mesh, Gazebo world, or Canyon's own file (docs/city.md).
        origin : (latitude_deg, longitude_deg, height_m), optional
            The place of a mesh's zero, or the zero that a map shall get.
        """
        ...

    @staticmethod
    def from_osm(files: Union[_Path, Sequence[_Path]], **settings: Any) -> City:
        """A city of OpenStreetMap files.

        Parameters
        ----------
        files : path or list of paths
            OpenStreetMap (.osm, .osm.gz, .osm.bz2, .osm.pbf) or CityJSON.
        **settings
            Further keys below ``city:``: ``origin``, ``bbox``, ``terrain``, ... (docs/city.md).
        """
        ...

    @staticmethod
    def of_scenario(scenario: Union[Scenario, _Path, Mapping[str, Any]]) -> City:
        """The city of a scenario: facades drawn and place moved as its seed says."""
        ...

    def save(self, path: _Path) -> None:
        """Writes Canyon's own city file (.canyon), which loads quickly."""
        ...

    @property
    def name(self) -> str:
        """str: The name that the source gives it."""
        ...

    @property
    def notes(self) -> List[str]:
        """list of str: Everything that the import dropped, guessed or repaired."""
        ...

    @property
    def origin(self) -> Tuple[float, float, float]:
        """tuple: (latitude_deg, longitude_deg, height_m) of the frame's zero, WGS 84."""
        ...

    @property
    def summary(self) -> Dict[str, Any]:
        """dict: buildings, triangles, highest_roof_m, built_area_fraction [1], min_enu_m, max_enu_m, ..."""
        ...

    @property
    def objects(self) -> List[CityObject]:
        """list of CityObject: They cover all triangles, in order."""
        ...

    @property
    def vertices(self) -> NDArray[np.float64]:
        """(n, 3) array [m]: East, north, up. The engine's own memory, read-only."""
        ...

    @property
    def triangles(self) -> NDArray[np.uint32]:
        """(m, 3) array: Indices into :attr:`vertices`, counter-clockwise from outside. Read-only, not copied."""
        ...

    @property
    def materials(self) -> NDArray[np.uint8]:
        """(m,) array: Index into :data:`canyon.MATERIALS` of each triangle. Read-only, not copied."""
        ...

    def object_of(self, triangle: int) -> CityObject:
        """The CityObject that a triangle belongs to, by its index into :attr:`triangles`."""
        ...

    def placement(self, places: ArrayLike) -> NDArray[np.uint8]:
        """Whether places (n, 3), east, north, up [m], are free, inside a building or under the terrain: indices into :data:`canyon.PLACEMENTS`."""
        ...

    def terrain(self, places: ArrayLike) -> NDArray[np.float64]:
        """Height of the terrain [m] at places, NaN where there is none. The places' heights do not matter."""
        ...

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
        ...

    def enu_of(self, places: ArrayLike) -> NDArray[np.float64]:
        """East, north, up [m] of (latitude_deg, longitude_deg, height_m), (3,) or (n, 3)."""
        ...

    def geodetic_of(self, enu: ArrayLike) -> NDArray[np.float64]:
        """(latitude_deg, longitude_deg, height_m) of east, north, up [m], (3,) or (n, 3)."""
        ...

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
        The keys below ``sky:`` in a scenario: ``navigation``, ``sp3``, ``nominal``, ``frozen``, ``systems``.

    Examples
    --------
    >>> import canyon
    >>> sky = canyon.Sky("2026-06-01T08:00:00Z", systems=["GPS"])
    >>> look = sky.look("2026-06-01T08:00:00Z", (48.1, 11.6, 520))
    >>> look["elevation_rad"].shape == (1, len(sky.satellites))
    True
    """

    def __init__(self, begin: Any, end: Any=None, place: Optional[Sequence[float]]=None, **settings: Any) -> None:
        ...

    @property
    def satellites(self) -> List[str]:
        """list of str: "G01", "E05", ..., those that it may know."""
        ...

    @property
    def warnings(self) -> List[str]:
        """list of str: Stale ephemerides and their like."""
        ...

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
        ...

class Tracer:
    """Traces satellites in one city. Its facets are prepared once.

    Parameters
    ----------
    city : City
    **propagation
        The keys below ``propagation:`` in a scenario: ``model``, ``reflection_order``, ...
    """

    def __init__(self, city: City, **propagation: Any) -> None:
        ...

    def at(self, places: ArrayLike, sky: Optional[Sky]=None, times: Any=None, satellites: Optional[Sequence[str]]=None, directions: Optional[ArrayLike]=None, threads: int=0, paths: bool=False) -> Any:
        """Traces at places: see :func:`canyon.trace`, whose arguments these are."""
        ...

class Epoch:
    """One receiver at one instant: the truth, and its measurements and fix."""

    @property
    def time(self) -> np.datetime64:
        """True instant, UTC."""

    @property
    def gps_ns(self) -> int:
        """Nanoseconds of GPS time since 1980-01-06."""

    @property
    def receiver(self) -> int:
        ...

    @property
    def solved(self) -> bool:
        ...

    @property
    def status(self) -> str:
        ...

    @property
    def reason(self) -> str:
        """Why there is no fix."""
        ...

    @property
    def truth(self) -> Tuple[float, float, float]:
        """(latitude_deg, longitude_deg, height_m) of the antenna."""

    @property
    def position(self) -> Optional[Tuple[float, float, float]]:
        """(latitude_deg, longitude_deg, height_m) as the receiver believes; None without a fix."""

    @property
    def position_ecef_m(self) -> NDArray[np.float64]:
        ...

    @property
    def truth_ecef_m(self) -> NDArray[np.float64]:
        ...

    @property
    def error_enu_m(self) -> NDArray[np.float64]:
        """Fix minus truth; NaN without a fix."""

    @property
    def covariance_enu_m2(self) -> NDArray[np.float64]:
        ...

    @property
    def velocity_enu_mps(self) -> Optional[NDArray[np.float64]]:
        ...

    @property
    def used(self) -> int:
        ...

    @property
    def visible(self) -> int:
        ...

    @property
    def blocked(self) -> int:
        ...

    @property
    def placement(self) -> str:
        ...

    @property
    def faults(self) -> List[str]:
        ...

    def table(self, name: str) -> Dict[str, NDArray[Any]]:
        """Columns of this epoch alone: "epochs", "satellites", "signals", "paths"."""

class Encoder:
    """Makes bytes of epochs, as `canyon simulate` writes them."""

    def begin(self) -> bytes:
        ...

    def encode(self, epoch: Epoch) -> bytes:
        ...

    def end(self) -> bytes:
        ...

class Stream:
    """Epochs of a run, one by one."""

    def __iter__(self) -> Iterator[Epoch]:
        ...

    def __next__(self) -> Epoch:
        ...

    def close(self) -> None:
        """Ends the run."""
        ...

class SampleStream:
    """Samples of a run, block by block."""

    def __init__(self, simulation: Simulation, band: Optional[str], centre_hz: Optional[float], rate_hz: Optional[float], intermediate_hz: Optional[float], real: Optional[bool], bandwidth_hz: Optional[float], noise: Optional[bool], receiver: int, size: int, threads: int) -> None:
        ...

    def __iter__(self) -> Iterator[NDArray[Any]]:
        ...

    def __next__(self) -> NDArray[Any]:
        ...

    def close(self) -> None:
        ...

class Simulation:
    """The engine's part of :class:`canyon.Simulation`: methods with an underscore serve its functions."""

    def __init__(self, scenario: Scenario, city: Optional[City]=None, models: Any=None) -> None:
        ...

    def __len__(self) -> int:
        ...

    @property
    def interval_s(self) -> float:
        """float: From epoch to epoch [s]."""
        ...

    @property
    def begin(self) -> np.datetime64:
        """numpy.datetime64: The first epoch, UTC."""
        ...

    @property
    def warnings(self) -> List[str]:
        """list of str: Warnings before the run."""
        ...

    @property
    def receivers(self) -> List[str]:
        """list of str: Names."""
        ...

    def antenna(self, times: Any, receiver: int=0) -> NDArray[np.float64]:
        """Where a receiver's antenna is at times: east, north, up [m], (n, 3)."""
        ...

    def _run(self, threads: int, paths: bool, folder: Optional[_Path]) -> Dict[str, Any]:
        ...

    def _correlation(self, satellite: str, signal: str, receiver: int, delays_m: Sequence[float], bandwidth_hz: Optional[float], threads: int) -> Dict[str, Any]:
        ...

    def _write(self, receiver: int, epochs: List[Epoch], path: _Path, format: str) -> None:
        ...

    def encoder(self, format: str, receiver: int=0) -> Encoder:
        """Makes bytes of epochs: `begin()`, `encode(epoch)` of each, `end()`. See :func:`canyon.formats`."""
        ...

    def stream(self, threads: int=0, paths: bool=False) -> Stream:
        """Epochs of all receivers, one by one, by time and then by receiver, while the engine works ahead.

        Leaving the loop ends the run. Every call begins anew.
        """
        ...

    def __iter__(self) -> Stream:
        ...

class LiveReceiver:
    """A receiver in a world whose time and motion are the caller's. Same steps, same numbers.

    Parameters
    ----------
    city : City
    start : time, optional
        Instant of the caller's time 0; else the key ``start`` of `settings`.
    faults : list of dict, optional
        Items of a scenario's ``faults:``.
    models : Models, optional
        Own models.
    **settings
        Keys of one receiver of a scenario (``profile``, ``clock``, ...) and ``sky``, ``seed``, ``start``.

    Examples
    --------
    >>> import canyon
    >>> city = canyon.City(open=True, origin={"latitude_deg": 48.1, "longitude_deg": 11.6, "height_m": 520})
    >>> receiver = canyon.LiveReceiver(city, "2026-06-01T08:00:00Z", profile="survey")
    >>> epoch = receiver.observe(0.0, (0, 0, 1.5))
    >>> epoch.solved, epoch.placement
    (True, 'free')
    """

    def __init__(self, city: City, start: Any=None, *, faults: Optional[Sequence[Union[str, Mapping[str, Any]]]]=None, models: Any=None, **settings: Any) -> None:
        ...

    def observe(self, seconds: float, position: Any, velocity: Any=None, yaw: float=0.0, yaw_rate: float=0.0, paths: bool=False) -> Epoch:
        """One epoch `seconds` of the caller's time after the start.

        `position` is the antenna's, east, north, up [m] of the city, `velocity` likewise [m/s], `yaw` [rad] from
        east counter-clockwise, `yaw_rate` [rad/s]. A time before the last one begins anew; a place that no vehicle
        gets to in one step restarts the receiver hot, with a warning.
        """
        ...

    def lose(self, seconds: float) -> Epoch:
        """One epoch of an antenna whose place is not known: no signal, no fix."""
        ...

    def restart(self) -> None:
        """As constructed."""
        ...

    def change(self, changes: Optional[Mapping[str, Any]]=None, /, **keys: Any) -> None:
        """Other options from the next step on (any key but ``sky``, ``start``, ``name``); begins anew."""
        ...

    def add_fault(self, fault: Union[str, Mapping[str, Any]]) -> str:
        """Begins a fault now: an item of a scenario's ``faults:``. Returns its name."""
        ...

    def end_fault(self, name: str) -> None:
        """Ends a fault before the next step."""
        ...

    @property
    def options(self) -> Dict[str, str]:
        """dict: Options that :meth:`change` takes, with dots in their names, and their values as text."""
        ...

    def take_warnings(self) -> List[str]:
        """Warnings since the last call."""
        ...

    def encoder(self, format: str, interval_s: float=1.0) -> Encoder:
        """Makes bytes of epochs: `begin()`, `encode(epoch)` of each, `end()`. See :func:`canyon.formats`."""
        ...

class ArrivingPath:
    """A path of a satellite that arrives."""

    @property
    def excess_m(self) -> float:
        """Detour [m], at least 0."""
        ...

    @excess_m.setter
    def excess_m(self, value: float) -> None:
        ...

    @property
    def amplitude_factor(self) -> float:
        """Multiplies the path's amplitude, at least 0."""
        ...

    @amplitude_factor.setter
    def amplitude_factor(self, value: float) -> None:
        ...

    @property
    def kind(self) -> str:
        ...

    @property
    def order(self) -> int:
        ...

    @property
    def arrival(self) -> NDArray[np.float64]:
        """Unit vector, east, north, up, towards where it comes from."""

class ArrivingSatellite:
    """A satellite above the horizon of an antenna."""

    @property
    def name(self) -> str:
        ...

    @property
    def azimuth_rad(self) -> float:
        ...

    @property
    def elevation_rad(self) -> float:
        ...

    @property
    def visibility(self) -> str:
        ...

    @property
    def paths(self) -> List[ArrivingPath]:
        ...

    def keep_paths(self, indices: Sequence[int]) -> None:
        """These of its paths stay, in this order; the others go."""

class Arrival:
    """The signals that arrive at an antenna at one instant, valid during one call."""

    @property
    def time(self) -> np.datetime64:
        ...

    @property
    def gps_ns(self) -> int:
        ...

    @property
    def antenna_enu_m(self) -> NDArray[np.float64]:
        ...

    @property
    def velocity_ecef_mps(self) -> NDArray[np.float64]:
        ...

    @property
    def placement(self) -> str:
        ...

    @property
    def satellites(self) -> List[ArrivingSatellite]:
        ...

    def remove(self, satellite: str) -> None:
        ...

    def interfere(self, power_dbw: float, towards: Any, width_hz: float=20000000.0) -> None:
        """Adds noise about L1: its power at an isotropic antenna, and the direction (ENU) it comes from."""

class Problem:
    """Ranges of one epoch, for a solver."""

    @property
    def time(self) -> np.datetime64:
        ...

    @property
    def gps_ns(self) -> int:
        ...

    @property
    def satellites(self) -> List[str]:
        ...

    @property
    def position_ecef_m(self) -> NDArray[np.float64]:
        """(n, 3): satellites at transmission, in the Earth's axes of reception."""

    @property
    def range_m(self) -> NDArray[np.float64]:
        """(n,): pseudoranges less satellite clocks and atmosphere: distance and receiver clock, one a system."""

    @property
    def sigma_m(self) -> NDArray[np.float64]:
        ...

    @property
    def cn0_dbhz(self) -> NDArray[np.float64]:
        ...

    @property
    def doppler_hz(self) -> NDArray[np.float64]:
        ...

    @property
    def start_ecef_m(self) -> Optional[NDArray[np.float64]]:
        """The engine's own least squares; None where that has no solution."""

class Map:
    """A heat map of Python's, and its writers."""

    def __init__(self, scenario: Union[Scenario, _Path, Mapping[str, Any]], city: Optional[City], box: Any, spacing_m: float, altitudes_m: List[float], altitude_kind: str, times: Any, layers: List[str], model: str, receiver: str, draws: int, receivers: str, path_nodes_m: float, limits: Dict[str, Any]) -> None:
        ...

    def run(self, folder: str, threads: int=0) -> bool:
        ...

    def values(self) -> Dict[str, Any]:
        ...

    def write(self, path: str, format: str) -> None:
        ...

class Recording:
    """A recorded drive with its scenario: city, sky, true positions (docs/methods.md).

    Parameters
    ----------
    scenario : Scenario, dict or path
    obs : path
        Observations: RINEX, or a log of Android's GnssLogger.
    truth : path, optional
        True positions; else the scenario's trajectory file.
    truth_format : {"csv", "urbannav", "nmea", "gpx", "kml", "gnsslogger"}, optional
    atmosphere : bool
        Whether the pseudoranges hold the atmosphere's delays, as those of real receivers do.
    """

    def __init__(self, scenario: Union[Scenario, _Path, Mapping[str, Any]], obs: _Path, truth: Optional[_Path]=None, truth_format: str='', *, atmosphere: bool=True) -> None:
        ...

    def __len__(self) -> int:
        ...

    @property
    def warnings(self) -> List[str]:
        """list of str: Warnings about the files."""
        ...

    def align(self, share: float=0.5, heading: bool=False, threads: int=0) -> Dict[str, Any]:
        """Moves the city to where the first `share` of the recording fits it best; later calls use that.

        Returns
        -------
        dict
            Offsets, their standard deviations and scores, as `canyon validate --align --json` has them.
        """
        ...

    def validate(self, part: Tuple[float, float]=(0.0, 1.0), models: Sequence[str]=(), threads: int=0) -> Dict[str, Any]:
        """Simulates the receiver at the recorded epochs and compares.

        Parameters
        ----------
        part : (float, float)
            Shares of the recording that figures are of.
        models : sequence of str
            Further steps of the ladder: "mirror", "specular", ...

        Returns
        -------
        dict
            As `canyon validate --json` writes it.
        """
        ...

def calibrate(recordings: List[Recording], begin: float, end: float, seeds: int, threads: int=0) -> Dict[str, Any]:
    ...

def map_layers() -> Dict[str, Tuple[str, str]]:
    """Layers that maps may have: name to (unit, meaning)."""
    ...

def scenario_keys() -> List[Dict[str, str]]:
    """All keys of scenarios: path, unit, default, values and meaning of each.

    Examples
    --------
    >>> import canyon
    >>> next(key for key in canyon.scenario_keys() if key["path"] == "duration_s")["unit"]
    's'
    """
    ...

def fault_kinds() -> List[Dict[str, Any]]:
    """Kinds of faults (docs/faults.md): name, summary, example and keys of each.

    Examples
    --------
    >>> import canyon
    >>> "outage" in [kind["name"] for kind in canyon.fault_kinds()]
    True
    """
    ...

def profiles() -> Dict[str, str]:
    """The receivers that come with Canyon: name to description (docs/profiles.md).

    Examples
    --------
    >>> import canyon
    >>> "ublox-m10" in canyon.profiles()
    True
    """
    ...

def formats() -> Dict[str, str]:
    """Formats of results: name to the name of the file in a folder of results (docs/outputs.md).

    Examples
    --------
    >>> import canyon
    >>> canyon.formats()["nmea"]
    'receiver.nmea'
    """
    ...

def material_names() -> List[str]:
    ...

def columns(table: str) -> Dict[str, Tuple[str, str, str]]:
    ...

def table(epochs: List[Epoch], name: str) -> Dict[str, NDArray[Any]]:
    ...
