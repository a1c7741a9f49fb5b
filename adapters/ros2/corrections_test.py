#!/usr/bin/env python3
"""RTCM 3 over topics of rtcm_msgs/Message, between processes: see processes_test.py."""
import os
import sys
import time
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from testing.processes import ORIGIN, Listener, folder, receiver, until  # noqa: E402

from canyon_msgs.msg import GnssSatellites  # noqa: E402
from geometry_msgs.msg import PoseStamped  # noqa: E402

try:
    from rtcm_msgs.msg import Message
except ImportError:
    Message = None

FIELD = {**ORIGIN, "city.open": True, "profile": "ublox-f9p", "sky.nominal": True, "autostart": True}
BASE = {**FIELD, "pose.source": "fixed", "fixed.east_m": 900.0, "fixed.north_m": 300.0, "fixed.up_m": 5.0,
        "rate_hz": 1.0, "streams": "['rtcm=topic:/rtcm']"}
ROVER = {**FIELD, "pose.source": "pose", "rtk.enabled": True, "corrections.from": "topic:rtcm",
         "corrections.max_age_s": 3.0}
DRIVE = """
city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17}}
sky: {nominal: true}
start: 2026-06-01T08:00:00Z
rate_hz: 2
duration_s: 20
trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2}, {east_m: 0, north_m: 300, up_m: 2}], speed_mps: 5}
receivers: [{name: car, profile: ublox-f9p, rtk: true, corrections: {from: "topic:/rtcm"}}]
"""


def base_node(values=BASE, *more):
    return receiver(values, "-r", "__ns:=/base", *more)


@unittest.skipIf(Message is None, "SKIPPED: there is no rtcm_msgs here")
class Corrections(unittest.TestCase):
    def drive(self, listener, poses, seen, node, kind, seconds=60):
        """Sends poses until the last five epochs have a fix of this kind."""
        end = time.monotonic() + seconds
        while [m.fix_kind for m in seen[-5:]] != 5 * [kind]:
            self.assertLess(time.monotonic(), end, f"{[m.fix_kind for m in seen[-5:]]}, not {kind}\n{node.output()}")
            pose = PoseStamped()
            pose.header.stamp = listener.node.get_clock().now().to_msg()
            pose.pose.orientation.w, pose.pose.position.z = 1.0, 2.0
            poses.publish(pose)
            listener.spin_for(0.05)

    def test_a_rover_is_fixed_while_a_base_publishes(self):
        with receiver(ROVER) as rover, Listener() as listener:
            seen = listener.listen(GnssSatellites, "/satellites")
            messages = listener.listen(Message, "/rtcm", reliable=True)
            poses = listener.node.create_publisher(PoseStamped, "/pose", 10)
            self.drive(listener, poses, seen, rover, GnssSatellites.KIND_SINGLE)
            with base_node() as base:
                self.drive(listener, poses, seen, rover, GnssSatellites.KIND_FIXED)
                self.assertLess(seen[-1].correction_age, 3)
                numbers = []
                for message in messages:
                    data = bytes(message.message)
                    # Preamble, 6 + 10 bits of length, the message, its checksum.
                    self.assertEqual((data[0], len(data)), (0xD3, 6 + (data[1] << 8 | data[2])))
                    numbers.append(data[3] << 4 | data[4] >> 4)
                    self.assertEqual(message.header.frame_id, "gnss")
                self.assertEqual(numbers[0], 1005)
                self.assertLessEqual({1033, 1077, 1087, 1097, 1127}, set(numbers))
                # Bytes that are not RTCM 3 are reported once, without effect.
                rogue = listener.node.create_publisher(Message, "/rtcm", 10)
                for _ in range(3):
                    for data in (b"", bytes(range(256)) * 8, b"\xd3" * 200_000):
                        rogue.publish(Message(message=data))
                        listener.spin_for(0.1)
                self.drive(listener, poses, seen, rover, GnssSatellites.KIND_FIXED)
                for text in ("has no bytes", "are not a valid RTCM 3 frame", "200000 bytes and is not read"):
                    until(lambda text=text: text in rover.output(), text)
                    self.assertEqual(rover.output().count(text), 1, rover.output())
                self.assertNotIn("ERROR", base.output())
            self.drive(listener, poses, seen, rover, GnssSatellites.KIND_SINGLE)
            self.assertIsNone(rover.child.poll(), rover.output())

    def test_the_topic_changes_while_it_runs(self):
        with receiver(ROVER) as rover, base_node({**BASE, "streams": "['rtcm=topic:rtcm']"}), Listener() as listener:
            seen = listener.listen(GnssSatellites, "/satellites")
            poses = listener.node.create_publisher(PoseStamped, "/pose", 10)
            self.drive(listener, poses, seen, rover, GnssSatellites.KIND_SINGLE)
            self.assertIn("does not name a topic", listener.set_parameter("/receiver", "corrections.from", "topic:a b"))
            self.assertEqual(listener.set_parameter("/receiver", "corrections.from", "topic:/base/rtcm"), "")
            self.drive(listener, poses, seen, rover, GnssSatellites.KIND_FIXED)

    def test_a_scenarios_own_drive(self):
        """Both use the clock driven by the rover, from the same start."""
        with folder() as path, Listener() as listener:
            drive = os.path.join(path, "drive.yaml")
            with open(drive, "w") as file:
                file.write(DRIVE)
            seen = listener.listen(GnssSatellites, "/satellites")
            with base_node({**BASE, "use_sim_time": True, "start": "2026-06-01T08:00:00Z"}):
                listener.spin_until(lambda: listener.node.get_publishers_info_by_topic("/base/fix"), "the base")
                with receiver({"scenario": drive, "drive_clock": True, "autostart": True}) as rover:
                    until(lambda: "the drive has ended" in rover.output() or listener.spin_for(0.1), "the end")
                    listener.spin_for(0.5)
            kinds = [m.fix_kind for m in seen]
            self.assertGreater(len(kinds), 35, rover.output())
            self.assertGreater(kinds.count(GnssSatellites.KIND_FIXED), 25, kinds)
            self.assertNotRegex(rover.output(), r"WARN.*\[receiver\]")  # rcl has warnings of its own


if __name__ == "__main__":
    unittest.main(verbosity=2)
