"""Live receivers, heat maps and recordings."""

import os
import signal
import tempfile
import threading
import unittest

import numpy as np

import canyon
from support import CITY

START = "2026-03-01T10:00:00Z"


class Live(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.city = canyon.City(**CITY)

    def test_same_steps_same_numbers(self):
        receiver = canyon.LiveReceiver(self.city, START)
        first = [receiver.observe(t, (0, 30, 2)).error_enu_m for t in range(5)]
        again = [receiver.observe(t, (0, 30, 2)).error_enu_m for t in range(5)]  # time went back: restart
        np.testing.assert_array_equal(first, again)

    def test_faults(self):
        receiver = canyon.ReceiverRunner(self.city, START, profile="ideal")
        self.assertTrue(receiver.observe(0, (0, 0, 100)).used)
        name = receiver.add_fault({"outage": {"satellites": ["GPS", "GLONASS", "Galileo", "BeiDou"]}})
        epoch = receiver.observe(1, (0, 0, 100))
        self.assertEqual((epoch.used, epoch.faults), (0, [name]))
        receiver.end_fault(name)
        self.assertTrue(receiver.observe(2, (0, 0, 100)).used)

    def test_changes_and_encoders(self):
        receiver = canyon.ReceiverRunner(self.city, START, profile="ideal")
        before = receiver.observe(0, (0, 0, 100)).used
        receiver.change(elevation_mask_deg=40)
        self.assertEqual(receiver.options["elevation_mask_deg"], "40")
        self.assertLess(receiver.observe(1, (0, 0, 100)).used, before)
        encoder = receiver.encoder("nmea")
        sentences = encoder.begin() + encoder.encode(receiver.observe(2, (0, 0, 100)))
        self.assertTrue(sentences.startswith(b"$G"))
        # The M8 has MON-HW, the F9 MON-RF.
        epoch = receiver.observe(3, (0, 0, 100))
        for generation, message in {"m8": b"\xb5b\n\x09", "f9": b"\xb5b\n8"}.items():
            self.assertIn(message, receiver.encoder("ubx", 1.0, generation).encode(epoch))

    def test_bad_steps(self):
        receiver = canyon.ReceiverRunner(self.city, START)
        for arguments in [(0, (0, 0)), (0, (0, 0, np.nan)), (0, np.zeros((3, 3))), (np.nan, (0, 0, 2)), (0, (0, 0, 2), (1, np.inf, 0))]:
            with self.assertRaises(canyon.InputError):
                receiver.observe(*arguments)
        with self.assertRaises(canyon.InputError) as caught:
            canyon.ReceiverRunner(self.city, START, profil="ideal")
        self.assertIn("did you mean 'profile'", str(caught.exception))
        with self.assertRaises(canyon.InputError):
            canyon.ReceiverRunner(self.city)


class Maps(unittest.TestCase):
    scenario = {"city": CITY, "start": START, "receivers": [{"name": "car", "profile": "ideal", "elevation_mask_deg": 10}]}

    def test_cells_are_what_trace_says(self):
        """Satellites in sight above the mask at a cell's centre, by the map's shadows and by single rays."""
        chart = canyon.heatmap(self.scenario, spacing_m=8, altitudes_m=2, layers=["satellites_los"])
        city = canyon.City(**CITY)
        east, north = np.meshgrid(chart.east_m, chart.north_m)
        free = chart.state[0] == 0
        places = np.column_stack([east[free], north[free], np.full(free.sum(), 2.0)])
        rows = canyon.trace(city, places, canyon.Sky(START), START)
        clear = (rows["visibility"] <= 1) & rows["above_horizon"] & (rows["elevation_rad"] >= np.radians(10))
        same = clear.sum(1) == chart["satellites_los"][0, 0][free]
        self.assertGreater(same.mean(), 0.995)  # rays that graze an edge may be in either state

    def test_files_and_xarray(self):
        chart = canyon.heatmap(self.scenario, spacing_m=10, altitudes_m=[2, 30], times=[START, "2026-03-01T11:00:00Z"])
        self.assertEqual(chart["hdop"].shape[:2], (2, 2))
        with tempfile.TemporaryDirectory() as folder:
            chart.write(f"{folder}/map.nc")
            try:
                import netCDF4  # noqa: F401
                import xarray
            except ImportError:
                self.skipTest("xarray or netCDF4 is missing")
            with xarray.open_dataset(f"{folder}/map.nc") as stored:
                np.testing.assert_array_equal(stored["hdop"].values, chart["hdop"])
            self.assertEqual(chart.to_xarray()["hdop"].attrs["units"], "1")

    def test_interrupted(self):
        timer = threading.Timer(1.0, lambda: os.kill(os.getpid(), signal.SIGINT))
        timer.start()
        with self.assertRaises(canyon.Interrupted) as caught:
            canyon.heatmap(dict(self.scenario, receivers=[{"name": "car"}]), box=(-100, -100, 100, 100),
                           spacing_m=1, altitudes_m=2, receivers="run")
        self.assertIn(255, caught.exception.result.state)

    def test_bad_maps(self):
        def wrong(text, **keywords):
            with self.assertRaises(canyon.InputError) as caught:
                canyon.heatmap(self.scenario, **keywords)
            self.assertIn(text, str(caught.exception))

        wrong("hdopp", layers=["hdopp"])
        wrong("reversed or empty", box=(10, 0, -10, 5))
        wrong("four numbers", box=(10, 0))
        wrong("values", spacing_m=0.01)
        wrong("altitude_kind", altitude_kind="sea")
        wrong("model", receivers="walk")
        wrong("path_nodes_m", path_nodes_m=-1)


if __name__ == "__main__":
    unittest.main()
