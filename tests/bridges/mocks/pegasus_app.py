"""Mock of a Pegasus application: physics at 250 Hz, one sensor, and a backend with the inputs of PX4's
(logic/vehicles/vehicle.py, logic/backends/px4_mavlink_backend.py). Prints HIL_GPS's fields as JSON."""
import json
import sys

import course
from pegasus_gps import CanyonGPS


class State:
    def __init__(self):
        self.position, self.linear_velocity, self.attitude = [0.0] * 3, [0.0] * 3, [0.0, 0.0, 0.0, 1.0]

    def update(self, time_s):
        self.position, self.linear_velocity = course.at(time_s)
        w, *xyz = course.quaternion(course.YAW_DEG, -course.PITCH_DEG, course.ROLL_DEG)  # z up, y left
        self.attitude = xyz + [w]


def update_sensor(sensor_type, data):
    assert sensor_type == "GPS"
    scales = {"fix_type": 1, "latitude": 1e7, "longitude": 1e7, "altitude": 1e3, "eph": 1, "epv": 1, "speed": 100,
              "velocity_north": 100, "velocity_east": 100, "velocity_down": 100, "cog": 100, "sattelites_visible": 1,
              "latitude_gt": 1e7, "longitude_gt": 1e7, "altitude_gt": 1e3}
    print(json.dumps({name: int(data[name] * scale) for name, scale in scales.items()}), flush=True)


sensor, state, clock = CanyonGPS({"canyon": sys.argv[1]}), State(), course.Clock()
sensor.initialize(None, 22.3, 114.17, 0.0)
clock = course.Clock()
while clock.time_s < course.SECONDS:
    clock.step(0.004)
    state.update(clock.time_s)
    data = sensor.update(state, 0.004)
    if data is not None:
        update_sensor(sensor.sensor_type, data)
