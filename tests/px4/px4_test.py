#!/usr/bin/env python3
"""Tests ./run px4 without PX4 and Gazebo Sim: its world, its MAVLink, its record of a flight, and its errors.

usage: tests/px4/px4_test.py CANYON [unittest's options]
"""
import json
import math
import os
import pathlib
import re
import socket
import stat
import subprocess
import sys
import tempfile
import time
import types
import unittest
import unittest.mock
import xml.etree.ElementTree as ElementTree

ROOT = pathlib.Path(__file__).resolve().parents[2]
HERE = ROOT / "adapters" / "gz_sim" / "px4"
sys.dont_write_bytecode = True
sys.path.insert(0, str(HERE))
import mavlink_link  # noqa: E402
import px4  # noqa: E402
import world_file  # noqa: E402

DOWNTOWN = ROOT / "adapters" / "gz_sim" / "worlds" / "canyon_downtown.sdf"
# As in PX4's src/modules/simulation/gz_bridge/server.config.
CONFIGURATION = """<server_config><plugins>
  <plugin entity_name="*" entity_type="world" filename="gz-sim-physics-system" name="gz::sim::systems::Physics"/>
  <plugin entity_name="*" entity_type="world" filename="gz-sim-imu-system" name="gz::sim::systems::Imu"/>
</plugins></server_config>"""


def options(**changed):
    return types.SimpleNamespace(**{"profile": "ublox-m10", "rate": 5.0, "start": "2026-06-01T08:00:00Z", "rtk": None, "inject": False,
                                    "settings": "", "bridge": False, "stock": False, "param": [], "model": "x500",
                                    "pose": [26.0, -260.0, 0.3], **changed})


class WorldFile(unittest.TestCase):
    def prepare(self, text, settings="<serve>all</serve>", without=()):
        folder = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory()))
        source, target, systems = folder / "in" / "city.sdf", folder / "world.sdf", folder / "server.config"
        source.parent.mkdir()
        source.write_text(text)
        (source.parent / "city.dae").write_text("")
        systems.write_text(CONFIGURATION)
        name = world_file.prepare(source, target, systems, settings, without)
        return name, ElementTree.parse(target).getroot().find("world"), source.parent

    def test_has_each_system_once(self):
        name, world, _ = self.prepare(DOWNTOWN.read_text())
        self.assertEqual(name, "canyon_downtown")
        names = [plugin.get("filename") for plugin in world.findall("plugin")]
        self.assertEqual(sorted(names), sorted(set(names)))
        self.assertLess({"gz-sim-physics-system", "gz-sim-imu-system", "CanyonGnssSystem"}, set(names))
        self.assertEqual(world.find("plugin[@filename='CanyonGnssSystem']/serve").text, "all")
        self.assertIsNone(world.find("plugin[@entity_name]"))

    def test_leaves_out_the_car_where_it_is_told_to(self):
        _, world, _ = self.prepare(DOWNTOWN.read_text(), without=("car",))
        self.assertEqual([model.get("name") for model in world.findall("model")], ["ground", "downtown"])
        _, world, _ = self.prepare(DOWNTOWN.read_text())
        self.assertIn("car", [model.get("name") for model in world.findall("model")])

    def test_keeps_the_buildings(self):
        """As read by the city reader."""
        folder = self.enterContext(tempfile.TemporaryDirectory())
        systems, target = os.path.join(folder, "server.config"), os.path.join(folder, "world.sdf")
        pathlib.Path(systems).write_text(CONFIGURATION)
        world_file.prepare(DOWNTOWN, target, systems, px4.canyon_elements(options(), True))
        def buildings(world):
            text = subprocess.run([CANYON, "city", "info", world], capture_output=True, text=True, check=True).stdout
            return re.search(r"buildings +(\d+)", text).group(1)
        self.assertEqual(buildings(target), buildings(DOWNTOWN))

    def test_names_files_by_their_whole_path(self):
        _, world, folder = self.prepare("""<sdf version="1.9"><world name="w"><spherical_coordinates/>
            <model name="m"><link name="l"><collision name="c"><geometry><mesh><uri>city.dae</uri></mesh></geometry></collision>
            <visual name="v"><geometry><mesh><uri>model://tree/tree.dae</uri></mesh></geometry></visual></link></model></world></sdf>""")
        self.assertEqual([uri.text for uri in world.iter("uri")], [str(folder / "city.dae"), "model://tree/tree.dae"])

    def test_refuses_what_is_no_world(self):
        for text, problem in (("<sdf><model name='m'/></sdf>", "contains no <world>"), ("<sdf><world", "cannot be read as a world"),
                              ("<sdf><world name='w'/></sdf>", "no <spherical_coordinates>")):
            with self.assertRaisesRegex(ValueError, problem):
                self.prepare(text)


