#!/usr/bin/env python3
"""Tests whether a classifier of NLOS signals trained on simulated drives is better than C/N0 alone on recorded signals.

    examples/datasets/make.py --canyon CANYON --out DATASET --drives 16
    labels.py CANYON DATA DATASET OUT

CANYON is the program, DATA the folder of the recordings, OUT a folder for runs. Features are the receiver's C/N0 and
the satellite's elevation. Sets of features are compared on three recordings of Hong Kong, whose labels are
`map_visibility`, and then on the first 60 s of Berlin, whose labels are smartLoc's. The best set on Hong Kong
is used; Berlin is not used for selection. Needs NumPy, pandas and scikit-learn. Run manually.
"""
import subprocess
import sys
from pathlib import Path

import pandas as pd
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.metrics import roc_auc_score

sys.path.insert(0, str(Path(__file__).parent))
import transfer

SETS = {  # features: +1 or -1: the score may only rise or fall with it; "balanced" sets train with elevation_balance()
    "C/N0, elevation": {"cn0": -1, "elevation": -1},
    "relative C/N0, elevation": {"to_best": -1, "to_median": -1, "elevation": -1},
    "C/N0, relative": {"cn0": -1, "to_best": -1, "to_median": -1},
    "C/N0, elevation, balanced": {"cn0": -1, "elevation": 0},
    "C/N0, relative, elevation, balanced": {"cn0": -1, "to_best": -1, "to_median": -1, "elevation": 0},
    "C/N0, past, elevation, balanced": {"cn0": -1, "mean": -1, "to_best": -1, "elevation": 0},
}


def elevation_balance(table, hidden):
    """Weights that give NLOS and other rows equal sums in each 5 deg of elevation: the height of houses depends on the city."""
    group = [(table.elevation // 5).rename("band"), hidden.rename("hidden")]
    return 1 / table.groupby(group).cn0.transform("count")


def features(table):
    """Adds further features known to a receiver to the columns drive, tow, sat, cn0, elevation."""
    epoch, satellite = table.groupby(["drive", "tow"]).cn0, table.sort_values("tow").groupby(["drive", "sat"], group_keys=True)
    table["to_best"] = table.cn0 - epoch.transform(lambda s: s.nlargest(3).mean())
    table["to_median"] = table.cn0 - epoch.transform("median")
    past = satellite.apply(lambda s: s.set_index(pd.to_timedelta(s.tow, unit="s")).cn0.rolling("10s").agg(["mean", "std"])
                           .set_axis(s.index))
    past.index = past.index.get_level_values(-1)
    return table.join(past.rename(columns={"std": "spread"}))


def observed(path):
    """C/N0 on L1 or B1 by (time of week, satellite) of RINEX 3."""
    types, found, tow = {}, {}, None
    for line in path.read_text().splitlines():
        if line[60:].startswith("SYS / # / OBS TYPES") and line[0] != " ":
            types[line[0]] = line[7:60].split()
        elif line.startswith(">"):
            c = line[1:].split()
            tow = pd.Timestamp(*map(int, c[:5])) + pd.Timedelta(seconds=float(c[5])) - pd.Timestamp(1980, 1, 6)
            tow = round(tow.total_seconds() % 604800)
        elif tow is not None and line[:1] in types:
            kind = "S2I" if line[0] == "C" else "S1C"
            at = 3 + 16 * types[line[0]].index(kind)
            if line[at:at + 14].strip():
                found[tow, line[:3]] = float(line[at:at + 14])
    return found


def simulated(canyon, data, out, name):
    """satellites.csv of the recording's scenario: directions and visibility by the map."""
    folder = out / name
    folder.mkdir(parents=True, exist_ok=True)
    run = folder / "run"
    if not (run / "satellites.csv").exists():
        subprocess.run([canyon, "simulate", transfer.scenario(data, folder, name), "-o", run, "--quiet"], check=True)
    table = pd.read_csv(run / "satellites.csv", usecols=["gps_tow", "sat", "elevation_deg", "map_visibility", "visibility"])
    return table.assign(second=table.gps_tow.round().astype(int)).drop_duplicates(["second", "sat"])


def recording(canyon, data, out, name):
    """Table of a recording: drive, tow, sat, cn0, elevation, hidden."""
    sky = simulated(canyon, data, out, name)
    if name == "berlin-m8":
        seen = pd.read_csv(data / "berlin-potsdamer-platz/nlos_labels_first60s.csv")
        seen = pd.DataFrame({"tow": seen.gps_tow, "sat": seen.satellite, "cn0": seen.cn0_dbhz, "hidden": seen.nlos_label == 1})
        seen["second"] = seen.tow.round().astype(int)
        table = seen.merge(sky, on=["second", "sat"])
    else:
        cn0 = pd.Series(observed(data / transfer.RECORDINGS[name][2])).rename_axis(["second", "sat"]).rename("cn0")
        table = cn0.reset_index().merge(sky, on=["second", "sat"])
        table = table.assign(tow=table.second, hidden=table.map_visibility == "NLOS")
    return features(table.rename(columns={"elevation_deg": "elevation"}).assign(drive=name)).dropna(subset=["elevation"])


def main():
    if len(sys.argv) != 5:
        sys.exit(__doc__)
    canyon, data, dataset, out = map(Path, sys.argv[1:])
    table = pd.read_csv(dataset / "observations.csv")
    table = table.sort_values(["drive", "gps_tow", "carrier_frequency_hz"], ascending=[True, True, False])
    table = table.drop_duplicates(["drive", "gps_tow", "sat"]).reset_index(drop=True)  # only the first band
    table = table.rename(columns={"gps_tow": "tow", "cn0_dbhz": "cn0", "elevation_deg": "elevation"})
    hidden = table.visibility == "NLOS"
    print(f"trained on {len(table)} observations of {table.drive.nunique()} drives, {hidden.mean():.0%} NLOS; of these "
          f"map_visibility LOS {(table.map_visibility[hidden] != 'NLOS').mean():.1%}")
    table = features(table)
    kept = table.tow.astype(int) % 3 == 0  # neighbouring epochs are nearly equal
    table, hidden = table[kept], hidden[kept]
    places = {n: recording(canyon, data, out, n) for n in ("tst-19-m8t", "tst-21-f9p", "tst-21-m8t", "berlin-m8")}
    print(f"{'area under the curve':36}" + "".join(f"{n:>14}" for n in places))
    print(f"{'C/N0 alone':36}" + "".join(f"{roc_auc_score(t.hidden, -t.cn0):14.3f}" for t in places.values()))
    print(f"{'elevation alone':36}" + "".join(f"{roc_auc_score(t.hidden, -t.elevation):14.3f}" for t in places.values()))
    for name, columns in SETS.items():
        model = HistGradientBoostingClassifier(max_iter=60, learning_rate=0.15, min_samples_leaf=200, random_state=1,
                                               monotonic_cst=list(columns.values()))
        weights = elevation_balance(table, hidden) if "balanced" in name else None
        model.fit(table[list(columns)], hidden, sample_weight=weights)
        scores = [roc_auc_score(t.hidden, model.predict_proba(t[list(columns)])[:, 1]) for t in places.values()]
        print(f"{name:36}" + "".join(f"{s:14.3f}" for s in scores), flush=True)


if __name__ == "__main__":
    main()
