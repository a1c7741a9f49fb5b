#include "canyon/outputs/encoding/observations/raw_observations.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/sky/gnss/signals.hpp"

namespace canyon::encoding {
namespace {

using geodesy::kSpeedOfLight;

/// An epoch of a clock with this bias and drift, of one satellite at a range that changes by `rate_mps`.
receiver::ReceiverEpoch drifting_epoch(geodesy::GpsTime begin, double elapsed_s, double bias_s, double drift,
                                       double rate_mps) {
  receiver::ReceiverEpoch seen;
  seen.time = begin + elapsed_s;
  seen.clock_bias_s = bias_s + drift * elapsed_s;
  seen.clock_drift = drift;
  seen.receiver_time = seen.time + seen.clock_bias_s;
  receiver::SatelliteObservation satellite;
  satellite.id = {gnss::System::GPS, 5};
  satellite.signal = &gnss::signals_of(gnss::System::GPS).front();
  positioning::Measurement m;
  m.id = satellite.id;
  m.carrier_frequency_hz = satellite.signal->carrier_hz;
  m.pseudorange_m = 22e6 + rate_mps * elapsed_s + kSpeedOfLight * seen.clock_bias_s;
  m.carrier_phase_cycles = m.pseudorange_m * m.carrier_frequency_hz / kSpeedOfLight;
  m.phase_since = begin;
  // Doppler with the receiver's oscillator, as in Receiver.
  m.doppler_hz = -m.carrier_frequency_hz / kSpeedOfLight * (rate_mps + kSpeedOfLight * drift) / (1 + drift);
  satellite.measurement = m;
  seen.satellites.push_back(satellite);
  return seen;
}

class RatesOfPhases : public testing::TestWithParam<Tags> {};

// An estimator that ties the clock's bias to its drift uses both.
TEST_P(RatesOfPhases, AreTheNegativeDoppler) {
  const geodesy::GpsTime begin = geodesy::GpsTime::from_week(2051, 46701.0);
  constexpr double kWavelength_m = kSpeedOfLight / 1575.42e6;
  for (const double drift : {0.0, 3.3e-8, -2.1e-7}) {
    RawObservations raw(GetParam());
    std::optional<RawEpoch> before;
    for (int k = 0; k < 300; ++k) {
      const RawEpoch now = raw.next(drifting_epoch(begin, k, 123'456.78e-9, drift, -612.3));
      ASSERT_EQ(now.observations.size(), 1U);
      const RawObservation& o = now.observations.front();
      EXPECT_NEAR(o.pseudorange_m, *o.carrier_phase_cycles * kWavelength_m, kWavelength_m);
      if (before && now.tag - before->tag < 1.0005) {
        // A tag has a resolution of 1 ns, phases near 1e8 cycles one of 1.5e-8 cycles.
        const double rate_hz = (*o.carrier_phase_cycles - *before->observations[0].carrier_phase_cycles) /
                               (now.tag - before->tag);
        EXPECT_NEAR(rate_hz, -*o.doppler_hz, 1e-5) << k << " with a drift of " << drift;
      }
      before = now;
    }
  }
}
INSTANTIATE_TEST_SUITE_P(RawObservations, RatesOfPhases,
                         testing::Values(Tags::ClockReading, Tags::WholeMilliseconds));

TEST(RawObservations, RangesOfASteeredClockHaveNoBias) {
  const geodesy::GpsTime begin = geodesy::GpsTime::from_week(2051, 46701.0);
  RawObservations steered(Tags::WholeMilliseconds), as_read(Tags::ClockReading);
  const receiver::ReceiverEpoch seen = drifting_epoch(begin, 7, 123'456.78e-9, 1e-7, -612.3);
  const RawEpoch moved = steered.next(seen), kept = as_read.next(seen);
  EXPECT_EQ(moved.tag, seen.time);
  EXPECT_NEAR(moved.observations[0].pseudorange_m, 22e6 - 612.3 * 7, 1e-6);
  EXPECT_EQ(kept.tag, seen.receiver_time);
  EXPECT_EQ(kept.observations[0].pseudorange_m, seen.satellites[0].measurement->pseudorange_m);
}

}  // namespace
}  // namespace canyon::encoding
