#!/usr/bin/env python3
"""Flies PX4's vehicles in Gazebo Sim with Canyon's receivers as their GPS: a world, PX4, u-blox receivers on serial lines.

Starts `gz sim`, PX4 and the viewer's server, prints fix and accuracies once per second of simulated time, and ends them all.
docs/autopilots.md explains it. Exit status 1 if PX4 gets no fix or something ends by itself.
"""
import argparse
import bisect
import csv
import datetime
import json
import math
import os
import shutil
import signal
import socket
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.dont_write_bytecode = True
sys.path[:0] = [HERE, os.path.join(HERE, "..", "..", "common", "example")]
import mavlink_link  # noqa: E402
import world_file  # noqa: E402
from driving import Children, headline, put_first, say, wait_until  # noqa: E402

DOWNTOWN = os.path.join(HERE, "..", "worlds", "canyon_downtown.sdf")
DOWNTOWN_POSE = "26,-260,0.3"    # an open field south of it
# For vehicle N: UDP ports of its epochs and of its MAVLink, here and in PX4; the viewer's TCP port.
EPOCHS, HERE_PORT, PX4_PORT, VIEW = 28960, 24560, 24550, 2950
# In a street a receiver reports a larger sigma than PX4 accepts by default (3 m; height 5 m); a barometer's height is better.
STREET_PARAMETERS = ("EKF2_REQ_EPH=10", "EKF2_REQ_EPV=15", "EKF2_HGT_REF=0")
PX4_RTCM_PORT = 14280    # PX4's link to a companion computer
KINDS = ("no GPS", "no fix", "2D", "3D", "DGPS", "float", "fixed")    # GPS_FIX_TYPE
GET_PX4 = """get it and build it once (docs/autopilots.md):
  git clone --recursive https://github.com/PX4/PX4-Autopilot && cd PX4-Autopilot && make px4_sitl_default
then name its folder: ./run px4 --px4 DIR, or export PX4_DIR=DIR"""


def complain(problem):
    raise SystemExit(f"px4: {problem}")


