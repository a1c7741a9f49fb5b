#!/usr/bin/env python3
"""Drives a car with a GNSS receiver through a city in Gazebo Sim and prints the system's messages.

usage: drive.py FOLDER BUILD [--seconds N] [--from N] [--gui]

FOLDER has NAME.world, truth.csv and reference.yaml, written by tests/gazebo/prepare.sh for the city NAME; BUILD is
the folder of Canyon's build. Starts `gz sim` and ends it. Exit status 1 if no fix arrives, or Gazebo ends by itself.
"""
import json
import math
import os
import signal
import subprocess
import sys
import threading
import time

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "..", "common", "example"))
from driving import (Children, FixTable, Truth, arguments_of, headline, print_notes, put_first, say,  # noqa: E402
                     wait_until, write_world)

SYSTEMS = '''<plugin filename="gz-sim-physics-system" name="gz::sim::systems::Physics"/>
<plugin filename="gz-sim-user-commands-system" name="gz::sim::systems::UserCommands"/>
<plugin filename="gz-sim-scene-broadcaster-system" name="gz::sim::systems::SceneBroadcaster"/>
<plugin filename="CanyonGnssSystem" name="canyon::GnssSystem"/>
'''


class Messages:
    """The output of `gz topic` for a topic as JSON, one message per line, read in a thread."""

    def __init__(self, children, topic):
        self.all = []
        child = subprocess.Popen(["gz", "topic", "-e", "-t", topic, "--json-output"], stdout=subprocess.PIPE,
                                 stderr=subprocess.DEVNULL, stdin=subprocess.DEVNULL, text=True)
        children.running.append(child)
        threading.Thread(target=self.read, args=(child.stdout,), daemon=True).start()

    def read(self, stream):
        for line in stream:
            if line.startswith("{"):
                self.all.append(json.loads(line))


def print_table(server, messages, topic, truth, seconds):
    table = FixTable(topic, truth)
    shown, next_index, begin = None, 0, None
    while shown is None or shown < begin + seconds:
        wait_until(lambda: len(messages.all) > next_index, f"the next message on {topic}", 60, server)
        message = messages.all[next_index]
        next_index += 1
        now = int(message.get("simTimeNs", 0)) * 1e-9
        if begin is None:
            begin, begin_wall, first = math.floor(now), time.monotonic(), now
        if shown is not None and math.floor(now) <= shown:
            continue
        shown = math.floor(now)
        fix = message.get("fix", {})
        place = fix.get("position")
        if message.get("state") == "FIX" and place:
            covariance = fix["covarianceEnuM2"]
            place = (place["latitudeDeg"], place["longitudeDeg"], place["heightM"],
                     math.sqrt(covariance[0] + covariance[4]))
        else:
            place = None
        table.row(now, message.get("visible", 0), message.get("blocked", 0), place)
    factor = (now - first) / (time.monotonic() - begin_wall)
    say(f"\n{next_index} messages in {now - first:.1f} s of simulated time, {factor:.2f} times real time")


def main():
    arguments = arguments_of(__doc__.split("usage: ")[1].split("\n")[0])
    build = os.path.abspath(arguments.build)
    truth = Truth(os.path.join(arguments.folder, "truth.csv"), arguments.begin_s)
    name = os.path.basename(arguments.folder.rstrip("/"))
    world = write_world(arguments.folder, truth, os.path.join(HERE, "vehicle.sdf"),
                        {"VISUALS": "true" if arguments.gui else "false"}, SYSTEMS)
    put_first("GZ_SIM_SYSTEM_PLUGIN_PATH", os.path.join(build, "lib"))
    put_first("GZ_DESCRIPTOR_PATH", os.path.join(build, "share/canyon/protos"))
    # Other Gazebo servers may run on this machine.
    os.environ["GZ_PARTITION"] = f"canyon_drive_{os.getpid()}"
    topic = f"/world/{name}/model/car/link/base/sensor/gnss/gnss"
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    with Children(arguments.folder) as children:
        messages = Messages(children, topic)
        server = children.start("gz_sim", "gz", "sim", "-r", "-v", "2", *([] if arguments.gui else ["-s"]), world)
        print_table(server, messages, topic, truth, arguments.seconds)
        headline("The satellites of the last message, those above the mask")
        for satellite in messages.all[-1].get("satellites", []):
            if satellite.get("aboveMask"):
                say(f"{satellite['id']:>4}  {satellite.get('visibility', 'LOS'):<14}"
                    f"elevation {math.degrees(satellite['elevationRad']):4.0f} deg"
                    f"  excess path {satellite.get('excessM', 0.0):6.1f} m")
        print_notes(server)
        if server.poll() is not None:
            raise SystemExit(f"drive: gz sim ended (status {server.returncode}); see {server.log}")
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
