#!/usr/bin/env python3
"""Judge: what does one drive teach of a street? docs/results.md has the results.

    learn.py CANYON DATA OUT [--seeds 4] [--map] [--picture FILE.svg]

CANYON is the program, DATA the folder of the recordings (urbannav-tst-20190428, urbannav-tst-20210517, hongkong), OUT a
folder for the runs. `canyon validate --view` gives every satellite and epoch, recorded and simulated. A field of dB over
place, azimuth, elevation and visibility is learned from a drive and judged on another: bits an observation of tracked or
not, AUC, CRPS of C/N0 and of the horizontal error, against the same without the field. --map: the calibration knows
the openness of the place and whether the car stands, too. With NumPy; ten minutes of a core.

    /usr/bin/python3 learn.py --self-test      checks the statistics; ctest runs this

Exit status: 0 done, 1 self-test failed, 2 bad input, 77 NumPy or data missing.
"""
import gzip
import json
import math
import struct
import subprocess
import sys
from pathlib import Path

from transfer import judge_arguments

try:
    import numpy as np
except ImportError:
    print("numpy is missing")
    sys.exit(77)

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
T19, T21 = "urbannav-tst-20190428", "urbannav-tst-20210517"
# Recording: scenario, profile, observations; the city's place by `canyon validate --align`, east and north [m].
RECORDINGS = {
    "m8t-2019": ("urbannav_tst_m8t.yaml", "ublox-m8t", f"{T19}/COM3_190428_124409.obs", (-2.0, 7.75)),
    "f9p": ("urbannav_tst_2021.yaml", "ublox-f9p", f"{T21}/20210517.light-urban.tste.ublox.f9p.splitter.obs", (0.6, 4.35)),
    "m8t": ("urbannav_tst_2021.yaml", "ublox-m8t", f"{T21}/20210517.light-urban.tste.ublox.m8t.GC.obs", (0.6, 4.35)),
    "phone": ("urbannav_tst_2021.yaml", "phone", f"{T21}/20210517.light-urban.tste.google.pixel4.obs", (0.6, 4.35)),
}
CAR = ("f9p", "m8t", "phone")  # the receivers of one car, 2021: two laps of the loop of 2019
# Part: seconds from the drive's begin, and the other part. The second lap begins after 384 s.
PARTS = {"": (0, 1e9, ""), "lap 1": (0, 384, "lap 2"), "lap 2": (384, 1e9, "lap 1"),
         "half 1": (0, 243, "half 2"), "half 2": (243, 1e9, "half 1")}
MASK_DEG = 10
# The field's prior: deviations [dB] of what depends on the place alone and on the direction, lengths [m, deg], the share
# that satellites in sight and hidden ones have in common; observations of a cell count as 3 at most. Chosen beforehand.
PLACE_DB, DIRECTION_DB, LENGTH_M, AZIMUTH_DEG, ELEVATION_DEG, COMMON, MOST = 1.5, 3.5, 30.0, 25.0, 15.0, 0.3, 3.0
PRIOR = PLACE_DB**2 + DIRECTION_DB**2
SLOPES = (0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4)  # of the logit, for each dB of the field
SHARES = (0, 0.3, 0.6, 1)  # of the field's dB in a receiver's C/N0
cdf = np.vectorize(lambda z: math.erfc(-z / math.sqrt(2)) / 2, otypes=[float])


def expit(x):
    return 1 / (1 + np.exp(-np.clip(x, -40, 40)))


def chunk(header, path):
    """The tables of a chunk of a view (docs/view-format.md)."""
    data, tables = gzip.open(path).read(), {}
    count = struct.unpack_from("<I", data, 8)[0]
    at = 16 + 8 * count
    for k in range(count):
        index, rows = struct.unpack_from("<II", data, 16 + 8 * k)
        table = tables[header["tables"][index]["name"]] = {}
        for column in header["tables"][index]["columns"]:
            at, kind, width = (at + 7) // 8 * 8, column["type"], column.get("values", 1)
            kind = np.dtype(f"<{kind[0]}{int(kind[1:]) // 8}")
            values = np.frombuffer(data, kind, rows * width, at)
            table[column["name"]] = values.reshape(rows, width) if width > 1 else values
            at += rows * width * kind.itemsize
    return tables


