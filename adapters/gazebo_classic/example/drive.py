#!/usr/bin/env python3
"""Drives a car with a GNSS receiver through a city in gzserver and prints what the plugin publishes.

usage: drive.py FOLDER BUILD [--seconds N] [--from N] [--gui]

FOLDER holds NAME.world, truth.csv and reference.yaml, as tests/gazebo/prepare.sh writes them for the city NAME; BUILD is
the plugin's build folder. Starts a ROS master and gzserver, and ends both. Without ROS it prints the plugin's NMEA.
Exit status 1 if no fix arrives, or Gazebo ends by itself.
"""
import argparse
import bisect
import csv
import glob
import math
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.parse

import yaml

HERE = os.path.dirname(os.path.abspath(__file__))
WGS84_A, WGS84_E2 = 6378137.0, 6.69437999014e-3


if not hasattr(threading.Thread, "isAlive"):    # Debian 11's rospy still asks so; Python 3.9 has no such name
    threading.Thread.isAlive = threading.Thread.is_alive


def say(text):
    print(text, flush=True)


def headline(text):
    say(f"\n\033[1m{text}\033[0m")


class Children:
    """Programs that end with us, whatever happens: by their process id, kindly first."""

    def __init__(self, folder):
        self.folder, self.running = folder, []

    def start(self, name, *command, **options):
        log = open(os.path.join(self.folder, f"{name}.log"), "w")
        child = subprocess.Popen(command, stdout=log, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL, **options)
        child.log = log.name
        self.running.append(child)
        return child

    def stop(self, child):
        for kind, patience_s in ((signal.SIGINT, 15), (signal.SIGTERM, 5), (signal.SIGKILL, 5)):
            if child.poll() is not None:
                break
            child.send_signal(kind)
            try:
                child.wait(patience_s)
            except subprocess.TimeoutExpired:
                pass
        return child.returncode

    def __enter__(self):
        return self

    def __exit__(self, *_):
        for child in reversed(self.running):
            self.stop(child)


def wait_until(condition, what, seconds, child=None):
    deadline = time.monotonic() + seconds
    while not condition():
        if child is not None and child.poll() is not None:
            raise SystemExit(f"drive: gzserver ended (status {child.returncode}) before {what}; see {child.log}")
        if time.monotonic() > deadline:
            raise SystemExit(f"drive: {what}: not within {seconds:.0f} s" + (f"; see {child.log}" if child else ""))
        time.sleep(0.05)


def listening(port):
    with socket.socket() as probe:
        probe.settimeout(1)
        return probe.connect_ex(("127.0.0.1", port)) == 0


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Truth:
    """Where the car is: rows of GPS week, tow [s], latitude, longitude [deg], height [m]. Times count from `begin_s` into
    the drive; without one from shortly before the car first moves."""

    def __init__(self, path, begin_s):
        with open(path) as file:
            rows = list(csv.reader(file))
        week, tow = int(rows[0][0]), float(rows[0][1])
        times = [(int(row[0]) - week) * 604800 + float(row[1]) - tow for row in rows]
        if begin_s is None:
            home = [float(cell) for cell in rows[0][2:4]]
            moving = next((t for t, row in zip(times, rows)
                           if max(abs(float(row[2 + i]) - home[i]) for i in range(2)) > 2e-5), 0)    # 2 m
            begin_s = max(moving - 5, 0)
        first = bisect.bisect_left(times, begin_s)
        if not 0 <= first < len(rows) - 1:
            raise SystemExit(f"drive: --from {begin_s} is not within the drive's {times[-1]:.0f} s")
        self.rows = rows[first:]
        self.week, self.tow = self.rows[0][0], self.rows[0][1]
        self.times = [t - times[first] for t in times[first:]]
        self.places = [[float(cell) for cell in row[2:5]] for row in self.rows]

    def at(self, seconds):
        after = min(max(bisect.bisect(self.times, seconds), 1), len(self.times) - 1)
        begin, end = self.times[after - 1], self.times[after]
        part = min(max((seconds - begin) / (end - begin), 0.0), 1.0)
        return [a + part * (b - a) for a, b in zip(self.places[after - 1], self.places[after])]

    def error(self, seconds, latitude_deg, longitude_deg, height_m):
        """Fix minus truth, east, north, up [m]: with the radii of curvature there, good to 0.1 % within 10 km."""
        latitude, longitude, height = self.at(seconds)
        sine = math.sin(math.radians(latitude))
        normal = WGS84_A / math.sqrt(1 - WGS84_E2 * sine * sine)
        meridian = normal * (1 - WGS84_E2) / (1 - WGS84_E2 * sine * sine)
        east = math.radians(longitude_deg - longitude) * (normal + height) * math.cos(math.radians(latitude))
        return east, math.radians(latitude_deg - latitude) * (meridian + height), height_m - height


