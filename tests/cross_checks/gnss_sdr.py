#!/usr/bin/env python3
"""GNSS-SDR receives samples of `canyon iq` under an open sky, and is compared with Canyon's measurements.

usage: tests/cross_checks/gnss_sdr.py CANYON [--signals L1CA,E1] [--seconds 110] [--keep FOLDER]

All satellites above 15 degrees but one must be tracked and their ephemerides be decoded; positions must be within
METRES of the truth (median); observations are single differences over the satellites of a signal: codes, phases and
C/N0 against Canyon's without noise. Exit status 77, and SKIPPED, if gnss-sdr is not installed.
"""
import argparse
import csv
import datetime
import math
import pathlib
import re
import shutil
import statistics
import struct
import subprocess
import sys
import tempfile
import typing

# For each signal: band and rate of its file, its name in GNSS-SDR, RINEX band, system, its C/N0 against Canyon's:
# E1 is tracked by its pilot only, half of the power, and by a BOC(1,1) replica, 10/11 of a CBOC's power; L2C by the code
# CM, which is half of it, while the replica is also in CL's time. It has the codes of the first 33 satellites of B1I.
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
    'L2C': dict(band='L2', rate=4e6, name='2S', rinex='2', system='G', loss_db=3,
                acquisition='GPS_L2_M_PCPS_Acquisition', tracking='GPS_L2_M_DLL_PLL_Tracking',
                decoder='GPS_L2C_Telemetry_Decoder',
                more='Tracking_2S.pll_bw_hz=3\nTracking_2S.dll_bw_hz=0.4\nTracking_2S.dump=true\n'
                     'Tracking_2S.dump_mat=false\nTracking_2S.dump_filename=./channel\n'),
    'B1I': dict(band='B1I', rate=5e6, name='B1', rinex='2', theirs='1', last=33, system='C', loss_db=0,
                acquisition='BEIDOU_B1I_PCPS_Acquisition', tracking='BEIDOU_B1I_DLL_PLL_Tracking',
                decoder='BEIDOU_B1I_Telemetry_Decoder', more=''),
    'B3I': dict(band='B3I', rate=25e6, name='B3', rinex='6', system='C', loss_db=0,
                acquisition='BEIDOU_B3I_PCPS_Acquisition', tracking='BEIDOU_B3I_DLL_PLL_Tracking',
                decoder='BEIDOU_B3I_Telemetry_Decoder', more=''),
    'G1': dict(band='G1', rate=12.5e6, name='1G', rinex='1', system='R', loss_db=0,
               acquisition='GLONASS_L1_CA_PCPS_Acquisition', tracking='GLONASS_L1_CA_DLL_PLL_Tracking',
               decoder='GLONASS_L1_CA_Telemetry_Decoder', more='Tracking_1G.pll_bw_hz=10\nTracking_1G.dll_bw_hz=1\n'),
}
SYSTEMS = {'G': 'GPS', 'E': 'Galileo', 'C': 'BeiDou', 'R': 'GLONASS'}
METRES = 5.0          # of a position, median
MASK_DEG = 15.0
LIGHT = 299792458.0
# GPS time minus that of a RINEX file: UTC for GLONASS. GNSS-SDR also writes GPS time under the label BDT.
LATER_S = {'GLO': 18}
LARGEST_M = 900.0     # of a code on a signal, not on noise
PULL_IN_S = 1.0       # of GNSS-SDR's loops after an acquisition
LATITUDE, LONGITUDE, HEIGHT = 48.1, 11.5, 502.0

