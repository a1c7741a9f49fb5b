#!/usr/bin/env python3
"""Noise of two receivers on laboratory simulators compared with their profiles: same place, sky and C/N0.

usage: tests/cross_checks/laboratory.py CANYON [--data FOLDER] [--keep FOLDER]

A NEO-F9P for 15 min at 1 Hz (f9p-laboratory) and a PolaRx5TR every 5 min for 4 h (skydel-20230108), no reflections. Rows
are signals at their median C/N0; other C/N0 are brought there by sigma^2 ~ 1 / (C/N0). Phases and Dopplers: second
differences of epochs over the square root of 6, less the truth's (Canyon's without noise) and the mean of the signal's
satellites (the clock), by the median of their size. Codes: at 1 Hz less the phase and a parabola of each satellite,
with the correlation after 1 and 5 s; else as phases. The F9P also states its deviations (UBX-RXM-RAWX), as its own log
does. Exit status 77, and SKIPPED, without the data.
"""
import argparse
import collections
import gzip
import math
import pathlib
import shutil
import statistics
import struct
import subprocess
import sys
import tempfile

import gnss_sdr

SCENARIO = '''\
city: {{open: true, origin: {{latitude_deg: 30, longitude_deg: 95, height_m: -2}}}}
sky: {{navigation: [{navigation}], systems: [GPS, Galileo], allow_stale: true, errors: {{enabled: false}}}}
start: {start}
rate_hz: {rate}
duration_s: {seconds}
trajectory: {{waypoints: [{{east_m: 0, north_m: 0, up_m: 2}}], hold_s: {seconds}}}
propagation: {{diffraction: false, ground_reflection: false, diffuse: {{enabled: false}}}}
receivers:
  - {{name: truth, {common}, signal: {{enabled: true, loop_noise: false, antenna: phone, lock: {lock}}}}}
  - {{name: ours, profile: {profile}, {common}, elevation_mask_deg: 0,
     signal: {{antenna: phone, satellite_sigma_db: 0, offset_db: [{offsets}], lock: {{warm_start: true}}}}}}
outputs: {{pictures: false, ubx: true}}
'''
LOCK = '{warm_start: true, tracking_threshold_dbhz: 5, acquisition_threshold_dbhz: 6}'
COMMON = ('tracks: [{tracks}], ionosphere: {atmosphere}, troposphere: {atmosphere}, noise: {{enabled: false}}, '
          'clock: {{bias_s: 0, drift: 0, drift_walk: 0}}')
LIGHT = 299792458.0
# System, start of RINEX codes, wavelength, signal of UBX.
SIGNALS = {'L1CA': ('G', ('1C',), LIGHT / 1575.42e6, (0, 0)), 'L2C': ('G', ('2L', '2X'), LIGHT / 1227.6e6, (0, 3)),
           'L5': ('G', ('5X', '5Q'), LIGHT / 1176.45e6, (0, 7)), 'E1': ('E', ('1X', '1C'), LIGHT / 1575.42e6, (2, 0)),
           'E5a': ('E', ('5X', '5Q'), LIGHT / 1176.45e6, (2, 4))}
RECEIVERS = {
    'NEO-F9P': dict(profile='ublox-f9p', signals=['L1CA', 'E1', 'L5', 'E5a'], atmosphere='true', step=1, seconds=915,
                    start='2023-01-08T09:45:10Z', recorded='f9p-laboratory/neo-f9p-15min.obs.gz',
                    navigation=['f9p-laboratory/neo-f9p-15min.nav.gz']),
    'PolaRx5TR': dict(profile='survey', signals=['L1CA', 'L2C', 'E1'], atmosphere='false', step=300, seconds=14400,
                      start='2023-01-08T09:59:42Z', recorded='skydel-20230108/polarx5tr.obs.gz',
                      navigation=[f'skydel-20230108/SkydelRINEX_S_20238959_{part}N.rnx.gz' for part in ('7200S_G', '600S_E')]),
}
FIELDS = ['code', 'phase', 'Doppler', 'after 1 s', 'after 5 s']
MOST, MOST_CORRELATION = 0.2, 0.15
# Code [m], phase [cycles], Doppler [Hz] reported by the recorded F9P at these C/N0.
STATED = ((0.08, 0.08), (0.004, 0.004), (0.064, 0.128))
PULLS_IN_S = 90


