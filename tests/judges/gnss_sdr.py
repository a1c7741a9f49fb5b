#!/usr/bin/env python3
"""GNSS-SDR receives samples of `canyon iq` under an open sky, and is compared with what Canyon measures.

usage: tests/judges/gnss_sdr.py CANYON [--signals L1CA,E1] [--seconds 80] [--keep FOLDER]

Every satellite above 15 degrees must be tracked and its ephemeris be decoded; positions must be within METRES of the
truth (median); observations are single differences over the satellites of a signal: codes, phases and C/N0 against
Canyon's without noise. Exit status 77, and SKIPPED, where gnss-sdr is not installed.
"""
import argparse
import datetime
import math
import pathlib
import re
import shutil
import statistics
import subprocess
import sys
import tempfile

# Of each signal: band and rate of its file, what GNSS-SDR calls it, RINEX band, system, its C/N0 against Canyon's:
# E1 is tracked by its pilot alone, half of the power, and by a BOC(1,1) replica, 10/11 of a CBOC's power.
SIGNALS = {
    'L1CA': dict(band='L1', rate=4e6, name='1C', rinex='1', system='G', loss_db=0,
                 acquisition='GPS_L1_CA_PCPS_Acquisition', tracking='GPS_L1_CA_DLL_PLL_Tracking',
                 decoder='GPS_L1_CA_Telemetry_Decoder', more=''),
    'E1': dict(band='L1', rate=4e6, name='1B', rinex='1', system='E', loss_db=3.4,
               acquisition='Galileo_E1_PCPS_Ambiguous_Acquisition', tracking='Galileo_E1_DLL_PLL_VEML_Tracking',
               decoder='Galileo_E1B_Telemetry_Decoder',
               more='Tracking_1B.pll_bw_hz=15\nTracking_1B.dll_bw_hz=0.75\nTracking_1B.early_late_space_chips=0.15\n'
                    'Tracking_1B.very_early_late_space_chips=0.6\nTracking_1B.track_pilot=true\n'
                    'Acquisition_1B.coherent_integration_time_ms=4\nAcquisition_1B.cboc=false\n'),
    'E5a': dict(band='E5a', rate=12.5e6, name='5X', rinex='5', system='E', loss_db=3,
                acquisition='Galileo_E5a_Noncoherent_IQ_Acquisition_CAF', tracking='Galileo_E5a_DLL_PLL_Tracking',
                decoder='Galileo_E5a_Telemetry_Decoder', more=''),
    'E5b': dict(band='E5b', rate=12.5e6, name='7X', rinex='7', system='E', loss_db=3,
                acquisition='Galileo_E5b_PCPS_Acquisition', tracking='Galileo_E5b_DLL_PLL_Tracking',
                decoder='Galileo_E5b_Telemetry_Decoder', more=''),
    'L5': dict(band='L5', rate=12.5e6, name='L5', rinex='5', system='G', loss_db=0,
               acquisition='GPS_L5i_PCPS_Acquisition', tracking='GPS_L5_DLL_PLL_Tracking',
               decoder='GPS_L5_Telemetry_Decoder', more=''),
    'L2C': dict(band='L2', rate=4e6, name='2S', rinex='2', system='G', loss_db=0,
                acquisition='GPS_L2_M_PCPS_Acquisition', tracking='GPS_L2_M_DLL_PLL_Tracking',
                decoder='GPS_L2C_Telemetry_Decoder',
                more='Tracking_2S.pll_bw_hz=3\nTracking_2S.dll_bw_hz=0.4\n'),
    'B1I': dict(band='B1I', rate=5e6, name='B1', rinex='2', system='C', loss_db=0,
                acquisition='BEIDOU_B1I_PCPS_Acquisition', tracking='BEIDOU_B1I_DLL_PLL_Tracking',
                decoder='BEIDOU_B1I_Telemetry_Decoder', more=''),
    'B3I': dict(band='B3I', rate=25e6, name='B3', rinex='6', system='C', loss_db=0,
                acquisition='BEIDOU_B3I_PCPS_Acquisition', tracking='BEIDOU_B3I_DLL_PLL_Tracking',
                decoder='BEIDOU_B3I_Telemetry_Decoder', more=''),
    'G1': dict(band='G1', rate=12.5e6, name='1G', rinex='1', system='R', loss_db=0,
               acquisition='GLONASS_L1_CA_PCPS_Acquisition', tracking='GLONASS_L1_CA_DLL_PLL_Tracking',
               decoder='GLONASS_L1_CA_Telemetry_Decoder', more=''),
}
SYSTEMS = {'G': 'GPS', 'E': 'Galileo', 'C': 'BeiDou', 'R': 'GLONASS'}
METRES = 5.0          # of a position, median
MASK_DEG = 15.0
LATITUDE, LONGITUDE, HEIGHT = 48.1, 11.5, 502.0

