"""Mock of Pegasus' truth: radians, on a sphere."""
import math


def reprojection(position, origin_lat, origin_long):
    return origin_lat + position[1] / 6353000.0, origin_long + position[0] / (6353000.0 * math.cos(origin_lat))