def residuals(recorded, truth, signal):
    """{time: {satellite: (code minus truth [m], phase [m], Doppler [Hz], C/N0)}}, at the receiver's true time."""
    system, codes, wavelength, _ = SIGNALS[signal]

    def values(row):
        found = [next((row[k + c] for c in codes if k + c in row), None) for k in 'CLDS']
        return None if None in found else found
    result = collections.defaultdict(dict)
    for time, rows in recorded.items():
        whole = time.replace(microsecond=0)
        pairs = {n: (values(row), values(truth[whole][n])) for n, row in rows.items()
                 if n[0] == system and n in truth.get(whole, {})}
        pairs = {n: pair for n, pair in pairs.items() if None not in pair}
        if not pairs:
            continue
        late = (time - whole).total_seconds() - statistics.median(a[0] - b[0] for a, b in pairs.values()) / LIGHT
        for n, ((c, p, d, cn0), (true_c, true_p, true_d, _)) in pairs.items():
            result[time][n] = (c - true_c + true_d * wavelength * late, wavelength * (p - true_p + true_d * late), d - true_d, cn0)
    return result


def without_parabola(y):
    x = [2 * i / (len(y) - 1) - 1 for i in range(len(y))]
    basis = [[1.0] * len(y)]
    for power in (1, 2):  # Gram-Schmidt
        b = [v ** power for v in x]
        for a in basis:
            share = sum(u * v for u, v in zip(a, b)) / sum(u * u for u in a)
            b = [v - share * u for u, v in zip(a, b)]
        basis.append(b)
    for a in basis:
        share = sum(u * v for u, v in zip(a, y)) / sum(u * u for u in a)
        y = [v - share * u for u, v in zip(a, y)]
    return y


def figures(found, step, middle):
    """Values of FIELDS at the C/N0 `middle`."""
    def weight(value):
        return 10 ** ((value[3] - middle) / 20)
    arcs, epochs = collections.defaultdict(list), collections.defaultdict(dict)
    for time in sorted(found):
        for n, value in found[time].items():
            if not arcs[n] or (time - arcs[n][-1][-1][0]).total_seconds() > 1.5 * step:
                arcs[n].append([])
            arcs[n][-1].append((time, value))
            if len(arcs[n][-1]) * step > PULLS_IN_S:
                epochs[time][n] = value
    sizes = collections.defaultdict(list)
    times = sorted(epochs)
    for first, middle_time, last in zip(times, times[1:], times[2:]):
        three = [epochs[t] for t in (first, middle_time, last)]
        names = [n for n in three[0] if n in three[1] and n in three[2]]
        if (last - first).total_seconds() > 2.5 * step or len(names) < 4:
            continue
        for i in range(3):
            bend = {n: three[0][n][i] - 2 * three[1][n][i] + three[2][n][i] for n in names}
            clock = statistics.median(bend.values())
            near = [n for n in names if i != 1 or abs(bend[n] - clock) < 0.05]  # no cycle slips
            clock = statistics.fmean(bend[n] for n in near)
            part = math.sqrt(6 * (1 - 1 / len(near))) if len(near) > 1 else math.inf
            sizes[FIELDS[i]] += [abs(bend[n] - clock) / part * weight(three[1][n]) for n in near]
    result = {k: 1.4826 * statistics.median(v) for k, v in sizes.items()}
    if step > 1:
        return result
    of_arcs = collections.defaultdict(list)
    for arc in (a[PULLS_IN_S:] for of_satellite in arcs.values() for a in of_satellite):
        if len(arc) < 200:
            continue
        y = [v * weight(value) for v, (_, value) in zip(without_parabola([v[0] - v[1] for _, v in arc]), arc)]
        variance = statistics.fmean(v * v for v in y)
        of_arcs['code'].append(math.sqrt(variance))
        for lag in (1, 5):
            of_arcs[f'after {lag} s'].append(statistics.fmean(a * b for a, b in zip(y, y[lag:])) / variance)
    return result | {k: statistics.median(v) for k, v in of_arcs.items()}


