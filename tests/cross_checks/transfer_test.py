#!/usr/bin/python3
"""Closed forms for transfer.py: its pairs, its filters, its files."""
import math

import numpy as np

import fix_filters
import pairs
import transfer

near = np.allclose
rng = np.random.default_rng(3)

# Blocks: every value once or more, means of the columns; a period of one block has no spread.
values = np.tile(np.arange(60.0), 10)[:, None]
means = pairs.block_means(values, 60, 500, rng)
assert near(means, 29.5)
walk = pairs.block_means(rng.normal(size=(6000, 1)), 60, 2000, rng)
assert 0.9 < walk.std() * math.sqrt(6000) < 1.1  # white noise: the deviation of a mean
slow = pairs.block_means(np.repeat(rng.normal(size=(100, 1)), 60, axis=0), 60, 2000, rng)
assert 0.06 < slow.std() < 0.14  # constant in blocks: about that of 100 values, not of 6000

# Pairs: a difference far beyond its spread is decided with its sign, equal ones are not; a third of noise alone is not.
noise = rng.normal(size=(1200, 3))
means = pairs.block_means(noise + [0, 1, 0], 60, 2000, rng)
assert list(pairs.decided(means)[[0, 2]]) == [-1, 1]  # pairs 0-1, 0-2, 1-2
assert pairs.decided(np.zeros((100, 2)))[0] == 0
false = [pairs.decided(pairs.block_means(rng.normal(size=(600, 2)), 20, 400, rng))[0] != 0 for _ in range(300)]
assert 0.05 < np.mean(false) < 0.17  # 10 %

assert pairs.agreement(np.array([1, -1, 0, 1]), np.array([2.0, 3.0, -1.0, 0.0])) == 1 / 3
assert math.isnan(pairs.agreement(np.array([0]), np.array([1.0])))

# Coverage: Student's quantiles, and 90 % of the recorded differences sampled like those of the seeds.
assert near([pairs.student(0.95, 1), pairs.student(0.95, 9), pairs.student(0.95, 200)], [6.3138, 1.8331, 1.6525], atol=2e-2)
draws = rng.normal(5, 3, size=(11, 20000))
assert abs(pairs.coverage(draws[0], draws[1:]) - 0.9) < 0.01
assert pairs.coverage(draws[0] + 30, draws[1:]) < 0.05 and math.isnan(pairs.coverage(draws[0], draws[1:2]))

# Kendall's tau-b, and the maximum: 1 without variation, tau of noise if nothing else differs.
assert pairs.kendall([1, 2, 3, 4], [10, 20, 30, 40]) == 1 and pairs.kendall([1, 2, 3], [3, 2, 1]) == -1
assert near(pairs.kendall([1, 2, 3, 4, 5], [3, 4, 1, 2, 5]), 0.2) and near(pairs.kendall([1, 1, 2, 3], [1, 2, 3, 4]), 5 / math.sqrt(30))
assert math.isnan(pairs.kendall([1, 1], [1, 2]))
same = np.tile([[1.0, 2.0, 3.0, 4.0]], (600, 1))
assert pairs.ceiling(pairs.block_means(same, 60, 200, rng), 10, rng) == 1
alike = pairs.block_means(rng.normal(size=(600, 8)) + 0.01 * np.arange(8), 60, 500, rng)
apart = pairs.block_means(rng.normal(size=(600, 8)) + np.arange(8), 60, 500, rng)
assert pairs.ceiling(alike, 10, rng) < 0.8 and pairs.ceiling(apart, 10, rng) == 1
found = pairs.compare(same, np.tile([[1.0, 2.0, 3.0, 4.0]], (10, 1)), 60)
assert (found["decided"], found["agreement"], found["coverage"], found["tau"], found["ceiling"]) == (6, 1, 1, 1, 1)

# Filters: 25, each once; filters with a speed state follow a straight drive without noise, others lag.
assert len(fix_filters.NAMES) == len(set(fix_filters.NAMES)) == 25
t = np.arange(300.0)
drive = np.stack([8 * t, -3 * t], axis=1)
error = dict(zip(fix_filters.NAMES, np.linalg.norm(fix_filters.run(t, drive) - drive[:, None], axis=2)[-50:].max(axis=0)))
speed = math.hypot(8, 3)
assert error["last fix"] == 0 and near(error["median 5 s"], 2 * speed)
assert near(error["smoothing 5 s"], speed / (math.exp(1 / 5) - 1), rtol=1e-3)
assert max(e for n, e in error.items() if n.startswith("Kalman") and "gate" not in n) < 1e-3

