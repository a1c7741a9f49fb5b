#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/paths/disturbance/faults/fault_timeline.hpp"
#include "canyon/paths/disturbance/faults/receiver_faults.hpp"
#include "canyon/paths/disturbance/faults/satellite_faults.hpp"

namespace canyon::disturbance {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const geodesy::GpsTime kBegin = geodesy::GpsTime::from_week(2421, 100'000);

FaultContext context(std::uint64_t seed = 1) {
  FaultContext context;
  context.name = "fault";
  context.begin = kBegin;
  context.seed = seed;
  context.receiver = "rover";
  return context;
}

propagation::Arrival two_satellites() {
  propagation::Arrival arrival;
  for (const int number : {5, 7}) {
    propagation::SatelliteView view;
    view.line.id = {gnss::System::GPS, static_cast<std::uint8_t>(number)};
    view.line.azimuth_rad = geodesy::radians(number == 5 ? 10 : 190);
    view.line.elevation_rad = geodesy::radians(30);
    view.paths.paths.emplace_back();
    arrival.views.push_back(view);
  }
  return arrival;
}

propagation::Antenna antenna(double seconds) {
  propagation::Antenna antenna;
  antenna.time = kBegin + seconds;
  return antenna;
}

std::string fault_of(const std::string& text) {
  try {
    (void)parse_fault(text, "command", 0, 1);
  } catch (const InputError& error) {
    EXPECT_NE(error.hint(), "") << error.what();
    return error.what();
  }
  ADD_FAILURE() << "no InputError: " << text;
  return {};
}

TEST(FaultKinds, EachHasAnExampleThatParsesKeysAndAWayBack) {
  std::set<std::string_view> names;
  for (const FaultKind& kind : fault_kinds()) {
    EXPECT_TRUE(names.insert(kind.name).second) << kind.name;
    EXPECT_FALSE(kind.summary.empty());
    EXPECT_EQ(fault_kind_named(kind.name).name, kind.name);
    const Fault fault = parse_fault(std::string(kind.example), "example", 0, 1);
    EXPECT_EQ(fault.kind, &kind) << kind.example;
    EXPECT_EQ(fault.name, fmt::format("{} 1", kind.name));
    EXPECT_FALSE(description(kind).keys.empty());
    for (const options::Key& key : description(kind).keys) EXPECT_NE(key.meaning, "") << key.path;
    const Fault again = parse_fault(options::yaml(fault), "again", 0, 1);
    EXPECT_EQ(options::exact_text(again), options::exact_text(fault));
  }
}

TEST(Faults, TellFileLineAndCure) {
  EXPECT_THAT(fault_of("from_s: 3\nuntil_s: 2\noutage: {}"),
              HasSubstr("command:2: until_s: the end at 2 s is not after the start at 3 s"));
  EXPECT_THAT(fault_of("outage: {}\nclock: {}"), HasSubstr("command:2: clock: conflicts with 'outage'"));
  EXPECT_THAT(fault_of("from_s: 3"), HasSubstr("give the section of its kind"));
  EXPECT_THAT(fault_of("outage:\n  satellites: [G05, X3]"),
              HasSubstr("command:2: satellites: 'X3' is not a satellite"));
  EXPECT_THAT(fault_of("outage: {satellites: G40}"), HasSubstr("'G40' is not a satellite"));
  EXPECT_THAT(fault_of("time: {}"), HasSubstr("nothing is wrong with the date"));
  EXPECT_THAT(fault_of("force: {}"), HasSubstr("give fix: none, single, differential, float or fixed"));
  EXPECT_THAT(fault_of("outtage: {}"), HasSubstr("did you mean 'outage'?"));
  EXPECT_THAT(fault_of("{name: 'a;b', outage: {}}"), HasSubstr("cannot be used in tables"));
  EXPECT_THAT(fault_of("antenna: {period_s: 1, on_s: 2}"), HasSubstr("on_s is longer than period_s"));
  EXPECT_EQ(parse_fault(R"({"from_s": 2, "duration_s": 3, "outage": {"satellites": ["G05"]}})", "json", 0, 1)
                .until_s,
            5.0);
}

TEST(FaultTimeline, EffectsActFromBeginToEndAndChangeWhileTheyRun) {
  const auto plan = std::make_shared<FaultTimeline>(
      kBegin,
      std::vector<Fault>{
          parse_fault("{name: a, from_s: 1, until_s: 3, outage: {satellites: G05}}", "f", 0, 1),
          parse_fault("{name: b, receivers: [base], outage: {}}", "f", 0, 1)},
      "rover");
  const auto effects = FaultTimeline::source(plan).make(1, "");
  const auto at = [&](double seconds) {
    propagation::Arrival arrival = two_satellites();
    ReceiverEvents events;
    effects->apply(antenna(seconds), arrival);
    effects->happen(antenna(seconds), events);
    EXPECT_EQ(arrival.views[0].paths.paths.empty(), !events.faults.empty());
    return events.faults;
  };
  EXPECT_THAT(at(0.999), IsEmpty());
  EXPECT_THAT(at(1), ElementsAre("a"));
  EXPECT_THAT(at(2.999), ElementsAre("a"));
  EXPECT_THAT(at(3), IsEmpty());
  EXPECT_TRUE(plan->add(parse_fault("{outage: {}}", "f", 4, plan->next_number())));
  EXPECT_THAT(at(4), ElementsAre("outage 3"));
  EXPECT_TRUE(plan->states(4)[1].active);
  plan->end("outage 3", 4);
  EXPECT_THAT(at(4), IsEmpty());
  EXPECT_THROW(plan->end("outage 3", 4), InputError);
  EXPECT_THROW(plan->add(parse_fault("{name: a, outage: {}}", "f", 0, 1)), InputError);
}

// Clients of a running receiver cannot fill the memory.
TEST(FaultTimeline, IsBounded) {
  FaultTimeline plan(kBegin, {}, "rover");
  Fault fault = parse_fault("{outage: {}}", "f", 0, 1);
  for (int i = 0; i < 10'000; ++i) {
    fault.name = std::to_string(i);
    plan.add(fault);
  }
  fault.name = "one more";
  EXPECT_THROW(plan.add(fault), InputError);
}

// Raw moments of Gamma(m, 1/m): E P^k = m (m + 1) ... (m + k - 1) / m^k. The deviation of S4^2 = E P^2 - 1
// over n independent powers is by the delta method.
TEST(Scintillation, HasTheS4ThatIsAskedForAndSoManyFades) {
  for (const double s4 : {0.3, 0.7, 1.0}) {
    ScintillationOptions options;
    options.s4 = s4;
    options.correlation_s = 0.1;
    Scintillation storm(options, context());
    constexpr int kCount = 20'000;
    double sum = 0, squares = 0;
    int faded = 0;
    for (int i = 0; i < kCount; ++i) {
      propagation::Arrival arrival = two_satellites();
      storm.apply(antenna(i), arrival);  // ten times the correlation: independent
      const double power = std::pow(arrival.views[0].paths.paths[0].amplitude_factor, 2);
      sum += power;
      squares += power * power;
      if (power < 0.1) ++faded;
    }
    const double m = 1 / (s4 * s4);
    double moments[5]{1};
    for (int k = 1; k < 5; ++k) moments[k] = moments[k - 1] * (m + k - 1) / m;
    const double mean = sum / kCount, measured = squares / kCount / (mean * mean) - 1;
    const double b = moments[2];
    const double variance = (moments[4] - b * b) - 4 * b * (moments[3] - b) + 4 * b * b * (b - 1);
    EXPECT_NEAR(mean, 1, 4 * s4 / std::sqrt(kCount)) << s4;
    EXPECT_NEAR(measured, s4 * s4, 4 * std::sqrt(variance / kCount)) << s4;
    if (s4 == 1.0) {
      // Rayleigh: 1 - exp(-0.1).
      EXPECT_NEAR(faded, kCount * 0.09516, 4 * std::sqrt(kCount * 0.09516 * 0.90484));
    }
  }
}

// The process's own autocorrelation (1 + t/T) exp(-t/T): 2/e at T; its rate has the deviation sigma/T.
TEST(Scintillation, PhaseHasItsDeviationCorrelationAndRate) {
  ScintillationOptions options;
  options.sigma_phi_rad = 0.6;
  options.phase_correlation_s = 2;
  Scintillation storm(options, context());
  constexpr int kCount = 20'000;
  double squares = 0, rates = 0, products = 0;
  for (int i = 0; i < kCount; ++i) {
    // Pairs T apart, 20 T between pairs.
    propagation::Arrival first = two_satellites(), second = two_satellites();
    storm.apply(antenna(40.0 * i), first);
    storm.apply(antenna(40.0 * i + 2), second);
    squares += std::pow(first.views[0].carrier_phase_offset_rad, 2);
    rates += std::pow(first.views[0].carrier_phase_rate_radps, 2);
    products += first.views[0].carrier_phase_offset_rad * second.views[0].carrier_phase_offset_rad;
  }
  const double variance = 0.36, sampling = 4 * std::sqrt(2.0 / kCount);
  EXPECT_NEAR(squares / kCount, variance, variance * sampling);
  EXPECT_NEAR(rates / kCount, variance / 4, variance / 4 * sampling);
  EXPECT_NEAR(products / kCount, variance * 2 / std::exp(1), variance * sampling);
}

TEST(Scintillation, SatellitesAndSeedsDifferAndRepeat) {
  const auto first = [](std::uint64_t seed) {
    Scintillation storm({}, context(seed));
    propagation::Arrival arrival = two_satellites();
    storm.apply(antenna(0), arrival);
    return std::pair(arrival.views[0].paths.paths[0].amplitude_factor,
                     arrival.views[1].paths.paths[0].amplitude_factor);
  };
  EXPECT_EQ(first(1), first(1));
  EXPECT_NE(first(1), first(2));
  EXPECT_NE(first(1).first, first(1).second);
}

// A Gauss-Markov process has the reported deviation at any time, and a correlation of 1/e after 60 s.
TEST(ForceFault, IsAsFarOffAsItStates) {
  ForceOptions options;
  options.fix = gnss::FixKind::Float;
  options.vertical_m = 2;
  constexpr int kCount = 4000;
  Eigen::Vector3d squares = Eigen::Vector3d::Zero(), products = Eigen::Vector3d::Zero();
  ForceFault fault(options, context());
  for (int i = 0; i < kCount; ++i) {
    ReceiverEvents events, later;
    fault.happen(antenna(2000.0 * i), events);
    fault.happen(antenna(2000.0 * i + 60), later);
    EXPECT_EQ(events.forced->kind, gnss::FixKind::Float);
    squares += events.forced->error_m.cwiseAbs2();
    products += events.forced->error_m.cwiseProduct(later.forced->error_m);
    EXPECT_EQ(events.forced->sigma_m, later.forced->sigma_m);
  }
  const Eigen::Vector3d variance(0.04, 0.04, 4);
  const double sampling = 4 * std::sqrt(2.0 / kCount);
  for (Eigen::Index i = 0; i < 3; ++i) {
    EXPECT_NEAR(squares[i] / kCount, variance[i], variance[i] * sampling);
    EXPECT_NEAR(products[i] / kCount, variance[i] / std::exp(1), variance[i] * sampling);
  }
}

// Friis by hand, linear: 1.41254 (1.5 dB), 1.99526 (3 dB), gain 501.187 (27 dB):
// (1.41254 + (100 * 1.99526 - 1) / 501.187) / (1.41254 + 0.99526 / 501.187) = 1.27863, 1.0674 dB.
TEST(AntennaFault, ALossBehindTheAmplifierTakesWhatFriisSays) {
  AntennaFaultOptions options;
  options.loss_db = 20;
  EXPECT_EQ(options.cn0_loss_db(), 20);
  options.stage = AntennaStage::After;
  EXPECT_NEAR(options.cn0_loss_db(), 1.0674, 1e-4);
}

TEST(AntennaFault, ShadesASectorOverNorthAndComesAndGoes) {
  AntennaFaultOptions options;
  options.azimuth_from_rad = geodesy::radians(300);
  options.azimuth_to_rad = geodesy::radians(20);
  options.loss_db = 6;
  options.period_s = 10;
  options.on_s = 4;
  AntennaFault fault(options, context());
  const auto at = [&](double seconds) {
    propagation::Arrival arrival = two_satellites();
    arrival.interference.resize(2);
    arrival.interference[0].arrival = Eigen::Vector3d::UnitY();  // north
    arrival.interference[1].arrival = Eigen::Vector3d::UnitX();
    fault.apply(antenna(seconds), arrival);
    EXPECT_NEAR(arrival.interference[0].power_dbw - arrival.interference[1].power_dbw,
                20 * std::log10(arrival.views[0].paths.paths[0].amplitude_factor), 1e-12)
        << "what jams from there falls alike";
    EXPECT_EQ(arrival.views[1].paths.paths[0].amplitude_factor, 1) << "190 deg is outside";
    return arrival.views[0].paths.paths[0].amplitude_factor;
  };
  EXPECT_NEAR(at(3.9), std::pow(10, -6.0 / 20), 1e-12);
  EXPECT_EQ(at(4), 1);
  EXPECT_NEAR(at(10), std::pow(10, -6.0 / 20), 1e-12);
}

}  // namespace
}  // namespace canyon::disturbance