SCENARIO = '''\
city: {{open: true, origin: {{latitude_deg: {latitude}, longitude_deg: {longitude}, height_m: {ground}}}}}
sky: {{nominal: true, systems: [{systems}], errors: {{enabled: false}}}}
start: {start}
rate_hz: 2
duration_s: {seconds}
trajectory: {{waypoints: [{{east_m: 0, north_m: 0, up_m: 2}}], hold_s: {hold}}}
receivers:
  - name: antenna
    tracks: [{tracks}]
    independent_noise: false
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
    """Epochs of a RINEX 3 file: {time: {satellite: {code: value}}}, by GPS time."""
    codes, epochs, system, time, later_s = {}, {}, '', None, 0
    with open(path) as file:
        for line in file:
            label = line[60:].strip()
            if label == 'SYS / # / OBS TYPES':
                system = line[0] if line[0] != ' ' else system
                codes.setdefault(system, []).extend(line[7:60].split())
            if label == 'TIME OF FIRST OBS':
                later_s = LATER_S.get(line[48:51], 0)
            if label == 'END OF HEADER':
                break
        for line in file:
            if line[0] == '>':
                word = line[1:].split()
                time = datetime.datetime(*map(int, word[:5])) + datetime.timedelta(seconds=float(word[5]) + later_s)
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
    """The value of a kind of observation, for any attribute."""
    return next((v for code, v in row.items() if code[:2] == kind + band), None)


def compare(signal, ours, theirs, elevations):
    """Rows of metrics, and failures."""
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
            pair = {k: (value(theirs[time][n], k, s.get('theirs', s['rinex'])), value(mine[n], k, s['rinex'])) for k in 'CLSD'}
            if None not in pair['C']:
                both[n] = pair
        if len(both) < 3:
            continue
        mean = statistics.fmean(p['C'][0] - p['C'][1] for p in both.values())
        # By its clock; GNSS-SDR does not set it with GLONASS only.
        early_s = mean / LIGHT
        for p in both.values():
            cycles = -p['D'][1] * early_s    # phase change in this time
            wavelength = abs(p['C'][1] / p['L'][1])
            p['C'] = (p['C'][0] + cycles * wavelength, p['C'][1])
            if None not in p['L']:
                p['L'] = (p['L'][0] + cycles, p['L'][1])
        mean = statistics.fmean(p['C'][0] - p['C'][1] for p in both.values())
        whole = [p['L'][0] - p['L'][1] for p in both.values() if None not in p['L']]
        for n, p in both.items():
            code.setdefault(n, []).append(p['C'][0] - p['C'][1] - mean)
            if None not in p['S']:
                cn0.setdefault(n, []).append(p['S'][0] - p['S'][1])
            if None not in p['L'] and len(whole) == len(both):
                phase.setdefault(n, []).append((time, p['L'][0] - p['L'][1]))
    # GNSS-SDR may lock on noise or on a side peak of E1 at first, and then has no ephemeris in time: one is omitted.
    failures = []
    missing = [f'{signal}: {n} at {elevation:.0f} deg has {len(code.get(n, []))} observations'
               for n, elevation in sorted(elevations.items())
               if n[0] == s['system'] and int(n[1:]) <= s.get('last', 99) and elevation > MASK_DEG and len(code.get(n, [])) < 5]
    if len(missing) > 1:
        failures += missing
    elif missing:
        print(f'left out: {missing[0]}')
    # Phases: each satellite's first difference is its ambiguity; the common part is the clock. The last third,
    # also for C/N0: loops have pulled in by then.
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
        level = statistics.fmean(cn0[n][len(cn0[n]) * 2 // 3:]) if n in cn0 else math.nan
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


def with_channels(text, signals, satellites):
    """configuration() of these signals with a channel for each satellite, so that none waits for the search of others."""
    lines, number = [], 0
    for s in (s for signal, s in SIGNALS.items() if signal in signals):    # in GNSS-SDR's order, numbered consecutively
        of = [n for n in satellites if n[0] == s['system']]
        text = text.replace(f"Channels_{s['name']}.count=11", f"Channels_{s['name']}.count={len(of)}")
        for n in of:
            lines.append(f"Channel{number}.signal={s['name']}\nChannel{number}.satellite={int(n[1:])}\n")
            number += 1
    return text + ''.join(lines)


# A record of GNSS-SDR's dump of a channel: magnitude of the prompt correlator, start of a code period [samples, and the
# fraction after it], C/N0, satellite.
RECORD = struct.Struct('<8xf16xQ36xf4xf8xI')


def receive_channels(folder, samples, satellites, spacing_chips, item='ibyte', rate=4e6):
    """GNSS-SDR with one channel for each GPS satellite, L1 C/A, in `folder`: {satellite: [(s, T, power, C/N0)]}.

    Loops as in a Canyon receiver with integration_s 0.02: 1 Hz, first order, early-late power; a phase loop of 10 Hz.
    A code period begins at s seconds since the first sample; T [s] is the integration, 1 ms before the channel has found
    the edges of the bits; power of the sum of all its samples; C/N0 [dB-Hz] reported by GNSS-SDR.
    """
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    text = with_channels(configuration(['L1CA'], samples, rate), ['L1CA'], satellites)
    for old, new in (('item_type=ibyte', f'item_type={item}'), ('Ibyte', item.capitalize()), ('max_dwells=4', 'max_dwells=2'),
                     ('in_acquisition=2', f'in_acquisition={len(satellites)}'), ('doppler_step=50', 'doppler_step=150'), ('pfa=0.001', 'pfa=1e-6')):
        assert old in text
        text = text.replace(old, new)
    text += f'''Acquisition_1C.blocking=false
