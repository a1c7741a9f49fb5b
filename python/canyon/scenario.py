"""Scenarios: the settings of a simulation, as in docs/scenario.md."""

from __future__ import annotations

import os
from typing import Any, Mapping, Union

from ._canyon import Scenario, as_scenario, fault_kinds, profiles, scenario_keys

__all__ = ["Scenario", "as_scenario", "fault_kinds", "profiles", "scenario_keys"]

Settings = Union[str, "os.PathLike[str]", Mapping[str, Any]]