class Elements(unittest.TestCase):
    def test_are_elements_of_the_plugin(self):
        root = ElementTree.fromstring(f"<plugin>{px4.canyon_elements(options(rtk=[26.0, -320.0, 5.0], inject=True), True)}</plugin>")
        streams = [stream.text for stream in root.iter("stream")]
        self.assertIn("ubx=pty:/tmp/canyon-gps{number}?latency_s=0.1&jitter_s=0.01", streams)
        self.assertIn("base/gps_rtcm_data=udp://127.0.0.1:1428{number}?rate_hz=1&latency_s=0.1&link_baud=57600", streams)
        self.assertEqual(root.find("base/fixed/north_m").text, "-320.0")
        self.assertEqual(root.find("publishers/navsat").text, "true")
        radio = ElementTree.fromstring(f"<plugin>{px4.canyon_elements(options(rtk=[26.0, -320.0, 5.0]), True)}</plugin>")
        self.assertEqual(radio.find("corrections/from").text, "base")
        self.assertFalse(any("rtcm" in stream.text for stream in radio.iter("stream")))
        shared = ElementTree.fromstring(f"<plugin>{px4.canyon_elements(options(rtk='tower'), True)}</plugin>")
        self.assertEqual((shared.find("corrections/from").text, shared.find("rtk").text, shared.find("base")),
                         ("tower", "true", None))
        older = ElementTree.fromstring(f"<plugin>{px4.canyon_elements(options(), False)}</plugin>")
        self.assertEqual(older.find("publishers/navsat").text, "false")
        bridge = ElementTree.fromstring(f"<plugin>{px4.canyon_elements(options(bridge=True), False)}</plugin>")
        self.assertEqual(bridge.find("publishers/navsat").text, "true")
        self.assertFalse(any("ubx" in stream.text for stream in bridge.iter("stream")))

    def test_an_own_checkout_joins_by_one_line(self):
        """PX4's start script joins a running world, and reads parameters from PX4_PARAM_NAME."""
        make, gps = px4.join_lines(options(param=["EKF2_HGT_REF=1"]), "/px4", True)
        self.assertEqual(make, "cd /px4 && PX4_GZ_MODEL_POSE=26,-260,0.3 PX4_PARAM_SIM_GZ_EN_GPS=0 PX4_PARAM_EKF2_REQ_EPH=10 "
                               "PX4_PARAM_EKF2_REQ_EPV=15 PX4_PARAM_EKF2_HGT_REF=1 make px4_sitl gz_x500")
        self.assertEqual(gps, "gps start -d /tmp/canyon-gps0 -p ubx")
        self.assertEqual(px4.join_lines(options(stock=True, bridge=True), "/px4", True),
                         ["cd /px4 && PX4_GZ_MODEL_POSE=26,-260,0.3 make px4_sitl gz_x500"])

    def test_the_line_is_short_enough_for_px4(self):
        """Its GPS driver keeps 19 characters of a device's path, and uses the last as the number of the bus."""
        self.assertRegex("/tmp/canyon-gps9", r"^.{1,18}\d$")


