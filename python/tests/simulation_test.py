"""Runs of scenarios: Python's results equal the command line's; invalid input raises one clear error each."""

import csv
import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import threading
import unittest

import numpy as np

import canyon

DRIVE = "examples/synthetic_drive.yaml"


class Import(unittest.TestCase):
    def test_without_numpy_it_says_so(self):
        code = "import sys; sys.modules['numpy'] = None; import canyon"
        run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
        self.assertIn("ImportError: canyon needs NumPy", run.stderr)
        self.assertIn("/usr/bin/python3", run.stderr)


class Inputs(unittest.TestCase):
    def test_no_output_replaces_one_of_its_own_run(self):
        scenario = {
            "city": {"open": True, "origin": {"latitude_deg": 48.1, "longitude_deg": 11.6, "height_m": 520}},
            "start": "2026-06-01T08:00:00Z", "duration_s": 2, "sky": {"nominal": True, "systems": ["GPS"]},
            "trajectory": {"position": {"east_m": 0, "north_m": 0, "up_m": 1.5}},
        }
        with tempfile.TemporaryDirectory() as folder:
            way, link = pathlib.Path(folder, "track.kml"), pathlib.Path(folder, "link.kml")
            first = canyon.simulate(scenario)
            first.write(way)
            whole = way.read_bytes()
            link.symlink_to(way)
            along = dict(scenario, trajectory={"file": str(way)})
            run = canyon.simulate(along)
            for write in (lambda: run.write(way), lambda: run.write(link), lambda: canyon.simulate(along, out=folder)):
                with self.assertRaisesRegex(canyon.InputError, "is an input of this run and would be replaced"):
                    write()
                self.assertEqual(way.read_bytes(), whole)
            # The previous run did not read it.
            first.write(way)
            city = pathlib.Path(folder, "a.canyon")
            canyon.City.of_scenario(dict(scenario, city={"synthetic": {"seed": 2}})).save(city)
            with self.assertRaisesRegex(canyon.InputError, "is an input of this run and would be replaced"):
                canyon.City.load(city).save(city)


class Correlation(unittest.TestCase):
    def test_is_a_triangle_in_the_open(self):
        scenario = {
            "city": {"open": True, "origin": {"latitude_deg": 48.1, "longitude_deg": 11.6, "height_m": 520}},
            "start": "2026-06-01T08:00:00Z", "duration_s": 2, "sky": {"nominal": True, "systems": ["GPS"]},
            "trajectory": {"position": {"east_m": 0, "north_m": 0, "up_m": 1.5}},
        }
        table = canyon.simulate(scenario).table("satellites")
        name = str(table["sat"][int(np.argmax(table["elevation_deg"]))])
        chip_m = 299792458 / 1.023e6
        delays = np.linspace(-chip_m, chip_m, 9)
        seen = canyon.correlation(scenario, name, delays_m=delays)
        self.assertEqual(seen.values.shape, (3, 9))
        peak = np.abs(seen.values[:, 4:5])
        np.testing.assert_allclose(np.abs(seen.values) / peak, np.tile(1 - np.abs(delays) / chip_m, (3, 1)), atol=1e-9)
        self.assertTrue((peak > 0.3).all())
        with self.assertRaisesRegex(canyon.InputError, "the sky has no satellite C62"):
            canyon.correlation(scenario, "C62")
        with self.assertRaisesRegex(canyon.InputError, "sends no signal"):
            canyon.correlation(scenario, name, signal="E1")
        with self.assertRaisesRegex(canyon.InputError, "ascend"):
            canyon.correlation(scenario, name, delays_m=[2, 1])


