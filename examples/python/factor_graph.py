"""A factor graph of raw pseudoranges: the positions and clocks of a complete drive at once, robust against reflections.

Factors: a pseudorange (position, clock of its system) with a Cauchy loss, and the acceleration of three neighbours. In GTSAM these are a
custom factor with `noiseModel.Robust` and a second difference; here SciPy solves the same sparse normal equations.
"""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve

import canyon

scenario = canyon.Scenario.load("examples/synthetic_drive.yaml", rate_hz=1)
run = canyon.simulate(scenario)
epochs, seen = run.epochs, run.satellites
used = np.isfinite(seen["pseudorange_m"]) & (seen["elevation_deg"] > 10)
number = np.searchsorted(epochs["time"], seen["time"][used])  # the epoch of a measurement
satellite, system = seen["sat"][used], np.array([s[0] for s in seen["sat"][used]])
systems, measured, sigma = sorted(set(system)), seen["pseudorange_m"][used], seen["sigma_m"][used]
sky = canyon.Sky(epochs["time"][0], epochs["time"][-1], nominal=True)
count, width = len(epochs["time"]), 3 + len(systems)  # unknowns of an epoch: position from the first fix, a clock for each system
city = canyon.City.of_scenario(scenario)
origin = np.stack([epochs[f"fix_{axis}"] for axis in ("latitude_deg", "longitude_deg", "height_m")], 1)[0]
look = sky.look(epochs["time"], origin)
column = np.array([sky.satellites.index(s) for s in satellite])
azimuth, elevation = look["azimuth_rad"][number, column], look["elevation_rad"][number, column]
east_north_up = np.stack([np.sin(azimuth) * np.cos(elevation), np.cos(azimuth) * np.cos(elevation), np.sin(elevation)], 1)
rest = measured - look["range_m"][number, column]  # of a position near the first fix: - direction * position + clock
rows = np.arange(len(rest))
columns = width * number[:, None] + np.arange(3)
clocks = width * number + 3 + np.searchsorted(systems, system)
pseudoranges = coo_matrix((np.r_[-east_north_up.ravel(), np.ones(len(rest))], (np.r_[np.repeat(rows, 3), rows], np.r_[columns.ravel(), clocks])),
                          (len(rest), width * count)).tocsr()
inner = width * np.arange(1, count - 1)[:, None] + np.arange(3)  # accelerations of 1 m/s^2
steps = np.arange(inner.size)
motion = coo_matrix((np.repeat([1.0, -2.0, 1.0], inner.size), (np.tile(steps, 3), np.r_[inner.ravel() - width, inner.ravel(), inner.ravel() + width])),
                    (inner.size, width * count)).tocsr()
weight = sigma**-2.0
for _ in range(20):
    estimate = spsolve((pseudoranges.T.multiply(weight) @ pseudoranges + motion.T @ motion).tocsc(), pseudoranges.T @ (weight * rest))
    weight = sigma**-2.0 / (1 + ((rest - pseudoranges @ estimate) / sigma) ** 2)
places = estimate.reshape(count, width)[:, :3] + city.enu_of(origin[None])
truth = city.enu_of(np.stack([epochs[f"true_{axis}"] for axis in ("latitude_deg", "longitude_deg", "height_m")], 1))
error = np.linalg.norm((places - truth)[:, :2], axis=1)
own = np.hypot(epochs["error_east_m"], epochs["error_north_m"])
print(f"median, 95 % horizontal error: the receiver's own fix {np.nanmedian(own):.1f}, {np.nanquantile(own, 0.95):.1f} m; "
      f"the factor graph {np.median(error):.1f}, {np.quantile(error, 0.95):.1f} m")
