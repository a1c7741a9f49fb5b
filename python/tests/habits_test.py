"""Daily use in Python: tables made once, pickles, process pools, and the import described in docs/python.md."""

import copy
import multiprocessing
import os
import pathlib
import pickle
import re
import subprocess
import sys
import tempfile
import time
import unittest

import numpy as np

import canyon
from support import CITY

PLACE = {
    "city": {"open": True, "origin": {"latitude_deg": 48.1, "longitude_deg": 11.6, "height_m": 560}},
    "start": "2026-06-01T08:00:00Z", "duration_s": 2, "trajectory": {"position": {"east_m": 0, "north_m": 0, "up_m": 2}},
}


def drive(seed):
    return canyon.simulate({**PLACE, "seed": seed}, paths=True)


def mapped(city):
    return canyon.heatmap({**PLACE, "city": CITY}, city, spacing_m=20, layers=["hdop", "sky_view"])


def refused(_):
    raise canyon.InputError("no such street", "take another", "map.osm", 7)


class Tables(unittest.TestCase):
    def test_are_made_once_and_cannot_be_written_into(self):
        run = drive(1)
        for name in ("epochs", "satellites", "signals", "paths"):
            self.assertIs(getattr(run, name), run.table(name))
            self.assertIs(getattr(run, name), run.table(name, "rover"))
        for column, values in run.epochs.items():
            with self.assertRaisesRegex(ValueError, "read-only", msg=column):
                values[0] = values[0]
        changed = run.epochs["error_east_m"].copy()
        changed[0] = 99.0

    def test_of_pandas_and_xarray_may_be_changed(self):
        try:
            import pandas  # noqa: F401
            import xarray  # noqa: F401
        except ImportError:
            self.skipTest("pandas or xarray is missing")
        run = drive(1)
        before = run.epochs["error_east_m"][0]
        run.to_pandas().loc[0, "error_east_m"] = 99.0
        run.to_xarray()["error_east_m"][0] = 99.0
        self.assertEqual(run.epochs["error_east_m"][0], before)

    def test_a_wrong_column_is_told_with_the_right_one(self):
        with self.assertRaisesRegex(KeyError, "did you mean 'error_east_m'"):
            drive(1).epochs["error_est_m"]
        self.assertNotIn("error_est_m", drive(1).epochs)

    def test_a_loop_over_rows_is_linear(self):
        run = canyon.simulate({**PLACE, "duration_s": 100, "rate_hz": 10})
        run.epochs
        begin = time.process_time()
        for i in range(1000):
            run.epochs["error_east_m"][i]
        self.assertLess(time.process_time() - begin, 1)  # it took 4 ms each

    def test_epochs_and_cities_give_arrays_that_cannot_be_written_into(self):
        epoch = drive(1).epochs_of()[0]
        for name in ("error_enu_m", "position_ecef_m", "truth_ecef_m", "covariance_enu_m2"):
            self.assertFalse(getattr(epoch, name).flags.writeable, name)
        city = canyon.City(**CITY)
        self.assertIs(city.objects, city.objects)
        self.assertIs(city.summary, city.summary)


