#!/usr/bin/env python3
"""Results of `canyon simulate` as a ROS 1 bag, for estimators that read sensor_msgs/Imu and raw observations.

    canyon simulate drive.yaml --out out/drive          # with sensors: {imu: ...} and outputs: {ubx: true}
    python3 ros1_bag.py out/drive drive.bag
    rosbag play --clock -d 3 drive.bag                  # its topics, at their times; subscribers have 3 s before

Contents of the bag, with Unix times of UTC, from the folder:
    imu               sensor_msgs/Imu              imu.csv, forward, left, up; orientation unknown; not for a fixed receiver
    magnetic_field    sensor_msgs/MagneticField    magnetometer.csv, likewise
    air_pressure      sensor_msgs/FluidPressure    barometer.csv
    fix               sensor_msgs/NavSatFix        epochs.csv, with covariance
    fix_velocity      geometry_msgs/TwistWithCovarianceStamped   epochs.csv: east, north, up
    raw_observations  canyon_msgs/GnssRawObservations            receiver.ubx (RXM-RAWX)
With --gnss-comm FOLDER (a checkout of gnss_comm) also, below /ublox_driver, range_meas, receiver_lla, ephem, glo_ephem,
iono_params and time_pulse_info, as in ros_gnss_comm.py.
Needs rosbag of ROS 1 (Debian: python3-rosbag python3-sensor-msgs python3-geometry-msgs); no package must be built.
"""
import argparse
import collections
import csv
import heapq
import math
import pathlib
import struct
import sys

import ros_gnss_comm as gnss

UNIX_OF_GPS_S = 315964800
HERE = pathlib.Path(__file__).resolve().parent
# RXM-RAWX, u-blox's gnssId: letter, system and first number less 1 in canyon_msgs, signals by sigId: code and MHz.
E1, L2, L5, E5B, B1 = 1575.42, 1227.6, 1176.45, 1207.14, 1561.098
RAWX = {
    0: ("G", 0, 0, {0: ("1C", E1), 3: ("2L", L2), 4: ("2S", L2), 6: ("5I", L5), 7: ("5Q", L5)}),
    1: ("S", 5, 0, {0: ("1C", E1)}),
    2: ("E", 2, 300, {0: ("1C", E1), 1: ("1B", E1), 3: ("5I", L5), 4: ("5Q", L5), 5: ("7I", E5B), 6: ("7Q", E5B)}),
    3: ("C", 3, 400, {0: ("2I", B1), 1: ("2I", B1), 2: ("7I", E5B), 3: ("7I", E5B), 5: ("1P", E1), 6: ("1D", E1),
                      7: ("5P", L5), 8: ("5D", L5)}),
    5: ("J", 4, 192, {0: ("1C", E1), 1: ("1Z", E1), 4: ("2S", L2), 5: ("2L", L2), 8: ("5I", L5), 9: ("5Q", L5)}),
    6: ("R", 1, 64, {0: ("1C", 1602.0), 2: ("2C", 1246.0)}),
}
GLONASS_STEP_MHZ = {0: 0.5625, 2: 0.4375}
BEIDOU_D2 = (1, 3)  # geostationary: u-blox's phases are half a cycle less


def ubx_messages(data, kind):
    """Payloads of the messages of class and number `kind` in `data`; damaged ones are skipped."""
    at = data.find(b"\xb5\x62")
    while 0 <= at <= len(data) - 8:
        length = int.from_bytes(data[at + 4:at + 6], "little")
        body = data[at + 2:at + 6 + length]
        a = b = 0
        if body[:2] == kind or len(data) < at + 8 + length:
            for byte in body:
                a = (a + byte) & 255
                b = (b + a) & 255
            if data[at + 6 + length:at + 8 + length] == bytes((a, b)):
                yield body[4:]
            else:
                length = -6  # search after its first bytes
        at = data.find(b"\xb5\x62", at + 8 + length)


