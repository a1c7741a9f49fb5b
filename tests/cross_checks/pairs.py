"""Statistics of pairs of settings: pairs decided by a recording, and the agreement of simulations."""
import numpy as np

DRAWS = 2000
BLOCK_S = 60


def block_means(values, block, draws, rng):
    """Means of columns over `draws` circular block bootstraps of the rows (Politis and Romano 1992)."""
    rows = len(values)
    block = min(block, rows)
    sums = np.cumsum(np.concatenate([np.zeros((1, values.shape[1])), values, values[:block]]), axis=0)
    of_block = (sums[block:block + rows] - sums[:rows]) / block
    starts = rng.integers(rows, size=(draws, -(-rows // block)))
    return of_block[starts].mean(axis=1)


def differences(means):
    """For each pair of the last axis: the first minus the second."""
    first, second = np.triu_indices(means.shape[-1], 1)
    return means[..., first] - means[..., second]


def decided(means):
    """For each pair -1 or 1 if the central 90 % of bootstrapped differences has that sign, else 0."""
    low, high = np.quantile(differences(means), (0.05, 0.95), axis=0)
    return (low > 0).astype(int) - (high < 0)


def agreement(signs, simulated):
    """Fraction of the decided pairs whose simulated difference has the same sign; NaN: no pairs. Equal counts as wrong."""
    pairs = signs != 0
    return np.mean(np.sign(simulated[pairs]) == signs[pairs]) if pairs.any() else np.nan


def student(probability, freedom):
    """Quantile above one half of Student's distribution."""
    angle = np.linspace(0, np.pi / 2, 100_001)[:-1]  # x = tan(angle)
    density = (1 + np.tan(angle) ** 2 / freedom) ** (-(freedom + 1) / 2) / np.cos(angle) ** 2
    area = np.cumsum(density)
    return np.tan(np.interp((2 * probability - 1) * area[-1], area, angle))


def coverage(recorded, seeds):
    """Fraction of the recorded differences within the 90 % interval of the next seed, by the differences (seeds, pairs)."""
    count = len(seeds)
    if count < 2:
        return np.nan
    reach = student(0.95, count - 1) * seeds.std(axis=0, ddof=1) * np.sqrt(1 + 1 / count)
    return np.mean(np.abs(recorded - seeds.mean(axis=0)) <= reach + 1e-12)


def kendall(x, y):
    """Kendall's tau-b; NaN if one of them is constant."""
    a, b = np.sign(differences(np.asarray(x, float))), np.sign(differences(np.asarray(y, float)))
    ties = np.sqrt((a ** 2).sum() * (b ** 2).sum())
    return (a * b).sum() / ties if ties else np.nan


def ceiling(means, seeds, rng, draws=300):
    """Mean tau of one bootstrapped recording with the mean of `seeds` others: the value of a perfect simulator."""
    taus = []
    for _ in range(draws):
        pick = rng.integers(len(means), size=seeds + 1)
        taus.append(kendall(means[pick[0]], means[pick[1:]].mean(axis=0)))
    taus = np.array(taus)
    return taus[~np.isnan(taus)].mean() if not np.isnan(taus).all() else np.nan


def compare(recorded, simulated, block, seed=1):
    """Metrics of settings. `recorded`: a value of each (epoch, setting); `simulated`: the means of each (seed, setting)."""
    rng = np.random.default_rng(seed)
    means = block_means(recorded, block, DRAWS, rng)
    signs, own, seeds = decided(means), recorded.mean(axis=0), np.asarray(simulated)
    halves = [differences(h.mean(axis=0)) for h in (seeds[::2], seeds[1::2]) if len(h)]
    return {"decided": int((signs != 0).sum()), "agreement": agreement(signs, differences(seeds.mean(axis=0))),
            "halves": [agreement(signs, h) for h in halves], "coverage": coverage(differences(own), differences(seeds)),
            "tau": kendall(own, seeds.mean(axis=0)), "ceiling": ceiling(means, len(seeds), rng)}
