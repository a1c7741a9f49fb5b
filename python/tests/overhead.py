"""The cost of Python over C++: paired runs of the same calls, one after the other. Not a test.

Times are processor times of all threads, robust to other load on the machine.

usage: overhead.py BUILD_FOLDER [PAIRS]     (ninja canyon_python simulation_trace_places_bench)
"""

import json
import statistics
import subprocess
import sys
import time

import numpy as np

import canyon

build = sys.argv[1]
pairs = int(sys.argv[2]) if len(sys.argv) > 2 else 7
NOON = "2026-06-01T12:00:00Z"
city = canyon.City(
    synthetic={"blocks_east": 8, "blocks_north": 8, "seed": 7},
    origin={"latitude_deg": 22.3, "longitude_deg": 114.17, "height_m": 0},
)


def in_cpp(name, repetitions, of=statistics.median):
    out = subprocess.run(
        [f"{build}/bin/simulation_trace_places_bench", f"--benchmark_filter={name}", "--benchmark_format=json",
         f"--benchmark_repetitions={repetitions}", "--benchmark_min_time=0.01"],
        capture_output=True, check=True, text=True,
    ).stdout
    runs = [b for b in json.loads(out)["benchmarks"] if b["run_type"] == "iteration"]
    return of(b["cpu_time"] for b in runs) * {"ms": 1e-3, "us": 1e-6}[runs[0]["time_unit"]]


def report(name, cpp, python):
    ratios = [p / c for c, p in zip(cpp, python)]
    differences = [(p - c) * 1e6 for c, p in zip(cpp, python)]
    print(f"{name}: C++ {statistics.median(cpp) * 1e3:.3f} ms, Python {statistics.median(python) * 1e3:.3f} ms; "
          f"of {len(ratios)} pairs the median ratio is {statistics.median(ratios):.3f} "
          f"({min(ratios):.3f} to {max(ratios):.3f}), the median difference {statistics.median(differences):+.1f} us", flush=True)


sky = canyon.Sky(NOON)
up = np.flatnonzero(sky.look(NOON, tuple(city.geodetic_of([0, 0, 2])))["elevation_rad"][0] > 0)[:30]
satellites = [sky.satellites[i] for i in up]
k = np.arange(10_000)
places = np.stack([456 * (0.6180339887 * k % 1) - 228, 456 * (0.7548776662 * k % 1) - 228, np.full(len(k), 2.0)], 1)
tracer = canyon.Tracer(city)


def trace_once():
    begin = time.process_time()
    tracer.at(places, sky, NOON, satellites)
    return time.process_time() - begin


def observe_many(where, count=600):
    receiver = canyon.ReceiverRunner(where, NOON, profile="ublox-m10", independent_noise=False)
    begin = time.process_time()
    for i in range(count):
        t = 0.1 * i
        receiver.observe(t, (0.0, t % 60, 2.0), (0.0, 1.0, 0.0)).error_enu_m
    return (time.process_time() - begin) / count


def plain_run(**models):
    scenario = canyon.Scenario.load("examples/synthetic_drive.yaml", outputs={"pictures": False})
    simulation = canyon.Simulation(scenario, models=canyon.Models(**models))
    begin = time.process_time()
    simulation.run()
    return time.process_time() - begin


class Nothing:
    def apply(self, arrival):
        for satellite in arrival.satellites:
            satellite.elevation_rad


class Engine:
    def solve(self, problem):
        return problem.start_ecef_m


cpp, python = [], []
for _ in range(pairs):
    cpp.append(in_cpp("TenThousandPlaces", 3))
    python.append(statistics.median(trace_once() for _ in range(3)))
report("trace of 10,000 places x 30 satellites", cpp, python)
open_field = canyon.City(open=True, origin={"latitude_deg": 22.3, "longitude_deg": 114.17, "height_m": 0})
for name, title, where in [("ObserveDowntown", "downtown", city), ("ObserveOpenField", "in an open field", open_field)]:
    cpp, python = [], []
    for _ in range(pairs):
        # The minimum of several: cache effects of other programs would hide a difference of microseconds.
        cpp.append(in_cpp(name, 8, min))
        python.append(min(observe_many(where) for _ in range(8)))
    report(f"observe() and its error, {title}", cpp, python)
for name, models in {
    "a disturbance that looks at every satellite": {"disturbances": [Nothing()]},
    "a weighting": {"weighting": lambda satellite, elevation, cn0, sigma: sigma},
    "a solver": {"solver": Engine()},
}.items():
    ratios = [plain_run(**models) / plain_run() for _ in range(pairs)]
    print(f"{name}: a run takes {statistics.median(ratios):.2f} times as long ({min(ratios):.2f} to {max(ratios):.2f})", flush=True)
