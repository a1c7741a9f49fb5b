#!/usr/bin/env python3
"""Isaac Sim with Pegasus 4 and later: a sensor that replaces Pegasus' GPS, with fixes for PX4, ArduPilot and ROS 2.

    canyon live town.yaml &

and in your Pegasus application (its examples/1_px4_single_vehicle.py, say), before the Multirotor is created:

    sys.path.append("/usr/share/canyon/examples/bridges")
    from pegasus_gps import CanyonGPS
    from pegasus.simulator.logic.sensors import Barometer, IMU, Magnetometer
    PegasusInterface().set_global_coordinates(22.3, 114.17, 0.0)             # city.origin of the scenario
    config.sensors = [Barometer(), IMU(), Magnetometer(), CanyonGPS()]       # {"canyon": "127.0.0.1:9001"} is the default

Start canyon live first: the sensor waits for it for 30 s. Pegasus has ENU, metres, and quaternions x, y, z, w of a body
with x forward, y left, z up. The stage must be in metres, with z up, as set by Pegasus. Without a fix the
backends get nothing, since the ROS 2 backend publishes everything as a fix. Altitudes are Canyon's heights above the ellipsoid.
"""
import math
import sys

import canyon_bridge

if __name__ == "__main__":  # nothing to run: prints its usage
    print(__doc__)
    sys.exit(0 if {"-h", "--help"} & set(sys.argv) else "pegasus_gps.py: import it in a Pegasus application, as above")

from pegasus.simulator.logic.sensors import Sensor
from pegasus.simulator.logic.sensors.geo_mag_utils import reprojection

FIX_TYPES = {"single": 3, "differential": 4, "float": 5, "fixed": 6}  # of MAVLink


class CanyonGPS(Sensor):
    def __init__(self, config={}):
        """@param config canyon: HOST:PORT; rate: of poses [Hz]; check: seconds after which the self-test prints what differs"""
        super().__init__(sensor_type="GPS", update_rate=config.get("rate", 50.0))
        self._config, self._time_s, self._bridge, self._state = config, 0.0, None, None

    def initialize(self, vehicle, origin_lat, origin_lon, origin_alt):
        super().initialize(vehicle, origin_lat, origin_lon, origin_alt)
        self._bridge = canyon_bridge.Bridge(
            canyon_bridge.host_port(self._config.get("canyon", canyon_bridge.CANYON)), (origin_lat, origin_lon, origin_alt),
            rate_hz=self.update_rate, check_s=self._config.get("check"))
        self._bridge.checked = lambda text, good: print(text, flush=True)  # the application continues

    @property
    def state(self):
        return self._state

    def update(self, state, dt):
        """At every physics step. Returns the data for the backends: a new fix, or None."""
        self._time_s += dt
        x, y, z, w = (float(each) for each in state.attitude)
        self._bridge.send(self._time_s, state.position, state.linear_velocity,
                          canyon_bridge.rotated(w, x, y, z, (1, 0, 0)), canyon_bridge.rotated(w, x, y, z, (0, 0, 1)))
        fixes = self._bridge.fixes()
        if not fixes or fixes[-1].kind not in FIX_TYPES:
            return None
        fix = fixes[-1]
        origin = self._origin_lat, self._origin_lon, self._origin_alt
        true_latitude, true_longitude = reprojection(state.position, math.radians(origin[0]), math.radians(origin[1]))
        latitude, longitude, altitude = fix.place
        sigma_m = math.hypot(*fix.sigma_enu_m[:2])
        east, north, up = fix.velocity_mps or (0.0, 0.0, 0.0)
        self._state = {
            "fix_type": FIX_TYPES[fix.kind], "latitude": latitude, "longitude": longitude, "altitude": altitude,
            "eph": 100 * sigma_m, "epv": 100 * fix.sigma_enu_m[2],  # cm, as in HIL_GPS for PX4
            "speed": math.hypot(east, north), "cog": math.degrees(math.atan2(east, north)) % 360,
            "velocity_north": north, "velocity_east": east, "velocity_down": -up, "sattelites_visible": fix.used,
            "latitude_gt": true_latitude, "longitude_gt": true_longitude, "altitude_gt": state.position[2] + origin[2]}
        return self._state
