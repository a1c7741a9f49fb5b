#!/usr/bin/env python3
"""examples/ros_gnss_comm.py and examples/ros1_bag.py, between a run of canyon simulate and mocks of ROS's messages.

usage: tests/ros_examples_test.py CANYON [unittest's options]

Converted values are compared with the RINEX file of the same run, read here, and by orbits computed here from the converted
ephemerides (IS-GPS-200, 20.3.3.4.3). The bag needs Debian's rosbag.
"""
import json
import math
import pathlib
import subprocess
import sys
import tempfile
import types
import unittest

ROOT = pathlib.Path(__file__).resolve().parents[1]
EXAMPLES = ROOT / "examples"
sys.dont_write_bytecode = True
sys.path.insert(0, str(EXAMPLES))
import ros1_bag as bag  # noqa: E402
import ros_gnss_comm as gnss  # noqa: E402

SCENARIO = """
city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17, height_m: 0}}
sky: {%s}
start: 2026-06-01T06:15:00Z      # near the time of an ephemeris of GLONASS
rate_hz: 2
trajectory:
  waypoints: [{east_m: 0, north_m: 0, up_m: 1.5, hold_s: 5}, {east_m: 60, north_m: 20, up_m: 1.5}]
  speed_mps: 10
  acceleration_mps2: 2
sensors:
  imu: {profile: tactical, rate_hz: 100, axes: frd}
  magnetometer: {axes: frd}
  barometer: {}
receivers: [{name: car, profile: ublox-f9p}]
outputs: {ubx: true}
"""
LIGHT, EARTH_RATE, MU = 299792458.0, 7.2921151467e-5, 3.986005e14
LEAP_S, WEEK, BEGIN = 18, 2421, 108918.0
FIRST = {"G": 0, "R": 32, "E": 59, "C": 97}  # numbers of gnss_comm minus those of RINEX


class Message(types.SimpleNamespace):
    """A message of ROS 1 with the fields of a .msg file, plain and nested."""

    def __init__(self, **fields):
        super().__init__(**{name: make() for name, make in fields.items()})


def clock():
    return Message(week=int, tow=float)


def messages(capitals=True):
    """Makers of the messages that the tests use; fields of ROS 2 have no capitals."""
    def maker(names, **nested):
        cased = (name if capitals else name.lower() for name in names.split())
        fields = dict.fromkeys(cased, lambda: None)
        return lambda: Message(**fields, **nested)
    return types.SimpleNamespace(
        GnssRawObservations=lambda: Message(observations=list, header=lambda: Message(stamp=float, frame_id=str)),
        GnssRawObservation=lambda: Message(loss_of_lock=bool, frequency_channel=int),
        GnssObsMsg=maker("sat freqs CN0 LLI code psr psr_std cp cp_std dopp dopp_std status", time=clock),
        GnssMeasMsg=maker("meas"),
        GnssEphemMsg=maker("sat toe_tow week iode iodc health code ura A e i0 omg OMG0 M0 delta_n OMG_dot i_dot cuc cus crc crs "
                           "cic cis af0 af1 af2 tgd0 tgd1", ttr=clock, toe=clock, toc=clock),
        GnssGloEphemMsg=maker("sat freqo health age tau_n gamma pos_x pos_y pos_z vel_x vel_y vel_z acc_x acc_y acc_z",
                              ttr=clock, toe=clock))


def simulate(canyon, sky, out):
    (out.parent / "drive.yaml").write_text(SCENARIO % sky)
    subprocess.run([canyon, "simulate", str(out.parent / "drive.yaml"), "--out", str(out)], check=True, capture_output=True)


def with_clocks(text):
    """The navigation file `text` with individual clocks for all satellites, up to 50 us; nominal ones are exact."""
    lines = text.splitlines()
    start = next(k for k, line in enumerate(lines) if "END OF HEADER" in line) + 1
    for k in range(start, len(lines)):
        if lines[k][:1].isalpha():
            offset = (int(lines[k][1:3]) * 7 % 11 - 5) * 1e-5
            lines[k] = lines[k][:23] + "%19.12E" % offset + lines[k][42:]
    return "\n".join(lines) + "\n"


