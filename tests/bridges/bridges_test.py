#!/usr/bin/env python3
"""The bridges of examples/bridges between mocks of their simulators and a real `canyon live`.

usage: tests/bridges/bridges_test.py CANYON [unittest's options]

Every stand-in drives the same way over a made-up town: east, north, up (mocks/course.py). The receiver is ideal and
has a lever arm, so that fixes depend on the attitude too. Fixes must be on that path in the simulator's own frame, and must
reach every corner of it. All sockets are on 127.0.0.1, and every process is ended by its id.
"""
import json
import math
import os
import pathlib
import re
import signal
import socket
import subprocess
import sys
import tempfile
import time
import unittest

HERE = pathlib.Path(__file__).resolve().parent
BRIDGES = HERE.parents[1] / "examples" / "bridges"
STAND_INS = HERE / "mocks"
sys.dont_write_bytecode = True
sys.path[:0] = [str(STAND_INS), str(BRIDGES)]
import bridge_check  # noqa: E402
import canyon_bridge  # noqa: E402
import course  # noqa: E402

LONGEST_S = 120
NEAR_M = 0.05  # of a fix from the path: the receiver is ideal; HIL_GPS has steps of 1 cm
ORIGIN = course.ORIGIN
LEVER = (4.0, 3.0, 2.0)  # forward, left, up

# The town of the examples, with an ideal receiver on a lever arm.
TOWN = (BRIDGES / "town.yaml").read_text()
SCENARIO = TOWN.replace("ublox-m10", "ideal, lever_arm: {forward_m: %g, left_m: %g, up_m: %g}" % LEVER)


def antenna(place):
    """The antenna's position for a position of the vehicle, in ENU, with the attitude of the course."""
    return [p + sum(length * axis[i] for length, axis in zip(LEVER, course.axes())) for i, p in enumerate(place)]


def enu_of(latitude, longitude, height):
    """Accurate to a millimetre within 100 m of the origin."""
    north_m, east_m = course.radii()
    return [math.radians(longitude - ORIGIN[1]) * east_m, math.radians(latitude - ORIGIN[0]) * north_m, height - ORIGIN[2]]


def distance_to_leg(point, a, b):
    way = [q - p for p, q in zip(a, b)]
    part = sum((x - p) * w for x, p, w in zip(point, a, way)) / sum(w * w for w in way)
    return math.dist(point, [p + min(max(part, 0.0), 1.0) * w for p, w in zip(a, way)])


def free_port():
    """Free for UDP and TCP."""
    for _ in range(100):
        with socket.socket(type=socket.SOCK_STREAM) as tcp, socket.socket(type=socket.SOCK_DGRAM) as udp:
            tcp.bind(("127.0.0.1", 0))
            try:
                udp.bind(tcp.getsockname())
                return tcp.getsockname()[1]
            except OSError:
                continue
    raise RuntimeError("no free port")