def arguments():
    parser = argparse.ArgumentParser(prog="./run px4", description=__doc__.split("\n")[0])
    parser.add_argument("build", help=argparse.SUPPRESS)
    parser.add_argument("--px4", metavar="DIR", help="PX4's folder, built (PX4_DIR, else ~/PX4-Autopilot or ../PX4-Autopilot)")
    parser.add_argument("--world", metavar="FILE", default=DOWNTOWN, help="a world with spherical_coordinates (a synthetic downtown)")
    parser.add_argument("--pose", metavar="X,Y,Z", help=f"position of the first vehicle in the world [m] (0,0,0.3; downtown {DOWNTOWN_POSE})")
    parser.add_argument("--model", default="x500", help="PX4's model (x500)")
    parser.add_argument("--vehicles", type=int, default=1, metavar="N", help="1 to 9 vehicles, 4 m apart (1)")
    parser.add_argument("--profile", default="ublox-m10", help="receiver: one of 'canyon profiles' (ublox-m10)")
    parser.add_argument("--rate", type=float, default=5, metavar="HZ", help="its epochs (5)")
    parser.add_argument("--rtk", metavar="X,Y,Z|NAME", help="RTK: a base station at this position in the world [m], or the world's receiver of this name")
    parser.add_argument("--inject", action="store_true", help="the base's RTCM is sent through PX4, instead of the receiver's own radio")
    parser.add_argument("--start", default="2026-06-01T08:00:00Z", help="UTC at simulated time 0")
    parser.add_argument("--speed", type=float, default=1, metavar="F", help="speed relative to real time (1)")
    parser.add_argument("--settings", default="", metavar="XML", help="further elements of Canyon's plugin (docs/sdf.md)")
    parser.add_argument("--param", action="append", default=[], metavar="NAME=VALUE", help="a parameter of PX4; may be repeated")
    parser.add_argument("--stock", action="store_true", help=f"PX4's own parameters, without {' '.join(STREET_PARAMETERS)}")
    parser.add_argument("--takeoff", action="store_true", help="take off when PX4 is ready, and hover")
    parser.add_argument("--mission", metavar="FILE", help="fly waypoints (QGC WPL 110) or a plan of QGroundControl; each further vehicle 5 m higher")
    parser.add_argument("--seconds", type=float, default=math.inf, help="end after these seconds of simulated time (Ctrl-C)")
    parser.add_argument("--out", default="out/px4", metavar="DIR", help="folder for logs (out/px4)")
    parser.add_argument("--fault", action="append", nargs=2, default=[], metavar=("SECONDS", "FAULT"),
                        help="a fault that begins at this simulated time, such as 60 '{duration_s: 15, outage: {}}' (docs/faults.md)")
    parser.add_argument("--bridge", action="store_true",
                        help="PX4's usual method for comparison: its bridge reads the sensor's topic and sets accuracies")
    parser.add_argument("--gui", action="store_true", help="with Gazebo's window")
    parser.add_argument("--join", action="store_true",
                        help="only Gazebo's side: 'make px4_sitl gz_x500' in your own checkout then joins this world")
    a = parser.parse_args()
    if not 1 <= a.vehicles <= 9:
        parser.error(f"--vehicles is {a.vehicles}; give 1 to 9")
    if not 0 < a.rate <= 25:
        parser.error(f"--rate is {a.rate}; receivers have up to 25 Hz")
    if not 0.01 <= a.speed <= 100:
        parser.error(f"--speed is {a.speed}; give 0.01 to 100")
    if a.mission and a.takeoff:
        parser.error("--takeoff and --mission exclude each other: a mission begins with its own take-off")
    if a.join and (a.takeoff or a.mission or a.fault or a.vehicles > 1):
        parser.error("with --join you control PX4 with your own commands")
    a.pose = numbers(parser, "--pose", a.pose or (DOWNTOWN_POSE if a.world == DOWNTOWN else "0,0,0.3"))
    if a.rtk and "," in a.rtk:
        a.rtk = numbers(parser, "--rtk", a.rtk)
    if a.inject and not isinstance(a.rtk, list):
        parser.error("--inject needs its own base station: --rtk X,Y,Z")
    try:
        a.fault = sorted((float(seconds), fault) for seconds, fault in a.fault)
    except ValueError:
        parser.error("--fault needs a time in seconds and a fault, such as 60 '{duration_s: 15, outage: {}}'")
    for setting in a.param:
        if "=" not in setting:
            parser.error(f"--param {setting}: write NAME=VALUE")
    return a


def numbers(parser, option, text):
    try:
        values = [float(cell) for cell in text.split(",")]
        if len(values) == 3 and all(math.isfinite(value) for value in values):
            return values
    except ValueError:
        pass
    parser.error(f"{option} is '{text}'; give three numbers, X,Y,Z in metres")


def find_px4(given):
    """PX4's folder; ends the program with the reason if it is missing."""
    places = [given] if given else [os.environ.get("PX4_DIR"), os.path.expanduser("~/PX4-Autopilot"),
                                    os.path.join(HERE, "..", "..", "..", "..", "PX4-Autopilot")]
    for place in filter(None, places):
        if os.path.exists(os.path.join(place, "build/px4_sitl_default/bin/px4")):
            return os.path.abspath(place)
    named = given or os.environ.get("PX4_DIR")
    complain((f"{named} has no build/px4_sitl_default/bin/px4" if named else "PX4 was not found") + f"; {GET_PX4}")


