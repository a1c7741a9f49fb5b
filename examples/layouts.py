#!/usr/bin/env python3
"""Files in the layouts of other programs, made from the arrays of a run.

usage: layouts.py FOLDER LAYOUT...      kf_gins, gici, urbannav_gt

FOLDER has the results of `canyon simulate` with sensors.imu (axes: frd) and outputs: {sensors_npz: true}.
"""
import pathlib
import sys

import numpy as np

UNIX_OF_GPS, WEEK, LEAP_SECONDS = 315964800, 604800, 18  # since 2017


def samples(folder):
    """The arrays of sensors.npz, without "imu_"; GPS week and seconds of the week at the end of each sample."""
    with np.load(folder / "sensors.npz") as file:
        imu = {name[4:]: file[name] for name in file.files if name.startswith("imu_")}
        week, tow = file["begin"]
    return imu, int(week), tow + imu["time_s"], tow + imu["stated_s"]


def kf_gins(folder):
    """KF-GINS and OB_GINS: increments forward, right, down [rad, m/s]; fixes with deviations; the truth."""
    imu, week, time, stated = samples(folder)
    steps = imu["time_s"][1] - imu["time_s"][0]
    got = np.isfinite(stated)
    increments = steps * np.column_stack([imu["angular_rate"], imu["specific_force"]])
    np.savetxt(folder / "kf_gins_imu.txt", np.column_stack([stated, increments])[got], ["%.9f"] + 6 * ["%.15e"])
    north_east_down = imu["velocity"][:, [1, 0, 2]] * [1, 1, -1]
    truth = np.column_stack([np.full_like(time, week), time, imu["place"], north_east_down, imu["attitude"]])
    np.savetxt(folder / "kf_gins_truth.nav", truth, ["%d", "%.9f", "%.12f", "%.12f", "%.6f"] + 6 * ["%.9f"])
    epochs = np.genfromtxt(folder / "epochs.csv", delimiter=",", names=True, dtype=None, encoding="utf-8")
    names = ["gps_tow", "fix_latitude_deg", "fix_longitude_deg", "fix_height_m", "sigma_north_m", "sigma_east_m", "sigma_up_m"]
    fixes = np.column_stack([epochs[name] for name in names])[epochs["status"] == "fix"]
    np.savetxt(folder / "kf_gins_gnss.txt", fixes, ["%.9f", "%.12f", "%.12f"] + 4 * ["%.6f"])


def gici(folder):
    """gici-open: Unix time, specific force and angular rate forward, left, up."""
    imu, week, _, stated = samples(folder)
    got = np.isfinite(stated)
    flu = [1, -1, -1]
    rows = np.column_stack([imu["specific_force"] * flu, imu["angular_rate"] * flu])[got]
    seconds = np.round(stated[got], 9)
    whole = np.floor(seconds)
    unix = [f"{UNIX_OF_GPS + week * WEEK - LEAP_SECONDS + int(w)}.{round((s - w) * 1e9):09d}" for w, s in zip(whole, seconds)]
    with open(folder / "gici_imu.txt", "w") as file:
        file.write("Timestamp\tAcc-X\tAcc-Y\tAcc-Z\tGyro-X\tGyro-Y\tGyro-Z\n")
        for time, row in zip(unix, rows):
            file.write("\t".join([time] + [f"{x:.9f}" for x in row[:3]] + [f"{x:.12f}" for x in row[3:]]) + "\n")


def urbannav_gt(folder):
    """The columns of UrbanNav's ground truth of 2021: poses of the sensor, 10 a second."""
    imu, week, time, _ = samples(folder)
    acceleration = np.gradient(imu["velocity"], time, axis=0)
    roll, pitch, heading = np.radians(imu["attitude"]).T
    ahead = np.column_stack([np.sin(heading) * np.cos(pitch), np.cos(heading) * np.cos(pitch), np.sin(pitch)])
    level = np.column_stack([np.cos(heading), -np.sin(heading), np.zeros_like(heading)])  # right, without roll
    above = np.cross(level, ahead)
    right = np.cos(roll)[:, None] * level - np.sin(roll)[:, None] * above
    axes = [right, ahead, np.cross(right, ahead)]
    rate_hz = 1 / (time[1] - time[0])
    with open(folder / "urbannav_gt.txt", "w") as file:
        for i in range(0, len(time), max(1, round(rate_hz / 10))):
            words = [f"{UNIX_OF_GPS + week * WEEK - LEAP_SECONDS + time[i]:.2f}", f"{week:.5f}", f"{time[i]:.5f}"]
            for angle in imu["place"][i, :2]:  # degrees with the sign, minutes and seconds without
                steps = round(abs(angle) * 3600e5)
                words.append(f"{'-' if angle < 0 else ''}{steps // 360000000} {steps // 6000000 % 60:02d} "
                             f"{steps // 100000 % 60:02d}.{steps % 100000:05d}")
            words.append(f"{imu['place'][i, 2]:.3f}")
            words += [f"{axis[i] @ vector[i]:.3f}" for vector in (imu["velocity"], acceleration) for axis in axes]
            heading_deg = (imu["attitude"][i, 2] + 180) % 360 - 180
            words += [f"{angle:.9f}" for angle in (imu["attitude"][i, 0], imu["attitude"][i, 1], heading_deg)]
            file.write(" ".join(words) + " 1\n")


if __name__ == "__main__":
    layouts = {each.__name__: each for each in (kf_gins, gici, urbannav_gt)}
    if len(sys.argv) < 3 or not set(sys.argv[2:]) <= set(layouts):
        sys.exit(__doc__)
    for name in sys.argv[2:]:
        layouts[name](pathlib.Path(sys.argv[1]))
