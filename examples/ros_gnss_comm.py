#!/usr/bin/env python3
"""Topics of a Canyon receiver as messages of gnss_comm, used by GVINS and others. For ROS 1 and ROS 2.

    canyon simulate drive.yaml --out out/drive       # its out/drive/sky.nav has the ephemerides
    python3 ros_gnss_comm.py --navigation out/drive/sky.nav --from /car/gnss --to /ublox_driver

It subscribes to raw_observations, satellites, fix and fix_velocity below the name --from, and publishes below --to
    range_meas       gnss_comm/GnssMeasMsg            each epoch: signals of GPS, GLONASS, Galileo and BeiDou
    receiver_pvt     gnss_comm/GnssPVTSolnMsg         each epoch; height_msl is the ellipsoidal one
    receiver_lla     sensor_msgs/NavSatFix            each epoch: the unchanged fix
    time_pulse_info  gnss_comm/GnssTimePulseInfoMsg   before each whole second of GPS time: that second
    ephem, glo_ephem gnss_comm/GnssEphemMsg, GnssGloEphemMsg   at the first epoch, and then every 30 s
    iono_params      gnss_comm/StampedFloat64Array    same times: eight coefficients of Klobuchar's model
With --back it subscribes to range_meas below --from and publishes canyon_msgs/GnssRawObservations below --to.
Needs NumPy, gnss_comm, canyon_msgs, and rospy or rclpy.
"""
import argparse
import datetime
import math
import pathlib
import sys

# Numbers of codes in RTKLIB 2.4.2, from 1 on.
CODES = ("1C 1P 1W 1Y 1M 1N 1S 1L 1E 1A 1B 1X 1Z 2C 2D 2S 2L 2X 2P 2W 2Y 2M 2N 5I 5Q 5X 7I 7Q 7X 6A 6B 6C 6X 6Z 6S 6L "
         "8I 8Q 8X 2I 2Q 6I 6Q 3I 3Q 3X 1I 1Q").split()
# Satellites are numbered through the systems in this order: letter, count, system and first number minus 1 in canyon_msgs.
SYSTEMS = (("G", 32, 0, 0), ("R", 27, 1, 64), ("E", 38, 2, 300), ("C", 63, 3, 400))
WEEK_S = 604800
REPEAT_S = 30
# GnssSatellites: fix_status, fix_kind.
SOLVED, DIFFERENTIAL, FLOAT, FIXED, DEAD_RECKONING, COMBINED = 1, 2, 3, 4, 5, 6
OF_GNSS_COMM = ("GnssMeasMsg GnssObsMsg GnssEphemMsg GnssGloEphemMsg GnssPVTSolnMsg GnssTimePulseInfoMsg "
                "StampedFloat64Array").split()
OF_CANYON = "GnssRawObservation GnssRawObservations GnssSatellites".split()
PSEUDORANGE_VALID, PHASE_VALID, HALF_CYCLE_KNOWN = 1, 2, 4


def satellite_number(name):
    """The number in gnss_comm for a RINEX name such as G05; 0 if it has none."""
    number, before = int(name[1:]), 0
    for letter, count, _, _ in SYSTEMS:
        if name[0] == letter:
            return before + number if 0 < number <= count else 0
        before += count
    return 0


def satellite_of(number):
    """RINEX name, system and number in canyon_msgs of a number of gnss_comm; None if it has none."""
    for letter, count, system, base in SYSTEMS:
        if 0 < number <= count:
            return "%s%02d" % (letter, number), system, base + number
        number -= count
    return None


def finite(value):
    return float(value) if math.isfinite(value) else 0.0


def named(message, name):
    """`name` of a field in ROS 1. Fields in ROS 2 have no capitals: `CN0` is `cn0`."""
    return name if hasattr(message, name) else name.lower()


def fill(message, **fields):
    for name, value in fields.items():
        setattr(message, named(message, name), value)