SCENARIO = '''\
city: {{open: true, origin: {{latitude_deg: {latitude}, longitude_deg: {longitude}, height_m: {ground}}}}}
sky: {{nominal: true, systems: [{systems}]}}
start: {start}
rate_hz: 2
duration_s: {seconds}
trajectory: {{waypoints: [{{east_m: 0, north_m: 0, up_m: 2}}], hold_s: {hold}}}
receivers:
  - name: antenna
    tracks: [{tracks}]
    own_draws: false
    noise: {{enabled: false}}
    clock: {{bias_s: 0, drift: 0, drift_walk: 0}}
    signal: {{enabled: true, loop_noise: false, cn0_step_db: 0, cn0_sigma_db: 0, antenna: {antenna}}}
outputs: {{pictures: false}}
'''


def configuration(signals, samples, rate):
    text = f'''[GNSS-SDR]
GNSS-SDR.internal_fs_sps={rate:.0f}
SignalSource.implementation=File_Signal_Source
SignalSource.filename={samples}
SignalSource.item_type=ibyte
SignalSource.sampling_frequency={rate:.0f}
SignalSource.samples=0
SignalSource.repeat=false
SignalSource.enable_throttle_control=false
SignalConditioner.implementation=Signal_Conditioner
DataTypeAdapter.implementation=Ibyte_To_Complex
InputFilter.implementation=Pass_Through
InputFilter.item_type=gr_complex
Resampler.implementation=Pass_Through
Resampler.item_type=gr_complex
Channels.in_acquisition=2
Observables.implementation=Hybrid_Observables
PVT.implementation=RTKLIB_PVT
PVT.positioning_mode=Single
PVT.iono_model=OFF
PVT.trop_model=OFF
PVT.elevation_mask=5
PVT.output_rate_ms=500
PVT.display_rate_ms=500
PVT.rinex_version=3
PVT.rinexobs_rate_ms=500
PVT.nmea_output_file_enabled=false
PVT.kml_output_enabled=false
PVT.gpx_output_enabled=false
PVT.geojson_output_enabled=false
PVT.xml_output_enabled=false
'''
    for signal in signals:
        s = SIGNALS[signal]
        n = s['name']
        text += f'''Channels_{n}.count=11
Acquisition_{n}.implementation={s['acquisition']}
Acquisition_{n}.item_type=gr_complex
Acquisition_{n}.doppler_max=5000
Acquisition_{n}.doppler_step=50
Acquisition_{n}.pfa=0.001
Acquisition_{n}.max_dwells=4
Tracking_{n}.implementation={s['tracking']}
Tracking_{n}.item_type=gr_complex
Tracking_{n}.pull_in_time_s=1
TelemetryDecoder_{n}.implementation={s['decoder']}
'''
        text += s['more'] or f'Tracking_{n}.pll_bw_hz=30\nTracking_{n}.dll_bw_hz=1\n'
    return text


def observations(path):
    """Epochs of a RINEX 3 file: {time: {satellite: {code: value}}}."""
    codes, epochs, system, time = {}, {}, '', None
    with open(path) as file:
        for line in file:
            label = line[60:].strip()
            if label == 'SYS / # / OBS TYPES':
                system = line[0] if line[0] != ' ' else system
                codes.setdefault(system, []).extend(line[7:60].split())
            if label == 'END OF HEADER':
                break
        for line in file:
            if line[0] == '>':
                word = line[1:].split()
                time = datetime.datetime(*map(int, word[:5])) + datetime.timedelta(seconds=float(word[5]))
                epochs[time] = {}
                continue
            if line[0] not in codes:
                continue
            values = epochs[time].setdefault(line[:3], {})
            for i, code in enumerate(codes[line[0]]):
                text = line[3 + 16 * i:17 + 16 * i].strip()
                if text:
                    values[code] = float(text)
    return epochs


