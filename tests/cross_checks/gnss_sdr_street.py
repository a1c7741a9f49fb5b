#!/usr/bin/env python3
"""Two drives in streets as samples of `canyon iq`: GNSS-SDR compared with Canyon's receiver with similar loops, GPS L1 C/A.

usage: tests/cross_checks/gnss_sdr_street.py CANYON [--data FOLDER] [--only downtown,hongkong] [--keep FOLDER]

The demo's downtown and, where its data is (../shared/data), two minutes of the recorded drive in Hong Kong
(examples/urbannav_tst_m8t.yaml). Code errors against the true pseudoranges, C/N0, and who measures when. Exit status
77, and SKIPPED, if gnss-sdr is not installed.
"""
import argparse
import csv
import pathlib
import statistics
import subprocess
import sys

import gnss_sdr

DOWNTOWN = '''\
city:
  synthetic: {blocks_east: 8, blocks_north: 8, block_size_m: 60, street_width_m: 16, min_height_m: 12, max_height_m: 200, seed: 7}
  origin: {latitude_deg: 22.3, longitude_deg: 114.17, height_m: 0}
sky: {nominal: true, systems: [GPS], errors: {enabled: false}}
start: 2026-06-01T08:00:00Z
duration_s: 200
trajectory:
  waypoints: [{east_m: -228, north_m: -228, hold_s: 20}, {east_m: -228, north_m: 0}, {east_m: 0, north_m: 0},
              {east_m: 0, north_m: 152}, {east_m: 152, north_m: 152}, {east_m: 152, north_m: -76},
              {east_m: -76, north_m: -76}, {east_m: -76, north_m: 228}, {east_m: 228, north_m: 228},
              {east_m: 228, north_m: 0}, {east_m: 76, north_m: 0}, {east_m: 76, north_m: -228}]
  speed_mps: 8
  acceleration_mps2: 2
  height_above_terrain_m: 1.5
'''
HONGKONG = '''\
city:
  mesh: DATA/hongkong/buildings.dae
  origin: {latitude_deg: 22.298251, longitude_deg: 114.178761, height_m: 0}
  offset: {east_m: 0, north_m: 8, up_m: 0}
sky:
  navigation: [DATA/urbannav-tst-20190428/hksc1180.19n, DATA/urbannav-tst-20190428/hksc1180.19b]
  systems: [GPS]
start: {week: 2051, tow: 46790}
duration_s: 120
trajectory: {file: DATA/urbannav-tst-20190428/groundTruth_TST.csv, format: urbannav, height_above_terrain_m: 2.0}
surroundings: dense
'''
# The same receiver with and without the noise of its code loop.
RECEIVERS = '''\
rate_hz: 10
seed: 1
outputs: [epochs_csv, satellites_csv]
receivers:
'''
RECEIVER = '''\
  - name: {name}
    independent_noise: false
    noise: {{enabled: false}}
    clock: {{bias_s: 0, drift: 0, drift_walk: 0}}
    signal:
      enabled: true
      loop_noise: {noise}
      cn0_step_db: 0
      cn0_sigma_db: 0
      front_end_bandwidth_hz: none
      lock: {{acquisition_threshold_dbhz: 35, tracking_threshold_dbhz: 25}}
      dll: {{spacing_chips: 0.5, discriminator: early_late_power, loop_bandwidth_hz: 1, integration_s: 0.02}}
'''
TRUTH = '''\
city: {{open: true, origin: {{latitude_deg: {latitude}, longitude_deg: {longitude}, height_m: 0}}}}
trajectory: {{file: way.csv, format: csv}}
'''
MOST_KS, MOST_M, MOST_DB, LEAST_CORRELATION = 0.12, 1.0, 1.0, 0.7
OFF_CARRIER_DB = 10
WORTH_DBHZ = 35        # maximum over time of a satellite that is searched
NOISE_POWER = 2 * (0.25 * 127) ** 2    # of a sample of int8


