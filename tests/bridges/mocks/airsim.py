"""Mock of AirSim's module (PythonClient/airsim/client.py, types.py): NED metres from the vehicle's start, quaternions
of a body with x forward, y right, z down, stamps in nanoseconds of Unix time."""
import course


class Vector3r:
    def __init__(self, x_val=0.0, y_val=0.0, z_val=0.0):
        self.x_val, self.y_val, self.z_val = x_val, y_val, z_val


class Quaternionr:
    def __init__(self, x_val=0.0, y_val=0.0, z_val=0.0, w_val=1.0):
        self.x_val, self.y_val, self.z_val, self.w_val = x_val, y_val, z_val, w_val


class KinematicsState:
    def __init__(self, time_s):
        (e, n, u), (ve, vn, vu) = course.at(time_s)
        w, x, y, z = course.quaternion(90 - course.YAW_DEG, course.PITCH_DEG, course.ROLL_DEG)
        self.position, self.linear_velocity = Vector3r(n, e, -u), Vector3r(vn, ve, -vu)
        self.orientation = Quaternionr(w_val=w, x_val=x, y_val=y, z_val=z)


class State:
    def __init__(self, time_s):
        self.timestamp = 1764000000000000000 + int(time_s * 1e9)


class GeoPoint:
    def __init__(self, latitude, longitude, altitude):
        self.latitude, self.longitude, self.altitude = latitude, longitude, altitude


class VehicleClient:
    def __init__(self, ip="", port=41451, timeout_value=3600):
        self.clock = course.Clock()

    def ping(self):
        return True

    def getHomeGeoPoint(self, vehicle_name=""):
        return GeoPoint(47.641468, -122.140165, 122.0)  # AirSim's own, far from the town

    def simGetGroundTruthKinematics(self, vehicle_name=""):
        return KinematicsState(self.clock.time_s)

    def _state(self, vehicle_name):
        if vehicle_name != "Car1" and isinstance(self, CarClient):
            raise RuntimeError(f"Vehicle API for '{vehicle_name}' is not available")
        self.clock.step(0.01)
        return State(self.clock.time_s)


class MultirotorClient(VehicleClient):
    def getMultirotorState(self, vehicle_name=""):
        return self._state(vehicle_name)


class CarClient(VehicleClient):
    def getCarState(self, vehicle_name=""):
        return self._state(vehicle_name)
