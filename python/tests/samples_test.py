"""Samples in Python equal those of `canyon iq`, in bounded memory."""

import itertools
import resource
import unittest

import numpy as np

import canyon

SCENARIO = {
    "city": {"open": True, "origin": {"latitude_deg": 48.1, "longitude_deg": 11.6, "height_m": 520}},
    "start": "2026-06-01T08:00:00Z", "duration_s": 2, "sky": {"nominal": True, "systems": ["GPS"]},
    "trajectory": {"position": {"east_m": 0, "north_m": 0, "up_m": 1.5}}, "receivers": [{"name": "car"}],
}


class Samples(unittest.TestCase):
    def test_blocks_are_the_array(self):
        whole = canyon.samples(SCENARIO, rate_hz=2e6)
        self.assertEqual((whole.dtype, whole.ndim), (np.complex64, 1))
        self.assertAlmostEqual(len(whole) / 4e6, 1, places=3)
        blocks = list(canyon.sample_blocks(SCENARIO, rate_hz=2e6, block=300_000, threads=1, receiver="car"))
        self.assertEqual({len(block) for block in blocks[:-1]}, {300_000})
        np.testing.assert_array_equal(np.concatenate(blocks), whole)
        noise = whole - canyon.samples(SCENARIO, rate_hz=2e6, noise=False)
        self.assertAlmostEqual(float(np.mean(np.abs(noise) ** 2)), 2, places=2)

    def test_real_samples_are_of_one_part(self):
        real = canyon.samples(SCENARIO, rate_hz=8e6, intermediate_hz=2e6, real=True, bandwidth_hz=2.5e6, duration_s=1)
        self.assertEqual(real.dtype, np.float32)
        density = np.abs(np.fft.rfft(real[: 1 << 22])) ** 2
        within = density[(1 << 19) : 3 << 19].sum()  # 1 to 3 MHz of 4
        self.assertGreater(within / density.sum(), 0.6)  # 0.5 without a filter
        self.assertLess(density[int(3.9 / 4 * (1 << 21)) :].sum() / density.sum(), 1e-5)

    def test_the_former_name_of_the_intermediate_frequency_warns(self):
        with self.assertWarnsRegex(FutureWarning, "if_hz is now intermediate_hz"):
            former = canyon.samples(SCENARIO, rate_hz=2e6, if_hz=2e5)
        np.testing.assert_array_equal(former, canyon.samples(SCENARIO, rate_hz=2e6, intermediate_hz=2e5))

    def test_the_scenario_says_what_is_left_out(self):
        scenario = {**SCENARIO, "samples": {"bands": ["L2"], "rate_hz": 2e6, "noise": False}}
        np.testing.assert_array_equal(canyon.samples(scenario), canyon.samples(SCENARIO, band="L2", rate_hz=2e6, noise=False))
        scenario["samples"]["bands"].append("L5")
        with self.assertRaisesRegex(canyon.InputError, "choose one with band"):
            canyon.samples(scenario)

    def test_long_runs_need_little_memory(self):
        blocks = canyon.sample_blocks(SCENARIO, rate_hz=4e6, duration_s=3600, block=1 << 16)
        before = [next(blocks) for _ in range(20)] and resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        for _ in itertools.islice(blocks, 1200):  # 20 s, 630 MB
            pass
        blocks.close()
        self.assertLess(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before, 100_000)

    def test_bad_input_is_one_clear_error(self):
        for words, problem in (
            ({"band": "L9"}, "is not a band"),
            ({"rate_hz": 1e3}, "must be at least"),
            ({"real": True}, "intermediate frequency"),
            ({"real": True, "intermediate_hz": 3e6}, "aliased"),
            ({"bandwidth_hz": 4e6}, "on either side"),
            ({"receiver": "bus"}, "no receiver 'bus'"),
            ({"duration_s": 0.5}, "one epoch"),
        ):
            with self.subTest(words), self.assertRaisesRegex(canyon.InputError, problem):
                canyon.samples(SCENARIO, **words)
        with self.assertRaisesRegex(canyon.InputError, "never end"):
            next(canyon.sample_blocks(SCENARIO, block=0))


if __name__ == "__main__":
    unittest.main()
