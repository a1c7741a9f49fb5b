"""The common part of the bridges of this folder: options, frames, poses to `canyon live`, and its fixes. Needs only the standard library.

    simulator -> pose -> bridge -> JSON over UDP -> canyon live -> epochs.csv over TCP -> bridge -> fix -> simulator

Both connections have the same port number (town.yaml). Lengths are metres, times seconds of the simulator's clock.
A frame is three letters, the directions of x, y and z: E, W, N, S, U or D. ROS has ENU, PX4 NED, and CARLA ESU,
which is left-handed. The frame's origin is the city's (`--origin`), moved by `--at`.
"""
import argparse
import collections
import csv
import importlib
import json
import math
import os
import select
import socket
import sys
import time

AXES = {"E": (0, 1), "W": (0, -1), "N": (1, 1), "S": (1, -1), "U": (2, 1), "D": (2, -1)}  # index in ENU, sign
WGS84_A_M, WGS84_E2 = 6378137.0, 6.69437999014e-3
CANYON, ORIGIN = "127.0.0.1:9001", (22.3, 114.17, 0.0)  # as in town.yaml

# Position, velocity and place (latitude and longitude [deg], height [m]) are None without a fix. Position and velocity
# are in the simulator's frame, sigma_enu_m are the standard deviations east, north and up reported by the receiver.
Fix = collections.namedtuple("Fix", "gps_week gps_tow_s kind reason position_m velocity_mps place sigma_enu_m used")


class BridgeError(Exception):
    """An error that ends a bridge, in one line for the user."""


def three_numbers(text):
    try:
        x, y, z = map(float, text.split(","))
    except ValueError as error:
        raise argparse.ArgumentTypeError(f"'{text}' is not three numbers with commas between them") from error
    return x, y, z


def host_port(text):
    host, colon, port = text.rpartition(":")
    if not (host and port.isdigit() and int(port) < 65536):
        raise argparse.ArgumentTypeError(f"'{text}' is not HOST:PORT")
    return host, int(port)


def frame(text):
    if sorted(AXES.get(letter, (3,))[0] for letter in text) != [0, 1, 2]:
        raise argparse.ArgumentTypeError(f"'{text}' is not a frame: give three of E, W, N, S, U, D, such as ENU")
    return text


def positive(text):
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not 0 < value < math.inf:
        raise argparse.ArgumentTypeError(f"'{text}' is not a number above 0")
    return value


def parser(doc, axes="ENU"):
    """An argument parser with the options of every bridge. `doc` is the bridge's docstring, `axes` its frame."""
    result = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    add = result.add_argument_group("canyon live").add_argument
    add("--canyon", type=host_port, default=CANYON, metavar="HOST:PORT",
        help="address of canyon live: UDP for poses, TCP for fixes (%(default)s)")
    add("--origin", type=three_numbers, default=ORIGIN, metavar="LAT,LON,HEIGHT",
        help="city.origin of its scenario (that of town.yaml: 22.3,114.17,0)")
    add("--at", type=three_numbers, default=(0.0, 0.0, 0.0), metavar="EAST,NORTH,UP",
        help="position of the simulator's origin in the city [m] (0,0,0); --at=-10,0,2 if it begins with a minus")
    add("--axes", type=frame, default=axes, help="directions of the simulator's x, y and z (%(default)s)")
    add("--rate", type=positive, default=50.0, metavar="HZ", help="maximum poses per second of the simulator's clock (50)")
    add("--wait", type=positive, default=30.0, metavar="S", help="time to wait for canyon live (30)")
    add("--check", type=positive, metavar="SECONDS",
        help="drive the vehicle for this time, compare clock, axes, units, attitude and origin, report differences, and end")
    add("--fixes-to", type=host_port, metavar="HOST:PORT", help="also send fixes there, as JSON in UDP datagrams")
    return result


def need(module, cure):
    """The module of a simulator. Raises BridgeError with `cure` if it is missing."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise BridgeError(f"{error}. {cure}") from error


def run(main):
    """Runs a bridge's main(): one line for an error, and a quiet end by Ctrl-C or a closed pipe."""
    try:
        sys.exit(main())
    except BridgeError as error:
        sys.exit(f"{os.path.basename(sys.argv[0])}: {error}")
    except KeyboardInterrupt:
        sys.exit(130)
    except BrokenPipeError:
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(1)


