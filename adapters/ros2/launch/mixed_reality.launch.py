"""A real vehicle, or one of a simulator without GNSS, in a city: with poses from a topic or from tf."""
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch_ros.actions import Node
from launch.substitutions import LaunchConfiguration

ARGUMENTS = {
    "source": ("pose", "geometry_msgs/PoseStamped: pose; nav_msgs/Odometry: odometry; tf2: tf"),
    "pose_topic": ("pose", "topic of the poses, if they are not from tf"),
    "pose_frame": ("map", "frame of the poses, z up"),
    "child_frame": ("base_link", "frame of the vehicle, if poses are from tf"),
    "scenario": ("", "scenario file: city, sky and receiver; its trajectory is not used"),
    "mesh": ("", "mesh of the city, in metres from its origin, if no scenario is given; default: a synthetic one"),
    "latitude_deg": ("22.3", "of the city's origin, if no scenario is given"),
    "longitude_deg": ("114.17", "of the city's origin, if no scenario is given"),
    "east_m": ("0.0", "origin of pose_frame in the city"),
    "north_m": ("0.0", "origin of pose_frame in the city"),
    "up_m": ("0.0", "origin of pose_frame in the city"),
    "heading_deg": ("0.0", "direction of the x axis of pose_frame, from east counter-clockwise"),
    "profile": ("", "profile of the receiver; empty: the scenario's, or a common module"),
    "rate_hz": ("10.0", "epochs per second"),
    "namespace": ("", "namespace of node and topics"),
    "use_sim_time": ("false", "use /clock"),
}


def receiver(context):
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    values = {"autostart": True, "use_sim_time": given["use_sim_time"].lower() == "true",
              "rate_hz": float(given["rate_hz"]), "profile": given["profile"], "pose.source": given["source"],
              "pose.frame": given["pose_frame"], "pose.child_frame": given["child_frame"]}
    for name in ("east_m", "north_m", "up_m", "heading_deg"):
        values["pose." + name] = float(given[name])
    if given["scenario"]:
        values["scenario"] = given["scenario"]
    else:
        values.update({"city.origin.latitude_deg": float(given["latitude_deg"]),
                       "city.origin.longitude_deg": float(given["longitude_deg"]), "sky.nominal": True})
        values.update({"city.mesh": given["mesh"]} if given["mesh"] else {"city.synthetic.seed": 7})
    topic = given["pose_topic"]
    return [Node(package="canyon_ros2", executable="receiver", namespace=given["namespace"], output="screen",
                 parameters=[values], remappings=[("pose", topic), ("odom", topic)])]


def generate_launch_description():
    arguments = [DeclareLaunchArgument(name, default_value=value, description=text)
                 for name, (value, text) in ARGUMENTS.items()]
    return LaunchDescription([*arguments, OpaqueFunction(function=receiver)])
