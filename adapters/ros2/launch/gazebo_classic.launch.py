"""Gazebo Classic with a world whose models carry Canyon's plugins, which publish on ROS 2 themselves."""
from launch import LaunchDescription
from launch.actions import AppendEnvironmentVariable, DeclareLaunchArgument, ExecuteProcess, OpaqueFunction, Shutdown
from launch.substitutions import LaunchConfiguration, PathJoinSubstitution
from launch_ros.substitutions import FindPackagePrefix

ARGUMENTS = {
    "world": ("worlds/empty.world", "world file"),
    "gui": ("false", "show the world; else the server alone runs"),
    "gazebo_ros": ("true", "load the system plugins of gazebo_ros: /clock, and services that spawn models"),
    "verbose": ("true", "print what Gazebo says"),
}


def server(context):
    def on(name):
        return LaunchConfiguration(name).perform(context).lower() == "true"
    words = ["gazebo" if on("gui") else "gzserver", LaunchConfiguration("world").perform(context)]
    if on("verbose"):
        words.append("--verbose")
    if on("gazebo_ros"):
        words += ["-s", "libgazebo_ros_init.so", "-s", "libgazebo_ros_factory.so"]
    return [ExecuteProcess(cmd=words, output="screen", on_exit=[Shutdown()])]


def generate_launch_description():
    arguments = [DeclareLaunchArgument(name, default_value=value, description=text)
                 for name, (value, text) in ARGUMENTS.items()]
    plugins = DeclareLaunchArgument(
        "plugins", default_value=PathJoinSubstitution([FindPackagePrefix("canyon_ros2"), "lib"]),
        description="folder with Canyon's plugins for Gazebo Classic")
    return LaunchDescription([*arguments, plugins,
                              AppendEnvironmentVariable("GAZEBO_PLUGIN_PATH", LaunchConfiguration("plugins")),
                              OpaqueFunction(function=server)])
