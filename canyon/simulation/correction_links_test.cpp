#include "canyon/simulation/correction_links.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/receiver_group.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/simulation_support.hpp"

namespace canyon::simulation {
namespace {

using positioning::Measurement;
using ::testing::AllOf;
using ::testing::HasSubstr;

class Collector final : public EpochSink {
 public:
  void write(const Epoch& epoch) override { epochs.push_back(epoch); }
  void finish() override {}
  std::vector<Epoch> epochs;
  [[nodiscard]] std::vector<const Epoch*> of(std::size_t receiver) const {
    std::vector<const Epoch*> found;
    for (const Epoch& epoch : epochs) {
      if (epoch.receiver == receiver) found.push_back(&epoch);
    }
    return found;
  }
};

// A rover in an open field and a base 1 km away, with an ionosphere and a troposphere that no fix corrects
// and faulty messages: 60 m of orbit, 30 m of clock. `keys` of all receivers, `rover_keys` only of the rover.
std::string open_field(const std::string& keys, const std::string& rover_keys) {
  return R"(
city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17, height_m: 0}}
sky: {nominal: true, systems: [GPS, Galileo]}
start: 2026-06-01T06:00:00Z
rate_hz: 1
trajectory: {position: {east_m: 0, north_m: 0, up_m: 1.5}}
duration_s: 60
receivers:
  - {name: rover, profile: ideal, elevation_mask_deg: 10, ionosphere: true, troposphere: true, independent_noise: true, )" +
         keys + rover_keys + R"(}
  - {name: base, profile: ideal, elevation_mask_deg: 10, ionosphere: true, troposphere: true, independent_noise: true,
     fixed: {east_m: 600, north_m: 800, up_m: 40}, )" +
         keys + R"(}
faults:
  - {ephemeris: {satellites: GPS, radial_m: 20, along_m: 60, clock_offset_s: 1e-7}}
  - {ephemeris: {satellites: Galileo, radial_m: -30, cross_m: 40, clock_offset_s: -5e-8}}
seed: 3
)";
}
constexpr const char* kFromBase = ", corrections: {from: base}";

std::vector<Epoch> run_of(const std::string& text, std::size_t receiver, int threads = 0) {
  const Scenario scenario = parse_scenario(text, "scenario.yaml");
  city::City city;
  city.frame = geodesy::LocalFrame(*scenario.city.origin);
  const Simulation simulation(scenario, std::move(city));
  Collector sink;
  RunOptions options;
  options.threads = threads;
  (void)simulation.run({&sink}, options);
  std::vector<Epoch> found;
  for (const Epoch* epoch : sink.of(receiver)) found.push_back(*epoch);
  return found;
}

/// A pseudorange with only the terms of geometry and the satellite's clock.
double clean_m(const orbit::LineOfSight& line) {
  return line.range_m - geodesy::kSpeedOfLight * (line.state.clock_bias_s - line.state.group_delay_s);
}

double worst_m(const std::vector<Epoch>& epochs) {
  double worst = 0;
  for (const Epoch& epoch : epochs) worst = std::max(worst, epoch.error_enu_m.norm());
  return worst;
}

// Common errors cancel. An orbit error d leaves at most |d| b / r = 60 m x 1 km / 20,200 km = 3 mm in a
// range; the troposphere of 40 m of height about 1.2 cm at the zenith (removed by the models if the fix
// corrects it), and the ionosphere's gradient is below 1 cm/km. Times a PDOP of 2.
TEST(Corrections, TakeOutWhatRoverAndBaseShare) {
  const std::vector<Epoch> alone = run_of(open_field("position_filter: {enabled: false}", ""), 0);
  const std::vector<Epoch> rover = run_of(open_field("position_filter: {enabled: false}", kFromBase), 0);
  ASSERT_EQ(rover.size(), 61U);
  EXPECT_GT(worst_m(alone), 10);
  EXPECT_LT(worst_m(rover), 0.15);
  const std::vector<Epoch> modelled =
      run_of(open_field("correct_ionosphere: true, correct_troposphere: true", kFromBase), 0);
  EXPECT_LT(worst_m(modelled), 0.012);
  for (const Epoch& epoch : rover) {
    EXPECT_EQ(epoch.observed.fix.kind(), positioning::FixKind::Differential);
    EXPECT_EQ(epoch.observed.fix.correction_age_s, 0);
  }
  for (const Epoch& epoch : alone) EXPECT_EQ(epoch.observed.fix.kind(), positioning::FixKind::Single);
}

