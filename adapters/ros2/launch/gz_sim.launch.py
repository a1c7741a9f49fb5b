"""Gazebo Sim with Canyon's system, and ros_gz_bridge between its topics and ROS 2."""
from launch import LaunchDescription
from launch.actions import (AppendEnvironmentVariable, DeclareLaunchArgument, ExecuteProcess, OpaqueFunction,
                            RegisterEventHandler, Shutdown)
from launch.event_handlers import OnProcessExit
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackagePrefix

ARGUMENTS = {
    "world_name": ("canyon_downtown", "the name in that file"),
    "model": ("car", "the vehicle; its velocities are taken from cmd_vel"),
    "link": ("body", "link with the sensor"),
    "sensor": ("gnss", "the navsat sensor"),
    "gui": ("false", "show the world; else only the server runs"),
    "namespace": ("", "of the ROS topics fix and cmd_vel"),
}


def processes(context):
    given = {name: LaunchConfiguration(name).perform(context) for name in ARGUMENTS}
    model = f"/world/{given['world_name']}/model/{given['model']}"
    navsat = f"{model}/link/{given['link']}/sensor/{given['sensor']}/navsat"
    clock = f"/world/{given['world_name']}/clock"
    cmd_vel = f"/model/{given['model']}/cmd_vel"
    server = ExecuteProcess(cmd=["gz", "sim", *([] if given["gui"].lower() == "true" else ["-s"]), "-r",
                                 LaunchConfiguration("world")], output="screen")
    bridge = Node(package="ros_gz_bridge", executable="parameter_bridge", namespace=given["namespace"], output="screen",
                  arguments=[f"{navsat}@sensor_msgs/msg/NavSatFix[gz.msgs.NavSat",
                             f"{clock}@rosgraph_msgs/msg/Clock[gz.msgs.Clock",
                             f"{cmd_vel}@geometry_msgs/msg/Twist]gz.msgs.Twist"],
                  remappings=[(navsat, "fix"), (clock, "/clock"), (cmd_vel, "cmd_vel")])
    return [server, bridge, RegisterEventHandler(OnProcessExit(target_action=server, on_exit=[Shutdown()]))]


def generate_launch_description():
    prefix = FindPackagePrefix("canyon_ros2")
    arguments = [DeclareLaunchArgument(name, default_value=value, description=text)
                 for name, (value, text) in ARGUMENTS.items()]
    plugins = DeclareLaunchArgument("plugins", default_value=PathJoinSubstitution([prefix, "lib"]),
                                    description="folder with Canyon's systems for Gazebo Sim")
    world = DeclareLaunchArgument(
        "world", default_value=PathJoinSubstitution([prefix, "share", "canyon_ros2", "canyon_downtown.sdf"]),
        description="world file")
    return LaunchDescription([
        *arguments, plugins, world,
        AppendEnvironmentVariable("GZ_SIM_SYSTEM_PLUGIN_PATH", LaunchConfiguration("plugins")),
        OpaqueFunction(function=processes)])
