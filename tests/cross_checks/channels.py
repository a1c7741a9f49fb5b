#!/usr/bin/python3
"""Behaviour of channels, recorded and simulated: frozen Dopplers, onsets of large errors, losses by elevation.

    channels.py CANYON DATA OUT [--seeds 3] [--only NAME ...]

CANYON, DATA, OUT, and names are those of transfer.py, whose runs in OUT are reused. Prints, for each recording and for the
mean of the seeds:
  frozen   fraction of measurements with exactly the Doppler of the previous epoch, by C/N0 [dB-Hz]; their number in a row
  onsets   errors of pseudoranges that rise above 80 m, from below 40 m if there is no gap: how many, how many of them follow an
           epoch without the satellite, median C/N0
  lost     fraction of satellites that are not tracked, by elevation [deg] and by angle over the map's skyline [deg]
The last two are of `canyon validate` with the drive's scenario: satellites never tracked in the recording are omitted.
"""
import gzip
import json
import re
import shutil
import subprocess
import sys
from collections import defaultdict

import numpy as np

import transfer

CN0 = (0, 12, 16, 20, 24, 28, 60)
ELEVATIONS = (10, 25, 40, 55, 90)
CLEARANCES = (-90, -15, -5, 5, 15, 91)
LARGE_M, SMALL_M = 80, 40
LEAST = 30  # satellites in a cell that is printed


def dopplers(text):
    """(satellite, band): list of (epoch, Doppler, C/N0) of RINEX 2 or 3; epochs are numbered."""
    types, found, epoch, names = {}, defaultdict(list), -1, []
    lines = iter(text.splitlines())
    for line in lines:
        label = line[60:].strip()
        if label == "SYS / # / OBS TYPES":
            system = line[0] if line[0] != " " else system
            types.setdefault(system, []).extend(line[7:60].split())
        elif label == "# / TYPES OF OBSERV":
            types[""] = line[10:60].split()
        elif transfer.EPOCH_OF_RINEX_2.match(line):
            epoch, count = epoch + 1, int(line[29:32])
            names = [line[k:k + 3] for k in range(32, len(line.rstrip()), 3)]
            while len(names) < count:
                more = next(lines).rstrip()
                names += [more[k:k + 3] for k in range(32, len(more), 3)]
            for name in names[:count]:
                take(found, name, types[""], next(lines), 0, epoch)
        elif line.startswith(">"):
            epoch += 1
        elif epoch >= 0 and line[:1] in types:
            take(found, line[:3], types[line[0]], line, 3, epoch)
    return found


def take(found, name, types, line, first, epoch):
    cells = {t: line[first + 16 * k:first + 16 * k + 14].strip() for k, t in enumerate(types)}
    for kind, value in cells.items():
        strength = cells.get("S" + kind[1:])
        if kind[0] == "D" and value and strength:
            found[name, kind[1:]].append((epoch, value, float(strength)))


def frozen(observations):
    """Counts by C/N0: all measurements with a previous epoch, and those with its Doppler; lengths of rows of these."""
    counts, rows = np.zeros((2, len(CN0) - 1)), []
    for series in dopplers(observations.path.read_text()).values():
        row = 0
        for (e0, d0, _), (e1, d1, strength) in zip(series, series[1:]):
            same = e1 == e0 + 1 and d1 == d0
            if e1 == e0 + 1:
                band = min(int(np.searchsorted(CN0, strength, side="right")) - 1, len(CN0) - 2)
                counts[:, band] += 1, same
            if row and not same:
                rows.append(row)
            row = row + 1 if same else 0
        rows += [row] if row else []
    return counts, rows


def view_tables(folder, receiver):
    """Columns of the tables `epochs`, `skylines` and `satellites` of a receiver (0 recorded, 1 simulated) of a view."""
    header, joined = json.loads((folder / "view.json").read_text()), defaultdict(lambda: defaultdict(list))
    for chunk in header["chunks"]:
        if chunk.get("receiver") == receiver and chunk["kind"] in ("track", "block"):
            for table, columns in transfer.tables_of(header, gzip.decompress((folder / chunk["file"]).read_bytes())).items():
                for name, values in columns.items():
                    joined[table][name].append(values)
    return {t: {n: np.concatenate(v) for n, v in columns.items()} for t, columns in joined.items()}