def elements(value):
    """YAML as elements: a mapping nests, a list repeats."""
    text = ""
    for key, item in value.items():
        for one in item if isinstance(item, list) else [item]:
            inner = elements(one) if isinstance(one, dict) else str(one).lower() if isinstance(one, bool) else str(one)
            text += f"<{key}>{inner}</{key}>"
    return text


def write_world(folder, truth, nmea_port, visuals):
    name = os.path.basename(folder.rstrip("/"))
    trajectory = os.path.join(folder, "drive.csv")
    with open(trajectory, "w") as file:
        csv.writer(file, lineterminator="\n").writerows(truth.rows)
    with open(os.path.join(folder, "reference.yaml")) as file:
        sky = yaml.safe_load(file)["sky"]
    with open(os.path.join(HERE, "vehicle.sdf")) as file:
        text = file.read()
    for word, value in (("SKY", elements(sky)), ("WEEK", truth.week), ("TOW", truth.tow),
                        ("TRAJECTORY", trajectory), ("NMEA_PORT", nmea_port),
                        ("VISUALS", "true" if visuals else "false")):
        text = text.replace(f"@{word}@", str(value))
    model = text[text.index("<model"):text.rindex("</sdf>")]
    with open(os.path.join(folder, f"{name}.world")) as file:
        world = file.read()
    path = os.path.join(folder, "drive.world")
    with open(path, "w") as file:
        file.write(world.replace("</world>", f"{model}</world>"))
    return path


def with_ros(build):
    """Whether ROS 1 and the messages of this build can be imported."""
    for place in glob.glob(os.path.join(build, "**", "canyon_msgs", "msg", "__init__.py"), recursive=True):
        packages = os.path.dirname(os.path.dirname(os.path.dirname(place)))
        sys.path.insert(0, packages)
        os.environ["PYTHONPATH"] = packages + os.pathsep + os.environ.get("PYTHONPATH", "")
        try:
            import canyon_msgs.msg  # noqa: F401
            import rospy  # noqa: F401
            import sensor_msgs.msg  # noqa: F401
            return shutil.which("rosmaster") is not None
        except ImportError:
            continue
    return False