def raw_observations(payload, locks, types):
    """A GnssRawObservations of an RXM-RAWX; `locks`: lock times of the previous epoch, by signal, which it replaces."""
    raw = types.GnssRawObservations()
    raw.gps_tow, raw.gps_week, raw.leap_seconds, count = struct.unpack_from("<dHbB", payload)
    before, now = dict(locks), {}
    for k in range(count):
        pseudorange, phase, doppler, system, satellite, signal, channel, lock, cn0, *deviations, state = struct.unpack_from(
            "<ddfBBBBHBBBBB", payload, 16 + 32 * k)
        letter, o_system, base, signals = RAWX.get(system, (None, 0, 0, {}))
        if signal not in signals or not state & 1:
            continue
        o = types.GnssRawObservation()
        o.code, frequency = signals[signal]
        if letter == "R":
            o.frequency_channel = channel - 7
            frequency += o.frequency_channel * GLONASS_STEP_MHZ[signal]
        o.id = "%s%02d" % (letter, satellite - (100 if letter == "S" else 0))
        o.system, o.prn, o.carrier_frequency = o_system, base + satellite, frequency * 1e6
        of_range, of_phase, of_doppler = (byte & 15 for byte in deviations)
        o.pseudorange, o.pseudorange_deviation = pseudorange, 0.01 * 2 ** of_range
        o.doppler, o.doppler_deviation, o.cn0 = doppler, 0.002 * 2 ** of_doppler, cn0
        o.carrier_phase = o.carrier_phase_deviation = o.lock_time = math.nan
        if state & 2:
            o.carrier_phase = phase + (0.5 if letter == "C" and signal in BEIDOU_D2 else 0)
            o.carrier_phase_deviation, o.lock_time = 0.004 * of_phase, lock / 1000
            o.loss_of_lock = lock < before.get((o.id, o.code), 0)
            now[o.id, o.code] = lock
        raw.observations.append(o)
    locks.update(now)
    return raw


def rows(path):
    """Lines of a table: numbers by column, words unchanged, empty cells NaN."""
    def value(cell):
        try:
            return float(cell) if cell else math.nan
        except ValueError:
            return cell
    with open(path, encoding="utf-8", newline="") as file:
        for row in csv.DictReader(file):
            yield {name: value(cell) for name, cell in row.items()}


