#!/usr/bin/python3
"""Draws one street four times: recorded, by Canyon, and with the defaults of Gazebo Sim and PX4. The README's first picture.

    street.py CANYON DATA PICTURE [--recording tst-21-f9p] [--seed 1] [--from-s 0] [--until-s 1000]

Recorded and simulated pseudoranges are solved in the same way, each epoch alone, by `canyon validate`. CANYON and DATA: as in transfer.py.
"""
import argparse
import subprocess
import tempfile
from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
import numpy as np  # noqa: E402
from matplotlib.collections import PolyCollection  # noqa: E402

import transfer  # noqa: E402


def px4_errors(count, rng):
    """PX4's sensor_gps_sim at 8 Hz, once per second (transfer.RIVALS)."""
    x, errors = np.zeros(2), []
    for k in range(8 * count):
        x = 0.76 * x + 0.016 * rng.normal(size=2)
        if k % 8 == 0:
            errors.append(x)
    return np.array(errors)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("canyon", "data", "picture"):
        parser.add_argument(name, type=lambda p: Path(p).resolve())
    parser.add_argument("--recording", default="tst-21-f9p", choices=transfer.RECORDINGS)
    parser.add_argument("--seed", default="1")
    parser.add_argument("--from-s", type=float, default=0)
    parser.add_argument("--until-s", type=float, default=1000)
    args = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        scenario = transfer.scenario(args.data, folder, args.recording)
        _, _, observations, truth, _, _ = transfer.RECORDINGS[args.recording]
        subprocess.run([args.canyon, "validate", scenario, "--obs", args.data / observations, "--seed", args.seed, "--view", folder / "view",
                        "--quiet"], check=True, timeout=600, capture_output=True)
        subprocess.run([args.canyon, "city", "build", args.data / "hongkong/buildings.dae", "-o", folder / "city.obj", "--origin",
                        "22.298251,114.178761,0"], check=True, timeout=600, capture_output=True)
        tracks = [transfer.track(folder / "view", receiver) for receiver in (0, 1)]
        lines = [line.split() for line in (folder / "city.obj").read_text().splitlines()]
    corners = np.array([[float(x) for x in line[1:4]] for line in lines if line[:1] == ["v"]])
    faces = [[int(x.split("/")[0]) - 1 for x in line[1:]] for line in lines if line[:1] == ["f"]]
    time = tracks[0]["time_s"]
    chosen = (time >= args.from_s) & (time <= args.until_s)
    place = np.stack([tracks[0]["east_m"], tracks[0]["north_m"]], axis=1)
    errors = {}
    for name, columns in zip(("recorded, u-blox F9P", "Canyon"), tracks):
        errors[name] = np.stack([columns["error_east_m"], columns["error_north_m"]], axis=1).astype(float)
        errors[name][columns["status"] != 1] = np.nan
    errors["PX4's simulated GPS"] = px4_errors(len(time), np.random.default_rng(int(args.seed)))
    errors["Gazebo Sim's NavSat"] = np.zeros((len(time), 2))

    figure, (plan, plot) = plt.subplots(1, 2, figsize=(13, 5), gridspec_kw={"width_ratios": [1, 1.35]}, layout="constrained")
    ground_m = corners[:, 2].min() + 3
    walls = PolyCollection([corners[f][:, :2] for f in faces if corners[f][:, 2].max() > ground_m], facecolor="#dcdcdc", edgecolor="none")
    plan.add_collection(walls)
    plan.plot(*place[chosen].T, color="black", lw=3, label="true way", zorder=3)
    for (name, error), colour in zip(errors.items(), ("#d55e00", "#0072b2", "#009e73", "#888888")):
        error_m = np.linalg.norm(error, axis=1)[chosen]
        known = error_m[np.isfinite(error_m)]
        label = f"{name}: half below {np.quantile(known, 0.5):.1f} m, 95 % below {np.quantile(known, 0.95):.1f} m" if known.max() > 0.5 \
            else f"{name}: below {np.ceil(10 * known.max()) / 10:.1f} m" if known.max() > 0 else f"{name}: none"
        plan.plot(*(place + error)[chosen].T, color=colour, lw=1, marker=".", ms=3, zorder=4)
        plot.plot(time[chosen], np.maximum(error_m, 0.01), color=colour, lw=1.4, label=label)
        print(label)
    low, high = place[chosen].min(axis=0), place[chosen].max(axis=0)
    middle, half = (low + high) / 2, (high - low).max() / 2 + 40
    plan.set(xlim=(middle[0] - half, middle[0] + half), ylim=(middle[1] - half, middle[1] + half), aspect="equal", xlabel="east [m]",
             ylabel="north [m]", title="Tsim Sha Tsui, Hong Kong")
    plot.set(yscale="log", ylim=(0.009, 5000), xlabel="time [s]", ylabel="horizontal error [m]", title="each epoch solved alone")
    plot.legend(loc="upper left", fontsize=10)
    plot.grid(alpha=0.3)
    figure.savefig(args.picture, dpi=100)


if __name__ == "__main__":
    main()
