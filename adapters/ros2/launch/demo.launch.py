"""A car in a synthetic downtown: its receiver, and RViz, if installed, with fixes and their reported accuracy."""
import os
import sys

from ament_index_python.packages import get_package_share_directory, get_packages_with_prefixes
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, ExecuteProcess, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

SHARE = get_package_share_directory("canyon_ros2")
ARGUMENTS = {
    "scenario": (os.path.join(SHARE, "synthetic_drive.yaml"), "scenario file with a trajectory"),
    "profile": ("", "profile of the receiver; empty: the scenario's"),
    "rviz": ("true", "show the fixes in RViz, if it is installed"),
}


def processes(context):
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    values = {"scenario": given["scenario"], "autostart": True, **({"profile": given["profile"]} if given["profile"] else {})}
    receiver = Node(package="canyon_ros2", executable="receiver", output="screen", parameters=[values])
    if given["rviz"].lower() != "true" or "rviz2" not in get_packages_with_prefixes():
        return [receiver]
    return [ExecuteProcess(cmd=[sys.executable, os.path.join(SHARE, "launch", "show_fixes.py")], output="screen"), receiver,
            Node(package="rviz2", executable="rviz2", arguments=["-d", os.path.join(SHARE, "demo.rviz")])]


def generate_launch_description():
    arguments = [DeclareLaunchArgument(name, default_value=value, description=text)
                 for name, (value, text) in ARGUMENTS.items()]
    return LaunchDescription([*arguments, OpaqueFunction(function=processes)])