class Folder:
    """Streams of (Unix time [s], topic, message) of a run's folder."""

    def __init__(self, run, receiver, axes, types):
        self.run, self.types = run, types
        self.receiver = run / receiver if receiver else run
        if not (self.receiver / "epochs.csv").is_file():
            names = sorted(path.parent.name for path in run.glob("*/epochs.csv"))
            sys.exit("%s has no epochs.csv; give --receiver one of: %s" % (self.receiver, ", ".join(names)) if names else
                     "%s has no epochs.csv; give the folder of a run of canyon simulate" % self.receiver)
        self.navigation = gnss.Navigation(run / "sky.nav")
        self.side = {"flu": 1.0, "frd": -1.0}[axes]
        self.axes = axes

    def unix(self, row):
        return UNIX_OF_GPS_S - self.navigation.leap_s + row["gps_week"] * gnss.WEEK_S + row["gps_tow"]

    def vector(self, to, row, name, scale=1.0):
        to.x, to.y, to.z = (row[name % axis] * scale * side for axis, side in (("x", 1), ("y", self.side), ("z", self.side)))

    def on_vehicle(self):
        """Whether the receiver is on the vehicle with the sensors: the truth of a fixed receiver does not move."""
        def moves(path, name):
            return path.is_file() and any(row[name % axis] for row in rows(path) for axis in ("east", "north", "up"))
        return moves(self.receiver / "epochs.csv", "true_velocity_%s_mps") or not moves(self.run / "motion.csv", "velocity_%s_mps")

    def streams(self):
        """Streams of the existing files; a fixed receiver has none of the vehicle's sensors."""
        of = {"imu.csv": self.imu, "magnetometer.csv": self.magnetometer, "barometer.csv": self.barometer}
        of = of if self.on_vehicle() else {}
        found = [call(rows(self.run / name)) for name, call in of.items() if (self.run / name).is_file()]
        found.append(self.fixes(rows(self.receiver / "epochs.csv")))
        if (self.receiver / "receiver.ubx").is_file():
            found.append(self.raw((self.receiver / "receiver.ubx").read_bytes()))
        return found

    def imu(self, table):
        for k, row in enumerate(table):
            message = self.types.Imu()
            message.header.frame_id = "imu"
            self.vector(message.linear_acceleration, row, "specific_force_%s_mps2")
            self.vector(message.angular_velocity, row, "angular_rate_%s_radps")
            message.orientation.w, message.orientation_covariance[0] = 1.0, -1.0
            if k == 0 and message.linear_acceleration.z < -5:
                sys.exit("imu.csv: at the first sample the force points down; give --axes %s if the sensor is not upside down" %
                         {"flu": "frd", "frd": "flu"}[self.axes])
            yield self.unix(row), "imu", message

    def magnetometer(self, table):
        for row in table:
            message = self.types.MagneticField()
            message.header.frame_id = "magnetometer"
            self.vector(message.magnetic_field, row, "field_%s_ut", 1e-6)
            yield self.unix(row), "magnetic_field", message

    def barometer(self, table):
        for row in table:
            message = self.types.FluidPressure()
            message.header.frame_id, message.fluid_pressure = "barometer", row["pressure_pa"]
            yield self.unix(row), "air_pressure", message

    def fixes(self, table):
        for row in table:
            yield self.unix(row), "fix", self.fix(row)
            message = self.types.TwistWithCovarianceStamped()
            message.header.frame_id = "gnss"
            linear, angular = message.twist.twist.linear, message.twist.twist.angular
            linear.x, linear.y, linear.z = (row["fix_velocity_%s_mps" % axis] for axis in ("east", "north", "up"))
            angular.x = angular.y = angular.z = math.nan
            message.twist.covariance[0] = message.twist.covariance[21] = -1.0
            yield self.unix(row), "fix_velocity", message

    def fix(self, row):
        message = self.types.NavSatFix()
        message.header.frame_id = "gnss"
        message.latitude, message.longitude, message.altitude = (
            row["fix_" + name] for name in ("latitude_deg", "longitude_deg", "height_m"))
        if row["status"] != "fix":
            message.status.status = message.status.STATUS_NO_FIX
            return message
        message.status.status = {"single": message.status.STATUS_FIX, "dead reckoning": message.status.STATUS_NO_FIX,
                                 "combined": message.status.STATUS_FIX}.get(row["fix_kind"], message.status.STATUS_GBAS_FIX)
        east, north, up = (row["sigma_%s_m" % axis] ** 2 for axis in ("east", "north", "up"))
        en, eu, nu = (row["covariance_%s_m2" % axes] for axes in ("east_north", "east_up", "north_up"))
        message.position_covariance = [east, en, eu, en, north, nu, eu, nu, up]
        message.position_covariance_type = message.COVARIANCE_TYPE_KNOWN
        return message

    def raw(self, data):
        locks = {}
        for payload in ubx_messages(data, b"\x02\x15"):
            message = raw_observations(payload, locks, self.types)
            message.header.frame_id = "gnss"
            yield self.unix({"gps_week": message.gps_week, "gps_tow": message.gps_tow}), "raw_observations", message


class Recorder:
    """A bag that replaces ROS: messages are written to it."""

    def __init__(self, bag, time_of):
        self.bag, self.time_of, self.calls, self.counts, self.at = bag, time_of, {}, collections.Counter(), None

    def publisher(self, name, _):
        return argparse.Namespace(publish=lambda message: self.write(name, message))

    def subscribe(self, name, _, call):
        self.calls.setdefault(name, []).append(call)

    def write(self, name, message):
        self.bag.write(name, message, self.at)
        self.counts[name] += 1
        for call in self.calls.get(name, []):
            call(message)

    def record(self, unix_s, name, message):
        seconds = math.floor(unix_s)
        self.at = self.time_of(seconds, round((unix_s - seconds) * 1e6) * 1000)
        message.header.stamp = self.at
        self.write(name, message)


