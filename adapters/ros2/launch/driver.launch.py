"""A receiver that replaces a real receiver's driver: its node and its topics have the driver's names.

The driver's parameters are not read: use Canyon's own, in a scenario file or a parameter file.
"""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

# For each driver: its node's name, the frame of its messages, whether its fixes report only variances, and its topics.
DRIVERS = {
    "ublox_gps": ("ublox_gps_node", "gps", True, [("fix", "~/fix"), ("fix_velocity", "~/fix_velocity")]),
    "septentrio_gnss_driver": ("septentrio_gnss", "gnss", False, [("fix", "navsatfix"), ("fix_velocity", "twist_gnss")]),
    "nmea_navsat_driver": ("nmea_navsat_driver", "gps", True, []),
}
ARGUMENTS = {
    "driver": ("ublox_gps", "driver whose names are used: " + ", ".join(DRIVERS)),
    "scenario": ("", "scenario file with the receiver"),
    "parameters": ("", "parameter file of the node receiver, overrides the scenario"),
    "frame_id": ("", "frame of all messages; empty: the driver's"),
    "namespace": ("", "namespace of node and topics"),
    "use_sim_time": ("false", "use /clock"),
}


def receiver(context):
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    if given["driver"] not in DRIVERS:
        raise RuntimeError(f"driver:={given['driver']} is not known; use one of {', '.join(DRIVERS)}")
    node, frame_id, diagonal, topics = DRIVERS[given["driver"]]
    values = {"autostart": True, "scenario": given["scenario"], "frame_id": given["frame_id"] or frame_id,
              "diagonal_covariance": diagonal, "use_sim_time": given["use_sim_time"].lower() == "true"}
    return [Node(package="canyon_ros2", executable="receiver", name=node, namespace=given["namespace"], output="screen",
                 parameters=[values, *([given["parameters"]] if given["parameters"] else [])], remappings=topics)]


def generate_launch_description():
    arguments = [DeclareLaunchArgument(name, default_value=value, description=text)
                 for name, (value, text) in ARGUMENTS.items()]
    return LaunchDescription([*arguments, OpaqueFunction(function=receiver)])
