"""The radio signal of a run as samples (docs/iq.md)."""

from __future__ import annotations

import warnings
from typing import Any, Iterator, Optional, Union

import numpy as np
from numpy.typing import NDArray

from . import _canyon
from .city import City
from .scenario import Scenario, Settings, as_scenario
from .simulation import Simulation, index_of_receiver

__all__ = ["sample_blocks", "samples"]


def sample_blocks(
    scenario: Union[Scenario, Settings],
    city: Optional[City] = None,
    *,
    band: Optional[str] = None,
    rate_hz: Optional[float] = None,
    intermediate_hz: Optional[float] = None,
    real: Optional[bool] = None,
    bandwidth_hz: Optional[float] = None,
    noise: Optional[bool] = None,
    duration_s: Optional[float] = None,
    receiver: Union[int, str] = 0,
    block: int = 1 << 18,
    threads: int = 0,
    if_hz: Optional[float] = None,
) -> Iterator[NDArray[Any]]:
    """The signal at a receiver's antenna, block by block, computed a few blocks ahead.

    Leaving the loop ends the run; a run of any length needs only the memory of some blocks. The samples are those of
    ``canyon iq`` before quantisation. Other parameters are those of :func:`samples`.

    Parameters
    ----------
    block : int
        Samples of a block; the last one is shorter.

    Examples
    --------
    >>> import canyon
    >>> scenario = {
    ...     "city": {"open": True, "origin": {"latitude_deg": 48.1, "longitude_deg": 11.6, "height_m": 520}},
    ...     "start": "2026-06-01T08:00:00Z", "sky": {"systems": ["GPS"]},
    ...     "trajectory": {"position": {"east_m": 0, "north_m": 0, "up_m": 1.5}},
    ... }
    >>> [len(block) for block in canyon.sample_blocks(scenario, rate_hz=2e6, duration_s=1, block=750_000)][:2]
    [750000, 750000]
    """
    if if_hz is not None:
        warnings.warn("if_hz is now intermediate_hz; the old name will be removed", FutureWarning, stacklevel=2)
        intermediate_hz = if_hz
    scenario = as_scenario(scenario)
    if duration_s is not None:
        scenario = scenario.changed(duration_s=duration_s)
    simulation = Simulation(scenario, city)
    number = index_of_receiver(receiver, simulation.receivers)
    return _canyon.SampleStream(
        simulation, band, rate_hz, intermediate_hz, real, bandwidth_hz, noise, number, block, threads
    )


def samples(
    scenario: Union[Scenario, Settings],
    city: Optional[City] = None,
    *,
    band: Optional[str] = None,
    rate_hz: Optional[float] = None,
    intermediate_hz: Optional[float] = None,
    real: Optional[bool] = None,
    bandwidth_hz: Optional[float] = None,
    noise: Optional[bool] = None,
    duration_s: Optional[float] = None,
    receiver: Union[int, str] = 0,
    threads: int = 0,
    if_hz: Optional[float] = None,
) -> NDArray[Any]:
    """The signal at a receiver's antenna in a band: ``complex64``, with noise of standard deviation 1 in each part.

    Default options are those of the scenario's ``samples``, by default band L1 at 4 million samples per second.

    Parameters
    ----------
    band : str, optional
        "L1", "L2", "L5", "E5", or a signal's name.
    rate_hz : float, optional
        Samples per second of the receiver's clock.
    intermediate_hz : float, optional
        Frequency of the band's centre in the samples [Hz]. ``if_hz`` is its former name.
    real : bool, optional
        Real samples, ``float32``; they need an intermediate frequency.
    bandwidth_hz : float, optional
        Two-sided, of a filter before the converter [Hz].
    noise : bool, optional
        The front end's noise.
    duration_s : float, optional
        Instead of the scenario's [s]. A minute at 4 million samples per second is 1.9 GB:
        :func:`sample_blocks` needs less memory.
    receiver : int or str
        Number or name.

    Raises
    ------
    InputError
        If the samples contain no signal of the sky, and for frequencies that alias.

    Examples
    --------
    >>> import canyon
    >>> x = canyon.samples({
    ...     "city": {"open": True, "origin": {"latitude_deg": 48.1, "longitude_deg": 11.6, "height_m": 520}},
    ...     "start": "2026-06-01T08:00:00Z", "sky": {"systems": ["GPS"]},
    ...     "trajectory": {"position": {"east_m": 0, "north_m": 0, "up_m": 1.5}},
    ... }, band="L1", rate_hz=2e6, duration_s=1)
    >>> x.dtype, 1.0 < float(x.real.std()) < 1.2
    (dtype('complex64'), True)
    """
    blocks = sample_blocks(
        scenario, city, band=band, rate_hz=rate_hz, intermediate_hz=intermediate_hz, real=real,
        bandwidth_hz=bandwidth_hz, noise=noise, duration_s=duration_s, receiver=receiver, threads=threads, if_hz=if_hz,
    )
    return np.concatenate(list(blocks))
