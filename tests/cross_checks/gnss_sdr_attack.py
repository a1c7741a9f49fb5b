#!/usr/bin/env python3
"""GNSS-SDR on samples with jammers and spoofers of `canyon iq`, compared with Canyon's receiver in the same scenario.

usage: tests/cross_checks/gnss_sdr_attack.py CANYON [--only noise,chirp] [--keep FOLDER]

Under an open sky the power of a jammer rises in steps: C/N0 and lock of each satellite at each step. A spoofer that
begins in alignment with the true signals pulls off codes and clock: both receivers follow, or neither. Exit status 77, and
SKIPPED, if gnss-sdr is not installed.
"""
import argparse
import statistics
import subprocess
import sys

import gnss_sdr

SCENARIO = '''\
city: {{open: true, origin: {{latitude_deg: 48.1, longitude_deg: 11.5, height_m: 500}}}}
sky: {{nominal: true, systems: [GPS], errors: {{enabled: false}}}}
start: 2026-06-01T08:00:00Z
rate_hz: 10
duration_s: {seconds}
trajectory: {{waypoints: [{{east_m: 0, north_m: 0, up_m: 2}}], hold_s: 1000}}
receivers:
  - name: antenna
    independent_noise: false
    noise: {{enabled: false}}
    clock: {{bias_s: 0, drift: 0, drift_walk: 0}}
    signal:
      enabled: true
      antenna: {antenna}
      loop_noise: false
      cn0_step_db: 0
      cn0_sigma_db: 0
      front_end_bandwidth_hz: none
      lock: {{acquisition_threshold_dbhz: 35, tracking_threshold_dbhz: {threshold}}}
      dll: {{spacing_chips: 0.5, discriminator: early_late_power, loop_bandwidth_hz: 1, integration_s: 0.02}}
outputs: {{pictures: false}}
{faults}'''
THRESHOLD_DBHZ = 25     # GNSS-SDR's own, for 50 values in a row
FIRST_S, STEP_S, STEPS, STEP_DB = 14, 6, 7, 4
# For each jammer: its waveform, its power at the first step [dBm], 100 m away.
JAMMERS = {
    'noise': ('shape: noise, centre_hz: 1575420000, width_hz: 20e6', -20),
    'noise of 1 MHz': ('shape: noise, centre_hz: 1575420000, width_hz: 1e6', -30),
    'chirp': ('shape: chirp, centre_hz: 1575420000, width_hz: 20e6, period_s: 1e-5', -20),
    'tone': ('shape: tone, centre_hz: 1575520000', -32),
}
JAMMER = ('{{name: step {i}, from_s: {begin}, duration_s: {step}, jamming: {{position: {{east_m: 100, north_m: 0, up_m: 2}}, '
          'polarisation: right, emissions: [{{{sends}, power_dbm: {power}}}]}}}}')
# For each spoofer: advantage [dB], carrier, and the speed of the pull-off of its clock [m/s], within 4 s or at once.
SPOOFERS = {
    'spoofer 10 dB': (10, 'follows_code', 4),
    'spoofer 3 dB': (3, 'follows_code', 4),
    'spoofer -6 dB': (-6, 'follows_code', 4),
    'spoofer 10 dB at once at 20 m/s': (10, 'follows_code', 20),
    'spoofer 10 dB with the carrier held': (10, 'held', 4),
}
SPOOFER = ('{{name: spoofer, from_s: 14, spoofing: {{position: {{east_m: 100, north_m: 0, up_m: 20}}, advantage_db: {advantage}, '
           'carrier: {carrier}, pull_off: {{hold_s: 6, rate_mps: {rate}, acceleration_mps2: {acceleration}, clock_m: 2000}}}}}}')
DRAWN_OFF_M = 400       # more than a chip, so that both signals are separate
CN0_DB = {'tone': 3.0}    # of a step, mean over the satellites; a tone coincides with spectral lines of codes; Canyon's code spectra are smooth
USUAL_CN0_DB = 1.0


def run(canyon, folder, name, faults, seconds, antenna):
    """Samples, both receivers: ours of satellites.csv by satellite and tenths of a second, theirs in the same form."""
    work = folder / name.replace(' ', '_').replace('/', '')
    work.mkdir(exist_ok=True)
    for file, attack in (('attack', faults), ('clear', '')):
        (work / f'{file}.yaml').write_text(SCENARIO.format(seconds=seconds, threshold=THRESHOLD_DBHZ, antenna=antenna, faults=attack and f'faults: [{attack}]\n'))
        subprocess.run([canyon, 'simulate', f'{file}.yaml', '--out', file, '--quiet'], cwd=work, check=True)
    # Headroom for jammers: 20 times the noise.
    subprocess.run([canyon, 'iq', 'attack.yaml', '--out', 'attack.iq', '--quiet', '--format', 'int16', '--noise-level', '0.01'],
                   cwd=work, check=True)
    truth = gnss_sdr.ranges(work / 'clear/satellites.csv')
    satellites = sorted(truth)
    channels = gnss_sdr.receive_channels(work / 'theirs', work / 'attack.iq', satellites, 0.5, 'ishort')
    (work / 'attack.iq').unlink()
    theirs = {n: gnss_sdr.sights(channels.get(n, []), truth[n]) for n in satellites}
    ours = gnss_sdr.sights_of(work / 'attack/satellites.csv', truth)
    return ours, theirs


