#!/usr/bin/env python3
"""Trains a classifier of NLOS signals on a data set of make.py and prints its performance in unseen
cities: docs/datasets.md.

    examples/datasets/train.py out/dataset

Needs NumPy, pandas and scikit-learn (Debian: python3-sklearn, python3-pandas).
"""
import argparse
import pathlib
import sys

import numpy as np
import pandas as pd
from sklearn.ensemble import HistGradientBoostingClassifier
from sklearn.metrics import roc_auc_score, roc_curve


def features_of(table):
    """Features of each observation known to the receiver, including the others of its epoch and its own past seconds."""
    epoch = table.groupby(["drive", "gps_tow"])
    satellite = table.groupby(["drive", "sat"])
    return pd.DataFrame({
        "C/N0": table.cn0_dbhz,
        "elevation": table.elevation_deg,
        "C/N0 less the epoch's median": table.cn0_dbhz - epoch.cn0_dbhz.transform("median"),
        "spread of C/N0 over 10 epochs": satellite.cn0_dbhz.transform(lambda s: s.rolling(10, min_periods=2).std()),
        "residual": table.residual_m,
        "residual over its deviation": table.residual_m / table.sigma_m,
        "satellites of the epoch": epoch.sat.transform("count"),
        "phase lock": table.phase_lock_s,
    })


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("dataset", type=pathlib.Path, help="folder of make.py")
    parser.add_argument("--curve", type=pathlib.Path, help="a picture of the curve (needs matplotlib)")
    arguments = parser.parse_args()
    path = arguments.dataset / "observations.csv"
    if not path.is_file():
        sys.exit(f"train.py: {path} does not exist; create it with make.py --out {arguments.dataset}")
    table = pd.read_csv(path)
    features, hidden = features_of(table), (table.visibility == "NLOS").to_numpy()
    train, test = (table.split == "train").to_numpy(), (table.split == "test").to_numpy()
    for name, rows in (("train", train), ("test", test)):
        print(f"{name}: {rows.sum()} observations of {table.drive[rows].nunique()} drives, {hidden[rows].mean():.1%} NLOS")
        if hidden[rows].all() or not hidden[rows].any():
            sys.exit(f"train.py: the {name} split has only one kind of signal; make more drives")

    model = HistGradientBoostingClassifier(max_iter=200, learning_rate=0.05, l2_regularization=1, random_state=1)
    model.fit(features[train], hidden[train])
    score = model.predict_proba(features[test])[:, 1]
    print(f"\nNLOS in unseen cities: area under the curve {roc_auc_score(hidden[test], score):.3f}; "
          f"by C/N0 alone {roc_auc_score(hidden[test], -table.cn0_dbhz[test]):.3f}, "
          f"by elevation alone {roc_auc_score(hidden[test], -table.elevation_deg[test]):.3f}\n")
    false_alarms, found, _ = roc_curve(hidden[test], score)
    print("false alarms   NLOS found")
    for share in (0.01, 0.02, 0.05, 0.1, 0.2, 0.3):
        print(f"{share:>11.0%}   {np.interp(share, false_alarms, found):>10.1%}")
    if arguments.curve:
        from matplotlib import pyplot
        pyplot.figure(figsize=(5, 5))
        pyplot.plot(false_alarms, found)
        pyplot.xlabel("fraction of other signals classified as NLOS")
        pyplot.ylabel("fraction of NLOS signals found")
        pyplot.grid(alpha=0.4)
        pyplot.savefig(arguments.curve, dpi=120, bbox_inches="tight")


if __name__ == "__main__":
    main()
