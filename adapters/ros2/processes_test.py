#!/usr/bin/env python3
"""The receiver's node, other ROS 2 programs and this one, each in its own process.

Expected numbers are those of `canyon simulate`, or closed forms given next to their use. Runs under ctest, which
sets the environment; a class name as argument runs only that class.
"""
import math
import os
import subprocess
import sys
import time
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from testing.processes import (CANYON, OPEN_FIELD, PREFIX, Listener, Process, folder, parameters, receiver,  # noqa: E402
                               ros2, seconds_of, simulated, until, write_drive)

from canyon_msgs.msg import GnssMultipath, GnssRawObservations, GnssSatellites  # noqa: E402
from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from geometry_msgs.msg import PoseStamped, TransformStamped, TwistWithCovarianceStamped  # noqa: E402
from lifecycle_msgs.msg import Transition  # noqa: E402
from nav_msgs.msg import Odometry  # noqa: E402
from rosgraph_msgs.msg import Clock  # noqa: E402
from sensor_msgs.msg import Imu, NavSatFix  # noqa: E402

TOPICS = {"/fix": NavSatFix, "/fix_velocity": TwistWithCovarianceStamped, "/gnss_multipath": GnssMultipath,
          "/satellites": GnssSatellites, "/raw_observations": GnssRawObservations, "/diagnostics": DiagnosticArray,
          "/clock": Clock}


def geodetic(east, north):
    """Degrees at a few metres from the origin: radii of curvature of WGS 84, within (10 m)^2 / 6378 km."""
    a, e2, latitude = 6378137.0, 0.0066943799901413165, math.radians(22.3)
    w = math.sqrt(1 - e2 * math.sin(latitude) ** 2)
    return (22.3 + math.degrees(north / (a * (1 - e2) / w ** 3)),
            114.17 + math.degrees(east / (a / w * math.cos(latitude))))