def true_ranges(canyon, folder, scenario):
    """True ranges along the driven path, under an open sky without obstructions and delays."""
    with open(folder / 'ours/clean/epochs.csv') as file, open(folder / 'way.csv', 'w') as way:
        for i, row in enumerate(csv.DictReader(file)):
            way.write(f"{i / 10},{row['true_latitude_deg']},{row['true_longitude_deg']},{row['true_height_m']}\n")
    kept = [line for line in scenario.splitlines() if line.startswith(('sky:', '  navigation:', '  systems:', 'start:', 'duration_s:'))]
    open_sky = TRUTH.format(latitude=row['true_latitude_deg'], longitude=row['true_longitude_deg'])
    (folder / 'open.yaml').write_text('\n'.join(kept) + '\n' + open_sky + RECEIVERS + RECEIVER.format(name='antenna', noise='false'))
    subprocess.run([canyon, 'simulate', 'open.yaml', '--out', 'open', '--quiet'], cwd=folder, check=True)
    return gnss_sdr.ranges(folder / 'open/satellites.csv')


def kolmogorov_smirnov(a, b):
    """Maximum distance of the distributions."""
    a, b = sorted(a), sorted(b)
    largest, i, j = 0.0, 0, 0
    while i < len(a) and j < len(b):
        at = min(a[i], b[j])
        while i < len(a) and a[i] <= at:
            i += 1
        while j < len(b) and b[j] <= at:
            j += 1
        largest = max(largest, abs(i / len(a) - j / len(b)))
    return largest


def quantile(values, share):
    return sorted(values)[min(len(values) - 1, int(share * len(values)))]


def compare(name, clean, noisy, theirs, visibility):
    failures = []
    epochs = {n: clean[n].keys() for n in clean}
    measured = {who: {(n, k) for n in s for k in s[n] if s[n][k].measured and k >= 20} for who, s in
                (('ours', clean), ('theirs', theirs))}
    all_epochs = sum(len([k for k in epochs[n] if k >= 20]) for n in epochs)
    both = measured['ours'] & measured['theirs']
    # Phase loops that lost the carrier in a fade and pull the code away.
    off = {(n, k) for n, k in both if theirs[n][k].cn0_dbhz < clean[n][k].cn0_dbhz - OFF_CARRIER_DB}
    print(f"{name}: {all_epochs} epochs of {len(epochs)} satellites; measured by Canyon {len(measured['ours']) / all_epochs:.3f}, GNSS-SDR "
          f"{len(measured['theirs']) / all_epochs:.3f}, both {len(both) / all_epochs:.3f}; GNSS-SDR off the carrier at {len(off)} of {len(both)}")
    print('          epochs  KS     correlation  median difference  median, 95 % of |error|: GNSS-SDR, Canyon   C/N0: median difference, 90 %')
    for kind in ('LOS', 'NLOS', 'all'):
        of = sorted(p for p in both - off if kind == 'all' or visibility.get(p, '').startswith(kind))
        if len(of) < 50:
            continue
        t = [theirs[n][k].error_m for n, k in of]
        c = [clean[n][k].error_m for n, k in of]
        o = [noisy[n][k].error_m for n, k in of if noisy[n].get(k) and noisy[n][k].measured]
        difference = [x - y for x, y in zip(t, c)]
        cn0 = [theirs[n][k].cn0_dbhz - clean[n][k].cn0_dbhz for n, k in of]
        print(f'{kind:10}{len(of):6} {kolmogorov_smirnov(t, o):6.3f} {statistics.correlation(t, c):8.3f} '
              f'{statistics.median(difference):14.2f} m {statistics.median(map(abs, t)):14.1f} {quantile(list(map(abs, t)), 0.95):6.1f}, '
              f'{statistics.median(map(abs, o)):6.1f} {quantile(list(map(abs, o)), 0.95):6.1f} m '
              f'{statistics.median(cn0):12.1f} {quantile(list(map(abs, cn0)), 0.9):6.1f} dB', flush=True)
        for what, found, most in (('KS', kolmogorov_smirnov(t, o), MOST_KS), ('median', statistics.median(difference), MOST_M),
                                  ('C/N0', statistics.median(cn0), MOST_DB)):
            if kind == 'all' and abs(found) > most:
                failures.append(f'{name}: {what} {found:.2f}')
        if kind == 'all' and statistics.correlation(t, c) < LEAST_CORRELATION:
            failures.append(f'{name}: correlation {statistics.correlation(t, c):.2f}')
    # The state of GNSS-SDR's channel while only Canyon measures.
    alone = measured['ours'] - both
    away = sum(1 for n, k in alone if k not in theirs[n])
    wrong = sum(1 for n, k in alone if k in theirs[n] and abs(theirs[n][k].error_m) > gnss_sdr.LARGEST_M)
    print(f'by Canyon alone {len(alone)}: GNSS-SDR searches or pulls in at {away}, is on noise at {wrong}, has less than 25 dB-Hz at '
          f'{len(alone) - away - wrong}')
    for n in sorted(clean):
        a, b = ({k for m, k in measured[who] if m == n} for who in ('ours', 'theirs'))
        print(f'  {n}: Canyon {len(a)}, GNSS-SDR {len(b)}, both {len(a & b)} of {len(epochs[n])}')
    if len(both) < 0.85 * len(measured['theirs']):
        failures.append(f"{name}: Canyon measures {len(both)} of {len(measured['theirs'])} that GNSS-SDR measures")
    return failures