class BridgesTest(unittest.TestCase):
    def setUp(self):
        self.folder = pathlib.Path(self.enterContext_(tempfile.TemporaryDirectory()))
        self.log = self.folder / "given"
        self.port, self.canyon = free_port(), None

    def enterContext_(self, context):
        self.addCleanup(context.__exit__, None, None, None)
        return context.__enter__()

    def start(self, command):
        """A process that ends with the test."""
        environment = dict(os.environ, PYTHONPATH=os.pathsep.join((str(STAND_INS), str(BRIDGES))),
                           PYTHONDONTWRITEBYTECODE="1", STAND_IN_LOG=str(self.log))
        process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment,
                                   cwd=self.folder)

        def end():
            if process.poll() is None:
                process.kill()
            process.communicate()
        self.addCleanup(end)
        return process

    def start_canyon(self, scenario=SCENARIO):
        path = self.folder / "town.yaml"
        path.write_text(scenario.replace("9001", str(self.port)))
        self.canyon = self.start([CANYON, "live", str(path), "--quiet"])

    def bridge(self, name, *options):
        return self.start([sys.executable, str(BRIDGES / name), "--canyon", f"127.0.0.1:{self.port}", *options])

    def output(self, process, status=0):
        out, error = process.communicate(timeout=LONGEST_S)
        self.assertEqual(process.returncode, status, error)
        self.assertNotIn("Traceback", error)
        return out, error

    def check_way(self, antennas):
        """Checks the path of antennas in ENU, in order of time."""
        corners = [antenna(corner) for corner in course.CORNERS]
        self.assertGreater(len(antennas), 60)
        for each in antennas:
            off = min(distance_to_leg(each, a, b) for a, b in zip(corners, corners[1:]))
            self.assertLess(off, NEAR_M, f"{each} is not on the way")
        reached = []
        for corner in corners:
            near = [math.dist(each, corner) for each in antennas]
            self.assertLess(min(near), NEAR_M, f"no fix at {corner}")
            reached.append(near.index(min(near)))
        self.assertEqual(reached, sorted(reached))

    def check_fixes(self, text, enu_from):
        """Checks the fixes that a bridge printed. `enu_from` converts from the simulator's frame, as known to this test."""
        fixes = [json.loads(line) for line in text.splitlines()]
        solved = [fix for fix in fixes if fix["kind"] != "none"]
        self.assertGreaterEqual(len(solved), len(fixes) - 5, "fixes are missing")
        positions = [enu_from(*fix["position_m"]) for fix in solved]
        self.check_way(positions)
        for fix, position in zip(solved, positions):
            self.assertLess(math.dist(enu_of(*fix["place"]), position), 0.01)
            self.assertGreater(fix["used"], 4)
        # The middle of each leg: east, north and up, at their speeds.
        fastest = [max((enu_from(*fix["velocity_mps"]) for fix in solved), key=lambda v, i=i: v[i]) for i in range(3)]
        for i, speed in enumerate((15.0, 10.0, 10.0)):
            self.assertAlmostEqual(fastest[i][i], speed, delta=1.0)
        return solved

    def given(self):
        return self.log.read_text().splitlines()

    # Each bridge.

    def test_plain_loop(self):
        # Its own path: 30 m east, 20 m north, 10 m up. The receiver has no lever arm here.
        self.start_canyon(TOWN.replace("ublox-m10", "ideal"))
        out, _ = self.output(self.bridge("plain_loop.py", "--seconds", "14", "--speed", "6", "--at=20,-10,60",
                                         "--axes", "NED"))
        fixes = [json.loads(line) for line in out.splitlines()]
        self.assertGreater(len(fixes), 90)
        for fix, expected in ((fixes[0], (0, 0, 0)), (fixes[-1], (20, 30, -10))):
            self.assertLess(math.dist(fix["position_m"], expected), NEAR_M)
        self.assertLess(math.dist(enu_of(*fixes[-1]["place"]), (50, 10, 70)), NEAR_M)

    def test_carla(self):
        self.start_canyon()
        # The vehicle is removed from the world at the end.
        out, error = self.output(self.bridge("carla_bridge.py", "--role", "hero", "--draw"), 1)
        self.assertIn("no longer exists", error)
        solved = self.check_fixes(out, lambda x, y, z: (x, -y, z))
        drawn = [[float(each) for each in line.split()] for line in self.given()]
        self.assertEqual(drawn, [fix["position_m"] for fix in solved])

    def test_carla_says_what_is_missing(self):
        self.start_canyon()
        self.assertIn("none of CARLA's 2 vehicles has the role_name 'nobody'",
                      self.output(self.bridge("carla_bridge.py", "--role", "nobody"), 1)[1])
        self.assertIn("CARLA: time-out", self.output(self.bridge("carla_bridge.py", "--carla", "127.0.0.1:9"), 1)[1])

    def test_pegasus(self):
        self.start_canyon()
        out, _ = self.output(self.start([sys.executable, str(STAND_INS / "pegasus_app.py"), f"127.0.0.1:{self.port}"]))
        fixes = [json.loads(line) for line in out.splitlines()]
        self.check_way([enu_of(fix["latitude"] / 1e7, fix["longitude"] / 1e7, fix["altitude"] / 1e3) for fix in fixes])
        for fix in fixes:
            self.assertEqual(fix["fix_type"], 3)
            self.assertGreater(fix["sattelites_visible"], 4)
            self.assertAlmostEqual(fix["speed"], math.hypot(fix["velocity_north"], fix["velocity_east"]), delta=2)
        east = max(fixes, key=lambda fix: fix["velocity_east"])
        north = max(fixes, key=lambda fix: fix["velocity_north"])
        self.assertAlmostEqual(east["velocity_east"], 1500, delta=100)
        self.assertAlmostEqual(east["cog"], 9000, delta=500)
        self.assertAlmostEqual(north["velocity_north"], 1000, delta=100)
        self.assertLess(min(min(north["cog"], 36000 - north["cog"]), 500), 500)
        self.assertAlmostEqual(min(fix["velocity_down"] for fix in fixes), -1000, delta=100)
        self.assertEqual(fixes[-1]["altitude_gt"], 70000)
        self.assertAlmostEqual(math.degrees(fixes[-1]["latitude_gt"] / 1e7), ORIGIN[0], delta=1e-3)

    def test_places_of_a_loop_of_ones_own(self):
        # Poses in degrees: a simulator with only latitude and longitude.
        self.start_canyon()
        bridge, fixes = canyon_bridge.Bridge(("127.0.0.1", self.port)), []
        for end in (bridge._udp, bridge._tcp):
            self.addCleanup(end.close)
        forward, _, up = course.axes()
        for step in range(round(course.SECONDS / 0.05)):
            bridge.send(0.05 * step, forward=forward, up=up, place=course.place_of(course.at(0.05 * step)[0]))
            fixes += bridge.fixes()
            time.sleep(0.05 / course.SPEED)
        self.check_way([enu_of(*fix.place) for fix in fixes + bridge.fixes(1.0)])

    # --check.

    def test_check_finds_nothing(self):
        self.start_canyon()
        text, _ = self.output(self.bridge("carla_bridge.py", "--role", "hero", "--check", "10"))
        found = {line[8:18].strip(): line[:8].strip() for line in text.splitlines()[:-1] if not line.startswith("{")}
        self.assertEqual(found, dict.fromkeys(("clock", "way", "velocity", "attitude", "origin", "answers"), "ok"), text)
        self.assertTrue(text.endswith("\nnothing differs\n"), text)
        self.assertRegex(text, r"50\.0 poses a second, at [456]\.\d\d times real time")
        # The lever arm is 5.4 m long.
        self.assertRegex(text, r"within [56]\.\d\d m of its poses")

    def test_check_finds_mirrored_axes(self):
        self.start_canyon(TOWN.replace("ublox-m10", "ideal"))
        text, _ = self.output(self.bridge("carla_bridge.py", "--role", "hero", "--check", "10", "--axes", "ENU"), 1)
        self.assertRegex(text, r"DIFFERS origin    places that are sent have other axes: north is what is taken as minus north")

    def test_check_finds_another_origin(self):
        self.start_canyon(SCENARIO.replace("22.3", "22.4"))
        text, _ = self.output(self.bridge("carla_bridge.py", "--role", "hero", "--check", "10", "--origin", "22.4,114.17,0"), 1)
        self.assertRegex(text, r"DIFFERS origin    by the simulator's latitude, longitude and height the vehicle is ")
        self.assertIn("\n1 of 6 differ", text)

    def test_check_of_plain_loop(self):
        self.start_canyon(TOWN.replace("ublox-m10", "ideal"))
        text = self.output(self.bridge("plain_loop.py", "--check", "8", "--speed", "6", "--at=0,0,20"))[0]
        self.assertIn("open    origin", text)
        self.assertIn("nothing differs; 2 not checked", text)

    def checked(self, velocity=lambda v: v, position=lambda p: p, body=lambda axis: axis, seconds=10):
        check, time_s = bridge_check.Check(seconds), 0.0
        while not check.done:
            (p, v), (forward, _, up) = course.at(time_s), course.axes()
            check.pose(time_s, position(p), velocity(v), body(forward), body(up))
            time_s += 0.02
        return {each.subject: each for each in check.findings()}

    def test_check_tells_units_and_axes(self):
        found = self.checked(velocity=lambda v: [100 * each for each in v])["velocity"]
        self.assertEqual((found.ok, "1 is 0.01 m, as of centimetres" in found.text), (False, True), found)
        found = self.checked(velocity=lambda v: (v[1], v[0], -v[2]))["velocity"]
        self.assertEqual(found.text, "velocities have other axes: east is what is taken as north, north is what is taken as "
                         "east, up is what is taken as minus up (by differences of positions)")
        found = self.checked(velocity=lambda v: [3.6 * v[0], 3.6 * v[2], -3.6 * v[1]])["velocity"]
        self.assertRegex(found.text, "as of km/h and have other axes: north is what is taken as minus up, up is ")
        self.assertEqual(self.checked(velocity=lambda v: (0.0, 0.0, 0.0))["velocity"].ok, False)
        self.assertIsNone(self.checked(velocity=lambda v: None)["velocity"].ok)
        self.assertIn("apart, by no swap", self.checked(velocity=lambda v: (v[0], 0.0, v[0]))["velocity"].text)

    def test_check_tells_attitude_and_rest(self):
        self.assertIn("z down", self.checked(body=lambda axis: [axis[0], -axis[1], -axis[2]])["attitude"].text)
        self.assertFalse(self.checked(body=lambda axis: [2 * each for each in axis])["attitude"].ok)
        at_rest = self.checked(position=lambda p: course.START, velocity=lambda v: (0.0, 0.0, 0.0))
        self.assertEqual([at_rest[each].ok for each in ("way", "velocity", "attitude")], [None] * 3)
        self.assertFalse(self.checked(position=lambda p: [100 * each for each in p])["way"].ok)
        self.assertFalse(at_rest["answers"].ok)

    # Tests of all bridges.

    def test_help_and_missing_modules(self):
        names = sorted(path.name for path in BRIDGES.glob("*.py") if path.name not in ("canyon_bridge.py", "bridge_check.py"))
        self.assertEqual(len(names), 3)
        for name in names:
            with self.subTest(name):
                found = subprocess.run([sys.executable, "-B", BRIDGES / name, "--help"], capture_output=True, text=True,
                                       timeout=LONGEST_S)
                self.assertEqual((found.returncode, found.stderr), (0, ""))
                self.assertIn("canyon live town.yaml", found.stdout)
        (self.folder / "carla.py").write_text("raise ImportError(\"No module named 'carla'\")")
        found = subprocess.run([sys.executable, "-B", BRIDGES / "carla_bridge.py"], capture_output=True, text=True,
                               timeout=LONGEST_S, env=dict(os.environ, PYTHONPATH=str(self.folder)))
        self.assertEqual(found.returncode, 1)
        self.assertRegex(found.stderr, r"^carla_bridge.py: No module named 'carla'\. [^\n]+\n$")
        found = subprocess.run([sys.executable, "-B", BRIDGES / "pegasus_gps.py"], capture_output=True, text=True,
                               timeout=LONGEST_S)
        self.assertEqual(found.returncode, 1)
        self.assertIn("import it in a Pegasus application", found.stderr)

    def test_canyon_live_is_not_there(self):
        error = self.output(self.bridge("plain_loop.py", "--wait", "0.3"), 1)[1]
        self.assertRegex(error, rf"^plain_loop.py: canyon live does not listen at tcp://127.0.0.1:{self.port} [^\n]+\n$")
        self.assertIn("Start it first", error)

    def test_canyon_live_ends(self):
        self.start_canyon()
        process = self.bridge("plain_loop.py")
        self.assertIn('"kind"', process.stdout.readline())
        self.canyon.send_signal(signal.SIGINT)
        self.assertEqual(self.output(process, 1)[1], "plain_loop.py: canyon live has ended\n")

    def test_interrupt_ends_quietly(self):
        self.start_canyon()
        process = self.bridge("plain_loop.py")
        self.assertIn('"kind"', process.stdout.readline())
        process.send_signal(signal.SIGINT)
        self.assertEqual(self.output(process, 130)[1], "")

    def test_wrong_origin_is_said(self):
        self.start_canyon()
        error = self.output(self.bridge("plain_loop.py", "--seconds", "2", "--speed", "2", "--origin", "22.3,114.27,0"))[1]
        self.assertRegex(error, r"^warning: canyon live has the vehicle 10\d\d\d m from its pose: set --origin to [^\n]+\n$")

    def test_fixes_go_to_an_address(self):
        self.start_canyon()
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as inbox:
            inbox.bind(("127.0.0.1", 0))
            inbox.settimeout(LONGEST_S)
            address = "127.0.0.1:%d" % inbox.getsockname()[1]
            out, _ = self.output(self.bridge("plain_loop.py", "--seconds", "1", "--fixes-to", address))
            self.assertEqual(inbox.recv(65536).decode(), out.splitlines(True)[0])

    def test_bad_options(self):
        for option, message in (("--at=1,2", "three numbers"), ("--axes=EEN", "is not a frame"), ("--axes=XYZ", "is not a frame"),
                                ("--rate=0", "above 0"), ("--canyon=9001", "HOST:PORT")):
            error = self.output(self.start([sys.executable, str(BRIDGES / "plain_loop.py"), option]), 2)[1]
            self.assertRegex(error, re.escape(message))


if __name__ == "__main__":
    CANYON = str(pathlib.Path(sys.argv.pop(1)).resolve())
    unittest.main()
