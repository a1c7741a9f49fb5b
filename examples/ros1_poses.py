#!/usr/bin/env python3
"""Poses of ROS 1 into `canyon live`: each message of a topic as one line of JSON in a UDP datagram.

    canyon live drive.yaml --poses udp-listen://127.0.0.1:9001 --stream nmea=tcp://127.0.0.1:10110
    python3 ros1_poses.py /mocap/rover/pose --to 127.0.0.1:9001
    python3 ros1_poses.py /odom --odometry --id rover

Position and attitude are sent unchanged: those of the vehicle's body (REP 103: x forward, y left, z up) in the frame of
header.frame_id, which is treated as x east, y north, z up unless the scenario's live.poses transforms it (axes, heading_deg,
east_m, ...). Odometry's pose is used, not its twist, which may be in another frame; velocities are computed from poses.
Stamps are those of the headers; without a stamp, canyon live uses the time of reception. Needs rospy and geometry_msgs, with
--odometry nav_msgs.
"""
import argparse
import json
import socket

import rospy


def line_of(header, pose, name):
    """One pose in the format of docs/live.md."""
    p, q = pose.position, pose.orientation
    line = {"position_m": [p.x, p.y, p.z], "attitude": [q.w, q.x, q.y, q.z]}
    if not header.stamp.is_zero():
        line["time_s"] = header.stamp.to_sec()
    if name:
        line["id"] = name
    return json.dumps(line) + "\n"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("topic")
    parser.add_argument("--odometry", action="store_true", help="nav_msgs/Odometry instead of geometry_msgs/PoseStamped")
    parser.add_argument("--to", default="127.0.0.1:9001", metavar="HOST:PORT", help="address of canyon live (127.0.0.1:9001)")
    parser.add_argument("--id", default="", metavar="NAME", help="of the vehicle, if several send to one port")
    arguments = parser.parse_args(rospy.myargv()[1:])
    host, port = arguments.to.rsplit(":", 1)
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    frames = set()

    def send(header, pose):
        if header.frame_id not in frames:
            frames.add(header.frame_id)
            rospy.loginfo("poses of %s in the frame '%s' go to %s", arguments.topic, header.frame_id, arguments.to)
        out.sendto(line_of(header, pose, arguments.id).encode(), (host, int(port)))

    rospy.init_node("canyon_poses", anonymous=True)
    if arguments.odometry:
        from nav_msgs.msg import Odometry
        rospy.Subscriber(arguments.topic, Odometry, lambda m: send(m.header, m.pose.pose), tcp_nodelay=True)
    else:
        from geometry_msgs.msg import PoseStamped
        rospy.Subscriber(arguments.topic, PoseStamped, lambda m: send(m.header, m.pose), tcp_nodelay=True)
    rospy.spin()


if __name__ == "__main__":
    main()
