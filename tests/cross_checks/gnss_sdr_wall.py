#!/usr/bin/env python3
"""Code errors of GNSS-SDR next to a wall, on samples of `canyon iq`, compared with Canyon's receiver with similar loops.

usage: tests/cross_checks/gnss_sdr_wall.py CANYON [--keep FOLDER]

An antenna with equal gain for both polarizations moves 4 cm/s away from a wall of 60 m, 30 m west of it; satellites in the west
of south and beyond the top of the wall have no echo and are the reference. Correlators are 1 and 0.3 chips apart.
Exit status 77, and SKIPPED, if gnss-sdr is not installed.
"""
import argparse
import csv
import datetime
import math
import shutil
import statistics
import subprocess
import sys

import gnss_sdr

WALL = 'o wall\nv -30 -2000 0\nv -30 2000 0\nv -30 2000 60\nv -30 -2000 60\nf 1 2 3 4\n'
SCENARIO = '''\
city: {{mesh: wall.obj, origin: {{latitude_deg: 48.1, longitude_deg: 11.5, height_m: 500}}}}
sky: {{nominal: true, systems: [GPS], errors: {{enabled: false}}}}
start: 2026-06-01T08:00:00Z
rate_hz: 10
duration_s: 100
trajectory: {{waypoints: [{{east_m: 0, north_m: 0, up_m: 2}}, {{east_m: 4, north_m: 0, up_m: 2}}], speed_mps: 0.04}}
propagation: {{diffraction: false, diffuse: {{enabled: false}}}}
receivers:
  - name: antenna
    independent_noise: false
    noise: {{enabled: false}}
    clock: {{bias_s: 0, drift: 0, drift_walk: 0}}
    signal:
      enabled: true
      loop_noise: false
      cn0_step_db: 0
      cn0_sigma_db: 0
      antenna: phone
      link: {{above_minimum_db: 15}}
      front_end_bandwidth_hz: none
      dll: {{spacing_chips: {spacing}, discriminator: early_late_power, loop_bandwidth_hz: 1, integration_s: 0.001}}
outputs: {{pictures: false}}
'''
LEAST_CORRELATION = 0.95


def errors(folder, theirs):
    """Code errors of GNSS-SDR and of Canyon for each satellite [m], epoch by epoch, after the loops' first seconds."""
    begin = datetime.datetime(2026, 6, 1)
    detour = {}
    with open(folder / 'ours/satellites.csv') as file:
        for row in csv.DictReader(file):
            if row['excess_path_m'] and row['pseudorange_m']:
                time = begin + datetime.timedelta(seconds=round(float(row['gps_tow']), 1) - 86400)
                detour[time, row['sat']] = float(row['excess_path_m'])
    ours = gnss_sdr.observations(folder / 'ours/receiver.obs')
    clean = {sat for _, sat in detour} - {sat for (_, sat), metres in detour.items() if metres != 0}
    pairs = {}
    for time in sorted(theirs)[20:]:
        late = {n: row['C1C'] - ours[time][n]['C1C'] + detour[time, n] for n, row in theirs[time].items()
                if (time, n) in detour and n in ours.get(time, {}) and 'C1C' in row}
        reference = [late[n] for n in clean if n in late]
        for n in late if reference else ():
            pairs.setdefault(n, []).append((late[n] - statistics.fmean(reference), detour[time, n]))
    return pairs, clean


def judge(options, canyon, folder):
    failures = []
    (folder / 'wall.obj').write_text(WALL)
    print('spacing  sat  epochs  GNSS-SDR: mean, deviation [m]  Canyon: mean, deviation [m]  correlation')
    for spacing in (1.0, 0.3):
        (folder / 'wall.yaml').write_text(SCENARIO.format(spacing=spacing))
        if not (folder / 'wall.iq').exists():
            subprocess.run([canyon, 'iq', 'wall.yaml', '--out', 'wall.iq', '--quiet'], cwd=folder, check=True)
        subprocess.run([canyon, 'simulate', 'wall.yaml', '--out', 'ours', '--quiet'], cwd=folder, check=True)
        work = folder / f'theirs{spacing}'
        shutil.rmtree(work, ignore_errors=True)
        work.mkdir()
        text = gnss_sdr.configuration(['L1CA'], folder / 'wall.iq', 4e6).replace('rate_ms=500', 'rate_ms=100')
        # GNSS-SDR's spacing is from early to prompt, and its loop of second order by default.
        (work / 'gnss-sdr.conf').write_text(
            text.replace('PVT.elevation_mask=5', 'PVT.elevation_mask=0') +
            f'Tracking_1C.early_late_space_chips={spacing / 2}\nTracking_1C.dll_filter_order=1\n')
        log = subprocess.run(['gnss-sdr', '--config_file=gnss-sdr.conf', '--log_dir=.'], cwd=work, text=True,
                             stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=1200).stdout
        (work / 'log.txt').write_text(log)
        recorded = sorted(work.glob('*O'))
        if not recorded:
            failures.append(f'spacing {spacing}: no observations')
            continue
        pairs, clean = errors(folder, gnss_sdr.observations(recorded[0]))
        for n, pair in sorted(pairs.items()):
            theirs, ours = zip(*pair)
            a, b = statistics.pstdev(theirs), statistics.pstdev(ours)
            correlation = math.nan
            if n not in clean and len(pair) > 100:
                correlation = statistics.fmean(
                    (x - statistics.fmean(theirs)) * (y - statistics.fmean(ours)) for x, y in pair) / (a * b)
                if correlation < LEAST_CORRELATION:
                    failures.append(f'spacing {spacing}: {n} correlates by {correlation:.2f}')
            print(f'{spacing:7} {n} {len(pair):6} {statistics.fmean(theirs):20.2f} {a:10.2f} '
                  f'{statistics.fmean(ours):17.2f} {b:10.2f} {correlation:12.3f}', flush=True)
        if len(pairs) < 5:
            failures.append(f'spacing {spacing}: {len(pairs)} satellites')
    return failures


if __name__ == '__main__':
    sys.exit(gnss_sdr.run_judge(argparse.ArgumentParser(), judge))
