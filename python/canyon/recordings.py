"""Recordings of real receivers beside simulated ones."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Dict, List, Sequence, Tuple, Union

from . import _canyon
from ._canyon import Recording

__all__ = ["Calibration", "Recording", "calibrate"]


@dataclass
class Calibration:
    """The options of a receiver as recordings show them.

    Attributes
    ----------
    estimates : list of dict
        Of each key: value before and after, interval, verdict, and its data.
    city_estimates : list of dict
        The same of the place: the share of buildings with coated glass. Empty where the scenarios state their
        facades.
    city : dict
        What a scenario of the place says below ``city:``, ``{"facades": {"shares": [...]}}``. Empty where no
        share was fitted.
    values : dict
        Keys that were fitted, and their values as text.
    notes : list of str
        Observations that do not fit.
    profile : str
        The profile, YAML; a scenario's ``profile:`` takes a file of it.
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
    """Fits the options of a receiver to what such receivers recorded (docs/methods.md).

    Parameters
    ----------
    recordings : Recording or sequence
        All of one kind of receiver; the profile that is fitted is that of the first one's scenario.
    part : (float, float)
        Shares of the recordings to learn from; validate by the rest.
    seeds : int
        Number of seeds by which each receiver is simulated, at least 1.
    """
    several = [recordings] if isinstance(recordings, Recording) else list(recordings)
    return Calibration(**_canyon.calibrate(several, part[0], part[1], seeds, threads))