def stated(path, of_signal):
    """Medians of the deviations of code [m], phase [cycles] and Doppler [Hz] in RXM-RAWX."""
    data, at, rows = path.read_bytes(), 0, []
    while (at := data.find(b'\xb5\x62\x02\x15', at)) >= 0:
        payload = data[at + 6:at + 6 + struct.unpack_from('<H', data, at + 4)[0]]
        for k in range(payload[11]):
            gnss, _, sig, _, _, _, code, phase, doppler = struct.unpack_from('<BBBBHBBBB', payload, 16 + 32 * k + 20)
            if (gnss, sig) == of_signal:
                rows.append((0.01 * 2 ** (code & 15), 0.004 * (phase & 15), 0.002 * 2 ** (doppler & 15)))
        at += 6
    return [statistics.median(column) for column in zip(*rows)]


def judge(name, receiver, canyon, data, folder):
    folder.mkdir(exist_ok=True)
    (folder / 'recorded.obs').write_bytes(gzip.decompress((data / receiver['recorded']).read_bytes()))
    recorded = gnss_sdr.observations(folder / 'recorded.obs')
    signals, step = receiver['signals'], receiver['step']
    offsets, failures = dict.fromkeys(signals, 0.0), []
    common = COMMON.format(tracks=', '.join(signals), atmosphere=receiver['atmosphere'])
    for last in (False, True):  # first for the levels
        (folder / 's.yaml').write_text(SCENARIO.format(
            navigation=', '.join(str(data / n) for n in receiver['navigation']), start=receiver['start'],
            rate=1 if step == 1 else 0.1, seconds=receiver['seconds'], common=common, lock=LOCK,
            profile=receiver['profile'], offsets=', '.join(f'{s}={v:.1f}' for s, v in offsets.items())))
        subprocess.run([canyon, 'simulate', 's.yaml', '--out', 'out', '--quiet'], cwd=folder, check=True)
        truth = gnss_sdr.observations(folder / 'out/truth/receiver.obs')
        ours = gnss_sdr.observations(folder / 'out/ours/receiver.obs')
        for signal in signals:
            pair = [residuals(each, truth, signal) for each in (recorded, ours)]
            middles = [statistics.median(v[3] for row in each.values() for v in row.values()) for each in pair]
            if not last:
                offsets[signal] = middles[0] - middles[1]
                continue
            real, simulated = (figures(each, s, middles[0]) for each, s in zip(pair, (step, 1 if step == 1 else 10)))
            text = f'{name:9} {signal:4} {middles[0]:5.1f}'
            for field in FIELDS:
                if field not in real:
                    continue
                a, b = real[field], simulated[field] if field in simulated else math.nan
                scale = 1000 if field == 'phase' else 1
                text += f'  {field} {scale * a:.3f}, {scale * b:.3f}'
                off, most = (abs(b - a), MOST_CORRELATION) if 'after' in field else (abs(b / a - 1), MOST)
                if not off <= most:
                    failures.append(f'{name}, {signal}, {field}: {b:.4f} instead of {a:.4f}')
            if name == 'NEO-F9P':
                says = stated(folder / 'out/ours/receiver.ubx', SIGNALS[signal][3])
                text += '  states ' + ', '.join(f'{v:g}' for v in says)
                if not all(low * 0.999 <= v <= high * 1.001 for v, (low, high) in zip(says, STATED)):
                    failures.append(f'{name}, {signal}: states {says}')
            print(text, flush=True)
    return failures


if __name__ == '__main__':
    parser = argparse.ArgumentParser()
    parser.add_argument('canyon', type=pathlib.Path)
    parser.add_argument('--data', type=pathlib.Path, default=pathlib.Path(__file__).resolve().parents[2] / '../shared/data')
    parser.add_argument('--keep')
    options = parser.parse_args()
    data = options.data.resolve()
    if not (data / 'f9p-laboratory').exists():
        print(f'SKIPPED: {data}/f9p-laboratory is not there')
        sys.exit(77)
    folder = pathlib.Path(options.keep or tempfile.mkdtemp(prefix='canyon-laboratory-')).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    print('receiver  signal C/N0; recorded, simulated: code [m], phase [mm], Doppler [Hz], correlation of the code')
    failed = []
    try:
        for name, receiver in RECEIVERS.items():
            failed += judge(name, receiver, options.canyon.resolve(), data, folder / name)
    finally:
        if not options.keep:
            shutil.rmtree(folder, ignore_errors=True)
    for failure in failed:
        print(f'FAILED: {failure}')
    sys.exit(1 if failed else 0)