def canyon_elements(a, has_parameter):
    """Canyon's plugin. Streams use the number at the end of the model's name for each vehicle's line, ports and position."""
    streams = [*([] if a.bridge else ["ubx=pty:/tmp/canyon-gps{number}?latency_s=0.1&amp;jitter_s=0.01"]),
               f"epochs_csv=udp://127.0.0.1:{EPOCHS // 10}{{number}}", f"view=tcp://127.0.0.1:{VIEW // 10}{{number}}"]
    more = ""
    if a.rtk:
        own = isinstance(a.rtk, list)
        if a.inject:
            streams.append(f"base/gps_rtcm_data=udp://127.0.0.1:{PX4_RTCM_PORT // 10}{{number}}?rate_hz=1&amp;latency_s=0.1&amp;link_baud=57600")
        else:
            more = f"<corrections><from>{'base' if own else a.rtk}</from><rate_hz>1</rate_hz><latency_s>0.2</latency_s></corrections>"
        more += "<rtk>true</rtk>"
        if own:
            east, north, up = a.rtk
            more += (f"<base><profile>ublox-f9p</profile><fixed><east_m>{east}</east_m>"
                     f"<north_m>{north}</north_m><up_m>{up}</up_m></fixed></base>")
    lines = "".join(f"<stream>{stream}</stream>" for stream in streams)
    return (f"<serve>all</serve><profile>{a.profile}</profile><rate_hz>{a.rate}</rate_hz><start>{a.start}</start>{more}"
            # Older releases of PX4 always use the sensor's own topic.
            f"<publishers><navsat>{'true' if has_parameter or a.bridge else 'false'}</navsat>{lines}</publishers>{a.settings}")


def px4_settings(a, has_parameter):
    """Parameters of PX4 as environment variables."""
    settings = [] if a.bridge or not has_parameter else ["SIM_GZ_EN_GPS=0"]    # older releases cannot disable it
    return dict(f"PX4_PARAM_{each}".split("=", 1) for each in settings + ([] if a.stock else list(STREET_PARAMETERS)) + a.param)


def join_lines(a, px4, has_parameter):
    """Commands for the user's own PX4 to join the running world: one line, and one in PX4's shell."""
    environment = {"PX4_GZ_MODEL_POSE": ",".join(f"{value:g}" for value in a.pose), **px4_settings(a, has_parameter)}
    make = " ".join([*(f"{name}={value}" for name, value in environment.items()), "make", "px4_sitl", f"gz_{a.model}"])
    return [f"cd {px4} && {make}"] + ([] if a.bridge else ["gps start -d /tmp/canyon-gps0 -p ubx"])


class Epochs:
    """Canyon's own record of a vehicle's receiver, rows of epochs.csv by UDP."""

    def __init__(self, port):
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.bind(("127.0.0.1", port))
        self.socket.setblocking(False)
        self.columns, self.rows = None, []

    def serve(self):
        while True:
            try:
                text = self.socket.recv(65536).decode(errors="replace")
            except OSError:
                return
            for line in text.splitlines():
                cells = line.split(",")
                if "gps_tow" in cells:
                    self.columns = cells
                elif self.columns and len(cells) == len(self.columns):
                    self.rows.append(dict(zip(self.columns, cells)))


class Vehicle:
    def __init__(self, number, px4, folder, children):
        self.number, self.px4, self.folder, self.children = number, px4, folder, children
        self.epochs = Epochs(EPOCHS + number)
        self.link = mavlink_link.Link(HERE_PORT + number, PX4_PORT + number)
        self.child, self.told = None, 0

    def start(self, a, world, has_parameter):
        os.makedirs(self.folder)
        x, y, z = a.pose
        environment = dict(os.environ, PX4_GZ_STANDALONE="1", PX4_GZ_WORLD=world, PX4_SIM_MODEL=f"gz_{a.model}",
                           PX4_GZ_MODELS=os.path.join(self.px4, "Tools/simulation/gz/models"), PX4_GZ_NO_FOLLOW="1",
                           PX4_GZ_MODEL_POSE=f"{x + 4 * self.number},{y},{z}")
        if a.speed != 1:
            environment["PX4_SIM_SPEED_FACTOR"] = f"{a.speed:g}"
        environment.update(px4_settings(a, has_parameter))
        build = os.path.join(self.px4, "build/px4_sitl_default")
        # PX4's GPS driver sets the machine's clock to the receiver's time if permitted.
        guard = ["setpriv", "--bounding-set", "-sys_time", "--inh-caps", "-sys_time"] if os.geteuid() == 0 else []
        self.child = self.children.start(f"px4_{self.number}", *guard, os.path.join(build, "bin/px4"), "-d", "-i",
                                         str(self.number), os.path.join(build, "etc"), cwd=self.folder, env=environment)
        wait_until(lambda: "Startup script returned" in self.log(), "PX4 has started", 120, self.child)
        if "Startup script returned successfully" not in self.log():
            complain(f"PX4 did not start; see {self.child.log}")
        if not a.bridge:
            self.run("gps", "start", "-d", f"/tmp/canyon-gps{self.number}", "-p", "ubx")
        self.run("mavlink", "start", "-x", "-u", str(PX4_PORT + self.number), "-o", str(HERE_PORT + self.number), "-m",
                 "onboard", "-r", "100000")

    def log(self):
        with open(self.child.log, errors="replace") as file:
            return file.read()

    def run(self, command, *words):
        """A command of PX4's shell."""
        done = subprocess.run([os.path.join(self.px4, "build/px4_sitl_default/bin", f"px4-{command}"), "--instance",
                               str(self.number), *words], cwd=self.folder, capture_output=True, text=True, timeout=30,
                              stdin=subprocess.DEVNULL)
        if done.returncode != 0:
            complain(f"PX4 rejected '{command} {' '.join(words)}': {(done.stdout + done.stderr).strip()}; see {self.child.log}")

    @property
    def system(self):
        return self.number + 1

    def serve(self):
        self.epochs.serve()
        self.link.serve()

    def say_news(self, several):
        for text in self.link.texts[self.told:]:
            say(f"          {f'{self.number}: ' if several else ''}{text}")
        self.told = len(self.link.texts)