class Pickles(unittest.TestCase):
    def same(self, a, b):
        self.assertEqual(a, b)
        self.assertEqual(hash(a), hash(b))
        self.assertEqual((a.yaml, a.settings, repr(a)), (b.yaml, b.settings, repr(b)))

    def test_scenarios(self):
        for scenario in (
            canyon.Scenario(PLACE, receivers=[{"name": "007", "profile": "ublox-m10"}], seed=3),
            canyon.Scenario.load("examples/synthetic_drive.yaml", seed=7),
        ):
            again = pickle.loads(pickle.dumps(scenario))
            self.same(scenario, again)
            self.same(scenario, copy.deepcopy(scenario))
            self.same(scenario.changed(duration_s=1), again.changed(duration_s=1))
            self.assertNotEqual(scenario, again.changed(seed=8))
        named = canyon.Scenario(PLACE, receivers=[{"name": "007"}])
        self.assertEqual(canyon.Scenario(named.settings).receivers, ["007"])

    def test_files_of_scenarios_stay_in_their_folder(self):
        track = "time_s,latitude_deg,longitude_deg,height_m\n0,48.1,11.6,562\n2,48.1,11.60001,562\n"
        with tempfile.TemporaryDirectory() as folder:
            pathlib.Path(folder, "track.csv").write_text(track)
            settings = {**PLACE, "trajectory": {"file": "track.csv"}}
            home = os.getcwd()
            os.chdir(folder)
            try:
                pathlib.Path("drive.yaml").write_text(canyon.Scenario(settings).yaml)
                scenarios = [canyon.Scenario(settings), canyon.Scenario.load("drive.yaml")]
                kept = [(pickle.dumps(each), len(canyon.simulate(each))) for each in scenarios]
            finally:
                os.chdir(home)
            for scenario, epochs in kept:
                self.assertEqual(len(canyon.simulate(pickle.loads(scenario))), epochs)

    def test_runs(self):
        run = drive(2)
        again = pickle.loads(pickle.dumps(run))
        self.assertEqual((repr(again.summaries), again.warnings, again.receivers, len(again), repr(again)),
                         (repr(run.summaries), run.warnings, run.receivers, len(run), repr(run)))
        for name in ("epochs", "satellites", "signals", "paths"):
            self.assertEqual(list(run.table(name)), list(again.table(name)))
            for column, values in run.table(name).items():
                np.testing.assert_array_equal(values, again.table(name)[column])
                self.assertFalse(again.table(name)[column].flags.writeable)
        self.assertEqual(again.epochs.units, run.epochs.units)
        for call in (again.epochs_of, lambda: again.write("somewhere.nmea")):
            with self.assertRaisesRegex(canyon.InputError, "pickled run has no epochs"):
                call()
        with tempfile.TemporaryDirectory() as folder:
            copy.deepcopy(run).write(f"{folder}/copy.nmea")
            copy.copy(run).write(f"{folder}/copy.obs")
            self.assertEqual(len(os.listdir(folder)), 2)
        stopped = pickle.loads(pickle.dumps(canyon.Interrupted("interrupted", run)))
        self.assertEqual((str(stopped), len(stopped.result)), ("interrupted", len(run)))

    def test_cities_and_maps(self):
        city = canyon.City(**CITY)
        again = pickle.loads(pickle.dumps(city))
        self.assertEqual((again.name, again.notes, again.origin, again.objects), (city.name, city.notes, city.origin, city.objects))
        for name in ("vertices", "triangles", "materials"):
            np.testing.assert_array_equal(getattr(city, name), getattr(again, name))
        one = mapped(city)
        other = pickle.loads(pickle.dumps(mapped(copy.deepcopy(city))))
        for layer, values in one.layers.items():
            np.testing.assert_array_equal(values, other[layer])
        self.assertEqual(repr(one), repr(other))
        with self.assertRaisesRegex(canyon.InputError, "pickled map has no tiles"):
            other.write("somewhere.nc")
        with tempfile.TemporaryDirectory() as folder:
            twin = copy.deepcopy(one)
            del one  # the tiles exist as long as they can be written
            twin.write(f"{folder}/map.nc")
            self.assertEqual(os.listdir(folder), ["map.nc"])

    def test_a_map_begins_with_the_path(self):
        with tempfile.TemporaryDirectory() as folder:
            pathlib.Path(folder, "path.csv").write_text(
                "time,latitude,longitude,height\n2026-06-01T08:00:00Z,22.3,114.17,2\n2026-06-01T08:00:09Z,22.3001,114.17,2\n")
            scenario = {"city": CITY, "trajectory": {"file": f"{folder}/path.csv"}}
            chart = canyon.heatmap(scenario, spacing_m=40, layers=["hdop"])
            self.assertEqual(chart.times[0], np.datetime64("2026-06-01T08:00:00"))

    def test_skies(self):
        sky = canyon.Sky(PLACE["start"], systems=["GPS"], place=(48.1, 11.6, 560))
        city = canyon.City(**CITY)
        seen = [canyon.trace(city, [[0, 0, 2]], each, PLACE["start"]) for each in (sky, pickle.loads(pickle.dumps(sky)))]
        self.assertEqual(*(repr(each.tolist()) for each in seen))

    def test_epochs_say_what_to_take(self):
        with self.assertRaisesRegex(TypeError, "use its table"):
            pickle.dumps(drive(1).epochs_of())

    def test_simulations(self):
        simulation = canyon.Simulation(PLACE, canyon.City(**CITY))
        again = copy.deepcopy(simulation)
        np.testing.assert_array_equal(simulation.run().epochs["error_east_m"], again.run().epochs["error_east_m"])

    def test_pools_of_processes(self):
        here = [drive(seed) for seed in (1, 2)]  # the engine's threads run before the fork
        for method in ("fork", "spawn"):
            with multiprocessing.get_context(method).Pool(2) as pool:
                there = pool.map_async(drive, [1, 2]).get(120)
                for a, b in zip(here, there):
                    np.testing.assert_array_equal(a.epochs["error_east_m"], b.epochs["error_east_m"])
                lengths = pool.map_async(canyon.simulate, [canyon.Scenario(PLACE)]).get(120)
                self.assertEqual(len(lengths[0]), 3)
                with self.assertRaises(canyon.InputError) as caught:
                    pool.map_async(refused, [1]).get(120)
                error = caught.exception
                self.assertEqual((error.problem, error.cure, error.file, error.line), ("no such street", "take another", "map.osm", 7))


