"""Scenarios: what to simulate, as docs/scenario.md has it."""

from __future__ import annotations

import os
from typing import Any, Dict, List, Mapping, Optional, Union

from . import _canyon

__all__ = ["Scenario", "fault_kinds", "profiles", "scenario_keys"]

Settings = Union[str, "os.PathLike[str]", Mapping[str, Any]]


def _plain(settings: Mapping[str, Any]) -> Dict[str, Any]:
    return {key: value for key, value in settings.items()}


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

    def __init__(self, source: Union[str, Mapping[str, Any], None] = None, /, **keys: Any) -> None:
        if isinstance(source, str):
            handle = _canyon.Scenario.from_text(source)
            self._handle = handle.changed(keys) if keys else handle
        else:
            self._handle = _canyon.Scenario.from_settings({**_plain(source or {}), **keys})

    @classmethod
    def _of(cls, handle: "_canyon.Scenario") -> "Scenario":
        scenario = cls.__new__(cls)
        scenario._handle = handle
        return scenario

    @classmethod
    def load(cls, path: "str | os.PathLike[str]", **changes: Any) -> "Scenario":
        """Reads a scenario file.

        Parameters
        ----------
        path : path
            A YAML file; names of files in it belong to its folder.
        **changes
            Keys laid over the file's, as in :meth:`changed`.
        """
        handle = _canyon.Scenario.from_file(os.fspath(path))
        return cls._of(handle.changed(changes) if changes else handle)

    def changed(self, changes: Optional[Mapping[str, Any]] = None, /, **keys: Any) -> "Scenario":
        """The scenario with other keys: mappings are merged key by key, anything else is replaced."""
        return Scenario._of(self._handle.changed({**_plain(changes or {}), **keys}))

    @property
    def settings(self) -> Dict[str, Any]:
        """dict: The keys as they were given, without defaults."""
        settings: Dict[str, Any] = self._handle.settings()
        return settings

    @property
    def yaml(self) -> str:
        """str: The effective scenario: profiles resolved, every default written out."""
        return self._handle.yaml()

    @property
    def receivers(self) -> List[str]:
        """list of str: Names of the receivers."""
        return self._handle.receivers

    @property
    def seed(self) -> int:
        """int: Seed of all noise."""
        return self._handle.seed

    @property
    def warnings(self) -> List[str]:
        """list of str: What the text says that may be meant otherwise."""
        return self._handle.warnings

    def __repr__(self) -> str:
        source = self._handle.file or "settings"
        return f"<canyon.Scenario of {source}: {', '.join(self.receivers)}>"


def as_scenario(scenario: Union["Scenario", Settings]) -> Scenario:
    """A scenario of what may stand for one: a file's name, YAML text of several lines, a dict."""
    if isinstance(scenario, Scenario):
        return scenario
    if isinstance(scenario, Mapping) or (isinstance(scenario, str) and "\n" in scenario):
        return Scenario(scenario)
    return Scenario.load(scenario)


def scenario_keys() -> List[Dict[str, str]]:
    """All keys of scenarios: path, unit, default, values and meaning of each.

    Examples
    --------
    >>> import canyon
    >>> next(key for key in canyon.scenario_keys() if key["path"] == "duration_s")["unit"]
    's'
    """
    return _canyon.scenario_keys()


def fault_kinds() -> List[Dict[str, Any]]:
    """What can go wrong on purpose (docs/faults.md): name, summary, example and keys of each kind.

    Examples
    --------
    >>> import canyon
    >>> "outage" in [kind["name"] for kind in canyon.fault_kinds()]
    True
    """
    return _canyon.fault_kinds()


def profiles() -> Dict[str, str]:
    """The receivers that come with Canyon: name to description (docs/profiles.md).

    Examples
    --------
    >>> import canyon
    >>> "ublox-m10" in canyon.profiles()
    True
    """
    return _canyon.profiles()
