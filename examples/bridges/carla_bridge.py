#!/usr/bin/env python3
"""CARLA 0.9.x and 0.10: the GNSS receiver of a vehicle.

    ./CarlaUE4.sh &
    canyon live town.yaml &
    python3 carla_bridge.py --role hero --draw

It follows the vehicle with the attribute role_name --role (default: the first vehicle) at every tick, also in synchronous
mode: another client ticks. Each line is a fix; position_m is a carla.Location's x, y, z. --draw shows fixes in the world.
CARLA's world is left-handed, in metres: x east, y south, z up; a Location's z of 0 is the ground of most maps. The
receiver is at the vehicle's Location: set a lever_arm in the scenario. Needs the module carla of your CARLA's version.
"""
import canyon_bridge


def xyz(vector):
    return vector.x, vector.y, vector.z


def find_vehicle(world, role):
    vehicles = world.get_actors().filter("vehicle.*")
    for vehicle in vehicles:
        if role is None or vehicle.attributes.get("role_name") == role:
            return vehicle
    raise canyon_bridge.BridgeError(f"none of CARLA's {len(vehicles)} vehicles has the role_name '{role}'" if role else
                                    "CARLA's world has no vehicle: spawn one first, as with manual_control.py")


def main():
    parser = canyon_bridge.parser(__doc__, "ESU")
    parser.add_argument("--carla", type=canyon_bridge.host_port, default="127.0.0.1:2000", metavar="HOST:PORT",
                        help="CARLA's server (%(default)s)")
    parser.add_argument("--role", help="role_name of the vehicle (the first vehicle)")
    parser.add_argument("--draw", action="store_true", help="show each fix as a point for a second")
    arguments = parser.parse_args()
    carla = canyon_bridge.need("carla", "Install the wheel of your CARLA's PythonAPI/carla/dist, or 'pip install carla'.")
    bridge = canyon_bridge.Bridge.of(arguments)
    try:
        client = carla.Client(*arguments.carla)
        client.set_timeout(10.0)
        world = client.get_world()
        vehicle = find_vehicle(world, arguments.role)
        city = world.get_map() if bridge.checks else None
        while True:
            snapshot = world.wait_for_tick(10.0)
            actor = snapshot.find(vehicle.id)
            if actor is None:
                raise canyon_bridge.BridgeError("the vehicle no longer exists in CARLA's world")
            at = actor.get_transform()
            bridge.send(snapshot.timestamp.elapsed_seconds, xyz(at.location), xyz(actor.get_velocity()),
                        xyz(at.get_forward_vector()), xyz(at.get_up_vector()))
            if bridge.checks:
                place = city.transform_to_geolocation(at.location)
                bridge.state_place((place.latitude, place.longitude, place.altitude), xyz(at.location))
            for fix in bridge.fixes():
                bridge.report(fix)
                if arguments.draw and fix.position_m:
                    world.debug.draw_point(carla.Location(*fix.position_m), size=0.1, life_time=1.0)
    except RuntimeError as error:  # carla's time-outs
        raise canyon_bridge.BridgeError(f"CARLA: {error}") from error


if __name__ == "__main__":
    canyon_bridge.run(main)
