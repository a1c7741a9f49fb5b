#!/usr/bin/env python3
"""Files that a ROS 2 workspace reads of Canyon, tested without ROS: package.xml, and demo.launch.py with mocks of launch.

usage: tests/ros2_workspace_test.py [unittest's options]
"""
import importlib.util
import json
import pathlib
import re
import sys
import types
import unittest
import xml.etree.ElementTree as ElementTree

ROOT = pathlib.Path(__file__).resolve().parents[1]
LAUNCH = ROOT / "adapters" / "ros2" / "launch"
sys.dont_write_bytecode = True

# rosdep's key of each package installed by ./run for the build (ros/rosdistro, rosdep/base.yaml, 2026-08-22).
KEYS = {"cmake": "cmake", "pkg-config": "pkg-config", "libeigen3-dev": "eigen", "libgeographiclib-dev": "geographiclib",
        "libembree-dev": "embree", "libtbb-dev": "tbb", "libfmt-dev": "fmt", "libyaml-cpp-dev": "yaml-cpp", "libcli11-dev": "cli11",
        "nlohmann-json3-dev": "nlohmann-json-dev", "zlib1g-dev": "zlib", "libcairo2-dev": "libcairo2-dev", "libpng-dev": "libpng-dev",
        "libosmium2-dev": "osmium", "libboost-dev": "libboost-dev", "libexpat1-dev": "libexpat1-dev", "libbz2-dev": "bzip2",
        "libgeos-dev": "geos", "libgdal-dev": "libgdal-dev", "libnetcdf-dev": "netcdf", "libcurl4-openssl-dev": "libcurl-dev",
        "libtinyxml2-dev": "tinyxml2", "libzmq3-dev": "libzmq3-dev", "libdraco-dev": "libdraco-dev",
        "libopenmpi-dev": "libopenmpi-dev"}
# Compilers come with ROS's own packages; libosmium2-dev includes protozero.
OTHERWISE = {"g++", "ninja-build", "ccache", "libprotozero-dev"}


class Package(unittest.TestCase):
    root = ElementTree.parse(ROOT / "package.xml").getroot()
    depends = {each.text for each in root if each.tag.endswith("depend")}

    def test_names_each_library_that_the_build_needs(self):
        packages = re.search(r"^build_packages=\((.*?)\)", (ROOT / "run").read_text(), re.S | re.M)[1].split()
        by_hand = set(re.search(r"sudo apt install (.*)", (ROOT / "docs/ros2.md").read_text())[1].split())
        for package in set(packages) - OTHERWISE - by_hand:
            self.assertIn(KEYS[package], self.depends)
        self.assertLess(by_hand, set(packages))

    def test_names_the_packages_of_ros(self):
        needed = re.search(r"set\(depends (.*?)\)", (ROOT / "adapters/ros2/CMakeLists.txt").read_text(), re.S)[1].split()
        self.assertLess(set(needed), self.depends)

    def test_is_the_project(self):
        version = re.search(r"project\(canyon VERSION (\S+)", (ROOT / "CMakeLists.txt").read_text())[1]
        self.assertEqual((self.root.find("name").text, self.root.find("version").text), ("canyon", version))
        self.assertEqual(json.loads((ROOT / "colcon.pkg").read_text())["name"], "canyon")


class Recorded:
    """An action or a substitution: stores its arguments."""

    def __init__(self, *words, **named):
        self.words, self.named = words, named

    def perform(self, context):
        return context[self.words[0]]


def loaded(file, packages):
    """The module of a launch file, with these packages installed."""
    names = {"launch": ["LaunchDescription"], "launch.actions": ["DeclareLaunchArgument", "ExecuteProcess", "OpaqueFunction"],
             "launch.substitutions": ["LaunchConfiguration"], "launch_ros": [], "launch_ros.actions": ["Node"]}
    modules = {name: types.ModuleType(name) for name in [*names, "ament_index_python", "ament_index_python.packages"]}
    for name, classes in names.items():
        for each in classes:
            setattr(modules[name], each, type(each, (Recorded,), {}))
    modules["ament_index_python.packages"].get_package_share_directory = lambda name: f"/ws/share/{name}"
    modules["ament_index_python.packages"].get_packages_with_prefixes = lambda: dict.fromkeys(packages, "/ws")
    sys.modules.update(modules)
    spec = importlib.util.spec_from_file_location(file, LAUNCH / file)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


class Demo(unittest.TestCase):
    def started(self, packages, **given):
        *arguments, starter = loaded("demo.launch.py", packages).generate_launch_description().words[0]
        context = {each.words[0]: each.named["default_value"] for each in arguments}
        self.assertLess(set(given), set(context) | {""})
        return starter.named["function"]({**context, **given})

    def test_plays_the_example_and_shows_it(self):
        drawing, receiver, rviz = self.started({"canyon_ros2", "rviz2"})
        values, = receiver.named["parameters"]
        self.assertEqual(values, {"scenario": "/ws/share/canyon_ros2/synthetic_drive.yaml", "autostart": True})
        self.assertTrue((ROOT / "examples" / "synthetic_drive.yaml").exists())
        self.assertEqual(drawing.named["cmd"][1], "/ws/share/canyon_ros2/launch/show_fixes.py")
        self.assertEqual(rviz.named["arguments"], ["-d", "/ws/share/canyon_ros2/demo.rviz"])

    def test_goes_without_rviz(self):
        self.assertEqual(len(self.started({"canyon_ros2"})), 1)
        receiver, = self.started({"canyon_ros2", "rviz2"}, rviz="false", profile="ublox-f9p")
        self.assertEqual(receiver.named["parameters"][0]["profile"], "ublox-f9p")

    def test_draws_metres_of_the_first_fix(self):
        """An arc of a meridian at 22.3 deg is 110,742 m per degree (WGS 84), of the parallel 103,040 m."""
        for name, classes in {"rclpy": [], "geometry_msgs": [], "geometry_msgs.msg": ["PoseStamped", "PoseWithCovarianceStamped"],
                              "nav_msgs": [], "nav_msgs.msg": ["Path"], "sensor_msgs": [], "sensor_msgs.msg": ["NavSatFix"]}.items():
            sys.modules[name] = types.ModuleType(name)
            for each in classes:
                setattr(sys.modules[name], each, Recorded)
        module = loaded("show_fixes.py", {"canyon_ros2"})
        degree = 0.017453292519943295
        east, north, up = module.enu((22.3 * degree, 114.17 * degree, 5), (22.3001 * degree, 114.1702 * degree, 9))
        self.assertAlmostEqual(east, 20.608, places=2)
        self.assertAlmostEqual(north, 11.074, places=2)
        self.assertAlmostEqual(up, 4, places=3)


if __name__ == "__main__":
    unittest.main()
