#include "canyon/sky/orbit/broadcast_sky.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/gnss/signals.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "tests/support/rinex_sample.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon::orbit {
namespace {

using geodesy::GpsTime;
using geodesy::parse_time;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

const gnss::SatelliteId kG05{gnss::System::GPS, 5}, kE11{gnss::System::Galileo, 11},
    kC21{gnss::System::BeiDou, 21}, kR07{gnss::System::GLONASS, 7}, kJ02{gnss::System::QZSS, 2},
    kS23{gnss::System::SBAS, 23};

gnss::NavigationData sample() {
  return rinex::read_rinex_navigation(TextFile::from_string(test::kRinex3Sample + test::kS23, "sample.rnx"));
}

gnss::NavigationData only(gnss::SatelliteId id) {
  gnss::NavigationData data = sample();
  const auto other = [id](const auto& e) { return e.id != id; };
  data.kepler.erase(std::remove_if(data.kepler.begin(), data.kepler.end(), other), data.kepler.end());
  data.glonass.erase(std::remove_if(data.glonass.begin(), data.glonass.end(), other), data.glonass.end());
  data.sbas.erase(std::remove_if(data.sbas.begin(), data.sbas.end(), other), data.sbas.end());
  return data;
}

// --- propagation
// ----------------------------------------------------------------------------------------------

/// Central differences of fourth order over +-20 s: their truncation is below 1e-9 m/s; the rest is the
/// rounding of angles of up to 44 rad (7e-15 rad, 0.3 um in geostationary orbit).
template <typename Ephemeris>
void expect_derivatives(const Ephemeris& e, double reach_s, double& worst_velocity, double& worst_drift) {
  constexpr double kStep = 10;
  for (double age = -reach_s; age <= reach_s; age += reach_s / 7.3) {
    const GpsTime t = e.toe + age;
    const auto at = [&](double steps) { return propagate(e, t + steps * kStep); };
    const SatelliteState state = at(0), m2 = at(-2), m1 = at(-1), p1 = at(1), p2 = at(2);
    const Eigen::Vector3d velocity =
        (8 * (p1.position_m - m1.position_m) - (p2.position_m - m2.position_m)) / (12 * kStep);
    const double drift =
        (8 * (p1.clock_bias_s - m1.clock_bias_s) - (p2.clock_bias_s - m2.clock_bias_s)) / (12 * kStep);
    worst_velocity = std::max(worst_velocity, (velocity - state.velocity_mps).norm());
    worst_drift = std::max(worst_drift, std::abs(drift - state.clock_drift));
  }
}

void expect_derivatives(const gnss::NavigationData& data) {
  double kepler = 0, glonass = 0, sbas = 0, drift = 0;
  for (const gnss::KeplerEphemeris& e : data.kepler)
    expect_derivatives(e, validity(e).after_s, kepler, drift);
  for (const gnss::GlonassEphemeris& e : data.glonass)
    expect_derivatives(e, validity(e).after_s, glonass, drift);
  for (const gnss::SbasEphemeris& e : data.sbas) expect_derivatives(e, validity(e).after_s, sbas, drift);
  std::printf(
      "  velocity within %.1e m/s (GLONASS %.1e, SBAS %.1e), clock drift within %.1e s/s of numeric "
      "differentiation\n",
      kepler, glonass, sbas, drift);
  EXPECT_LT(kepler, 1e-7);
  EXPECT_LT(sbas, 1e-7);
  EXPECT_LT(glonass, 1e-5);  // position and velocity have separate integration errors
  EXPECT_LT(drift, 1e-18);
}

TEST(Propagate, VelocityAndDriftAreTheDerivatives) {
  expect_derivatives(sample());
}

TEST(Propagate, VelocityAndDriftAreTheDerivativesOnARealDay) {
  CANYON_SHARED_DATA(path, "orbits/ESBC00DNK_R_20201770000_01D_MN.rnx.gz");
  expect_derivatives(rinex::read_rinex_navigation(path));
}

TEST(Propagate, GlonassIntegrationErrorIsMillimetres) {
  const gnss::GlonassEphemeris start = only(kR07).glonass.front();
  for (const double direction : {-1.0, 1.0}) {
    gnss::GlonassEphemeris e = start;  // integrated in steps of 1 s
    for (int i = 0; i < 1800; ++i) {
      const SatelliteState state = propagate(e, e.toe + direction);
      e.toe = e.toe + direction;
      for (std::size_t k = 0; k < 3; ++k) {
        e.position_m[k] = state.position_m[static_cast<Eigen::Index>(k)];
        e.velocity_mps[k] = state.velocity_mps[static_cast<Eigen::Index>(k)];
      }
    }
    const SatelliteState fine = propagate(e, e.toe), coarse = propagate(start, e.toe);
    std::printf("  60 s steps against 1 s steps after 30 min: %.1e m, %.1e m/s\n",
                (fine.position_m - coarse.position_m).norm(),
                (fine.velocity_mps - coarse.velocity_mps).norm());
    EXPECT_LT((fine.position_m - coarse.position_m).norm(), 2e-3);
    EXPECT_LT((fine.velocity_mps - coarse.velocity_mps).norm(), 1e-6);
  }
}

TEST(GlonassOrbit, IsThatOfItsEphemerisToTheBit) {
  const gnss::GlonassEphemeris e = only(kR07).glonass.front();
  const GlonassOrbit orbit;
  // Times extend beyond the stored states, and are on both sides of whole steps.
  for (double dt = -2500; dt <= 2500; dt += dt == std::floor(dt) ? 0.0625 : 9.9375) {
    const SatelliteState a = propagate(e, e.toe + dt), b = orbit.propagate(e, e.toe + dt);
    ASSERT_EQ(a.position_m, b.position_m) << dt;
    ASSERT_EQ(a.velocity_mps, b.velocity_mps) << dt;
    ASSERT_EQ(a.clock_bias_s, b.clock_bias_s) << dt;
  }
}

TEST(Propagate, CircularEquatorialOrbitInClosedForm) {
  gnss::KeplerEphemeris e;
  e.id = kG05;
  e.toe = e.toc = GpsTime::from_week(2051, 43200);
  e.sqrt_a = 5153.6;
  e.right_ascension = 0.3;
  const double a = e.sqrt_a * e.sqrt_a;
  const double n = std::sqrt(3.986005e14 / (a * a * a));  // IS-GPS-200 table 20-IV
  for (const double tk : {-7200.0, 0.0, 1234.5, 7200.0}) {
    const double longitude = 0.3 + n * tk - geodesy::kEarthRotationRate * (43200 + tk);
    const SatelliteState state = propagate(e, e.toe + tk);
    EXPECT_NEAR(state.position_m.x(), a * std::cos(longitude), 1e-6);
    EXPECT_NEAR(state.position_m.y(), a * std::sin(longitude), 1e-6);
    EXPECT_NEAR(state.position_m.z(), 0, 1e-9);
    EXPECT_NEAR(state.velocity_mps.norm(), a * (n - geodesy::kEarthRotationRate), 1e-9);
  }
}

TEST(Propagate, RelativityOfAnEccentricOrbit) {
  gnss::NavigationData data = only(kG05);
  gnss::KeplerEphemeris e = data.kepler.front();
  // IS-GPS-200, 20.3.3.3.3.1: -2 (R . V) / c^2 with the inertial velocity equals F e sqrt(A) sin E for an
  // orbit without perturbations.
  e.cuc = e.cus = e.crc = e.crs = e.cic = e.cis = 0;
  e.mean_motion_difference = e.inclination_rate = e.right_ascension_rate = 0;
  e.af0 = e.af1 = e.af2 = 0;
  for (const double tk : {-7000.0, 0.0, 3000.0}) {
    const SatelliteState state = propagate(e, e.toe + tk);
    const double r_dot_v = state.position_m.dot(state.velocity_mps);  // a rotation does not change it
    EXPECT_NEAR(state.clock_bias_s, -2 * r_dot_v / std::pow(geodesy::kSpeedOfLight, 2), 1e-15);
  }
}

TEST(Propagate, GroupDelayBelongsToTheL1Signal) {
  const gnss::NavigationData data = sample();
  const auto delay = [&data](gnss::SatelliteId id) {
    for (const gnss::KeplerEphemeris& e : data.kepler) {
      if (e.id == id) return propagate(e, e.toe).group_delay_s;
    }
    return propagate(data.glonass.front(), data.glonass.front().toe).group_delay_s;
  };
  EXPECT_EQ(delay(kG05), -1.769512891769e-08);  // TGD
  EXPECT_EQ(delay(kE11), -2.095475792885e-09);  // I/NAV: BGD E5b/E1
  EXPECT_EQ(delay(kC21), 1.600000021362e-09);   // TGD1
  EXPECT_EQ(delay(kJ02), -5.587935447693e-09);
  EXPECT_EQ(delay(kR07), 0);
  gnss::KeplerEphemeris fnav = only(kE11).kepler.front();
  fnav.data_sources = 258;
  EXPECT_EQ(propagate(fnav, fnav.toe).group_delay_s, -1.862645149231e-09);  // BGD E5a/E1
  EXPECT_EQ(propagate(data.glonass.front(), data.glonass.front().toe).carrier_frequency_hz,
            1602e6 + 5 * 562500.0);
}

// The delays in the nearest of the newer messages are used. Other signals have TGD at L1 and (f1 / f)^2 TGD
// elsewhere.
TEST(BroadcastSkyTest, TakesDelaysOfSignalsFromNewerMessages) {
  gnss::NavigationData data = only(kG05);
  const GpsTime toe = data.kepler.front().toe;
  const double tgd = data.kepler.front().group_delay[0], nan = std::nan("");
  data.signal_delays = {{kG05, toe - 7200.0, {1e-9, nan, 2e-9, nan, nan}},
                        {kG05, toe, {nan, nan, 3e-9, 4e-9, nan}}};
  const BroadcastSky sky(data);
  const auto before = sky.state(kG05, toe - 6000.0), now = sky.state(kG05, toe + 60.0);
  ASSERT_TRUE(before && now);
  const auto gps = gnss::signals_of(gnss::System::GPS);  // L1CA, L1C, L2C, L5
  EXPECT_EQ(before->group_delay_s, 1e-9);
  EXPECT_EQ(before->group_delay_of(gps[2]), 2e-9);
  EXPECT_EQ(before->group_delay_of(gps[1]), tgd);
  EXPECT_EQ(now->group_delay_s, tgd);
  EXPECT_EQ(now->group_delay_of(gps[2]), 3e-9);
  EXPECT_EQ(now->group_delay_of(gps[3]), 4e-9);

  // A message without a field for a signal does not hide another one with the field (CNAV has none for L1C).
  const double none = std::numeric_limits<double>::infinity();
  data.signal_delays = {{kG05, toe - 60.0, {1e-9, 5e-9, 2e-9, 4e-9}}, {kG05, toe, {6e-9, none, nan, 7e-9}}};
  const auto both = BroadcastSky(data).state(kG05, toe + 60.0);
  EXPECT_EQ(both->group_delay_s, 6e-9);
  EXPECT_EQ(both->group_delay_of(gps[1]), 5e-9);
  EXPECT_NE(both->group_delay_of(gps[2]), 2e-9) << "the nearest leaves it blank";
  EXPECT_EQ(both->group_delay_of(gps[3]), 7e-9);
}

TEST(Propagate, BeidouGeostationariesStandInTheirPlaces) {
  CANYON_SHARED_DATA(path, "urbannav-tst-20190428/hksc1180.19b");
  // BDS-SIS-ICD B1I 3.0, 2.1: geostationary longitudes of C04, C01, C03, C02, C05.
  const std::map<int, double> longitude_deg{{1, 140}, {2, 80}, {3, 110.5}, {4, 160}, {5, 58.75}};
  int seen = 0;
  for (const gnss::KeplerEphemeris& e : rinex::read_rinex_navigation(path).kepler) {
    if (!is_beidou_geo(e.id)) continue;
    ++seen;
    for (double age = -3600; age <= 3600; age += 1800) {
      const SatelliteState state = propagate(e, e.toe + age);
      const Eigen::Vector3d& p = state.position_m;
      EXPECT_NEAR(geodesy::degrees(std::atan2(p.y(), p.x())), longitude_deg.at(e.id.number), 5)
          << to_string(e.id);
      EXPECT_LT(std::abs(p.z()), std::sin(geodesy::radians(2.5)) * 42.2e6);
      EXPECT_LT(state.velocity_mps.norm(), 150);
    }
  }
  EXPECT_GT(seen, 50);
}

// RTCA DO-229 A.4.4.11, computed explicitly for 300 s.
TEST(Propagate, SbasIsAParabolaInTheRotatingFrame) {
  const gnss::SbasEphemeris e = only(kS23).sbas.front();
  const SatelliteState state = propagate(e, e.toe + 300.0);
  EXPECT_NEAR(state.position_m.x(), 35944600.08 + 300 * 1.25 - 45000 * 1.25e-5, 1e-7);
  EXPECT_NEAR(state.position_m.y(), 22044140 - 300 * 2.1875 + 45000 * 2.5e-5, 1e-7);
  EXPECT_NEAR(state.position_m.z(), 120000 + 300 * 36 - 45000 * 6.25e-5, 1e-7);
  EXPECT_NEAR(state.velocity_mps.z(), 36 - 300 * 6.25e-5, 1e-12);
  EXPECT_NEAR(state.clock_bias_s, 9.313225746155e-09 - 300 * 1.818989403546e-12, 1e-20);
  EXPECT_EQ(state.clock_drift, -1.818989403546e-12);
  EXPECT_EQ(state.group_delay_s, 0);
  EXPECT_EQ(state.carrier_frequency_hz, 1575.42e6);
}

// --- choice
// ---------------------------------------------------------------------------------------------------

TEST(BroadcastSky, ListsSatellitesAndSpan) {
  const BroadcastSky sky(sample());
  std::string list;
  for (const gnss::SatelliteId id : sky.satellites()) list += to_string(id);
  EXPECT_EQ(list, "G05R07E11C03C21J02");
  EXPECT_EQ(sky.span().first, parse_time("2019-04-28T11:45:18 GPST"));
  EXPECT_EQ(sky.span().second, parse_time("2019-04-28T12:00:14 GPST"));
  // SBAS must be named.
  const std::set<gnss::System> all{gnss::kAllSystems.begin(), gnss::kAllSystems.end()};
  EXPECT_EQ(BroadcastSky(sample(), {all, false, false}).satellites().back(), kS23);
  const BroadcastSky two(sample(), {{gnss::System::GPS, gnss::System::BeiDou}, false, false});
  EXPECT_EQ(two.satellites().size(), 3u);
  EXPECT_FALSE(two.state(kE11, parse_time("2019-04-28T12:00:00 GPST")));
  EXPECT_THAT(two.source(kE11, {}), HasSubstr("no ephemeris of E11"));
}

TEST(BroadcastSky, ValidityOfEachSystem) {
  const struct {
    gnss::SatelliteId id;
    double before_s, after_s;
  } cases[] = {{kG05, 7200, 7200},  {kJ02, 7200, 7200}, {kE11, 1800, 14400},
               {kC21, 3600, 10800}, {kR07, 1800, 1800}, {kS23, 360, 360}};
  for (const auto& [id, before_s, after_s] : cases) {
    const gnss::NavigationData data = only(id);
    const GpsTime toe = !data.kepler.empty()    ? data.kepler.front().toe
                        : !data.glonass.empty() ? data.glonass.front().toe
                                                : data.sbas.front().toe;
    const BroadcastSky sky(data, {{gnss::System(id.system)}, false, false}),
        stale(data, {{gnss::System(id.system)}, true, false});
    for (const double inside : {-before_s, 0.0, after_s}) {
      EXPECT_TRUE(sky.state(id, toe + inside));
      EXPECT_TRUE(sky.covers(toe + inside));
      EXPECT_THAT(sky.source(id, toe + inside), AllOf(HasSubstr("sample.rnx"), Not(HasSubstr("none"))));
    }
    for (const double outside : {-before_s - 1, after_s + 1}) {
      EXPECT_FALSE(sky.state(id, toe + outside));
      EXPECT_FALSE(sky.covers(toe + outside));
      EXPECT_TRUE(stale.state(id, toe + outside));
      EXPECT_TRUE(stale.covers(toe + outside));
      EXPECT_THAT(stale.source(id, toe + outside), HasSubstr("stale"));
    }
    EXPECT_THAT(sky.source(id, toe + 5 * after_s),
                AllOf(HasSubstr("none: "), HasSubstr("after toe"), HasSubstr("allow_stale: true")));
    EXPECT_THAT(sky.source(id, toe - 5 * before_s), HasSubstr("before toe"));
  }
}

TEST(BroadcastSky, FitIntervalWidensTheValidity) {
  gnss::NavigationData data = only(kG05);
  data.kepler.front().fit_interval_h = 8;
  const GpsTime toe = data.kepler.front().toe;
  const BroadcastSky sky(data);
  EXPECT_TRUE(sky.state(kG05, toe + 4 * 3600.0));
  EXPECT_FALSE(sky.state(kG05, toe + 4 * 3600.0 + 1));
  for (const double flag : {0.0, 1.0}) {  // not given; the message's bit instead of hours
    data.kepler.front().fit_interval_h = flag;
    EXPECT_TRUE(BroadcastSky(data).state(kG05, toe + 7200.0));
    EXPECT_FALSE(BroadcastSky(data).state(kG05, toe + 7201.0));
  }
}

TEST(BroadcastSky, ALongFitReachesBeyondACloserShortOne) {
  gnss::NavigationData data = only(kG05);
  gnss::KeplerEphemeris far = data.kepler.front();
  far.fit_interval_h = 26;
  far.toe = far.toe - 7200.0;
  far.af0 = 1;
  data.kepler.push_back(far);
  const BroadcastSky sky(data);
  const GpsTime toe = data.kepler.front().toe;
  EXPECT_LT(sky.state(kG05, toe + 3600.0)->clock_bias_s, 0.1);
  EXPECT_GT(sky.state(kG05, toe + 7300.0)->clock_bias_s, 0.1);
}

TEST(BroadcastSky, ClosestToeThenNewestMessage) {
  gnss::NavigationData data = only(kG05);
  const gnss::KeplerEphemeris first = data.kepler.front();
  const auto add = [&](double toe_after, double sent_after, double af0) {
    gnss::KeplerEphemeris e = first;
    e.toe = first.toe + toe_after;
    e.toc = e.toe;
    e.transmission = first.toe + sent_after;
    e.af0 = af0;
    e.af1 = 0;
    e.eccentricity = 0;
    data.kepler.push_back(e);
  };
  data.kepler.clear();
  add(0, -3600, 1e-3);
  add(7200, 3600, 2e-3);
  add(7200, 3630, 3e-3);  // the newer message of the same toe
  add(7200, 3500, 4e-3);
  const BroadcastSky sky(data);
  EXPECT_EQ(sky.state(kG05, first.toe - 10.0)->clock_bias_s, 1e-3);
  EXPECT_EQ(sky.state(kG05, first.toe + 3599.0)->clock_bias_s, 1e-3);
  EXPECT_EQ(sky.state(kG05, first.toe + 3600.0)->clock_bias_s, 3e-3);
  EXPECT_EQ(sky.state(kG05, first.toe + 9000.0)->clock_bias_s, 3e-3);
}

TEST(BroadcastSky, GalileoTakesInavBeforeFnav) {
  gnss::NavigationData data = only(kE11);
  gnss::KeplerEphemeris fnav = data.kepler.front();
  fnav.data_sources = 258;
  fnav.toe = fnav.toe + 3 * 3600.0;
  data.kepler.push_back(fnav);
  const BroadcastSky sky(data);
  const GpsTime toe = data.kepler.front().toe;
  EXPECT_THAT(sky.source(kE11, toe + 3 * 3600.0), HasSubstr("I/NAV"));
  EXPECT_THAT(sky.source(kE11, toe + 5 * 3600.0), HasSubstr("F/NAV"));
  EXPECT_EQ(sky.state(kE11, toe + 5 * 3600.0)->group_delay_s, fnav.group_delay[0]);
}

TEST(BroadcastSky, UnhealthyIsOut) {
  gnss::NavigationData data = only(kG05);
  gnss::KeplerEphemeris sick = data.kepler.front();
  sick.toe = sick.toe + 7200.0;
  sick.health = 63;
  data.kepler.push_back(sick);
  const BroadcastSky sky(data), all(data, {{gnss::System::GPS}, false, true});
  const GpsTime toe = data.kepler.front().toe;
  EXPECT_TRUE(sky.state(kG05, toe + 3500.0));
  EXPECT_FALSE(sky.state(kG05, toe + 3700.0));
  EXPECT_FALSE(sky.covers(toe + 3700.0));
  EXPECT_THAT(sky.source(kG05, toe + 3700.0), AllOf(HasSubstr("none: "), HasSubstr("unhealthy (health 63)")));
  EXPECT_EQ(sky.health(kG05, toe + 3700.0), SatelliteHealth::Unhealthy);
  EXPECT_EQ(sky.health(kG05, toe + 3500.0), SatelliteHealth::Healthy);
  EXPECT_EQ(sky.health(kG05, toe + 86400.0), SatelliteHealth::Unknown);
  EXPECT_TRUE(all.state(kG05, toe + 3700.0));
  EXPECT_THAT(all.source(kG05, toe + 3700.0), AllOf(HasSubstr("unhealthy"), Not(HasSubstr("none"))));
}

TEST(BroadcastSky, HealthRulesOfEachSystem) {
  const auto healthy = [](gnss::SatelliteId id, int health, double accuracy = 2, int sources = 517) {
    gnss::KeplerEphemeris e;
    e.id = id;
    e.health = health;
    e.accuracy_m = accuracy;
    e.data_sources = sources;
    return is_healthy(e);
  };
  EXPECT_TRUE(healthy(kG05, 0));
  EXPECT_FALSE(healthy(kG05, 1));
  EXPECT_FALSE(healthy(kG05, 63));
  EXPECT_TRUE(healthy(kJ02, 0));
  EXPECT_TRUE(healthy(kJ02, 1));  // L1C/B or LEX only
  EXPECT_TRUE(healthy(kJ02, 0b001111));
  EXPECT_FALSE(healthy(kJ02, 0b010000));
  EXPECT_FALSE(healthy(kJ02, 0b111111));
  EXPECT_TRUE(healthy(kC21, 0));
  EXPECT_FALSE(healthy(kC21, 1));
  EXPECT_TRUE(healthy(kE11, 0));
  EXPECT_FALSE(healthy(kE11, 0b001));             // E1-B data validity
  EXPECT_FALSE(healthy(kE11, 0b010));             // E1-B out of service
  EXPECT_TRUE(healthy(kE11, 0b001000));           // E5a only
  EXPECT_TRUE(healthy(kE11, 0b010000000));        // E5b only
  EXPECT_FALSE(healthy(kE11, 0, -1));             // no accuracy prediction
  EXPECT_FALSE(healthy(kE11, 0b001000, 2, 258));  // F/NAV has only E5a
  EXPECT_TRUE(healthy(kE11, 0b010000000, 2, 258));
  EXPECT_TRUE(healthy(kE11, 0b001000, 2, 263));  // from I/NAV and F/NAV: E1 has its own bits
  EXPECT_FALSE(healthy(kE11, 0b001, 2, 263));

  gnss::SbasEphemeris e;
  for (const int usable : {0, 0b10, 0b100}) {  // corrections, integrity off
    e.health = usable;
    EXPECT_TRUE(is_healthy(e)) << usable;
  }
  for (const int useless : {1, 31, 32, 63}) {  // ranging off, health unknown, no accuracy: from real files
    e.health = useless;
    EXPECT_FALSE(is_healthy(e)) << useless;
  }
}

TEST(BroadcastSky, NothingToAnswerFrom) {
  EXPECT_THROW(BroadcastSky(gnss::NavigationData()), InputError);
  try {
    const BroadcastSky sky(only(kG05), {{gnss::System::Galileo}, false, false});
    FAIL();
  } catch (const InputError& error) {
    EXPECT_THAT(error.what(), AllOf(HasSubstr("no ephemeris of Galileo"), HasSubstr("sample.rnx")));
  }
  const BroadcastSky sky(only(kG05));
  EXPECT_FALSE(sky.state({gnss::System::GPS, 200}, sky.span().first));
  EXPECT_FALSE(sky.state({static_cast<gnss::System>(9), 1}, sky.span().first));
}

}  // namespace
}  // namespace canyon::orbit