def value(row, kind, band):
    """Of a kind of observation, whatever the attribute."""
    return next((v for code, v in row.items() if code[:2] == kind + band), None)


def compare(signal, ours, theirs, elevations):
    """Rows of figures, and failures."""
    s = SIGNALS[signal]
    names = sorted({n for epoch in theirs.values() for n in epoch if n[0] == s['system']})
    code, phase, cn0 = {}, {}, {}
    for time in sorted(theirs):
        mine = ours.get(time)
        if mine is None:
            continue
        both = {}
        for n in names:
            if n not in theirs[time] or n not in mine:
                continue
            pair = {k: (value(theirs[time][n], k, s['rinex']), value(mine[n], k, s['rinex'])) for k in 'CLS'}
            if None not in pair['C']:
                both[n] = pair
        if len(both) < 3:
            continue
        mean = statistics.fmean(p['C'][0] - p['C'][1] for p in both.values())
        whole = [p['L'][0] - p['L'][1] for p in both.values() if None not in p['L']]
        for n, p in both.items():
            code.setdefault(n, []).append(p['C'][0] - p['C'][1] - mean)
            if None not in p['S']:
                cn0.setdefault(n, []).append(p['S'][0] - p['S'][1])
            if None not in p['L'] and len(whole) == len(both):
                phase.setdefault(n, []).append((time, p['L'][0] - p['L'][1]))
    failures = []
    for n, elevation in sorted(elevations.items()):
        if n[0] == s['system'] and elevation > MASK_DEG and len(code.get(n, [])) < 5:
            failures.append(f'{signal}: {n} at {elevation:.0f} deg has {len(code.get(n, []))} observations')
    # Phases: each satellite's first difference is its ambiguity; what all have in common is the clock. The last third:
    # loops have pulled in by then.
    drift = {}
    if phase:
        times = set.intersection(*(set(t for t, _ in v) for v in phase.values()))
        times = sorted(times)[-max(1, len(times) // 3):]
        table = {n: {t: x for t, x in v} for n, v in phase.items()}
        if len(times) > 2:
            for n in table:
                table[n] = {t: table[n][t] - table[n][times[0]] for t in times}
            for n in table:
                rest = [table[n][t] - statistics.median(table[m][t] for m in table) for t in times]
                half = [x - round(2 * x) / 2 for x in rest]    # half a cycle: a slip of a Costas loop
                drift[n] = math.sqrt(statistics.fmean(x * x for x in half))
    rows = []
    for n in sorted(code):
        mean, sigma = statistics.fmean(code[n]), statistics.pstdev(code[n])
        level = statistics.fmean(cn0[n]) if n in cn0 else math.nan
        rows.append((signal, n, elevations.get(n, math.nan), len(code[n]), mean, sigma, drift.get(n, math.nan), level))
        # A loop's noise is correlated over about a second: as many independent values as seconds.
        allowed = 4 * max(sigma, 0.3) / math.sqrt(max(1, len(code[n]) / 2)) + 0.3
        if elevations.get(n, 0) > MASK_DEG and abs(mean) > allowed:
            failures.append(f'{signal}: code of {n} off by {mean:.2f} m, more than {allowed:.2f}')
        if elevations.get(n, 0) > MASK_DEG and not abs(level + s['loss_db']) < 1:
            failures.append(f'{signal}: C/N0 of {n} off by {level:.2f} dB, {-s["loss_db"]} expected')
        if n in drift and elevations.get(n, 0) > MASK_DEG and drift[n] > 0.1:
            failures.append(f'{signal}: phase of {n} off by {drift[n]:.3f} cycles')
    return rows, failures


def metres(latitude, longitude, height):
    """East, north, up from the truth; good to a millimetre near it."""
    a, e2 = 6378137.0, 6.69437999014e-3
    sine = math.sin(math.radians(LATITUDE))
    n = a / math.sqrt(1 - e2 * sine * sine)
    m = n * (1 - e2) / (1 - e2 * sine * sine)
    return (math.radians(longitude - LONGITUDE) * (n + HEIGHT) * math.cos(math.radians(LATITUDE)),
            math.radians(latitude - LATITUDE) * (m + HEIGHT), height - HEIGHT)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('canyon')
    parser.add_argument('--signals', default='L1CA,E1')
    parser.add_argument('--seconds', type=float, default=80)
    parser.add_argument('--start', default='2026-06-01T08:00:00Z')
    parser.add_argument('--threads', default='0')
    parser.add_argument('--keep')
    options = parser.parse_args()
    if shutil.which('gnss-sdr') is None:
        print('SKIPPED: gnss-sdr is not installed (Debian: gnss-sdr)')
        return 77
    signals = options.signals.split(',')
    bands = {(SIGNALS[s]['band'], SIGNALS[s]['rate']) for s in signals}
    if len(bands) != 1:
        sys.exit('these signals are not in one band')
    band, rate = bands.pop()
    folder = pathlib.Path(options.keep or tempfile.mkdtemp(prefix='canyon-gnss-sdr-')).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    try:
        return judge(options, signals, band, rate, folder)
    finally:
        if not options.keep:
            shutil.rmtree(folder, ignore_errors=True)


def judge(options, signals, band, rate, folder):
    canyon = str(pathlib.Path(options.canyon).resolve())
    upper = band in ('L1', 'B1I', 'G1')
    (folder / 'open.yaml').write_text(SCENARIO.format(
        latitude=LATITUDE, longitude=LONGITUDE, ground=HEIGHT - 2, seconds=options.seconds, hold=options.seconds + 1,
        systems=', '.join(sorted({SYSTEMS[SIGNALS[s]['system']] for s in signals})), start=options.start,
        tracks=', '.join(signals), antenna='patch' if upper else 'dual_patch'))

    def run(*words, **more):
        return subprocess.run(words, cwd=folder, check=True, text=True, **more)
    run(canyon, 'iq', 'open.yaml', '--out', 'open.iq', '--band', band, '--rate', f'{rate:.0f}', '--threads',
        options.threads)
    run(canyon, 'simulate', 'open.yaml', '--out', 'ours', '--quiet', stdout=subprocess.DEVNULL)
    (folder / 'gnss-sdr.conf').write_text(configuration(signals, folder / 'open.iq', rate))
    (folder / 'theirs').mkdir(exist_ok=True)
    for old in (folder / 'theirs').iterdir():
        old.unlink()
    log = subprocess.run(['gnss-sdr', f'--config_file={folder}/gnss-sdr.conf', f'--log_dir={folder}/theirs'],
                         cwd=folder / 'theirs', text=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                         timeout=1200).stdout
    (folder / 'log.txt').write_text(log)

    elevations = {}
    with open(folder / 'ours/satellites.csv') as file:
        columns = file.readline().strip().split(',')
        for line in file:
            row = dict(zip(columns, line.split(',')))
            elevations[row['sat']] = float(row['elevation_deg'])
    failures, rows = [], []
    recorded = sorted((folder / 'theirs').glob('*O'))
    if not recorded:
        print(log[-3000:])
        print('FAILED: GNSS-SDR wrote no observations')
        return 1
    theirs = observations(recorded[0])
    ours = observations(folder / 'ours/receiver.obs')
    for signal in signals:
        more, wrong = compare(signal, ours, theirs, elevations)
        rows += more
        failures += wrong
    print('signal sat  elevation  epochs  code [m]  deviation [m]  phase [cycles]  C/N0 [dB]')
    for signal, n, elevation, count, mean, sigma, drift, level in rows:
        print(f'{signal:6} {n} {elevation:9.1f} {count:8} {mean:9.2f} {sigma:13.2f} {drift:15.4f} {level:10.2f}')
    fixes = [metres(*map(float, found)) for found in
             re.findall(r'Lat = ([-\d.]+) \[deg\], Long = ([-\d.]+) \[deg\], Height = ([-\d.]+)', log)]
    if fixes:
        middle = [statistics.median(axis) for axis in zip(*fixes)]
        error = [statistics.median(math.hypot(*f[:2]) for f in fixes), statistics.median(abs(f[2]) for f in fixes)]
        print(f'{len(fixes)} positions: median east {middle[0]:.2f}, north {middle[1]:.2f}, up {middle[2]:.2f} m; '
              f'horizontal error {error[0]:.2f}, vertical {error[1]:.2f} m')
        if max(map(abs, middle)) > METRES:
            failures.append('the position is off')
    else:
        failures.append('no position')
    for failure in failures:
        print(f'FAILED: {failure}')
    return 1 if failures else 0


if __name__ == '__main__':
    sys.exit(main())