def week_second(start):
    """Second of the GPS week of a time of UTC; 18 leap seconds since 2017."""
    try:
        utc = datetime.datetime.fromisoformat(start.replace("Z", "+00:00"))
    except ValueError:
        complain(f"--start is '{start}'; write a time of UTC such as 2026-06-01T08:00:00Z")
    since = utc - datetime.datetime(1980, 1, 6, tzinfo=datetime.timezone.utc)
    return (since.total_seconds() + 18) % 604800


def cell(value, layout, scale=1.0):
    return format(value * scale, layout) if value is not None else " " * int(layout.split(".")[0])


def row_of(vehicle, several):
    """A line of the table: the receiver's result in Canyon's record, and PX4's results."""
    epoch, link = vehicle.epochs.rows[-1], vehicle.link.latest
    number = lambda name: float(epoch[name]) if epoch[name] else None
    east, north = number("error_east_m"), number("error_north_m")
    sigma = [number("sigma_east_m"), number("sigma_north_m")]
    gps, estimate = link.get("GPS_RAW_INT", {}), link.get("ESTIMATOR_STATUS", {})
    kind = KINDS[gps["fix_type"]] if gps.get("fix_type", 99) < len(KINDS) else ""
    has_accuracy = gps.get("fix_type", 0) > 1
    return ((f"{vehicle.number:7d}  " if several else "") +
            cell(None if east is None else math.hypot(east, north), "9.1f") + cell(number("error_up_m"), "8.1f") +
            cell(None if sigma[0] is None else math.hypot(*sigma), "12.1f") + f"  {kind:>7}" +
            cell(gps.get("satellites_visible"), "6.0f") + cell(gps["h_acc"] if has_accuracy else None, "9.1f", 1e-3) +
            cell(gps["eph"] if has_accuracy and gps["eph"] != 65535 else None, "7.1f", 0.01) +
            cell(estimate.get("pos_horiz_accuracy"), "9.1f") + cell(estimate.get("pos_horiz_ratio"), "7.2f") +
            ("   armed" if vehicle.link.armed else ""))


def print_head(several):
    headline("Once per second: the receiver (fix minus truth, and its reported sigma), PX4's GPS, PX4's estimator (EKF2)")
    say(f"{'time [s]':>9}  " + (f"{'vehicle':>7}  " if several else "") +
        f"{'error [m]':>9}{'up [m]':>8}{'stated [m]':>12}  {'fix':>7}{'sats':>6}{'eph [m]':>9}{'HDOP':>7}{'eph [m]':>9}{'ratio':>7}")


