"""Your own simulation in a loop: moves a vehicle and computes a receiver's fix five times per second.

    python3 own_loop.py        # writes out/own_loop.kml, and out/own_loop.png if matplotlib is installed
"""
import os

import numpy

import canyon

STEP_S = 0.2


def pose(time_s):
    """Position and velocity, east, north, up of the city [m, m/s]. Insert your simulation here."""
    return (4 * time_s, 0, 1.5), (4, 0, 0)


city = canyon.City(synthetic={"seed": 7}, origin={"latitude_deg": 22.3, "longitude_deg": 114.17, "height_m": 0})
receiver = canyon.ReceiverRunner(city, "2026-06-01T08:00:00Z", profile="ublox-m10")
track = receiver.encoder("kml", STEP_S)
truth, errors = [], []
os.makedirs("out", exist_ok=True)
with open("out/own_loop.kml", "wb") as file:
    file.write(track.begin())
    for step in range(250):
        position, velocity = pose(step * STEP_S)
        epoch = receiver.observe(step * STEP_S, position, velocity)
        file.write(track.encode(epoch))
        truth.append(position)
        errors.append(epoch.error_enu_m)     # NaN without a fix; epoch.position is the fix itself
    file.write(track.end())

horizontal = numpy.hypot(*numpy.array(errors).T[:2])
print(f"{len(errors)} epochs, {numpy.isfinite(horizontal).sum()} with a fix; horizontal error: "
      f"median {numpy.nanmedian(horizontal):.1f} m, largest {numpy.nanmax(horizontal):.1f} m")

try:
    import matplotlib
    matplotlib.use("Agg")
    from matplotlib import pyplot
except ImportError:
    raise SystemExit(0)
truth, errors = numpy.array(truth), numpy.array(errors)
pyplot.figure(figsize=(9, 4))
pyplot.plot(truth[:, 0], truth[:, 1], "k-", label="truth")
pyplot.plot(*(truth + errors).T[:2], ".", label="fixes")
pyplot.xlabel("east [m]")
pyplot.ylabel("north [m]")
pyplot.axis("equal")
pyplot.legend()
pyplot.savefig("out/own_loop.png", dpi=100)
