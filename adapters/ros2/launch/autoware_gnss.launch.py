"""A receiver for Autoware instead of the car's: turns a simulator's true poses in the map into a fix and gnss_poser's pose.

Topics are those of Autoware's sample sensor kit, poses those of AWSIM. With gnss_poser:=false Autoware's own launch files
start the poser.
"""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

ARGUMENTS = {
    "map_projector": ("", "map_projector_info.yaml of the map"),
    "scenario": ("", "scenario file with the map's city and the receiver; its trajectory is not used"),
    "pose_topic": ("/awsim/ground_truth/vehicle/pose", "geometry_msgs/PoseStamped of the vehicle in the map"),
    "fix_topic": ("/sensing/gnss/ublox/nav_sat_fix", "sensor_msgs/NavSatFix of the receiver"),
    "frame_id": ("gnss_link", "frame of the antenna"),
    "gnss_poser": ("true", "also start autoware_gnss_poser"),
    "orientation": ("false", "the poser uses the attitude of a receiver with dead reckoning or two antennas"),
    "use_sim_time": ("true", "use /clock"),
}


def nodes(context):
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    for name in ("map_projector", "scenario"):
        if not given[name]:
            raise RuntimeError(f"give {name}:=FILE, the {ARGUMENTS[name][1]}")
    time = {"use_sim_time": given["use_sim_time"].lower() == "true"}
    receiver = Node(package="canyon_ros2", executable="receiver", name="ublox", namespace="/sensing/gnss",
                    output="screen",
                    parameters=[time, {"autostart": True, "diagonal_covariance": True, "scenario": given["scenario"],
                                       "frame_id": given["frame_id"], "pose.source": "pose",
                                       "pose.map_projector": given["map_projector"]}],
                    remappings=[("fix", given["fix_topic"]), ("fix_velocity", "~/fix_velocity"), ("pose", given["pose_topic"]),
                                 ("autoware_orientation", "/autoware_orientation")])
    if given["gnss_poser"].lower() != "true":
        return [receiver]
    poser = Node(package="autoware_gnss_poser", executable="gnss_poser", name="gnss_poser", output="screen",
                 parameters=[time, {"base_frame": "base_link", "gnss_base_frame": "gnss_base_link", "map_frame": "map",
                                    "buff_epoch": 1, "gnss_pose_pub_method": 0,
                                    "use_gnss_ins_orientation": given["orientation"].lower() == "true"}],
                 remappings=[("fix", given["fix_topic"]), ("autoware_orientation", "/autoware_orientation"),
                             ("gnss_pose", "/sensing/gnss/pose"),
                             ("gnss_pose_cov", "/sensing/gnss/pose_with_covariance"),
                             ("gnss_fixed", "/sensing/gnss/fixed")])
    return [receiver, poser]


def generate_launch_description():
    arguments = [DeclareLaunchArgument(name, default_value=value, description=text)
                 for name, (value, text) in ARGUMENTS.items()]
    return LaunchDescription([*arguments, OpaqueFunction(function=nodes)])
