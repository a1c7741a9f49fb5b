#!/usr/bin/env python3
"""AirSim, Colosseum (both: module airsim) and Cosys-AirSim (module cosysairsim): the GNSS receiver of a vehicle.

    canyon live town.yaml &
    python3 airsim_bridge.py --at 0,0,1.5                        # Blocks, a multirotor
    python3 airsim_bridge.py --car --vehicle Car1
    python3 airsim_bridge.py --module cosysairsim

It asks for the true pose --rate times a second. Each line is a fix; position_m is north, east, down, as AirSim's
position: metres from where the vehicle started, so --at is the place of the start in the city. AirSim takes no GPS from
outside for its own flight controller; PX4 and ArduPilot take Canyon's (docs/autopilots.md).
Project AirSim has another client, which this bridge does not know.
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
    client = kind(*arguments.airsim, timeout_value=10)  # one that is away would hold it for an hour
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
    except Exception as error:  # msgpackrpc has classes of its own for a server that is away
        raise canyon_bridge.BridgeError(f"AirSim at {arguments.airsim[0]}:{arguments.airsim[1]}: {error}") from error


if __name__ == "__main__":
    canyon_bridge.run(main)