def rinex(path):
    """Observations by (second of the week, satellite, band): pseudorange, phase, Doppler, C/N0."""
    kinds, found, body = {}, {}, False
    for line in path.read_text().splitlines():
        if "SYS / # / OBS TYPES" in line:
            kinds[line[0]] = line[7:60].split()
        elif "END OF HEADER" in line:
            body = True
        elif body and line[0] == ">":
            day, hour, minute, second = line.split()[3:7]
            tow = 86400 + int(hour) * 3600 + int(minute) * 60 + float(second)  # 1 June 2026 is a Monday
        elif body:
            for k, kind in enumerate(kinds[line[0]]):
                cell = line[3 + 16 * k:17 + 16 * k].strip()
                if cell:
                    found.setdefault((round(tow, 1), line[:3], kind[1]), {})[kind[0]] = float(cell)
    return found


def seconds(time):
    return time.week * 604800 + time.tow


def kepler(m, at):
    """ECEF [m] and clock [s] of a GnssEphemMsg at GPS second `at`."""
    t = at - seconds(m.toe)
    mean = m.M0 + (math.sqrt(MU / m.A ** 3) + m.delta_n) * t
    e = mean
    for _ in range(20):
        e = mean + m.e * math.sin(e)
    true = math.atan2(math.sqrt(1 - m.e ** 2) * math.sin(e), math.cos(e) - m.e)
    u = true + m.omg
    s, c = math.sin(2 * u), math.cos(2 * u)
    u, r = u + m.cus * s + m.cuc * c, m.A * (1 - m.e * math.cos(e)) + m.crs * s + m.crc * c
    i = m.i0 + m.i_dot * t + m.cis * s + m.cic * c
    own = 14 if 97 < m.sat <= 160 else 0  # BeiDou's week begins 14 s later
    node = m.OMG0 + (m.OMG_dot - EARTH_RATE) * t - EARTH_RATE * ((seconds(m.toe) - own) % 604800)
    x, y = r * math.cos(u), r * math.sin(u)
    return (x * math.cos(node) - y * math.cos(i) * math.sin(node), x * math.sin(node) + y * math.cos(i) * math.cos(node),
            y * math.sin(i)), m.af0


def near_toe(m, at):
    """ECEF [m] and clock [s] of a GnssGloEphemMsg within a minute of its time."""
    t = at - seconds(m.toe)
    p, v = (m.pos_x, m.pos_y, m.pos_z), (m.vel_x, m.vel_y, m.vel_z)
    pull = -MU / math.hypot(*p) ** 3
    a = (pull * p[0] + EARTH_RATE ** 2 * p[0] + 2 * EARTH_RATE * v[1], pull * p[1] + EARTH_RATE ** 2 * p[1] - 2 * EARTH_RATE * v[0],
         pull * p[2])
    return tuple(p[k] + v[k] * t + a[k] * t * t / 2 for k in range(3)), -m.tau_n


def range_to(m, of, at, place):
    """The measurement of an error-free receiver at `place` at GPS second `at`, without its clock [m]."""
    travel = 0.075
    for _ in range(4):
        (x, y, z), offset = of(m, at - travel)
        turn = EARTH_RATE * travel
        x, y = x * math.cos(turn) + y * math.sin(turn), y * math.cos(turn) - x * math.sin(turn)
        travel = math.dist((x, y, z), place) / LIGHT
    return (travel - offset) * LIGHT


def ecef(latitude_deg, longitude_deg, height_m):
    a, e2 = 6378137.0, 6.69437999014e-3
    s, c = math.sin(math.radians(latitude_deg)), math.cos(math.radians(latitude_deg))
    n = a / math.sqrt(1 - e2 * s * s)
    lon = math.radians(longitude_deg)
    return (n + height_m) * c * math.cos(lon), (n + height_m) * c * math.sin(lon), (n * (1 - e2) + height_m) * s


