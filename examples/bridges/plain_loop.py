#!/usr/bin/env python3
"""Your own simulation in a loop: here a vehicle that moves 30 m east, 20 m north and 10 m up in 10 s, and stops.

    canyon live town.yaml &
    python3 plain_loop.py --at 0,0,20

Each printed line is a fix: position_m in x, y, z of --axes, and also latitude, longitude and height.
Replace pose() by your simulation. A loop may be slower or faster than real time: town.yaml takes
the time from the poses. Keep a few metres from walls; town.yaml's streets are 16 m wide.
"""
import time

import canyon_bridge

STEP_S = 0.02
WAY_M = (("east", 0, 30.0), ("north", 1, 20.0), ("up", 2, 10.0))
LEG_S = 10.0 / 3


def pose(time_s):
    """Position and velocity in ENU [m, m/s]."""
    position, velocity = [0.0] * 3, [0.0] * 3
    for leg, (_, axis, metres) in enumerate(WAY_M):
        part = (time_s - leg * LEG_S) / LEG_S
        position[axis] = metres * min(max(part, 0.0), 1.0)
        velocity[axis] = metres / LEG_S if 0 < part < 1 else 0.0
    return position, velocity


def main():
    parser = canyon_bridge.parser(__doc__)
    parser.add_argument("--seconds", type=canyon_bridge.positive, help="duration of the simulation (unlimited)")
    parser.add_argument("--speed", type=canyon_bridge.positive, default=1.0,
                        help="seconds of the simulation in one of real time (1)")
    arguments = parser.parse_args()
    bridge = canyon_bridge.Bridge.of(arguments)
    begin, step = time.monotonic(), 0
    while arguments.seconds is None or step * STEP_S <= arguments.seconds:
        position, velocity = pose(step * STEP_S)
        bridge.send(step * STEP_S, canyon_bridge.frame_from_enu(arguments.axes, position),
                    canyon_bridge.frame_from_enu(arguments.axes, velocity))
        bridge.report_all()
        step += 1
        time.sleep(max(0.0, begin + step * STEP_S / arguments.speed - time.monotonic()))


if __name__ == "__main__":
    canyon_bridge.run(main)
