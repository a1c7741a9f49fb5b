"""User models in Python, in runs and live."""

import gc
import unittest

import numpy as np

import canyon

OPEN = {"open": True, "origin": {"latitude_deg": 48.1, "longitude_deg": 11.6, "height_m": 520}}
PLACE = {
    "city": OPEN,
    "start": "2026-06-01T08:00:00Z",
    "duration_s": 5,
    "trajectory": {"position": {"east_m": 0, "north_m": 0, "up_m": 1.5}},
}
# Plain least squares, without filter, RAIM and smoothing, as in the paper's receiver.
PLAIN = {**PLACE, "receivers": [{"name": "rover", "profile": "paper"}]}


class GaussNewton:
    """Least squares of position and one clock for each system."""

    def solve(self, problem):
        if len(problem.satellites) < 5:
            return None
        systems = sorted({name[0] for name in problem.satellites})
        counts = {s: sum(name[0] == s for name in problem.satellites) for s in systems}
        keep = np.array([counts[name[0]] > 1 for name in problem.satellites])
        systems = [s for s in systems if counts[s] > 1]
        clock = np.array([[name[0] == s for s in systems] for name in problem.satellites], float)[keep]
        place = np.array(problem.start_ecef_m)
        for _ in range(5):
            way = problem.position_ecef_m[keep] - place
            distance = np.linalg.norm(way, axis=1)
            design = np.hstack([-way / distance[:, None], clock]) / problem.sigma_m[keep, None]
            solution, *_ = np.linalg.lstsq(design, (problem.range_m[keep] - distance) / problem.sigma_m[keep], rcond=None)
            residual_free = solution[:3]
            place = place + residual_free
            clock_m = clock @ solution[3:]
            if np.linalg.norm(residual_free) < 1e-4:
                break
        return place


class Models(unittest.TestCase):
    def test_an_own_least_squares_is_the_engines(self):
        """The same equations have the same solution: within 1 mm for a position known to 5 m."""
        own = canyon.simulate(PLAIN, models=canyon.Models(solver=GaussNewton()))
        engine = canyon.simulate(PLAIN)
        self.assertEqual(list(own.epochs["status"]), ["fix"] * 6)
        for name in ["error_east_m", "error_north_m", "error_up_m"]:
            np.testing.assert_allclose(own.epochs[name], engine.epochs[name], atol=1e-3)
        for name in ["hdop", "vdop", "sigma_east_m"]:
            np.testing.assert_allclose(own.epochs[name], engine.epochs[name], rtol=1e-3)

    def test_an_own_solver_has_the_engines_accuracy_and_filter(self):
        class Same:
            def solve(self, problem):
                return problem.start_ecef_m

        for filtered in (False, True):
            receiver = {"name": "rover", "profile": "ublox-m8t", "position_filter": {"enabled": filtered}}
            own, engine = (canyon.simulate({**PLACE, "receivers": [receiver]}, models=models)
                           for models in (canyon.Models(solver=Same()), None))
            for name in ["error_east_m", "error_up_m", "sigma_east_m", "sigma_up_m", "fix_velocity_east_mps", "hdop"]:
                np.testing.assert_allclose(own.epochs[name], engine.epochs[name], rtol=1e-5, atol=1e-5, err_msg=name)

    def test_no_answer_is_no_fix(self):
        class Never:
            def solve(self, problem):
                return None

        run = canyon.simulate(PLAIN, models=canyon.Models(solver=Never()))
        self.assertEqual(run.summary["fixes"], 0)

    def test_weights_move_the_fix(self):
        """Equal weights are the same as `weighting: equal`."""
        engine = canyon.simulate({**PLAIN, "receivers": [{"name": "rover", "profile": "paper", "weights": {"weighting": "equal"}}]})
        alike = canyon.simulate(PLAIN, models=canyon.Models(weighting=lambda *_: 3.0))
        np.testing.assert_allclose(alike.epochs["error_up_m"], engine.epochs["error_up_m"], atol=1e-6)

    def test_disturbances_live_and_in_runs(self):
        class Later:
            """All paths are 30 m longer: this changes the clock, not the position."""

            def __init__(self):
                self.begun = []

            def begin(self, seed, receiver):
                self.begun.append(seed)

            def apply(self, arrival):
                for satellite in arrival.satellites:
                    for path in satellite.paths:
                        path.excess_m += 30.0

        later = Later()
        plain = canyon.simulate(PLAIN)
        run = canyon.simulate(PLAIN, models=canyon.Models(disturbances=[later]))
        self.assertEqual(later.begun, [1])
        np.testing.assert_allclose(run.satellites["excess_path_m"], plain.satellites["excess_path_m"] + 30)
        np.testing.assert_allclose(run.epochs["error_east_m"], plain.epochs["error_east_m"], atol=1e-3)
        receiver = canyon.ReceiverRunner(canyon.City(**OPEN), PLACE["start"], profile="paper", independent_noise=False,
                                       models=canyon.Models(disturbances=[lambda seed, name: Later()]))
        live = receiver.observe(0, (0, 0, 1.5)).table("satellites")
        np.testing.assert_allclose(live["excess_path_m"], 30)

    def test_an_antenna(self):
        """10 dB less everywhere is 10 dB-Hz less (true C/N0, if one path arrives)."""
        strong = {**PLACE, "receivers": [{"name": "rover", "profile": "survey", "signal": {"antenna": "isotropic"}}]}
        flat = canyon.simulate(strong, models=canyon.Models(antenna=lambda elevation, carrier: (0.0, -100.0)))
        deaf = canyon.simulate(strong, models=canyon.Models(antenna=lambda elevation, carrier: (-10.0, -110.0)))
        difference = flat.satellites["true_cn0_dbhz"] - deaf.satellites["true_cn0_dbhz"]
        np.testing.assert_allclose(difference[np.isfinite(difference)], 10, atol=1e-6)
        self.assertGreater(np.isfinite(difference).sum(), 20)

    def test_what_is_lent_is_gone_afterwards(self):
        kept = []

        class Keeps:
            def apply(self, arrival):
                kept.append(arrival.satellites[0])

        canyon.simulate(PLAIN, models=canyon.Models(disturbances=[Keeps()]))
        with self.assertRaises(canyon.InputError):
            kept[0].elevation_rad

    def test_errors_come_out_as_they_are(self):
        class Breaks:
            def apply(self, arrival):
                raise KeyError("mine")

        models = canyon.Models(disturbances=[Breaks()])
        with self.assertRaises(KeyError):
            canyon.simulate(PLAIN, models=models)
        with self.assertRaises(KeyError):
            list(canyon.Simulation(PLAIN, models=models))
        gc.collect()

    def test_bad_models(self):
        def wrong(text, **models):
            with self.assertRaises(canyon.InputError) as caught:
                canyon.simulate(PLAIN, models=canyon.Models(**models))
            self.assertIn(text, str(caught.exception))

        wrong("is not a disturbance", disturbances=[3])
        wrong("weighting is not a function", weighting=3)
        wrong("the solver has no method solve", solver=3)
        wrong("the weighting returns nan m", weighting=lambda *_: float("nan"))
        wrong("is not three numbers", solver=lambda *_: type("S", (), {"solve": lambda self, p: [1, 2]})())
        with self.assertRaises(canyon.InputError):
            canyon.simulate(PLAIN, models={"bus": canyon.Models()})


if __name__ == "__main__":
    unittest.main()