class Drive(unittest.TestCase):
    """A drive with satellite clocks and signals without errors except noise."""

    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory()
        folder = pathlib.Path(cls.folder.name)
        simulate(CANYON, "nominal: true", folder / "nominal")
        (folder / "clocks.nav").write_text(with_clocks((folder / "nominal" / "sky.nav").read_text()))
        cls.run_folder = folder / "run"
        simulate(CANYON, "navigation: [%s/clocks.nav], errors: {enabled: false}" % folder, cls.run_folder)
        cls.observations = rinex(cls.run_folder / "receiver.obs")
        cls.epochs = list(bag.rows(cls.run_folder / "epochs.csv"))

    @classmethod
    def tearDownClass(cls):
        cls.folder.cleanup()

    def raw(self):
        locks = {}
        data = (self.run_folder / "receiver.ubx").read_bytes()
        return [bag.raw_observations(payload, locks, messages()) for payload in bag.ubx_messages(data, b"\x02\x15")]

    def ephemerides(self, of):
        """Converted ephemerides by RINEX name, and the function for position and clock of each, in names of ROS 1."""
        found = {}
        for name, when, numbers in gnss.Navigation(self.run_folder / "sky.nav").nearest(WEEK * 604800 + BEGIN):
            m = of.GnssGloEphemMsg() if name[0] == "R" else of.GnssEphemMsg()
            (gnss.fill_glonass if name[0] == "R" else gnss.fill_ephemeris)(m, name, when, numbers)
            for field in ("A", "OMG0", "M0", "OMG_dot"):
                if hasattr(m, field.lower()):
                    setattr(m, field, getattr(m, field.lower()))
            found[name] = m, near_toe if name[0] == "R" else kepler
        return found


