#!/usr/bin/env python3
"""AirSim, Colosseum (both: module airsim) and Cosys-AirSim (module cosysairsim): the GNSS receiver of a vehicle.

    canyon live town.yaml &
    python3 airsim_bridge.py --at 0,0,1.5                        # Blocks, a multirotor
    python3 airsim_bridge.py --car --vehicle Car1
    python3 airsim_bridge.py --module cosysairsim

It requests the true pose --rate times per second. Each line is a fix; position_m is north, east, down, like AirSim's
position: metres from the start of the vehicle, so --at is the start's position in the city. AirSim accepts no external
GPS for its own flight controller; PX4 and ArduPilot accept Canyon's (docs/autopilots.md).
Project AirSim has another client, which this bridge does not support.
"""
import time

import canyon_bridge


def xyz(vector):
    return vector.x_val, vector.y_val, vector.z_val


def main():
    parser = canyon_bridge.parser(__doc__, "NED")
    parser.add_argument("--module", default="airsim", help="airsim or cosysairsim (%(default)s)")
    parser.add_argument("--airsim", type=canyon_bridge.host_port, default="127.0.0.1:41451", metavar="HOST:PORT",
                        help="the RPC server (%(default)s)")
    parser.add_argument("--car", action="store_true", help="the vehicle is a car, not a multirotor")
    parser.add_argument("--vehicle", default="", help="its name in settings.json (the first)")
    arguments = parser.parse_args()
    airsim = canyon_bridge.need(arguments.module, f"Install it: pip install {arguments.module}")
    bridge = canyon_bridge.Bridge.of(arguments)
    kind = airsim.CarClient if arguments.car else airsim.MultirotorClient
    client = kind(*arguments.airsim, timeout_value=10)  # a missing server would block it for an hour
    state = client.getCarState if arguments.car else client.getMultirotorState
    try:
        if not client.ping():
            raise canyon_bridge.BridgeError("AirSim does not answer")
        if bridge.checks:
            home = client.getHomeGeoPoint(vehicle_name=arguments.vehicle)
            bridge.state_place((home.latitude, home.longitude, home.altitude), (0, 0, 0))
        first_ns = None
        while True:
            begin = time.monotonic()
            stamp_ns = int(state(vehicle_name=arguments.vehicle).timestamp)
            first_ns = first_ns or stamp_ns
            truth = client.simGetGroundTruthKinematics(vehicle_name=arguments.vehicle)
            q = truth.orientation  # body forward, right, down to north, east, down
            turn = q.w_val, q.x_val, q.y_val, q.z_val
            bridge.send((stamp_ns - first_ns) * 1e-9, xyz(truth.position), xyz(truth.linear_velocity),
                        canyon_bridge.rotated(*turn, (1, 0, 0)), canyon_bridge.rotated(*turn, (0, 0, -1)))
            bridge.report_all()
            time.sleep(max(0.0, begin + 1 / arguments.rate - time.monotonic()))
    except (canyon_bridge.BridgeError, BrokenPipeError):
        raise
    except Exception as error:  # msgpackrpc has its own classes for a missing server
        raise canyon_bridge.BridgeError(f"AirSim at {arguments.airsim[0]}:{arguments.airsim[1]}: {error}") from error


if __name__ == "__main__":
    canyon_bridge.run(main)
