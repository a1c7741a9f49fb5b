"""Fixes for RViz, which does not draw NavSatFix: fix_path, and fix_pose with covariance, in metres east, north, up of the first."""
import math

import rclpy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from nav_msgs.msg import Path
from sensor_msgs.msg import NavSatFix


def enu(origin, place):
    """From one (latitude, longitude, height) to another near it [rad, m], by WGS 84's radii of curvature at the first."""
    a, e2 = 6378137.0, 6.69437999014e-3
    w = 1 - e2 * math.sin(origin[0]) ** 2
    north, east, up = (there - here for here, there in zip(origin, place))
    return ((a / math.sqrt(w) + origin[2]) * math.cos(origin[0]) * east, (a * (1 - e2) / w ** 1.5 + origin[2]) * north, up)


def main():
    rclpy.init()
    node = rclpy.create_node("show_fixes")
    path, paths = Path(), node.create_publisher(Path, "fix_path", 10)
    poses, origin = node.create_publisher(PoseWithCovarianceStamped, "fix_pose", 10), []

    def show(fix):
        place = (math.radians(fix.latitude), math.radians(fix.longitude), fix.altitude)
        if not all(map(math.isfinite, place)):
            return
        origin.append(place)
        stamped, pose = PoseStamped(), PoseWithCovarianceStamped()
        for header in (stamped.header, pose.header, path.header):
            header.frame_id, header.stamp = "map", fix.header.stamp
        stamped.pose.position.x, stamped.pose.position.y, stamped.pose.position.z = enu(origin[0], place)
        pose.pose.pose = stamped.pose
        for row in range(3):
            pose.pose.covariance[6 * row:6 * row + 3] = fix.position_covariance[3 * row:3 * row + 3]
        path.poses.append(stamped)
        paths.publish(path)
        poses.publish(pose)

    node.create_subscription(NavSatFix, "fix", show, 10)
    rclpy.spin(node)


if __name__ == "__main__":
    main()
