#!/usr/bin/python3
"""Tests whether filters and settings that are better on a recording are also better on simulations of its drive.

    transfer.py CANYON DATA OUT [--seeds 10] [--only NAME ...] [--jobs 2] [--quick]

CANYON is the program, DATA the folder of the recordings (urbannav-tst-20190428, urbannav-tst-20210517,
berlin-potsdamer-platz, hongkong), OUT a folder for runs and results: computed results are reused until the program, a
scenario or a setting changes. Each drive is simulated from its scenario in examples/, with the constellations that
were recorded, errors of sky.errors and a mask of 5 deg. Recorded and simulated observations are then solved in the same way:

  filters   25 filters (fix_filters.py) of single fixes by `canyon validate`: mean error up to 100 m, share of epochs beyond 10, 30 m
  RTKLIB    settings of rnx2rtkp: fraction of all epochs within 10, 20, 30 m; an epoch without a fix is not within
  Canyon    the same for settings of `canyon validate`, epoch by epoch

Of the pairs of settings that the recording decides (90 % of bootstraps by blocks of 60 s) the table states the share whose
difference, in the mean of the seeds, has the recorded sign; how many recorded differences are in the 90 % interval of
the next seed (Student); Kendall's tau beside that of a perfect simulator. Rivals stand in the same table: see RIVALS.
OUT/transfer.json has all metrics. --quick: one recording, two seeds, few settings.

Exit status: 0 done, 2 bad input, 77 rnx2rtkp or data missing.
"""
import argparse
import concurrent.futures
import datetime
import gzip
import hashlib
import itertools
import json
import math
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

import fix_filters
import pairs

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SYSTEMS = {"GPS": 1, "GLONASS": 4, "BeiDou": 32}  # RTKLIB's pos1-navsys
LETTERS = {"GPS": "G", "GLONASS": "R", "BeiDou": "C"}
T21 = "urbannav-tst-20210517"
T21_SKY = [f"{T21}/hksc137c.21n", f"{T21}/hksc137c.21f"]
RECORDINGS = {  # name: scenario, profile, observations, truth, ephemerides, recorded constellations with ephemerides
    "tst-21-f9p": ("urbannav_tst_2021.yaml", "ublox-f9p", f"{T21}/20210517.light-urban.tste.ublox.f9p.splitter.obs",
                   f"{T21}/UrbanNav_TST_GT.txt", T21_SKY, ["GPS", "BeiDou"]),
    "tst-21-m8t": ("urbannav_tst_2021.yaml", "ublox-m8t", f"{T21}/20210517.light-urban.tste.ublox.m8t.GC.obs",
                   f"{T21}/UrbanNav_TST_GT.txt", T21_SKY, ["GPS", "BeiDou"]),
    "tst-19-m8t": ("urbannav_tst_m8t.yaml", "ublox-m8t", "urbannav-tst-20190428/COM3_190428_124409.obs",
                   "urbannav-tst-20190428/groundTruth_TST.csv",
                   ["urbannav-tst-20190428/hksc1180.19n", "urbannav-tst-20190428/hksc1180.19b"], ["GPS", "BeiDou"]),
    "berlin-m8": ("berlin_m8.yaml", "ublox-m8t", "berlin-potsdamer-platz/Berlin_Potsdamer_Platz.obs",
                  "berlin-potsdamer-platz/truth.csv",
                  ["berlin-potsdamer-platz/brdc1580.16n", "berlin-potsdamer-platz/brdc1580.16g"], ["GPS", "GLONASS"]),
    "tst-21-phone": ("urbannav_tst_2021.yaml", "phone", f"{T21}/20210517.light-urban.tste.google.pixel4.obs",
                     f"{T21}/UrbanNav_TST_GT.txt", T21_SKY, ["GPS"]),
}
RIVALS = {  # name: description
    "mirror": "the paper's model on the same map and receiver: propagation.model mirror, surroundings open",
    "white": "white noise with the recorded median error: of fixes, or of pseudoranges under an open sky",
    "Gauss-Markov": "noise of fixes with the recorded median error and a correlation time of 30 s",
    "Gazebo": "NavSat of Gazebo Sim: no noise unless a world asks for it (gz-sensors src/NavSatSensor.cc, SDFormat noise type none)",
    "PX4": "x = 0.76 x + 0.016 m times white noise at 8 Hz: 2.5 cm (src/modules/simulation/sensor_gps_sim)",
    "ArduPilot": "no noise, 100 ms late (SIM_GPS1_HNSE 0, SIM_GPS1_LAG_MS 100; libraries/SITL/SIM_GPS.cpp)",
}
REACHES_M = (10, 20, 30)
FILTER_FIGURES = ("mean error up to 100 m", "beyond 10 m", "beyond 30 m")


