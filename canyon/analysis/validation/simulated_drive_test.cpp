// Canyon's own recording, written as RINEX, read back and compared: recovers the simulated errors.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <map>

#include "canyon/analysis/validation/pseudorange_errors.hpp"
#include "canyon/analysis/validation/receiver_clock.hpp"
#include "canyon/analysis/validation/statistics.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/outputs/encoding/stream.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"
#include "tests/integration/run_scenario.hpp"
#include "tests/support/source_dir.hpp"

namespace canyon::validation {
namespace {

TEST(SimulatedDrive, ErrorsComeBackThroughRinex) {
  // The example by a receiver without noise: the error of a pseudorange is its excess path.
  std::string yaml(
      TextFile(std::filesystem::path(canyon_source_dir) / "examples/synthetic_drive.yaml").text());
  const std::string receiver = "- name: car";
  ASSERT_NE(yaml.find(receiver), std::string::npos);
  yaml.replace(yaml.find(receiver), receiver.size(),
               "- name: car\n    profile: ideal\n    elevation_mask_deg: 10");
  const test::TemporaryFolder folder;
  const auto simulation = test::prepare(yaml, folder.path());
  test::Recorder recorder;
  const auto path = folder / "car.obs";
  const auto rinex =
      encoding::open_file("rinex_observation", path, 0, encoding::describe_receiver(simulation, 0));
  simulation.run({&recorder, rinex.get()});

  using Key = std::pair<geodesy::GpsTime, gnss::SatelliteId>;
  std::map<Key, const receiver::SatelliteObservation*> simulated;
  std::vector<std::pair<geodesy::GpsTime, geodesy::Geodetic>> truth;
  for (const simulation::Epoch& e : recorder.epochs) {
    truth.emplace_back(e.observed.time, geodesy::geodetic_from_ecef(e.truth_ecef));
    for (const auto& s : e.observed.satellites) simulated[{e.observed.time, s.id}] = &s;
  }
  const auto file = rinex::read_rinex_observations(path);
  EXPECT_EQ(file.report.notes.losses(), 0U);
  ResidualOptions options;
  options.ionosphere = options.troposphere = false;  // as the example's signals
  const auto residuals = pseudorange_residuals(file.epochs, simulation::Trajectory(truth),
                                               simulation.environment().sky(), {}, options);
  // Reception times are recovered within a microsecond: the epoch is the closest one.
  const auto of = [&](const PseudorangeResidual& o, const ResidualEpoch& epoch) {
    const auto at = simulated.lower_bound({epoch.reception - 1e-3, o.id});
    for (auto i = at; i != simulated.end(); ++i) {
      if (i->first.second == o.id) return i->second;
    }
    return static_cast<const receiver::SatelliteObservation*>(nullptr);
  };
  const auto errors = remove_receiver_clock(residuals, [&](const auto& o, const auto& epoch) {
    const auto* s = of(o, epoch);
    return s != nullptr && s->visibility == propagation::Visibility::LOS;
  });
  std::vector<double> difference;
  std::size_t nlos = 0;
  for (std::size_t i = 0; i < errors.observations.size(); ++i) {
    const PseudorangeResidual& o = residuals.observations[i];
    if (errors.clocks[o.epoch].source != ClockSource::Clear) continue;
    const auto* s = of(o, residuals.epochs[o.epoch]);
    ASSERT_NE(s, nullptr);
    nlos += s->visibility == propagation::Visibility::NLOS ? 1 : 0;
    difference.push_back(std::abs(errors.observations[i].error_m - s->pseudorange_error_m));
  }
  const double half = median(difference).value(), worst = quantile(difference, 1).value();
  std::printf("%zu pseudoranges, %zu NLOS: errors differ by %.2g m in the median, %.2g m at most\n",
              difference.size(), nlos, half, worst);
  EXPECT_GT(difference.size(), 2000U);
  EXPECT_GT(nlos, 300U);
  // RINEX has millimetres, and the receiver's clock has an error of 0.5 mm if one satellite determines it.
  EXPECT_LT(half, 1e-3);
  EXPECT_LT(worst, 2e-3);
}

}  // namespace
}  // namespace canyon::validation
