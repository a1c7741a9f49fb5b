"""Recordings of real receivers, compared with simulated ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, List, Sequence, Tuple, Union

from . import _canyon
from ._canyon import Recording

__all__ = ["Calibration", "Recording", "calibrate"]


@dataclass
class Calibration:
    """The options of a receiver, estimated from recordings.

    Attributes
    ----------
    estimates : list of dict
        For each key: value before and after, interval, verdict, and its data.
    city_estimates : list of dict
        The same for the city: the fraction of buildings with coated glass. Empty if the scenarios set their
        facades.
    city : dict
        Keys of a scenario in this city below ``city:``, ``{"facades": {"shares": [...]}}``. Empty if no
        fraction was fitted.
    values : dict
        Fitted keys, and their values as text.
    notes : list of str
        Observations that do not fit.
    profile : str
        The profile, YAML; a scenario's ``profile:`` accepts a file with it.
    """

    estimates: List[Dict[str, Any]]
    city_estimates: List[Dict[str, Any]]
    city: Dict[str, Any]
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
    """Fits the options of a receiver to recordings of such receivers (docs/methods.md).

    Parameters
    ----------
    recordings : Recording or sequence
        All of one kind of receiver; the fitted profile is that of the first one's scenario.
    part : (float, float)
        Fractions of the recordings for fitting; use the rest for validation.
    seeds : int
        Number of simulated seeds for each receiver, at least 1.
    """
    several = [recordings] if isinstance(recordings, Recording) else list(recordings)
    return Calibration(**_canyon.calibrate(several, part[0], part[1], seeds, threads))
