"""Twenty-five filters of fixes, as used after a receiver: medians, smoothing, Kalman filters of constant velocity."""
import numpy as np

MEDIANS_S = (3, 5, 9)
SMOOTHING_S = (2, 5, 10)  # time constants
# Deviation of a fix [m], acceleration [m/s^2 in 1 s], gate [deviations], reset after this time of rejected fixes [s], smoothed backwards.
KALMAN = [(s, a, np.inf, np.inf, False) for s in (3, 10, 30) for a in (0.5, 2)]
KALMAN += [(s, 1, gate, reset, False) for s in (5, 15) for gate in (2.5, 4) for reset in (3, 10)]
KALMAN += [(s, 1, 4, np.inf, False) for s in (5, 15)]
KALMAN += [(10, a, np.inf, np.inf, True) for a in (0.5, 2)]
FIRST_SPEED_MPS = 10  # deviation of a Kalman filter's velocity after its first fix


def kalman_name(sigma, acceleration, gate, reset, smoothed):
    gates = "" if np.isinf(gate) else f", gate {gate}, " + ("no reset" if np.isinf(reset) else f"reset {reset} s")
    return f"{'smoother' if smoothed else 'Kalman'} {sigma} m, {acceleration} m/s2{gates}"


NAMES = ["last fix", *(f"median {s} s" for s in MEDIANS_S), *(f"smoothing {s} s" for s in SMOOTHING_S),
         *(kalman_name(*k) for k in KALMAN)]


def held(estimates):
    """Rows (epochs, 2) that are NaN repeat the row before; those before the first stay NaN."""
    known = np.where(np.isnan(estimates[:, 0]), 0, np.arange(len(estimates)))
    return estimates[np.maximum.accumulate(known)]


def medians(t, fixes, window_s):
    """Median of the fixes of the last `window_s`; the one before where there is none."""
    found = np.full_like(fixes, np.nan)
    first = np.searchsorted(t, t - window_s + 1e-3)
    for k, start in enumerate(first):
        window = fixes[start:k + 1]
        window = window[~np.isnan(window[:, 0])]
        if len(window):
            found[k] = np.median(window, axis=0)
    return held(found)


def smoothed(t, fixes, constant_s):
    """Exponential smoothing."""
    found, state, last = np.full_like(fixes, np.nan), None, None
    for k in np.flatnonzero(~np.isnan(fixes[:, 0])):
        gain = 1 if state is None else 1 - np.exp(-(t[k] - last) / constant_s)
        state = fixes[k] if state is None else state + gain * (fixes[k] - state)
        found[k], last = state, t[k]
    return held(found)


def kalman(t, fixes):
    """Estimates (epochs, filters, 2) of KALMAN. Both axes of a filter share one covariance."""
    sigma2, acceleration, gate, reset_s, backwards = (np.array(c, dtype=float) for c in zip(*KALMAN))
    sigma2, intensity, gate2 = sigma2 ** 2, acceleration ** 2, gate ** 2
    count = len(KALMAN)
    found = np.full((len(t), count, 2), np.nan)
    started = np.flatnonzero(~np.isnan(fixes[:, 0]))
    if not len(started):
        return found
    accepted = np.full(count, -np.inf)  # time of the last fix that passed
    x, v = np.zeros((count, 2)), np.zeros((count, 2))
    pp, pv, vv = np.zeros(count), np.zeros(count), np.zeros(count)
    kept = []  # per epoch: state and covariance before and after its fix
    for k in range(started[0], len(t)):
        dt = t[k] - t[k - 1] if k > started[0] else 0.0
        x = x + v * dt
        pp, pv, vv = (pp + dt * (2 * pv + dt * vv) + intensity * dt ** 3 / 3, pv + dt * vv + intensity * dt ** 2 / 2,
                      vv + intensity * dt)
        before = (x, v, pp, pv, vv)
        if not np.isnan(fixes[k, 0]):
            innovation = fixes[k] - x
            variance = pp + sigma2
            passes = (innovation ** 2).sum(axis=1) <= gate2 * variance
            begins = ~passes & (t[k] - accepted > reset_s)
            if k == started[0]:
                passes, begins = np.zeros(count, bool), np.ones(count, bool)
            gain, gain_v = np.where(passes, pp / variance, 0), np.where(passes, pv / variance, 0)
            x, v = x + gain[:, None] * innovation, v + gain_v[:, None] * innovation
            pp, pv, vv = (1 - gain) * pp, (1 - gain) * pv, vv - gain_v * pv
            x, v = np.where(begins[:, None], fixes[k], x), np.where(begins[:, None], 0, v)
            pp, pv, vv = np.where(begins, sigma2, pp), np.where(begins, 0, pv), np.where(begins, FIRST_SPEED_MPS ** 2, vv)
            accepted = np.where(passes | begins, t[k], accepted)
        kept.append((dt, before, (x, v, pp, pv, vv)))
        found[k] = x
    which = np.flatnonzero(backwards)
    found[started[0]:, which] = smooth_backwards([(dt, *([a[which] for a in s] for s in (before, after)))
                                                  for dt, before, after in kept])
    return found


def smooth_backwards(kept):
    """Rauch, Tung and Striebel: estimates of all epochs from states before and after their fixes."""
    x, v = kept[-1][2][:2]
    found = [x]
    for (dt, before, _), (_, _, after) in zip(kept[:0:-1], kept[-2::-1]):
        bx, bv, bpp, bpv, bvv = before
        ax, av, app, apv, avv = after
        determinant = bpp * bvv - bpv ** 2
        cross = ((app + dt * apv, apv), (apv + dt * avv, avv))  # covariance of this state with the next
        (g00, g01), (g10, g11) = (((a * bvv - b * bpv) / determinant, (b * bpp - a * bpv) / determinant) for a, b in cross)
        dx, dv = x - bx, v - bv
        x, v = ax + g00[:, None] * dx + g01[:, None] * dv, av + g10[:, None] * dx + g11[:, None] * dv
        found.append(x)
    return np.stack(found[::-1])


def run(t, fixes):
    """Estimates (epochs, filters, 2) at times `t` [s] from fixes (epochs, 2) [m]; NaN: no fix, and before the first."""
    simple = [held(fixes), *(medians(t, fixes, s) for s in MEDIANS_S), *(smoothed(t, fixes, s) for s in SMOOTHING_S)]
    return np.concatenate([np.stack(simple, axis=1), kalman(t, fixes)], axis=1)