Acquisition_1C.coherent_integration_time_ms=5
Tracking_1C.dll_filter_order=1
Tracking_1C.early_late_space_chips={spacing_chips / 2}
Tracking_1C.extend_correlation_symbols=20
Tracking_1C.early_late_space_narrow_chips={spacing_chips / 2}
Tracking_1C.dll_bw_narrow_hz=1
Tracking_1C.pll_bw_narrow_hz=10
Tracking_1C.cn0_smoother_alpha=0.05
Tracking_1C.cn0_smoother_samples=20
Tracking_1C.dump=true
Tracking_1C.dump_mat=false
Tracking_1C.dump_filename=./channel
PVT.rinex_output_enabled=false
'''
    (folder / 'gnss-sdr.conf').write_text(text)
    with open(folder / 'log.txt', 'w') as log:
        subprocess.run(['gnss-sdr', '--config_file=gnss-sdr.conf', '--log_dir=.', '--minloglevel=2'], cwd=folder, stdout=log,
                       stderr=subprocess.STDOUT, timeout=1800)
    return read_channels(folder, rate)


def read_channels(folder, rate=4e6):
    channels = {}
    for dump in folder.glob('channel*.dat'):
        before, since = -1.0, 0.0
        data = dump.read_bytes()
        for prompt, start, cn0, part, number in RECORD.iter_unpack(data[:len(data) // RECORD.size * RECORD.size]):
            time = (start + part) / rate
            integration = 0.001 if time - before < 0.005 else 0.02
            if time - before > 0.03:
                since = time
            if time - since > PULL_IN_S:
                channels.setdefault(f'G{number:02}', []).append((time, integration, prompt * prompt, cn0))
            before = time
    return channels


def ranges(table):
    """True pseudoranges of satellites.csv: {satellite: {tenths of a second since the first epoch: (metres, metres/s)}}."""
    found, first = {}, None
    with open(table) as file:
        for row in csv.DictReader(file):
            tenths = round(float(row['gps_tow']) * 10)
            first = tenths if first is None else first
            if row['pseudorange_m']:
                metres = float(row['pseudorange_m']) - float(row['pseudorange_error_m'])
                rate = -float(row['doppler_hz']) * LIGHT / float(row['carrier_frequency_hz'])
                found.setdefault(row['sat'], {})[tenths - first] = (metres, rate)
    return found


class Sight(typing.NamedTuple):
    """A receiver's values for a satellite at an instant."""
    error_m: float         # of the code; nan: not measured
    cn0_dbhz: float        # at the correlator
    stated_dbhz: float     # as reported by the receiver
    measured: bool


def sights(channel, truth, noise_power=0.0):
    """{tenths of a second: Sight} of a channel of receive_channels, measured if it has the bits' edges.

    With the noise's power of a sample C/N0 is the prompt correlator's power over the noise's within 50 ms, and a signal with
    25 dB-Hz and a code within LARGEST_M is measured, with or without the bits' edges.
    """
    near = {}
    for record in channel:
        near.setdefault(round(record[0] * 10), []).append(record)
    found = {}
    for tenths, records in near.items():
        if tenths not in truth or len({r[1] for r in records}) != 1:
            continue
        time, integration, _, stated = min(records, key=lambda r: abs(r[0] - tenths / 10))
        metres, rate = truth[tenths]
        # The period was sent at a whole millisecond.
        error = math.remainder(time - (metres + rate * (time - tenths / 10)) / LIGHT, 1e-3) * LIGHT
        cn0, measured = stated, integration > 0.01
        if noise_power > 0:
            unit = noise_power * integration * 4e6
            over = (statistics.fmean(r[2] for r in records) / unit - 1) / integration
            cn0 = 10 * math.log10(max(over, 1))
            measured = len(records) * integration > 0.05 and cn0 > 25 and abs(error) < LARGEST_M
        found[tenths] = Sight(error, cn0, stated, measured)
    return found


def of_channels(folder, ours, rate, band):
    """As observations(), of the codes and C/N0 in the dumps of channels; the whole millisecond is from Canyon's."""
    begin, truth = min(ours), {}
    for time, epoch in ours.items():
        for n, row in epoch.items():
            code, doppler = value(row, 'C', band), value(row, 'D', band)
            if code is not None and doppler is not None:
                carrier_hz = {'2': 1227.6e6}[band]
                truth.setdefault(n, {})[round((time - begin).total_seconds() * 10)] = (code, -doppler * LIGHT / carrier_hz)
    epochs = {}
    for n, channel in read_channels(folder, rate).items():
        for tenths, sight in sights(channel, truth.get(n, {})).items():
            if abs(sight.error_m) < LARGEST_M:
                epochs.setdefault(begin + datetime.timedelta(seconds=tenths / 10), {})[n] = {
                    f'C{band}': truth[n][tenths][0] + sight.error_m, f'S{band}': sight.stated_dbhz}
    return epochs


def sights_of(table, truth):
    """Canyon's: {satellite: {tenths of a second: Sight}}."""
    found, first = {n: {} for n in truth}, None
    with open(table) as file:
        for row in csv.DictReader(file):
            tenths = round(float(row['gps_tow']) * 10)
            first = tenths if first is None else first
            if row['sat'] in truth and row['true_cn0_dbhz']:
                error = float(row['pseudorange_m']) - truth[row['sat']][tenths - first][0] if row['pseudorange_m'] else math.nan
                found[row['sat']][tenths - first] = Sight(error, float(row['true_cn0_dbhz']), float(row['cn0_dbhz'] or 'nan'),
                                                           bool(row['pseudorange_m']))
    return found


def metres(latitude, longitude, height):
    """East, north, up from the truth; accurate to a millimetre near it."""
    a, e2 = 6378137.0, 6.69437999014e-3
    sine = math.sin(math.radians(LATITUDE))
    n = a / math.sqrt(1 - e2 * sine * sine)
    m = n * (1 - e2) / (1 - e2 * sine * sine)
    return (math.radians(longitude - LONGITUDE) * (n + HEIGHT) * math.cos(math.radians(LATITUDE)),
            math.radians(latitude - LATITUDE) * (m + HEIGHT), height - HEIGHT)


def run_judge(parser, judge):
    """Exit status of judge(options, canyon, folder), which returns failures; adds CANYON and --keep to `parser`."""
    parser.add_argument('canyon')
    parser.add_argument('--keep')
    options = parser.parse_args()
    if shutil.which('gnss-sdr') is None:
        print('SKIPPED: gnss-sdr is not installed (Debian: gnss-sdr)')
        return 77
    folder = pathlib.Path(options.keep or tempfile.mkdtemp(prefix='canyon-gnss-sdr-')).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    try:
        failures = judge(options, str(pathlib.Path(options.canyon).resolve()), folder)
    finally:
        if not options.keep:
            shutil.rmtree(folder, ignore_errors=True)
    for failure in failures:
        print(f'FAILED: {failure}')
    return 1 if failures else 0


def judge(options, canyon, folder):
    signals = options.signals.split(',')
    bands = {(SIGNALS[s]['band'], SIGNALS[s]['rate']) for s in signals}
    if len(bands) != 1:
        sys.exit('these signals are not in one band')
    band, rate = bands.pop()
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
    ours = observations(folder / 'ours/receiver.obs')
    (folder / 'gnss-sdr.conf').write_text(with_channels(configuration(signals, folder / 'open.iq', rate), signals,
                                                        sorted({n for epoch in ours.values() for n in epoch})))
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
    theirs = observations(recorded[0]) if recorded else {}
    if signals == ['L2C']:    # GNSS-SDR writes no RINEX for it
        theirs = of_channels(folder / 'theirs', ours, rate, SIGNALS['L2C']['rinex'])
    if not theirs:
        print(log[-3000:])
        return ['GNSS-SDR wrote no observations']
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
        if max(map(abs, middle)) > max(METRES, 4 * max(error) / math.sqrt(max(1, len(fixes) / 2))):
            failures.append('the position is off')
    else:
        failures.append('no position')
    return failures


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('--signals', default='L1CA,E1')
    parser.add_argument('--seconds', type=float, default=110)
    parser.add_argument('--start', default='2026-06-01T08:00:00Z')
    parser.add_argument('--threads', default='0')
    return run_judge(parser, judge)


if __name__ == '__main__':
    sys.exit(main())
