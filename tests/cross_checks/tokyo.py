#!/usr/bin/python3
"""Compares run 1 of Tokyo (a car, a mosaic-X5, July 2024) with its simulations, by receivers and obstacles.

    tokyo.py CANYON DATA OUT [--seeds 1] [--duration S] [--only NAME ...]

CANYON is the program, DATA the folder of `tokyo-ppc-run1`, OUT a folder for the runs. The truth has gaps of up to
183 s; figures are of the epochs (1 Hz) within 0.3 s of a truth. "tracked" counts satellites of GPS, GLONASS, Galileo and QZSS in
epochs.csv and run1_tracked.csv; "correlation" is Pearson's, of these counts over epochs. Errors are of single
epochs: Canyon's against its truth, recorded ones of another program (run1_spp.csv). Run by hand, minutes of one core.

    tokyo.py --self-test         checks the statistics; ctest runs this

Exit status: 0 done, 1 self-test failed, 2 bad input, 77 data missing.
"""
import csv
import gzip
import math
import statistics
import subprocess
import sys
from pathlib import Path

from transfer import judge_arguments, quantile

SCENARIO = """city: {{osm: tokyo/buildings_run1.osm.gz, geoid_undulation_m: 40}}
sky:
  sp3: tokyo/sky_20240723_approx.sp3.gz
  systems: [GPS, GLONASS, Galileo, QZSS]
  errors: true
trajectory: {{file: truth.csv, format: csv, height_above_terrain_m: 2.0}}
receivers:
  - {{name: rover, elevation_mask_deg: 5, position_filter: {{enabled: false}}, {receiver}}}
{world}
outputs: [epochs_csv]
seed: 1
"""
SKYLINE = "surroundings: dense\nshadowing: {{skyline: {{{}}}}}"
VARIANTS = {  # name: receiver's keys, scenario's keys
    "septentrio-mosaic, open": ("profile: septentrio-mosaic", "surroundings: open"),
    "septentrio-mosaic, auto": ("profile: septentrio-mosaic", "surroundings: auto"),
    "septentrio-mosaic, urban": ("profile: septentrio-mosaic", "surroundings: urban"),
    "septentrio-mosaic, dense": ("profile: septentrio-mosaic", "surroundings: dense"),
    "survey, open": ("profile: survey", "surroundings: open"),
    "survey, urban": ("profile: survey", "surroundings: urban"),
    "survey, dense": ("profile: survey", "surroundings: dense"),
    "survey, roof_with_splitter, open": ("profile: survey, signal: {installation: roof_with_splitter}", "surroundings: open"),
    "f9p, urban": ("profile: ublox-f9p", "surroundings: urban"),
    "dense, share 0.2": ("profile: survey", SKYLINE.format("share: 0.2")),
    "dense, share 0": ("profile: survey", SKYLINE.format("share: 0")),
    "dense, height 5": ("profile: survey", SKYLINE.format("height_m: 5")),
    "urban, frame 20": ("profile: survey", "surroundings: urban\nshadowing: {frame_m: 20}"),
}


def pearson(x, y):
    """Pearson's correlation of two equally long lists; NaN if one of them is constant."""
    mx, my = statistics.fmean(x), statistics.fmean(y)
    sxx, syy = sum((a - mx) ** 2 for a in x), sum((b - my) ** 2 for b in y)
    return sum((a - mx) * (b - my) for a, b in zip(x, y)) / math.sqrt(sxx * syy) if sxx and syy else math.nan


def rows(path):
    with (gzip.open(path, "rt") if path.suffix == ".gz" else open(path, encoding="utf-8")) as file:
        yield from csv.DictReader(file)


def recorded(data):
    """Truth as lines of a trajectory file; tow: satellites tracked; tow: (horizontal, vertical error) if known."""
    truth = [(float(r["gps_tow_s"]), ",".join([r["gps_week"], r["gps_tow_s"], r["lat_deg"], r["lon_deg"], r["h_ellipsoid_m"]]))
             for r in rows(data / "run1_truth_rtkfix.csv.gz")]
    known = {round(t) for t, _ in truth if abs(t - round(t)) < 0.3}
    tracked = {round(float(r["gps_tow_s"])): int(r["nsat_tracked"]) for r in rows(data / "run1_tracked.csv.gz")}
    fixes = {}
    for r in rows(data / "run1_spp.csv.gz"):
        tow = float(r["gps_tow_s"])
        if abs(tow - round(tow)) < 1e-6 and r["err_e_m"]:
            fixes[round(tow)] = math.hypot(float(r["err_e_m"]), float(r["err_n_m"])), abs(float(r["err_u_m"]))
    return truth, {t: n for t, n in tracked.items() if t in known}, {t: e for t, e in fixes.items() if t in known}


