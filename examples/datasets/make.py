#!/usr/bin/env python3
"""Makes a labelled data set of drives through synthetic cities: docs/datasets.md.

    examples/datasets/make.py --out out/dataset --drives 10

Each drive has its own city, route, day, receiver and errors, sampled from the seed. Needs only Python and `canyon`.
"""
import argparse
import csv
import json
import math
import os
import pathlib
import random
import shutil
import subprocess
import sys

# The receiver's values of an observation, followed by the simulation's truth.
FEATURES = ["sat", "azimuth_deg", "elevation_deg", "pseudorange_m", "doppler_hz", "carrier_frequency_hz", "cn0_dbhz",
            "sigma_m", "residual_m", "phase_lock_s", "cycle_slip", "used", "excluded"]
LABELS = ["visibility", "map_visibility", "tracked_path", "excess_path_m", "pseudorange_error_m", "true_cn0_dbhz",
          "obstacles_db"]
ACCELERATION_MPS2 = 3
PLACES = [(52.5, 13.4), (22.3, 114.2), (40.7, -74.0), (-33.9, 151.2), (35.7, 139.7), (59.3, 18.1), (1.3, 103.8)]


def scenario_of(drive, dice, seconds, rate_hz):
    """The scenario of one drive, as a tree for YAML (JSON is YAML)."""
    blocks, block, street = 12, dice.choice([50, 60, 70, 80]), dice.choice([16, 20, 26, 32])
    pitch, most = block + street, blocks // 2 - 1
    highest = round(12 * math.exp(dice.uniform(0, math.log(7))))
    x, y = dice.randint(-most, most), dice.randint(-most, most)
    # Corners are rounded: the arc must stay 1.5 m from the house.
    speed = min(dice.choice([6, 9, 12]), round(math.sqrt(ACCELERATION_MPS2 * (street / math.sqrt(2) - 1.5) / 0.4142), 1))
    corners, before, way_m = [(x, y)], None, 0
    while way_m < seconds * speed:  # along the streets, never back
        ways = [(dx, dy) for dx, dy in ((1, 0), (-1, 0), (0, 1), (0, -1))
                if (-dx, -dy) != before and abs(x + dx) <= most and abs(y + dy) <= most]
        before = dice.choice(ways)
        x, y = x + before[0], y + before[1]
        corners.append((x, y))
        way_m += pitch
    latitude, longitude = dice.choice(PLACES)
    return {
        "city": {
            "synthetic": {"blocks_east": blocks, "blocks_north": blocks, "block_size_m": block, "street_width_m": street,
                          "min_height_m": min(9, highest / 2), "max_height_m": highest, "seed": dice.randint(1, 10**6)},
            "origin": {"latitude_deg": latitude, "longitude_deg": longitude, "height_m": 50},
            "facades": {"mix": dice.choice(["traditional", "urban_stock", "thermally_efficient"])},
        },
        "sky": {"nominal": True},
        "start": f"2026-{dice.randint(1, 12):02}-{dice.randint(1, 28):02}T{dice.randint(0, 23):02}:{dice.randint(0, 59):02}:00Z",
        "rate_hz": rate_hz,
        "duration_s": seconds,
        "surroundings": dice.choice(["suburban", "urban", "dense"]),
        "trajectory": {"waypoints": [{"east_m": e * pitch, "north_m": n * pitch, "up_m": 1.8} for e, n in corners],
                       "speed_mps": speed, "acceleration_mps2": ACCELERATION_MPS2},
        "receivers": [{"name": f"drive{drive}", "profile": dice.choice(["ublox-m10", "ublox-m8t", "ublox-f9p", "phone"])}],
        "outputs": ["epochs_csv", "satellites_csv", "rinex_observation", "rinex_navigation"],
        "seed": dice.randint(1, 10**6),
    }


def find_canyon(given):
    built = pathlib.Path(__file__).resolve().parents[2] / "build-release/bin/canyon"
    for program in (given, os.environ.get("CANYON"), shutil.which("canyon"), str(built)):
        if program and os.access(program, os.X_OK):
            return program
    sys.exit("make.py: canyon is not found; install it, run ./run build, or give --canyon PROGRAM")


