"""Cities, skies and traces: arrays in, arrays out."""

import unittest

import numpy as np

import canyon
from support import CITY

NOON = "2026-06-01T12:00:00Z"


class City(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.city = canyon.City(**CITY)

    def test_arrays_are_the_engines_own(self):
        first, again = self.city.vertices, self.city.vertices
        self.assertEqual(first.__array_interface__["data"], again.__array_interface__["data"])
        self.assertFalse(first.flags.owndata)
        with self.assertRaises(ValueError):
            first[0, 0] = 1

    def test_arrays_outlive_the_city(self):
        triangles = canyon.City(**CITY).triangles
        self.assertEqual(int(triangles.max()) + 1, len(self.city.vertices))

    def test_objects_cover_the_triangles(self):
        self.assertEqual(sum(each.triangle_count for each in self.city.objects), len(self.city.triangles))
        last = self.city.objects[-1]
        self.assertEqual(self.city.object_of(last.first_triangle), last)

    def test_a_ray_down_meets_the_terrain(self):
        """Synthetic ground is at height 0: docs/city.md."""
        hit = self.city.cast([[0, 0, 50]], [0, 0, -3])
        np.testing.assert_allclose(hit["range_m"], [50], atol=1e-3)
        np.testing.assert_allclose(hit["normal"], [[0, 0, 1]], atol=1e-9)
        np.testing.assert_allclose(self.city.terrain([0, 0, 99]), [0], atol=1e-3)

    def test_places_go_there_and_back(self):
        places = np.array([[10.0, -20.0, 5.0], [-300.0, 40.0, 0.0]])
        np.testing.assert_allclose(self.city.enu_of(self.city.geodetic_of(places)), places, atol=1e-6)

    def test_saved_and_loaded(self):
        import tempfile

        with tempfile.TemporaryDirectory() as folder:
            self.city.save(f"{folder}/x.canyon")
            again = canyon.City.load(f"{folder}/x.canyon")
        np.testing.assert_array_equal(again.vertices, self.city.vertices)


class Trace(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.city = canyon.City(**CITY)
        cls.sky = canyon.Sky(NOON, systems=["GPS", "Galileo"])

    def test_paths_have_the_values_of_the_table_of_paths(self):
        """The columns of docs/outputs.md, of a receiver without its own model."""
        scenario = canyon.Scenario(city=CITY, start=NOON, duration_s=0, sky={"systems": ["GPS"]}, receivers=[{"profile": "ideal"}],
                                   trajectory={"position": {"east_m": 10, "north_m": 2, "up_m": 2}})
        city = canyon.City.of_scenario(scenario)
        simulation = canyon.Simulation(scenario, city)
        table = simulation.run(paths=True).table("paths")
        sky = canyon.Sky(NOON, systems=["GPS"])
        _, rows = canyon.trace(city, simulation.antenna(NOON), sky, NOON, paths=True)
        self.assertGreater(len(rows), 4)
        self.assertEqual(list(table["sat"]), [sky.satellites[i] for i in rows["satellite"]])
        self.assertEqual(list(table["kind"]), [canyon.PATH_KINDS[i] for i in rows["kind"]])
        np.testing.assert_array_equal(table["order"], rows["order"])
        bent, twice = rows["kind"] > 0, rows["order"] == 2
        for column, values in [("excess_path_m", rows["excess_m"]), *zip(("arrival_east", "arrival_north", "arrival_up"), rows["arrival"].T)]:
            np.testing.assert_allclose(table[column], values, atol=1e-6, err_msg=column)
        for k, axis in enumerate(("east", "north", "up")):
            np.testing.assert_allclose(table[f"point_{axis}_m"][bent], rows["point"][bent, k], atol=1e-6)
            np.testing.assert_allclose(table[f"far_point_{axis}_m"][twice], rows["far_point"][twice, k], atol=1e-6)
        reflected = np.isfinite(table["incidence_deg"])
        np.testing.assert_allclose(table["incidence_deg"][reflected], np.degrees(rows["incidence_rad"][reflected]), atol=1e-6)

    def test_a_wall_reflects_twice_the_distance(self):
        """A wall d behind an antenna, seen at elevation e perpendicular to it: excess 2 d cos(e) (image method)."""
        hit = self.city.cast([0, 0, 2], [1, 0.3, 0.01])
        self.assertTrue(np.isfinite(hit["range_m"][0]))
        walls = {**CITY["synthetic"], "min_height_m": 60, "max_height_m": 60}
        city = canyon.City(**{**CITY, "synthetic": walls})
        places = np.array([[0.0, 30.0, 2.0]])  # in a street from south to north, houses at east and west
        wall = city.cast(places, [1, 0, 0])["range_m"][0]
        e = 1.2  # over the western roof onto the eastern wall, where that is 8 m away and 60 m high
        rows, paths = canyon.trace(city, places, directions=[[-np.cos(e), 0, np.sin(e)]],
                                   propagation={"reflection_order": 1}, paths=True)
        reflected = paths[paths["kind"] == canyon.PATH_KINDS.index("reflected")]
        self.assertIn(True, np.isclose(reflected["excess_m"], 2 * wall * np.cos(e), atol=1e-3))

    def same(self, a, b):
        for name in a.dtype.names:  # field by field: NaN equals NaN there
            np.testing.assert_array_equal(a[name], b[name])

    def test_directions_and_sky_agree(self):
        places = [[0, 0, 2], [0, 30, 2]]
        by_sky = canyon.trace(self.city, places, self.sky, NOON)
        up = by_sky["above_horizon"][0]
        az, el = by_sky["azimuth_rad"][0][up], by_sky["elevation_rad"][0][up]
        directions = np.stack([np.sin(az) * np.cos(el), np.cos(az) * np.cos(el), np.sin(el)], 1)
        by_direction = canyon.trace(self.city, places, directions=directions)
        np.testing.assert_array_equal(by_direction["visibility"][0], by_sky["visibility"][0][up])
        np.testing.assert_allclose(by_direction["excess_m"][0], by_sky["excess_m"][0][up], atol=1e-6)

    def test_wanted_satellites_in_the_order_given(self):
        names = self.sky.satellites
        some = [names[7], names[2], names[7]]
        places = [[0, 30, 2]]
        everything = canyon.trace(self.city, places, self.sky, NOON)
        chosen = canyon.trace(self.city, places, self.sky, NOON, satellites=some)
        self.same(chosen[0], everything[0][[7, 2, 7]])

    def test_threads_do_not_matter(self):
        places = np.random.default_rng(1).uniform([-100, -100, 1], [100, 100, 60], (200, 3))
        self.same(canyon.trace(self.city, places, self.sky, NOON, threads=1),
                  canyon.trace(self.city, places, self.sky, NOON))

    def test_bad_arrays(self):
        def wrong(text, *arguments, **keywords):
            with self.assertRaises(canyon.InputError) as caught:
                canyon.trace(self.city, *arguments, **keywords)
            self.assertIn(text, str(caught.exception))

        wrong("row 1 has a value that is not finite", [[0, 0, 1], [0, np.nan, 1]], self.sky, NOON)
        wrong("no satellite has an ephemeris at 2036-06-01", [[0, 0, 1]], self.sky, "2036-06-01T12:00:00Z")
        wrong("point 1 (1e+300, 0, 1) is not finite, or more than 10000 km away", [[0, 0, 1], [1e300, 0, 1]], self.sky, NOON)
        wrong("shape (2, 2)", np.zeros((2, 2)), self.sky, NOON)
        wrong("of type <U1", [["a", "b", "c"]], self.sky, NOON)
        wrong("of type complex128", np.zeros((1, 3), complex), self.sky, NOON)
        wrong("3 times for 2 points", np.zeros((2, 3)), self.sky, [NOON] * 3)
        wrong("is not a unit vector", np.zeros((2, 3)), directions=[[0, 0, 2]])
        wrong("'X99' is not a satellite", np.zeros((2, 3)), self.sky, NOON, satellites=["X99"])
        wrong("is not a time", np.zeros((2, 3)), self.sky, {})
        wrong("did you mean 'reflection_order'", np.zeros((2, 3)), self.sky, NOON, propagation={"reflection_ordr": 1})


if __name__ == "__main__":
    unittest.main()