class Pilot:
    """Makes a vehicle take off or fly its mission when PX4 is ready; repeats the command while PX4 rejects it."""

    def __init__(self, vehicle, a):
        self.vehicle, self.takeoff, self.items, self.uploaded, self.flies = vehicle, a.takeoff, [], False, False
        self.was_armed, self.place, self.moved_s = False, None, 0.0
        if a.mission:
            try:
                self.items = mavlink_link.read_mission(a.mission, (lambda _: None) if vehicle.number else say)
                for item in self.items:
                    item["z"] += 5 * vehicle.number if item["z"] and item["frame"] != mavlink_link.MISSION_FRAME else 0
            except (OSError, ValueError) as error:
                complain(str(error))

    def step(self):
        link, system = self.vehicle.link, self.vehicle.system
        gps = link.latest.get("GPS_RAW_INT", {})
        if self.flies or not (self.items or self.takeoff) or gps.get("fix_type", 0) < 3 or not link.texts:
            return
        if not any("Ready for takeoff" in text for text in link.texts + [self.vehicle.log()]):
            return
        if self.items and not self.uploaded:
            self.uploaded = link.upload(self.items, system)
            if not self.uploaded:
                complain("PX4 did not accept the mission; see its log")
        mode = (4, 4) if self.items else (4, 2)    # PX4's main mode auto, sub mode mission or take-off
        if link.command(mavlink_link.DO_SET_MODE, system, 1, *mode) != 0:
            return
        self.flies = link.command(mavlink_link.COMPONENT_ARM_DISARM, system, 1) == 0

    def has_flown(self, now):
        """Whether it has disarmed after a flight, or has crashed: no motion for half a minute."""
        epoch, degrees = self.vehicle.epochs.rows[-1], ("true_latitude_deg", "true_longitude_deg")
        place = [float(epoch[name]) for name in degrees] + [float(epoch["true_height_m"]) * 1e-5]
        self.was_armed = self.was_armed or self.vehicle.link.armed
        if self.place is None or math.dist(place, self.place) > 1e-5 or not self.was_armed:    # about 1 m
            self.place, self.moved_s = place, now
        return self.was_armed and (not self.vehicle.link.armed or now - self.moved_s > 30)


def add_fault(world, fault):
    """Requests a fault for all receivers of the world."""
    text = fault.replace("\\", "\\\\").replace('"', '\\"')
    done = subprocess.run(["gz", "service", "-s", f"/world/{world}/canyon/add_fault", "--reqtype", "gz.msgs.StringMsg", "--reptype",
                           "gz.msgs.StringMsg", "--timeout", "5000", "--req", f'data: "{text}"'],
                          capture_output=True, text=True, timeout=30, stdin=subprocess.DEVNULL)
    say(f"          {fault}: {done.stdout.strip() or done.stderr.strip()}")


def watch(a, world, vehicles, server):
    several, faults = len(vehicles) > 1, list(a.fault)
    pilots = [Pilot(vehicle, a) for vehicle in vehicles]
    print_head(several)
    zero = week_second(a.start)
    first, shown, had_fix, begin = None, -1, False, time.monotonic()
    while True:
        for vehicle in vehicles:
            vehicle.serve()
            if vehicle.child.poll() is not None:
                complain(f"PX4 ended (status {vehicle.child.returncode}); see {vehicle.child.log}")
        if server.poll() is not None:
            complain(f"gz sim ended (status {server.returncode}); see {server.log}")
        rows = [vehicle.epochs.rows for vehicle in vehicles]
        if not all(rows):
            if time.monotonic() > begin + 60:
                complain(f"no epoch received from Canyon's receivers within a minute; see {server.log}")
            time.sleep(0.05)
            continue
        now = (float(rows[0][-1]["gps_tow"]) - zero) % 604800
        first = now if first is None else first
        if math.floor(now) > shown:
            shown = math.floor(now)
            for vehicle in vehicles:
                vehicle.say_news(several)
                say(f"{now:9.1f}  " + row_of(vehicle, several))
                had_fix = had_fix or vehicle.link.latest.get("GPS_RAW_INT", {}).get("fix_type", 0) >= 3
            for pilot in pilots:
                pilot.step()
            while faults and now >= faults[0][0]:
                add_fault(world, faults.pop(0)[1])
        is_flown = a.mission and flown(pilots, now)
        if is_flown or now - first >= a.seconds:
            say(f"\n{'the mission has ended: ' if is_flown else ''}{now - first:.1f} s of simulated time, "
                f"{(now - first) / (time.monotonic() - begin):.2f} times real time")
            return 0 if had_fix else 1
        time.sleep(0.02)


