"""Mock of Pegasus' base of sensors (logic/sensors/sensor.py)."""


class Sensor:
    def __init__(self, sensor_type, update_rate):
        self._sensor_type, self._update_rate = sensor_type, update_rate
        self._origin_lat, self._origin_lon, self._origin_alt, self._vehicle = -999, -999, 0.0, None

    def initialize(self, vehicle, origin_lat, origin_lon, origin_alt):
        self._vehicle, self._origin_lat, self._origin_lon, self._origin_alt = vehicle, origin_lat, origin_lon, origin_alt

    @property
    def sensor_type(self):
        return self._sensor_type

    @property
    def update_rate(self):
        return self._update_rate
