"""Parts of the simulators' example drives: child processes, the truth of a drive, its world, a table of fixes."""
import argparse
import bisect
import csv
import math
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import time

import yaml

PROGRAM = os.path.splitext(os.path.basename(sys.argv[0]))[0]    # prefix of messages
WGS84_A, WGS84_E2 = 6378137.0, 6.69437999014e-3


def say(text):
    print(text, flush=True)


def headline(text):
    say(f"\n\033[1m{text}\033[0m")


class Children:
    """Programs that always end with this one: by their process id, first with a gentle signal."""

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


def put_first(variable, *folders):
    """Prepends folders to a path of the environment, each once: Gazebo warns about messages that it reads twice."""
    every = (*folders, *os.environ.get(variable, "").split(os.pathsep))
    os.environ[variable] = os.pathsep.join(dict.fromkeys(filter(None, every)))


def wait_until(condition, what, seconds, child=None):
    deadline = time.monotonic() + seconds
    while not condition():
        if child is not None and child.poll() is not None:
            raise SystemExit(f"{PROGRAM}: {os.path.splitext(os.path.basename(child.log))[0]} ended (status {child.returncode}) before {what}; see {child.log}")
        if time.monotonic() > deadline:
            raise SystemExit(f"{PROGRAM}: {what}: not within {seconds:.0f} s" + (f"; see {child.log}" if child else ""))
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
    """The car's position: rows of GPS week, tow [s], latitude, longitude [deg], height [m]. Times count from `begin_s` of
    the drive; by default from shortly before the car first moves."""

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
        """Fix minus truth, east, north, up [m]: with the local radii of curvature, accurate to 0.1 % within 10 km."""
        latitude, longitude, height = self.at(seconds)
        sine = math.sin(math.radians(latitude))
        normal = WGS84_A / math.sqrt(1 - WGS84_E2 * sine * sine)
        meridian = normal * (1 - WGS84_E2) / (1 - WGS84_E2 * sine * sine)
        east = math.radians(longitude_deg - longitude) * (normal + height) * math.cos(math.radians(latitude))
        return east, math.radians(latitude_deg - latitude) * (meridian + height), height_m - height


def elements(value):
    """YAML as elements: a mapping is nested, a list repeated."""
    text = ""
    for key, item in value.items():
        for one in item if isinstance(item, list) else [item]:
            inner = elements(one) if isinstance(one, dict) else str(one).lower() if isinstance(one, bool) else str(one)
            text += f"<{key}>{inner}</{key}>"
    return text


def write_world(folder, truth, vehicle, words, systems=""):
    """The prepared city of `folder` with the vehicle of a template, words between @ replaced; `systems` are
    further elements of the world. Returns the file's path."""
    name = os.path.basename(folder.rstrip("/"))
    trajectory = os.path.join(folder, "drive.csv")
    with open(trajectory, "w") as file:
        csv.writer(file, lineterminator="\n").writerows(truth.rows)
    sky = yaml.safe_load(pathlib.Path(folder, "reference.yaml").read_text())["sky"]
    text = pathlib.Path(vehicle).read_text()
    for word, value in {"SKY": elements(sky), "WEEK": truth.week, "TOW": truth.tow, "TRAJECTORY": trajectory,
                        **words}.items():
        text = text.replace(f"@{word}@", str(value))
    model = text[text.index("<model"):text.rindex("</sdf>")]
    world = pathlib.Path(folder, f"{name}.world").read_text()
    path = pathlib.Path(folder, "drive.world")
    path.write_text(world.replace("</world>", f"{systems}{model}</world>"))
    return str(path)


def arguments_of(usage):
    parser = argparse.ArgumentParser(usage=usage)
    parser.add_argument("folder")
    parser.add_argument("build")
    parser.add_argument("--seconds", type=float, default=20, help="of simulated time (20)")
    parser.add_argument("--from", type=float, dest="begin_s", help="seconds into the drive (when the car first moves)")
    parser.add_argument("--gui", action="store_true", help="with Gazebo's window")
    arguments = parser.parse_args()
    if not arguments.seconds > 0:
        parser.error("--seconds must be above 0")
    return arguments


class FixTable:
    """Fixes, once per second of simulated time, with their errors."""

    def __init__(self, topic, truth):
        self.truth = truth
        headline(f"{topic}, once per second (errors: fix minus truth)")
        say(f"{'time [s]':>8}  {'latitude':>11}  {'longitude':>11}  {'height [m]':>10}  {'received':>8}  {'blocked':>7}"
            f"  {'sigma [m]':>9}  {'east [m]':>8}  {'north [m]':>9}  {'up [m]':>8}")

    def row(self, seconds, received, blocked, fix):
        """`fix`: latitude, longitude [deg], height [m], horizontal sigma [m]; None: no fix."""
        line = f"{seconds:8.1f}  "
        tally = f"{received:8d}  {blocked:7d}  "
        if fix is None:
            say(line + f"{'no fix':>11}  {'':>11}  {'':>10}  " + tally)
        else:
            latitude, longitude, height, sigma = fix
            east, north, up = self.truth.error(seconds, latitude, longitude, height)
            say(line + f"{latitude:11.7f}  {longitude:11.7f}  {height:10.2f}  " + tally +
                f"{sigma:9.1f}  {east:8.1f}  {north:9.1f}  {up:8.1f}")


def print_notes(gzserver):
    """The plugins' messages on Gazebo's console, without its colours."""
    with open(gzserver.log, errors="replace") as file:
        lines = [re.sub(r"\x1b\[[0-9;]*m", "", line) for line in file]
    notes = [line[line.index("[canyon] ") + 9:].strip() for line in lines if "[canyon] " in line and "not defined in SDF" not in line]
    if notes:
        headline("The plugins' notes")
        say("\n".join(notes))