// The noise of both codes remains: the fix is that of a rover whose pseudoranges have no error except the
// difference of the two.
TEST(Corrections, LeaveTheNoiseOfBothCodes) {
  const std::string keys =
      "noise: {enabled: true}, correct_ionosphere: true, correct_troposphere: true, biases: {code_m: "
      "[Galileo=7]}, clock: {bias_s: 1e-4, drift: 1e-7}";
  const std::string text = open_field(keys, kFromBase);
  const std::vector<Epoch> rover = run_of(text, 0), base = run_of(text, 1);
  const Scenario scenario = parse_scenario(text, "scenario.yaml");
  const BuiltSky sky = build_sky(scenario.sky, rover.front().truth.time, rover.back().truth.time,
                                 rover.front().truth.position);
  double squares = 0;
  for (std::size_t k = 0; k < rover.size(); ++k) {
    const receiver::ReceiverEpoch& seen = rover[k].observed;
    std::vector<Measurement> measurements;
    for (const receiver::SatelliteObservation& satellite : seen.satellites) {
      if (!satellite.measurement) continue;
      for (const receiver::SatelliteObservation& at_base : base[k].observed.satellites) {
        if (at_base.id != satellite.id || !at_base.measurement) continue;
        const auto line = orbit::line_of_sight(*sky.sky, satellite.id, seen.time, rover[k].truth_ecef);
        Measurement m;
        m.id = satellite.id;
        m.sigma_m = std::hypot(satellite.measurement->sigma_m, at_base.measurement->sigma_m);
        m.pseudorange_m = clean_m(*line) + satellite.noise_m - at_base.noise_m;
        measurements.push_back(m);
      }
    }
    positioning::FixOptions options = scenario.receivers[0].options.fix;
    options.correct_ionosphere = options.correct_troposphere = false;
    const positioning::Fix expected = solve_fix(seen.time, measurements, *sky.sky, options);
    ASSERT_TRUE(expected.solved());
    EXPECT_EQ(expected.used, seen.fix.used);
    EXPECT_LT((expected.position_ecef - seen.fix.position_ecef).norm(), 0.015) << k;
    squares += rover[k].error_enu_m.squaredNorm();
  }
  EXPECT_GT(std::sqrt(squares / static_cast<double>(rover.size())), 0.2);  // there is noise
}

// A base whose clock drifts fast does not break the rover's filter, which also uses Doppler.
TEST(Corrections, OfARunningClockKeepTheFilter) {
  const std::string keys =
      "correct_ionosphere: true, correct_troposphere: true, clock: {bias_s: 1e-4, drift: 1e-6}, "
      "position_filter: {enabled: true}";
  const std::vector<Epoch> rover = run_of(open_field(keys, kFromBase), 0);
  EXPECT_LT(worst_m(rover), 0.05);
  for (const Epoch& epoch : rover) {
    EXPECT_EQ(epoch.observed.fix.kind(), positioning::FixKind::Differential);
    EXPECT_GT(epoch.observed.fix.used.size(), 8U);
  }
}

// The base is silent for 20 s: its last corrections are used for 5 s, then the fix is a single one, and back.
TEST(Corrections, AreNotUsedWhenTheyAreOld) {
  std::string text =
      open_field("position_filter: {enabled: false}", ", corrections: {from: base, max_age_s: 5}");
  const std::size_t faults = text.find("faults:\n");
  text.insert(faults + 8, "  - {from_s: 20, duration_s: 20, receivers: [base], outage: {}}\n");
  const std::vector<Epoch> rover = run_of(text, 0);
  for (std::size_t k = 0; k < rover.size(); ++k) {
    const positioning::Fix& fix = rover[k].observed.fix;
    const bool differential = k < 25 || k >= 40;
    EXPECT_EQ(fix.kind(), differential ? positioning::FixKind::Differential : positioning::FixKind::Single);
    EXPECT_EQ(rover[k].error_enu_m.norm() < 0.2, differential) << k;
    EXPECT_EQ(fix.correction_station.has_value(), differential);
    if (!differential) continue;
    EXPECT_NEAR(*fix.correction_age_s, k < 20 || k >= 40 ? 0 : static_cast<double>(k) - 19, 1e-6);
  }
}

