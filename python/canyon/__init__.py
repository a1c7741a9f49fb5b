"""Canyon: an emulator of GNSS reception in cities.

A drive through a synthetic downtown, and its error:

>>> import canyon
>>> scenario = canyon.Scenario(
...     city={"synthetic": {"blocks_east": 4, "blocks_north": 4, "seed": 7},
...           "origin": {"latitude_deg": 22.3, "longitude_deg": 114.17, "height_m": 0}},
...     start="2026-06-01T08:00:00Z",
...     trajectory={"waypoints": [{"east_m": -76, "north_m": 0}, {"east_m": 76, "north_m": 0}],
...                 "speed_mps": 8, "height_above_terrain_m": 1.5},
... )
>>> run = canyon.simulate(scenario)
>>> len(run), run.epochs.units["error_horizontal_m"]
(20, 'm')
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Tuple

try:
    import numpy as _numpy  # noqa: F401  _canyon needs it; its own error has less detail
except ImportError as error:
    raise ImportError(
        "canyon needs NumPy: 'pip install numpy', or your system's package python3-numpy, or use the Python for which it "
        "was built (/usr/bin/python3 for packages)"
    ) from error

from ._command import use_bundle

use_bundle()
try:
    from . import _canyon
except ImportError as error:
    from importlib.machinery import EXTENSION_SUFFIXES

    folder = Path(__file__).parent
    if any((folder / f"_canyon{suffix}").exists() for suffix in EXTENSION_SUFFIXES):
        raise  # it exists, but a dependency is missing
    found = ", ".join(file.name for file in folder.glob("_canyon.*.so"))
    raise ImportError(
        f"the engine is built for another Python than {sys.executable}: {found}; use /usr/bin/python3" if found else
        f"the engine is not in {folder}: './run build' builds it with pybind11-dev, python3-dev and python3-numpy"
    ) from error

from ._canyon import Encoder, Epoch, ReceiverRunner, __version__, formats
from .city import PLACEMENTS, City, CityObject
from .errors import InputError, Interrupted, OutputError
from .heatmap import CELL_STATES, HeatMap, heatmap, map_layers
from .models import Arrival, Disturbance, Models, Problem, Solver
from .recordings import Calibration, Recording, calibrate
from .samples import sample_blocks, samples
from .scenario import Scenario, fault_kinds, profiles, scenario_keys
from .simulation import (
    Barometer,
    Correlation,
    Inertial,
    Magnetometer,
    Run,
    Simulation,
    Wheels,
    correlation,
    simulate,
)
from .sky import PATH_KINDS, VISIBILITIES, Sky, Tracer, trace
from .tables import Table

LiveReceiver = ReceiverRunner  # its former name

__all__ = [
    "Arrival",
    "Barometer",
    "CELL_STATES",
    "Calibration",
    "Disturbance",
    "HeatMap",
    "Models",
    "Problem",
    "Recording",
    "Solver",
    "calibrate",
    "heatmap",
    "map_layers",
    "City",
    "CityObject",
    "Encoder",
    "Correlation",
    "Inertial",
    "Magnetometer",
    "Wheels",
    "Epoch",
    "InputError",
    "Interrupted",
    "LiveReceiver",
    "MATERIALS",
    "OutputError",
    "PATH_KINDS",
    "PLACEMENTS",
    "ReceiverRunner",
    "Run",
    "Scenario",
    "Simulation",
    "Sky",
    "Table",
    "Tracer",
    "VISIBILITIES",
    "__version__",
    "correlation",
    "fault_kinds",
    "formats",
    "profiles",
    "sample_blocks",
    "samples",
    "scenario_keys",
    "simulate",
    "trace",
]

MATERIALS: Tuple[str, ...] = tuple(_canyon.material_names())
"""Meanings of the numbers of :attr:`City.materials`."""