class Conversion(Drive):
    """The parts that need no ROS."""

    def test_raw_observations_are_those_of_rinex(self):
        count = 0
        for raw in self.raw():
            self.assertEqual((raw.gps_week, raw.leap_seconds), (WEEK, LEAP_S))
            for o in raw.observations:
                expected = self.observations[round(raw.gps_tow, 1), o.id, o.code[0]]
                self.assertAlmostEqual(o.pseudorange, expected["C"], delta=6e-4)
                self.assertAlmostEqual(o.carrier_phase, expected["L"], delta=6e-4)
                self.assertAlmostEqual(o.doppler, expected["D"], delta=1e-3)
                self.assertAlmostEqual(o.cn0, expected["S"], delta=0.5)
                self.assertTrue(0.01 <= o.pseudorange_deviation < 30 and 0 < o.doppler_deviation < 10)
                count += 1
        self.assertEqual(count, len(self.observations))
        self.assertGreater(count, 1000)

    def test_measurements_have_numbers_and_values(self):
        for of, cn0 in ((messages(), "CN0"), (messages(capitals=False), "cn0")):
            raw = self.raw()[5]
            m = of.GnssMeasMsg()
            gnss.fill_measurements(m, raw, of.GnssObsMsg)
            seen = 0
            for element in m.meas:
                letter = next(each for each in "CERG" if element.sat > FIRST[each])
                name = "%s%02d" % (letter, element.sat - FIRST[letter])
                self.assertAlmostEqual(element.time.tow, BEGIN + 2.5, delta=1e-3)
                for k, frequency in enumerate(element.freqs):
                    band = {"G": {157542: "1", 122760: "2"}, "E": {157542: "1", 120714: "7"}, "C": {156110: "2", 120714: "7"},
                            "R": {}}[letter].get(round(frequency / 1e4), "1" if frequency > 1.5e9 else "2")
                    expected = self.observations[BEGIN + 2.5, name, band]
                    self.assertAlmostEqual(element.psr[k], expected["C"], delta=6e-4)
                    self.assertAlmostEqual(element.cp[k], expected["L"], delta=6e-4)
                    self.assertAlmostEqual(getattr(element, cn0)[k], expected["S"], delta=0.5)
                    self.assertEqual(element.status[k], 7)
                    seen += 1
            self.assertEqual(seen, sum(1 for tow, _, _ in self.observations if tow == BEGIN + 2.5))

    def test_measurements_come_back(self):
        of = messages()
        raw, m, back = self.raw()[3], of.GnssMeasMsg(), of.GnssRawObservations()
        gnss.fill_measurements(m, raw, of.GnssObsMsg)
        gnss.fill_raw(back, m, of.GnssRawObservation, LEAP_S)
        self.assertEqual((back.gps_week, back.gps_tow), (raw.gps_week, raw.gps_tow))
        self.assertEqual(len(back.observations), len(raw.observations))
        of_signal = {(o.id, o.code): vars(o) for o in raw.observations}
        for o in back.observations:
            self.assertTrue(math.isnan(o.lock_time))  # gnss_comm has none
            self.assertEqual({**vars(o), "lock_time": 0}, {**of_signal[o.id, o.code], "lock_time": 0})

    def test_ephemerides_give_pseudoranges_and_doppler(self):
        for of in (messages(), messages(capitals=False)):
            ephemerides = self.ephemerides(of)
            raw, epoch = self.raw()[0], self.epochs[0]
            place = ecef(epoch["true_latitude_deg"], epoch["true_longitude_deg"], epoch["true_height_m"])
            now = raw.gps_week * 604800 + raw.gps_tow
            ranges, rates = {}, {}
            for o in raw.observations:
                if o.code[0] != ("2" if o.id[0] == "C" else "1"):
                    continue
                m, of_time = ephemerides[o.id]
                ranges[o.id] = o.pseudorange - range_to(m, of_time, now, place)
                rate = range_to(m, of_time, now + 0.5, place) - range_to(m, of_time, now - 0.5, place)
                rates[o.id] = -o.doppler * LIGHT / o.carrier_frequency - rate
            self.assertEqual({name[0] for name in ranges}, set("GREC"))
            for values, limit in ((ranges, 5), (rates, 0.3)):  # of the receiver's clock: noise
                middle = sorted(values.values())[len(values) // 2]
                self.assertLess(max(abs(value - middle) for value in values.values()), limit, values)

    def test_ionosphere_and_leap_seconds(self):
        navigation = gnss.Navigation(self.run_folder / "sky.nav")
        self.assertEqual(navigation.leap_s, LEAP_S)
        lines = [line for line in (self.run_folder / "sky.nav").read_text().splitlines() if line.startswith("GPS")]
        self.assertEqual(navigation.klobuchar, [float(word) for line in lines for word in line[5:53].split()])

    def test_a_run_without_navigation_is_refused(self):
        with tempfile.TemporaryDirectory() as folder:
            (pathlib.Path(folder) / "epochs.csv").touch()
            with self.assertRaisesRegex(SystemExit, "sky.nav cannot be read .*rinex_navigation: true"):
                bag.Folder(pathlib.Path(folder), None, "frd", None)

    def test_a_damaged_message_is_passed_over(self):
        data = bytearray((self.run_folder / "receiver.ubx").read_bytes())
        whole = len(list(bag.ubx_messages(data, b"\x02\x15")))
        data[data.index(b"\xb5\x62\x02\x15") + 30] ^= 1
        self.assertEqual(len(list(bag.ubx_messages(data, b"\x02\x15"))), whole - 1)


READ = """
import json, sys, rosbag
bag, found = rosbag.Bag(sys.argv[1]), {}
for topic, m, t in bag.read_messages():
    of = found.setdefault(topic, [])
    stamp = m.header.stamp.to_sec()
    if topic == '/imu':
        of.append([stamp, m.linear_acceleration.x, m.linear_acceleration.y, m.linear_acceleration.z,
                   m.angular_velocity.x, m.angular_velocity.y, m.angular_velocity.z])
    elif topic == '/raw_observations':
        of.append([stamp, [[o.id, o.code, o.pseudorange, o.carrier_phase] for o in m.observations]])
    elif topic == '/fix':
        of.append([stamp, m.latitude, m.longitude, m.altitude] + list(m.position_covariance))
    else:
        of.append([stamp])
json.dump({'topics': found, 'md5': {c.datatype: c.md5sum for c in bag._get_connections()}}, sys.stdout)
"""


class Bag(Drive):
    """The bag as read by rosbag."""

    def setUp(self):
        pythons = [each for each in (sys.executable, "/usr/bin/python3") if pathlib.Path(each).is_file() and subprocess.run(
            [each, "-c", "import rosbag, sensor_msgs.msg, geometry_msgs.msg"], capture_output=True, check=False).returncode == 0]
        if not pythons:
            self.skipTest("SKIPPED: rosbag of ROS 1 is not installed here (python3-rosbag python3-sensor-msgs python3-geometry-msgs)")
        self.python = pythons[0]

    def convert(self, *words):
        return subprocess.run([self.python, str(EXAMPLES / "ros1_bag.py"), *map(str, words)], capture_output=True, text=True, check=False)

    def test_is_the_run(self):
        path = self.run_folder.parent / "run.bag"
        said = self.convert(self.run_folder, path, "--axes", "frd")
        self.assertEqual(said.returncode, 0, said.stderr)
        read = json.loads(subprocess.run([self.python, "-c", READ, str(path)], check=True, capture_output=True, text=True).stdout)
        topics, begin = read["topics"], 315964800 - LEAP_S + WEEK * 604800
        # MD5 sums of the unchanged message files, made by gencpp of ROS 1.
        self.assertEqual(read["md5"]["canyon_msgs/GnssRawObservations"], "dbc74a961b8e646597d9dcc41223c0db")
        imu = list(bag.rows(self.run_folder / "imu.csv"))
        self.assertEqual(len(topics["/imu"]), len(imu))
        for got, row in zip(topics["/imu"], imu):
            x, y, z = (row["specific_force_%s_mps2" % axis] for axis in "xyz")
            p, q, r = (row["angular_rate_%s_radps" % axis] for axis in "xyz")
            self.assertAlmostEqual(got[0], begin + row["gps_tow"], delta=2e-6)
            self.assertEqual(got[1:], [x, -y, -z, p, -q, -r])
        self.assertGreater(topics["/imu"][0][3], 9)  # at rest, upwards
        self.assertEqual(len(topics["/raw_observations"]), len(self.epochs))
        seen = 0
        for stamp, signals in topics["/raw_observations"]:
            for name, code, pseudorange, phase in signals:
                expected = self.observations[round(stamp - begin, 1), name, code[0]]
                self.assertAlmostEqual(pseudorange, expected["C"], delta=6e-4)
                self.assertAlmostEqual(phase, expected["L"], delta=6e-4)
                seen += 1
        self.assertEqual(seen, len(self.observations))
        for got, row in zip(topics["/fix"], self.epochs):
            self.assertEqual(got[:4], [begin + row["gps_tow"]] + [row["fix_" + name] for name in ("latitude_deg", "longitude_deg", "height_m")])
            self.assertAlmostEqual(got[4], row["sigma_east_m"] ** 2, delta=1e-9)
            self.assertEqual(got[5], row["covariance_east_north_m2"])
        self.assertEqual({name: len(topics[name]) for name in ("/magnetic_field", "/air_pressure")},
                         {"/magnetic_field": len(list(bag.rows(self.run_folder / "magnetometer.csv"))),
                          "/air_pressure": len(list(bag.rows(self.run_folder / "barometer.csv")))})

    def test_refusals(self):
        path = self.run_folder.parent / "none.bag"
        for words, problem in (((self.run_folder, path), "give --axes frd"), ((self.run_folder.parent, path), "give --receiver one of: nominal, run"),
                               ((self.run_folder, path, "--axes", "frd", "--gnss-comm", EXAMPLES), "has no GnssMeasMsg.msg")):
            said = self.convert(*words)
            self.assertNotEqual(said.returncode, 0)
            self.assertIn(problem, said.stderr)
            self.assertNotIn("Traceback", said.stderr)
            self.assertFalse(path.exists())


if __name__ == "__main__":
    CANYON = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main(verbosity=2)
