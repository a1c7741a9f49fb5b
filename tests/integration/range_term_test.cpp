// A term of the table of range terms, here the troposphere, appears in tables, virtual stations, maps and
// samples.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <string>

#include "canyon/analysis/heatmap/engine/engine.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/outputs/encoding/columns.hpp"
#include "canyon/receiver/positioning/range_terms.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/correction_links.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/samples/generator.hpp"
#include "canyon/simulation/samples/path_interpolator.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/sky/range_errors.hpp"
#include "tests/integration/run_scenario.hpp"
#include "tests/support/circular_sky.hpp"

namespace canyon::range_term_test {
namespace {

using receiver::CodeAndCarrier;
using simulation::Epoch;

constexpr const char* kScenario = R"(
city: {open: true, origin: {latitude_deg: 22.3, longitude_deg: 114.17}}
sky: {nominal: true, errors: {enabled: true}}
start: 2026-06-01T06:00:00Z
duration_s: 1
trajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2}]}
receivers: [{name: car, profile: ublox-f9p}]
)";

/// kScenario with other options of its receiver.
std::string scenario_with(const std::string& options) {
  std::string text = kScenario;
  text.replace(text.find("ublox-f9p"), 9, "ublox-f9p" + options);
  return text;
}

/// The true delay of a satellite's signal at a position.
double troposphere_m(const Epoch& epoch, gnss::SatelliteId id, const Eigen::Vector3d& ecef) {
  const auto line = orbit::line_of_sight(epoch.environment->sky(), id, epoch.truth.time, ecef);
  const sky::RangeErrorModel& errors = *epoch.environment->errors();
  return errors.at(*line, errors.reception(epoch.truth.time, ecef)).troposphere_m;
}

/// All results of one run.
struct ReportedTerms {
  std::map<std::string, double> signal_entries, satellite_rows;  ///< pseudoranges by satellite and signal
  std::map<std::string, double> column;                          ///< troposphere_m
  std::map<std::string, double> delay_m;                         ///< true
  std::map<std::string, CodeAndCarrier> at_virtual_station;
  std::map<std::string, double> delay_there_m;
  std::vector<double> sample_codes_m, sample_carriers_m;
};

class Teller final : public simulation::EpochSink {
 public:
  Teller(const simulation::Simulation& simulation, ReportedTerms& reported)
      : reported_(reported),
        options_(simulation.scenario().receivers[0].options),
        interpolator_(samples::make_path_interpolator(options_, 1, simulation.environment().klobuchar(),
                                                      samples::FrontEnd(), 4e6)) {}

  void write(const Epoch& epoch) override {
    read(encoding::TableKind::Signals, epoch);
    read(encoding::TableKind::Satellites, epoch);
    // 100 km to the north.
    geodesy::Geodetic geodetic = epoch.truth.position;
    geodetic.latitude_rad += geodesy::radians(0.9);
    const Eigen::Vector3d there = geodesy::ecef_from_geodetic(geodetic);
    const auto moved = simulation::VirtualStation().move(epoch, there);
    ASSERT_TRUE(moved);
    for (const receiver::SatelliteObservation& satellite : moved->observed.satellites) {
      if (!satellite.measurement || !satellite.measurement->carrier_phase_cycles) continue;
      const positioning::Measurement& m = *satellite.measurement;
      const std::string name = gnss::to_string(satellite.id);
      reported_.at_virtual_station[name] = {
          m.pseudorange_m, *m.carrier_phase_cycles * geodesy::kSpeedOfLight / m.carrier_frequency_hz};
      reported_.delay_there_m[name] = troposphere_m(epoch, satellite.id, there);
    }
    if (const auto segment = interpolator_->next(epoch)) {
      for (const auto& signal : segment->signals) {
        for (const auto& path : signal.paths) {
          reported_.sample_codes_m.push_back(path.code_m.at(0));
          reported_.sample_carriers_m.push_back(path.carrier_m.at(0));
        }
      }
    }
  }
  void finish() override {}

 private:
  void read(encoding::TableKind kind, const Epoch& epoch) {
    const auto columns = encoding::table(kind).columns;
    encoding::TableRows rows(kind, options_.signal);
    rows.each(epoch, [&](const encoding::Row& row) {
      if (!row.signal->measurement) return;
      std::string name = gnss::to_string(row.satellite->id);
      const bool signal_entries = kind == encoding::TableKind::Signals;
      if (signal_entries) name += std::string(" ") + std::string(row.signal->signal->name);
      reported_.delay_m[name] = troposphere_m(epoch, row.satellite->id, epoch.truth_ecef);
      for (const encoding::Column& column : columns) {
        const std::string_view is(column.name);
        if (is == "pseudorange_m")
          (signal_entries ? reported_.signal_entries : reported_.satellite_rows)[name] = column.value(row);
        if (is == "troposphere_m") reported_.column[name] = column.value(row);
      }
    });
  }

  ReportedTerms& reported_;
  receiver::ReceiverOptions options_;
  std::unique_ptr<samples::PathInterpolator> interpolator_;
};