class Environment(unittest.TestCase):
    def test_has_each_folder_once(self):
        """Gazebo reads every folder of GZ_DESCRIPTOR_PATH, and warns about a known message."""
        with unittest.mock.patch.dict(os.environ, {"SOME_PATH": "/theirs:/ours:/other"}):
            px4.put_first("SOME_PATH", "/ours", "/ours/too")
            self.assertEqual(os.environ["SOME_PATH"], "/ours:/ours/too:/theirs:/other")
            del os.environ["SOME_PATH"]
            px4.put_first("SOME_PATH", "/ours")
            self.assertEqual(os.environ["SOME_PATH"], "/ours")


class Mavlink(unittest.TestCase):
    def test_frames_are_those_of_pymavlink(self):
        """The bytes of the same message by pymavlink 2.4, from system 255, component 190."""
        self.assertEqual(mavlink_link.frame("COMMAND_LONG", 7, command=400, param1=1, target_system=2, target_component=1).hex(),
                         ARM)
        self.assertEqual(mavlink_link.frame("MISSION_COUNT", 255, count=7, target_system=1, target_component=1).hex(), COUNT)

    def test_reads_what_it_writes(self):
        sent = dict(time_boot_ms=1234, lat=223000000, lon=1141700000, alt=-15000, vx=-3, hdg=9000)
        data = mavlink_link.frame("GLOBAL_POSITION_INT", 3, **sent)
        broken = data[:-3] + bytes([data[-3] ^ 1]) + data[-2:]
        found = list(mavlink_link.messages_of(b"noise\xFD" + data + broken + data[:9]))
        self.assertEqual(len(found), 1)
        self.assertEqual(found[0][0], "GLOBAL_POSITION_INT")
        self.assertLessEqual(sent.items(), found[0][1].items())

    def test_uploads_a_mission(self):
        """To a vehicle that requests each item, one of them twice."""
        vehicle = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        vehicle.bind(("127.0.0.1", 0))
        vehicle.settimeout(5)
        link = mavlink_link.Link(0, vehicle.getsockname()[1])
        here = link.socket.getsockname()
        items, got = mavlink_link.read_mission(ROOT / "examples" / "px4_street.waypoints"), []

        def fly(_):
            try:
                vehicle.settimeout(0.01)
                data = vehicle.recv(2048)
            except OSError:
                return
            for name, values in mavlink_link.messages_of(data):
                if name == "MISSION_ITEM_INT":
                    got.append(values)
                if name in ("MISSION_COUNT", "MISSION_ITEM_INT"):
                    wanted = 0 if name == "MISSION_COUNT" else values["seq"] + 1
                    for _ in range(2 if wanted == 3 else 1):
                        reply = ("MISSION_REQUEST_INT", {"seq": wanted}) if wanted < len(items) else ("MISSION_ACK", {"type": 0})
                        vehicle.sendto(mavlink_link.frame(reply[0], 0, **reply[1]), here)

        original = time.sleep
        mavlink_link.time.sleep = fly
        try:
            self.assertTrue(link.upload(items, 1))
        finally:
            mavlink_link.time.sleep = original
            link.close()
            vehicle.close()
        self.assertEqual({item["seq"] for item in got}, set(range(len(items))))
        self.assertEqual(got[0]["command"], mavlink_link.NAV_TAKEOFF)
        self.assertEqual((got[0]["x"], got[0]["y"], got[0]["z"]), (222976520, 1141702523, 15.0))

    def read(self, text, name="m.waypoints"):
        """Items of a mission and the lines logged; PATH is its path in these and in errors."""
        path, logged = pathlib.Path(self.enterContext(tempfile.TemporaryDirectory())) / name, []
        path.write_text(text if isinstance(text, str) else json.dumps(text))
        try:
            items = mavlink_link.read_mission(path, logged.append)
        except ValueError as error:
            raise ValueError(str(error).replace(str(path), "PATH")) from None
        return items, [line.replace(str(path), "PATH") for line in logged]

    def test_only_ardupilots_row_0_is_home(self):
        """The same mission with home as row 0 (ArduPilot), without and numbered from 1 (PX4, QGroundControl)."""
        row = "{}\t{}\t3\t{}\t15\t0\t0\tnan\t48.1\t11.5\t12\t1\n"
        rows = lambda first: "".join(row.format(first + i, int(i == 0), command) for i, command in enumerate((22, 16, 21)))
        home = "0\t1\t0\t16\t0\t0\t0\t0\t48.1\t11.5\t520\t1\n"
        for text, logged in ((home + rows(1), ["PATH: row 0 (command 16, frame 0: 48.1, 11.5) is taken as home and not flown"]),
                           (rows(0), []), (rows(1), [])):
            items, lines = self.read("\ufeffQGC WPL 110\r\n" + text)
            self.assertEqual([(item["command"], item["current"]) for item in items], [(22, 1), (16, 0), (21, 0)])
            self.assertEqual((items[1]["frame"], items[1]["x"], items[1]["y"], items[1]["z"]), (6, 481000000, 115000000, 12))
            self.assertEqual(lines, logged)
        self.assertEqual([item["command"] for item in self.read("QGC WPL 110\n" + home)[0]], [16])

    def test_jumps_count_as_px4_does(self):
        """From 0 and without home; rows of a file count home too."""
        for home, first in (("0 1 0 16 0 0 0 0 48 11 520 1\n", 1), ("", 0), ("", 5 - 4)):
            text = f"{first} 0 3 16 0 0 0 0 48 11 9 1\n{first + 1} 0 2 177 {first} 3 0 0 0 0 0 1\n"
            self.assertEqual(self.read("QGC WPL 110\n" + home + text)[0][1]["param1"], 0)
        with self.assertRaisesRegex(ValueError, "PATH:2: jumps to item 7"):
            self.read("QGC WPL 110\n0 1 2 177 7 3 0 0 0 0 0 1\n")

    def test_names_the_line_of_a_wrong_waypoint(self):
        home = "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t22\t114\t0\t1\n"
        for text, problem in ((home + "1\t0\t3\tx\t0\t0\t0\t0\t22\t114\t0\t1\n", "PATH:3: a waypoint"),
                              (home + "1\t0\t3\t16\t0\t0\t0\t0\t22\t114\t0\tx\n", "PATH:3: a waypoint"),
                              (home + "1\t0\t3\t16\t0\t0\t0\t0\t22\t114\n", "PATH:3: a waypoint"),
                              (home + "2\t0\t3\t16\t0\t0\t0\t0\t22\t114\t0\t1\n", "PATH:3: its number is 2"),
                              (home + "1\t0\t3\t16\t0\t0\t0\t0\t92\t114\t0\t1\n", "PATH:3: a parameter is out of range"),
                              (home + "1\t0\t3\t16\t0\t0\t0\t0\tnan\t114\t0\t1\n", "PATH:3: has no latitude"),
                              (home + "1\t0\t10\t16\t0\t0\t0\t0\t22\t114\t0\t1\n", "PATH:3: PX4 does not accept its frame 10"),
                              (home + "1\t0\t2\t178\t1\t4\t-1\t0\t0.5\t0\t0\t1\n", "PATH:3: parameters 5 and 6"),
                              ("lat,lon\n", "PATH:1: is not a mission"), ("", "PATH:1: is not a mission"),
                              ("QGC WPL 110\n", "PATH: contains no item")):
            with self.assertRaisesRegex(ValueError, problem):
                self.read(text)

    @staticmethod
    def plan(*items, **more):
        return {"fileType": "Plan", "mission": {"items": list(items)}, **more}

    @staticmethod
    def item(command, frame, values, **more):
        return {"type": "SimpleItem", "autoContinue": True, "command": command, "frame": frame, "params": values, **more}

    def test_reads_plans_of_qgroundcontrol(self):
        """Frames and commands as accepted by PX4's parse_mavlink_mission_item(); the unset integer is MAVLink's INT32_MAX."""
        items, logged = self.read(self.plan(
            self.item(22, 3, [0, 0, 0, None, 48.1, 11.5, 12], Altitude=12, AltitudeMode=1, doJumpId=11),
            self.item(178, 2, [1, 4, -1, 0, None, 0, None], doJumpId=12),
            self.item(16, 0, [0, 0, 0, None, 48.1006, 11.5, 536], Altitude=12, AltitudeMode=3, AMSLAltAboveTerrain=536, doJumpId=13),
            self.item(16, 0, [0, 0, 0, 90, 48.1, 11.5, 540], Altitude=540, AltitudeMode=2, doJumpId=14),
            self.item(93, 2, [5, -1, -1, -1, 0, 0, 0], doJumpId=15), self.item(177, 2, [13, 2, 0, 0, 0, 0, 0], doJumpId=16),
            self.item(20, 2, [0] * 7, doJumpId=17), geoFence={"circles": [], "polygons": [{}, {}]}, rallyPoints={"points": [[48, 11, 5]]}))
        self.assertEqual([item["command"] for item in items], [22, 178, 16, 16, 93, 177, 20])
        self.assertEqual([item["frame"] for item in items], [6, 2, 5, 5, 2, 2, 2])
        self.assertEqual([items[i]["z"] for i in (0, 2, 3)], [12, 536, 540])
        self.assertTrue(math.isnan(items[0]["param4"]) and items[3]["param4"] == 90)
        self.assertEqual((items[1]["x"], items[1]["param2"], items[5]["param1"]), (2147483647, 4, 2))
        self.assertEqual(logged, ["warning: PATH: not uploaded: 2 polygons of the geofence, 1 rally points"])
        self.assertEqual(len(mavlink_link.frame("MISSION_ITEM_INT", 0, seq=1, **items[1])), 12 + 37)

    def test_refuses_what_it_would_fly_wrongly(self):
        good = self.item(22, 3, [0, 0, 0, None, 48.1, 11.5, 12], AltitudeMode=1)
        for items, problem in (([good, {"type": "ComplexItem", "complexItemType": "survey"}], "item 2: the complex item 'survey'"),
                               ([good, {"type": "ComplexItem", "complexItemType": "StructureScan"}], "'StructureScan'"),
                               ([good, 7], "item 2: the complex item '7'"), ([], "contains no item"),
                               ([dict(good, AltitudeMode=3)], "item 1: AltitudeMode 3 and frame 3 contradict"),
                               ([self.item(16, 0, [0, 0, 0, 0, 48, 11, None], AltitudeMode=3)], "item 1: has no latitude"),
                               ([self.item(16, 0, [0, 0, 0, 0, 48, 11, "12"])], "item 1: an item has command"),
                               ([self.item(16, 0, 5)], "item 1: an item has command"),
                               ([self.item("16", 0, [0] * 7)], "item 1: an item has command")):
            with self.assertRaisesRegex(ValueError, problem):
                self.read(self.plan(*items), "m.plan")
        for text, problem in (('{"fileType": "Plan",\n "mission": ]', "PATH:2: is not JSON"), ({"fileType": "Mission"}, "is not a plan")):
            with self.assertRaisesRegex(ValueError, problem):
                self.read(text, "m.plan")


