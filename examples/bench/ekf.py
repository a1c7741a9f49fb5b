#!/usr/bin/python3
"""An estimator of 100 lines: an extended Kalman filter of a car or a person with fixes, a gyroscope and wheels.

    ekf.py DRIVE ESTIMATE.csv [--robust] [--gate 9.21]

DRIVE is a folder of `canyon bench make`. State: east, north [m], heading [rad, from north, clockwise], speed [m/s], bias of the gyroscope
[rad/s]. Without wheels the speed is a random walk. Fixes outside the gate (99 % of chi-square with two degrees) are rejected.
--robust: such a fix gets less weight instead (Huber), and after 3 s of them the filter restarts at the fix.
"""
import argparse
import csv
import math
from pathlib import Path

import numpy as np

METRES_PER_DEGREE = 111_320.0
RESET_S = 3
STEP = 5  # samples of the gyroscope per prediction


def rows(path):
    with open(path, newline="") as file:
        return [{k: float(v) if v not in ("", None) else math.nan for k, v in row.items()} for row in csv.DictReader(file)]


def turned(angle):
    return (angle + math.pi) % (2 * math.pi) - math.pi


class Filter:
    def __init__(self, robust, gate):
        self.robust, self.gate, self.x, self.p, self.rejected_since = robust, gate, None, None, None

    def begin(self, east, north, variance):
        heading, speed, bias = self.x[2:] if self.x is not None else (0.0, 0.0, 0.0)
        self.x = np.array([east, north, heading, speed, bias])
        self.p = np.diag([variance, variance, 4.0 if speed == 0 else 0.3, 4.0, 1e-4])

    def predict(self, dt, rate, wheels):
        if self.x is None:
            return
        _, _, heading, speed, bias = self.x
        sin, cos = math.sin(heading), math.cos(heading)
        f = np.eye(5)
        f[0, 2], f[0, 3] = speed * cos * dt, sin * dt
        f[1, 2], f[1, 3] = -speed * sin * dt, cos * dt
        f[2, 4] = -dt
        self.x = self.x + np.array([speed * sin, speed * cos, rate - bias, 0, 0]) * dt
        self.x[2] = turned(self.x[2])
        self.p = f @ self.p @ f.T + np.diag([0.01, 0.01, 1e-4, 1.0, 1e-9]) * dt
        if not math.isnan(wheels):
            self.correct(np.array([[0, 0, 0, 1.0, 0]]), np.array([wheels - self.x[3]]), np.array([[0.04]]))

    def correct(self, h, innovation, r):
        gain = self.p @ h.T @ np.linalg.inv(h @ self.p @ h.T + r)
        self.x = self.x + gain @ innovation
        self.x[2] = turned(self.x[2])
        self.p = (np.eye(5) - gain @ h) @ self.p

    def take_fix(self, time, east, north, covariance):
        if self.x is None:
            return self.begin(east, north, covariance[0, 0] + covariance[1, 1])
        h = np.eye(5)[:2]
        innovation = np.array([east, north]) - self.x[:2]
        distance = innovation @ np.linalg.inv(h @ self.p @ h.T + covariance) @ innovation
        if distance <= self.gate:
            self.rejected_since = None
        elif not self.robust:
            return
        else:
            self.rejected_since = time if self.rejected_since is None else self.rejected_since
            if time - self.rejected_since > RESET_S:
                self.rejected_since = None
                return self.begin(east, north, covariance[0, 0] + covariance[1, 1])
            covariance = covariance * distance / self.gate
        self.correct(h, innovation, covariance)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("drive", type=Path)
    parser.add_argument("estimate", type=Path)
    parser.add_argument("--robust", action="store_true")
    parser.add_argument("--gate", type=float, default=9.21, help="limit of the squared, normalized innovation (9.21); inf: none")
    args = parser.parse_args()
    fixes, wheels = rows(args.drive / "fixes.csv"), rows(args.drive / "wheels.csv")
    imu = np.genfromtxt(args.drive / "imu.csv", delimiter=",", names=True)
    origin = next((f for f in fixes if not math.isnan(f["latitude_deg"])), None)
    if origin is None:
        raise SystemExit(f"{args.drive}/fixes.csv has no fix")
    east_m = METRES_PER_DEGREE * math.cos(math.radians(origin["latitude_deg"]))
    speeds = np.array([(w["time_s"], (w["speed_left_mps"] + w["speed_right_mps"]) / 2) for w in wheels]).reshape(-1, 2)
    ekf, at, lines = Filter(args.robust, args.gate), 0, []
    last = 0.0
    for fix in fixes:
        while at + STEP <= len(imu) and imu["time_s"][at + STEP - 1] <= fix["time_s"] + 1e-9:
            time, rate = imu["time_s"][at + STEP - 1], -np.mean(imu["angular_rate_z_radps"][at:at + STEP])  # positive to the left
            speed = np.interp(time, speeds[:, 0], speeds[:, 1]) if len(speeds) else math.nan
            ekf.predict(time - last, 0.0 if math.isnan(rate) else rate, speed)
            last, at = time, at + STEP
        if not math.isnan(fix["latitude_deg"]):
            c = np.array([[fix["cov_ee_m2"], fix["cov_en_m2"]], [fix["cov_en_m2"], fix["cov_nn_m2"]]])
            if np.isnan(c).any() or c[0, 0] <= 0:
                c = 25.0 * np.eye(2)
            ekf.take_fix(fix["time_s"], (fix["longitude_deg"] - origin["longitude_deg"]) * east_m,
                         (fix["latitude_deg"] - origin["latitude_deg"]) * METRES_PER_DEGREE, c)
        if ekf.x is not None:
            lines.append(f"{fix['time_s']:.3f},{origin['latitude_deg'] + ekf.x[1] / METRES_PER_DEGREE:.9f},"
                         f"{origin['longitude_deg'] + ekf.x[0] / east_m:.9f},{math.degrees(ekf.x[2]) % 360:.3f},"
                         f"{ekf.p[0, 0]:.6f},{ekf.p[0, 1]:.6f},{ekf.p[1, 1]:.6f}\n")
    args.estimate.write_text("time_s,latitude_deg,longitude_deg,heading_deg,cov_ee_m2,cov_en_m2,cov_nn_m2\n" + "".join(lines))


if __name__ == "__main__":
    main()
