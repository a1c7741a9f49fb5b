// The group delay of every signal, in metres, against hand calculations with the formulas of the interface
// documents: a clock is broadcast for one signal or pair, and the others are transmitted later by these
// delays. tests/integration/group_delays_test.cpp compares them with RTKLIB.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"

namespace canyon::orbit {
namespace {

const geodesy::GpsTime kTime = geodesy::GpsTime::from_week(2051, 43200);

gnss::KeplerEphemeris kepler(gnss::System system, double first_s, double second_s, int data_sources = 0) {
  gnss::KeplerEphemeris e;
  e.id = {system, 11};
  e.toe = e.toc = kTime;
  e.sqrt_a = 5153.6;
  e.group_delay = {first_s, second_s};
  e.data_sources = data_sources;
  return e;
}

struct Delay {
  std::string signal;
  double metres;
};

/// Within 1 mm.
void expect_delays(const SatelliteState& state, gnss::System system, const std::vector<Delay>& expected) {
  const auto signals = gnss::signals_of(system);
  const auto is_simulated = [](const gnss::Signal& signal) { return signal.only_recorded.empty(); };
  ASSERT_LE(static_cast<std::size_t>(std::count_if(signals.begin(), signals.end(), is_simulated)),
            expected.size());
  for (const Delay& delay : expected) {
    const auto signal = std::find_if(signals.begin(), signals.end(),
                                     [&](const gnss::Signal& each) { return each.name == delay.signal; });
    ASSERT_NE(signal, signals.end()) << delay.signal;
    EXPECT_NEAR(geodesy::kSpeedOfLight * state.group_delay_of(*signal), delay.metres, 1e-3)
        << name(system) << ' ' << delay.signal;
  }
}

// IS-GPS-200 20.3.3.3.3.2, IS-QZSS-PNT 5.5.3: TGD at L1, (77/60)^2 TGD = 1.646944 TGD at L2; the same rule at
// L5, (154/115)^2 = 1.793270, instead of its inter-signal correction. TGD of -24 and 11 steps of 2^-31 s.
TEST(GroupDelaysInMetres, GpsAndQzss) {
  expect_delays(propagate(kepler(gnss::System::GPS, -24 * 0x1p-31, 0), kTime), gnss::System::GPS,
                {{"L1CA", -3.3504}, {"L1C", -3.3504}, {"L2C", -5.5180}, {"L5", -6.0082}, {"L2P", -5.5180}});
  expect_delays(propagate(kepler(gnss::System::QZSS, 11 * 0x1p-31, 0), kTime), gnss::System::QZSS,
                {{"L1CA", 1.5356}, {"L1C", 1.5356}, {"L2C", 2.5291}, {"L5", 2.7538}});
}

// OS SIS ICD 2.1, 5.1.5. BGD(E1,E5a) a = -37 2^-32 s (-2.5826 m), BGD(E1,E5b) b = -52 2^-32 s (-3.6296 m).
// I/NAV, clock of E1 and E5b: E1 b, E5b (154/118)^2 b; F/NAV, of E1 and E5a: E1 a, E5a (154/115)^2 a. A
// definition of BGD, (t(E1) - t(E5)) / (1 - (f1/f5)^2), gives the third: E5a b + 0.793270 a, E5b a + 0.703246
// b.
TEST(GroupDelaysInMetres, GalileoByEitherClock) {
  const double a = -37 * 0x1p-32, b = -52 * 0x1p-32;
  expect_delays(propagate(kepler(gnss::System::Galileo, a, b, 1 << 9), kTime), gnss::System::Galileo,
                {{"E1", -3.6296}, {"E5a", -5.6784}, {"E5b", -6.1822}});
  expect_delays(propagate(kepler(gnss::System::Galileo, a, b, 1 << 8), kTime), gnss::System::Galileo,
                {{"E1", -2.5826}, {"E5a", -4.6314}, {"E5b", -5.1352}});
}

// BDS-SIS-ICD-B1I-3.0 5.2.4.10 and 2.1 5.2.4.10: clock of B3I; TGD1 of 142 and TGD2 of -53 steps of 0.1 ns.
// B1C and B2a use those of their neighbours, because the message of B1I and B2I has none for them; B2b, which
// only satellites without B2I send, has none.
TEST(GroupDelaysInMetres, BeiDou) {
  expect_delays(
      propagate(kepler(gnss::System::BeiDou, 142e-10, -53e-10), kTime), gnss::System::BeiDou,
      {{"B1I", 4.2571}, {"B1C", 4.2571}, {"B2I", -1.5889}, {"B2a", -1.5889}, {"B3I", 0}, {"B2b", 0}});
}

// ICD GLONASS L1, L2 5.1, 4.4: the clock refers to L1, delta tau n is the delay of L2; -12 steps of 2^-30 s.
TEST(GroupDelaysInMetres, Glonass) {
  gnss::GlonassEphemeris e;
  e.id = {gnss::System::GLONASS, 7};
  e.toe = kTime;
  e.position_m = {25.5e6, 0, 0};
  e.velocity_mps = {0, 3000, 0};
  e.group_delay_difference_s = -12 * 0x1p-30;
  expect_delays(propagate(e, kTime), gnss::System::GLONASS, {{"G1", 0}, {"G2", -3.3504}});
}

// Message 9 has none (RTCA DO-229 A.4.4.11).
TEST(GroupDelaysInMetres, Sbas) {
  gnss::SbasEphemeris e;
  e.id = {gnss::System::SBAS, 23};
  e.toe = kTime;
  e.position_m = {42164e3, 0, 0};
  expect_delays(propagate(e, kTime), gnss::System::SBAS, {{"L1CA", 0}});
}

}  // namespace
}  // namespace canyon::orbit
