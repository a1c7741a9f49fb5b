"""Recordings of real receivers beside simulated ones."""

from __future__ import annotations

import os
from dataclasses import dataclass
from typing import Any, Dict, List, Optional, Sequence, Tuple, Union

from . import _canyon
from .scenario import Scenario, Settings, as_scenario

__all__ = ["Calibration", "Recording", "calibrate"]


class Recording:
    """A recorded drive with its scenario: city, sky, true positions (docs/methods.md).

    Parameters
    ----------
    scenario : Scenario, dict or path
    obs : path
        RINEX observations.
    truth : path, optional
        True positions; else the scenario's trajectory file.
    truth_format : {"csv", "urbannav", "nmea"}, optional
    atmosphere : bool
        Whether the pseudoranges hold the atmosphere's delays, as those of real receivers do.
    """

    def __init__(
        self,
        scenario: Union[Scenario, Settings],
        obs: "str | os.PathLike[str]",
        truth: "str | os.PathLike[str] | None" = None,
        truth_format: str = "",
        *,
        atmosphere: bool = True,
    ) -> None:
        self._handle = _canyon.Recording(
            as_scenario(scenario)._handle, os.fspath(obs), "" if truth is None else os.fspath(truth), truth_format, "",
            atmosphere,
        )

    def __len__(self) -> int:
        return self._handle.epoch_count

    @property
    def warnings(self) -> List[str]:
        """list of str: What is worth saying about the files."""
        return self._handle.warnings

    def align(self, share: float = 0.5, heading: bool = False, threads: int = 0) -> Dict[str, Any]:
        """Moves the city to where the first `share` of the recording fits it best; what follows uses that.

        Returns
        -------
        dict
            Offsets, their standard deviations and scores, as `canyon validate --align --json` has them.
        """
        result: Dict[str, Any] = self._handle.align(share, heading, threads)
        return result

    def validate(
        self, part: Tuple[float, float] = (0.0, 1.0), models: Sequence[str] = (), threads: int = 0
    ) -> Dict[str, Any]:
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
        result: Dict[str, Any] = self._handle.validate(part[0], part[1], list(models), threads)
        return result


@dataclass
class Calibration:
    """What recordings show of a receiver.

    Attributes
    ----------
    estimates : list of dict
        Of each key: value before and after, interval, verdict, and what it is based on.
    values : dict
        Keys that were fitted, and their values as text.
    notes : list of str
        What does not fit.
    profile : str
        The profile, YAML; a scenario's ``profile:`` takes a file of it.
    """

    estimates: List[Dict[str, Any]]
    values: Dict[str, str]
    notes: List[str]
    profile: str


def calibrate(
    recordings: Union[Recording, Sequence[Recording]],
    part: Tuple[float, float] = (0.0, 0.5),
    *,
    seeds: int = 3,
    threads: int = 0,
) -> Calibration:
    """Fits the options of a receiver to what such receivers recorded (docs/calibration.md).

    Parameters
    ----------
    recordings : Recording or sequence
        All of one kind of receiver; the profile that is fitted is that of the first one's scenario.
    part : (float, float)
        Shares of the recordings to learn from; validate by the rest.
    seeds : int
        That each receiver is simulated by, at least 1.
    """
    several = [recordings] if isinstance(recordings, Recording) else list(recordings)
    return Calibration(
        **_canyon.calibrate([each._handle for each in several], part[0], part[1], seeds, threads)
    )