def jam(name, ours, theirs):
    failures = []
    print(f'{name}: power [dBm]  C/N0 by Canyon [dB-Hz]  GNSS-SDR less that: mean, deviation  locks: Canyon, GNSS-SDR, both')
    satellites = [n for n in ours if len(theirs[n]) > 50]

    def has(n, k):
        return k in theirs[n] and theirs[n][k].measured
    clear = {n: statistics.fmean(theirs[n][k].stated_dbhz - ours[n][k].cn0_dbhz for k in range(100, 140) if has(n, k)) for n in satellites
             if any(has(n, k) for k in range(100, 140))}
    agree, of = 0, 0
    for i in range(STEPS):
        last = range((FIRST_S + (i + 1) * STEP_S) * 10 - 20, (FIRST_S + (i + 1) * STEP_S) * 10 - 1)
        mine = {n: statistics.fmean(ours[n][k].cn0_dbhz for k in last) for n in clear}
        difference = {n: statistics.fmean(theirs[n][k].stated_dbhz for k in last if has(n, k)) - mine[n] - clear[n] for n in clear
                      if sum(has(n, k) for k in last) > 9 and mine[n] > THRESHOLD_DBHZ}
        locked = {n for n in clear if ours[n][last[-1]].measured}
        theirs_locked = {n for n in clear if has(n, last[-1])}
        # Near the threshold both results are accepted.
        clearly = {n for n in clear if abs(mine[n] - THRESHOLD_DBHZ) > 3}
        agree += len(clearly) - len((locked ^ theirs_locked) & clearly)
        of += len(clearly)
        mean = statistics.fmean(difference.values()) if difference else 0.0
        print(f'{JAMMERS[name][1] + STEP_DB * i:6} {min(mine.values()):6.1f} to {max(mine.values()):.1f} {mean:8.2f} '
              f'{statistics.pstdev(difference.values()) if difference else 0:6.2f} {len(locked):5} {len(theirs_locked):3} '
              f'{len(locked & theirs_locked):3}', flush=True)
        if abs(mean) > CN0_DB.get(name, USUAL_CN0_DB):
            failures.append(f'{name}: C/N0 at step {i} off by {mean:.2f} dB')
    print(f'lock alike where C/N0 is more than 3 dB from {THRESHOLD_DBHZ} dB-Hz: {agree} of {of}')
    if agree < 0.9 * of:
        failures.append(f'{name}: lock alike {agree} of {of} times')
    return failures


def spoof(name, ours, theirs, shown_m):
    """The receivers that follow, by the last half second."""
    followed = {}
    for who, errors in (('Canyon', ours), ('GNSS-SDR', theirs)):
        end = {n: [sight.error_m for _, sight in sorted(errors[n].items()) if sight.measured][-5:] for n in errors}
        end = {n: statistics.median(v) for n, v in end.items() if v}
        followed[who] = {n: abs(error - shown_m) < abs(error) for n, error in end.items()}
        print(f"{name}: {who} {sum(followed[who].values())} of {len(end)} follow; code errors "
              + ' '.join(f'{n} {error:.0f}' for n, error in sorted(end.items())), flush=True)
    both = followed['Canyon'].keys() & followed['GNSS-SDR'].keys()
    alike = sum(followed['Canyon'][n] == followed['GNSS-SDR'][n] for n in both)
    return [] if alike >= 0.9 * len(both) and len(both) >= 5 else [f'{name}: {alike} of {len(both)} alike']


def judge(options, canyon, folder):
    failures = []
    for name in options.only.split(','):
        if name in JAMMERS:
            sends, power = JAMMERS[name]
            faults = ', '.join(JAMMER.format(i=i, begin=FIRST_S + STEP_S * i, step=STEP_S, sends=sends, power=power + STEP_DB * i)
                               for i in range(STEPS))
            failures += jam(name, *run(canyon, folder, name, faults, FIRST_S + STEP_S * STEPS, 'patch'))
        else:
            advantage, carrier, rate = SPOOFERS[name]
            faults = SPOOFER.format(advantage=advantage, carrier=carrier, rate=rate, acceleration=0 if 'at once' in name else 1)
            seconds = 20 + DRAWN_OFF_M // rate
            failures += spoof(name, *run(canyon, folder, name, faults, seconds, 'isotropic'), (seconds - 20) * rate)
    return failures


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('--only', default=','.join([*JAMMERS, *SPOOFERS]))
    return gnss_sdr.run_judge(parser, judge)


if __name__ == '__main__':
    sys.exit(main())