TEST(Corrections, OfTheFutureOrTooOldAreNone) {
  rtk::CorrectionOptions options;
  options.max_age_s = 5;
  receiver::CodeCorrections corrections(options);
  const geodesy::GpsTime now = geodesy::GpsTime::from_week(2300, 1000);
  EXPECT_FALSE(corrections.age_s(now));
  rtk::Corrections epoch;
  epoch.station = 17;
  epoch.station_ecef = {-2.4e6, 5.4e6, 2.4e6};
  epoch.receiver_time = now;
  SkyConfig nominal;
  nominal.nominal = true;
  const BuiltSky sky = build_sky(nominal, now, now, {});
  corrections.take(epoch, *sky.sky, {}, {});
  EXPECT_EQ(corrections.station(), 17);
  EXPECT_EQ(corrections.age_s(now + 5), 5);
  EXPECT_FALSE(corrections.age_s(now + 5.001));
  EXPECT_EQ(corrections.age_s(now + -0.001), 0);  // the clocks differ
  EXPECT_FALSE(corrections.age_s(now + -1.5));
}

// An error of the base's reported position shifts the rover, and is detected from the base's pseudoranges.
TEST(Corrections, AWrongPlaceOfTheBaseIsTheRoversErrorAndIsSaid) {
  const auto warnings = [](const std::string& more, double& north_m) {
    const Scenario scenario = parse_scenario(
        "city: {open: true, origin: {latitude_deg: 48, longitude_deg: 11, height_m: 500}}\n"
        "sky: {nominal: true, systems: [GPS, Galileo]}\nstart: 2026-06-01T06:00:00Z\nduration_s: 20\n"
        "trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 1.5}]}\nreceivers:\n"
        "  - {name: rover, profile: survey, corrections: {from: base" +
            more + "}}\n  - {name: base, profile: survey, fixed: {east_m: 900, north_m: 300, up_m: 5}}\n",
        "scenario.yaml");
    city::City city;
    city.frame = geodesy::LocalFrame(*scenario.city.origin);
    const Simulation simulation(scenario, std::move(city));
    Collector sink;
    const RunResult result = simulation.run({&sink});
    north_m = sink.of(0).back()->error_enu_m.y();
    return result.warnings;
  };
  double north_m = 0;
  EXPECT_THAT(warnings("", north_m), ::testing::IsEmpty());
  EXPECT_NEAR(north_m, 0, 3);
  EXPECT_THAT(warnings(", station_error_m: [0, 60, 0]", north_m),
              ::testing::ElementsAre(HasSubstr("rover: the base's pseudoranges put it")));
  EXPECT_NEAR(north_m, 60, 3);
}

// A base that receives a fifth of its satellites only by reflections of far houses has its true position.
TEST(Corrections, EchoesAtTheBaseAreNotAWrongPlace) {
  SkyConfig nominal;
  nominal.nominal = true;
  const geodesy::GpsTime now = geodesy::GpsTime::from_week(2421, 100000);
  const BuiltSky sky = build_sky(nominal, now, now, {});
  const geodesy::LocalFrame frame(geodesy::Geodetic::from_degrees(48, 11, 500));
  const Eigen::Vector3d point = frame.ecef_from_local({0, 0, 10});
  positioning::FixOptions fix;
  fix.correct_ionosphere = fix.correct_troposphere = false;
  const auto offset_m = [&](const Eigen::Vector3d& reported_offset) {
    rtk::Corrections epoch;
    epoch.receiver_time = now;
    epoch.station_ecef = frame.ecef_from_local(Eigen::Vector3d(0, 0, 10) + reported_offset);
    int echoes = 0, count = 0;
    for (const gnss::SatelliteId id : sky.sky->satellites()) {
      const auto line = orbit::line_of_sight(*sky.sky, id, now, point);
      if (!line || line->elevation_rad < 0.3) continue;
      const double echo_m = ++count % 5 == 0 ? 250 : 0;
      echoes += echo_m > 0;
      Measurement m;
      m.id = id;
      m.sigma_m = 1;
      m.pseudorange_m = clean_m(*line) + echo_m;
      m.carrier_frequency_hz = line->state.carrier_frequency_hz;
      epoch.observations.push_back({&gnss::signals_of(id.system).front(), m});
    }
    EXPECT_GT(echoes, 2);
    receiver::CodeCorrections corrections({});
    corrections.take(epoch, *sky.sky, fix, {});
    return corrections.station_offset_m().value();
  };
  EXPECT_LT(offset_m({0, 0, 0}), 10);
  EXPECT_FALSE(receiver::wrong_station_warning(offset_m({0, 0, 0})));
  EXPECT_NEAR(offset_m({0, 60, 0}), 60, 10);
  // Errors of a wrong sign of a coordinate, or of satellites of other times.
  EXPECT_NEAR(offset_m({0, 3000, 0}), 3000, 600);
  EXPECT_GT(offset_m({-6e6, 0, -4e6}), 1e5);
  EXPECT_GT(offset_m({0, 0, -1.2e7}), 1e5);
}

