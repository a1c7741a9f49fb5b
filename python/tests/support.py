"""Functions used by several tests."""

CITY = {
    "synthetic": {"blocks_east": 4, "blocks_north": 4, "seed": 7},
    "origin": {"latitude_deg": 22.3, "longitude_deg": 114.17, "height_m": 0},
}