def errors_and_losses(tables, map_tables):
    """Number of onsets, those after a gap, their C/N0; counts by elevation and clearance: all, and lost. The skylines are those of
    `map_tables`, of the same epochs."""
    s = tables["satellites"]
    tracked = ~np.isnan(s["cn0_dbhz"]) & (s["lock"] == 1)
    before = {}  # satellite: its last tracked epoch, and whether its error has not been small since it was large
    onsets, gaps, strengths = 0, 0, []
    for k in np.flatnonzero(tracked):
        last, was_large = before.get(s["satellite"][k], (-2, False))
        error, adjacent = abs(s["pseudorange_error_m"][k]), last == s["epoch"][k] - 1
        if error > LARGE_M and not (adjacent and was_large) and s["epoch"][k] > 0:
            onsets, gaps = onsets + 1, gaps + (not adjacent)
            strengths.append(s["cn0_dbhz"][k])
        before[s["satellite"][k]] = s["epoch"][k], error > LARGE_M or (adjacent and was_large and error > SMALL_M)
    outlines = map_tables["skylines"]["elevation"].reshape(-1, 120)[map_tables["epochs"]["skyline"][s["epoch"]]] / 2.0
    hidden = outlines[np.arange(len(outlines)), (s["azimuth_deg"] // 3).astype(int) % 120]
    places = s["elevation_deg"], s["elevation_deg"] - hidden
    counts = np.array([np.histogram2d(*(p[which] for p in places), bins=(ELEVATIONS, CLEARANCES))[0]
                       for which in (np.ones_like(tracked), ~tracked)])
    return onsets, gaps, strengths, counts


def shares(counts):
    return " ".join("  -" if n < LEAST else f"{share:3.0%}" for n, share in zip(counts[0], counts[1] / np.maximum(counts[0], 1)))


def say(what, found, seeds=1):
    """A line of sums over `seeds`."""
    (counts, rows), seen = found
    onsets, gaps, strengths = seen[0] / seeds, seen[1] / seeds, seen[2]
    lost = " / ".join(shares(seen[3][:, elevation]) for elevation in range(len(ELEVATIONS) - 1))
    print(f"  {what:9} frozen {shares(counts)}, in a row {np.median(rows) if rows else 0:.0f} "
          f"({max(rows, default=0)} at most); onsets {onsets:.0f}, after a gap {gaps:.0f}, "
          f"at {np.median(strengths) if strengths else np.nan:.0f} dB-Hz; lost {lost}", flush=True)


def main():
    parser = transfer.judge_arguments(__doc__, 3)
    parser.add_argument("--only", nargs="+", choices=transfer.RECORDINGS, default=list(transfer.RECORDINGS))
    args = parser.parse_args()
    if not all((args.data / transfer.RECORDINGS[n][2]).exists() for n in args.only):
        print(f"SKIPPED: the recordings in {args.data} are missing")
        return 77
    print(f"frozen by C/N0 {CN0} dB-Hz; lost by elevation {ELEVATIONS} deg (/), over the skyline {CLEARANCES} deg")
    for name in args.only:
        drive = transfer.Drive(args, name)
        sums = [np.zeros((2, len(CN0) - 1)), []]
        seen_sums = [0, 0, [], np.zeros((2, len(ELEVATIONS) - 1, len(CLEARANCES) - 1))]

        def view(seed, text):
            """Tables of the recorded and of the simulated receiver."""
            folder, file = drive.out / "channels.view", drive.out / "channels.yaml"
            shutil.rmtree(folder, ignore_errors=True)
            file.write_text(text)
            subprocess.run([args.canyon, "validate", file, "--obs", drive.recorded.path, "--view", folder, "--seed", str(seed), "--threads",
                            "1", "--quiet"], check=True, timeout=600, capture_output=True)
            tables = [view_tables(folder, receiver) for receiver in (0, 1)]
            shutil.rmtree(folder)
            return tables

        scenario = transfer.scenario_text(name)
        own = view(1, re.sub("  roofs_m: .*\n", "", scenario))[0]  # skylines of the map
        for seed in range(1, args.seeds + 1):
            drive.simulate("Canyon", seed)
            counts, rows = frozen(drive.simulated["Canyon", seed])
            sums[0] += counts
            sums[1] += rows
            for k, value in enumerate(errors_and_losses(view(seed, scenario)[1], own)):
                seen_sums[k] = seen_sums[k] + value
        print(name)
        say("recorded", (frozen(drive.recorded), errors_and_losses(own, own)))
        say("simulated", (sums, seen_sums), args.seeds)
    return 0


if __name__ == "__main__":
    sys.exit(main())