# Used by other comparisons.
def quantile(values, share):
    """Linear between the two nearest ranks; NaN: no values."""
    return float(np.quantile(values, share)) if len(values) else math.nan


def judge_arguments(about, seeds):
    """A parser of the common command line: program, data, folder of the runs, seeds."""
    parser = argparse.ArgumentParser(description=about, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name in ("canyon", "data", "out"):
        parser.add_argument(name, type=lambda p: Path(p).resolve())  # runs have their own folders
    parser.add_argument("--seeds", type=int, default=seeds)
    return parser


def scenario_text(name, receiver="", mask=5, surroundings=None):
    """The drive's scenario with its profile, the recorded constellations, a mask and the errors of the sky; `receiver` adds keys."""
    file, profile, systems = (RECORDINGS[name][i] for i in (0, 1, 5))
    lines = []
    for line in (EXAMPLES / file).read_text().splitlines():
        if line.startswith("    profile:"):
            line = f"    profile: {profile}" + receiver
        if line.startswith("  systems:"):
            line = f"  systems: [{', '.join(systems)}]"
        if surroundings and line.startswith("surroundings:"):
            continue
        lines.append(line.replace("elevation_mask_deg: 10", f"elevation_mask_deg: {mask}"))
        if line == "sky:":
            lines.append("  errors: true")
    return "\n".join(lines + ([f"surroundings: {surroundings}"] if surroundings else [])) + "\n"


def scenario(data, out, name):
    """Writes scenario_text(name) to `out`, with links to the data; for other comparisons."""
    for folder in {Path(p).parts[0] for r in RECORDINGS.values() for p in r[2:4]} | {"hongkong"}:
        if not (out / folder).exists():
            (out / folder).symlink_to((data / folder).resolve())
    (out / "scenario.yaml").write_text(scenario_text(name))
    return out / "scenario.yaml"


def read_truth(path):
    """Rows of time of week [s], latitude, longitude [deg]; both formats of UrbanNav."""
    truth = []
    for line in Path(path).read_text().splitlines():
        try:
            c = [float(x) for x in line.replace(",", " ").split()]
        except ValueError:
            continue
        if len(c) == 5:
            truth.append((c[1], c[2], c[3]))
        elif len(c) > 10:
            truth.append((c[2], c[3] + c[4] / 60 + c[5] / 3600, c[6] + c[7] / 60 + c[8] / 3600))
    return np.array(sorted(truth))


class Truth:
    """East, north [m] of the antenna by time of week."""

    def __init__(self, path):
        rows = read_truth(path)
        self.t, self.origin = rows[:, 0], rows[len(rows) // 2, 1:]
        latitude = math.radians(self.origin[0])
        root = 1 - 0.00669437999 * math.sin(latitude) ** 2  # WGS 84
        north = 6_378_137 * (1 - 0.00669437999) / root ** 1.5
        self.metres_per_degree = np.radians([6_378_137 / root ** 0.5 * math.cos(latitude), north])
        self.places = self.metres(rows[:, 1:])

    def metres(self, degrees):
        """East, north of the origin, which is a position of the drive."""
        return (degrees - self.origin)[:, ::-1] * self.metres_per_degree

    def known(self, t):
        """Whether `t` is between two truths at most 1.5 s apart."""
        after = np.clip(np.searchsorted(self.t, t), 1, len(self.t) - 1)
        inside = (t >= self.t[0] - 1e-3) & (t <= self.t[-1] + 1e-3)
        return inside & (self.t[after] - self.t[after - 1] <= 1.5)

    def at(self, t):
        return np.stack([np.interp(t, self.t, self.places[:, k]) for k in (0, 1)], axis=1)


EPOCH_OF_RINEX_2 = re.compile(r" (\d\d) ([ \d]\d) ([ \d]\d) ([ \d]\d) ([ \d]\d) ?([ \d]\d\.\d{7})  [01]")


def epochs_of(text):
    """Times of week [s] of the epochs of RINEX 2 or 3."""
    found = []
    for line in text.splitlines():
        if line.startswith(">"):
            cells = line.split()[1:7]
        elif match := EPOCH_OF_RINEX_2.match(line):
            cells = ["20" + match[1], *match.groups()[1:]]
        else:
            continue
        day = datetime.date(*(int(c) for c in cells[:3])).isoweekday() % 7
        found.append(day * 86400 + int(cells[3]) * 3600 + int(cells[4]) * 60 + float(cells[5]))
    return np.array(found)


def nearest(t, times, values):
    """Rows of `values`, at `times`, for the epochs `t`: the nearest within half an interval, else NaN."""
    found = np.full((len(t), values.shape[1]), np.nan)
    if not len(times) or not len(t):
        return found
    at = np.clip(np.searchsorted(t, times), 1, len(t) - 1)
    at -= times - t[at - 1] < t[at] - times
    close = np.abs(t[at] - times) < np.median(np.diff(t)) / 2
    found[at[close]] = values[close]
    return found


def digest(*parts):
    return hashlib.sha1("\0".join(parts).encode()).hexdigest()[:20]


class Observations:
    """A RINEX file with its ephemerides; `t` are the epochs with a truth."""

    def __init__(self, path, navigation, truth):
        text = path.read_text()
        self.path, self.navigation, self.truth = path, navigation, truth
        self.digest = digest(text, *(n.read_text() for n in navigation))
        self.t = epochs_of(text)
        self.t = self.t[truth.known(self.t)]


def tables_of(header, data):
    """Table: column: values of an unpacked chunk of a view (docs/view-format.md)."""
    counts = np.frombuffer(data, "<u4", 2 * int.from_bytes(data[8:12], "little"), 16).reshape(-1, 2)
    at, found = 16 + counts.nbytes, {}
    for index, rows in counts:
        table = header["tables"][index]
        for column in table["columns"]:
            kind = np.dtype(f"<{column['type'][0]}{int(column['type'][1:]) // 8}")
            values, at = int(rows) * column.get("values", 1), -(-at // 8) * 8
            found.setdefault(table["name"], {})[column["name"]] = np.frombuffer(data, kind, values, at)
            at += values * kind.itemsize
    return found


def track(folder, receiver=0):
    """Columns of a receiver's epochs in a view (0: the recorded one of a comparison), and their times of week [s] as `tow`."""
    header = json.loads((folder / "view.json").read_text())
    chunk = next(c for c in header["chunks"] if c["kind"] == "track" and c["receiver"] == receiver)
    columns = tables_of(header, gzip.decompress((folder / chunk["file"]).read_bytes()))["epochs"]
    return {**columns, "tow": header["time"]["gps_tow"] + columns["time_s"]}


def with_noise(text, sigma_m, rng):
    """RINEX 3 with white noise on each pseudorange."""
    types, system, lines = {}, None, []
    for line in text.splitlines():
        if line[60:].startswith("SYS / # / OBS TYPES"):
            system = line[0] if line[0] != " " else system
            types.setdefault(system, []).extend(line[7:60].split())
        elif line[:1] in types and not line[60:].startswith(("SYS", "END")):
            for k, kind in enumerate(types[line[0]]):
                cell = line[3 + 16 * k:17 + 16 * k]
                if kind[0] == "C" and cell.strip():
                    line = f"{line[:3 + 16 * k]}{float(cell) + rng.normal(0, sigma_m):14.3f}{line[17 + 16 * k:]}"
        lines.append(line)
    return "\n".join(lines) + "\n"


def rtklib_settings(systems):
    """Name: lines of rnx2rtkp's options."""
    sets = [s for n in range(1, len(systems) + 1) for s in itertools.combinations(systems, n)]
    settings = {}
    for used in sets:
        base = f"pos1-navsys={sum(SYSTEMS[s] for s in used)}\npos1-frequency=l1\npos1-posmode=single\npos1-ionoopt=brdc\n" \
               "pos1-tropopt=saas\nout-outhead=off\nout-timesys=gpst\nout-timeform=tow\nout-timendec=3\nout-solformat=llh\n"
        name = "+".join(used)
        for mask in (5, 15, 25, 35):
            settings[f"{name}, mask {mask}"] = base + f"pos1-elmask={mask}\n"
        for cn0 in (25, 30, 35):
            settings[f"{name}, C/N0 {cn0}"] = base + "pos1-elmask=10\npos1-snrmask_r=on\npos1-snrmask_L1=" \
                + ",".join([str(cn0)] * 9) + "\n"
        settings[f"{name}, RAIM"] = base + "pos1-elmask=10\npos1-posopt5=on\n"
    return settings


CANYON_SETTINGS = {f"{weights}, RAIM {raim}, mask {mask}": (weights, raim, mask)
                   for weights, raim, mask in itertools.product(("equal", "elevation", "cn0"), ("true", "false"), (5, 20))}
PROFILES_OWN = ("cn0", "false", 10)  # weights, RAIM and mask of the fixes used by filters


class Drive:
    """One recording, its simulations, and the results of solvers; all results are stored in a folder."""

    def __init__(self, args, name):
        self.name, self.canyon, self.out = name, args.canyon, args.out / name
        self.results = self.out / "results"
        self.results.mkdir(parents=True, exist_ok=True)
        self.program = hashlib.sha1(args.canyon.read_bytes()).hexdigest()[:20]
        self.data = args.data
        scenario(args.data, self.out, name)
        self.truth = Truth(args.data / RECORDINGS[name][3])
        self.recorded = Observations(args.data / RECORDINGS[name][2], [args.data / n for n in RECORDINGS[name][4]], self.truth)
        self.simulated = {}  # (model, seed): Observations

    def kept(self, key, compute):
        """Errors (epochs, 2) [m], computed once."""
        path = self.results / f"{key}.npy"
        if not path.exists():
            errors = compute()
            partly = path.with_name(f"{key}.part.npy")
            np.save(partly, errors.astype(np.float32))
            partly.rename(path)
        return np.load(path)

    def open_scene(self, navigation, receiver, errors):
        latitude, longitude = self.truth.origin
        _, profile, _, truth, _, systems = RECORDINGS[self.name]
        return (f"city: {{open: true, origin: {{latitude_deg: {latitude}, longitude_deg: {longitude}, height_m: 0}}}}\n"
                f"sky: {{navigation: [{', '.join(map(str, navigation))}], systems: [{', '.join(systems)}], errors: {errors}}}\n"
                f"trajectory: {{file: {self.data / truth}, format: urbannav}}\n"
                f"receivers: [{{name: rover, profile: {profile}, {receiver}}}]\nseed: 1\n")

    def forget(self, runs):
        """Removes runs of other programs or scenarios."""
        for old in self.out.glob(runs):
            shutil.rmtree(old)

    def simulate(self, model, seed):
        text = {"Canyon": lambda: scenario_text(self.name),
                "mirror": lambda: scenario_text(self.name, "\n    propagation: {model: mirror}", surroundings="open"),
                "open": lambda: self.open_scene(self.recorded.navigation, "elevation_mask_deg: 5", "true")}[model]()
        text += "outputs: [rinex_observation, rinex_navigation]\n"
        folder = self.out / f"{model}-{seed}-{digest(self.program, text)}"
        if not (folder / "receiver.obs").exists():
            file = self.out / f"{model}-{seed}.yaml"
            file.write_text(text)
            partly = self.out / f"{model}-{seed}.part"
            subprocess.run([self.canyon, "simulate", file, "-o", partly, "--seed", str(seed), "--threads", "1", "--quiet"],
                           check=True, timeout=1200, stderr=subprocess.PIPE)
            self.forget(f"{model}-{seed}-*")
            partly.rename(folder)
        self.simulated[model, seed] = Observations(folder / "receiver.obs", [folder / "sky.nav"], self.truth)

    def add_white(self, seed, sigma_m):
        """The receiver under an open sky, with white noise on its pseudoranges."""
        clean = self.simulated["open", 1]
        folder = self.out / f"white-{seed}-{digest(clean.digest, repr(float(sigma_m)))}"
        if not folder.exists():
            text = with_noise(clean.path.read_text(), sigma_m, np.random.default_rng(seed))
            self.forget(f"white-{seed}-*")
            folder.mkdir()
            (folder / "receiver.obs").write_text(text)
        self.simulated["white", seed] = Observations(folder / "receiver.obs", clean.navigation, self.truth)

    def rtklib(self, observations, options):
        """Errors of rnx2rtkp's fixes."""
        key = digest("rtklib", observations.digest, options)

        def compute():
            conf, pos = self.results / f"{key}.conf", self.results / f"{key}.pos"
            conf.write_text(options)
            subprocess.run(["rnx2rtkp", "-k", conf, "-o", pos, observations.path, *observations.navigation],
                           check=True, timeout=300, capture_output=True)
            rows = [line.split()[1:4] for line in pos.read_text().splitlines() if line[:1] != "%" and len(line.split()) > 6]
            rows = np.array(rows, dtype=float).reshape(-1, 3)
            conf.unlink(), pos.unlink()
            return nearest(observations.t, rows[:, 0], self.truth.metres(rows[:, 1:]) - self.truth.at(rows[:, 0]))
        return self.kept(key, compute)

    def solve(self, observations, setting):
        """Errors of Canyon's fixes, epoch by epoch: `canyon validate` treats the observations as a recording under an open sky, of an
        antenna at the truth's origin. Skylines along a drive would take most of the time."""
        weights, raim, mask = setting
        text = self.open_scene(observations.navigation, f"elevation_mask_deg: {mask}, weights: {{weighting: {weights}}}, "
                               f"raim: {{enabled: {raim}}}, position_filter: {{enabled: false}}, signal: {{enabled: false}}", "false")
        key = digest("canyon", self.program, observations.digest, "standing", text.replace(str(observations.path.parent), ""))

        def compute():
            file, view = self.results / f"{key}.yaml", self.results / f"{key}.view"
            file.write_text(text)
            subprocess.run([self.canyon, "validate", file, "--obs", observations.path, "--truth", "{},{},0".format(*self.truth.origin),
                            "--view", view, "--threads", "1", "--quiet"], check=True, timeout=600, capture_output=True)
            rows = track(view)
            shutil.rmtree(view), file.unlink()
            places = np.stack([rows["error_east_m"], rows["error_north_m"]], axis=1)
            places[rows["status"] != 1] = np.nan
            return nearest(observations.t, rows["tow"], places) - self.truth.at(observations.t)
        return self.kept(key, compute)


class Progress:
    """Runs pieces of work, and prints their progress."""

    def __init__(self, jobs):
        self.jobs, self.start = jobs, time.monotonic()

    def run(self, what, work):
        """`work`: functions without arguments. Returns their results."""
        pause, said = (2 if sys.stderr.isatty() else 30), time.monotonic()
        with concurrent.futures.ThreadPoolExecutor(self.jobs) as pool:
            futures = [pool.submit(w) for w in work]
            try:
                for k, future in enumerate(concurrent.futures.as_completed(futures)):
                    future.result()
                    if time.monotonic() - said > pause:
                        said = time.monotonic()
                        print(f"{what}: {k + 1} of {len(futures)}, {said - self.start:.0f} s", file=sys.stderr, flush=True)
            except BaseException:
                pool.shutdown(cancel_futures=True)
                raise
        return [f.result() for f in futures]


def block_of(t):
    return round(pairs.BLOCK_S / np.median(np.diff(t)))


def of_filters(t, fixes, truth):
    """Metrics of FILTER_FIGURES of each (epoch, filter): error up to 100 m, and whether it is beyond 10, 30 m."""
    error = np.linalg.norm(fix_filters.run(t, fixes) - truth[:, None], axis=2)
    error = np.where(np.isnan(error), 1e9, error)
    return np.minimum(error, 100), error > 10, error > 30


def noises(drive, errors, seeds):
    """Rival: fixes of each seed, at the recorded epochs."""
    t, truth = drive.recorded.t, drive.truth.at(drive.recorded.t)
    sigma = np.nanmedian(np.linalg.norm(errors, axis=1)) / math.sqrt(2 * math.log(2))  # the median of two such axes

    def markov(sigma, correlation, rng):
        kept = correlation(np.diff(t, prepend=t[0] - 1e9))[:, None]
        x, steps = np.zeros_like(truth), rng.normal(0, sigma, truth.shape) * np.sqrt(1 - kept ** 2)
        for k in range(len(t)):
            x[k] = kept[k] * x[k - 1] + steps[k]
        return x
    draws = [np.random.default_rng([seed, 7]) for seed in range(1, seeds + 1)]
    return {"white": [truth + r.normal(0, sigma, truth.shape) for r in draws],
            "Gauss-Markov": [truth + markov(sigma, lambda dt: np.exp(-dt / 30), r) for r in draws],
            "Gazebo": [truth],
            "PX4": [truth + markov(0.016 / math.sqrt(1 - 0.76 ** 2), lambda dt: 0.76 ** (8 * dt), r) for r in draws],
            "ArduPilot": [drive.truth.at(t - 0.1)]}


def judge_filters(drive, seeds):
    """Metrics by model of the 25 filters."""
    recorded = drive.recorded
    errors = drive.solve(recorded, PROFILES_OWN)
    truth = drive.truth.at(recorded.t)
    own = of_filters(recorded.t, truth + errors, truth)
    models = {m: [of_filters(recorded.t, f, truth) for f in fixes] for m, fixes in noises(drive, errors, seeds).items()}
    for model in ("Canyon", "mirror"):
        models[model] = []
        for o in (drive.simulated[model, s] for s in range(1, seeds + 1)):
            at = drive.truth.at(o.t)
            models[model].append(of_filters(o.t, at + drive.solve(o, PROFILES_OWN), at))
    values = {m: [[np.mean(s[f], axis=0) for s in sets] for f in range(3)] for m, sets in models.items()}
    return {"settings": fix_filters.NAMES, "figures": FILTER_FIGURES, **compared(recorded, own, values)}


def compared(recorded, own, values):
    """pairs.compare() of each metric and model."""
    return {"recorded": [np.mean(v, axis=0) for v in own], "simulated": {m: [np.mean(x, axis=0) for x in v] for m, v in values.items()},
            "models": {m: [pairs.compare(own[f].astype(float), np.array(v[f]), block_of(recorded.t)) for f in range(3)]
                       for m, v in values.items()}}


def judge_settings(drive, solve, settings, models, seeds):
    """Metrics by model of settings. `solve(observations, setting)` returns errors."""
    def within(observations):
        errors = np.stack([np.linalg.norm(solve(observations, s), axis=1) for s in settings.values()], axis=1)
        return [np.where(np.isnan(errors), np.inf, errors) <= reach for reach in REACHES_M]
    own = within(drive.recorded)
    values = {}
    for m in models:
        seen = [within(drive.simulated[m, s]) for s in range(1, seeds + 1)]
        values[m] = [[np.mean(s[f], axis=0) for s in seen] for f in range(3)]
    return {"settings": list(settings), "figures": [f"within {r} m" for r in REACHES_M], **compared(drive.recorded, own, values)}


def share(value):
    return "-" if value is None or math.isnan(value) else f"{value:.2f}".replace("0.", ".", 1)


def table(judged):
    """The table of the page, followed by pooled fractions."""
    models = ["Canyon", *RIVALS]
    lines = ["| recording | of | decided pairs | " + " | ".join(models) + " | covered | tau; perfect |",
             "|" + "---|" * (len(models) + 5)]
    pooled = {}
    for name, tests in judged.items():
        for test, found in tests.items():
            own = found["models"]["Canyon"]
            cells = []
            for m in models:
                figures = found["models"].get(m)
                cells.append(" ".join(share(f["agreement"]) for f in figures) if figures else "-")
                for k, f in enumerate(figures or []):
                    if f["decided"]:
                        right, all_ = pooled.setdefault((test, k, m), (0, 0))
                        pooled[test, k, m] = right + f["agreement"] * f["decided"], all_ + f["decided"]
            first = own[0]
            lines.append(f"| {name} | {test} | {' '.join(str(f['decided']) for f in own)} | {' | '.join(cells)} | "
                         f"{share(first['coverage'])} | {share(first['tau'])}; {share(first['ceiling'])} |")
    for test in dict.fromkeys(t for t, _, _ in pooled):
        def all_of(m):
            found = [pooled.get((test, k, m)) for k in range(3)]
            return " ".join(share(f[0] / f[1]) if f else "-" for f in found) if any(found) else "-"
        counts = " ".join(str(pooled.get((test, k, "Canyon"), (0, 0))[1]) for k in range(3))
        lines.append(f"| all | {test} | {counts} | " + " | ".join(map(all_of, models)) + " | | |")
    return "\n".join(lines)


def chance(judged):
    """Agreement of the odd and of the even seeds alone: the effect of chance on a metric."""
    lines = ["", "Canyon's odd and even seeds alone, at the first figure:"]
    for name, tests in judged.items():
        lines.append(f"{name}: " + ", ".join(f"{t} " + " ".join(share(h) for h in f["models"]["Canyon"][0]["halves"])
                                             for t, f in tests.items()))
    return "\n".join(lines)


def judge(args):
    progress, seeds = Progress(args.jobs), range(1, args.seeds + 1)
    drives = [Drive(args, name) for name in args.only]
    progress.run("simulating", [lambda d=d, m=m, s=s: d.simulate(m, s) for d in drives
                                for m, s in [*itertools.product(("Canyon", "mirror"), seeds), ("open", 1)]])
    trial_m = 10

    def white(d):
        """Noise of pseudoranges that results in the recorded median error."""
        d.add_white(0, trial_m)
        own, trial = (np.nanmedian(np.linalg.norm(d.solve(o, PROFILES_OWN), axis=1)) for o in (d.recorded, d.simulated["white", 0]))
        for s in seeds:
            d.add_white(s, trial_m * own / trial)
    progress.run("noise", [lambda d=d: white(d) for d in drives])
    keep = slice(None, None, 7 if args.quick else 1)
    rtklib = {d.name: dict(list(rtklib_settings(RECORDINGS[d.name][5]).items())[keep]) for d in drives}
    canyon = dict(list(CANYON_SETTINGS.items())[slice(None, None, 5 if args.quick else 1)])
    work = []
    for model in ("recorded", "Canyon", "mirror", "white"):
        for d in drives:
            for o in [d.recorded] if model == "recorded" else [d.simulated[model, s] for s in seeds]:
                work += [lambda d=d, o=o, s=s: d.rtklib(o, s) for s in rtklib[d.name].values()]
                if model != "white":
                    work.append(lambda d=d, o=o: d.solve(o, PROFILES_OWN))
                if model in ("recorded", "Canyon"):
                    work += [lambda d=d, o=o, s=s: d.solve(o, s) for s in canyon.values()]
    progress.run("solving", work)
    judged = {}
    for d in drives:
        judged[d.name] = {"filters": judge_filters(d, args.seeds),
                          "RTKLIB": judge_settings(d, d.rtklib, rtklib[d.name], ("Canyon", "mirror", "white"), args.seeds),
                          "Canyon": judge_settings(d, d.solve, canyon, ("Canyon",), args.seeds)}
    return judged


def main():
    parser = judge_arguments(__doc__, 10)
    parser.add_argument("--only", nargs="+", choices=RECORDINGS, default=list(RECORDINGS))
    parser.add_argument("--jobs", type=int, default=2, help="parallel programs")
    parser.add_argument("--quick", action="store_true")
    args = parser.parse_args()
    if args.quick:
        args.seeds, args.only = 2, ["tst-19-m8t"]
    if args.seeds < 2:
        parser.error("at least two seeds")
    if not shutil.which("rnx2rtkp") or not all((args.data / RECORDINGS[n][2]).exists() for n in args.only):
        print(f"SKIPPED: rnx2rtkp or the recordings in {args.data} are missing")
        return 77
    judged = judge(args)
    print(table(judged))
    print(chance(judged))
    (args.out / "transfer.json").write_text(json.dumps(judged, indent=1, default=lambda a: a.tolist()) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
