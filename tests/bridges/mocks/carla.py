"""Mock of CARLA's module: names and arguments are those of libcarla's World.cpp, Snapshot.cpp and Geom.cpp. The world is
left-handed: x east, y south, z up, metres; yaw rotates from x to y, pitch up and roll to the right are
positive; degrees."""
import fnmatch

import course


class Vector3D:
    def __init__(self, x=0.0, y=0.0, z=0.0):
        self.x, self.y, self.z = x, y, z


Location = Vector3D


class Transform:
    def __init__(self, location, pitch, yaw, roll):
        self.location = location
        (self.sp, self.cp), (self.sy, self.cy), (self.sr, self.cr) = course.trigonometry(pitch, yaw, roll)

    def get_forward_vector(self):
        return Vector3D(self.cy * self.cp, self.sy * self.cp, self.sp)

    def get_up_vector(self):
        return Vector3D(-self.cy * self.sp * self.cr - self.sy * self.sr, -self.sy * self.sp * self.cr + self.cy * self.sr,
                        self.cp * self.cr)


class Actor:
    def __init__(self, number, type_id, role):
        self.id, self.type_id, self.attributes = number, type_id, {"role_name": role}


class ActorList(list):
    def filter(self, wildcard_pattern):
        return ActorList(each for each in self if fnmatch.fnmatch(each.type_id, wildcard_pattern))


class ActorSnapshot:
    def __init__(self, time_s):
        self.position, self.velocity = course.at(time_s)

    def get_transform(self):
        east, north, up = self.position
        return Transform(Location(east, -north, up), course.PITCH_DEG, -course.YAW_DEG, course.ROLL_DEG)

    def get_velocity(self):
        east, north, up = self.velocity
        return Vector3D(east, -north, up)


class Timestamp:
    elapsed_seconds = 0.0


class WorldSnapshot:
    def __init__(self, time_s):
        self.timestamp = Timestamp()
        self.timestamp.elapsed_seconds = 100.0 + time_s

    def find(self, actor_id):
        time_s = self.timestamp.elapsed_seconds - 100.0
        return ActorSnapshot(time_s) if actor_id == 7 and time_s <= course.SECONDS else None


class DebugHelper:
    def draw_point(self, location, size=0.1, color=None, life_time=-1.0):
        course.log(f"{location.x} {location.y} {location.z}")


class GeoLocation:
    def __init__(self, latitude=0.0, longitude=0.0, altitude=0.0):
        self.latitude, self.longitude, self.altitude = latitude, longitude, altitude


class Map:
    """Its geographic reference is town.yaml's origin."""

    def transform_to_geolocation(self, location):
        return GeoLocation(*course.place_of((location.x, -location.y, location.z)))


class World:
    def __init__(self):
        self.clock, self.debug = course.Clock(), DebugHelper()

    def get_map(self):
        return Map()

    def get_actors(self):
        return ActorList((Actor(3, "sensor.camera.rgb", "hero"), Actor(5, "vehicle.tesla.model3", "autopilot"),
                          Actor(7, "vehicle.audi.tt", "hero")))

    def wait_for_tick(self, seconds=0.0):
        self.clock.step(0.02)
        return WorldSnapshot(self.clock.time_s)


class Client:
    def __init__(self, host="127.0.0.1", port=2000, worker_threads=0):
        if port != 2000:
            raise RuntimeError(f"time-out of 10000ms while waiting for the simulator at {host}:{port}")
        self.timeout_s = None

    def set_timeout(self, seconds):
        self.timeout_s = seconds

    def get_world(self):
        return World()
