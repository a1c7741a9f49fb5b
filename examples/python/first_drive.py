"""A first drive: a car through a synthetic downtown, and its receiver's results."""

import tempfile

import numpy as np

import canyon

scenario = canyon.Scenario(
    city={
        "synthetic": {"blocks_east": 8, "blocks_north": 8, "max_height_m": 200, "seed": 7},
        "origin": {"latitude_deg": 22.3, "longitude_deg": 114.17, "height_m": 0},
    },
    sky={"systems": ["GPS", "Galileo"]},
    start="2026-06-01T08:00:00Z",
    trajectory={
        "waypoints": [
            {"east_m": -228, "north_m": 0},
            {"east_m": 0, "north_m": 0},
            {"east_m": 0, "north_m": 152},
            {"east_m": 228, "north_m": 152},
        ],
        "speed_mps": 8,
        "height_above_terrain_m": 1.5,
    },
    receivers=[{"name": "car"}, {"name": "survey", "profile": "survey"}],
)
run = canyon.simulate(scenario)
print(f"{len(run)} epochs of {run.receivers}")
for figures in run.summaries:
    print(f"{figures['receiver']:8} fixes {figures['fixes']:4}  horizontal error: median {figures['horizontal_p50_m']:5.1f} m, "
          f"95 % {figures['horizontal_p95_m']:5.1f} m")

# Tables are columns of NumPy arrays; converted to pandas and xarray if these are installed.
epochs, satellites = run.epochs, run.satellites
worst = int(np.nanargmax(epochs["error_horizontal_m"]))
print(f"worst at {epochs['time'][worst]}: {epochs['error_horizontal_m'][worst]:.1f} m with {epochs['used'][worst]} satellites")
nlos = satellites["visibility"] == "NLOS"
print(f"{nlos.mean():.0%} of the satellites arrive by reflections alone, "
      f"{np.nanmedian(satellites['excess_path_m'][nlos]):.0f} m too long (median)")
try:
    by_satellite = run.to_pandas("satellites").groupby("sat")["pseudorange_error_m"].median()
    print("largest median pseudorange error:", by_satellite.idxmax(), f"{by_satellite.max():.1f} m")
except ImportError:
    pass

with tempfile.TemporaryDirectory() as folder:
    for name in ["car.obs", "car.nmea", "car.ubx", "sky.nav"]:
        run.write(f"{folder}/{name}", receiver="car")
    print(open(f"{folder}/car.nmea").readline().strip())