def enu_from(axes, vector):
    """Vector of the frame `axes` as east, north, up."""
    enu = [0.0, 0.0, 0.0]
    for letter, value in zip(axes, vector):
        index, sign = AXES[letter]
        enu[index] = sign * float(value)
    return enu


def frame_from_enu(axes, enu):
    """Rounded to 0.1 mm."""
    return [round(AXES[letter][1] * enu[AXES[letter][0]], 4) for letter in axes]


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def rotated(w, x, y, z, vector):
    """`vector` rotated by a quaternion, in a right-handed frame."""
    t = [2 * each for each in cross((x, y, z), vector)]
    return [v + w * a + b for v, a, b in zip(vector, t, cross((x, y, z), t))]


def quaternion(forward, up):
    """Quaternion w, x, y, z from a body's axes (x forward, y left, z up) to ENU, from its unit vectors forward and up in ENU."""
    (a, d, g), (b, e, h), (c, f, i) = forward, cross(up, forward), up
    squares = [1 + a + e + i, 1 + a - e - i, 1 - a + e - i, 1 - a - e + i]
    largest = squares.index(max(squares))
    q = [(squares[0], h - f, c - g, d - b), (h - f, squares[1], b + d, c + g),
         (c - g, b + d, squares[2], f + h), (d - b, c + g, f + h, squares[3])][largest]
    return [each / (2 * math.sqrt(squares[largest])) for each in q]


def ecef_from(latitude_deg, longitude_deg, height_m):
    """WGS 84 (NIMA TR8350.2, 4.3)."""
    latitude, longitude = math.radians(latitude_deg), math.radians(longitude_deg)
    n = WGS84_A_M / math.sqrt(1 - WGS84_E2 * math.sin(latitude) ** 2)
    return ((n + height_m) * math.cos(latitude) * math.cos(longitude),
            (n + height_m) * math.cos(latitude) * math.sin(longitude), (n * (1 - WGS84_E2) + height_m) * math.sin(latitude))


def enu_from_place(place, origin):
    """East, north, up of `place` in the tangent plane at `origin`, both latitude, longitude [deg], height [m]."""
    x, y, z = (a - b for a, b in zip(ecef_from(*place), ecef_from(*origin)))
    (sa, ca), (so, co) = ((math.sin(math.radians(deg)), math.cos(math.radians(deg))) for deg in origin[:2])
    return [co * y - so * x, ca * z - sa * (co * x + so * y), ca * (co * x + so * y) + sa * z]