class Sensors(unittest.TestCase):
    SCENARIO = {
        "city": {"open": True, "origin": {"latitude_deg": 22.3, "longitude_deg": 114.17, "height_m": 5}},
        "start": "2026-06-01T08:00:00Z", "duration_s": 2, "sky": {"nominal": True},
        "trajectory": {"position": {"east_m": 0, "north_m": 0, "up_m": 95}},
        "sensors": {"wheels": {"tick_m": 0}, "barometer": {"profile": "ideal"}, "magnetometer": {"profile": "ideal"}},
    }

    def test_samples_at_rest(self):
        simulation = canyon.Simulation(self.SCENARIO)
        np.testing.assert_array_equal(simulation.wheels().true_speed, np.zeros((20, 2)))
        self.assertTrue(np.isnan(simulation.wheels().ticks).all())
        barometer = simulation.barometer()
        np.testing.assert_allclose(barometer.time_s, np.arange(1, 51) / 25)
        np.testing.assert_allclose(barometer.pressure, 100129, atol=1)  # ICAO's table: 100,129 Pa at 100 m
        np.testing.assert_allclose(barometer.altitude, barometer.true_height, atol=1e-6)
        self.assertEqual(simulation.magnetometer().field.shape, (100, 3))
        np.testing.assert_allclose(np.linalg.norm(simulation.magnetometer().field, axis=1), 45, atol=1)  # uT, Hong Kong
        with self.assertRaisesRegex(canyon.InputError, "no sensors.imu"):
            simulation.imu()

    def test_file_of_arrays_has_the_same(self):
        with tempfile.TemporaryDirectory() as folder:
            canyon.simulate({**self.SCENARIO, "outputs": ["sensors_npz"]}, out=folder)
            simulation = canyon.Simulation(self.SCENARIO)
            with np.load(f"{folder}/sensors.npz") as arrays:
                names = {"begin"}
                for sensor in ("wheels", "barometer", "magnetometer"):
                    for name, values in getattr(simulation, sensor)()._asdict().items():
                        np.testing.assert_array_equal(arrays[f"{sensor}_{name}"], values)
                        names.add(f"{sensor}_{name}")
                self.assertEqual(set(arrays), names)