class Topics(unittest.TestCase):
    """A scenario's drive, with the clock driven by it."""

    def setUp(self):
        self.folder = folder()
        self.addCleanup(self.folder.cleanup)

    def test_every_topic_is_echoed(self):
        drive = write_drive(self.folder.name, 20)
        echoes = {}
        with receiver({"scenario": drive, "drive_clock": True}) as node, Listener() as listener:
            self.assertTrue(listener.transition("/receiver", Transition.TRANSITION_CONFIGURE), node.output())
            for topic in TOPICS:
                echoes[topic] = Process(["ros2", "topic", "echo", "--once", topic])
                self.addCleanup(echoes[topic].end)
            names = ros2("topic", "list", "-t")
            for topic, kind in TOPICS.items():
                self.assertIn(f"{topic} [{kind.__module__.split('.')[0]}/msg/{kind.__name__}]", names)
            time.sleep(3)  # until the echoes have begun
            self.assertTrue(listener.transition("/receiver", Transition.TRANSITION_ACTIVATE), node.output())
            for topic, echo in echoes.items():
                until(lambda: echo.child.poll() is not None, f"ros2 topic echo {topic}")
                said = echo.output()
                print(f"$ ros2 topic echo --once {topic}\n{said[:600]}")
                self.assertEqual(echo.child.returncode, 0, said)
        self.assertRegex(echoes["/fix"].output(), r"frame_id: gnss\nstatus:\n  status: 0\n  service: 9\nlatitude: 22\.")
        self.assertIn("range_offset:", echoes["/gnss_multipath"].output())
        self.assertIn("carrier_phase:", echoes["/raw_observations"].output())
        self.assertIn("name: 'receiver: receiver'", echoes["/diagnostics"].output())

    def test_rates_and_numbers_are_those_of_the_simulation(self):
        drive = write_drive(self.folder.name, 8)
        epochs, satellites = simulated(drive, os.path.join(self.folder.name, "out"))
        self.assertEqual(len(epochs), 81)
        with receiver({"scenario": drive, "drive_clock": True}) as node, Listener() as listener:
            self.assertTrue(listener.transition("/receiver", Transition.TRANSITION_CONFIGURE), node.output())
            received = {topic: listener.listen(kind, topic) for topic, kind in TOPICS.items()}
            listener.spin_for(1)
            began = time.monotonic()
            self.assertTrue(listener.transition("/receiver", Transition.TRANSITION_ACTIVATE), node.output())
            listener.spin_until(lambda: len(received["/fix"]) == 81, "81 epochs")
            took = time.monotonic() - began
            listener.spin_for(0.5)
            self.assertEqual(listener.state("/receiver"), "inactive")  # after the end of the drive
        for topic in ("/fix", "/fix_velocity", "/gnss_multipath", "/satellites", "/raw_observations"):
            stamps = [round(seconds_of(m.header.stamp), 9) for m in received[topic]]
            self.assertEqual(stamps, [round(0.1 * i, 9) for i in range(81)], topic)
        # 8 s of simulated time at speed 1, plus start and end.
        self.assertGreater(took, 7.9)
        self.assertLess(took, 12)
        clock = [seconds_of(m.clock) for m in received["/clock"]]
        self.assertEqual(clock, sorted(clock))
        self.assertEqual((round(clock[0], 9), round(clock[-1], 9), len(clock)), (0, 8.1, 811))  # every 10 ms, to the end of the last interval
        # Once per second, at every change, and at the end.
        self.assertGreaterEqual(len(received["/diagnostics"]), 9)
        self.assertLess(len(received["/diagnostics"]), 40)

        for row, fix in zip(epochs, received["/fix"]):
            self.assertEqual(fix.status.status, 0 if row["status"] == "fix" else -1)
            if row["status"] != "fix":
                self.assertTrue(math.isnan(fix.latitude))
                continue
            # As many digits as the table has.
            self.assertAlmostEqual(fix.latitude, float(row["fix_latitude_deg"]), delta=6e-11)
            self.assertAlmostEqual(fix.longitude, float(row["fix_longitude_deg"]), delta=6e-11)
            self.assertAlmostEqual(fix.altitude, float(row["fix_height_m"]), delta=6e-5)
        names = ["LOS", "LOS+multipath", "NLOS", "blocked"]
        seen = [s for m in received["/satellites"] for s in m.satellites]
        self.assertEqual(len(seen), len(satellites))
        for row, satellite in zip(satellites, seen):
            self.assertEqual(satellite.id, row["sat"])
            self.assertEqual(names[satellite.visibility], row["visibility"])
            if row["excess_path_m"]:
                self.assertAlmostEqual(satellite.excess_path, float(row["excess_path_m"]), delta=1e-4)
        measured = {(m, s.id): s for m, raw in enumerate(received["/raw_observations"]) for s in raw.observations}
        epoch, tow, found = -1, None, 0
        for row in satellites:
            epoch, tow = (epoch, tow) if row["gps_tow"] == tow else (epoch + 1, row["gps_tow"])
            raw = measured.get((epoch, row["sat"]))
            self.assertEqual(raw is not None, row["pseudorange_m"] != "", (row, raw))
            if raw is not None:
                found += 1
                self.assertAlmostEqual(raw.pseudorange, float(row["pseudorange_m"]), delta=6e-4)
        self.assertEqual(found, len(measured))

    def test_a_subscriber_that_asks_for_more_is_told_of(self):
        drive = write_drive(self.folder.name, 30)
        values = {"scenario": drive, "autostart": True}
        best_effort = "qos_overrides./fix.publisher.reliability:=best_effort"
        with receiver(values, "-p", best_effort) as node, Listener() as listener:
            reliable = listener.listen(NavSatFix, "/fix", reliable=True)
            sensor_data = listener.listen(NavSatFix, "/fix")
            listener.spin_until(lambda: len(sensor_data) > 5, "fixes")
            until(lambda: "quality of service" in node.output(), "the warning")
            self.assertRegex(node.output(), r"a subscriber of /fix requests .*not offered \(RELIABILITY_QOS_POLICY\)")
            self.assertEqual(reliable, [])
        with receiver(values), Listener() as listener:
            reliable = listener.listen(NavSatFix, "/fix", reliable=True)
            sensor_data = listener.listen(NavSatFix, "/fix")
            listener.spin_until(lambda: min(len(reliable), len(sensor_data)) > 5, "fixes for both")

    def test_sensors_come_at_their_times(self):
        drive = os.path.join(self.folder.name, "sensors.yaml")
        with open(write_drive(self.folder.name, 6)) as file, open(drive, "w") as other:
            smooth = file.read().replace("speed_mps: 5", "speed_mps: 5\n  acceleration_mps2: 2")
            other.write(smooth + "sensors: {imu: {profile: ideal, rate_hz: 50}, wheels: {rate_hz: 10, track_m: 1.5}}\n")
        with receiver({"scenario": drive, "drive_clock": True}) as node, Listener() as listener:
            self.assertTrue(listener.transition("/receiver", Transition.TRANSITION_CONFIGURE), node.output())
            imu = listener.listen(Imu, "/imu")
            wheels = listener.listen(TwistWithCovarianceStamped, "/wheels")
            clock = listener.listen(Clock, "/clock")
            late = []
            listener.spin_for(1)
            self.assertTrue(listener.transition("/receiver", Transition.TRANSITION_ACTIVATE), node.output())

            def ended():
                if imu and clock:
                    late.append(seconds_of(clock[-1].clock) - seconds_of(imu[-1].header.stamp))
                return len(imu) == 300
            listener.spin_until(ended, "6 s of samples")
        self.assertEqual([round(seconds_of(m.header.stamp), 9) for m in imu], [round(0.02 * (i + 1), 9) for i in range(300)])
        self.assertLess(sorted(late)[len(late) // 2], 0.1)  # not in blocks of an epoch
        self.assertAlmostEqual(imu[150].linear_acceleration.z, 9.7875, delta=0.01)  # gravity at 22.3 N (WGS 84)
        self.assertEqual(imu[0].orientation_covariance[0], -1)
        self.assertEqual((imu[0].header.frame_id, wheels[0].header.frame_id), ("imu", "base_link"))
        self.assertAlmostEqual(wheels[-1].twist.twist.linear.x, 5, delta=0.2)


class Lifecycle(unittest.TestCase):
    def test_every_transition(self):
        with folder() as path:
            drive = write_drive(path, 60)
            with receiver({"scenario": drive}) as node, Listener() as listener:
                fixes = listener.listen(NavSatFix, "/fix")
                until(lambda: "unconfigured" in ros2("lifecycle", "get", "/receiver", check=False), "the node")
                for _ in range(2):
                    self.assertIn("Transitioning successful", ros2("lifecycle", "set", "/receiver", "configure"))
                    self.assertEqual(listener.state("/receiver"), "inactive")
                    self.assertEqual(len(fixes), 0)
                    self.assertTrue(listener.transition("/receiver", Transition.TRANSITION_ACTIVATE))
                    self.assertEqual(listener.state("/receiver"), "active")
                    listener.spin_until(lambda: len(fixes) > 3, "fixes")
                    self.assertTrue(listener.transition("/receiver", Transition.TRANSITION_DEACTIVATE))
                    listener.spin_for(0.3)
                    fixes.clear()
                    listener.spin_for(0.5)
                    self.assertEqual(fixes, [])
                    self.assertTrue(listener.transition("/receiver", Transition.TRANSITION_CLEANUP))
                    self.assertEqual(listener.state("/receiver"), "unconfigured")
                self.assertTrue(listener.transition("/receiver", Transition.TRANSITION_UNCONFIGURED_SHUTDOWN))
                self.assertEqual(listener.state("/receiver"), "finalized")
                self.assertEqual(node.end(), 0)

    def test_what_cannot_be_configured_stays_and_says_why(self):
        with folder() as path:
            missing = os.path.join(path, "none.yaml")
            with receiver({"scenario": missing}) as node, Listener() as listener:
                self.assertFalse(listener.transition("/receiver", Transition.TRANSITION_CONFIGURE))
                self.assertEqual(listener.state("/receiver"), "unconfigured")
                self.assertIn("none.yaml", node.output())
                # And continues after the cause is fixed.
                self.assertEqual(listener.set_parameter("/receiver", "scenario", write_drive(path, 5)), "")
                self.assertTrue(listener.transition("/receiver", Transition.TRANSITION_CONFIGURE), node.output())
            with receiver({"scenario": missing, "autostart": True}) as node:
                until(lambda: node.child.poll() is not None, "its end")
                self.assertNotEqual(node.child.returncode, 0)


class Parameters(unittest.TestCase):
    def test_descriptors_ranges_and_refusals(self):
        with folder() as path:
            drive = write_drive(path, 60)
            # The engine's own messages, as on the command line.
            wrong = os.path.join(path, "wrong.yaml")
            with open(drive) as file, open(wrong, "w") as other:
                other.write(file.read().replace("profile: paper", "profile: paper, elevation_mask_deg: 95"))
            said = subprocess.run([CANYON, "simulate", wrong, "--out", path], stderr=subprocess.PIPE, text=True).stderr
            engine = said[said.index("95"):].splitlines()[0]
            with receiver({"scenario": drive, "elevation_mask": 9}) as node, Listener() as listener:
                until(lambda: "unconfigured" in ros2("lifecycle", "get", "/receiver", check=False), "the node")
                self.assertRegex(node.output(), "no parameter 'elevation_mask'; did you mean 'elevation_mask_deg'?")
                described = ros2("param", "describe", "/receiver", "clock.bias_s", "elevation_mask_deg")
                print(described)
                self.assertIn("Min value", described)
                refused = ros2("param", "set", "/receiver", "elevation_mask_deg", "95.0", check=False)
                print(refused)
                self.assertIn("parameter 'elevation_mask_deg': ", refused)
                self.assertIn(engine, refused)
                self.assertIn("successful", ros2("param", "set", "/receiver", "elevation_mask_deg", "20.0"))
                self.assertIn("20", ros2("param", "get", "/receiver", "elevation_mask_deg"))
                self.assertTrue(listener.transition("/receiver", Transition.TRANSITION_CONFIGURE))
                # The city is loaded; the receiver may still change.
                self.assertRegex(listener.set_parameter("/receiver", "city.synthetic.seed", 8), "run cleanup first")
                self.assertEqual(listener.set_parameter("/receiver", "elevation_mask_deg", 15.0), "")
                self.assertIn(engine.split("must")[-1].strip(),
                              listener.set_parameter("/receiver", "elevation_mask_deg", 95.0))
                self.assertTrue(listener.transition("/receiver", Transition.TRANSITION_ACTIVATE))
                self.assertEqual(listener.set_parameter("/receiver", "elevation_mask_deg", 5.0), "")
                self.assertRegex(listener.set_parameter("/receiver", "rate_hz", 5.0), "run cleanup first")

    def test_a_receiver_by_poses_changes_while_it_runs(self):
        with receiver(OPEN_FIELD) as node, Listener() as listener:
            poses = listener.node.create_publisher(PoseStamped, "/pose", 10)
            received = listener.listen(GnssSatellites, "/satellites")

            def above():
                """Satellites above the mask in the next message but one."""
                received.clear()
                end = time.monotonic() + 30
                while len(received) < 3 and time.monotonic() < end:
                    pose = PoseStamped()
                    pose.header.stamp = listener.node.get_clock().now().to_msg()
                    pose.pose.orientation.w = 1.0
                    poses.publish(pose)
                    listener.spin_for(0.05)
                return sum(s.above_mask for s in received[-1].satellites)

            self.assertGreater(above(), 0, node.output())
            self.assertEqual(listener.set_parameter("/receiver", "elevation_mask_deg", 60.0), "")
            high = above()
            self.assertTrue(all(s.above_mask == (s.elevation > math.radians(60)) for s in received[-1].satellites))
            self.assertEqual(listener.set_parameter("/receiver", "elevation_mask_deg", 5.0), "")
            self.assertGreater(above(), high)
            self.assertIn("95", listener.set_parameter("/receiver", "elevation_mask_deg", 95.0))


class Poses(unittest.TestCase):
    """Truth from topics: an ideal receiver in open sky reports its position."""

    def check(self, source, publish):
        with receiver({**OPEN_FIELD, "pose.source": source}) as node, Listener() as listener:
            fixes = listener.listen(NavSatFix, "/fix")
            reports = listener.listen(DiagnosticArray, "/diagnostics", reliable=True)
            listener.spin_until(lambda: fixes and reports or node.child.poll() is not None, "the first epoch")
            if "this build has no tf2" in node.output():
                self.skipTest("this build has no tf2")
            self.assertEqual(fixes[-1].status.status, -1)  # no pose yet
            self.assertTrue(math.isnan(fixes[-1].latitude))
            self.assertEqual(reports[-1].status[0].level, b"\x02")
            send = publish(listener.node)
            end = time.monotonic() + 30
            while not (fixes[-1].status.status == 0) and time.monotonic() < end:
                send(listener.node.get_clock().now().to_msg())
                listener.spin_for(0.05)
            self.assertEqual(fixes[-1].status.status, 0, node.output())
            latitude, longitude = geodetic(10, 5)
            self.assertAlmostEqual(fixes[-1].latitude, latitude, delta=1e-3 / 111e3)  # 1 mm
            self.assertAlmostEqual(fixes[-1].longitude, longitude, delta=1e-3 / 103e3)
            self.assertAlmostEqual(fixes[-1].altitude, 1.5, delta=1e-3)
            # Silence for longer than pose.timeout_s: no fix, no stale position.
            listener.spin_until(lambda: fixes[-1].status.status == -1, "the end of fixes")

    def test_pose_stamped(self):
        def publish(node):
            publisher = node.create_publisher(PoseStamped, "/pose", 10)

            def send(stamp):
                message = PoseStamped()
                message.header.stamp, message.header.frame_id = stamp, "map"
                p = message.pose.position
                p.x, p.y, p.z, message.pose.orientation.w = 10.0, 5.0, 1.5, 1.0
                publisher.publish(message)
            return send
        self.check("pose", publish)

    def test_odometry(self):
        def publish(node):
            publisher = node.create_publisher(Odometry, "/odom", 10)

            def send(stamp):
                message = Odometry()
                message.header.stamp, message.header.frame_id = stamp, "map"
                p = message.pose.pose.position
                p.x, p.y, p.z, message.pose.pose.orientation.w = 10.0, 5.0, 1.5, 1.0
                publisher.publish(message)
            return send
        self.check("odometry", publish)

    def test_tf(self):
        def publish(node):
            from tf2_msgs.msg import TFMessage
            publisher = node.create_publisher(TFMessage, "/tf", 100)

            def send(stamp):
                first, second = TransformStamped(), TransformStamped()
                first.header.stamp = second.header.stamp = stamp
                first.header.frame_id, first.child_frame_id = "map", "odom"
                second.header.frame_id, second.child_frame_id = "odom", "base_link"
                # 8 m east and 5 m north; then, heading north, 2 m to the right: 10 m east.
                first.transform.translation.x, first.transform.translation.y = 8.0, 5.0
                first.transform.rotation.w = first.transform.rotation.z = math.sqrt(0.5)
                second.transform.translation.y, second.transform.translation.z = -2.0, 1.5
                second.transform.rotation.w = 1.0
                publisher.publish(TFMessage(transforms=[first, second]))
            return send
        self.check("tf", publish)

    def test_simulated_time(self):
        """Epochs follow /clock: 2 Hz in its time, at any speed; if time goes back the receiver restarts."""
        with receiver({**OPEN_FIELD, "use_sim_time": True, "rate_hz": 2}) as node, Listener() as listener:
            fixes = listener.listen(NavSatFix, "/fix")
            clock = listener.node.create_publisher(Clock, "/clock", 10)
            poses = listener.node.create_publisher(PoseStamped, "/pose", 10)
            listener.spin_until(lambda: poses.get_subscription_count() and clock.get_subscription_count(), "the node")
            listener.spin_for(1)
            self.assertEqual(fixes, [])  # time has not begun

            def run(seconds):
                fixes.clear()
                for i in range(1, 20 * seconds + 1):
                    message, pose = Clock(), PoseStamped()
                    message.clock.sec, message.clock.nanosec = i // 20, i % 20 * 50_000_000
                    pose.header.stamp = message.clock
                    pose.pose.orientation.w = 1.0
                    clock.publish(message)
                    poses.publish(pose)
                    listener.spin_for(0.02)  # 2.5 times real time
                listener.spin_for(0.3)
                return [seconds_of(m.header.stamp) for m in fixes]

            for _ in range(2):
                stamps = run(5)
                self.assertTrue(all(m.status.status == 0 for m in fixes[1:]), node.output())
                self.assertIn(len(stamps), (10, 11), stamps)
                for before, after in zip(stamps[1:], stamps[2:]):  # the first comes at once
                    self.assertAlmostEqual(after - before, 0.5, delta=0.11)


class Composition(unittest.TestCase):
    def test_in_a_container(self):
        with folder() as path, Process(["ros2", "run", "rclcpp_components", "component_container"]) as container:
            drive = write_drive(path, 60)
            until(lambda: "/ComponentManager" in ros2("node", "list"), "the container")
            self.assertIn("canyon::adapters::ros2::ReceiverNode", ros2("component", "types", "canyon_ros2"))
            loaded = ros2("component", "load", "/ComponentManager", "canyon_ros2",
                          "canyon::adapters::ros2::ReceiverNode", "-e", "use_intra_process_comms:=true", "-n", "car",
                          *parameters({"scenario": drive, "autostart": True}))
            self.assertIn("/car", loaded)
            with Listener() as listener:
                fixes = listener.listen(NavSatFix, "/fix")
                listener.spin_until(lambda: len(fixes) > 5, "fixes of the container's receiver")
                self.assertEqual(listener.state("/car"), "active")
            self.assertIn("Unloaded", ros2("component", "unload", "/ComponentManager", "1"))
            self.assertIsNone(container.child.poll(), container.output())


class Bag(unittest.TestCase):
    def test_a_drive_played_back_is_the_same(self):
        if "bag" not in ros2("--help"):
            self.skipTest("SKIPPED: there is no `ros2 bag` here")
        kinds = {topic: kind for topic, kind in TOPICS.items()}
        with folder() as path:
            drive = write_drive(path, 5)
            bag = os.path.join(path, "bag")
            with receiver({"scenario": drive, "drive_clock": True}) as node, Listener() as listener:
                self.assertTrue(listener.transition("/receiver", Transition.TRANSITION_CONFIGURE), node.output())
                received = {topic: listener.listen(kind, topic) for topic, kind in kinds.items()}
                with Process(["ros2", "bag", "record", "-s", "sqlite3", "-o", bag, *kinds]) as recorder:
                    until(lambda: all(f"Subscribed to topic '{topic}'" in recorder.output() for topic in kinds),
                          "the recorder")
                    self.assertTrue(listener.transition("/receiver", Transition.TRANSITION_ACTIVATE), node.output())
                    listener.spin_until(lambda: len(received["/fix"]) == 51, "the drive")
                    listener.spin_for(1)
            print(ros2("bag", "info", bag))
            with Listener() as listener:
                played = {topic: listener.listen(kind, topic) for topic, kind in kinds.items()}
                with Process(["ros2", "bag", "play", bag, "--delay", "2"]) as player:
                    until_end = time.monotonic() + 40
                    while player.child.poll() is None and time.monotonic() < until_end:
                        listener.spin_for(0.1)
                    self.assertEqual(player.child.returncode, 0, player.output())
                listener.spin_for(0.5)
        for topic in kinds:
            # NaN is not equal to itself, its text is.
            self.assertEqual([str(m) for m in played[topic]], [str(m) for m in received[topic]], topic)
        print({topic: len(messages) for topic, messages in played.items()})


class Launch(unittest.TestCase):
    def test_arguments_are_told(self):
        for name in ("demo", "hongkong_drive", "driver", "gz_sim", "mixed_reality"):
            said = ros2("launch", "canyon_ros2", f"{name}.launch.py", "--show-args")
            self.assertRegex(said, "Arguments")
            self.assertGreater(said.count("default:"), 1, said)

    def test_a_drive(self):
        with folder() as path, Listener() as listener:
            fixes = listener.listen(NavSatFix, "/car/fix")
            drive = write_drive(path, 3)
            with Process(["ros2", "launch", "canyon_ros2", "hongkong_drive.launch.py", f"scenario:={drive}",
                          "namespace:=car"]) as launch:
                listener.spin_until(lambda: len(fixes) > 20, "fixes of the launched drive")
                until(lambda: "the drive has ended" in launch.output(), "its end")

    def test_the_demo(self):
        """Without a screen; the fixes are those of `canyon simulate`."""
        with folder() as path, Listener() as listener:
            drive = write_drive(path, 3)
            epochs, _ = simulated(drive, os.path.join(path, "out"))
            fixes = listener.listen(NavSatFix, "/fix", reliable=True)
            with Process(["ros2", "launch", "canyon_ros2", "demo.launch.py", f"scenario:={drive}", "rviz:=false"]) as launch:
                until(lambda: "the drive has ended" in launch.output(), "the end of the demo's drive")
                listener.spin_until(lambda: len(fixes) > 20, launch.output())
                listener.spin_for(0.5)
        self.assertAlmostEqual(fixes[-1].latitude, float(epochs[-1]["fix_latitude_deg"]), delta=6e-11)

    def test_names_of_a_driver(self):
        with folder() as path, Listener() as listener:
            fixes = listener.listen(NavSatFix, "/car/ublox_gps_node/fix", reliable=True)
            velocities = listener.listen(TwistWithCovarianceStamped, "/car/ublox_gps_node/fix_velocity", reliable=True)
            drive = write_drive(path, 20)
            with Process(["ros2", "launch", "canyon_ros2", "driver.launch.py", f"scenario:={drive}", "namespace:=car"]):
                listener.spin_until(lambda: min(len(fixes), len(velocities)) > 10, "fixes by the driver's names")
            self.assertEqual(fixes[0].header.frame_id, "gps")

    def test_gps_fix_beside_the_fix(self):
        try:
            from gps_msgs.msg import GPSFix
        except ImportError:
            self.skipTest("SKIPPED: no gps_msgs here")
        with folder() as path, Listener() as listener:
            fixes = listener.listen(NavSatFix, "/navsatfix", reliable=True)
            full = listener.listen(GPSFix, "/gpsfix", reliable=True)
            with Process(["ros2", "launch", "canyon_ros2", "driver.launch.py", "driver:=septentrio_gnss_driver",
                          f"scenario:={write_drive(path, 20)}"]):
                listener.spin_until(lambda: min(len(fixes), len(full)) > 10, "fixes")
        by_stamp = {seconds_of(m.header.stamp): m for m in fixes}
        both = [(m, by_stamp[seconds_of(m.header.stamp)]) for m in full if seconds_of(m.header.stamp) in by_stamp]
        self.assertGreater(len(both), 5)
        for fix, plain in both:
            self.assertEqual((fix.latitude, fix.altitude, fix.status.status),
                             (plain.latitude, plain.altitude, plain.status.status))
            self.assertEqual(fix.status.satellites_used, len(fix.status.satellite_used_prn))

    def test_mixed_reality(self):
        with Listener() as listener:
            fixes = listener.listen(NavSatFix, "/fix")
            poses = listener.node.create_publisher(PoseStamped, "/vicon/pose", 10)
            with Process(["ros2", "launch", "canyon_ros2", "mixed_reality.launch.py", "pose_topic:=/vicon/pose",
                          "latitude_deg:=22.3", "longitude_deg:=114.17", "profile:=ideal"]) as launch:
                end = time.monotonic() + 40
                while time.monotonic() < end and not (fixes and fixes[-1].status.status == 0):
                    pose = PoseStamped()
                    pose.header.stamp = listener.node.get_clock().now().to_msg()
                    pose.pose.orientation.w, pose.pose.position.z = 1.0, 30.0
                    poses.publish(pose)
                    listener.spin_for(0.05)
                self.assertTrue(fixes and fixes[-1].status.status == 0, launch.output())


class HongKong(unittest.TestCase):
    def test_hong_kong(self):
        """The recorded drive, 20 times as fast, beside `canyon simulate` of the same files."""
        here = os.path.dirname(os.path.abspath(__file__))
        data = os.path.normpath(os.path.join(here, "..", "..", "..", "shared", "data"))
        if not os.path.exists(os.path.join(data, "hongkong", "buildings.dae")):
            self.skipTest("SKIPPED: the recorded drive of Hong Kong (../shared/data) is not here")
        with folder() as path, Listener() as listener:
            with open(os.path.join(here, "..", "..", "examples", "urbannav_tst.yaml")) as file:
                text = file.read()
            for name in ("hongkong", "urbannav-tst-20190428"):
                os.symlink(os.path.join(data, name), os.path.join(path, name))
            scenario = os.path.join(path, "drive.yaml")
            with open(scenario, "w") as file:
                file.write(text + "\noutputs: {pictures: false}\n")
            epochs, _ = simulated(scenario, os.path.join(path, "out"))
            fixes = listener.listen(NavSatFix, "/fix")
            with Process(["ros2", "launch", "canyon_ros2", "hongkong_drive.launch.py", f"data:={data}",
                          "speed:=20"]) as launch:
                listener.spin_until(lambda: len(fixes) > 300, "fixes of the drive", 120)
            self.assertNotIn("ERROR", launch.output())
            # A subscriber that joined late misses the first; those received stand where their stamps say.
            interval = float(epochs[1]["gps_tow"]) - float(epochs[0]["gps_tow"])
            for fix in fixes:
                row = epochs[round(seconds_of(fix.header.stamp) / interval)]
                self.assertEqual(fix.status.status, 0 if row["status"] == "fix" else -1)
                if row["status"] == "fix":
                    self.assertAlmostEqual(fix.latitude, float(row["fix_latitude_deg"]), delta=6e-11)
                    self.assertAlmostEqual(fix.longitude, float(row["fix_longitude_deg"]), delta=6e-11)
            print(f"{len(fixes)} of {len(epochs)} epochs heard, none differs")


def tearDownModule():  # noqa: N802: unittest's name
    """Commands of ros2 leave a process behind that remembers the domain."""
    ros2("daemon", "stop", check=False)


if __name__ == "__main__":
    assert os.path.isdir(PREFIX)
    unittest.main(verbosity=2)
