"""One receiver driven step by step by one's own simulator."""

from __future__ import annotations

from typing import Any, Dict, List, Mapping, Optional, Sequence, Union

from . import _canyon
from .city import City
from .models import Models

__all__ = ["LiveReceiver"]


class LiveReceiver:
    """A receiver in a world whose time and motion are the caller's. Same steps, same numbers.

    ``observe(seconds, position, velocity=None, yaw=0.0, yaw_rate=0.0, paths=False)`` computes one epoch: `seconds` since
    `start`, `position` of the antenna east, north, up of the city [m], `velocity` likewise [m/s], `yaw` [rad] from east
    counter-clockwise. A time before the last one begins anew. The epoch has ``solved``, ``position`` (latitude [deg],
    longitude [deg], height [m]; None without a fix), ``reason``, ``error_enu_m``, ``truth``, ``used``, ``table("satellites")``.

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

    def __init__(
        self,
        city: City,
        start: Any = None,
        *,
        faults: Optional[Sequence[Union[str, Mapping[str, Any]]]] = None,
        models: Optional[Models] = None,
        **settings: Any,
    ) -> None:
        self._handle = _canyon.LiveReceiver(settings, city._handle, start, list(faults or []), models)
        self.observe = self._handle.observe  # each microsecond counts

    def lose(self, seconds: float) -> "_canyon.Epoch":
        """One epoch of an antenna that nobody knows the place of: no signal, no fix."""
        return self._handle.lose(seconds)

    def restart(self) -> None:
        """As constructed."""
        self._handle.restart()

    def change(self, changes: Optional[Mapping[str, Any]] = None, /, **keys: Any) -> None:
        """Other options from the next step on (any key but ``sky``, ``start``, ``name``); begins anew."""
        self._handle.change({**(changes or {}), **keys})

    def add_fault(self, fault: Union[str, Mapping[str, Any]]) -> str:
        """Something goes wrong from now on: an item of a scenario's ``faults:``. Returns its name."""
        return self._handle.add_fault(fault)

    def end_fault(self, name: str) -> None:
        """Ends a fault before the next step."""
        self._handle.end_fault(name)

    @property
    def options(self) -> Dict[str, str]:
        """dict: Options that :meth:`change` takes, with dots in their names, and their values as text."""
        return dict(line.split(": ", 1) for line in self._handle.options().splitlines())

    def take_warnings(self) -> List[str]:
        """Warnings since the last call."""
        return self._handle.take_warnings()

    def encoder(self, format: str, interval_s: float = 1.0) -> "_canyon.Encoder":
        """Makes bytes of epochs: `begin()`, `encode(epoch)` of each, `end()`. See :func:`canyon.formats`."""
        return self._handle.encoder(format, interval_s)
