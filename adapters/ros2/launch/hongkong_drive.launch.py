"""A scenario's own drive, that of Hong Kong where nothing else is said, as ROS 2 topics."""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue


def generate_launch_description():
    arguments = [
        DeclareLaunchArgument(
            "data", default_value="../shared/data",
            description="folder with the recorded drive (hongkong/, urbannav-tst-20190428/), of the default scenario"),
        DeclareLaunchArgument(
            "scenario",
            default_value=PathJoinSubstitution([LaunchConfiguration("data"), "urbannav_tst.yaml"]),
            description="scenario file with a trajectory; examples/urbannav_tst.yaml put into the data's folder"),
        DeclareLaunchArgument("receiver", default_value="", description="which of its receivers; empty: the first"),
        DeclareLaunchArgument("namespace", default_value="", description="of node and topics"),
        DeclareLaunchArgument("drive_clock", default_value="true", description="publish /clock and go by it"),
        DeclareLaunchArgument("speed", default_value="1.0", description="of that clock, times real time"),
        DeclareLaunchArgument("frame_id", default_value="gnss", description="of all messages"),
    ]

    def value(name, kind):
        return ParameterValue(LaunchConfiguration(name), value_type=kind)

    node = Node(package="canyon_ros2", executable="receiver", namespace=LaunchConfiguration("namespace"), output="screen",
                parameters=[{"scenario": value("scenario", str), "receiver": value("receiver", str),
                             "drive_clock": value("drive_clock", bool), "speed": value("speed", float),
                             "frame_id": value("frame_id", str), "autostart": True}])
    return LaunchDescription([*arguments, node])