def drive(canyon, folder, name, scenario):
    folder.mkdir(exist_ok=True)
    text = scenario + RECEIVERS + RECEIVER.format(name='clean', noise='false') + RECEIVER.format(name='noisy', noise='true')
    (folder / 'drive.yaml').write_text(text)
    subprocess.run([canyon, 'simulate', 'drive.yaml', '--out', 'ours', '--quiet'], cwd=folder, check=True)
    truth = true_ranges(canyon, folder, scenario)
    clean = gnss_sdr.sights_of(folder / 'ours/clean/satellites.csv', truth)
    noisy = gnss_sdr.sights_of(folder / 'ours/noisy/satellites.csv', truth)
    # The others only take GNSS-SDR's time.
    truth = {n: truth[n] for n in truth if any(sight.cn0_dbhz > WORTH_DBHZ for sight in clean[n].values())}
    clean, noisy = ({n: s[n] for n in truth} for s in (clean, noisy))
    visibility, first = {}, None
    with open(folder / 'ours/clean/satellites.csv') as file:
        for row in csv.DictReader(file):
            tenths = round(float(row['gps_tow']) * 10)
            first = tenths if first is None else first
            visibility[row['sat'], tenths - first] = row['visibility']
    if not (folder / 'theirs').exists():
        subprocess.run([canyon, 'iq', 'drive.yaml', '--receiver', 'clean', '--out', 'drive.iq', '--quiet'], cwd=folder, check=True)
        gnss_sdr.receive_channels(folder / 'theirs', folder / 'drive.iq', sorted(truth), 0.5)
        (folder / 'drive.iq').unlink()
    channels = gnss_sdr.read_channels(folder / 'theirs')
    theirs = {n: gnss_sdr.sights(channels.get(n, []), truth[n], NOISE_POWER) for n in truth}
    return compare(name, clean, noisy, theirs, visibility)


def judge(options, canyon, folder):
    data = pathlib.Path(options.data).resolve()
    failures = []
    for name in options.only.split(','):
        if name == 'hongkong' and not data.exists():
            print(f'SKIPPED: the drive in Hong Kong ({data} is not there)')
            continue
        scenario = DOWNTOWN if name == 'downtown' else HONGKONG.replace('DATA', str(data))
        failures += drive(canyon, folder / name, name, scenario)
    return failures


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('--data', default=pathlib.Path(__file__).resolve().parents[3] / 'shared/data')
    parser.add_argument('--only', default='downtown,hongkong')
    return gnss_sdr.run_judge(parser, judge)


if __name__ == '__main__':
    sys.exit(main())