class Flight(unittest.TestCase):
    """A vehicle that flies north at 10 m/s, whose estimate is 3 m too far, and whose fix is 4 m off to the east."""

    def vehicle(self):
        metres_of_deg = 111194.93    # of the sphere of 6371 km
        epochs, link = [], types.SimpleNamespace(armed_at=lambda now: now >= 5)
        for i in range(50):
            epochs.append({"gps_tow": f"{115218 + 0.2 * i:.3f}", "true_latitude_deg": f"{22.3 + 2 * i / metres_of_deg:.9f}",
                           "true_longitude_deg": "114.17", "true_height_m": "20", "placement": "free", "error_east_m": "4",
                           "error_north_m": "0", "error_up_m": "-1", "sigma_east_m": "3", "sigma_north_m": "4", "used": "12"})
        times = [0.02 + 0.1 * i for i in range(100)]
        link.kept = {"GLOBAL_POSITION_INT": (times, [{"lat": (22.3 + (10 * t + 3) / metres_of_deg) * 1e7, "lon": 1141700000.0,
                                                      "alt": 22000} for t in times]),
                     "GPS_RAW_INT": ([0.5], [{"fix_type": 3, "satellites_visible": 12, "h_acc": 5000, "eph": 80}]),
                     "ESTIMATOR_STATUS": ([], [])}
        return types.SimpleNamespace(epochs=types.SimpleNamespace(rows=epochs), link=link)

    def test_joins_the_receivers_record_and_px4s_messages_by_time(self):
        rows = px4.flight_of(self.vehicle(), px4.week_second("2026-06-01T08:00:00Z"))
        self.assertEqual([round(row["time_s"], 6) for row in rows[:3]], [0.0, 0.2, 0.4])
        self.assertEqual(rows[0]["estimate_error_m"], "")    # PX4 sent nothing before
        self.assertAlmostEqual(rows[10]["estimate_error_m"], 3, places=2)
        self.assertAlmostEqual(rows[10]["estimate_error_up_m"], 2)
        self.assertEqual((rows[5]["px4_eph_m"], rows[5]["px4_hdop"]), (5.0, 0.8))
        self.assertEqual(rows[20]["px4_fix_type"], "", "the message is 3.5 s old")
        self.assertEqual((rows[10]["fix_error_m"], rows[10]["fix_stated_m"]), (4, 5))
        self.assertEqual([row["armed"] for row in rows[24:27]], [0, 1, 1])

    def test_the_second_of_the_week(self):
        """2026-06-01 is a Monday, 18 leap seconds behind GPS."""
        self.assertEqual(px4.week_second("2026-06-01T08:00:00Z"), 86400 + 8 * 3600 + 18)