const std::string kDrive = R"(
city: {synthetic: {}}
sky: {nominal: true, systems: [GPS, Galileo]}
start: 2026-06-01T08:00:00Z
trajectory:
  waypoints: [{east_m: -60, north_m: 0, up_m: 1.5}, {east_m: 60, north_m: 0, up_m: 1.5}]
  speed_mps: 6
rate_hz: 2
seed: 9
receivers:
)";
const std::string kBase =
    "  - {name: base, profile: survey, independent_noise: true, fixed: {east_m: 0, north_m: 0, up_m: 250}}\n";

// Receivers may be in any order; sinks get them in that order, on any number of threads.
TEST(Corrections, ComeFromReceiversInAnyOrder) {
  const std::string rover = "  - {name: car, independent_noise: true, corrections: {from: base}}\n";
  const auto run = [&](const std::string& receivers, int threads) {
    const Simulation simulation(parse_scenario(kDrive + receivers, "scenario.yaml"),
                                city::synthetic_city({}));
    Collector sink;
    RunOptions options;
    options.threads = threads;
    (void)simulation.run({&sink}, options);
    return sink;
  };
  const Collector first = run(kBase + rover, 1), last = run(rover + kBase, 2);
  ASSERT_EQ(first.epochs.size(), last.epochs.size());
  const auto a = first.of(1), b = last.of(0);
  int differential = 0;
  for (std::size_t k = 0; k < a.size(); ++k) {
    EXPECT_EQ(last.epochs[2 * k].receiver, 0U);
    ASSERT_EQ(a[k]->observed.fix.solved(), b[k]->observed.fix.solved());
    if (!a[k]->observed.fix.solved()) continue;
    EXPECT_EQ(a[k]->observed.fix.position_ecef, b[k]->observed.fix.position_ecef);
    if (a[k]->observed.fix.kind() == positioning::FixKind::Differential) ++differential;
  }
  EXPECT_GT(differential, 20);
}

TEST(Corrections, OrderIsThatOfNeed) {
  std::vector<ReceiverConfig> receivers(4);
  const char* names[] = {"a", "b", "c", "d"};
  for (std::size_t i = 0; i < 4; ++i) {
    receivers[i].options.name = names[i];
    receivers[i].options.independent_noise = true;
    receivers[i].fixed.emplace();
  }
  EXPECT_EQ(CorrectionLinks(receivers, 1).order({0, 1, 2, 3}), (std::vector<std::size_t>{0, 1, 2, 3}));
  receivers[0].options.corrections.from = "c";
  receivers[2].options.corrections.from = "d";
  EXPECT_EQ(CorrectionLinks(receivers, 1).order({0, 1, 2, 3}), (std::vector<std::size_t>{1, 3, 2, 0}));
  EXPECT_EQ(CorrectionLinks(receivers, 1).base_of(0), 2U);
  EXPECT_FALSE(CorrectionLinks(receivers, 1).base_of(1));
}