def view(folder):
    """Of the recorded and of the simulated receiver: epochs (with `skylines`), satellites; and the satellites' names."""
    header = json.loads((folder / "view.json").read_text())
    sides = []
    for r in (0, 1):
        chunks = [chunk(header, folder / c["file"]) for c in header["chunks"] if c.get("receiver") == r]
        epochs = {k: v for c in chunks for n in ("epochs", "skylines") for k, v in c.get(n, {}).items()}
        blocks = [c["satellites"] for c in chunks if "satellites" in c]
        sides.append((epochs, {k: np.concatenate([b[k] for b in blocks]) for k in blocks[0]}))
    return sides, [s["id"] for s in header["satellites"]]


def table(folders, shift):
    """A row for each satellite above the mask, of those that the recording tracks, and epoch; and the epochs' errors."""
    simulated = []
    for folder in folders:
        ((e, s), (se, ss)), names = view(folder)
        row = {key: k for k, key in enumerate(zip(ss["epoch"], ss["satellite"]))}
        at = np.array([row.get(key, -1) for key in zip(s["epoch"], s["satellite"])])
        simulated.append((np.where(at < 0, np.nan, (ss["flags"] & 4 > 0)[at]), np.where(at < 0, np.nan, ss["cn0_dbhz"][at]),
                          np.where(se["status"] == 1, np.hypot(se["error_east_m"], se["error_north_m"]), np.nan)))
    k = s["epoch"].astype(int)
    sky = e["elevation"][e["skyline"]] / 2.0
    speed = np.hypot(np.gradient(e["east_m"]), np.gradient(e["north_m"]))
    east, north = e["east_m"] + shift[0], e["north_m"] + shift[1]
    t = {"time": e["time_s"][k], "sat": np.array(names)[s["satellite"]], "east": east[k], "north": north[k],
         "az": s["azimuth_deg"].astype(float), "el": s["elevation_deg"].astype(float), "los": s["visibility"] < 2,
         "tracked": s["flags"] & 4 > 0, "cn0": s["cn0_dbhz"].astype(float), "open": sky.mean(1)[k], "stands": (speed < 0.5)[k],
         "top": sky[k, (s["azimuth_deg"] // 3).astype(int) % 120],
         "p": (sum(a for a, _, _ in simulated) + 0.5) / (len(folders) + 1), "draws": np.array([b for _, b, _ in simulated]).T}
    heard = {name for name in set(t["sat"]) if t["tracked"][t["sat"] == name].sum() >= 20}
    keep = np.isin(t["sat"], list(heard)) & np.isfinite(t["p"]) & (t["el"] >= MASK_DEG)
    fixes = {"time": e["time_s"], "east": east, "north": north, "draws": np.array([c for _, _, c in simulated]).T,
             "error": np.where(e["status"] == 1, np.hypot(e["error_east_m"], e["error_north_m"]), np.nan)}
    return {c: v[keep] for c, v in t.items()}, fixes


def part(t, name):
    keep = (t["time"] >= PARTS[name][0]) & (t["time"] < PARTS[name][1])
    return {c: v[keep] for c, v in t.items()}


def features(t, more=False, satellites=()):
    """What a calibration knows: elevation and margin over the map's skyline by visibility, system, simulated share."""
    los, hidden, el = t["los"] * 1.0, 1.0 - t["los"], t["el"]
    margin = np.clip((el - t["top"]) / 20, -2, 2)
    columns = [np.ones_like(el), los, margin * los, margin * hidden, np.char.startswith(t["sat"].astype(str), "C") * 1.0,
               np.log(t["p"] / (1 - t["p"]))]
    for hat in [np.clip(1 - np.abs(el - c) / 15, 0, 1) for c in (30, 45, 60)] + [np.clip((el - 60) / 15, 0, 1)]:
        columns += [hat * los, hat * hidden]
    if more:
        openness = (t["open"] - 30) / 15
        columns += [openness * los, openness**2 * los, openness * hidden, openness**2 * hidden, t["stands"] * los, t["stands"] * hidden]
    return np.column_stack(columns + [(t["sat"] == s) * 0.55 for s in satellites])


def ridge(columns, scale=1.0):
    r = np.full(columns, 0.3 * scale)
    r[0] = 1e-3 * scale
    return np.diag(r)


def logistic(x, y, weight=0.1):
    b, r = np.zeros(x.shape[1]), ridge(x.shape[1])
    for _ in range(30):
        p = expit(x @ b)
        b = b + np.linalg.solve((x.T * (weight * p * (1 - p))) @ x + r, weight * x.T @ (y - p) - r @ b)
    return b


def linear(x, y, weight=0.1):
    return np.linalg.solve(weight * x.T @ x + ridge(x.shape[1], 0.07), weight * x.T @ y)


def mills(z):
    """phi(z) / Phi(z)."""
    low = z < -8
    return np.where(low, -z - 1 / np.minimum(z, -1), np.exp(-z * z / 2) / math.sqrt(2 * math.pi) / np.maximum(cdf(z), 1e-300))


def censored(t):
    """A receiver's C/N0 as a linear model with normal deviations, censored where it does not track (EM): mean, deviation,
    threshold [dB-Hz]. Satellites have levels of their own, so that no place learns these."""
    x, seen = features(t, False, sorted(set(t["sat"]))), t["tracked"] & np.isfinite(t["cn0"])
    threshold, sigma = np.quantile(t["cn0"][seen], 0.1), 6.0
    mean = x @ linear(x[seen], t["cn0"][seen])
    for _ in range(60):
        z = (threshold - mean) / sigma
        y = np.where(seen, t["cn0"], mean - sigma * mills(z))
        spread = np.where(seen, 0.0, sigma**2 * (1 - z * mills(z) - mills(z) ** 2))
        mean = x @ np.linalg.solve(0.1 * x.T @ x + ridge(x.shape[1], sigma**2 / 16), 0.1 * x.T @ y)
        sigma = math.sqrt(np.mean((y - mean) ** 2 + spread))
    return mean, sigma, threshold


def cells(t, metres, degrees):
    """Mean place, azimuth, elevation and visibility of each cell; the cell of each row; rows of each cell."""
    key = np.column_stack([t["east"] // metres, t["north"] // metres, t["az"] // degrees, t["el"] // degrees, t["los"]])
    key, cell, count = np.unique(key, axis=0, return_inverse=True, return_counts=True)

    def mean(v):
        return np.bincount(cell, v) / count
    az = np.radians(t["az"])
    centres = [mean(t["east"]), mean(t["north"]), np.arctan2(mean(np.sin(az)), mean(np.cos(az))), mean(t["el"]), key[:, 4]]
    return np.column_stack(centres), cell, count


def kernel(a, b):
    a, b = a.astype(np.float32), b.astype(np.float32)
    d = np.hypot(a[:, None, 0] - b[None, :, 0], a[:, None, 1] - b[None, :, 1])
    turn = (np.cos(a[:, None, 2] - b[None, :, 2]) - 1) / math.radians(AZIMUTH_DEG) ** 2
    rise = (a[:, None, 3] - b[None, :, 3]) ** 2 / (2 * ELEVATION_DEG**2)
    return np.exp(-d / LENGTH_M) * np.where(a[:, None, 4] == b[None, :, 4], 1, COMMON) * (PLACE_DB**2 + DIRECTION_DB**2 * np.exp(turn - rise))


class Field:
    """The street: posterior of dB by Laplace's method. Tracked rows have normal C/N0, others one below the threshold."""

    def __init__(self, t, moved=0.0):
        mean, sigma, threshold = censored(t)
        noise = math.sqrt(max(sigma**2 - PRIOR, 9.0))
        self.cells, cell, count = cells(move(t, moved) if moved else t, 15, 15)
        n, weight, seen = len(count), np.minimum(1, MOST / count)[cell], t["tracked"] & np.isfinite(t["cn0"])
        k, f = kernel(self.cells, self.cells), np.zeros(len(count))
        for _ in range(20):
            at = mean + f[cell]
            z = (threshold - at) / noise
            m = mills(z)
            slope = np.where(seen, (np.where(seen, t["cn0"], 0) - at) / noise**2, -m / noise) * weight
            bend = np.where(seen, 1, m * (z + m)) / noise**2 * weight
            w = np.bincount(cell, bend, n) + 1e-9
            s = np.sqrt(w)
            b = np.eye(n) + s[:, None] * k * s
            a = w * f + np.bincount(cell, slope, n)
            a -= s * np.linalg.solve(b, s * (k @ a))
            change, f = np.abs(k @ a - f).max(), k @ a
            if change < 0.05:
                break
        self.a, self.q = a, s[:, None] * np.linalg.inv(b) * s

    def at(self, t):
        """Mean and variance [dB, dB^2] for each row."""
        c, cell, _ = cells(t, 10, 10)
        k = kernel(c, self.cells)
        return (k @ self.a)[cell], np.maximum(PRIOR - ((k @ self.q) * k).sum(1), 1e-6)[cell]


def move(t, metres):
    """The placebo: what was seen here is said to have been seen `metres` farther along the way."""
    _, first, epoch = np.unique(t["time"], return_index=True, return_inverse=True)
    east, north = t["east"][first], t["north"][first]
    way = np.concatenate([[0], np.cumsum(np.hypot(np.diff(east), np.diff(north)))])
    there = (way + metres) % way[-1]
    return {**t, "east": np.interp(there, way, east)[epoch], "north": np.interp(there, way, north)[epoch]}


def auc(p, y):
    order = np.argsort(p, kind="stable")
    _, first, tie, count = np.unique(p[order], return_index=True, return_inverse=True, return_counts=True)
    rank = np.empty(len(p))
    rank[order] = (first + (count + 1) / 2)[tie]
    return (rank[y].sum() - y.sum() * (y.sum() + 1) / 2) / (y.sum() * (~y).sum())


def bits(p, y):
    return np.log2(np.where(y, p, 1 - p))


def crps(y, mean, sd):
    """Of a normal distribution."""
    z = (y - mean) / sd
    return sd * (z * (2 * cdf(z) - 1) + np.sqrt(2 / np.pi) * np.exp(-z * z / 2) - 1 / math.sqrt(math.pi))


def crps_draws(y, draws):
    """Mean over the rows with two draws or more; the fair estimator."""
    n, y = np.isfinite(draws).sum(1), y[:, None]
    keep = n >= 2
    n, y, draws = n[keep], y[keep], draws[keep]
    apart = np.nansum(np.abs(draws[:, :, None] - draws[:, None, :]), (1, 2)) / (2 * n * (n - 1))
    return (np.nanmean(np.abs(draws - y), 1) - apart).mean()


def interval(v, time, draws=400, block_s=30):
    """Mean of v with its central 90 % over bootstrap samples of blocks of time."""
    _, block = np.unique(time // block_s, return_inverse=True)
    total, count = np.bincount(block, v), np.bincount(block)
    pick = np.random.default_rng(1).integers(0, len(count), (draws, len(count)))
    return v.mean(), *np.quantile(total[pick].sum(1) / count[pick].sum(1), (0.05, 0.95))


def row(*cells):
    print("| " + " | ".join(map(str, cells)) + " |", flush=True)


def judge(name, field, train, test, more, own):
    """One line: `test` by a calibration on `train`, without and with the field; slope and share are fitted on `train`, unless
    it is the field's `own` source."""
    b = logistic(features(train, more), train["tracked"])
    train, test = ({**t, **dict(zip(("mean", "variance"), field.at(t)))} for t in (train, test))

    def tracked(t, slope):
        """The prior's variance is in the calibration already: where nothing was learned, p is the calibration's."""
        x = features(t, more) @ b * math.sqrt(1 + math.pi / 8 * slope**2 * PRIOR) + slope * t["mean"]
        return expit(x / np.sqrt(1 + math.pi / 8 * slope**2 * t["variance"]))
    slope = max((0.2,) if own else SLOPES, key=lambda s: bits(tracked(train, s), train["tracked"]).mean())
    y, p0, p1 = test["tracked"], tracked(test, 0), tracked(test, slope)
    gain = interval(bits(p1, y) - bits(p0, y), test["time"])

    heard, ours = ({c: v[t["tracked"] & np.isfinite(t["cn0"])] for c, v in t.items()} for t in (test, train))
    level = linear(features(ours, more), ours["cn0"])
    spread = {los: (ours["cn0"] - features(ours, more) @ level)[ours["los"] == los].std() for los in (True, False)}

    def strength(t, share):
        sd = np.where(t["los"], spread[True], spread[False])
        return features(t, more) @ level + share * t["mean"], np.sqrt(np.maximum(sd**2 - share**2 * (PRIOR - t["variance"]), 0.3 * sd**2))
    share = max((0.6,) if own else SHARES, key=lambda s: -crps(ours["cn0"], *strength(ours, s)).mean())
    (m0, s0), (m1, s1) = strength(heard, 0), strength(heard, share)
    c0, c1 = crps(heard["cn0"], m0, s0), crps(heard["cn0"], m1, s1)
    less = interval((c0 - c1) / c0.mean() * 100, heard["time"])
    covered = [np.mean(np.abs(heard["cn0"] - m) < 1.645 * s) * 100 for m, s in ((m0, s0), (m1, s1))]
    row(name, len(y), f"{-bits(test['p'], y).mean():.2f}, {-bits(p0, y).mean():.2f}", f"{slope:.2f}", "{:+.3f} ({:+.3f} to {:+.3f})".format(*gain),
        f"{auc(test['p'], y):.2f}, {auc(p0, y):.2f}, {auc(p1, y):.2f}", f"{share:.1f}",
        f"{crps_draws(heard['cn0'], heard['draws']):.2f}, {c0.mean():.2f}, {c1.mean():.2f}", "{:+.0f} % ({:+.0f} to {:+.0f})".format(*less),
        f"{covered[0]:.0f}, {covered[1]:.0f}", f"{s1.mean() / s0.mean():.2f}", f"{1 - test['variance'].mean() / PRIOR:.2f}")


def judge_fixes(name, source, train, test, own):
    """One line: log errors of fixes, normal by the test receiver's own `train`, without and with the places of `source`."""
    def good(t):
        keep = np.isfinite(t["error"]) & (np.isfinite(t["draws"]).sum(1) >= 2)
        return {c: v[keep] for c, v in t.items()}
    source, train, test = good(source), good(train), good(test)
    logs, line = {}, {}
    for key, t in (("source", source), ("train", train), ("test", test)):
        x = np.column_stack([np.ones(len(t["error"])), np.log(np.nanmedian(t["draws"], 1) + 0.5)])
        logs[key], line[key] = np.log(t["error"] + 0.1), x
    line_of = {key: linear(line[key], logs[key]) for key in ("source", "train")}
    rest = logs["source"] - line["source"] @ line_of["source"]
    key, cell, count = np.unique(np.column_stack([source["east"] // 15, source["north"] // 15]), axis=0, return_inverse=True, return_counts=True)
    places, variance = (key + 0.5) * 15, rest.var()

    def k(a, b):
        return 0.7 * variance * np.exp(-np.hypot(a[:, None, 0] - b[None, :, 0], a[:, None, 1] - b[None, :, 1]) / LENGTH_M)
    weight = np.linalg.solve(k(places, places) + np.diag(0.3 * variance / np.minimum(count, MOST)), np.bincount(cell, rest) / count)
    sd = (logs["train"] - line["train"] @ line_of["train"]).std()
    quantiles = (np.arange(99) + 1) / 100
    normal = np.interp(quantiles, cdf(np.linspace(-5, 5, 2001)), np.linspace(-5, 5, 2001))

    def score(t, key, share):
        at = line[key] @ line_of["train"] + share * (k(np.column_stack([t["east"], t["north"]]), places) @ weight)
        off = t["error"][:, None] - np.exp(at[:, None] + sd * normal)
        return 2 * np.maximum(quantiles * off, (quantiles - 1) * off).mean(1)
    share = max((0.6,) if own else SHARES, key=lambda s: -score(train, "train", s).mean())
    c0, c1 = score(test, "test", 0), score(test, "test", share)
    less = interval((c0 - c1) / c0.mean() * 100, test["time"])
    row(name, len(c0), f"{share:.1f}", f"{crps_draws(test['error'], test['draws']):.1f}, {c0.mean():.1f}, {c1.mean():.1f}",
        "{:+.0f} % ({:+.0f} to {:+.0f})".format(*less))


def simulate(canyon, data, out, seeds):
    """Runs `canyon validate` of all recordings by these seeds; the tables by recording."""
    out.mkdir(parents=True, exist_ok=True)
    for folder in ("hongkong", T19, T21):
        if not (out / folder).exists():
            (out / folder).symlink_to((data / folder).resolve())
    entries = []
    for name, (scenario, profile, obs, (east, north)) in RECORDINGS.items():
        text = (EXAMPLES / scenario).read_text()
        assert "{east_m: 0, north_m: 8," in text
        (out / scenario).write_text(text.replace("{east_m: 0, north_m: 8,", f"{{east_m: {east}, north_m: {north},"))
        entries.append(f"- {{name: {name}, scenario: {scenario}, profile: {profile}, obs: {obs}}}\n")
    (out / "list.yaml").write_text("recordings:\n" + "".join(entries))
    for seed in seeds:
        if not (out / str(seed)).exists():
            subprocess.run([canyon, "validate", out / "list.yaml", "--part", "all", "--all-satellites", "--seed", str(seed), "--quiet",
                            "--view", out / str(seed)], check=True, timeout=1200, stdout=subprocess.DEVNULL)
    return {name: table([out / str(s) / name for s in seeds], r[3]) for name, r in RECORDINGS.items()}


def picture(path, field, t):
    """An SVG: the field along the way of `t`, a rose every 60 m for clear satellites at 30 deg; red is weaker, paler less sure."""
    _, first = np.unique(np.column_stack([t["east"] // 60, t["north"] // 60]), axis=0, return_index=True)
    az, n = np.tile(np.arange(0, 360, 15.0), len(first)), 24
    east, north = np.repeat(t["east"][first], n), np.repeat(t["north"][first], n)
    db, variance = field.at({"east": east, "north": north, "az": az, "el": 30 + 0 * az, "los": az >= 0})
    low, high = np.array([east.min(), north.min()]) - 80, np.array([east.max(), north.max()]) + 80
    scale = 820 / (high - low).max()
    size = (high - low) * scale
    svg = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {size[0]:.0f} {size[1] + 30:.0f}" font-family="sans-serif" font-size="13">',
           f'<rect width="{size[0]:.0f}" height="{size[1] + 30:.0f}" fill="white"/>']
    for e, v, a, d, s2 in zip(east, north, az, db, variance):
        x, y = (e - low[0]) * scale, size[1] - (v - low[1]) * scale
        rim = [(x + 28 * scale * math.sin(b), y - 28 * scale * math.cos(b)) for b in np.radians([a - 7.5, a + 7.5])]
        colour = "#c0392b" if d < 0 else "#2468a2"
        svg.append(f'<path d="M{x:.1f} {y:.1f}L{rim[0][0]:.1f} {rim[0][1]:.1f}L{rim[1][0]:.1f} {rim[1][1]:.1f}Z" fill="{colour}" '
                   f'fill-opacity="{min(1, abs(d) / 6) * max(0, 1 - s2 / PRIOR):.2f}" stroke="#ddd" stroke-width="0.3"/>')
    svg.append(f'<text x="10" y="{size[1] + 4:.0f}">Red: up to 6 dB weaker than the calibration says, blue: stronger, by direction.</text>'
               f'<text x="10" y="{size[1] + 22:.0f}">Pale: as it says, or not known. Roses have a radius of 28 m.</text></svg>')
    Path(path).write_text("\n".join(svg) + "\n")


def self_test():
    near = math.isclose
    assert near(crps(0.0, 0.0, 1.0), (math.sqrt(2) - 1) / math.sqrt(math.pi)) and near(crps_draws(np.zeros(1), np.array([[-1.0, 1.0]])), 0)
    assert near(auc(np.array([0.1, 0.4, 0.35, 0.8]), np.array([False, False, True, True])), 0.75)
    assert near(auc(np.full(4, 0.5), np.array([False, True, False, True])), 0.5) and near(bits(np.array([0.25]), np.array([True]))[0], -2)
    assert np.allclose(mills(np.array([0.0, -8 - 1e-9, -30])), [math.sqrt(2 / math.pi), 8.121, 30.033], rtol=2e-3)
    assert interval(np.full(90, 2.0), np.arange(90.0)) == (2, 2, 2)
    # A street of 600 m, twenty satellites; between 200 and 300 m something takes 12 dB in the east.
    rng, n = np.random.default_rng(1), 20
    east, k = np.repeat(np.arange(0, 600, 5.0), n), np.tile(np.arange(n), 120)
    t = {"time": east / 4, "sat": np.array([f"G{i:02}" for i in range(n)])[k], "east": east, "north": 0 * east, "az": 18.0 * k + 3,
         "el": 20 + 3.0 * (k % 5), "los": k >= 0, "top": 0 * east, "p": 0.5 + 0 * east}
    lost = (east > 200) & (east < 300) & (t["az"] > 45) & (t["az"] < 135)
    strength = 30 + rng.normal(0, 3, len(east)) - 12 * lost
    t.update(tracked=strength > 22, cn0=np.where(strength > 22, strength, np.nan))
    field = Field(t)
    mean, variance = field.at(t)
    assert mean[lost].mean() < -5 and abs(mean[~lost].mean()) < 1.5 and variance.max() < PRIOR
    away = {**t, "east": east + 5000}
    assert np.allclose(field.at(away), [[0], [PRIOR]], atol=1e-3)  # nothing is known of another place
    assert np.corrcoef(Field(t, 200).at(t)[0], lost)[0, 1] > -0.2 > -0.6 > np.corrcoef(mean, lost)[0, 1]
    print("statistics are right")


def main():
    if sys.argv[1:] == ["--self-test"]:
        self_test()
        return 0
    parser = judge_arguments(__doc__, 4)
    parser.add_argument("--map", action="store_true")
    parser.add_argument("--picture", type=Path, help="the field of the drive of 2019 as an SVG, and nothing else")
    args = parser.parse_args()
    if not all((args.data / r[2]).exists() for r in RECORDINGS.values()):
        print("the recordings are missing")
        return 77
    tables = simulate(args.canyon, args.data, args.out, range(1, args.seeds + 1))
    if args.picture:
        drive = tables["m8t-2019"][0]
        picture(args.picture, Field(drive), drive)
        return 0
    tests = [("m8t-2019", "", r, lap) for r in CAR for lap in ("lap 2", "lap 1")]                     # another day
    tests += [(r, "", "m8t-2019", half) for r in CAR for half in ("half 1", "half 2")]
    tests += [(a, "lap 1", b, "lap 2") for a in CAR for b in CAR]                                      # the next lap
    tests += [(a, "lap 2", b, "lap 2") for a in CAR for b in CAR if a != b]                            # the same time
    row("learned from, judged on", "rows", "bits lost: simulated, calibrated", "slope", "gain, bits (90 %)", "AUC: simulated, calibrated, learned",
        "share", "CRPS of C/N0 [dB]: simulated, calibrated, learned", "less (90 %)", "covered by 90 %: calibrated, learned", "width", "known")
    row(*["---"] * 12)
    for moved in (0, 400):
        fields = {}
        for a, of, b, which in tests[:12] if moved else tests:
            (ta, _), (tb, _) = tables[a], tables[b]
            field = fields.get((a, of)) or fields.setdefault((a, of), Field(part(ta, of), moved))
            judge(f"{a} {of} -> {b} {which}" + (", moved" if moved else ""), field, part(tb, PARTS[which][2]), part(tb, which),
                  args.map, a == b)
    print()
    row("learned from, judged on", "epochs", "share", "CRPS of the horizontal error [m]: simulated, calibrated, learned", "less (90 %)")
    row(*["---"] * 5)
    for a, of, b, which in tests:
        (_, ta), (_, tb) = tables[a], tables[b]
        judge_fixes(f"{a} {of} -> {b} {which}", part(ta, of), part(tb, PARTS[which][2]), part(tb, which), a == b)
    return 0


if __name__ == "__main__":
    sys.exit(main())
