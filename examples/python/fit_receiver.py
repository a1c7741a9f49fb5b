"""Fits a receiver's profile to a recording, and validates it with the part not used for calibration.

The recording is made here, by a receiver with a known C/N0 level: 4.5 dB above the minimum power in the
interface documents (1.5 in the profile). A real recording is a RINEX file and true positions.
"""

import pathlib
import tempfile

import numpy as np

import canyon

base = canyon.Scenario(
    city={
        "synthetic": {"blocks_east": 3, "blocks_north": 3, "max_height_m": 60, "seed": 7},
        "origin": {"latitude_deg": 22.3, "longitude_deg": 114.17, "height_m": 0},
    },
    sky={"systems": ["GPS", "GLONASS", "Galileo"]},
    start="2026-06-01T08:00:00Z",
    trajectory={
        "waypoints": [{"east_m": -76, "north_m": -100}, {"east_m": -76, "north_m": 0}, {"east_m": 76, "north_m": 0}, {"east_m": 76, "north_m": 100}],
        "speed_mps": 2,
        "height_above_terrain_m": 1.5,
    },
)
recorder = base.changed(receivers=[{
    "name": "car", "profile": "ublox-m8t",
    "signal": {"link": {"above_minimum_db": 4.5}, "shadowing": {"enabled": False}},
}])

with tempfile.TemporaryDirectory() as name:
    folder = pathlib.Path(name)
    recorded = canyon.simulate(recorder)
    recorded.write(folder / "drive.obs")
    recorded.write(folder / "sky.nav")
    recorded.write(folder / "epochs.csv")
    # Week, seconds, latitude, longitude, height: the first columns of epochs.csv.
    truth = [",".join(line.split(",")[:5]) for line in (folder / "epochs.csv").read_text().splitlines()[1:]]
    (folder / "truth.csv").write_text("\n".join(truth) + "\n")

    settings = base.changed(receivers=[{"name": "car", "profile": "ublox-m8t"}]).settings
    settings["sky"] = {"navigation": [folder / "sky.nav"]}
    recording = canyon.Recording(settings, folder / "drive.obs", folder / "truth.csv", "urbannav")
    print(f"{len(recording)} epochs")
    fit = canyon.calibrate(recording, (0, 0.5), seeds=2)
    for estimate in fit.estimates:
        if estimate["verdict"] == "fitted":
            print(f"  {estimate['key']}: {estimate['before']} -> {estimate['after']} ({estimate['interval_95']})")
    level = next(e for e in fit.estimates if e["key"] == "signal.link.above_minimum_db")
    assert abs(float(level["after"]) - 4.5) < 1.5, level
    # The scenario does not set the facades. Those of the city would be in fit.city, for settings["city"].
    assert [e["key"] for e in fit.city_estimates] == ["city.facades.fractions.coated_glass"], fit.city_estimates

    (folder / "mine.yaml").write_text(fit.profile)
    for profile in ["ublox-m8t", str(folder / "mine.yaml")]:
        settings["receivers"] = [{"name": "car", "profile": profile}]
        recording = canyon.Recording(settings, folder / "drive.obs", folder / "truth.csv", "urbannav")
        figures = recording.validate((0.5, 1.0))["models"][0]
        ks = figures["distributions"]["los_cn0_dbhz"]["ks"]
        print(f"{pathlib.Path(profile).name:10} distance of the C/N0 in sight, simulated from recorded (Kolmogorov-Smirnov): {ks:.2f}")