def classes_of(package, folder, names):
    """Classes of messages, by name, of the .msg files in `folder`; without catkin."""
    import genpy.dynamic
    from std_msgs.msg import Header
    texts = {path.stem: path.read_text(encoding="utf-8") for path in folder.glob("*.msg")}

    def needs(name):
        kinds = (line.split("[")[0].split() for line in texts[name].splitlines())
        found = [words[0] for words in kinds if words and words[0] in texts]
        return found + [other for each in found for other in needs(each)]

    def load(name):
        parts = ["%s\nMSG: std_msgs/Header\n%s" % ("=" * 80, Header._full_text)]
        parts += ["%s\nMSG: %s/%s\n%s" % ("=" * 80, package, other, texts[other]) for other in dict.fromkeys(needs(name))]
        whole = "%s/%s" % (package, name)
        return genpy.dynamic.generate_dynamic(whole, "\n".join([texts[name]] + parts))[whole]

    missing = [name for name in names if name not in texts]
    if missing:
        sys.exit("%s has no %s.msg; give --%s the folder of that package" % (folder, missing[0], package.replace("_", "-")))
    return {name: load(name) for name in names}


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("run", type=pathlib.Path, help="folder of canyon simulate")
    parser.add_argument("bag", type=pathlib.Path)
    parser.add_argument("--receiver", metavar="NAME", help="name of the receiver, for a run with several")
    parser.add_argument("--axes", choices=("flu", "frd"), default="flu", help="axes of the scenario's sensors (flu)")
    parser.add_argument("--canyon-msgs", type=pathlib.Path, metavar="FOLDER", default=HERE.parent / "adapters/ros/canyon_msgs",
                        help="folder of that package, in a checkout of Canyon")
    parser.add_argument("--gnss-comm", type=pathlib.Path, metavar="FOLDER", help="folder of that package; without it, none of its messages")
    arguments = parser.parse_args()
    try:
        import genpy
        import geometry_msgs.msg
        import rosbag
        import sensor_msgs.msg
    except ImportError as missing:
        sys.exit("%s; install python3-rosbag, python3-sensor-msgs and python3-geometry-msgs" % missing)
    types = argparse.Namespace(TwistWithCovarianceStamped=geometry_msgs.msg.TwistWithCovarianceStamped)
    for name in ("Imu", "MagneticField", "FluidPressure", "NavSatFix"):
        setattr(types, name, getattr(sensor_msgs.msg, name))
    packages = [("canyon_msgs", arguments.canyon_msgs, gnss.OF_CANYON)]
    if arguments.gnss_comm:
        packages.append(("gnss_comm", arguments.gnss_comm, gnss.OF_GNSS_COMM))
    for package, folder, names in packages:
        vars(types).update(classes_of(package, folder / "msg", names))
    folder = Folder(arguments.run, arguments.receiver, arguments.axes, types)
    try:
        with rosbag.Bag(str(arguments.bag), "w") as bag:
            recorder = Recorder(bag, genpy.Time)
            if arguments.gnss_comm:
                gnss.Converter(recorder, types, "", "/ublox_driver", folder.navigation)
            for unix_s, topic, message in heapq.merge(*folder.streams(), key=lambda item: item[0]):
                recorder.record(unix_s, "/" + topic, message)
    except BaseException:
        arguments.bag.unlink()  # an incomplete bag looks like a complete one
        raise
    for name, count in sorted(recorder.counts.items()):
        print("%7d  %s" % (count, name))
    if not recorder.counts["/raw_observations"]:
        print("no raw observations: the scenario needs outputs: {ubx: true} and a receiver that measures them", file=sys.stderr)


if __name__ == "__main__":
    main()
