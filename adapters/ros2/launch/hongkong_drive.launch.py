"""A scenario's own drive as ROS 2 topics: by default the recorded drive in Hong Kong."""
import os

from ament_index_python.packages import get_package_share_directory
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

ARGUMENTS = {
    "data": ("", "folder with hongkong/ and urbannav-tst-20190428/, for the default scenario"),
    "scenario": ("", "another scenario with a trajectory"),
    "receiver": ("", "name of one of its receivers; empty: the first"),
    "namespace": ("", "namespace of node and topics"),
    "drive_clock": ("true", "publish /clock and use it; else the node's time"),
    "speed": ("1.0", "speed of that clock, relative to real time"),
    "frame_id": ("gnss", "frame of all messages"),
}


def receiver(context):
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    values = {"autostart": True, "drive_clock": given["drive_clock"].lower() == "true", "speed": float(given["speed"]),
              "receiver": given["receiver"], "frame_id": given["frame_id"], "scenario": given["scenario"]}
    if not given["scenario"]:
        if not given["data"]:
            raise RuntimeError("give data:=FOLDER with the recorded drive, or scenario:=FILE with another one")
        recorded = os.path.join(os.path.abspath(given["data"]), "urbannav-tst-20190428")
        values.update({
            "scenario": os.path.join(get_package_share_directory("canyon_ros2"), "urbannav_tst.yaml"),
            "city.mesh": os.path.join(os.path.abspath(given["data"]), "hongkong", "buildings.dae"),
            "sky.navigation": [os.path.join(recorded, name) for name in ("hksc1180.19n", "hksc1180.19b")],
            "trajectory.file": os.path.join(recorded, "groundTruth_TST.csv")})
    return [Node(package="canyon_ros2", executable="receiver", namespace=given["namespace"], output="screen",
                 parameters=[values])]


def generate_launch_description():
    arguments = [DeclareLaunchArgument(name, default_value=value, description=text)
                 for name, (value, text) in ARGUMENTS.items()]
    return LaunchDescription([*arguments, OpaqueFunction(function=receiver)])