def simulate(canyon, out, receiver, world, seed, duration):
    """tow: satellites tracked, and tow: (horizontal, vertical error)."""
    (out / "scenario.yaml").write_text(SCENARIO.format(receiver=receiver, world=world))
    command = [canyon, "simulate", out / "scenario.yaml", "-o", out / "run", "--rate", "1", "--seed", str(seed), "--quiet"]
    subprocess.run(command + (["--duration", str(duration)] if duration else []), check=True, timeout=1800)
    tracked, fixes = {}, {}
    for r in rows(out / "run" / "epochs.csv"):
        tracked[round(float(r["gps_tow"]))] = int(r["tracked"])
        if r["error_east_m"]:
            fixes[round(float(r["gps_tow"]))] = (math.hypot(float(r["error_east_m"]), float(r["error_north_m"])),
                                                 abs(float(r["error_up_m"])))
    return tracked, fixes


def line(name, counts, correlation, fixes):
    h, v = [e[0] for e in fixes], [e[1] for e in fixes]
    print(f"{name:34} {statistics.fmean(counts):7.1f} {correlation:11.2f} {quantile(h, 0.5):7.1f} {quantile(h, 0.95):6.0f} "
          f"{quantile(v, 0.5):7.1f} {quantile(v, 0.95):6.0f} {len(h):6}", flush=True)


def self_test():
    assert math.isclose(pearson([1, 2, 3], [2, 4, 6]), 1) and math.isclose(pearson([1, 2, 3], [3, 2, 1]), -1)
    assert math.isclose(pearson([1, 2, 3, 4], [2, 1, 4, 3]), 0.6) and math.isnan(pearson([1, 1], [1, 2]))
    assert math.isclose(quantile([4, 1, 3, 2], 0.5), 2.5) and math.isnan(quantile([], 0.5))
    print("statistics are right")


def main():
    if sys.argv[1:] == ["--self-test"]:
        self_test()
        return 0
    parser = judge_arguments(__doc__, 1)
    parser.add_argument("--duration", type=float, help="first seconds of the drive alone")
    parser.add_argument("--only", nargs="+", choices=VARIANTS, default=list(VARIANTS))
    args = parser.parse_args()
    data = args.data / "tokyo-ppc-run1"
    if not data.is_dir():
        print(f"{data} is missing")
        return 77
    args.out.mkdir(parents=True, exist_ok=True)
    truth, tracked, fixes = recorded(data)
    (args.out / "truth.csv").write_text("gps_week,gps_tow,latitude,longitude,height\n" + "\n".join(t for _, t in truth) + "\n")
    if not (args.out / "tokyo").exists():
        (args.out / "tokyo").symlink_to(data.resolve())
    if args.duration:
        end = truth[0][0] + args.duration
        tracked = {t: n for t, n in tracked.items() if t <= end}
        fixes = {t: e for t, e in fixes.items() if t <= end}
    print(f"{'':34} tracked correlation   H p50    p95   V p50    p95  fixes")
    line("recorded", list(tracked.values()), 1, list(fixes.values()))
    for name in args.only:
        counts, errors, correlations = [], [], []
        for seed in range(1, args.seeds + 1):
            sim, sim_fixes = simulate(args.canyon, args.out, *VARIANTS[name], seed, args.duration)
            epochs = sorted(tracked)
            counts += [sim.get(t, 0) for t in epochs]
            correlations.append(pearson([tracked[t] for t in epochs], [sim.get(t, 0) for t in epochs]))
            errors += [e for t, e in sim_fixes.items() if t in tracked]
        line(name, counts, statistics.fmean(correlations), errors)
    return 0


if __name__ == "__main__":
    sys.exit(main())