class Import(unittest.TestCase):
    def test_the_pages_way(self):
        """The block of docs/python.md, unchanged; apt and cmake are stubs, the build folder is this one."""
        source = pathlib.Path.cwd()
        block = re.search(r"## Install\n\n(?:<!--[^\n]*\n\n?)?```sh\n(.*?)```", (source / "docs/python.md").read_text(), re.S)[1]
        package = pathlib.Path(canyon.__file__).parent
        with tempfile.TemporaryDirectory() as name:
            folder = pathlib.Path(name)
            for part in ("run", "cmake"):
                (folder / part).symlink_to(source / part)
            for stub, text in {
                "apt": "", "dpkg-query": "echo install ok installed",
                # The requested target exists from then on.
                "cmake": f'[ "$1" != --build ] || for t in "$@"; do [ "$t" != canyon_python ] || ln -s {package.parent} "$2"/python; done',
            }.items():
                (folder / "bin").mkdir(exist_ok=True)
                (folder / "bin" / stub).write_text(f"#!/bin/sh\n{text}\n")
                (folder / "bin" / stub).chmod(0o755)
            (folder / "build-release").mkdir()
            (folder / "build-release/build.ninja").write_text("build canyon_python: phony\n")
            environment = {**os.environ, "PATH": f"{folder}/bin:{os.environ['PATH']}"}
            for variable in ("PYTHONPATH", "CANYON_BUILD"):
                environment.pop(variable, None)
            done = subprocess.run(["bash", "-ec", block.replace("/usr/bin/python3", sys.executable)], cwd=folder, env=environment,
                                  capture_output=True, text=True, timeout=60)
            self.assertEqual(done.returncode, 0, done.stderr)

    def test_without_the_engine_it_says_what_to_do(self):
        package = pathlib.Path(canyon.__file__).parent
        for extension, words in ((None, "'./run build' builds it"), ("_canyon.cpython-26-x86_64-linux-gnu.so", "another Python")):
            with tempfile.TemporaryDirectory() as folder:
                copied = pathlib.Path(folder, "canyon")
                copied.mkdir()
                for file in package.glob("*.py"):
                    (copied / file.name).write_text(file.read_text())
                if extension:
                    (copied / extension).touch()
                done = subprocess.run([sys.executable, "-c", "import canyon"], env={**os.environ, "PYTHONPATH": folder},
                                      cwd=folder, capture_output=True, text=True, timeout=60)
                self.assertIn("ImportError: the engine is", done.stderr)
                self.assertIn(words, done.stderr)


if __name__ == "__main__":
    unittest.main()
