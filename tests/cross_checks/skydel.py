#!/usr/bin/env python3
"""Compares Canyon's pseudoranges, Dopplers and delays with the tables of a commercial simulator (Skydel).

    skydel.py CANYON [DATA]

DATA is ../shared/data/skydel-20230108. Prints the tables of docs/results.md. Exits with 1 if a metric exceeds its
limit, with 77 without DATA.
"""
import bisect
import csv
import gzip
import math
import os
import statistics
import subprocess
import sys
import tempfile

# Skydel's name, Canyon's system and signal, carrier; required agreement: pseudorange [m], Doppler [Hz], ionosphere [m].
# Skydel's peculiarities: E5a has all of gamma BGD, GLONASS's records have no drift, B2a's ionosphere is not scaled, C01 to
# C05, C59 and C60 are another orbit, elevations in its troposphere are geocentric (DATA/README.md). SBAS: records of
# 09:59, with satellites marked healthy, for 6 minutes.
SIGNALS = [
    ("L1CA", "G", "L1CA", 1e-3, 1e-3, .10), ("L1C", "G", "L1C", 1e-3, 1e-3, .10), ("L2C", "G", "L2C", 1e-3, 1e-3, .15),
    ("L5", "G", "L5", 1e-3, 1e-3, .15),
    ("E1", "E", "E1", 1e-3, 1e-3, .10), ("E5a", "E", "E5a", 4, 1e-3, .15), ("E5b", "E", "E5b", 1e-3, 1e-3, .15),
    ("QZSSL1CA", "J", "L1CA", 1e-3, 1e-3, .10), ("QZSSL1C", "J", "L1C", 1e-3, 1e-3, .10),
    ("QZSSL2C", "J", "L2C", 1e-3, 1e-3, .15), ("QZSSL5", "J", "L5", 1e-3, 1e-3, .15),
    ("B1", "C", "B1I", 1e-3, 1e-3, .20), ("B1C", "C", "B1C", 1e-3, 1e-3, .20), ("B2", "C", "B2I", 1e-3, 1e-3, .30),
    ("B2a", "C", "B2a", 1e-3, 1e-3, None),
    ("G1", "R", "G1", 4, 1e-2, None), ("SBASL1", "S", "L1CA", .2, .2, .10),
]
GEOSTATIONARY = {"C01", "C02", "C03", "C04", "C05", "C59", "C60"}
BANDS = [9, 12, 15, 20, 30, 45, 90]
MOST_TROPOSPHERE_M = .08

SCENARIO = """
city: {{open: true, origin: {{latitude_deg: 30, longitude_deg: 95, height_m: 0}}}}
sky:
  navigation: [{files}]
  systems: [GPS, GLONASS, Galileo, BeiDou, QZSS, SBAS]
  errors: {{enabled: false}}
start: 2023-01-08T10:00:00 GPST
duration_s: 14400
rate_hz: {rate}
trajectory: {{position: {{latitude_deg: 30, longitude_deg: 95, height_m: 0}}}}
receivers:
  - name: r
    profile: ideal
    tracks: [L1CA, L1C, L2C, L5, G1, G2, E1, E5a, E5b, B1I, B1C, B2I, B2a]
    ionosphere: {atmosphere}
    troposphere: {atmosphere}
outputs: [signals_csv]
"""


def simulate(canyon, data, folder, atmosphere):
    """Canyon's signals by time of week, satellite and name."""
    files = []
    for name in sorted(os.listdir(data)):
        if not name.startswith("SkydelRINEX") or "_IN." in name:
            continue
        with gzip.open(os.path.join(data, name), "rt") as source:
            lines = source.read().splitlines()
        if "_SN." in name:  # mark its satellites healthy
            lines = [x[:61] + " 0.000000000000E+00" if lines[i - 1].startswith("S") else x for i, x in enumerate(lines)]
        files.append(os.path.join(folder, name[:-3]))
        with open(files[-1], "w", encoding="utf-8") as copy:
            copy.write("\n".join(lines) + "\n")
    scenario = os.path.join(folder, "skydel.yaml")
    with open(scenario, "w", encoding="utf-8") as out:
        out.write(SCENARIO.format(files=", ".join(files), rate="1/300", atmosphere="true" if atmosphere else "false"))
    out = os.path.join(folder, "out" + str(atmosphere))
    subprocess.run([canyon, "simulate", scenario, "--out", out, "--quiet"], check=True, stdout=subprocess.DEVNULL, timeout=120)
    found = [os.path.join(d, f) for d, _, names in os.walk(out) for f in names if f == "signals.csv"]
    with open(found[0], encoding="utf-8") as table:
        return {(round(float(r["gps_tow"])), r["sat"], r["signal"]): r for r in csv.DictReader(table) if r["pseudorange_m"]}