class Bridge:
    """A connection to `canyon live`. Waits for it for `wait_s`; then raises BridgeError."""

    def __init__(self, canyon=host_port(CANYON), origin=ORIGIN, at=(0, 0, 0), axes="ENU", rate_hz=50, wait_s=30,
                 fixes_to=None, check_s=None):
        """@param check_s seconds after which checked() gets the report of a bridge_check.Check"""
        self._check = importlib.import_module("bridge_check").Check(check_s) if check_s else None
        self.canyon, self.origin, self.at, self.axes, self.fixes_to = canyon, origin, at, axes, fixes_to
        self._interval_s, self._sent_s, self._sent_enu = 1 / rate_hz, None, None
        self._names, self._rest, self._warned = None, "", False
        self._udp = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._tcp = self._connect(wait_s)

    @classmethod
    def of(cls, arguments):
        """A bridge with the arguments that parser() parsed."""
        return cls(arguments.canyon, arguments.origin, arguments.at, arguments.axes, arguments.rate, arguments.wait,
                   arguments.fixes_to, arguments.check)

    def _connect(self, wait_s):
        end = time.monotonic() + wait_s
        while True:
            try:
                return socket.create_connection(self.canyon, timeout=5)
            except OSError as error:
                if time.monotonic() >= end:
                    raise BridgeError("canyon live does not listen at tcp://%s:%d (%s). Start it first: "
                                      "canyon live examples/bridges/town.yaml" % (*self.canyon, error)) from error
                time.sleep(0.2)

    def send(self, time_s, position=None, velocity=None, forward=None, up=None, place=None):
        """Sends a pose, unless the last one is less than 1/rate old.

        @param time_s    simulator's clock; a time that goes back begins a new run
        @param position  in the simulator's frame; or `place`: latitude, longitude [deg], height [m]
        @param velocity  in the frame's axes; with `place` in ENU, as `forward` and `up`, the body's unit vectors
        """
        if self._sent_s is not None and 0 <= time_s - self._sent_s < self._interval_s * 0.999:
            return
        self._sent_s, axes = time_s, "ENU" if place else self.axes
        pose = {"time_s": time_s}
        if place:
            pose.update(zip(("latitude_deg", "longitude_deg", "height_m"), map(float, place)))
        else:
            self._sent_enu = pose["position_m"] = [a + b for a, b in zip(enu_from(axes, position), self.at)]
        if velocity is not None:
            pose["velocity_mps"] = enu_from(axes, velocity)
        if forward is not None:
            pose["attitude"] = quaternion(enu_from(axes, forward), enu_from(axes, up))
        self._udp.sendto((json.dumps(pose) + "\n").encode(), self.canyon)
        if self._check:
            enu = enu_from_place(place, self.origin) if place else self._sent_enu
            body = [each is not None and enu_from(axes, each) or None for each in (forward, up)]
            self._check.pose(time_s, enu, pose.get("velocity_mps"), *body)
            if self._check.done:
                text, good = self._check.report()
                self._check = None
                self.checked(text, good)

    def checked(self, text, good):
        """Prints the report of --check, and ends the program: 0 if nothing differs."""
        print(text, flush=True)
        sys.exit(0 if good else 1)

    @property
    def checks(self):
        """Whether a check is running, which uses state_place()."""
        return self._check is not None

    def state_place(self, place, position):
        """Passes the simulator's own latitude, longitude [deg] and height [m] of a position to a check."""
        if self._check:
            self._check.stated([a + b for a, b in zip(enu_from(self.axes, position), self.at)],
                               enu_from_place(place, self.origin))

    def fixes(self, wait_s=0.0):
        """The fixes received since the last call, oldest first; waits up to `wait_s` for one. Raises BridgeError if
        canyon live has ended."""
        found = []
        while select.select([self._tcp], [], [], wait_s)[0]:
            try:
                received = self._tcp.recv(65536)
            except ConnectionError:
                received = b""
            if not received:
                raise BridgeError("canyon live has ended")
            *lines, self._rest = (self._rest + received.decode()).split("\n")
            for cells in csv.reader(lines):
                if self._names is None:
                    self._names = cells
                else:
                    found.append(self._fix(dict(zip(self._names, cells))))
            wait_s = 0.0
        return found

    def _fix(self, row):
        def values(*names):
            return [float(row[name]) for name in names] if all(row[name] for name in names) else None

        truth = values("true_latitude_deg", "true_longitude_deg", "true_height_m")
        self._check_origin(truth)
        place = values("fix_latitude_deg", "fix_longitude_deg", "fix_height_m")
        velocity = values("fix_velocity_east_mps", "fix_velocity_north_mps", "fix_velocity_up_mps")
        if self._check:
            self._check.fix(truth and enu_from_place(truth, self.origin), place is not None)
        position = place and [a - b for a, b in zip(enu_from_place(place, self.origin), self.at)]
        return Fix(int(row["gps_week"]), float(row["gps_tow"]), row["fix_kind"], row["reason"] or None,
                   position and frame_from_enu(self.axes, position), velocity and frame_from_enu(self.axes, velocity), place,
                   values("sigma_east_m", "sigma_north_m", "sigma_up_m"), int(row["used"]))

    def _check_origin(self, truth):
        if truth is None or self._sent_enu is None or self._warned:
            return
        off_m = math.dist(enu_from_place(truth, self.origin), self._sent_enu)
        if off_m > 1000:  # an airliner moves 300 m in a second
            self._warned = True
            print("warning: canyon live has the vehicle %.0f m from its pose: set --origin to the scenario's city.origin"
                  % off_m, file=sys.stderr)

    def report(self, fix):
        """Prints a fix as a line of JSON, and sends it to `fixes_to`."""
        line = json.dumps({name: value for name, value in fix._asdict().items() if value is not None})
        print(line, flush=True)
        if self.fixes_to:
            self._udp.sendto(line.encode() + b"\n", self.fixes_to)

    def report_all(self):
        for fix in self.fixes():
            self.report(fix)
