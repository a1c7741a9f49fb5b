// Faults of a timeline, through Simulation and ReceiverRunner.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/receiver_runner.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::simulation::faults_test {
namespace {

using geodesy::kSpeedOfLight;
using test::error_of;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::IsNan;

struct Observed {
  Epoch epoch;
  propagation::Arrival arrival;
  gnss::NavigationData messages;
};

class Collector final : public EpochSink {
 public:
  void write(const Epoch& epoch) override { all.push_back({epoch, *epoch.arrival, *epoch.navigation}); }
  void finish() override {}
  std::vector<Observed> all;
};

city::City open_field(const Scenario& scenario) {
  city::City field;
  field.frame = geodesy::LocalFrame(*scenario.city.origin);
  return field;
}

/// A stationary scenario under an open sky: 11 epochs, one a second.
std::string text_of(const std::string& faults, const std::string& receiver) {
  return "city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17, height_m: 0}}\n"
         "sky: {nominal: true, systems: [GPS, Galileo]}\nstart: 2026-06-01T08:00:00Z\nduration_s: 10\n"
         "trajectory: {position: {east_m: 0, north_m: 0, up_m: 2}}\n"
         "receivers: [{name: rover, profile: ideal, elevation_mask_deg: 10, weights: {weighting: equal}" +
         receiver + "}]\n" + (faults.empty() ? "" : "faults: [" + faults + "]\n");
}

std::vector<Observed> run(const std::string& text) {
  const Scenario scenario = parse_scenario(text, "s.yaml");
  Collector collector;
  (void)Simulation(scenario, open_field(scenario)).run({&collector});
  return std::move(collector.all);
}
std::vector<Observed> run(const std::string& faults, const std::string& receiver) {
  return run(text_of(faults, receiver));
}

const receiver::SatelliteObservation& of(const Observed& seen, const std::string& id) {
  const auto& all = seen.epoch.observed.satellites;
  const auto at = std::find_if(all.begin(), all.end(),
                               [&](const auto& satellite) { return gnss::to_string(satellite.id) == id; });
  if (at == all.end()) throw std::runtime_error("no satellite " + id);
  return *at;
}
const propagation::SatelliteView& view(const Observed& seen, gnss::SatelliteId id) {
  return *std::find_if(seen.arrival.views.begin(), seen.arrival.views.end(),
                       [&](const auto& each) { return each.line.id == id; });
}
bool is_used(const Observed& seen, const std::string& id) {
  return of(seen, id).used;
}

/// The highest GPS satellite of the fix.
std::string highest() {
  static const std::string name = [] {
    const auto satellites = run("", "").front().epoch.observed.satellites;
    const receiver::SatelliteObservation* best = nullptr;
    for (const auto& each : satellites) {
      if (each.id.system == gnss::System::GPS &&
          (best == nullptr || each.elevation_rad > best->elevation_rad)) {
        best = &each;
      }
    }
    return gnss::to_string(best->id);
  }();
  return name;
}

// --- satellites
// ------------------------------------------------------------------------------------------------------

// Closed form: computed ranges are wrong by u.d, where d is the offset of the satellite's position and u the
// unit vector to it; the fix moves by the least squares solution of H x = -u.d, rows [-u, 1 of its system].
TEST(EphemerisFault, MovesTheFixByTheRowOfTheDesignMatrix) {
  const auto seen =
      run(fmt::format("{{from_s: 5, ephemeris: {{satellites: {}, radial_m: 100}}}}", highest()), "");
  EXPECT_LT(seen[4].epoch.error_enu_m.norm(), 1e-3) << "before it begins";
  const Observed& hit = seen[5];
  const positioning::Fix& fix = hit.epoch.observed.fix;
  ASSERT_TRUE(fix.solved());
  Eigen::MatrixXd design(static_cast<Eigen::Index>(fix.used.size()), 5);
  Eigen::VectorXd wrong(design.rows());
  for (Eigen::Index i = 0; i < design.rows(); ++i) {
    const gnss::SatelliteId id = fix.used[static_cast<std::size_t>(i)];
    const orbit::LineOfSight& line = view(hit, id).line;
    const bool gps = id.system == gnss::System::GPS;
    design.row(i) << -line.direction_ecef.transpose(), gps ? 1 : 0, gps ? 0 : 1;
    const Eigen::Vector3d offset = 100 * line.position_at_reception_m.normalized();
    wrong[i] = gnss::to_string(id) == highest() ? -line.direction_ecef.dot(offset) : 0;
  }
  const Eigen::VectorXd moved = design.colPivHouseholderQr().solve(wrong);
  const Eigen::Vector3d error_ecef = fix.position_ecef - hit.epoch.truth_ecef;
  EXPECT_GT(error_ecef.norm(), 10);
  EXPECT_LT((error_ecef - moved.head<3>()).norm(), 0.01) << error_ecef.transpose() << "\n"
                                                         << moved.transpose();
  EXPECT_THAT(hit.epoch.faults, ElementsAre("ephemeris 1"));
  EXPECT_THAT(seen[4].epoch.faults, IsEmpty());
}

// A clock reported ahead by 1e-7 s makes the corrected pseudorange longer by c 1e-7 = 29.979 m; one that
// really is ahead makes it shorter by as much.
TEST(EphemerisFault, AClockErrorIsInTheMessageOrInTheSignal) {
  const auto with = [](const std::string& where) {
    return run(fmt::format("{{ephemeris: {{satellites: {}, clock_offset_s: 1e-7, clock_in: {}}}}}", highest(),
                           where),
               "")[3];
  };
  const Observed none = run("", "")[3], message = with("message"), signal = with("signal");
  const auto range = [](const Observed& seen) { return of(seen, highest()).measurement->pseudorange_m; };
  EXPECT_EQ(range(message), range(none)) << "what is measured is true";
  EXPECT_NEAR(range(signal) - range(none), -29.9792458, 1e-6);
  EXPECT_GT(message.epoch.error_enu_m.norm(), 3);
  EXPECT_LT((message.epoch.error_enu_m + signal.epoch.error_enu_m).norm(), 1e-3);
  const auto af0 = [](const Observed& seen) {
    for (const gnss::KeplerEphemeris& e : seen.messages.kepler) {
      if (gnss::to_string(e.id) == highest()) return e.af0;
    }
    return 0.0;
  };
  EXPECT_DOUBLE_EQ(af0(message) - af0(none), 1e-7);
  EXPECT_EQ(af0(signal), af0(none));
}

TEST(EphemerisFault, RaimExcludesTheSatelliteThatLies) {
  const std::string fault = fmt::format("{{ephemeris: {{satellites: {}, radial_m: 100}}}}", highest());
  const Observed caught = run(fault, ", raim: {enabled: true}")[3];
  const auto& excluded = caught.epoch.observed.fix.excluded;
  ASSERT_EQ(excluded.size(), 1U);
  EXPECT_EQ(gnss::to_string(excluded[0]), highest());
  EXPECT_LT(caught.epoch.error_enu_m.norm(), 1e-3);
}

TEST(Outage, OfAllLeavesNoFixAndOfOneLeavesItOut) {
  const auto seen =
      run(fmt::format("{{from_s: 2, until_s: 5, outage: {{}}}}, {{from_s: 7, outage: {{satellites: {}}}}}",
                      highest()),
          "");
  for (std::size_t k = 0; k < seen.size(); ++k) {
    EXPECT_EQ(seen[k].epoch.observed.fix.solved(), k < 2 || k >= 5) << k;
    EXPECT_EQ(seen[k].epoch.observed.visible == 0, k >= 2 && k < 5) << k;
  }
  EXPECT_TRUE(is_used(seen[6], highest()));
  EXPECT_FALSE(of(seen[7], highest()).measurement);
  EXPECT_EQ(of(seen[7], highest()).visibility, propagation::Visibility::Blocked);
}

TEST(Outage, UnhealthySatellitesAreMeasuredAndNotUsed) {
  const auto seen = run("{from_s: 2, outage: {satellites: Galileo, mode: unhealthy}}", "");
  ASSERT_TRUE(seen[2].epoch.observed.fix.solved());
  for (const auto& satellite : seen[2].epoch.observed.satellites) {
    if (!satellite.above_mask) continue;
    EXPECT_TRUE(satellite.measurement);
    EXPECT_EQ(satellite.used, satellite.id.system == gnss::System::GPS) << gnss::to_string(satellite.id);
  }
  for (const gnss::KeplerEphemeris& e : seen[2].messages.kepler) {
    EXPECT_EQ(e.health != 0, e.id.system == gnss::System::Galileo);
  }
  for (const gnss::KeplerEphemeris& e : seen[1].messages.kepler) EXPECT_EQ(e.health, 0);
}

// --- receivers
// -------------------------------------------------------------------------------------------------------

// c 1 ms = 299,792.458 m in every pseudorange, and in the clock.
TEST(ClockFault, AJumpOfAMillisecondIsInTheClockAlone) {
  const auto seen = run("{from_s: 4, until_s: 8, clock: {jump_s: 1e-3, drift: 1e-7}}", "");
  const auto bias_m = [&](std::size_t k) {
    return kSpeedOfLight * seen[k].epoch.observed.fix.clock_bias_s.at(gnss::System::GPS);
  };
  for (const Observed& each : seen) {
    ASSERT_TRUE(each.epoch.observed.fix.solved());
    EXPECT_LT(each.epoch.error_enu_m.norm(), 1e-3);
    EXPECT_LT(each.epoch.observed.fix.velocity_enu_mps->norm(), 1e-3);
  }
  EXPECT_NEAR(bias_m(3), 0, 1e-3);
  EXPECT_NEAR(bias_m(4), 299'792.458, 1e-3);
  EXPECT_NEAR(bias_m(6), 299'792.458 + 2 * 29.9792458, 1e-3);
  EXPECT_NEAR(bias_m(8), 0, 1e-3) << "it goes back";
  EXPECT_NEAR(seen[6].epoch.observed.clock_drift, 1e-7, 1e-15);
}

// 1024 weeks before 2026-06-01 it was 2006-10-16; and 2026 has 18 leap seconds, 2006 had 14.
TEST(DateFault, StatesAnotherDateOfTheSameDay) {
  const auto seen = run("{time: {weeks: -1024, utc_s: 1}}", "");
  const receiver::ReceiverEpoch& observed = seen[0].epoch.observed;
  EXPECT_EQ(geodesy::format_utc(observed.time, 0).substr(0, 19), "2026-06-01T08:00:00");
  EXPECT_EQ(geodesy::format_utc(observed.reported_utc(), 0).substr(0, 19), "2006-10-16T08:00:01");
  EXPECT_EQ(observed.time.week() - observed.reported_time().week(), 1024);
  EXPECT_EQ(observed.reported_time().nanosecond_of_week(), observed.time.nanosecond_of_week());
  EXPECT_LT(seen[0].epoch.error_enu_m.norm(), 1e-3);
}

// For any sky: with all satellites, and with none.
TEST(ForceFault, StatesTheFixThatItIsTold) {
  using positioning::FixKind;
  for (const auto& [word, kind] : {std::pair("none", FixKind::None), std::pair("single", FixKind::Single),
                                   std::pair("differential", FixKind::Differential),
                                   std::pair("float", FixKind::Float), std::pair("fixed", FixKind::Fixed)}) {
    const auto seen = run(
        fmt::format("{{from_s: 2, until_s: 9, force: {{fix: {}}}}}, {{from_s: 5, outage: {{}}}}", word), "");
    for (const std::size_t k : {3U, 7U}) {
      const Epoch& epoch = seen[k].epoch;
      const positioning::Fix& fix = epoch.observed.fix;
      EXPECT_EQ(fix.kind(), kind) << word << k;
      EXPECT_EQ(epoch.observed.visible == 0, k == 7) << "measurements stay";
      if (kind == FixKind::None) continue;
      EXPECT_LT(epoch.error_enu_m.cwiseQuotient(fix.covariance_enu.diagonal().cwiseSqrt()).norm(), 5);
      EXPECT_GT(epoch.error_enu_m.norm(), 1e-4);
      EXPECT_GE(fix.used.size(), 6U);
      EXPECT_LT(fix.dop->pdop, 3);
      EXPECT_LT(fix.velocity_enu_mps->norm(), 0.3);
      EXPECT_EQ(fix.clock_bias_s.size(), 2U);
    }
    EXPECT_EQ(seen[1].epoch.observed.fix.kind(), FixKind::Single);
    EXPECT_EQ(seen[9].epoch.observed.fix.kind(), FixKind::None);
  }
}

// East at 10 m/s with ideal measurements: the reported position identifies its epoch.
TEST(FixFault, StatesOldOffOrOversureFixes) {
  const auto east_errors = [](const std::string& fix, const std::string& more = "") {
    std::string text = text_of("{from_s: 3, until_s: 8, fix: {" + fix + "}}" + more, "");
    const std::string still = "position: {east_m: 0, north_m: 0, up_m: 2}";
    text.replace(text.find(still), still.size(),
                 "waypoints: [{east_m: 0, north_m: 0, up_m: 2}, {east_m: 100, north_m: 0, up_m: 2}], "
                 "speed_mps: 10");
    std::vector<double> errors;
    for (const Observed& seen : run(text)) errors.push_back(std::round(seen.epoch.error_enu_m.x()));
    return errors;
  };
  EXPECT_THAT(east_errors("stuck: true"), ElementsAre(0, 0, 0, 0, -10, -20, -30, -40, 0, 0, 0));
  EXPECT_THAT(east_errors("late_s: 2"), ElementsAre(0, 0, 0, -20, -20, -20, -20, -20, 0, 0, 0));
  EXPECT_THAT(east_errors("late_s: 4"), ElementsAre(0, 0, 0, IsNan(), -40, -40, -40, -40, 0, 0, 0))
      << "there was no fix at -1 s";
  EXPECT_THAT(east_errors("stuck: true", ", {from_s: 9, fix: {late_s: 3}}"),
              ElementsAre(0, 0, 0, 0, -10, -20, -30, -40, 0, -30, -30))
      << "3 s before the second begins";
  EXPECT_THAT(east_errors("repeat: 2"), ElementsAre(0, 0, 0, 0, -10, 0, -10, 0, 0, 0, 0));
  EXPECT_THAT(east_errors("east_m: 20, growth_s: 4"), ElementsAre(0, 0, 0, 0, 5, 10, 15, 20, 0, 0, 0));

  EXPECT_THAT(east_errors("forward_m: 2"), ElementsAre(0, 0, 0, 2, 2, 2, 2, 2, 0, 0, 0));

  // Only after an outage, and in the epochs' own fixes as well.
  const auto back =
      run("{from_s: 2, until_s: 5, outage: {}}, {from_s: 0, fix: {east_m: 20, after_outage_s: 2}}", "");
  std::vector<double> east, alone;
  for (const Observed& seen : back) {
    east.push_back(std::round(seen.epoch.error_enu_m.x()));
    alone.push_back(
        std::round((seen.epoch.observed.single_epoch.position_ecef - seen.epoch.truth_ecef).norm()));
  }
  EXPECT_THAT(east, ElementsAre(0, 0, IsNan(), IsNan(), IsNan(), 20, 20, 0, 0, 0, 0));
  EXPECT_EQ(alone[5], 20);
  EXPECT_EQ(alone[8], 0);

  const auto all =
      run("{from_s: 3, until_s: 8, fix: {state: fixed, accuracy_m: 0.01, without_satellites: true}}", "");
  const positioning::Fix& fix = all[4].epoch.observed.fix;
  EXPECT_EQ(fix.kind(), positioning::FixKind::Fixed);
  EXPECT_TRUE(fix.covariance_enu.isApprox(1e-4 * Eigen::Matrix3d::Identity()));
  EXPECT_THAT(fix.used, IsEmpty());
  const auto factor = run("{from_s: 3, fix: {accuracy_factor: 0.1}}", "");
  EXPECT_TRUE(factor[4].epoch.observed.fix.covariance_enu.isApprox(
      0.01 * all[1].epoch.observed.fix.covariance_enu, 1e-3));
  const auto dropped = run("{from_s: 3, fix: {drop: 0.5}}", "");
  const auto gone = std::count_if(dropped.begin(), dropped.end(), [](const Observed& seen) {
    return seen.epoch.observed.fix.kind() == positioning::FixKind::None;
  });
  EXPECT_GT(gone, 0);
  EXPECT_LT(gone, 8);
}

// A fault of satellites that are not in the sky would have no effect.
TEST(Faults, OfSatellitesThatTheSkyHasNotAreRefused) {
  const auto refused = [](const std::string& fault) {
    return std::string(error_of([&] { (void)run(fault, ""); }).what());
  };
  EXPECT_THAT(
      refused("{name: early,\n  outage: {satellites: [G05, GLONASS]}}"),
      HasSubstr("s.yaml:8: fault 'early': the sky has no GLONASS; leave it out, or name others; there "
                "are satellites of GPS, Galileo"));
  EXPECT_THAT(refused("{ephemeris: {satellites: J02, radial_m: 1}}"), HasSubstr("the sky has no J02"));
  EXPECT_THAT(refused("{spoofing: {position: {east_m: 9, north_m: 0, up_m: 30}, satellites: [G05, E60]}}"),
              HasSubstr("s.yaml:7: satellites: 'E60' is not a satellite"));
}

const std::string kStrength = ", signal: {enabled: true, cn0_sigma_db: 0, lock: {warm_start: true}}";

TEST(AntennaFault, TakesSoMuchOfTheStrengthOrAll) {
  const auto seen =
      run("{from_s: 2, until_s: 5, antenna: {loss_db: 7}}, {from_s: 6, antenna: {loss_db: none}}", kStrength);
  const auto cn0 = [&](std::size_t k) { return of(seen[k], highest()).cn0_dbhz; };
  EXPECT_NEAR(*cn0(2) - *cn0(1), -7, 0.01);
  EXPECT_NEAR(*cn0(5) - *cn0(1), 0, 0.01);
  EXPECT_FALSE(cn0(6));
  EXPECT_FALSE(seen[6].epoch.observed.fix.solved());
}

// Times to first fix: search and ephemeris together, by the option's own numbers; hot: by the receiver's.
TEST(Restart, TakesTheTimesThatItIsGiven) {
  for (const std::string& receiver : {std::string(), kStrength}) {
    const std::map<std::string, int> first_fix{
        {"kind: hot", 1},
        {"kind: warm, search_s: 1, ephemeris_s: 25", 26},
        {"kind: cold, search_s: 2, ephemeris_s: 24", 26},
    };
    for (const auto& [restart, after_s] : first_fix) {
      std::string text = text_of(fmt::format("{{from_s: 3, restart: {{{}}}}}", restart), receiver);
      text.replace(text.find("duration_s: 10"), 14, "duration_s: 40");
      const auto seen = run(text);
      for (int k = 0; k <= 40; ++k) {
        const Observed& each = seen[static_cast<std::size_t>(k)];
        EXPECT_EQ(each.epoch.observed.fix.solved(), k < 3 || k >= 3 + after_s)
            << restart << " at " << k << receiver;
        EXPECT_EQ(each.epoch.faults.empty(), k < 3 || k >= 3 + after_s) << restart << " at " << k;
      }
    }
  }
}

/// The first fix of a receiver after a restart.
struct FirstFix {
  double after_s = 1e9;
  std::size_t used = 0, used_20_s_later = 0;
};

/// The first fixes of receivers with these profiles, at one start.
std::map<std::string, FirstFix> first_fixes(const std::vector<std::string>& profiles, const std::string& kind,
                                            int start_s) {
  std::string text = fmt::format(
      "city: {{open: true, origin: {{latitude_deg: 22.3, longitude_deg: 114.17, height_m: 0}}}}\n"
      "sky: {{nominal: true}}\nstart: 2026-06-01T08:00:{:02d}Z\nduration_s: 90\nrate_hz: 1\n"
      "trajectory: {{position: {{east_m: 0, north_m: 0, up_m: 2}}}}\n"
      "faults: [{{from_s: 0, restart: {{kind: {}}}}}]\nreceivers:\n",
      start_s, kind);
  for (const std::string& profile : profiles) {
    text += fmt::format("  - {{name: {0}, profile: {0}}}\n", profile);
  }
  const Scenario scenario = parse_scenario(text, "s.yaml");
  struct Sink final : EpochSink {
    explicit Sink(std::size_t receivers) : fixes(receivers) {}
    void write(const Epoch& epoch) override {
      if (!start) start = epoch.observed.time;
      FirstFix& fix = fixes.at(epoch.receiver);
      const double after_s = epoch.observed.time - *start;
      const std::size_t used = epoch.observed.fix.used.size();
      if (fix.after_s > 1e8 && epoch.observed.fix.solved()) {
        fix.after_s = after_s;
        fix.used = used;
      }
      if (after_s <= fix.after_s + 20) fix.used_20_s_later = used;
    }
    void finish() override {}
    std::vector<FirstFix> fixes;
    std::optional<geodesy::GpsTime> start;
  };
  Sink sink(profiles.size());
  (void)Simulation(scenario, open_field(scenario)).run({&sink});
  std::map<std::string, FirstFix> result;
  for (std::size_t i = 0; i < profiles.size(); ++i) result[profiles[i]] = sink.fixes[i];
  return result;
}

// A cold start takes the time of the profile's data sheet, in the median of starts over a frame of 30 s; each
// start has independent noise. The first fix has few satellites, and more are added with the frames.
TEST(Restart, TakesTheTimeOfEachProfile) {
  const std::vector<std::string> profiles{"ublox-m10", "ublox-f9p", "ublox-m8t", "survey", "phone"};
  const std::map<std::string, double> documented_s{
      {"ublox-m10", 23}, {"ublox-f9p", 24}, {"ublox-m8t", 26}, {"survey", 39}, {"phone", 5}};
  std::map<std::string, std::vector<double>> after_s, used, gained;
  for (int start_s = 0; start_s < 60; start_s += 5) {
    for (const auto& [profile, fix] : first_fixes(profiles, "cold", start_s)) {
      after_s[profile].push_back(fix.after_s);
      used[profile].push_back(static_cast<double>(fix.used));
      gained[profile].push_back(static_cast<double>(fix.used_20_s_later) - static_cast<double>(fix.used));
    }
  }
  for (const auto& [profile, expected_s] : documented_s) {
    std::printf("%s: first fix after %.0f s (documented %.0f), %.0f satellites, %.0f more 20 s later\n",
                profile.c_str(), *median(after_s[profile]), expected_s, *median(used[profile]),
                *median(gained[profile]));
    EXPECT_NEAR(*median(after_s[profile]), expected_s, 3) << profile;
    EXPECT_GE(*median(used[profile]), 4) << profile;
    EXPECT_LE(*median(used[profile]), 10) << profile;
    EXPECT_GE(*median(gained[profile]), 8) << profile;
  }
}

TEST(Restart, IsHotAtOnceAndWarmByTheFrames) {
  for (const auto& [profile, fix] : first_fixes({"ublox-m10", "survey"}, "hot", 0)) {
    EXPECT_EQ(fix.after_s, 1) << profile;
  }
  const auto warm = first_fixes({"ublox-m10", "phone"}, "warm", 0);
  EXPECT_GE(warm.at("ublox-m10").after_s, 12) << "four strings of GLONASS, the fastest ephemeris";
  EXPECT_LE(warm.at("ublox-m10").after_s, 36);
  EXPECT_LE(warm.at("phone").after_s, 1) << "its ephemerides come by the network";
}

// 1 W at 1 m: GLONASS and BeiDou's B1I, next to the jammed 20 MHz, are lost as well.
TEST(Jamming, SaturatesWhatStandsBesideIt) {
  const auto tracked = [](double away_m, double power_dbm) {
    const Scenario scenario = parse_scenario(
        fmt::format(
            "city: {{open: true, origin: {{latitude_deg: 22.3, longitude_deg: 114.17, height_m: 0}}}}\n"
            "sky: {{nominal: true}}\nstart: 2026-06-01T08:00:00Z\nduration_s: 6\n"
            "trajectory: {{position: {{east_m: 0, north_m: 0, up_m: 2}}}}\n"
            "receivers: [{{name: f9p, profile: ublox-f9p, tracks: [L1CA, G1, E1, B1I]}}]\n"
            "faults: [{{jamming: {{position: {{east_m: {}, north_m: 0, up_m: 2}}, emissions: [{{shape: "
            "chirp, power_dbm: {}}}]}}}}]\n",
            away_m, power_dbm),
        "s.yaml");
    Collector collector;
    (void)Simulation(scenario, open_field(scenario)).run({&collector});
    return collector.all.back().epoch.observed.visible;
  };
  EXPECT_EQ(tracked(1, 30), 0);
  const int neighbour = tracked(100, 30);
  EXPECT_GT(neighbour, 4) << "GLONASS and BeiDou";
  EXPECT_GT(tracked(1e6, -60), neighbour + 10);
}

// --- the timeline
// ------------------------------------------------------------------------------------------------

const std::string kAll = fmt::format(
    "{{from_s: 1, until_s: 3, outage: {{satellites: Galileo}}}}, {{from_s: 2, ephemeris: {{satellites: GPS, "
    "along_m: "
    "20}}}}, {{clock: {{jump_s: 1e-5, drift: 1e-9}}}}, {{time: {{utc_s: 1}}}}, {{from_s: 4, antenna: "
    "{{loss_db: "
    "3}}}}, {{from_s: 2, scintillation: {{s4: 0.6}}}}, {{from_s: 6, restart: {{kind: hot}}}}");
const std::string kNoisy = ", noise: {enabled: true}, signal: {enabled: true, lock: {warm_start: true}}";

/// A host's receiver at the scenario's position.
class Host {
 public:
  explicit Host(const std::string& text) {
    const Scenario scenario = parse_scenario(text, "s.yaml");
    live_ = std::make_unique<ReceiverRunner>(
        RunnerConfig(scenario), std::make_shared<CityScene>(open_field(scenario)), *scenario.start);
  }
  Epoch step(double seconds) {
    RigidPose antenna;
    antenna.position_m = {0, 0, 2};
    return live_->observe(seconds, antenna).epoch;
  }
  ReceiverRunner& operator*() { return *live_; }

 private:
  std::unique_ptr<ReceiverRunner> live_;
};

TEST(FaultTimeline, GivesTheSameNumbersOfflineAndLiveAndTwice) {
  const auto offline = run(kAll, kNoisy), again = run(kAll, kNoisy);
  Host host(text_of(kAll, kNoisy));
  for (int round = 0; round < 2; ++round) {  // a time before the last one restarts it
    for (std::size_t k = 0; k < offline.size(); ++k) {
      const Epoch live = host.step(static_cast<double>(k));
      EXPECT_EQ(live.faults, offline[k].epoch.faults);
      const auto& satellites = offline[k].epoch.observed.satellites;
      ASSERT_EQ(live.observed.satellites.size(), satellites.size());
      for (std::size_t i = 0; i < satellites.size(); ++i) {
        ASSERT_EQ(live.observed.satellites[i].measurement.has_value(), satellites[i].measurement.has_value());
        if (!satellites[i].measurement) continue;
        const auto& other = again[k].epoch.observed.satellites[i].measurement;
        EXPECT_EQ(satellites[i].measurement->pseudorange_m, other->pseudorange_m);
        EXPECT_NEAR(live.observed.satellites[i].measurement->pseudorange_m, other->pseudorange_m, 1e-6);
        EXPECT_NEAR(*live.observed.satellites[i].cn0_dbhz, *satellites[i].cn0_dbhz, 1e-6);
      }
    }
  }
  EXPECT_THAT(offline[7].epoch.faults,
              ElementsAre("ephemeris 2", "clock 3", "time 4", "antenna 5", "scintillation 6"));
}

TEST(FaultTimeline, ChangesWhileAReceiverRuns) {
  Host host(text_of("", ""));
  ReceiverRunner& live = *host;
  EXPECT_TRUE(host.step(0).observed.fix.solved());
  EXPECT_EQ(live.add_fault("outage: {}"), "outage 1");
  EXPECT_EQ(live.add_fault(R"({"name": "later", "from_s": 5, "clock": {"jump_s": 1e-3}})"), "later");
  EXPECT_FALSE(host.step(1).observed.fix.solved());
  ASSERT_EQ(live.faults().size(), 2U);
  EXPECT_TRUE(live.faults()[0].active);
  EXPECT_FALSE(live.faults()[1].active);
  live.end_fault("outage 1");
  EXPECT_TRUE(host.step(2).observed.fix.solved());
  EXPECT_NEAR(host.step(5).observed.clock_bias_s, 1e-3, 1e-12);
  EXPECT_THAT(error_of([&] { live.end_fault("outage 1"); }).what(), HasSubstr("use one of later"));
  EXPECT_THAT(error_of([&] { live.add_fault("{from_s: 1, duration_s: 2, outage: {}}"); }).what(),
              AllOf(HasSubstr("it ends at 3 s, and the time is 5.0 s"), HasSubstr("leave from_s out")));
  EXPECT_THAT(error_of([&] { live.add_fault("clock: {jump_s: 3}", "socket"); }).what(),
              HasSubstr("socket:1: jump_s: 3 is out of range"));
  EXPECT_THAT(error_of([&] { live.add_fault("outage: {satellites: J02}", "socket"); }).what(),
              HasSubstr("socket:1: fault 'outage 3': the sky has no J02"));
  EXPECT_THAT(error_of([&] { live.add_fault("{name: later, outage: {}}"); }).what(),
              HasSubstr("two faults have the name 'later'"));
  EXPECT_EQ(host.step(0).observed.clock_bias_s, 0) << "as constructed";
  EXPECT_THAT(live.faults(), IsEmpty());
}

// Fixes are stored from the time the fault is added.
TEST(FixFault, ReportsNoFixUntilOneIsOldEnough) {
  Host host(text_of("", ""));
  EXPECT_TRUE(host.step(0).observed.fix.solved());
  (*host).add_fault("{from_s: 2, fix: {late_s: 2}}");
  EXPECT_TRUE(host.step(1).observed.fix.solved());
  EXPECT_FALSE(host.step(2).observed.fix.solved());
  EXPECT_TRUE(host.step(3).observed.fix.solved());
}

TEST(FaultTimeline, HitsTheReceiversThatItNames) {
  std::string text = text_of("{receivers: base, outage: {}}", "}, {name: base, profile: ideal");
  for (const Observed& each : run(text)) {
    EXPECT_EQ(each.epoch.observed.fix.solved(), each.epoch.receiver == 0);
    EXPECT_EQ(each.epoch.faults.size(), each.epoch.receiver);
  }
  text = text_of("{receivers: bass, outage: {}}", "}, {name: base, profile: ideal");
  EXPECT_THAT(error_of([&] { (void)parse_scenario(text, "s.yaml"); }).what(),
              HasSubstr("s.yaml:7: receivers: there is no receiver 'bass'; use one of rover, base"));
}

}  // namespace
}  // namespace canyon::simulation::faults_test
