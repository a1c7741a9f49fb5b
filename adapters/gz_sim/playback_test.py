#!/usr/bin/env python3
"""A log of Gazebo Sim played back: a receiver computes from the log's poses the same results as during recording.

usage: playback_test.py PLUGINS PROTOS    (folders of the build: Canyon's systems, descriptions of its messages)
"""
import json
import os
import subprocess
import sys
import tempfile

SETTINGS = """<profile>paper</profile><elevation_mask_deg>5</elevation_mask_deg>
<propagation><model>mirror</model></propagation><sky><frozen><satAzimuth>1.5707963 -1.5707963 0 3.1415927</satAzimuth>
<satElevation>0.7853982 0.7853982 1.0471976 1.0471976</satElevation></frozen></sky>"""

BOX = """<model name="{name}"><static>true</static><pose>{x} 0 15 0 0 0</pose><link name="l"><collision name="c"><geometry>
<box><size>1 400 30</size></box></geometry></collision></link></model>"""

# The car sinks slowly: a log stores only changes, and ends with the last one.
WORLD = """<?xml version="1.0"?><sdf version="1.9"><world name="street"><gravity>0 0 -0.1</gravity>
<physics name="p" type="dart"><max_step_size>0.01</max_step_size><real_time_factor>1</real_time_factor></physics>
<plugin filename="gz-sim-physics-system" name="gz::sim::systems::Physics"/>
<plugin filename="gz-sim-scene-broadcaster-system" name="gz::sim::systems::SceneBroadcaster"/>
<plugin filename="CanyonGnssSystem" name="canyon::GnssSystem"/>
<spherical_coordinates><surface_model>EARTH_WGS84</surface_model><world_frame_orientation>ENU</world_frame_orientation>
<latitude_deg>22.3</latitude_deg><longitude_deg>114.17</longitude_deg><elevation>5</elevation><heading_deg>0</heading_deg>
</spherical_coordinates>""" + BOX.format(name="east", x=10.5) + BOX.format(name="west", x=-10.5) + """
<model name="car"><pose>3 0 10 0 0 0</pose><link name="body"><inertial><mass>1</mass></inertial>
<sensor name="antenna" type="navsat"><pose>0 0 2 0 0 0</pose><update_rate>10</update_rate><canyon>""" + SETTINGS + """</canyon></sensor>
</link></model></world></sdf>"""

CONFIG = """<server_config><plugins><plugin entity_name="*" entity_type="world" filename="CanyonGnssSystem"
name="canyon::GnssSystem"/></plugins></server_config>"""

TOPIC = "/world/street/model/car/link/body/sensor/antenna/gnss"


def satellites_while(command, environment, messages):
    """Visibility and excess path of each satellite in the last of this number of messages of a server."""
    echo = subprocess.Popen(["timeout", "-k", "5", "60", "gz", "topic", "-e", "-n", str(messages), "-t", TOPIC, "--json-output"],
                            env=environment, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    server = subprocess.Popen(["timeout", "-k", "5", "60"] + command, env=environment, stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL)
    try:
        line = echo.communicate(timeout=70)[0]
        message = json.loads([text for text in line.splitlines() if text.startswith("{")][-1])
        return [(s.get("id"), s.get("visibility"), round(s.get("excessM", 0), 3)) for s in message["satellites"]]
    finally:
        server.terminate()
        server.wait(timeout=30)
        echo.kill()


def main():
    plugins, protos = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        def write(name, text):
            with open(os.path.join(folder, name), "w") as file:
                file.write(text)
            return os.path.join(folder, name)

        environment = dict(os.environ, GZ_PARTITION=f"canyon_playback_{os.getpid()}", GZ_IP="127.0.0.1",
                           GZ_DESCRIPTOR_PATH=protos)
        environment["GZ_SIM_SYSTEM_PLUGIN_PATH"] = plugins + ":" + os.environ.get("GZ_SIM_SYSTEM_PLUGIN_PATH", "")
        world, log = write("street.sdf", WORLD), os.path.join(folder, "log")
        recorded = satellites_while(["gz", "sim", "-s", "-r", "--record-path", log, world], environment, 60)
        environment["GZ_SIM_SERVER_CONFIG_PATH"] = write("playback.config", CONFIG)
        played = satellites_while(["gz", "sim", "-s", "-r", "--playback", log], environment, 3)
    print("recorded", recorded)
    print("played  ", played)
    # Between walls 20 m apart: the eastern and the western signal arrive by a wall.
    assert sum(1 for _, visibility, _ in recorded if visibility == "NLOS") == 2, "the street's walls have no effect"
    assert played == recorded, "the log gives another street"


if __name__ == "__main__":
    main()
