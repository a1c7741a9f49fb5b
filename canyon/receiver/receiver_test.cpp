#include "canyon/receiver/receiver.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/orbit/nominal_constellation.hpp"
#include "canyon/sky/orbit/sky.hpp"
#include "canyon/sky/range_errors.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "tests/support/circular_sky.hpp"
#include "tests/support/observe.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon::receiver {
namespace {

using geodesy::GpsTime;
using geodesy::kSpeedOfLight;
using gnss::System;
using propagation::Path;
using propagation::PathKind;
using propagation::SatelliteView;
using propagation::Visibility;
using raytrace::Containment;
using test::CircularSky;

const geodesy::Geodetic kPosition = geodesy::Geodetic::from_degrees(22.3, 114.18, 30);
const geodesy::LocalFrame kFrame(kPosition);
const Eigen::Matrix3d kEcefFromEnu = kFrame.ecef_from_local_rotation();
constexpr GpsTime kTime = CircularSky::kEpoch + std::chrono::hours(5);
const Eigen::Vector3d kAtRest = Eigen::Vector3d::Zero();

/// Satellites above the horizon, every one in clear line of sight.
std::vector<SatelliteView> open_sky(const orbit::Sky& sky, GpsTime time, const Eigen::Vector3d& antenna) {
  std::vector<SatelliteView> views;
  for (const gnss::SatelliteId id : sky.satellites()) {
    const auto line = orbit::line_of_sight(sky, id, time, antenna);
    if (!line || line->elevation_rad < 0) continue;
    SatelliteView view;
    view.line = *line;
    view.paths.visibility = Visibility::LOS;
    Path direct;
    direct.arrival = kEcefFromEnu.transpose() * line->direction_ecef;
    view.paths.paths.push_back(direct);
    views.push_back(view);
  }
  return views;
}

void block(SatelliteView& view) {
  view.paths.visibility = Visibility::Blocked;
  view.paths.paths.clear();
}

/// The image construction at a vertical wall through `point` with unit normal `normal` (ENU) towards the
/// antenna; antenna in ENU.
void reflect(SatelliteView& view, const Eigen::Vector3d& antenna, const Eigen::Vector3d& point,
             const Eigen::Vector3d& normal) {
  const Eigen::Vector3d s = kEcefFromEnu.transpose() * view.line.direction_ecef;
  Path path;
  path.kind = PathKind::Reflected;
  path.excess_m = 2 * normal.dot(antenna - point) * normal.dot(s);
  path.arrival = s - 2 * normal.dot(s) * normal;
  view.paths.visibility = Visibility::NLOS;
  view.paths.paths = {path};
}

const std::map<System, gnss::Klobuchar> kKlobuchar{
    {System::GPS,
     {{8.3819e-9, 1.4901e-8, -5.9605e-8, -5.9605e-8}, {8.8064e4, 3.2768e4, -1.9661e5, -1.9661e5}}}};

ReceiverOptions quiet() {
  ReceiverOptions options;
  options.noise.enabled = false;
  return options;
}

const SatelliteObservation* find(const ReceiverEpoch& epoch, gnss::SatelliteId id) {
  for (const SatelliteObservation& each : epoch.satellites) {
    if (each.id == id) return &each;
  }
  return nullptr;
}

ReceiverEpoch observe_open_sky(Receiver& receiver, const orbit::Sky& sky, GpsTime time,
                               const Eigen::Vector3d& antenna, const Eigen::Vector3d& velocity = kAtRest) {
  return test::observe_views(receiver, time, antenna, velocity, open_sky(sky, time, antenna), kEcefFromEnu,
                             Containment::Free, sky);
}

const CircularSky& four_systems() {
  static const CircularSky sky({System::GPS, System::GLONASS, System::Galileo, System::BeiDou});
  return sky;
}

/// Noise-free fixes of an antenna at 300 m/s under an open sky, over `hours` every ten minutes.
void expect_truth_over(const orbit::Sky& sky, GpsTime begin, double hours, int least_satellites) {
  ReceiverOptions options = quiet();
  options.clock.bias_s = 5e-4;
  options.clock.drift = 1e-7;
  options.clock.drift_walk = 1e-10;
  options.fix.elevation_mask_rad = geodesy::radians(5);
  Receiver receiver(options, 1);
  double worst_position = 0, worst_velocity = 0, worst_clock = 0, worst_drift = 0;
  for (double seconds = 0; seconds <= hours * 3600; seconds += 600) {
    const GpsTime time = begin + seconds;
    const Eigen::Vector3d enu(0.1 * seconds, -0.05 * seconds, 10 + 0.01 * seconds);
    const Eigen::Vector3d antenna = kFrame.ecef_from_local(enu);
    const Eigen::Vector3d velocity = 300 * Eigen::Vector3d(0.48, 0.6, 0.64);
    const ReceiverEpoch epoch = observe_open_sky(receiver, sky, time, antenna, velocity);
    ASSERT_TRUE(epoch.fix.solved()) << reason(epoch.fix.status) << " after " << seconds << " s";
    EXPECT_GE(static_cast<int>(epoch.fix.used.size()), least_satellites);
    EXPECT_EQ(epoch.receiver_time, time + epoch.clock_bias_s);
    worst_position = std::max(worst_position, (epoch.fix.position_ecef - antenna).norm());
    ASSERT_TRUE(epoch.fix.velocity_enu_mps && epoch.fix.clock_drift);
    const Eigen::Vector3d true_velocity = geodesy::enu_from_ecef_rotation(epoch.fix.position) * velocity;
    worst_velocity = std::max(worst_velocity, (*epoch.fix.velocity_enu_mps - true_velocity).norm());
    worst_drift = std::max(worst_drift, std::abs(*epoch.fix.clock_drift - epoch.clock_drift));
    for (const auto& [system, bias] : epoch.fix.clock_bias_s) {
      worst_clock = std::max(worst_clock, std::abs(bias - epoch.clock_bias_s));
    }
  }
  EXPECT_LT(worst_position, 1e-5);
  EXPECT_LT(worst_velocity, 1e-5);
  EXPECT_LT(worst_clock * kSpeedOfLight, 1e-5);
  EXPECT_LT(worst_drift * kSpeedOfLight, 1e-5);
  std::printf(
      "open sky, noise off: position within %.1e m, velocity %.1e m/s, clock %.1e m, drift %.1e m/s\n",
      worst_position, worst_velocity, worst_clock * kSpeedOfLight, worst_drift * kSpeedOfLight);
}

TEST(ReceiverOpenSky, NoiseOffIsTheTruthUnderCircularOrbits) {
  expect_truth_over(four_systems(), kTime, 24, 20);
}

TEST(ReceiverOpenSky, NoiseOffIsTheTruthUnderTheNominalConstellations) {
  const GpsTime begin = GpsTime::from_week(2100, 43'200);
  const orbit::BroadcastSky sky(orbit::nominal_constellation(
      begin - 3600.0, begin + 25 * 3600.0, {System::GPS, System::GLONASS, System::Galileo, System::BeiDou}));
  expect_truth_over(sky, begin, 24, 15);
}

TEST(ReceiverOpenSky, NoiseOffIsTheTruthUnderRealEphemerides) {
  CANYON_SHARED_DATA(file, "orbits/ESBC00DNK_R_20201770000_01D_MN.rnx.gz");
  const orbit::BroadcastSky sky(rinex::read_rinex_navigation(file));
  // 2020-06-25: week 2111, day 4.
  expect_truth_over(sky, GpsTime::from_week(2111, 4 * 86'400 + 2 * 3600), 20, 6);
}

TEST(Receiver, PseudorangeIsTheMeasurementEquation) {
  ReceiverOptions options = quiet();
  options.clock.bias_s = 3.3e-4 + 1.7e-10;  // not a whole number of nanoseconds
  Receiver receiver(options, 1);
  const Eigen::Vector3d antenna = kFrame.ecef_from_local({5, 6, 7});
  const std::vector<SatelliteView> views = open_sky(four_systems(), kTime, antenna);
  const ReceiverEpoch epoch = test::observe_views(receiver, kTime, antenna, kAtRest, views, kEcefFromEnu,
                                                  Containment::Free, four_systems());
  for (const SatelliteView& view : views) {
    const SatelliteObservation* seen = find(epoch, view.line.id);
    ASSERT_NE(seen, nullptr);
    if (!seen->measurement) continue;
    const double expected =
        view.line.range_m +
        kSpeedOfLight * (options.clock.bias_s - view.line.state.clock_bias_s + view.line.state.group_delay_s);
    EXPECT_NEAR(seen->measurement->pseudorange_m, expected, 1e-7);
    EXPECT_EQ(seen->measurement->carrier_frequency_hz, view.line.state.carrier_frequency_hz);
    EXPECT_EQ(seen->pseudorange_error_m, 0);
    EXPECT_TRUE(seen->used);
  }
  EXPECT_LT((epoch.fix.position_ecef - antenna).norm(), 1e-4);
  EXPECT_LT(std::abs((epoch.receiver_time - kTime) - options.clock.bias_s), 0.51e-9);
}

/// -lambda D against central differences of simulated pseudoranges over the receiver's own clock.
/// `antenna(t)` in ENU [m], t [s] from kTime; `arrange` sets the paths.
double worst_doppler_difference(const std::function<Eigen::Vector3d(double)>& antenna, double clock_drift,
                                const std::function<void(SatelliteView&, const Eigen::Vector3d&)>& arrange) {
  ReceiverOptions options = quiet();
  options.clock.bias_s = 1e-4;
  options.clock.drift = clock_drift;
  Receiver receiver(options, 1);
  constexpr double kStep = 0.25;
  std::vector<ReceiverEpoch> epochs;
  for (const double t : {-kStep, 0.0, kStep}) {
    const Eigen::Vector3d ecef = kFrame.ecef_from_local(antenna(t));
    const Eigen::Vector3d velocity = kEcefFromEnu * (antenna(t + 1e-3) - antenna(t - 1e-3)) / 2e-3;
    std::vector<SatelliteView> views = open_sky(four_systems(), kTime + t, ecef);
    for (SatelliteView& view : views) arrange(view, antenna(t));
    epochs.push_back(test::observe_views(receiver, kTime + t, ecef, velocity, views, kEcefFromEnu,
                                         Containment::Free, four_systems()));
  }
  double worst = 0;
  int compared = 0;
  for (const SatelliteObservation& now : epochs[1].satellites) {
    const SatelliteObservation* before = find(epochs[0], now.id);
    const SatelliteObservation* after = find(epochs[2], now.id);
    if (!now.measurement || before == nullptr || after == nullptr || !before->measurement ||
        !after->measurement) {
      continue;
    }
    const double elapsed = 2 * kStep * (1 + clock_drift);
    const double rate = (after->measurement->pseudorange_m - before->measurement->pseudorange_m) / elapsed;
    const double doppler =
        *now.measurement->doppler_hz * kSpeedOfLight / now.measurement->carrier_frequency_hz;
    worst = std::max(worst, std::abs(rate + doppler));
    ++compared;
  }
  EXPECT_GE(compared, 5);
  return worst;
}

Eigen::Vector3d drive(double t) {
  return {100 + 150 * t, -30 + 200 * t - 1.5 * t * t, 20 + 40 * t};
}

// Central differences of range over +-0.25 s: r''' h^2 / 6 is below 1e-4 m/s here.
TEST(Receiver, DopplerIsTheRateOfThePseudorangeInLineOfSight) {
  const auto clear = [](SatelliteView&, const Eigen::Vector3d&) {};
  EXPECT_LT(worst_doppler_difference(drive, 0, clear), 1e-3);
  EXPECT_LT(worst_doppler_difference(drive, 5e-5, clear), 1e-3);
  EXPECT_LT(worst_doppler_difference([](double) { return Eigen::Vector3d(1, 2, 3); }, 0, clear), 1e-3);
}

TEST(Receiver, DopplerIsTheRateOfThePseudorangeOfAReflection) {
  const Eigen::Vector3d point(600, 500, 0);
  for (const double azimuth : {0.3, 2.0, 4.4}) {
    // The wall faces away from `azimuth`; satellites on the other side of it stay in line of sight.
    const Eigen::Vector3d normal = geodesy::enu_from_azimuth_elevation(azimuth, 0.1);
    const Eigen::Vector3d at = drive(0) - 120 * normal;
    const auto mirror = [&](SatelliteView& view, const Eigen::Vector3d& antenna) {
      const Eigen::Vector3d s = kEcefFromEnu.transpose() * view.line.direction_ecef;
      if (normal.dot(s) > 0.05) {
        reflect(view, antenna, at, normal);
      } else {
        block(view);
      }
    };
    EXPECT_LT(worst_doppler_difference(drive, 1e-6, mirror), 1e-3) << azimuth;
  }
}

// A receiver that drives towards the wall, away from the satellite behind it: the direct path becomes longer,
// the reflected one shorter.
TEST(Receiver, ReflectedDopplerHasTheSignOfTheDirectionOfArrival) {
  const Eigen::Vector3d antenna(0, 0, 10);
  std::vector<SatelliteView> views = open_sky(four_systems(), kTime, kFrame.ecef_from_local(antenna));
  const SatelliteView* low = nullptr;
  for (const SatelliteView& view : views) {
    if (view.line.elevation_rad > geodesy::radians(12) &&
        (low == nullptr || view.line.elevation_rad < low->line.elevation_rad)) {
      low = &view;
    }
  }
  ASSERT_NE(low, nullptr);
  const Eigen::Vector3d towards = geodesy::enu_from_azimuth_elevation(low->line.azimuth_rad, 0);
  const auto doppler = [&](bool reflected, double speed) {
    SatelliteView view = *low;
    if (reflected) reflect(view, antenna, antenna - 50 * towards, towards);
    Receiver receiver(quiet(), 1);
    const Eigen::Vector3d velocity = kEcefFromEnu * (-speed * towards);
    const std::vector<SatelliteView> one{view};
    return *test::observe_views(receiver, kTime, kFrame.ecef_from_local(antenna), velocity, one, kEcefFromEnu,
                                Containment::Free, four_systems())
                .satellites.front()
                .measurement->doppler_hz;
  };
  const double wavelength = kSpeedOfLight / low->line.state.carrier_frequency_hz;
  const double expected = 20 * std::cos(low->line.elevation_rad) / wavelength;
  EXPECT_NEAR(doppler(false, 20) - doppler(false, 0), -expected, 0.01);
  EXPECT_NEAR(doppler(true, 20) - doppler(true, 0), expected, 0.01);
}

TEST(Receiver, ExcessPathIsAddedAndSaid) {
  const Eigen::Vector3d antenna(0, 0, 10);
  const Eigen::Vector3d ecef = kFrame.ecef_from_local(antenna);
  std::vector<SatelliteView> views = open_sky(four_systems(), kTime, ecef);
  Receiver clear_receiver(quiet(), 1);
  const ReceiverEpoch clear = test::observe_views(clear_receiver, kTime, ecef, kAtRest, views, kEcefFromEnu,
                                                  Containment::Free, four_systems());
  const Eigen::Vector3d normal = Eigen::Vector3d::UnitX();
  std::size_t chosen = 0;
  while (views[chosen].line.elevation_rad < 0.3 ||
         normal.dot(kEcefFromEnu.transpose() * views[chosen].line.direction_ecef) < 0.2) {
    ++chosen;
  }
  reflect(views[chosen], antenna, antenna - 25 * normal, normal);
  Receiver receiver(quiet(), 1);
  const ReceiverEpoch epoch = test::observe_views(receiver, kTime, ecef, kAtRest, views, kEcefFromEnu,
                                                  Containment::Free, four_systems());
  const double excess = views[chosen].paths.paths.front().excess_m;
  EXPECT_GT(excess, 9);
  const SatelliteObservation* before = find(clear, views[chosen].line.id);
  const SatelliteObservation* after = find(epoch, views[chosen].line.id);
  EXPECT_EQ(after->visibility, Visibility::NLOS);
  EXPECT_EQ(after->excess_m, excess);
  EXPECT_EQ(after->pseudorange_error_m, excess);
  EXPECT_NEAR(after->measurement->pseudorange_m - before->measurement->pseudorange_m, excess, 1e-7);
  EXPECT_GT((epoch.fix.position_ecef - ecef).norm(), 0.1);
}

TEST(Receiver, MaskAndVisibilityAreCounted) {
  const Eigen::Vector3d ecef = kFrame.ecef_from_local({0, 0, 0});
  std::vector<SatelliteView> views = open_sky(four_systems(), kTime, ecef);
  for (std::size_t i = 0; i < views.size(); i += 3) block(views[i]);
  ReceiverOptions options = quiet();
  options.fix.elevation_mask_rad = geodesy::radians(25);
  Receiver receiver(options, 1);
  const ReceiverEpoch epoch = test::observe_views(receiver, kTime, ecef, kAtRest, views, kEcefFromEnu,
                                                  Containment::Free, four_systems());
  ASSERT_EQ(epoch.satellites.size(), views.size());
  int visible = 0, blocked = 0, measured = 0, used = 0, below = 0;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const SatelliteObservation& seen = *find(epoch, views[i].line.id);
    const bool above = views[i].line.elevation_rad >= geodesy::radians(25);
    EXPECT_EQ(seen.above_mask, above);
    EXPECT_EQ(seen.measurement.has_value(), above && i % 3 != 0);
    EXPECT_EQ(seen.visibility, i % 3 == 0 ? Visibility::Blocked : Visibility::LOS);
    visible += above && i % 3 != 0;
    blocked += above && i % 3 == 0;
    below += !above;
    measured += seen.measurement.has_value();
    used += seen.used;
  }
  EXPECT_GT(below, 0);
  EXPECT_GT(blocked, 0);
  EXPECT_EQ(epoch.visible, visible);
  EXPECT_EQ(epoch.blocked, blocked);
  EXPECT_EQ(measured, visible);
  EXPECT_EQ(used, static_cast<int>(epoch.fix.used.size()));
  EXPECT_TRUE(std::is_sorted(epoch.satellites.begin(), epoch.satellites.end(),
                             [](const auto& a, const auto& b) { return a.id < b.id; }));
}

TEST(Receiver, InsideABuildingNothingIsReceived) {
  for (const Containment containment : {Containment::InsideBuilding, Containment::UnderTerrain}) {
    const Eigen::Vector3d ecef = kFrame.ecef_from_local({0, 0, 0});
    const std::vector<SatelliteView> views = open_sky(four_systems(), kTime, ecef);
    Receiver receiver(ReceiverOptions{}, 1);
    const ReceiverEpoch epoch =
        test::observe_views(receiver, kTime, ecef, kAtRest, views, kEcefFromEnu, containment, four_systems());
    EXPECT_EQ(epoch.fix.status, positioning::FixStatus::NoSignal);
    EXPECT_EQ(name(epoch.fix.status), "no fix");
    EXPECT_TRUE(std::isnan(epoch.fix.position.latitude_rad));
    EXPECT_EQ(epoch.visible, 0);
    EXPECT_GT(epoch.blocked, 10);
    ASSERT_EQ(epoch.satellites.size(), views.size());
    for (const SatelliteObservation& seen : epoch.satellites) {
      EXPECT_EQ(seen.visibility, Visibility::Blocked);
      EXPECT_FALSE(seen.measurement || seen.used);
      EXPECT_EQ(seen.excess_m, 0);
    }
  }
}

TEST(Receiver, BlockedSkyIsNoFix) {
  const Eigen::Vector3d ecef = kFrame.ecef_from_local({0, 0, 0});
  std::vector<SatelliteView> views = open_sky(four_systems(), kTime, ecef);
  for (SatelliteView& view : views) block(view);
  Receiver receiver(ReceiverOptions{}, 1);
  const ReceiverEpoch epoch = test::observe_views(receiver, kTime, ecef, kAtRest, views, kEcefFromEnu,
                                                  Containment::Free, four_systems());
  EXPECT_EQ(epoch.fix.status, positioning::FixStatus::TooFewSatellites);
  EXPECT_TRUE(epoch.fix.position_ecef.array().isNaN().all());
  EXPECT_EQ(epoch.visible, 0);
}

TEST(Receiver, SameSeedSameNumbersWhateverRunsBeside) {
  const Eigen::Vector3d ecef = kFrame.ecef_from_local({0, 0, 0});
  ReceiverOptions options;
  options.clock.drift_walk = 1e-9;
  Receiver a(options, 7), b(options, 7), other_seed(options, 8);
  options.name = "other";
  Receiver own(options, 7);
  options.independent_noise = false;
  Receiver other_name(options, 7);
  for (int i = 0; i < 5; ++i) {
    const GpsTime time = kTime + 1.0 * i;
    const ReceiverEpoch ea = observe_open_sky(a, four_systems(), time, ecef);
    const ReceiverEpoch es = observe_open_sky(other_seed, four_systems(), time, ecef);
    const ReceiverEpoch en = observe_open_sky(other_name, four_systems(), time, ecef);
    const ReceiverEpoch eo = observe_open_sky(own, four_systems(), time, ecef);
    const ReceiverEpoch eb = observe_open_sky(b, four_systems(), time, ecef);
    EXPECT_EQ(ea.fix.position_ecef, eb.fix.position_ecef);
    EXPECT_EQ(ea.fix.position_ecef, en.fix.position_ecef);
    EXPECT_EQ(ea.clock_bias_s, eb.clock_bias_s);
    ASSERT_EQ(ea.satellites.size(), eb.satellites.size());
    for (std::size_t k = 0; k < ea.satellites.size(); ++k) {
      if (!ea.satellites[k].measurement) continue;
      EXPECT_EQ(ea.satellites[k].measurement->pseudorange_m, eb.satellites[k].measurement->pseudorange_m);
      EXPECT_EQ(*ea.satellites[k].measurement->doppler_hz, *eb.satellites[k].measurement->doppler_hz);
      EXPECT_NE(ea.satellites[k].noise_m, es.satellites[k].noise_m);
      EXPECT_EQ(ea.satellites[k].noise_m, en.satellites[k].noise_m);
      EXPECT_NE(ea.satellites[k].noise_m, eo.satellites[k].noise_m);
    }
  }
}

// Errors in space are equal in all bands and receivers, except for the ionosphere's f^-2.
TEST(Receiver, ErrorsOfSpaceAreSharedByBandsAndReceivers) {
  const Eigen::Vector3d ecef = kFrame.ecef_from_local({0, 0, 0});
  ReceiverOptions options = quiet();
  options.tracks = {"L1CA", "L5", "E1", "E5a"};
  options.decide(true, true);
  EXPECT_TRUE(options.orbit_errors && options.ionosphere && options.troposphere);
  EXPECT_TRUE(options.fix.correct_ionosphere && options.fix.correct_troposphere);
  options.fix.correct_ionosphere = options.fix.correct_troposphere = false;
  Receiver one(options, 1);
  options.name = "other";
  Receiver other(options, 2);
  std::vector<SatelliteView> views = open_sky(four_systems(), kTime, ecef);
  for (SatelliteView& view : views) view.space = {0.1 * view.line.id.number, 5.0 + view.line.id.number, 3};
  const auto observe = [&](Receiver& receiver) {
    return test::observe_views(receiver, kTime, ecef, kAtRest, views, kEcefFromEnu, Containment::Free,
                               four_systems(), kKlobuchar);
  };
  const ReceiverEpoch a = observe(one), b = observe(other);
  int bands = 0;
  for (std::size_t k = 0; k < a.satellites.size(); ++k) {
    const SatelliteObservation& satellite = a.satellites[k];
    if (!satellite.measurement) continue;
    EXPECT_DOUBLE_EQ(satellite.pseudorange_error_m, 0.1 * satellite.id.number + 5 + satellite.id.number + 3);
    EXPECT_EQ(satellite.pseudorange_error_m, b.satellites[k].pseudorange_error_m);
    for (const SignalObservation& second : satellite.more) {
      if (!second.measurement) continue;
      ++bands;
      EXPECT_EQ(second.term_m(RangeTermId::OrbitError), satellite.term_m(RangeTermId::OrbitError));
      EXPECT_EQ(second.term_m(RangeTermId::Troposphere), satellite.term_m(RangeTermId::Troposphere));
      EXPECT_NEAR(second.term_m(RangeTermId::Ionosphere) / satellite.term_m(RangeTermId::Ionosphere),
                  std::pow(154.0 / 115.0, 2), 1e-9);
    }
  }
  EXPECT_GT(bands, 5);

  // A receiver with these switched off has none.
  options.orbit_errors = options.ionosphere = options.troposphere = false;
  options.decide(true, true);
  Receiver without(options, 1);
  for (const SatelliteObservation& satellite : observe(without).satellites) {
    EXPECT_EQ(satellite.pseudorange_error_m, 0);
  }
}

// One satellite's noise does not depend on the other received satellites.
TEST(Receiver, EverySatelliteHasItsOwnStream) {
  const Eigen::Vector3d ecef = kFrame.ecef_from_local({0, 0, 0});
  Receiver all(ReceiverOptions{}, 7), some(ReceiverOptions{}, 7);
  for (int i = 0; i < 5; ++i) {
    const GpsTime time = kTime + 1.0 * i;
    std::vector<SatelliteView> views = open_sky(four_systems(), time, ecef);
    const ReceiverEpoch ea =
        test::observe_views(all, time, ecef, kAtRest, views, kEcefFromEnu, Containment::Free, four_systems());
    for (std::size_t k = 0; k < views.size(); k += 2) block(views[k]);
    const ReceiverEpoch eb = test::observe_views(some, time, ecef, kAtRest, views, kEcefFromEnu,
                                                 Containment::Free, four_systems());
    for (const SatelliteObservation& seen : eb.satellites) {
      if (!seen.measurement) continue;
      EXPECT_EQ(seen.noise_m, find(ea, seen.id)->noise_m);
    }
  }
}

/// Mean square of noise and lag-1-second product over all satellites, observed at `rate_hz` for a frozen sky.
struct NoiseStatistics {
  double variance = 0, product = 0;
};
NoiseStatistics noise_statistics(int rate_hz, double seconds) {
  ReceiverOptions options;
  options.noise.ou.theta_per_s = 0.5;
  options.noise.ou.sigma_m_per_sqrt_s = 2;  // stationary deviation 2 m
  Receiver receiver(options, 3);
  const orbit::FrozenSky sky(kPosition, {0, 1, 2, 3, 4, 5}, {0.5, 1.2, 0.7, 0.4, 0.9, 0.6});
  const Eigen::Vector3d ecef = geodesy::ecef_from_geodetic(kPosition);
  const std::vector<SatelliteView> views = open_sky(sky, kTime, ecef);
  NoiseStatistics statistics;
  std::vector<double> last;
  int pairs = 0;
  for (int i = 0; i <= static_cast<int>(seconds * rate_hz); ++i) {
    const GpsTime time = kTime + static_cast<double>(i) / rate_hz;
    const ReceiverEpoch epoch =
        test::observe_views(receiver, time, ecef, kAtRest, views, kEcefFromEnu, Containment::Free, sky);
    if (i % rate_hz != 0) continue;
    std::vector<double> now;
    for (const SatelliteObservation& seen : epoch.satellites) now.push_back(seen.noise_m);
    for (std::size_t k = 0; k < last.size(); ++k) {
      statistics.variance += now[k] * now[k];
      statistics.product += now[k] * last[k];
      ++pairs;
    }
    last = now;
  }
  statistics.variance /= pairs;
  statistics.product /= pairs;
  return statistics;
}

// AR(1) at 1 Hz with phi = e^-0.5 over 6 * 2000 samples, at any rate of observation; five deviations.
TEST(Receiver, NoiseStatisticsDoNotDependOnTheRate) {
  const double phi = std::exp(-0.5);
  const double n = 6 * 2000 * (1 - phi * phi) / (1 + phi * phi);
  for (const int rate : {1, 10}) {
    const NoiseStatistics s = noise_statistics(rate, 2000);
    EXPECT_NEAR(s.variance, 4, 5 * 4 * std::sqrt(2 / n)) << rate;
    EXPECT_NEAR(s.product, 4 * phi, 5 * 4 * std::sqrt(2 / n)) << rate;
  }
}

// A satellite that returns is decorrelated by the elapsed time: without diffusion its deviation from the mean
// has decayed over the whole gap.
TEST(Receiver, NoiseGoesOnOverAGap) {
  ReceiverOptions options;
  options.noise.ou.theta_per_s = 0.05;
  options.noise.ou.sigma_m_per_sqrt_s = 0;
  options.noise.drift_enabled = true;
  Receiver receiver(options, 3);
  const Eigen::Vector3d ecef = kFrame.ecef_from_local({0, 0, 0});
  const Eigen::Vector3d fast(10, 0, 0);
  // At rest the values start at each satellite's own drifted mean; in motion they return to 0.
  const ReceiverEpoch start = observe_open_sky(receiver, four_systems(), kTime, ecef);
  const ReceiverEpoch later = observe_open_sky(receiver, four_systems(), kTime + 8.0, ecef, fast);
  int compared = 0;
  for (const SatelliteObservation& seen : later.satellites) {
    const SatelliteObservation* before = find(start, seen.id);
    if (!seen.measurement || before == nullptr || !before->measurement) continue;
    EXPECT_NEAR(seen.noise_m, before->noise_m * std::exp(-0.05 * 8), 1e-12);
    ++compared;
  }
  EXPECT_GT(compared, 10);
}

TEST(Receiver, MeansDriftWhenSlowOrWithoutLineOfSight) {
  ReceiverOptions options;
  options.noise.ou.sigma_m_per_sqrt_s = 0;
  options.noise.drift_enabled = true;
  const Eigen::Vector3d ecef = kFrame.ecef_from_local({0, 0, 0});
  const Eigen::Vector3d fast(10, 0, 0);
  double square = 0;
  int count = 0;
  for (int seed = 0; seed < 100; ++seed) {
    Receiver slow(options, static_cast<std::uint64_t>(seed));
    for (const SatelliteObservation& seen : observe_open_sky(slow, four_systems(), kTime, ecef).satellites) {
      if (!seen.measurement) continue;
      square += seen.noise_m * seen.noise_m;
      ++count;
    }
  }
  EXPECT_NEAR(square / count, 4, 5 * 4 * std::sqrt(2.0 / count));

  Receiver moving(options, 1);
  for (const SatelliteObservation& seen :
       observe_open_sky(moving, four_systems(), kTime, ecef, fast).satellites) {
    EXPECT_EQ(seen.noise_m, 0);
  }
  // Moving, but only three satellites in line of sight.
  std::vector<SatelliteView> views = open_sky(four_systems(), kTime, ecef);
  int los = 0;
  for (SatelliteView& view : views) {
    if (view.line.elevation_rad >= options.fix.elevation_mask_rad && ++los > 3) {
      reflect(view, {0, 0, 0}, {0, 0, -5}, {0, 0, 1});
    }
  }
  Receiver losing(options, 1);
  const ReceiverEpoch epoch =
      test::observe_views(losing, kTime, ecef, fast, views, kEcefFromEnu, Containment::Free, four_systems());
  for (const SatelliteObservation& seen : epoch.satellites) {
    if (!seen.measurement) continue;
    EXPECT_NE(seen.noise_m, 0);
  }
}

TEST(Receiver, CovarianceStatesTheNoise) {
  ReceiverOptions options;
  options.noise.ou.theta_per_s = 0.02;
  options.noise.ou.sigma_m_per_sqrt_s = 0.6;  // 3 m
  options.noise.doppler_sigma_hz = 0.5;
  Receiver receiver(options, 1);
  const Eigen::Vector3d ecef = kFrame.ecef_from_local({0, 0, 0});
  const Eigen::Matrix3d enu_from_ecef = kEcefFromEnu.transpose();
  constexpr int kRuns = 2000;
  Eigen::Matrix3d position = Eigen::Matrix3d::Zero(), velocity = Eigen::Matrix3d::Zero();
  ReceiverEpoch epoch;
  const std::vector<SatelliteView> views = open_sky(four_systems(), kTime, ecef);
  for (int i = 0; i < kRuns; ++i) {
    Receiver fresh(options, static_cast<std::uint64_t>(i));
    epoch = test::observe_views(fresh, kTime, ecef, kAtRest, views, kEcefFromEnu, Containment::Free,
                                four_systems());
    ASSERT_TRUE(epoch.fix.solved() && epoch.fix.velocity_enu_mps);
    const Eigen::Vector3d error = enu_from_ecef * (epoch.fix.position_ecef - ecef);
    position += error * error.transpose() / kRuns;
    velocity += *epoch.fix.velocity_enu_mps * epoch.fix.velocity_enu_mps->transpose() / kRuns;
  }
  const Eigen::Matrix3d& p = epoch.fix.covariance_enu;
  const Eigen::Matrix3d& v = *epoch.fix.velocity_covariance_enu;
  EXPECT_NEAR(std::sqrt(p.trace()), 3 * epoch.fix.dop->pdop, 1e-6);
  for (int i = 0; i < 3; ++i) {
    EXPECT_NEAR(position(i, i), p(i, i), 5 * p(i, i) * std::sqrt(2.0 / kRuns)) << i;
    EXPECT_NEAR(velocity(i, i), v(i, i), 5 * v(i, i) * std::sqrt(2.0 / kRuns)) << i;
  }
}

// alpha and beta: the header of a GPS navigation file of 2019 (they only determine the size of the delay).

TEST(ReceiverAtmosphere, DelaysAreInTheSignalAndTheFixTakesThemOff) {
  const Eigen::Vector3d ecef = kFrame.ecef_from_local({0, 0, 0});
  const std::vector<SatelliteView> views = open_sky(four_systems(), kTime, ecef);
  for (const int bits : {1, 2, 3}) {
    const bool ionosphere = (bits & 1) != 0;
    const bool troposphere = (bits & 2) != 0;
    const auto run = [&](bool in_signal, bool in_fix) {
      ReceiverOptions options = quiet();
      options.clock.bias_s = 5e-4;
      options.ionosphere = in_signal && ionosphere;
      options.troposphere = in_signal && troposphere;
      options.fix.correct_ionosphere = in_fix && ionosphere;
      options.fix.correct_troposphere = in_fix && troposphere;
      Receiver receiver(options, 1);
      return test::observe_views(receiver, kTime, ecef, kAtRest, views, kEcefFromEnu, Containment::Free,
                                 four_systems(), kKlobuchar);
    };
    const ReceiverEpoch none = run(false, false);
    const ReceiverEpoch signal_only = run(true, false);
    const ReceiverEpoch fix_only = run(false, true);
    const ReceiverEpoch both = run(true, true);
    EXPECT_LT((none.fix.position_ecef - ecef).norm(), 1e-3);
    EXPECT_LT((both.fix.position_ecef - ecef).norm(), 1e-2);
    EXPECT_GT((signal_only.fix.position_ecef - ecef).norm(), 0.5);
    EXPECT_GT((fix_only.fix.position_ecef - ecef).norm(), 0.5);
    for (std::size_t i = 0; i < none.satellites.size(); ++i) {
      if (!none.satellites[i].measurement) continue;
      const auto& view = views[i].line;
      double delay = 0;
      if (ionosphere) {
        delay += sky::klobuchar_delay_m(kKlobuchar.at(System::GPS), kTime, kPosition, view.azimuth_rad,
                                        view.elevation_rad, view.state.carrier_frequency_hz);
      }
      if (troposphere) delay += sky::saastamoinen_delay_m(kPosition, view.elevation_rad);
      EXPECT_GT(delay, 1);
      const double added = signal_only.satellites[i].measurement->pseudorange_m -
                           none.satellites[i].measurement->pseudorange_m;
      EXPECT_NEAR(added, delay, 1e-6);
      EXPECT_NEAR(signal_only.satellites[i].pseudorange_error_m, delay, 1e-6);
      EXPECT_NEAR(fix_only.satellites[i].pseudorange_error_m, -delay, 1e-6);
      EXPECT_NEAR(both.satellites[i].pseudorange_error_m, 0, 1e-9);
    }
  }
}

TEST(ReceiverAtmosphere, IonosphereWithoutCoefficientsIsRefused) {
  const Eigen::Vector3d ecef = kFrame.ecef_from_local({0, 0, 0});
  ReceiverOptions options = quiet();
  options.ionosphere = true;
  Receiver receiver(options, 1);
  EXPECT_THROW(observe_open_sky(receiver, four_systems(), kTime, ecef), InputError);
}

TEST(Receiver, RefusesPosesAndTimesThatAreNone) {
  const Eigen::Vector3d ecef = kFrame.ecef_from_local({0, 0, 0});
  const double nan = std::numeric_limits<double>::quiet_NaN();
  ReceiverOptions options;
  options.name = "rover";
  Receiver receiver(options, 1);
  const std::vector<SatelliteView> views = open_sky(four_systems(), kTime, ecef);
  const auto observe = [&](GpsTime time, const Eigen::Vector3d& antenna, const Eigen::Vector3d& velocity) {
    return test::refusal([&] {
      static_cast<void>(test::observe_views(receiver, time, antenna, velocity, views, kEcefFromEnu,
                                            Containment::Free, four_systems()));
    });
  };
  EXPECT_THAT(observe(kTime, {ecef.x(), nan, ecef.z()}, kAtRest),
              testing::AllOf(testing::HasSubstr("rover"), testing::HasSubstr("position")));
  EXPECT_THAT(observe(kTime, ecef, {0, 0, INFINITY}), testing::HasSubstr("velocity"));
  EXPECT_EQ(observe(kTime, ecef, kAtRest), "");
  EXPECT_EQ(observe(kTime, ecef, kAtRest), "");  // the same instant again
  EXPECT_THAT(observe(kTime - 1.0, ecef, kAtRest), testing::HasSubstr("backwards"));
}

TEST(ReceiverOptionsTest, NamesReceiverAndField) {
  const auto message = [](const std::function<void(ReceiverOptions&)>& spoil) {
    ReceiverOptions options;
    options.name = "rover";
    spoil(options);
    return test::refusal([&] { Receiver receiver(options, 1); });
  };
  using Options = ReceiverOptions;
  EXPECT_EQ(message([](Options&) {}), "");
  EXPECT_THAT(message([](Options& o) { o.name.clear(); }), testing::HasSubstr("name"));
  EXPECT_THAT(message([](Options& o) { o.noise.doppler_sigma_hz = -1; }),
              testing::AllOf(testing::HasSubstr("rover"), testing::HasSubstr("doppler_sigma_hz")));
  EXPECT_THAT(message([](Options& o) { o.noise.ou.theta_per_s = 0; }), testing::HasSubstr("theta_per_s"));
  EXPECT_THAT(message([](Options& o) { o.clock.bias_s = 1; }), testing::HasSubstr("bias_s"));
  EXPECT_THAT(message([](Options& o) { o.fix.min_satellites = 1; }), testing::HasSubstr("min_satellites"));
  EXPECT_THAT(message([](Options& o) { o.fix_input.ionosphere_sigma_m = 0; }),
              testing::AllOf(testing::HasSubstr("rover"), testing::HasSubstr("ionosphere_sigma_m")));
}

// As in simulators' own sensors: white, on the solved position and velocity, and reported.
TEST(Receiver, FixNoiseIsWhiteAndStated) {
  ReceiverOptions options = quiet();
  options.fix_noise = {0.5, 2, 0.1, 0.3};
  Receiver with(options, 1), without(quiet(), 1);
  const Eigen::Vector3d antenna = kFrame.ecef_from_local({0, 0, 10});
  constexpr int kCount = 1000;
  Eigen::Vector3d squares = Eigen::Vector3d::Zero(), products = squares, last = squares, speeds = squares;
  for (int i = 0; i < kCount; ++i) {
    const positioning::Fix fix = observe_open_sky(with, four_systems(), kTime + i, antenna).fix;
    const positioning::Fix plain = observe_open_sky(without, four_systems(), kTime + i, antenna).fix;
    const Eigen::Vector3d error = kEcefFromEnu.transpose() * (fix.position_ecef - antenna);
    squares += error.cwiseAbs2();
    products += error.cwiseProduct(last);
    speeds += fix.velocity_enu_mps->cwiseAbs2();
    last = error;
    const Eigen::Vector3d reported = (fix.covariance_enu - plain.covariance_enu).diagonal();
    EXPECT_LT((reported - Eigen::Vector3d(0.25, 0.25, 4)).norm(), 1e-6);
    EXPECT_LT((plain.position_ecef - antenna).norm(), 1e-4);
  }
  const double sampling = 4 * std::sqrt(2.0 / kCount);
  const Eigen::Vector3d position(0.25, 0.25, 4), velocity(0.01, 0.01, 0.09);
  for (Eigen::Index i = 0; i < 3; ++i) {
    EXPECT_NEAR(squares[i] / kCount, position[i], position[i] * sampling);
    EXPECT_NEAR(products[i] / kCount, 0, position[i] * sampling);
    EXPECT_NEAR(speeds[i] / kCount, velocity[i], velocity[i] * sampling);
  }
}

}  // namespace
}  // namespace canyon::receiver
