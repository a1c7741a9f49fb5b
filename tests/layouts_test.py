#!/usr/bin/env python3
"""examples/layouts.py on a run of canyon simulate.

usage: tests/layouts_test.py CANYON [unittest's options]
"""
import pathlib
import subprocess
import sys
import tempfile
import unittest

try:
    import numpy as np
except ImportError:
    sys.exit(77)

ROOT = pathlib.Path(__file__).resolve().parents[1]

# To the north-east, then north, with half of the samples lost before the estimator.
SCENARIO = """
city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: -70.5, height_m: 0}}
sky: {nominal: true}
start: 2026-06-01T06:00:00Z
trajectory:
  waypoints: [{east_m: 0, north_m: 0, up_m: 7}, {east_m: 40, north_m: 40, up_m: 9}, {east_m: 40, north_m: 80, up_m: 9}]
  speed_mps: 10
  acceleration_mps2: 2
sensors:
  imu: {profile: ideal, rate_hz: 100, axes: frd, lost: %s}
outputs: {sensors_npz: true}
"""


class LayoutsTest(unittest.TestCase):
    def made(self, lost="0"):
        self.folder = pathlib.Path(self.enterContext_(tempfile.TemporaryDirectory()))
        (self.folder / "drive.yaml").write_text(SCENARIO % lost)
        subprocess.run([CANYON, "simulate", "drive.yaml", "--out", ".", "--quiet"], cwd=self.folder, check=True)
        subprocess.run([sys.executable, ROOT / "examples" / "layouts.py", self.folder, "kf_gins", "gici", "urbannav_gt"], check=True)
        return (np.genfromtxt(self.folder / "imu.csv", delimiter=",", skip_header=1),
                np.genfromtxt(self.folder / "motion.csv", delimiter=",", skip_header=1))

    def enterContext_(self, context):
        self.addCleanup(context.__exit__, None, None, None)
        return context.__enter__()

    def test_kf_gins(self):
        imu, motion = self.made()
        increments, truth, fixes = (np.loadtxt(self.folder / name)
                                    for name in ("kf_gins_imu.txt", "kf_gins_truth.nav", "kf_gins_gnss.txt"))
        np.testing.assert_allclose(increments[:, 0], imu[:, 1], atol=1e-8)
        np.testing.assert_allclose(increments[:, 1:4], 0.01 * imu[:, 5:8], atol=1e-14)
        np.testing.assert_allclose(increments[:, 4:], 0.01 * imu[:, 2:5], atol=1e-13)
        np.testing.assert_allclose(truth[:, 2:5], motion[:, 2:5], atol=1e-6)
        np.testing.assert_allclose(truth[:, 5:8], motion[:, [6, 5, 7]] * [1, 1, -1], atol=1e-9)
        np.testing.assert_allclose(truth[:, 8:], motion[:, 8:11], atol=1e-8)
        self.assertGreater(len(fixes), 5)
        np.testing.assert_allclose(fixes[-1, 1:3], truth[-1, 2:4], atol=1e-3)
        self.assertGreater(fixes[0, 4], 0)

    def test_gici(self):
        imu, _ = self.made()
        rows = np.loadtxt(self.folder / "gici_imu.txt", skiprows=1)
        self.assertEqual((self.folder / "gici_imu.txt").read_text().splitlines()[251].split("\t")[0], "1780293602.510000000")
        np.testing.assert_allclose(rows[:, 1:4], imu[:, 2:5] * [1, -1, -1], atol=1e-9)
        np.testing.assert_allclose(rows[:, 4:], imu[:, 5:8] * [1, -1, -1], atol=1e-12)

    def test_lost_samples_are_left_out(self):
        imu, motion = self.made("0.5")
        self.assertLess(len(imu), 0.7 * len(motion))
        for name, header in (("kf_gins_imu.txt", 0), ("gici_imu.txt", 1)):
            self.assertEqual(len(np.loadtxt(self.folder / name, skiprows=header)), len(imu))

    def test_urbannav(self):
        _, motion = self.made()
        rows = np.loadtxt(self.folder / "urbannav_gt.txt")
        truth = motion[::10]
        self.assertEqual(rows.shape, (len(truth), 20))
        np.testing.assert_allclose(rows[:, 2], truth[:, 1], atol=1e-5)
        for first, degrees in ((3, truth[:, 2]), (6, truth[:, 3])):
            angle = np.abs(rows[:, first]) + rows[:, first + 1] / 60 + rows[:, first + 2] / 3600
            np.testing.assert_allclose(np.sign(rows[:, first]) * angle, degrees, atol=2e-9)
        np.testing.assert_allclose(rows[:, 9], truth[:, 4], atol=1e-3)
        # The nose points along the path: all of the velocity is forward.
        np.testing.assert_allclose(rows[:, 11], np.linalg.norm(truth[:, 5:8], axis=1), atol=0.02)
        np.testing.assert_allclose(rows[:, 10], 0, atol=0.02)
        # From north-east to north: a left turn, with acceleration to the left.
        self.assertLess(rows[:, 13].min(), -1)
        self.assertAlmostEqual(rows[20, 18], 45, delta=0.1)
        said = subprocess.run([CANYON, "check", self.folder / "urbannav_gt.txt"], capture_output=True, text=True, check=True)
        self.assertIn("recorded path (urbannav)", said.stdout)


if __name__ == "__main__":
    CANYON = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
