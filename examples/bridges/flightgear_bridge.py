#!/usr/bin/env python3
"""FlightGear 2018.3 and later: a GNSS receiver beside the aircraft, by FlightGear's generic protocol.

    canyon live town.yaml &
    fgfs --data=FOLDER/flightgear --generic=socket,out,50,127.0.0.1,5501,udp,canyon \\
         --generic=socket,in,50,127.0.0.1,5502,udp,canyon --lat=22.3 --lon=114.17 --altitude=300 --vc=90 &
    python3 flightgear_bridge.py

with the folder of this file (flightgear/Protocol/canyon.xml is the protocol). Poses go by latitude, longitude and height:
--at and --axes count for position_m of the printed fixes alone. Fixes come back as properties, /canyon/fix/latitude-deg
and others; /canyon/fix/valid is 0 without a fix. FlightGear's altitude is taken as the height above the ellipsoid, as the
heights of a city without a geoid are. FlightGear's own houses are not Canyon's: take city.osm of the place you fly at.
"""
import math
import socket
import sys
import time

import canyon_bridge

FOOT_M = 0.3048
SILENT_S = 5.0


def body_axes(heading_deg, pitch_deg, roll_deg):
    """Forward and up in ENU."""
    (sh, ch), (sp, cp), (sr, cr) = ((math.sin(math.radians(deg)), math.cos(math.radians(deg)))
                                    for deg in (heading_deg, pitch_deg, roll_deg))
    return (cp * sh, cp * ch, sp), (sr * ch - cr * sp * sh, -sr * sh - cr * sp * ch, cr * cp)


def send_pose(bridge, line):
    """@param line of canyon.xml's output"""
    try:
        time_s, latitude, longitude, feet, heading, pitch, roll = map(float, line.split(b","))
    except ValueError as error:
        raise canyon_bridge.BridgeError(f"no line of canyon.xml: {line[:80]!r}") from error
    forward, up = body_axes(heading, pitch, roll)
    # Velocities follow from places: those that FlightGear states are its flight model's, and the UFO's ignore its pitch.
    bridge.send(time_s, forward=forward, up=up, place=(latitude, longitude, feet * FOOT_M))


def properties(fix):
    """A line of canyon.xml's input."""
    latitude, longitude, height = fix.place or (0.0, 0.0, 0.0)
    east, north, up = fix.sigma_enu_m or (0.0, 0.0, 0.0)
    return (f"{1 if fix.place else 0},{fix.kind},{latitude:.9f},{longitude:.9f},{height / FOOT_M:.3f},"
            f"{math.hypot(east, north):.3f},{up:.3f},{fix.used}\n").encode()


def main():
    parser = canyon_bridge.parser(__doc__)
    parser.add_argument("--listen", type=canyon_bridge.host_port, default="127.0.0.1:5501", metavar="HOST:PORT",
                        help="where FlightGear sends poses (%(default)s)")
    parser.add_argument("--flightgear", type=canyon_bridge.host_port, default="127.0.0.1:5502", metavar="HOST:PORT",
                        help="where FlightGear takes fixes (%(default)s)")
    arguments = parser.parse_args()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as flightgear:
        try:
            flightgear.bind(arguments.listen)
        except OSError as error:
            raise canyon_bridge.BridgeError("cannot listen at %s:%d: %s" % (*arguments.listen, error)) from error
        flightgear.settimeout(1.0)
        bridge = canyon_bridge.Bridge.of(arguments)
        heard_s = time.monotonic()
        while True:
            try:
                send_pose(bridge, flightgear.recv(4096))
                heard_s = time.monotonic()
            except socket.timeout:
                if time.monotonic() - heard_s > SILENT_S:
                    print("FlightGear sends nothing to %s:%d: is it paused, or without --generic=socket,out,...?"
                          % arguments.listen, file=sys.stderr)
                    heard_s = math.inf  # said
            for fix in bridge.fixes():
                bridge.report(fix)
                flightgear.sendto(properties(fix), arguments.flightgear)


if __name__ == "__main__":
    canyon_bridge.run(main)