def elevation_deg(row, geocentric):
    """At 30 deg north, 95 deg east on the ellipsoid, above the plane across the vertical or the geocentric direction."""
    lat, lon, radius = math.radians(30), math.radians(95), 6378137 / math.sqrt(1 - 6.69437999014e-3 / 4)
    up = (math.cos(lat) * math.cos(lon), math.cos(lat) * math.sin(lon), math.sin(lat))
    here = (radius * up[0], radius * up[1], radius * (1 - 6.69437999014e-3) * up[2])
    if geocentric:
        up = [x / math.hypot(*here) for x in here]
    there = [float(row[k]) - x for k, x in zip(("x_m", "y_m", "z_m"), here)]
    return math.degrees(math.asin(sum(a * b for a, b in zip(there, up)) / math.hypot(*there)))


def pairs(data, name, ours):
    """(signal's row of SIGNALS, Skydel's row, Canyon's row) of rows in both."""
    known = {s[0]: s for s in SIGNALS}
    with gzip.open(os.path.join(data, name), "rt") as table:
        for row in csv.DictReader(table):
            signal = known.get(row["signal"])
            if signal is None:
                continue
            name = f"{signal[1]}{int(row['prn']) + (19 if signal[1] == 'S' else 0):02d}"
            mine = ours.get((round(float(row["gps_tow_s"])), name, signal[2]))
            if mine and name not in GEOSTATIONARY:
                yield signal, row, mine


def middle_and_worst(values):
    return statistics.median(values), max(map(abs, values))


def main():
    data = sys.argv[2] if len(sys.argv) > 2 else os.path.join(os.path.dirname(__file__), "../../../shared/data/skydel-20230108")
    if not os.path.isdir(data):
        print(f"skipped: {data} is not there")
        return 77
    beyond = []

    def judge(what, value, limit):
        if limit is not None and not value <= limit:
            beyond.append(f"{what}: {value:.4f}, limit {limit}")

    with tempfile.TemporaryDirectory() as folder:
        clear, delayed = (simulate(sys.argv[1], data, folder, atmosphere) for atmosphere in (False, True))
    ranges, rates, ionosphere, troposphere, ratios = {}, {}, {}, {}, []
    for signal, row, mine in pairs(data, "none.csv.gz", clear):
        ranges.setdefault(signal, []).append(float(mine["pseudorange_m"]) - float(row["pseudorange_m"]))
        rates.setdefault(signal, []).append(float(mine["doppler_hz"]) - float(row["doppler_hz"]))
    curve, theirs = [], []  # troposphere by elevation
    for signal, row, mine in pairs(data, "klobuchar-saastamoinen.csv.gz", delayed):
        ionosphere.setdefault(signal, []).append(float(mine["ionosphere_m"]) - float(row["ionosphere_m"]))
        curve.append((elevation_deg(row, False), float(mine["troposphere_m"])))
        theirs.append((elevation_deg(row, True), float(row["troposphere_m"])))
    curve.sort()
    for elevation, delay in theirs:
        at = min(max(bisect.bisect(curve, (elevation, 0)), 1), len(curve) - 1)
        (e0, d0), (e1, d1) = curve[at - 1], curve[at]
        own = d0 if e1 == e0 else d0 + (d1 - d0) * (elevation - e0) / (e1 - e0)
        band = next(b for b in reversed(BANDS[:-1]) if elevation >= b)
        troposphere.setdefault(band, []).append((own, delay))
        if elevation > 60:
            ratios.append(delay / own)
    print("| signal | rows | pseudorange, median, worst [m] | Doppler, median, worst [Hz] | ionosphere, median, worst [m] |\n|---|---|---|---|---|")
    for signal in SIGNALS:
        if signal not in ranges:
            beyond.append(f"{signal[0]}: nothing to compare")
            continue
        figures = [middle_and_worst(kind[signal]) for kind in (ranges, rates, ionosphere)]
        print(f"| {signal[0]} | {len(ranges[signal])} | " + " | ".join(f"{m:.{d}f}, {w:.{d}f}" for (m, w), d in zip(figures, (4, 4, 2))) + " |")
        for what, (_, worst), limit in zip(("pseudorange", "Doppler", "ionosphere"), figures, signal[3:]):
            judge(f"{signal[0]}, {what}", worst, limit)
    ratio = statistics.median(ratios)
    print(f"\nzenith delay: Skydel's is {ratio:.4f} of Canyon's\n\n| elevation [deg] | rows | troposphere, median, worst [m] | with that zenith delay |\n|---|---|---|---|")
    for band, end in zip(BANDS, BANDS[1:]):
        rows = troposphere.get(band, [])
        own, scaled = (middle_and_worst([a * scale - b for a, b in rows]) for scale in (1, ratio))
        print(f"| {band} to {end} | {len(rows)} | {own[0]:+.3f}, {own[1]:.3f} | {scaled[0]:+.3f}, {scaled[1]:.3f} |")
        judge(f"troposphere at {band} to {end} deg", scaled[1], MOST_TROPOSPHERE_M)
    print("\n".join(beyond))
    return 1 if beyond else 0


if __name__ == "__main__":
    sys.exit(main())