def set_time(to, seconds):
    """`to`: a GnssTimeMsg; `seconds` of GPS time since 1980-01-06."""
    to.week, to.tow = int(seconds // WEEK_S), float(seconds % WEEK_S)


class Navigation:
    """Ephemerides and ionosphere of a RINEX 3 navigation file (RINEX 3.04, A.6 to A.14), in GPS time."""

    def __init__(self, path):
        try:
            lines = pathlib.Path(path).read_text(encoding="ascii").splitlines()
        except (OSError, UnicodeDecodeError) as problem:
            sys.exit("the navigation file %s cannot be read (%s); canyon simulate writes sky.nav with outputs: "
                     "{rinex_navigation: true}" % (path, getattr(problem, "strerror", None) or "it is not text"))
        end = next((k for k, line in enumerate(lines) if line[60:].startswith("END OF HEADER")), None)
        if end is None or lines[0][20:21] != "N" or lines[0].split()[0][0] != "3":
            sys.exit("%s is not a RINEX 3 navigation file; give --navigation the sky.nav of canyon simulate" % path)
        self.klobuchar, self.leap_s, self.records = [0.0] * 8, 18, []
        for line in lines[:end]:
            if line[:4] in ("GPSA", "GPSB"):
                at = 0 if line[3] == "A" else 4
                self.klobuchar[at:at + 4] = self.numbers(line, 5, 12)
            elif line[60:].startswith("LEAP SECONDS"):
                self.leap_s = int(line[:6])
        for line in lines[end + 1:]:
            if line[:1].isalpha():
                when = datetime.datetime(*(int(word) for word in line[4:23].split()))
                self.records.append((line[:3], self.gps(when, line[0]), self.numbers(line, 23, 19)[:3]))
            elif line.strip():
                self.records[-1][2].extend(self.numbers(line, 4, 19))
        # For Galileo the I/NAV messages of E1-B.
        self.records = [r for r in self.records if satellite_number(r[0]) and len(r[2]) >= (15 if r[0][0] == "R" else 31)
                        and not (r[0][0] == "E" and not int(r[2][20]) & 1)]

    @staticmethod
    def numbers(line, start, width):
        cells = (line[at:at + width].replace("D", "E").strip() for at in range(start, start + 4 * width, width))
        return [float(cell) if cell else 0.0 for cell in cells]

    def gps(self, when, system):
        """GLONASS uses UTC, BeiDou is 14 s behind."""
        return (when - datetime.datetime(1980, 1, 6)).total_seconds() + {"R": self.leap_s, "C": 14}.get(system, 0)

    def nearest(self, now):
        """For each satellite the record nearest in time to `now`."""
        best = {}
        for record in self.records:
            if record[0] not in best or abs(record[1] - now) < abs(best[record[0]][1] - now):
                best[record[0]] = record
        return best.values()


def fill_ephemeris(m, name, toc, n):
    """GnssEphemMsg. Weeks and times of BeiDou are those of GPS, as in gnss_comm's own reader of RINEX."""
    zero = n[21] * WEEK_S + ((1356 * WEEK_S + 14) if name[0] == "C" else 0)
    m.sat = satellite_number(name)
    set_time(m.toc, toc)
    set_time(m.toe, zero + n[11])
    set_time(m.ttr, zero + n[27])
    m.week, m.toe_tow = m.toe.week, m.toe.tow
    fill(m, af0=n[0], af1=n[1], af2=n[2], iode=int(n[3]), crs=n[4], delta_n=n[5], M0=n[6], cuc=n[7], e=n[8], cus=n[9],
         A=n[10] ** 2, cic=n[12], OMG0=n[13], cis=n[14], i0=n[15], crc=n[16], omg=n[17], OMG_dot=n[18], i_dot=n[19],
         code=int(n[20]), ura=n[23], health=int(n[24]), tgd0=n[25])
    if name[0] == "G":
        m.iodc = int(n[26])
    else:
        m.tgd1 = n[26]


def fill_glonass(m, name, toe, n):
    """GnssGloEphemMsg, in m."""
    m.sat = satellite_number(name)
    set_time(m.toe, toe)
    set_time(m.ttr, toe)
    m.tau_n, m.gamma, m.health, m.freqo, m.age = -n[0], n[1], int(n[6]), int(n[10]), int(n[14])
    for axis, at in (("x", 3), ("y", 7), ("z", 11)):
        for k, what in enumerate(("pos_", "vel_", "acc_")):
            setattr(m, what + axis, n[at + k] * 1e3)


def fill_measurements(m, raw, make_observation):
    """GnssMeasMsg of a GnssRawObservations: one element for each satellite, its signals in lists."""
    satellites = {}  # number: lists by field
    for o in raw.observations:
        number = satellite_number(o.id)
        if not number or o.code not in CODES:
            continue
        phase = math.isfinite(o.carrier_phase)
        for field, value in (("freqs", o.carrier_frequency), ("CN0", finite(o.cn0)), ("LLI", int(o.loss_of_lock)),
                             ("code", CODES.index(o.code) + 1), ("psr", o.pseudorange),
                             ("psr_std", finite(o.pseudorange_deviation)), ("cp", finite(o.carrier_phase)),
                             ("cp_std", finite(o.carrier_phase_deviation)), ("dopp", finite(o.doppler)),
                             ("dopp_std", finite(o.doppler_deviation)),
                             ("status", PSEUDORANGE_VALID | (PHASE_VALID | HALF_CYCLE_KNOWN if phase else 0))):
            satellites.setdefault(number, {}).setdefault(field, []).append(value)
    measurements = []
    for number, lists in satellites.items():
        to = make_observation()
        to.sat, to.time.week, to.time.tow = number, raw.gps_week, raw.gps_tow
        fill(to, **lists)
        measurements.append(to)
    m.meas = measurements


def fill_raw(raw, measurements, make_observation, leap_s):
    """GnssRawObservations of a GnssMeasMsg; missing values are NaN."""
    for element in measurements.meas:
        known = satellite_of(element.sat)
        raw.gps_week, raw.gps_tow, raw.leap_seconds = element.time.week, element.time.tow, leap_s
        for k, frequency in enumerate(element.freqs):
            if known is None or not 0 < element.code[k] <= len(CODES):
                continue
            o = make_observation()
            (o.id, o.system, o.prn), o.code, o.carrier_frequency = known, CODES[element.code[k] - 1], frequency
            if known[1] == 1:
                base, step = (1602e6, 562.5e3) if o.code[0] == "1" else (1246e6, 437.5e3)
                o.frequency_channel = int(round((frequency - base) / step))
            o.pseudorange, o.pseudorange_deviation = element.psr[k], element.psr_std[k]
            phase = bool(element.status[k] & PHASE_VALID)
            o.carrier_phase, o.carrier_phase_deviation = (element.cp[k], element.cp_std[k]) if phase else (math.nan,) * 2
            o.doppler, o.doppler_deviation = element.dopp[k], element.dopp_std[k]
            o.cn0, o.lock_time = getattr(element, named(element, "CN0"))[k], math.nan
            o.loss_of_lock = bool(getattr(element, named(element, "LLI"))[k] & 1)
            raw.observations.append(o)


def pdop(satellites):
    """Dilution of the used satellites, a clock for each system; 0 if they do not determine a position."""
    import numpy
    systems = sorted({s.system for s in satellites})
    rows = [[math.cos(s.elevation) * math.sin(s.azimuth), math.cos(s.elevation) * math.cos(s.azimuth), math.sin(s.elevation)] +
            [float(s.system == each) for each in systems] for s in satellites]
    matrix = numpy.array(rows)
    if len(rows) < 3 + len(systems) or numpy.linalg.matrix_rank(matrix) < matrix.shape[1]:
        return 0.0
    return float(numpy.sqrt(numpy.trace(numpy.linalg.inv(matrix.T @ matrix)[:3, :3])))


def fill_pvt(m, satellites, fix, velocity):
    """GnssPVTSolnMsg."""
    kind, used = satellites.fix_kind, [s for s in satellites.satellites if s.used]
    m.time.week, m.time.tow = max(satellites.gps_week, 0), finite(satellites.gps_tow)
    m.valid_fix = satellites.fix_status == SOLVED and math.isfinite(fix.latitude)
    m.fix_type = 0 if not m.valid_fix else {DEAD_RECKONING: 1, COMBINED: 4}.get(kind, 3)
    m.diff_soln, m.carr_soln, m.num_sv = kind in (DIFFERENTIAL, FLOAT, FIXED), {FLOAT: 1, FIXED: 2}.get(kind, 0), len(used)
    m.latitude, m.longitude, m.altitude = fix.latitude, fix.longitude, fix.altitude
    m.height_msl, m.p_dop = fix.altitude, pdop(used)
    of_place, of_speed = fix.position_covariance, velocity.twist.covariance
    m.h_acc, m.v_acc = math.sqrt(max(0.0, of_place[0] + of_place[4])), math.sqrt(max(0.0, of_place[8]))
    linear = velocity.twist.twist.linear
    m.vel_e, m.vel_n, m.vel_d = linear.x, linear.y, -linear.z
    m.vel_acc = math.sqrt(max(0.0, of_speed[0] + of_speed[7] + of_speed[14]))


class Ros1:
    def __init__(self):
        import rospy
        self.rospy = rospy
        rospy.init_node("canyon_gnss_comm", anonymous=True)

    def publisher(self, name, kind):
        return self.rospy.Publisher(name, kind, queue_size=200)

    def subscribe(self, name, kind, call):
        self.rospy.Subscriber(name, kind, call, queue_size=200)

    def now(self):
        return self.rospy.Time.now()

    def spin(self):
        self.rospy.spin()


class Ros2:
    def __init__(self):
        import rclpy
        self.rclpy = rclpy
        rclpy.init()
        self.node = rclpy.create_node("canyon_gnss_comm")

    def publisher(self, name, kind):
        return self.node.create_publisher(kind, name, 200)

    def subscribe(self, name, kind, call):
        self.node.create_subscription(kind, name, call, 200)

    def now(self):
        return self.node.get_clock().now().to_msg()

    def spin(self):
        try:
            self.rclpy.spin(self.node)
        except KeyboardInterrupt:
            pass


class Converter:
    def __init__(self, ros, types, source, target, navigation):
        self.types, self.navigation = types, navigation
        self.sent_s, self.pulse_s, self.parts = -math.inf, -math.inf, {}
        of = {"range_meas": types.GnssMeasMsg, "receiver_pvt": types.GnssPVTSolnMsg, "receiver_lla": types.NavSatFix,
              "time_pulse_info": types.GnssTimePulseInfoMsg, "ephem": types.GnssEphemMsg,
              "glo_ephem": types.GnssGloEphemMsg, "iono_params": types.StampedFloat64Array}
        self.out = {name: ros.publisher(target + "/" + name, kind) for name, kind in of.items()}
        ros.subscribe(source + "/raw_observations", types.GnssRawObservations, self.observed)
        for name, kind in (("satellites", types.GnssSatellites), ("fix", types.NavSatFix),
                           ("fix_velocity", types.TwistWithCovarianceStamped)):
            ros.subscribe(source + "/" + name, kind, lambda message, name=name: self.solved(name, message))

    def observed(self, raw):
        if raw.gps_week < 0:
            return
        now = raw.gps_week * WEEK_S + raw.gps_tow
        if self.navigation and not 0 <= now - self.sent_s < REPEAT_S:
            self.sent_s = now
            self.send_navigation(raw.header, now)
        if not 0 < self.pulse_s - now <= 1:
            self.pulse_s = math.floor(now) + 1
            pulse = self.types.GnssTimePulseInfoMsg()
            set_time(pulse.time, self.pulse_s)
            pulse.utc_based, pulse.time_sys = False, 1  # GPS in gnss_comm's numbering of systems
            self.out["time_pulse_info"].publish(pulse)
        message = self.types.GnssMeasMsg()
        fill_measurements(message, raw, self.types.GnssObsMsg)
        self.out["range_meas"].publish(message)

    def send_navigation(self, header, now):
        iono = self.types.StampedFloat64Array()
        iono.header, iono.data = header, self.navigation.klobuchar
        self.out["iono_params"].publish(iono)
        for name, when, numbers in self.navigation.nearest(now):
            glonass = name[0] == "R"
            message = self.types.GnssGloEphemMsg() if glonass else self.types.GnssEphemMsg()
            (fill_glonass if glonass else fill_ephemeris)(message, name, when, numbers)
            self.out["glo_ephem" if glonass else "ephem"].publish(message)

    def solved(self, name, message):
        if name == "fix":
            self.out["receiver_lla"].publish(message)
        stamp = str(message.header.stamp)
        parts = self.parts.setdefault(stamp, {})
        parts[name] = message
        if len(parts) == 3 and self.parts.pop(stamp, None):  # rospy has a thread for each topic
            solution = self.types.GnssPVTSolnMsg()
            fill_pvt(solution, parts["satellites"], parts["fix"], parts["fix_velocity"])
            self.out["receiver_pvt"].publish(solution)
        while len(self.parts) > 200:  # the oldest will not be completed
            self.parts.pop(next(iter(self.parts)), None)


def go_back(ros, types, source, target, leap_s):
    out = ros.publisher(target + "/raw_observations", types.GnssRawObservations)

    def observed(measurements):
        raw = types.GnssRawObservations()
        raw.header.stamp = ros.now()
        raw.gps_week, raw.gps_tow = -1, math.nan
        fill_raw(raw, measurements, types.GnssRawObservation, leap_s)
        out.publish(raw)

    ros.subscribe(source + "/range_meas", types.GnssMeasMsg, observed)


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--from", dest="source", default="", metavar="NAME", help="namespace of the subscribed topics")
    parser.add_argument("--to", default="/ublox_driver", metavar="NAME", help="namespace of the published topics (/ublox_driver)")
    parser.add_argument("--navigation", metavar="FILE", help="RINEX 3: ephemerides and ionosphere; without it, none are sent")
    parser.add_argument("--back", action="store_true", help="from gnss_comm's observations to canyon_msgs'")
    arguments = parser.parse_args([word for word in sys.argv[1:] if ":=" not in word])
    navigation = Navigation(arguments.navigation) if arguments.navigation else None
    types = argparse.Namespace()
    for package, names in (("gnss_comm", OF_GNSS_COMM), ("canyon_msgs", OF_CANYON), ("sensor_msgs", ["NavSatFix"]),
                           ("geometry_msgs", ["TwistWithCovarianceStamped"])):
        module = __import__(package + ".msg", fromlist=["msg"])
        for name in names:
            setattr(types, name, getattr(module, name))
    try:
        ros = Ros1()
    except ImportError:
        ros = Ros2()
    if arguments.back:
        go_back(ros, types, arguments.source, arguments.to, navigation.leap_s if navigation else 18)
    else:
        converter = Converter(ros, types, arguments.source, arguments.to, navigation)  # noqa: F841, referenced by its callbacks
    ros.spin()


if __name__ == "__main__":
    main()
