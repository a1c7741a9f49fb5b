"""User models instead of the engine's: disturbances, antenna, weights, position solver."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Callable, Optional, Protocol, Sequence, Tuple, Union

from . import _canyon

__all__ = ["Arrival", "Disturbance", "Models", "Problem", "Solver"]

Arrival = _canyon.Arrival
Problem = _canyon.Problem


class Disturbance(Protocol):
    """Changes the signals of an epoch before they reach the receiver.

    An object may also have ``begin(seed, receiver)``, called at the beginning of a run.
    """

    def apply(self, arrival: Arrival) -> None:
        """Called once per epoch, in order of time. `arrival` is valid during the call."""


class Solver(Protocol):
    """Computes a position from an epoch's ranges. May have ``begin(seed, receiver)``."""

    def solve(self, problem: Problem) -> Any:
        """The antenna's ECEF position [m], three numbers; None: no fix."""


Factory = Callable[[int, str], Any]


@dataclass
class Models:
    """Python objects that replace parts of a receiver, in runs and live.

    Attributes
    ----------
    disturbances : sequence of Disturbance
        In this order; or their factories ``make(seed, receiver)``.
    antenna : callable, optional
        ``antenna(elevation_rad, carrier_hz) -> (rhcp_dbic, lhcp_dbic)``: sampled once at each degree, near L1
        and near L2; used if signals have strength.
    weighting : callable, optional
        ``weighting(satellite, elevation_rad, cn0_dbhz, sigma_m) -> sigma_m``: the standard deviation used to
        weight a pseudorange [m], above 0. C/N0 is NaN if there is none.
    solver : Solver, optional
        Instead of the engine's least squares of an epoch; or a factory ``make(seed, receiver)``. A position filter
        starts from it and remains the receiver's own: ``position_filter: {enabled: false}`` publishes the solver's positions.

    Examples
    --------
    >>> import canyon
    >>> class Roof:
    ...     '''Hides all satellites below 45 degrees.'''
    ...     def apply(self, arrival):
    ...         for satellite in arrival.satellites:
    ...             if satellite.elevation_rad < 0.785:
    ...                 arrival.remove(satellite.name)
    >>> scenario = canyon.Scenario(
    ...     city={"open": True, "origin": {"latitude_deg": 48.1, "longitude_deg": 11.6, "height_m": 520}},
    ...     start="2026-06-01T08:00:00Z", duration_s=2,
    ...     trajectory={"position": {"east_m": 0, "north_m": 0, "up_m": 1.5}})
    >>> below = canyon.simulate(scenario, models=canyon.Models(disturbances=[Roof()]))
    >>> bool(below.satellites["elevation_deg"].min() > 44.9)
    True
    """

    disturbances: Sequence[Union[Disturbance, Factory]] = field(default_factory=tuple)
    antenna: Optional[Callable[[float, float], Tuple[float, float]]] = None
    weighting: Optional[Callable[[str, float, float, float], float]] = None
    solver: Union[Solver, Factory, None] = None