class FrontDoor(unittest.TestCase):
    def run_px4(self, *words, gazebo=True, **environment):
        folder = self.enterContext(tempfile.TemporaryDirectory())
        gz = pathlib.Path(folder) / "gz"
        gz.write_text(f"#!/bin/sh\nexit {0 if gazebo else 1}\n")
        gz.chmod(gz.stat().st_mode | stat.S_IXUSR)
        names = {"PATH": f"{folder}:/usr/bin:/bin", "HOME": folder, **environment}
        done = subprocess.run([sys.executable, str(HERE / "px4.py"), "build", *words], capture_output=True, text=True, env=names,
                              cwd=folder, timeout=60)
        return done.returncode, done.stderr

    def test_says_what_is_missing(self):
        status, text = self.run_px4(gazebo=False)
        self.assertEqual(status, 1)
        self.assertIn("Gazebo Sim was not found: install gz-harmonic", text)
        status, text = self.run_px4()
        self.assertIn("PX4 was not found", text)
        self.assertIn("--px4 DIR", text)
        status, text = self.run_px4(PX4_DIR="/nowhere")
        self.assertIn("/nowhere has no build/px4_sitl_default/bin/px4", text)

    def test_refuses_wrong_options(self):
        for words, problem in ((["--vehicles", "10"], "give 1 to 9"), (["--pose", "1,2"], "three numbers"), (["--pose", "1,2,nan"], "three numbers"),
                               (["--inject"], "needs its own base"), (["--rate", "0"], "up to 25 Hz"), (["--param", "EKF2_REQ_EPH"], "NAME=VALUE"),
                               (["--takeoff", "--mission", "m"], "exclude each other"), (["--join", "--takeoff"], "you control PX4"), (["--speed", "-1"], "0.01 to 100"),
                               (["--fault", "soon", "{}"], "a time in seconds")):
            status, text = self.run_px4(*words)
            self.assertEqual(status, 2, words)
            self.assertIn(problem, text)


ARM = "fd20000007ffbe4c00000000803f00000000000000000000000000000000000000000000000090010201615d"
COUNT = "fd040000ffffbe2c0000070001018ab1"

if __name__ == "__main__":
    CANYON = os.path.abspath(sys.argv.pop(1))
    unittest.main()
