"""The drive of all mocks, in ENU [m] and seconds of the simulation: no two legs and no two positions are equal,
so that swapped or rotated axes are detected. The vehicle heads 30 degrees north of east, with its nose 20 degrees up and its
right side 15 degrees down."""
import math
import os
import time

START = (20.0, -10.0, 60.0)
LEGS = ((2.0, (0.0, 0.0, 0.0)), (2.0, (30.0, 0.0, 0.0)), (0.5, (0.0, 0.0, 0.0)), (2.0, (0.0, 20.0, 0.0)),
        (0.5, (0.0, 0.0, 0.0)), (1.0, (0.0, 0.0, 10.0)), (4.0, (0.0, 0.0, 0.0)))  # seconds, path
CORNERS = (START, (50.0, -10.0, 60.0), (50.0, 10.0, 60.0), (50.0, 10.0, 70.0))
SECONDS = sum(leg[0] for leg in LEGS)
YAW_DEG, PITCH_DEG, ROLL_DEG = 30.0, 20.0, 15.0  # from east counter-clockwise; nose up; right side down
SPEED = 6.0  # seconds of the simulation in one of real time


ORIGIN = (22.3, 114.17, 0.0)  # of town.yaml: latitude, longitude [deg], height [m]


def radii():
    """The radii of curvature at the origin [m], north and east (Groves, Principles of GNSS, 2.105 and 2.106)."""
    s2 = math.sin(math.radians(ORIGIN[0])) ** 2
    e2 = 0.00669437999014
    north_m, east_m = 6378137.0 * (1 - e2) / (1 - e2 * s2) ** 1.5, 6378137.0 / math.sqrt(1 - e2 * s2)
    return north_m, east_m * math.cos(math.radians(ORIGIN[0]))


def place_of(enu):
    """Latitude, longitude [deg] and height [m]; accurate to a millimetre within 100 m of the origin."""
    north_m, east_m = radii()
    return ORIGIN[0] + math.degrees(enu[1] / north_m), ORIGIN[1] + math.degrees(enu[0] / east_m), ORIGIN[2] + enu[2]


def at(time_s):
    """Position and velocity."""
    position = list(START)
    for seconds, way in LEGS:
        part = min(max(time_s / seconds, 0.0), 1.0)
        position = [p + part * w for p, w in zip(position, way)]
        if time_s < seconds:
            return position, [w / seconds for w in way]
        time_s -= seconds
    return position, [0.0, 0.0, 0.0]


def trigonometry(*degrees):
    """Sine and cosine of each."""
    return [(math.sin(math.radians(deg)), math.cos(math.radians(deg))) for deg in degrees]


def axes():
    """The vehicle's forward, left and up in ENU."""
    (sy, cy), (sp, cp), (sr, cr) = trigonometry(YAW_DEG, PITCH_DEG, ROLL_DEG)
    forward, level, lift = (cy * cp, sy * cp, sp), (-sy, cy, 0.0), (-cy * sp, -sy * sp, cp)
    return (forward, [cr * a + sr * b for a, b in zip(level, lift)], [cr * b - sr * a for a, b in zip(level, lift)])


def quaternion(z_deg, y_deg, x_deg):
    """w, x, y, z of rotations about z, then the new y, then the new x."""
    w, x, y, z = 1.0, 0.0, 0.0, 0.0
    for axis, deg in enumerate((x_deg, y_deg, z_deg)):
        (s, c), = trigonometry(deg / 2)
        a, b, d = (s if i == axis else 0.0 for i in range(3))
        w, x, y, z = (c * w - a * x - b * y - d * z, c * x + a * w + b * z - d * y, c * y - a * z + b * w + d * x,
                      c * z + a * y - b * x + d * w)
    return w, x, y, z


class Clock:
    """The clock of a simulation that steps."""

    def __init__(self):
        self.begin, self.time_s = time.monotonic(), 0.0

    def step(self, seconds):
        self.time_s += seconds
        time.sleep(max(0.0, self.begin + self.time_s / SPEED - time.monotonic()))


def log(text):
    """Logs an input of the simulator, for the test."""
    with open(os.environ["STAND_IN_LOG"], "a") as file:
        file.write(text + "\n")
