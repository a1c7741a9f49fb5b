"""A receiver in place of a real one's driver: its node has the driver's name, and its topics have the driver's names.

Parameters of the driver are not read: they are Canyon's own, in a scenario file or a file of parameters.
"""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

# Of each driver: its node's name, the frame of its messages, whether its fixes state variances alone, and its topics.
DRIVERS = {
    "ublox_gps": ("ublox_gps_node", "gps", True, [("fix", "~/fix"), ("fix_velocity", "~/fix_velocity")]),
    "septentrio_gnss_driver": ("septentrio_gnss", "gnss", False, [("fix", "navsatfix"), ("fix_velocity", "twist_gnss")]),
    "nmea_navsat_driver": ("nmea_navsat_driver", "gps", True, []),
}
ARGUMENTS = {
    "driver": ("ublox_gps", "whose names it takes: " + ", ".join(DRIVERS)),
    "scenario": ("", "scenario file with the receiver"),
    "parameters": ("", "file of parameters of the node receiver, over the scenario"),
    "frame_id": ("", "of all messages; empty: the driver's"),
    "namespace": ("", "of node and topics"),
    "use_sim_time": ("false", "go by /clock"),
}


def receiver(context):
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    if given["driver"] not in DRIVERS:
        raise RuntimeError(f"driver:={given['driver']} is not known; it is one of {', '.join(DRIVERS)}")
    node, frame_id, diagonal, topics = DRIVERS[given["driver"]]
    values = {"autostart": True, "scenario": given["scenario"], "frame_id": given["frame_id"] or frame_id,
              "diagonal_covariance": diagonal, "use_sim_time": given["use_sim_time"].lower() == "true"}
    return [Node(package="canyon_ros2", executable="receiver", name=node, namespace=given["namespace"], output="screen",
                 parameters=[values, *([given["parameters"]] if given["parameters"] else [])], remappings=topics)]


def generate_launch_description():
    arguments = [DeclareLaunchArgument(name, default_value=value, description=text)
                 for name, (value, text) in ARGUMENTS.items()]
    return LaunchDescription([*arguments, OpaqueFunction(function=receiver)])
