#!/usr/bin/python3
"""Compares rankings of fix filters by the bench's synthetic drives and by recordings.

    bench.py CANYON DATA OUT [--receivers ublox-m10 ...] [--seeds 5]

CANYON and DATA are those of transfer.py. The filters are those of fix_filters.py, applied to fixes of single epochs at 1 Hz. Of the pairs
of filters that a recording decides (pairs.py), prints the share that the bench's drives without faults order alike: by mean
error up to 100 m, by errors beyond 10 m and beyond 30 m.
"""
import csv
import re
import shutil
import subprocess
import sys

import numpy as np

import pairs
import transfer

DRIVES = ("low", "middle", "high", "walk", "drone")
EARTH_M = 6_378_137.0


def single_epochs(args, folder, receiver):
    """Times, fixes and truth [m] of a drive with fixes of single epochs at 1 Hz."""
    text = (folder / "scenario.yaml").read_text()
    text = text.replace(f"profile: {receiver}", f"profile: {receiver}, position_filter: {{enabled: false}}", 1)
    text = text.replace("rate_hz: 5", "rate_hz: 1", 1).replace("epochs_csv: false", "epochs_csv: true")
    text = re.sub(r", rtk: true, corrections: \{[^}]*\}", "", re.sub(r"  - \{name: base.*\n", "", text))
    (folder / "single.yaml").write_text(text)
    subprocess.run([args.canyon, "simulate", folder / "single.yaml", "-o", folder / "single", "--quiet"], check=True, timeout=600,
                   stderr=subprocess.DEVNULL)
    rows = list(csv.DictReader((folder / "single" / "epochs.csv").open()))
    east_m = EARTH_M * np.cos(np.radians(float(rows[0]["true_latitude_deg"])))

    def places(kind):
        degrees = np.array([[float(r[f"{kind}_{axis}_deg"] or "nan") for axis in ("longitude", "latitude")] for r in rows])
        return np.radians(degrees) * (east_m, EARTH_M)
    return np.array([float(r["gps_tow"]) for r in rows]), places("fix"), places("true")


def main():
    parser = transfer.judge_arguments(__doc__, 5)
    parser.add_argument("--receivers", nargs="+", default=["ublox-m10", "ublox-m8t", "ublox-f9p", "phone"])
    args = parser.parse_args()
    if not all((args.data / r[2]).exists() for r in transfer.RECORDINGS.values()):
        print(f"SKIPPED: the recordings in {args.data} are missing")
        return 77
    recorded = {}
    for name in transfer.RECORDINGS:
        drive = transfer.Drive(args, name)
        truth = drive.truth.at(drive.recorded.t)
        recorded[name] = (drive.recorded.t, transfer.of_filters(drive.recorded.t, truth + drive.solve(drive.recorded, transfer.PROFILES_OWN), truth))
    print(f"{'':12}" + "".join(f"{name:>18}" for name in recorded))
    for receiver in args.receivers:
        out = args.out / receiver
        shutil.rmtree(out, ignore_errors=True)
        subprocess.run([args.canyon, "bench", "make", out, "--only", *DRIVES, "--receiver", receiver, "--seeds", str(args.seeds), "--quiet"],
                       check=True, timeout=3600, stderr=subprocess.DEVNULL)
        drives = [transfer.of_filters(*single_epochs(args, out / f"{name}-{seed}", receiver)) for name in DRIVES
                  for seed in range(1, args.seeds + 1)]
        line = f"{receiver:12}"
        for t, figures in recorded.values():
            found = [pairs.compare(figures[k].astype(float), np.array([d[k].mean(axis=0) for d in drives]), transfer.block_of(t))["agreement"]
                     for k in range(3)]
            line += "  " + " ".join(f"{each:.2f}" for each in found).rjust(16)
        print(line, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
