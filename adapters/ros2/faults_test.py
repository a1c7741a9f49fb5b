#!/usr/bin/env python3
"""Faults of the receiver's node by services, between processes: see processes_test.py."""
import math
import os
import sys
import time
import unittest

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from testing.processes import OPEN_FIELD, Listener, folder, receiver, ros2, write_drive  # noqa: E402

from canyon_msgs.srv import FaultCommand  # noqa: E402
from diagnostic_msgs.msg import DiagnosticArray  # noqa: E402
from geometry_msgs.msg import PoseStamped  # noqa: E402
from lifecycle_msgs.msg import Transition  # noqa: E402
from sensor_msgs.msg import NavSatFix, NavSatStatus  # noqa: E402


class Faults(unittest.TestCase):
    """Faults added and ended by services, while poses arrive."""

    def ask(self, listener, service, text=""):
        reply = listener.call(FaultCommand, f"/receiver/{service}", FaultCommand.Request(fault=text))
        return reply.success, reply.message

    def test_come_and_go(self):
        with receiver({**OPEN_FIELD, "live.changes": True, "name": "car"}) as node, Listener() as listener:
            fixes = listener.listen(NavSatFix, "/fix")
            poses = listener.node.create_publisher(PoseStamped, "/pose", 10)

            def reaches(status):
                """Whether four successive fixes have this status, while poses arrive."""
                end = time.monotonic() + 30
                fixes.clear()
                while [m.status.status for m in fixes[-4:]] != 4 * [status] and time.monotonic() < end:
                    pose = PoseStamped()
                    pose.header.stamp = listener.node.get_clock().now().to_msg()
                    pose.pose.orientation.w, pose.pose.position.z = 1.0, 2.0
                    poses.publish(pose)
                    listener.spin_for(0.05)
                return [m.status.status for m in fixes[-4:]] == 4 * [status]

            self.assertTrue(reaches(0), node.output())
            self.assertEqual(self.ask(listener, "get_faults"), (True, "none"))
            self.assertEqual(self.ask(listener, "add_fault", "{name: dark, outage: {}}"), (True, "added car: dark"))
            self.assertTrue(reaches(-1))  # without a satellite there is no fix
            done, said = self.ask(listener, "get_faults")
            self.assertTrue(done)
            self.assertRegex(said, r"^car: dark \(outage\) from [0-9.]+ s, at work$")
            # As typed by a user.
            typed = ros2("service", "call", "/receiver/end_fault", "canyon_msgs/srv/FaultCommand", "{fault: dark}")
            self.assertIn("success=True, message='ended car: dark'", typed)
            self.assertTrue(reaches(0))
            done, said = self.ask(listener, "add_fault", "{outage: {satelites: G05}}")
            self.assertFalse(done)
            self.assertRegex(said, "refused: .*satelites.*'satellites'")
            self.assertEqual(self.ask(listener, "end_fault", "bright")[0], False)

    def test_are_refused_where_nothing_may_change(self):
        with receiver(OPEN_FIELD) as node, Listener() as listener:
            reports = listener.listen(DiagnosticArray, "/diagnostics", reliable=True)
            listener.spin_until(lambda: reports, node.output())
            done, said = self.ask(listener, "add_fault", "{outage: {}}")
            self.assertFalse(done)
            self.assertIn("live.changes", said)
            self.assertEqual(self.ask(listener, "end_fault", "outage 1")[0], False)
            self.assertEqual(self.ask(listener, "get_faults"), (True, "none"))

    def test_come_and_go_in_a_scenarios_own_drive(self):
        with folder() as path:
            values = {"scenario": write_drive(path, 60), "live.changes": True}
            with receiver(values) as node, Listener() as listener:
                self.assertTrue(listener.transition("/receiver", Transition.TRANSITION_CONFIGURE), node.output())
                self.assertIn("activate", self.ask(listener, "add_fault", "{outage: {}}")[1])
                self.assertTrue(listener.transition("/receiver", Transition.TRANSITION_ACTIVATE), node.output())
                fixes = listener.listen(NavSatFix, "/fix")
                for service, text, status in (("add_fault", "{name: dark, outage: {}}", -1), ("end_fault", "dark", 0)):
                    done, said = self.ask(listener, service, text)
                    self.assertTrue(done, said)
                    fixes.clear()
                    listener.spin_until(lambda: [m.status.status for m in fixes[-4:]] == 4 * [status], service)

    def test_a_forced_fix_states_its_kind(self):
        """docs/faults.md, "force": status, and the reported deviations of east and of the height."""
        kinds = {"float": (NavSatStatus.STATUS_GBAS_FIX, 0.2, 0.4), "fixed": (NavSatStatus.STATUS_GBAS_FIX, 0.01, 0.02),
                 "single": (NavSatStatus.STATUS_FIX, 1, 2), "none": (NavSatStatus.STATUS_NO_FIX, math.nan, math.nan)}
        with folder() as path:
            values = {"scenario": write_drive(path, 60), "live.changes": True, "autostart": True}
            with receiver(values) as node, Listener() as listener:
                fixes = listener.listen(NavSatFix, "/fix")
                listener.spin_until(lambda: fixes, node.output())
                for kind, (status, east_m, up_m) in kinds.items():
                    done, said = self.ask(listener, "add_fault", f"{{name: {kind}, force: {{fix: {kind}}}}}")
                    self.assertTrue(done, said)
                    fixes.clear()
                    listener.spin_until(lambda: len(fixes) > 4, kind)
                    self.assertEqual(fixes[-1].status.status, status, kind)
                    self.assertEqual(math.isnan(fixes[-1].latitude), kind == "none")
                    for stated, expected_m in ((fixes[-1].position_covariance[i], m) for i, m in ((0, east_m), (8, up_m))):
                        self.assertTrue(math.isclose(stated, expected_m**2, rel_tol=1e-9) or kind == "none", (kind, stated))
                    self.assertTrue(self.ask(listener, "end_fault", kind)[0])


if __name__ == "__main__":
    unittest.main(verbosity=2)