def print_ros(children, gzserver, truth, seconds):
    import rospy
    from canyon_msgs.msg import GnssMultipath
    from sensor_msgs.msg import NavSatFix
    fixes, multipath = {}, {}
    rospy.init_node("canyon_drive", anonymous=True, disable_signals=True)
    rospy.Subscriber("/car/fix", NavSatFix, lambda m: fixes.__setitem__(m.header.stamp.to_nsec(), m))
    rospy.Subscriber("/car/gnss_multipath", GnssMultipath, lambda m: multipath.__setitem__(m.header.stamp.to_nsec(), m))
    wait_until(lambda: fixes and multipath, "the first messages on /car/fix and /car/gnss_multipath", 90, gzserver)

    headline("rostopic list")
    say(subprocess.run(["rostopic", "list"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, timeout=30,
                       universal_newlines=True).stdout.strip())
    rates = children.start("rostopic_hz", "rostopic", "hz", "-w", "50", "/car/fix")

    headline("/car/fix, once a second (errors: fix minus truth)")
    say(f"{'time [s]':>8}  {'latitude':>11}  {'longitude':>11}  {'height [m]':>10}  {'received':>8}  {'blocked':>7}"
        f"  {'sigma [m]':>9}  {'east [m]':>8}  {'north [m]':>9}  {'up [m]':>8}")
    begin_wall, begin_sim, shown = time.monotonic(), max(fixes) * 1e-9, -1
    while shown < math.floor(begin_sim + seconds):
        def due():
            return sorted(t for t in set(fixes) & set(multipath) if math.floor(t * 1e-9) > shown)
        wait_until(due, "the next fix", 60, gzserver)
        stamp = due()[0]
        shown = math.floor(stamp * 1e-9)
        fix, satellites = fixes[stamp], multipath[stamp]
        line = f"{stamp * 1e-9:8.1f}  "
        tally = f"{satellites.num_vis_sat:8d}  {satellites.num_block_sat:7d}  "
        if fix.status.status < 0:
            say(line + f"{'no fix':>11}  {'':>11}  {'':>10}  " + tally)
        else:
            east, north, up = truth.error(stamp * 1e-9, fix.latitude, fix.longitude, fix.altitude)
            sigma = math.sqrt(fix.position_covariance[0] + fix.position_covariance[4])
            say(line + f"{fix.latitude:11.7f}  {fix.longitude:11.7f}  {fix.altitude:10.2f}  " + tally +
                f"{sigma:9.1f}  {east:8.1f}  {north:9.1f}  {up:8.1f}")
    factor = (max(fixes) * 1e-9 - begin_sim) / (time.monotonic() - begin_wall)

    headline("rostopic echo -n1 /car/gnss_multipath")
    say(subprocess.run(["rostopic", "echo", "-n1", "/car/gnss_multipath"], stdout=subprocess.PIPE,
                       stderr=subprocess.DEVNULL, timeout=60, universal_newlines=True).stdout.strip())
    headline("rostopic hz /car/fix")
    children.stop(rates)
    with open(rates.log) as file:
        measured = [line.strip() for line in file if "rate" in line or "min:" in line]
    say("\n".join(measured[-2:]) or "no rate measured")
    rospy.signal_shutdown("the drive has ended")
    say(f"\n{len(fixes)} messages in {max(fixes) * 1e-9 - min(fixes) * 1e-9:.1f} s of simulated time, "
        f"{factor:.2f} times real time")


def print_notes(gzserver):
    """What the plugins had to say on Gazebo's console, without its colours."""
    with open(gzserver.log, errors="replace") as file:
        lines = [re.sub(r"\x1b\[[0-9;]*m", "", line) for line in file]
    notes = [line[line.index("[canyon]") + 9:].strip() for line in lines if "[canyon]" in line]
    if notes:
        headline("The plugins' notes")
        say("\n".join(notes))


def print_nmea(gzserver, port, seconds):
    wait_until(lambda: listening(port), f"the plugin's NMEA on port {port}", 90, gzserver)
    headline("NMEA (ROS 1 is not here)")
    deadline, lines = time.monotonic() + 60 + 5 * seconds, 0
    with socket.create_connection(("127.0.0.1", port), timeout=30) as stream, stream.makefile("r") as sentences:
        for sentence in sentences:
            if "GGA" in sentence and sentence.split(",")[1].endswith((".00", ".000")):
                say(sentence.strip())
                lines += 1
            if lines > seconds or time.monotonic() > deadline:
                break
    if not lines:
        raise SystemExit("drive: no NMEA sentence has come")


def main():
    parser = argparse.ArgumentParser(usage=__doc__.split("usage: ")[1].split("\n")[0])
    parser.add_argument("folder")
    parser.add_argument("build")
    parser.add_argument("--seconds", type=float, default=20, help="of simulated time (20)")
    parser.add_argument("--from", type=float, dest="begin_s", help="seconds into the drive (when the car first moves)")
    parser.add_argument("--gui", action="store_true", help="with Gazebo's window")
    arguments = parser.parse_args()
    if not arguments.seconds > 0:
        parser.error("--seconds must be above 0")
    truth = Truth(os.path.join(arguments.folder, "truth.csv"), arguments.begin_s)
    ros = with_ros(arguments.build)
    port = free_port()
    world = write_world(arguments.folder, truth, port, arguments.gui)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    with Children(arguments.folder) as children:
        if ros:
            master = urllib.parse.urlparse(os.environ["ROS_MASTER_URI"])
            children.start("rosmaster", "rosmaster", "--core", "-p", str(master.port))
            wait_until(lambda: listening(master.port), "the ROS master", 30)
        # Before Gazebo 11.2 meshes are found from the current folder.
        gzserver = children.start("gzserver", "gzserver", "--verbose", world, cwd=arguments.folder)
        if arguments.gui:
            children.start("gzclient", "gzclient", cwd=arguments.folder)
        if ros:
            print_ros(children, gzserver, truth, arguments.seconds)
        else:
            print_nmea(gzserver, port, arguments.seconds)
        print_notes(gzserver)
        if gzserver.poll() is not None:
            raise SystemExit(f"drive: gzserver ended (status {gzserver.returncode}); see {gzserver.log}")
        if children.stop(gzserver) != 0:
            say(f"drive: gzserver ended with status {gzserver.returncode}; see {gzserver.log}")
            return 1
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