def flown(pilots, now):
    """Whether all have disarmed after a flight, or have crashed."""
    return all([pilot.has_flown(now) for pilot in pilots])


FLIGHT = ("time_s", "true_latitude_deg", "true_longitude_deg", "true_height_m", "placement", "fix_error_m", "fix_error_up_m",
          "fix_stated_m", "used", "px4_fix_type", "px4_satellites", "px4_eph_m", "px4_hdop", "estimate_error_m",
          "estimate_error_up_m", "estimate_eph_m", "estimate_ratio", "armed")


def flight_of(vehicle, zero):
    """Rows of FLIGHT, one for each epoch of the receiver, with PX4's newest messages of that time."""
    def newest(name, now):
        times, values = vehicle.link.kept[name]
        at = bisect.bisect_right(times, now)
        return values[at - 1] if at and now - times[at - 1] < 2 else None

    def estimate(now):
        times, values = vehicle.link.kept["GLOBAL_POSITION_INT"]
        at = bisect.bisect_left(times, now)
        if not 0 < at < len(times) or times[at] - times[at - 1] > 0.5:
            return None
        part = (now - times[at - 1]) / (times[at] - times[at - 1])
        before, after = values[at - 1], values[at]
        return [(before[key] + part * (after[key] - before[key])) * unit for key, unit in (("lat", 1e-7), ("lon", 1e-7), ("alt", 1e-3))]

    rows = []
    for epoch in vehicle.epochs.rows:
        now = (float(epoch["gps_tow"]) - zero) % 604800
        truth = [float(epoch[f"true_{key}"]) for key in ("latitude_deg", "longitude_deg", "height_m")]
        size = lambda *names: math.hypot(*(float(epoch[name]) for name in names)) if epoch[names[0]] else ""
        gps, status, place = newest("GPS_RAW_INT", now), newest("ESTIMATOR_STATUS", now), estimate(now)
        has_fix = gps is not None and gps["fix_type"] > 1
        error = up = ""
        if place is not None and place[0] != 0:
            per_deg = math.radians(6371e3)
            error = math.hypot((place[0] - truth[0]) * per_deg, (place[1] - truth[1]) * per_deg * math.cos(math.radians(truth[0])))
            up = place[2] - truth[2]
        rows.append(dict(zip(FLIGHT, (
            now, *truth, epoch["placement"], size("error_east_m", "error_north_m"), epoch["error_up_m"],
            size("sigma_east_m", "sigma_north_m"), epoch["used"], gps["fix_type"] if gps else "",
            gps["satellites_visible"] if gps else "", gps["h_acc"] * 1e-3 if has_fix else "", gps["eph"] * 0.01 if has_fix else "",
            error, up, status["pos_horiz_accuracy"] if status else "", status["pos_horiz_ratio"] if status else "",
            int(vehicle.link.armed_at(now))))))
    return rows


def figures(values):
    values = sorted(float(value) for value in values if value != "")
    if not values:
        return "none"
    at = lambda share: values[min(len(values) - 1, round(share * (len(values) - 1)))]
    return f"{at(0.5):.1f}, {at(0.95):.1f}, {values[-1]:.1f} m"


