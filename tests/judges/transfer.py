#!/usr/bin/env python3
"""Judge: is the order of positioning settings the same on recorded and on simulated observations of one drive?

    transfer.py CANYON DATA OUT [--seeds 3] [--only NAME ...] [--picture FILE.svg]

CANYON is the program, DATA the folder of the recordings (urbannav-tst-20190428, urbannav-tst-20210517,
berlin-potsdamer-platz, hongkong), OUT a folder for the runs. Each drive is simulated from its scenario in examples/ with
the errors of sky.errors and a mask of 5 deg. RTKLIB's rnx2rtkp solves recorded and simulated observations with
each setting; `canyon validate` does so with Canyon's settings. Horizontal errors are against the drive's truth.
The figures are Kendall's tau-b of the settings' medians and 95 % values, recorded against the mean of the
seeds, with the central 90 % of 2,000 bootstrap samples of the settings. Solved epochs differ between settings.

    transfer.py --self-test      checks the statistics; ctest runs this

Exit status: 0 done, 1 self-test failed, 2 bad input, 77 rnx2rtkp or data missing.
"""
import argparse
import itertools
import json
import math
import random
import shutil
import statistics
import subprocess
import sys
from pathlib import Path

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
MIN_FIXES = 50  # a setting with fewer epochs on either side is left out
SYSTEMS = {"GPS": 1, "GLONASS": 4, "BeiDou": 32}  # RTKLIB's pos1-navsys
T21 = "urbannav-tst-20210517"
RECORDINGS = {  # name: scenario, profile, observations, truth, ephemerides, second constellation
    "tst-19-m8t": ("urbannav_tst_m8t.yaml", "ublox-m8t", "urbannav-tst-20190428/COM3_190428_124409.obs",
                   "urbannav-tst-20190428/groundTruth_TST.csv",
                   ["urbannav-tst-20190428/hksc1180.19n", "urbannav-tst-20190428/hksc1180.19b"], "BeiDou"),
    "tst-21-f9p": ("urbannav_tst_2021.yaml", "ublox-f9p", f"{T21}/20210517.light-urban.tste.ublox.f9p.splitter.obs",
                   f"{T21}/UrbanNav_TST_GT.txt", [f"{T21}/hksc137c.21n", f"{T21}/hksc137c.21f"], "BeiDou"),
    "tst-21-m8t": ("urbannav_tst_2021.yaml", "ublox-m8t", f"{T21}/20210517.light-urban.tste.ublox.m8t.GC.obs",
                   f"{T21}/UrbanNav_TST_GT.txt", [f"{T21}/hksc137c.21n", f"{T21}/hksc137c.21f"], "BeiDou"),
    "tst-21-phone": ("urbannav_tst_2021.yaml", "phone", f"{T21}/20210517.light-urban.tste.google.pixel4.obs",
                     f"{T21}/UrbanNav_TST_GT.txt", [f"{T21}/hksc137c.21n", f"{T21}/hksc137c.21f"], "BeiDou"),
    "berlin-m8": ("berlin_m8.yaml", "ublox-m8t", "berlin-potsdamer-platz/Berlin_Potsdamer_Platz.obs",
                  "berlin-potsdamer-platz/truth.csv",
                  ["berlin-potsdamer-platz/brdc1580.16n", "berlin-potsdamer-platz/brdc1580.16g"], "GLONASS"),
}


def kendall(x, y):
    """Kendall's tau-b of two equally long lists; NaN if one of them is constant."""
    s = tx = ty = 0
    for i in range(len(x)):
        for j in range(i):
            a = (x[i] > x[j]) - (x[i] < x[j])
            b = (y[i] > y[j]) - (y[i] < y[j])
            s, tx, ty = s + a * b, tx + a * a, ty + b * b
    return s / math.sqrt(tx * ty) if tx and ty else math.nan