class Run(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.scenario = canyon.Scenario.load(DRIVE, duration_s=20, outputs={"pictures": False})
        cls.run_ = canyon.simulate(cls.scenario)

    def test_a_file_of_the_users_stays(self):
        scenario = self.scenario.changed(duration_s=2, outputs={"pictures": False})
        with tempfile.TemporaryDirectory() as folder:
            mine = os.path.join(folder, "epochs.csv")
            with open(mine, "w") as file:
                file.write("notes")
            with self.assertRaisesRegex(canyon.InputError, "was not written by Canyon"):
                canyon.simulate(scenario, out=folder)
            os.remove(mine)
            for _ in range(2):
                canyon.simulate(scenario, out=folder)
            self.assertIn("epochs.csv", os.listdir(folder))

    def test_files_are_the_command_lines(self):
        """The sinks of `canyon simulate` and the stored epochs give the same bytes in every format."""
        with tempfile.TemporaryDirectory() as folder:
            formats = canyon.formats()
            del formats["highres_imu"]  # stored epochs have no sensor samples
            outputs = {name: True for name in formats}
            scenario = self.scenario.changed(outputs={**outputs, "pictures": False})
            run = canyon.simulate(scenario, out=folder, paths=True)
            for name, file in formats.items():
                run.write(f"{folder}/again", name)
                self.assertEqual(pathlib.Path(folder, "again").read_bytes(), pathlib.Path(folder, file).read_bytes(), name)

    def test_tables_are_the_csv_files(self):
        """Every column of every CSV file, cell by cell, to the digits in the file."""
        run = canyon.simulate(self.scenario, paths=True)
        with tempfile.TemporaryDirectory() as folder:
            for name in ("epochs", "satellites", "signals", "paths"):
                run.write(f"{folder}/{name}.csv")
                with open(f"{folder}/{name}.csv", newline="") as file:
                    rows = list(csv.DictReader(file))
                table = run.table(name)
                self.assertEqual(table.rows, len(rows))
                for column in rows[0]:
                    cells = [row[column] for row in rows]
                    if table[column].dtype.kind == "U":
                        self.assertEqual(list(table[column]), cells, column)
                        continue
                    digits = max(len(cell.partition(".")[2]) for cell in cells)
                    written = [float(cell) if cell else np.nan for cell in cells]
                    np.testing.assert_allclose(table[column], written, rtol=1e-15, atol=0.51 * 10.0**-digits, err_msg=column)
                self.assertTrue(all(table.column_attributes(column)["long_name"] for column in table))

    def test_paths_that_were_not_kept_are_an_error(self):
        with self.assertRaisesRegex(canyon.InputError, "paths=True"):
            self.run_.to_pandas("paths")
        with self.assertRaisesRegex(canyon.InputError, "paths=True"):
            self.run_.paths
        self.assertGreater(self.run_.signals.rows, 0)
        self.assertGreater(canyon.simulate(self.scenario, paths=True).paths.rows, 0)

    def test_stream_is_the_run(self):
        streamed = [epoch.error_enu_m for epoch in canyon.Simulation(self.scenario)]
        kept = [epoch.error_enu_m for epoch in self.run_.epochs_of("car")]
        np.testing.assert_array_equal(streamed, kept)

    def test_stream_may_be_left(self):
        for number, _ in enumerate(canyon.Simulation(self.scenario)):
            if number == 3:
                break

    def test_live_is_the_run(self):
        """The same poses give the same numbers, by the same code (a live receiver has independent noise)."""
        # Noise depends on the name of a live receiver, and only on the seed in a scenario.
        simulation = canyon.Simulation(self.scenario.changed(receivers=[{"name": "car", "independent_noise": True}]))
        receiver = canyon.ReceiverRunner(canyon.City.of_scenario(self.scenario), simulation.begin, name="car",
                                       sky={"nominal": True})
        begin = simulation.begin
        for number, epoch in enumerate(simulation.stream()):
            step = np.timedelta64(int(number * simulation.interval_s * 1e9), "ns")
            if number == 5:
                break
            truth = epoch.table("epochs")
            velocity = tuple(truth[f"true_velocity_{axis}_mps"][0] for axis in ("east", "north", "up"))
            live = receiver.observe(number * simulation.interval_s, simulation.antenna(begin + step)[0], velocity)
            np.testing.assert_allclose(live.error_enu_m, epoch.error_enu_m, atol=1e-3)

    def test_threads_do_not_matter(self):
        one = canyon.simulate(self.scenario, threads=1).epochs
        for name, values in self.run_.epochs.items():
            np.testing.assert_array_equal(values, one[name])

    def test_pandas_and_xarray(self):
        try:
            import pandas  # noqa: F401
            import xarray  # noqa: F401
        except ImportError:
            self.skipTest("pandas or xarray is missing")
        frame = self.run_.to_pandas("satellites")
        self.assertEqual(frame.attrs["units"]["excess_path_m"], "m")
        data = self.run_.to_xarray()
        self.assertEqual(data["true_latitude_deg"].attrs["standard_name"], "latitude")
        self.assertEqual(data.sizes["time"], len(self.run_))

    def test_no_pandas_before_it_is_asked_for(self):
        code = "import canyon, sys; sys.exit(any(m in sys.modules for m in ('pandas', 'xarray', 'gymnasium')))"
        self.assertEqual(subprocess.run([sys.executable, "-c", code]).returncode, 0)

    def test_interrupt_keeps_what_is_done(self):
        scenario = canyon.Scenario.load(DRIVE, rate_hz=100)  # half a minute of work
        timer = threading.Timer(1.5, lambda: os.kill(os.getpid(), signal.SIGINT))
        timer.start()
        with self.assertRaises(canyon.Interrupted) as caught:
            canyon.simulate(scenario)
        run = caught.exception.result
        self.assertTrue(run.interrupted)
        self.assertGreater(len(run), 0)
        self.assertEqual(run.epochs.rows, len(run))


class BadInput(unittest.TestCase):
    def wrong(self, problem, cure, call):
        with self.assertRaises(canyon.InputError) as caught:
            call()
        self.assertIn(problem, str(caught.exception))
        self.assertIn(cure, caught.exception.cure)
        return caught.exception

    def test_scenarios(self):
        load = lambda **changes: lambda: canyon.Scenario.load(DRIVE, **changes)
        self.wrong("unknown key 'systms' in 'sky'", "'systems'", load(sky={"systms": ["GPS"]}))
        self.wrong("duration_s: NaN", "remove the key", load(duration_s=float("nan")))
        self.wrong("seed: 'x' is not a whole number", "digits", load(seed="x"))
        self.wrong("receivers[].elevation_mask_deg: 95", "90", load(receivers=[{"elevation_mask_deg": 95}]))
        self.wrong("is not a setting", "numbers", load(duration_s=object()))
        self.wrong("the key 3 is not a string", "names", load(sky={3: 4}))
        loop = {}
        loop["sky"] = loop
        self.wrong("too deep", "contains itself", lambda: canyon.Scenario(loop))
        error = self.wrong("", "indentation", lambda: canyon.Scenario("city: {open: true}\nseed: [\n"))
        self.assertEqual(error.line, 3)
        error = self.wrong("no such file", "path", lambda: canyon.Scenario.load("nowhere.yaml"))
        self.assertEqual((error.file, error.line), ("nowhere.yaml", None))
        self.wrong("'trajectory' is missing", "waypoints", lambda: canyon.simulate({"city": {"synthetic": {}}, "start": "2026-06-01T08:00:00Z"}))

    def test_results(self):
        run = canyon.simulate(canyon.Scenario.load(DRIVE, duration_s=1))
        self.wrong("no table 'satelites'", "satellites", lambda: run.table("satelites"))
        self.wrong("no receiver 'bus'", "car", lambda: run.table("epochs", "bus"))
        self.wrong("has no known format extension", "nmea", lambda: run.write("somewhere.xyz"))
        self.wrong("nmae", "nmea", lambda: run.write("somewhere.xyz", "nmae"))


if __name__ == "__main__":
    unittest.main()