def simulate(canyon, scenario, folder):
    """One drive; its folder appears when it is complete."""
    begun = folder.with_name(folder.name + ".part")
    for old in (begun, folder):
        shutil.rmtree(old, ignore_errors=True)
    begun.mkdir(parents=True)
    (begun / "scenario.yaml").write_text(scenario)
    subprocess.run([canyon, "simulate", begun / "scenario.yaml", "--out", begun, "--quiet"], check=True)
    begun.rename(folder)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True, type=pathlib.Path, help="folder for the data set; must not exist")
    parser.add_argument("--drives", type=int, default=10)
    parser.add_argument("--seconds", type=int, default=300, help="length of a drive")
    parser.add_argument("--rate", type=float, default=1, help="epochs per second")
    parser.add_argument("--test", type=float, default=0.3, help="fraction of the drives in the test split")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--canyon", help="the program (default: $CANYON, canyon in PATH, this repository's)")
    arguments = parser.parse_args()
    if arguments.drives < 2 or not 0 < arguments.test < 1 or arguments.seconds < 1 or not arguments.rate > 0:
        sys.exit("make.py: give at least 2 drives, --test between 0 and 1, --seconds of at least 1 and --rate above 0")
    if arguments.out.exists():
        sys.exit(f"make.py: {arguments.out} exists already; remove it or choose another --out")
    canyon = find_canyon(arguments.canyon)
    # The data set appears when it is complete; drives finished by an interrupted call are kept.
    part = arguments.out.with_name(arguments.out.name + ".part")
    part.mkdir(parents=True, exist_ok=True)

    tested = min(arguments.drives - 1, math.ceil(arguments.test * arguments.drives))
    drives, counts = [], {}
    with open(part / "observations.csv", "w", newline="") as table:
        rows = csv.writer(table)
        rows.writerow(["split", "drive", "profile", "gps_week", "gps_tow"] + FEATURES + LABELS)
        for drive in range(1, arguments.drives + 1):
            split = "test" if drive > arguments.drives - tested else "train"
            folder = part / "drives" / f"{drive:03}"
            scenario = scenario_of(drive, random.Random(f"{arguments.seed}/{drive}"), arguments.seconds, arguments.rate)
            text = json.dumps(scenario, indent=1) + "\n"
            kept = folder.exists() and (folder / "scenario.yaml").read_text() == text
            print(f"drive {drive} of {arguments.drives} ({split}){', kept' if kept else ''}", file=sys.stderr)
            if not kept:
                simulate(canyon, text, folder)
            profile = scenario["receivers"][0]["profile"]
            with open(folder / "satellites.csv", newline="") as satellites:
                for line in csv.DictReader(satellites):
                    if line["pseudorange_m"] == "":  # not measured
                        continue
                    rows.writerow([split, drive, profile, line["gps_week"], line["gps_tow"]] +
                                  [line[name] for name in FEATURES + LABELS])
                    key = f"{split} {line['visibility']}"
                    counts[key] = counts.get(key, 0) + 1
            drives.append({"drive": drive, "split": split, "scenario": f"drives/{drive:03}/scenario.yaml"})
    version = subprocess.run([canyon, "--version"], check=True, capture_output=True, text=True).stdout.strip()
    card = {
        "what": "simulated GNSS observations of cars in made-up cities, with the truth of each",
        "made_by": version, "seed": arguments.seed, "seconds": arguments.seconds, "rate_hz": arguments.rate,
        "split": "by drive: each has a city of its own", "observations": counts,
        "known_to_a_receiver": FEATURES, "labels": LABELS, "columns": "docs/outputs.md, satellites.csv",
        "not_in_it": "real receivers, real cities, interference", "drives": drives,
    }
    (part / "card.json").write_text(json.dumps(card, indent=1) + "\n")
    part.rename(arguments.out)
    print(f"{sum(counts.values())} observations of {arguments.drives} drives in {arguments.out}: "
          + ", ".join(f"{name} {count}" for name, count in sorted(counts.items())))


if __name__ == "__main__":
    try:
        main()
    except (KeyboardInterrupt, subprocess.CalledProcessError) as error:
        said = f"{error}; " if str(error) else ""
        sys.exit(f"make.py: {said}interrupted: the same command continues after the last complete drive")