def interval(x, y, draws=2000):
    """The central 90 % of tau over bootstrap samples of the pairs."""
    rng = random.Random(1)
    taus = []
    for _ in range(draws):
        pick = rng.choices(range(len(x)), k=len(x))
        taus.append(kendall([x[i] for i in pick], [y[i] for i in pick]))
    taus = sorted(t for t in taus if not math.isnan(t))
    return (taus[len(taus) // 20], taus[len(taus) - 1 - len(taus) // 20]) if taus else (math.nan, math.nan)


def quantile(values, share):
    """Linear between the two nearest ranks; NaN of nothing."""
    v = sorted(values)
    if not v:
        return math.nan
    at = share * (len(v) - 1)
    low = int(at)
    return v[low] + (at - low) * (v[min(low + 1, len(v) - 1)] - v[low])


def judge_arguments(about, seeds):
    """A parser of the judges' command line: program, data, folder of the runs, seeds."""
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("canyon", "data", "out"):
        parser.add_argument(name, type=lambda p: Path(p).resolve())  # runs have folders of their own
    parser.add_argument("--seeds", type=int, default=seeds)
    return parser


def read_truth(path):
    """Time of week [s]: latitude, longitude [deg]; both formats of UrbanNav."""
    truth = []
    for line in Path(path).read_text().splitlines():
        cells = line.replace(",", " ").split()
        try:
            c = [float(x) for x in cells]
        except ValueError:
            continue
        if len(c) == 5:
            truth.append((c[1], c[2], c[3]))
        elif len(c) > 10:
            truth.append((c[2], c[3] + c[4] / 60 + c[5] / 3600, c[6] + c[7] / 60 + c[8] / 3600))
    return sorted(truth)


def errors(pos, truth):
    """Horizontal errors [m] of the fixes of an RTKLIB file whose time lies between two truths at most 1.5 s apart."""
    found, at = [], 0
    for line in Path(pos).read_text().splitlines():
        c = line.split()
        if line.startswith("%") or len(c) < 7:
            continue
        t, lat, lon = float(c[1]), float(c[2]), float(c[3])
        while at + 2 < len(truth) and truth[at + 1][0] < t:
            at += 1
        (t0, lat0, lon0), (t1, lat1, lon1) = truth[at], truth[at + 1]
        if not t0 - 1e-3 <= t <= t1 + 1e-3 or t1 - t0 > 1.5:
            continue
        w = (t - t0) / (t1 - t0)
        north = (lat - lat0 - w * (lat1 - lat0)) * 111_200
        east = (lon - lon0 - w * (lon1 - lon0)) * 111_320 * math.cos(math.radians(lat0))
        found.append(math.hypot(north, east))
    return found


def rtklib_settings(second):
    """Name: lines of rnx2rtkp's options."""
    names = {"GPS": 1, second: SYSTEMS[second], f"GPS+{second}": 1 + SYSTEMS[second]}
    settings = {}
    for name, bits in names.items():
        base = f"pos1-navsys={bits}\npos1-frequency=l1\npos1-posmode=single\npos1-ionoopt=brdc\npos1-tropopt=saas\n" \
               "out-outhead=off\nout-timesys=gpst\nout-timeform=tow\nout-timendec=3\nout-solformat=llh\n"
        for mask in (5, 10, 15, 20, 25, 30, 35):
            settings[f"{name}, mask {mask}"] = base + f"pos1-elmask={mask}\n"
        for cn0 in (25, 30, 35):
            settings[f"{name}, C/N0 {cn0}"] = base + "pos1-elmask=10\npos1-snrmask_r=on\npos1-snrmask_L1=" \
                + ",".join([str(cn0)] * 9) + "\n"
        settings[f"{name}, RAIM"] = base + "pos1-elmask=10\npos1-posopt5=on\n"
    return settings


def rtklib(options, observations, navigation, truth, folder):
    """Errors of rnx2rtkp's fixes with these options."""
    (folder / "rtk.conf").write_text(options)
    subprocess.run(["rnx2rtkp", "-k", folder / "rtk.conf", "-o", folder / "rtk.pos", observations, *navigation],
                   check=True, timeout=300, capture_output=True)
    return errors(folder / "rtk.pos", truth)


def scenario(data, out, name, extra="", mask=5):
    """Writes the drive's scenario with its profile, a mask and the errors of the sky; `extra` goes into the receiver."""
    file, profile = RECORDINGS[name][:2]
    lines = []
    for line in (EXAMPLES / file).read_text().splitlines():
        if line.startswith("    profile:"):
            line = f"    profile: {profile}" + extra
        lines.append(line.replace("elevation_mask_deg: 10", f"elevation_mask_deg: {mask}"))
        if line == "sky:":
            lines.append("  errors: true")
    path = out / "scenario.yaml"
    for folder in ("hongkong", "urbannav-tst-20190428", T21, "berlin-potsdamer-platz"):
        if not (out / folder).exists():
            (out / folder).symlink_to((data / folder).resolve())
    path.write_text("\n".join(lines) + "\n")
    return path


def run_rtklib(canyon, data, out, name, seeds):
    """Setting: (recorded p50, p95), list over seeds of simulated (p50, p95)."""
    _, _, obs, truth_file, nav, second = RECORDINGS[name]
    truth = read_truth(data / truth_file)
    folder = out / name
    folder.mkdir(parents=True, exist_ok=True)
    sets = [(data / obs, [data / f for f in nav])]
    for seed in range(1, seeds + 1):
        run = folder / f"seed{seed}"
        subprocess.run([canyon, "simulate", scenario(data, folder, name), "-o", run, "--seed", str(seed), "--quiet"],
                       check=True, timeout=1200)
        sets.append((run / "receiver.obs", [run / "sky.nav"]))
    figures = {}
    for setting, options in rtklib_settings(second).items():
        found = [rtklib(options, o, n, truth, folder) for o, n in sets]
        if min(map(len, found)) >= MIN_FIXES:
            pairs = [(quantile(e, 0.5), quantile(e, 0.95), len(e)) for e in found]
            figures[setting] = pairs[0], pairs[1:]
    return figures


def run_canyon(canyon, data, out, name, seeds):
    """As run_rtklib, with Canyon's weights and RAIM, each epoch alone and by the filter."""
    folder = out / name
    folder.mkdir(parents=True, exist_ok=True)
    figures = {}
    for weights, raim, mask in itertools.product(("equal", "elevation", "cn0"), ("true", "false"), (5, 20)):
        extra = f"\n    weights: {{weighting: {weights}}}\n    raim: {{enabled: {raim}}}"
        path = scenario(data, folder, name, extra, mask)
        values = {}
        for seed in range(1, seeds + 1):
            text = subprocess.run([canyon, "validate", path, "--obs", data / RECORDINGS[name][2], "--json", "-",
                                   "--quiet", "--seed", str(seed)], check=True, timeout=1200, capture_output=True,
                                  text=True).stdout
            for kind, pair in canyon_figures(json.loads(text)).items():
                values.setdefault(kind, []).append(pair)
        for kind, pairs in values.items():
            figures[f"{kind}, {weights}, RAIM {raim}, mask {mask}"] = pairs[0][0], [p[1] for p in pairs]
    return figures


def canyon_figures(report):
    """Kind of position: ((recorded p50, p95, epochs), (simulated p50, p95, epochs)) of a report of `canyon validate`."""
    kinds = {"single": "position", "filter": "filtered_position"}
    figures = {}
    for kind, key in kinds.items():
        sides = [report["models"][0][key][side] for side in ("measured", "simulated")]
        figures[kind] = tuple((s["horizontal_error_m"]["p50"], s["horizontal_error_m"]["p95"], s["fixes"]) for s in sides)
    return figures


def between(figures, i):
    """Mean tau of figure `i` between two seeds: what one recording can reach of another; NaN with one seed."""
    seeds = list(zip(*([s[i] for s in f[1]] for f in figures.values())))
    taus = [kendall(a, b) for a, b in itertools.combinations(seeds, 2)]
    return statistics.fmean(taus) if taus else math.nan


def table(name, program, figures):
    """Prints settings and taus; returns recorded and simulated medians and 95 % values."""
    recorded = [[f[0][i] for f in figures.values()] for i in (0, 1)]
    simulated = [[statistics.fmean(s[i] for s in f[1]) for f in figures.values()] for i in (0, 1)]
    print(f"\n{name}, {program}: {len(figures)} settings")
    print(f"{'setting':40} recorded p50  p95  fixes   simulated p50  p95  fixes")
    for i, (setting, (rec, sim)) in enumerate(figures.items()):
        print(f"{setting:40} {rec[0]:12.1f} {rec[1]:5.0f} {rec[2]:6}   {simulated[0][i]:12.1f} {simulated[1][i]:5.0f} "
              f"{statistics.fmean(s[2] for s in sim):6.0f}")
    for i, what in enumerate(("medians", "95 %")):
        low, high = interval(recorded[i], simulated[i])
        seeds = [kendall(recorded[i], [f[1][k][i] for f in figures.values()]) 
                 for k in range(len(next(iter(figures.values()))[1]))]
        print(f"Kendall's tau of {what}: {kendall(recorded[i], simulated[i]):.2f} (90 % interval {low:.2f} to {high:.2f}; "
              f"single seeds {' '.join(f'{t:.2f}' for t in seeds)}; "
              f"seed with seed {between(figures, i):.2f})", flush=True)
    return recorded, simulated


def picture(path, points):
    """An SVG: recorded (x) against simulated (y) medians on logarithmic axes; points: {recording: (x, y)}."""
    colours = ("#1f6fb4", "#d9541e", "#2c9942", "#8a4bb0", "#7a6a20")
    flat = [v for x, y in points.values() for v in (*x, *y)]
    low, high = math.log10(min(flat)) - 0.05, math.log10(max(flat)) + 0.05

    def at(v):
        return 420 * (math.log10(v) - low) / (high - low)
    svg = ['<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 640 500" font-family="sans-serif" font-size="13">',
           '<rect width="640" height="500" fill="white"/>',
           '<path d="M60 440V20H480V440ZM60 440L480 20" fill="none" stroke="#888"/>']
    for v in (1, 2, 5, 10, 20, 50, 100, 200):
        if low < math.log10(v) < high:
            svg.append(f'<path d="M{60 + at(v):.1f} 440v5M60 {440 - at(v):.1f}h-5" stroke="#888"/>'
                       f'<text x="{60 + at(v):.1f}" y="460" text-anchor="middle">{v}</text>'
                       f'<text x="50" y="{444 - at(v):.1f}" text-anchor="end">{v}</text>')
    svg.append('<text x="270" y="485" text-anchor="middle">recorded median error [m]</text>'
               '<text transform="translate(18 230) rotate(-90)" text-anchor="middle">simulated median error [m]</text>')
    for k, (name, (x, y)) in enumerate(points.items()):
        svg.append(f'<g fill="{colours[k % 5]}"><circle cx="500" cy="{40 + 22 * k}" r="4"/>'
                   f'<text x="510" y="{44 + 22 * k}" fill="black">{name}</text>')
        svg += [f'<circle cx="{60 + at(a):.1f}" cy="{440 - at(b):.1f}" r="4" fill-opacity="0.7"/>' for a, b in zip(x, y)]
        svg.append("</g>")
    Path(path).write_text("\n".join(svg) + "\n</svg>\n")


def self_test():
    near = math.isclose
    assert kendall([1, 2, 3, 4], [10, 20, 30, 40]) == 1 and kendall([1, 2, 3], [3, 2, 1]) == -1
    assert near(kendall([1, 2, 3, 4, 5], [3, 4, 1, 2, 5]), 0.2)       # 6 pairs agree, 4 do not
    assert near(kendall([1, 1, 2, 3], [1, 2, 3, 4]), 5 / math.sqrt(30))  # a tie: tau-b
    assert math.isnan(kendall([1, 1], [1, 2]))
    assert near(quantile([4, 1, 3, 2], 0.5), 2.5) and near(quantile(range(101), 0.95), 95)
    low, high = interval([1, 2, 3, 4, 5, 6, 7, 8], [2, 1, 4, 3, 6, 5, 8, 7], 300)
    assert -1 < low < kendall([1, 2, 3, 4, 5, 6, 7, 8], [2, 1, 4, 3, 6, 5, 8, 7]) < high <= 1
    assert near(between({"a": (None, [(1,), (1,)]), "b": (None, [(2,), (3,)]), "c": (None, [(3,), (2,)])}, 0), 1 / 3)
    assert interval([1, 2, 3], [1, 2, 3], 300) == (1, 1)
    print("statistics are right")


def main():
    if sys.argv[1:] == ["--self-test"]:
        self_test()
        return 0
    parser = judge_arguments(__doc__, 3)
    parser.add_argument("--only", nargs="+", choices=RECORDINGS, default=list(RECORDINGS))
    parser.add_argument("--programs", nargs="+", choices=("RTKLIB", "Canyon"), default=["RTKLIB", "Canyon"])
    parser.add_argument("--picture", type=Path)
    args = parser.parse_args()
    if not shutil.which("rnx2rtkp") or not all((args.data / RECORDINGS[n][2]).exists() for n in args.only):
        print("rnx2rtkp or the recordings are missing")
        return 77
    points = {}
    for name in args.only:
        for program in args.programs:
            solve = run_rtklib if program == "RTKLIB" else run_canyon
            figures = solve(args.canyon, args.data, args.out, name, args.seeds)
            recorded, simulated = table(name, program, figures)
            if program == "RTKLIB":
                points[name] = recorded[0], simulated[0]
    if args.picture and points:
        picture(args.picture, points)
    return 0


if __name__ == "__main__":
    sys.exit(main())
