#!/usr/bin/env python3
"""Compares a day of a real station under an open sky with Canyon's simulation of it.

    station_day.py CANYON OBS NAV [--profiles survey ublox-m8t] [--masks 5 20 45]

OBS is a station's observations (RINEX, Hatanaka too) whose header has its place, NAV the broadcast ephemerides of that
day: for example ESBC00DNK_R_20201770000_01D_30S_MO.crx.gz of nav-solutions/data. Prints, by profile and elevation mask, the
spread of pseudorange errors without the receiver's clock (the quartiles' distance over 1.349) and the median C/N0, recorded
and simulated with errors of orbits, clocks and atmosphere.
"""
import argparse
import datetime
import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path


def spread(values):
    return (values["p75"] - values["p25"]) / 1.349


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("canyon")
    parser.add_argument("obs", type=Path)
    parser.add_argument("nav", type=Path)
    parser.add_argument("--profiles", nargs="+", default=["survey", "ublox-m8t"])
    parser.add_argument("--masks", nargs="+", type=int, default=[5, 20, 45])
    args = parser.parse_args()
    told = subprocess.run([args.canyon, "check", args.obs], stdout=subprocess.PIPE, text=True, check=True).stdout
    latitude, longitude, height = (float(x) for x in re.search(r"place +([-\d.]+), ([-\d.]+) deg, ([-\d.]+) m", told).groups())
    first = datetime.datetime.fromisoformat(re.search(r"time +(\S+) GPST", told).group(1))
    seconds = float(re.search(r"\((\d+) s\)", told).group(1))
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        rows = [f"{first + datetime.timedelta(seconds=30 * k)} GPST,{latitude},{longitude},{height}" for k in range(int(seconds / 30) + 1)]
        (folder / "truth.csv").write_text("\n".join(["time,latitude_deg,longitude_deg,height_m", *rows]) + "\n")
        print("profile       mask  spread recorded, simulated [m]  C/N0 recorded, simulated [dB-Hz]")
        for profile in args.profiles:
            for mask in args.masks:
                (folder / "day.yaml").write_text(
                    f"city: {{open: true, origin: {{latitude_deg: {latitude}, longitude_deg: {longitude}, height_m: {height - 5}}}}}\n"
                    f"sky: {{navigation: [{args.nav.resolve()}], systems: [GPS, Galileo], errors: {{enabled: true}}}}\n"
                    f"trajectory: {{file: truth.csv}}\nreceivers: [{{name: station, profile: {profile}, elevation_mask_deg: {mask}}}]\nseed: 1\n")
                subprocess.run([args.canyon, "validate", folder / "day.yaml", "--obs", args.obs.resolve(), "--quiet", "--json", folder / "day.json"],
                               stderr=subprocess.DEVNULL, check=True)
                of = json.loads((folder / "day.json").read_text())["models"][0]["distributions"]
                error, strength = of["los_error_m"], of["los_cn0_dbhz"]
                print(f"{profile:12} {mask:5}  {spread(error['measured']):8.2f}, {spread(error['simulated']):.2f}"
                      f"{strength['measured']['p50']:26.1f}, {strength['simulated']['p50']:.1f}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
