#!/usr/bin/env python3
"""Drives a car with a GNSS receiver through a city in gzserver and prints the plugin's messages.

usage: drive.py FOLDER BUILD [--seconds N] [--from N] [--gui]

FOLDER has NAME.world, truth.csv and reference.yaml, written by tests/gazebo/prepare.sh for the city NAME; BUILD is
the plugin's build folder. Starts a ROS master and gzserver, and ends both. Without ROS it prints the plugin's NMEA.
Exit status 1 if no fix arrives, or Gazebo ends by itself.
"""
import glob
import math
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
import urllib.parse

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(HERE, "..", "..", "common", "example"))
from driving import (Children, FixTable, Truth, arguments_of, free_port, headline, listening, print_notes,  # noqa: E402
                     say, wait_until, write_world)


if not hasattr(threading.Thread, "isAlive"):    # Debian 11's rospy still calls it; Python 3.9 removed it
    threading.Thread.isAlive = threading.Thread.is_alive


def with_ros(build):
    """Whether ROS 1 and the messages of this build can be imported."""
    for place in glob.glob(os.path.join(build, "**", "canyon_msgs", "msg", "__init__.py"), recursive=True):
        packages = os.path.dirname(os.path.dirname(os.path.dirname(place)))
        sys.path.insert(0, packages)
        os.environ["PYTHONPATH"] = packages + os.pathsep + os.environ.get("PYTHONPATH", "")
        try:
            import canyon_msgs.msg  # noqa: F401
            import rospy  # noqa: F401
            import sensor_msgs.msg  # noqa: F401
            return shutil.which("rosmaster") is not None
        except ImportError:
            continue
    return False


def print_ros(children, gzserver, truth, seconds):
    import rospy
    from canyon_msgs.msg import GnssMultipath
    from sensor_msgs.msg import NavSatFix
    fixes, multipath = {}, {}
    rospy.init_node("canyon_drive", anonymous=True, disable_signals=True)
    rospy.Subscriber("/car/fix", NavSatFix, lambda m: fixes.__setitem__(m.header.stamp.to_nsec(), m))
    rospy.Subscriber("/car/gnss_multipath", GnssMultipath, lambda m: multipath.__setitem__(m.header.stamp.to_nsec(), m))
    wait_until(lambda: fixes and multipath, "the first messages on /car/fix and /car/gnss_multipath", 90, gzserver)

    headline("rostopic list")
    say(subprocess.run(["rostopic", "list"], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, timeout=30,
                       universal_newlines=True).stdout.strip())
    rates = children.start("rostopic_hz", "rostopic", "hz", "-w", "50", "/car/fix")

    table = FixTable("/car/fix", truth)
    begin_wall, begin_sim, shown = time.monotonic(), max(fixes) * 1e-9, -1
    while shown < math.floor(begin_sim + seconds):
        def due():
            return sorted(t for t in set(fixes) & set(multipath) if math.floor(t * 1e-9) > shown)
        wait_until(due, "the next fix", 60, gzserver)
        stamp = due()[0]
        shown = math.floor(stamp * 1e-9)
        fix, satellites = fixes[stamp], multipath[stamp]
        sigma = math.sqrt(fix.position_covariance[0] + fix.position_covariance[4])
        table.row(stamp * 1e-9, satellites.num_vis_sat, satellites.num_block_sat, None if fix.status.status < 0 else
                  (fix.latitude, fix.longitude, fix.altitude, sigma))
    factor = (max(fixes) * 1e-9 - begin_sim) / (time.monotonic() - begin_wall)

    headline("rostopic echo -n1 /car/gnss_multipath")
    say(subprocess.run(["rostopic", "echo", "-n1", "/car/gnss_multipath"], stdout=subprocess.PIPE,
                       stderr=subprocess.DEVNULL, timeout=60, universal_newlines=True).stdout.strip())
    headline("rostopic hz /car/fix")
    children.stop(rates)
    with open(rates.log) as file:
        measured = [line.strip() for line in file if "rate" in line or "min:" in line]
    say("\n".join(measured[-2:]) or "no rate measured")
    rospy.signal_shutdown("the drive has ended")
    say(f"\n{len(fixes)} messages in {max(fixes) * 1e-9 - min(fixes) * 1e-9:.1f} s of simulated time, "
        f"{factor:.2f} times real time")


def print_nmea(gzserver, port, seconds):
    wait_until(lambda: listening(port), f"the plugin's NMEA on port {port}", 90, gzserver)
    headline("NMEA (ROS 1 is not here)")
    deadline, lines = time.monotonic() + 60 + 5 * seconds, 0
    with socket.create_connection(("127.0.0.1", port), timeout=30) as stream, stream.makefile("r") as sentences:
        for sentence in sentences:
            if "GGA" in sentence and sentence.split(",")[1].endswith((".00", ".000")):
                say(sentence.strip())
                lines += 1
            if lines > seconds or time.monotonic() > deadline:
                break
    if not lines:
        raise SystemExit("drive: no NMEA sentence was received")


def main():
    arguments = arguments_of(__doc__.split("usage: ")[1].split("\n")[0])
    truth = Truth(os.path.join(arguments.folder, "truth.csv"), arguments.begin_s)
    ros = with_ros(arguments.build)
    port = free_port()
    world = write_world(arguments.folder, truth, os.path.join(HERE, "vehicle.sdf"),
                        {"NMEA_PORT": port, "VISUALS": "true" if arguments.gui else "false"})
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    with Children(arguments.folder) as children:
        if ros:
            master = urllib.parse.urlparse(os.environ["ROS_MASTER_URI"])
            children.start("rosmaster", "rosmaster", "--core", "-p", str(master.port))
            wait_until(lambda: listening(master.port), "the ROS master", 30)
        # Before Gazebo 11.2, meshes are searched in the current folder.
        gzserver = children.start("gzserver", "gzserver", "--verbose", world, cwd=arguments.folder)
        if arguments.gui:
            children.start("gzclient", "gzclient", cwd=arguments.folder)
        if ros:
            print_ros(children, gzserver, truth, arguments.seconds)
        else:
            print_nmea(gzserver, port, arguments.seconds)
        print_notes(gzserver)
        if gzserver.poll() is not None:
            raise SystemExit(f"drive: gzserver ended (status {gzserver.returncode}); see {gzserver.log}")
        if children.stop(gzserver) != 0:
            say(f"drive: gzserver ended with status {gzserver.returncode}; see {gzserver.log}")
            return 1
    return 0


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit(130)