TEST(Corrections, RefuseWhatCannotBe) {
  const auto refusal = [](const std::string& receivers) {
    return std::string(test::error_of([&] {
                         (void)parse_scenario(
                             "city: {synthetic: {}}\ntrajectory: {position: {east_m: 0, "
                             "north_m: 0, up_m: 2}}\nreceivers:\n" +
                                 receivers,
                             "s.yaml");
                       }).what());
  };
  const std::string base =
      "  - {name: base, independent_noise: true, fixed: {east_m: 0, north_m: 0, up_m: 99}}\n";
  EXPECT_THAT(refusal(base + "  - {name: car, corrections: {from: bass}}\n"),
              AllOf(HasSubstr("s.yaml:5"), HasSubstr("'bass'"), HasSubstr("base, car")));
  EXPECT_THAT(refusal("  - {name: car, independent_noise: true, corrections: {from: car}}\n"),
              AllOf(HasSubstr("s.yaml:4"), HasSubstr("itself")));
  EXPECT_THAT(
      refusal("  - {name: van, independent_noise: true}\n  - {name: car, corrections: {from: van}}\n"),
      AllOf(HasSubstr("s.yaml:5"), HasSubstr("fixed:")));
  EXPECT_THAT(refusal("  - {name: a, independent_noise: true, fixed: {east_m: 0, north_m: 0, up_m: 9}, "
                      "corrections: {from: b}}\n"
                      "  - {name: b, fixed: {east_m: 9, north_m: 0, up_m: 9}, corrections: {from: a}}\n"),
              AllOf(HasSubstr("s.yaml:4"), HasSubstr("itself depends on this receiver")));
  EXPECT_THAT(refusal("  - {name: base, independent_noise: false, fixed: {east_m: 0, north_m: 0, up_m: 99}}\n"
                      "  - {name: car, independent_noise: false, corrections: {from: base}}\n"),
              AllOf(HasSubstr("s.yaml:5"), HasSubstr("independent_noise: false")));
  EXPECT_THAT(refusal(base + "  - {name: car, corrections: {from: base, station_error_m: [1, 2, 3, 4]}}\n"),
              HasSubstr("station_error_m: 4 numbers"));
  EXPECT_THAT(refusal(base + "  - {name: car, corrections: {from: base, max_age_s: 0}}\n"),
              AllOf(HasSubstr("s.yaml:5"), HasSubstr("max_age_s")));
}

constexpr const char* kLive = R"(
sky: {nominal: true, systems: [GPS, Galileo]}
start: 2026-06-01T08:00:00Z
name: car
seed: 9
base: {profile: survey, fixed: {east_m: 0, north_m: 0, up_m: 250}}
corrections: {from: base}
)";

// A host with one antenna gets a base from its configuration alone, with the same numbers as the scenario.
TEST(Corrections, AreTheSameLive) {
  const Scenario scenario =
      parse_scenario(kDrive + "  - {name: car, independent_noise: true, corrections: {from: base}}\n" + kBase,
                     "scenario.yaml");
  const Simulation simulation(scenario, city::synthetic_city({}));
  Collector batch;
  (void)simulation.run({&batch});
  const auto scene = std::make_shared<CityScene>(city::synthetic_city({}));
  simulation::ReceiverGroup live(parse_live_config(kLive, "host"), scene, simulation.begin());
  ASSERT_EQ(batch.epochs.size(), 82U);
  int differential = 0;
  for (std::size_t k = 0; k < batch.epochs.size(); k += 2) {
    const Epoch& expected = batch.epochs[k];
    const geodesy::GpsTime time = expected.truth.time;
    std::vector<simulation::ReceiverGroup::Due> due{{1, time, live.fixed_pose(1, time)},
                                                    {0, time, simulation.antenna_pose(0, time)}};
    const std::vector<ReceiverRunner::Step> steps = live.make(due, false);
    EXPECT_EQ(steps[0].epoch.receiver, 1U);
    for (const auto& [a, b] :
         {std::pair(&expected, &steps[1].epoch), {&batch.epochs[k + 1], &steps[0].epoch}}) {
      ASSERT_EQ(a->observed.fix.solved(), b->observed.fix.solved());
      EXPECT_EQ(a->observed.fix.kind(), b->observed.fix.kind());
      EXPECT_EQ(a->observed.fix.used, b->observed.fix.used);
      if (!a->observed.fix.solved()) continue;
      EXPECT_LT((a->observed.fix.position_ecef - b->observed.fix.position_ecef).norm(), 1e-6);
    }
    if (steps[1].epoch.observed.fix.kind() == positioning::FixKind::Differential) ++differential;
  }
  EXPECT_GT(differential, 20);
}

