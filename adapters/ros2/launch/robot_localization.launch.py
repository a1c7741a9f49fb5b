"""robot_localization on a simulated drive: an EKF of wheels, gyroscope and the receiver's fixes by navsat_transform_node."""
import os

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

SHARE = get_package_share_directory("canyon_ros2")
ARGUMENTS = {
    "scenario": (os.path.join(SHARE, "dead_reckoning.yaml"), "with a trajectory and sensors: {imu: ..., wheels: ...}"),
    "receiver": ("f9p", "name of one of its receivers"),
    "speed": ("1.0", "speed of the clock, relative to real time"),
    "latitude_deg": ("22.3", "origin of the filter's frame"),
    "longitude_deg": ("114.17", "origin of the filter's frame"),
    "yaw_rad": ("3.14159", "heading of the vehicle at the start, from east counter-clockwise"),
    "autostart": ("true", "the drive starts automatically; false: when the node is activated"),
}


def nodes(context):
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    simulated = {"use_sim_time": True}
    receiver = Node(package="canyon_ros2", executable="receiver", output="screen",
                    parameters=[{"scenario": given["scenario"], "receiver": given["receiver"], "drive_clock": True,
                                 "diagonal_covariance": True,    # in two dimensions the filter uses cross terms of height
                                 "speed": float(given["speed"]), "autostart": given["autostart"].lower() == "true"}])
    # Antenna and axle are at the trajectory's point: without a lever arm the frames coincide.
    frames = [Node(package="tf2_ros", executable="static_transform_publisher",
                   arguments=["--frame-id", "base_link", "--child-frame-id", frame]) for frame in ("gnss", "imu")]
    datum = [float(given["latitude_deg"]), float(given["longitude_deg"]), 0.0]
    configuration = os.path.join(SHARE, "robot_localization.yaml")
    state = [0.0] * 15
    state[5] = float(given["yaw_rad"])
    ekf = Node(package="robot_localization", executable="ekf_node", name="ekf_filter_node", output="screen",
               parameters=[configuration, simulated, {"initial_state": state}])
    navsat = Node(package="robot_localization", executable="navsat_transform_node", name="navsat_transform",
                  output="screen", parameters=[configuration, simulated, {"datum": datum}],
                  remappings=[("gps/fix", "fix")])
    return [receiver, *frames, ekf, navsat]


def generate_launch_description():
    arguments = [DeclareLaunchArgument(name, default_value=value, description=text)
                 for name, (value, text) in ARGUMENTS.items()]
    return LaunchDescription([*arguments, OpaqueFunction(function=nodes)])