ReportedTerms run(const std::string& options) {
  const test::TemporaryFolder folder;
  const simulation::Simulation simulation = test::prepare(scenario_with(options), folder.path());
  ReportedTerms reported;
  Teller teller(simulation, reported);
  simulation.run({&teller}, {});
  return reported;
}

TEST(RangeTerm, ComesToTablesVirtualStationsAndSamples) {
  const ReportedTerms without = run(", troposphere: false"), with = run(", troposphere: true");
  ASSERT_GT(with.signal_entries.size(), 40U);
  ASSERT_GT(with.satellite_rows.size(), 20U);
  for (const auto of : {&ReportedTerms::signal_entries, &ReportedTerms::satellite_rows}) {
    for (const auto& [name, metres] : with.*of) {
      // A pseudorange is a double of 4e-9 m.
      EXPECT_NEAR(metres - (without.*of).at(name), with.delay_m.at(name), 1e-6) << name;
    }
  }
  for (const auto& [name, metres] : with.column) EXPECT_NEAR(metres, with.delay_m.at(name), 1e-6) << name;
  for (const auto& [name, metres] : without.column) EXPECT_EQ(metres, 0) << name;
  // The base has the term at its position; the station has the term at its own.
  ASSERT_GT(with.at_virtual_station.size(), 20U);
  double apart_m = 0;
  for (const auto& [name, range] : with.at_virtual_station) {
    const double expected_m = with.delay_there_m.at(name);
    EXPECT_NEAR(range.code - without.at_virtual_station.at(name).code, expected_m, 1e-6) << name;
    EXPECT_NEAR(range.carrier - without.at_virtual_station.at(name).carrier, expected_m, 1e-6) << name;
    apart_m = std::max(apart_m, std::abs(expected_m - with.delay_m.at(name)));
  }
  EXPECT_GT(apart_m, 1e-4);
  ASSERT_EQ(with.sample_codes_m.size(), without.sample_codes_m.size());
  ASSERT_FALSE(with.sample_codes_m.empty());
  for (std::size_t i = 0; i < with.sample_codes_m.size(); ++i) {
    const double code_m = with.sample_codes_m[i] - without.sample_codes_m[i];
    EXPECT_GT(code_m, 1);
    EXPECT_NEAR(with.sample_carriers_m[i] - without.sample_carriers_m[i], code_m, 1e-6);
  }
}

/// Maximum error of a virtual station's pseudoranges apart from geometry and satellite clocks [m].
class Mover final : public simulation::EpochSink {
 public:
  void write(const Epoch& epoch) override {
    const Eigen::Vector3d point = epoch.truth_ecef + Eigen::Vector3d(0, 0, 5e4);
    const auto moved = simulation::VirtualStation().move(epoch, point);
    const auto clean_m = [&](gnss::SatelliteId id, const Eigen::Vector3d& from) {
      const auto line = orbit::line_of_sight(epoch.environment->sky(), id, epoch.truth.time, from);
      return line->range_m - geodesy::kSpeedOfLight * line->state.clock_bias_s;
    };
    for (std::size_t i = 0; i < epoch.observed.satellites.size(); ++i) {
      const auto &base = epoch.observed.satellites[i], &there = moved->observed.satellites[i];
      if (!base.measurement || !there.measurement) continue;
      ++count;
      worst_m =
          std::max(worst_m, std::abs(there.measurement->pseudorange_m - base.measurement->pseudorange_m -
                                     clean_m(base.id, point) + clean_m(base.id, epoch.truth_ecef)));
    }
  }
  void finish() override {}
  double worst_m = 0;
  int count = 0;
};

// A base without range errors gets none at another position.
TEST(RangeTerm, AVirtualStationHasTheSwitchesOfItsBase) {
  const auto worst_m = [](const std::string& switches) {
    const test::TemporaryFolder folder;
    Mover mover;
    test::prepare(scenario_with(switches), folder.path()).run({&mover}, {});
    EXPECT_GT(mover.count, 20);
    return mover.worst_m;
  };
  EXPECT_LT(worst_m(", ionosphere: false, troposphere: false, orbit_errors: false"), 1e-6);
  EXPECT_GT(worst_m(""), 0.01);
}

TEST(RangeTerm, ComesToMaps) {
  const simulation::Environment open(city::City(),
                                     std::make_shared<test::CircularSky>(std::vector{gnss::System::GPS}));
  heatmap::Request request;
  request.grid = heatmap::Grid::covering(0, 0, 4, 2, 2);
  request.times = {test::CircularSky::kEpoch + std::chrono::hours(5)};
  request.layers = {heatmap::Layer::VerticalError};
  const auto up_m = [&](bool delayed, bool corrected) {
    simulation::ReceiverConfig receiver;
    receiver.options.troposphere = delayed;
    receiver.options.fix.correct_troposphere = corrected;
    return heatmap::Heatmap(open, receiver, request, "").compute(0).values[0];
  };
  // A delay that grows towards the horizon raises the position.
  EXPECT_GT(up_m(true, false) - up_m(false, false), 1);
  EXPECT_NEAR(up_m(true, true), up_m(false, false), 1e-4);
}

}  // namespace
}  // namespace canyon::range_term_test