# One that begins at rest, compared with least squares over all fixes: the last estimates agree, the smoother's agree everywhere.
sigma, acceleration = 10, 2
column, smoother = (fix_filters.NAMES.index(f"{k} 10 m, 2 m/s2") for k in ("Kalman", "smoother"))
t, fixes = np.array([0.0, 1, 2, 3.5, 4, 6]), rng.normal(size=(6, 2)) * 10
rows, right, weights = [], [], []


def state(k, of):
    row = np.zeros(2 * len(t))
    row[2 * k + of] = 1
    return row


for k, fix in enumerate(fixes):
    rows.append(state(k, 0)[None]), right.append(fix[None]), weights.append(np.eye(1) / sigma ** 2)
    if k:
        dt = t[k] - t[k - 1]
        rows.append(np.stack([state(k, 0) - state(k - 1, 0) - dt * state(k - 1, 1), state(k, 1) - state(k - 1, 1)]))
        weights.append(np.linalg.inv(acceleration ** 2 * np.array([[dt ** 3 / 3, dt ** 2 / 2], [dt ** 2 / 2, dt]])))
    else:
        rows.append(state(0, 1)[None]), weights.append(np.eye(1) / fix_filters.FIRST_SPEED_MPS ** 2)
    right.append(np.zeros((len(rows[-1]), 2)))
normal = sum(r.T @ w @ r for r, w in zip(rows, weights))
best = np.linalg.solve(normal, sum(r.T @ w @ y for r, w, y in zip(rows, weights, right)))[::2]
estimates = fix_filters.run(t, fixes)
assert near(estimates[-1, column], best[-1]) and near(estimates[:, smoother], best)

# A gate: an outlier is rejected, and a persistent jump restarts the filter after the reset time.
t = np.arange(60.0)
fixes = rng.normal(size=(60, 2))
fixes[30] += 500
fixes[45:] += 500
fixes[:2] = np.nan
gated, lost = (fix_filters.NAMES.index(f"Kalman 5 m, 1 m/s2, gate 4, {r}reset{a}") for r, a in (("", " 3 s"), ("no ", "")))
estimates = fix_filters.run(t, fixes)
assert np.isnan(estimates[:2]).all() and np.abs(estimates[30, gated]).max() < 10
assert np.abs(estimates[47, gated]).max() < 20 and np.abs(estimates[50:, gated] - 500).max() < 10 and np.abs(estimates[-1, lost]).max() < 100
fixes[50:] = np.nan  # the last fix is held
assert near(fix_filters.run(t, fixes)[-1, 0], fixes[49])

# White noise of a known level: the median error, and fractions beyond 10 m.
truth = np.zeros((3000, 2))
figures = transfer.of_filters(np.arange(3000.0), rng.normal(0, 8, truth.shape), truth)
assert abs(figures[1][:, 0].mean() - math.exp(-100 / 128)) < 0.03 and abs(figures[0][:, 0].mean() - 8 * math.sqrt(math.pi / 2)) < 0.4
assert near([f[:, 0].mean() for f in transfer.of_filters(np.arange(9.0), np.full((9, 2), np.nan), truth[:9])], [100, 1, 1])

# Files: epochs of RINEX 2 and 3, noise on pseudoranges only, nearest epochs.
text = " 16  6  6 11 10 41.7000000  0 19G12R20R02G19G32\n  19834589.652 8 104231461.634 8        49.000 8       221.941 8\n"
assert near(transfer.epochs_of(text), [126641.7])
text = "G    4 C1C L1C D1C S1C                                      SYS / # / OBS TYPES \n> 2021  5 17  2 33 13.4446064  0  9\n" \
       "G01  21535816.773 4                      3095.007          25.000\n"
assert near(transfer.epochs_of(text), [95593.4446064])
noisy = transfer.with_noise(text, 10, rng).splitlines()
assert noisy[:2] == text.splitlines()[:2] and noisy[2][17:] == text.splitlines()[2][17:] and noisy[2] != text.splitlines()[2]
found = transfer.nearest(np.arange(4.0), np.array([0.02, 2.4, 9]), np.array([[1.0], [2], [3]]))
assert near(found[:, 0], [1, np.nan, 2, np.nan], equal_nan=True)
assert len(transfer.rtklib_settings(["GPS", "BeiDou"])) == 24 and len(transfer.CANYON_SETTINGS) == 12
print("statistics, filters and files are right")