TEST(Corrections, OfAHostNeedABase) {
  const auto refusal = [](const std::string& text) {
    return std::string(test::error_of([&] { (void)parse_live_config(text, "host"); }).what());
  };
  EXPECT_THAT(refusal("corrections: {from: base}\n"), AllOf(HasSubstr("host:1"), HasSubstr("base: {fixed")));
  EXPECT_THAT(refusal("base: {profile: survey}\n"),
              AllOf(HasSubstr("host:1"), HasSubstr("give its position")));
  EXPECT_THAT(refusal("base: {name: rover, fixed: {east_m: 1, north_m: 2, up_m: 3}}\n"),
              HasSubstr("'rover' is the name of the receiver"));
  EXPECT_THAT(refusal("corrections: {from: 'ntrip://127.0.0.1:2101/BASE'}\n"),
              AllOf(HasSubstr("host:1"), HasSubstr("is a stream, which hosts do not read")));
  const RunnerConfig config = parse_live_config(kLive, "host");
  EXPECT_THAT(std::string(test::error_of([&] {
                            (void)changed_live_config(config, "corrections: {from: other}", "change");
                          }).what()),
              HasSubstr("corrections.from: cannot change"));
  EXPECT_EQ(changed_live_config(config, "corrections.max_age_s: 5", "change")
                .receiver()
                .options.corrections.max_age_s,
            5);
  // A client can send back the options that it was shown.
  EXPECT_EQ(
      changed_live_config(config, running_options(config), "change").receiver().options.corrections.from,
      "base");
}

// Faults contain the names of rover and base.
TEST(Corrections, FaultsOfAHostReachItsBase) {
  const auto scene = std::make_shared<CityScene>(city::synthetic_city({}));
  const RunnerConfig config = parse_live_config(kLive, "host");
  simulation::ReceiverGroup live(config, scene, *config.start);
  EXPECT_EQ(live.order(), (std::vector<std::size_t>{1, 0}));
  const auto base_at = [&](double seconds) {
    const geodesy::GpsTime time = live[0].at(seconds);
    const Pose rover = pose_of({{0, 0, 1.5}}, {scene->city.frame}, time);
    std::vector<simulation::ReceiverGroup::Due> due{{1, time, live.fixed_pose(1, time)}, {0, time, rover}};
    return live.make(due, false).front().epoch;
  };
  EXPECT_TRUE(base_at(0).observed.fix.measured());
  const std::string name = live.add_fault("{receivers: [base], outage: {}}");
  EXPECT_FALSE(base_at(1).observed.fix.measured());
  live.end_fault(name);
  EXPECT_NE(base_at(2).faults, std::vector<std::string>{name});
  // A single receiver cannot have it.
  EXPECT_THAT(test::error_of([&] { (void)ReceiverRunner(config, scene, *config.start); }).what(),
              HasSubstr("simulation::Simulation"));
  EXPECT_THAT(test::error_of([&] { live.end_fault("none"); }).what(), HasSubstr("none"));
}

// The link uses the options that a receiver gets while it runs.
TEST(Corrections, OfARunFollowTheOptionsOfItsReceiver) {
  const auto scene = std::make_shared<CityScene>(city::synthetic_city({}));
  const RunnerConfig config = parse_live_config(kLive, "host");
  simulation::ReceiverGroup live(config, scene, *config.start);
  const auto kind_at = [&](double seconds) {
    const geodesy::GpsTime time = live[0].at(seconds);
    const std::vector<simulation::ReceiverGroup::Due> due{
        {1, time, live.fixed_pose(1, time)}, {0, time, pose_of({{0, 0, 150}}, {scene->city.frame}, time)}};
    return live.make(due, false).back().epoch.observed.fix.kind();
  };
  for (const double seconds : {0.0, 1.0, 2.0}) (void)kind_at(seconds);
  EXPECT_EQ(kind_at(3), positioning::FixKind::Differential);
  live[0].set_config(changed_live_config(live[0].config(), "corrections.outages_s: [0]", "change"));
  for (const double seconds : {4.0, 5.0, 6.0}) EXPECT_EQ(kind_at(seconds), positioning::FixKind::Single);
  live[0].set_config(changed_live_config(live[0].config(), "corrections.outages_s: [100, 110]", "change"));
  for (const double seconds : {7.0, 8.0, 9.0}) (void)kind_at(seconds);
  EXPECT_EQ(kind_at(10), positioning::FixKind::Differential);
}

}  // namespace
}  // namespace canyon::simulation