def summarise(a, vehicles):
    """Writes the record of each flight, complete also after an interruption, and prints its metrics."""
    for vehicle in vehicles:
        if not vehicle.epochs.rows:
            continue
        rows = flight_of(vehicle, week_second(a.start))
        path = os.path.join(a.out, f"flight_{vehicle.number}.csv")
        with open(path, "w", newline="") as file:
            writer = csv.DictWriter(file, FLIGHT, lineterminator="\n")
            writer.writeheader()
            writer.writerows({key: round(value, 7) if isinstance(value, float) else value for key, value in row.items()} for row in rows)
        air = [row for row in rows if row["armed"]] or rows
        column = lambda name: [row[name] for row in air if row[name] != ""]
        inside = sum(row["placement"] == "inside building" for row in air)
        headline(f"Vehicle {vehicle.number}{' while armed' if air is not rows else ''} (median, 95 %, largest)")
        say(f"fix         {figures(column('fix_error_m'))} off, states {figures(column('px4_eph_m'))}")
        say(f"estimate    {figures(column('estimate_error_m'))} off, states {figures(column('estimate_eph_m'))}; "
            f"largest test ratio {max(map(float, column('estimate_ratio')), default=math.nan):.2f}")
        say(f"no fix      {sum(row['px4_fix_type'] in ('', 0, 1) for row in air)} of {len(air)} epochs"
            + (f"; inside a building {inside}" if inside else ""))
        say(f"record      {path}")


def end_once(*_):
    """A second signal does not prevent the first from ending the started programs."""
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    sys.exit(143)


def main():
    a = arguments()
    if shutil.which("gz") is None or subprocess.run(["gz", "sim", "--versions"], capture_output=True, check=False).returncode != 0:
        complain("Gazebo Sim was not found: install gz-harmonic (https://gazebosim.org/docs/harmonic/install)")
    px4 = find_px4(a.px4)
    build = os.path.abspath(a.build)
    a.out = os.path.abspath(a.out)
    shutil.rmtree(a.out, ignore_errors=True)
    os.makedirs(a.out)
    put_first("GZ_SIM_SYSTEM_PLUGIN_PATH", os.path.join(build, "lib"), os.path.join(px4, "build/px4_sitl_default/src/modules/simulation/gz_plugins"))
    put_first("GZ_DESCRIPTOR_PATH", os.path.join(build, "share/canyon/protos"))
    put_first("GZ_SIM_RESOURCE_PATH", *(os.path.join(px4, "Tools/simulation/gz", kind) for kind in ("models", "worlds")))
    with open(os.path.join(px4, "build/px4_sitl_default/parameters.json")) as file:
        has_parameter = any(parameter["name"] == "SIM_GZ_EN_GPS" for parameter in json.load(file)["parameters"])
    world = os.path.join(a.out, "world.sdf")
    try:
        name = world_file.prepare(a.world, world, os.path.join(px4, "src/modules/simulation/gz_bridge/server.config"),
                                  canyon_elements(a, has_parameter), ("car",) if a.world == DOWNTOWN else ())
    except ValueError as error:
        complain(str(error))
    signal.signal(signal.SIGTERM, end_once)
    with Children(a.out) as children:
        vehicles = [] if a.join else [Vehicle(i, px4, os.path.join(a.out, f"px4_{i}"), children) for i in range(a.vehicles)]
        try:
            say(f"starting    Gazebo Sim{'' if a.join else ' and PX4'}; the first start of a world takes longer")
            server = children.start("gz_sim", "gz", "sim", "-r", "-v", "3", *([] if a.gui else ["-s"]), world)
            if a.join:
                say("\n".join(f"{who:11} {line}" for who, line in zip(("terminal 2", "PX4's shell"), join_lines(a, px4, has_parameter))))
                return server.wait()
            for vehicle in vehicles:
                vehicle.start(a, name, has_parameter)
            if os.path.exists(os.path.join(HERE, "../../../viewer/dist/viewer.html")):
                viewer = children.start("viewer", os.path.join(build, "bin/canyon"), "view", world,
                                        *(word for v in vehicles for word in ("--live", f"tcp://127.0.0.1:{VIEW + v.number}")))
                wait_until(lambda: "http://" in open(viewer.log).read(), "the viewer serves", 60, viewer)
                address = next(word for word in open(viewer.log).read().split() if word.startswith("http://"))
                say(f"viewer      {address}")
            say(f"world       {world}\nlogs        {a.out}\nground      QGroundControl finds the vehicles automatically (UDP 14550)")
            return watch(a, name, vehicles, server)
        finally:
            for vehicle in vehicles:
                vehicle.serve()
                vehicle.link.close()
            summarise(a, vehicles)


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
