// Errors of published fixes compared with their reported accuracy.

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "canyon/base/text_file.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/integration/run_scenario.hpp"
#include "tests/support/source_dir.hpp"

namespace canyon {
namespace {

/// Counts of fixes, and of errors of at most twice the reported deviation, horizontally and vertically.
struct Within {
  int fixes = 0, horizontal = 0, vertical = 0;

  /// Adds the fixes of a scenario, every `step`-th epoch.
  void add(const std::string& yaml, std::uint64_t seed, std::size_t step) {
    const test::TemporaryFolder folder;
    simulation::Simulation simulation =
        test::prepare(yaml + "\nseed: " + std::to_string(seed), folder.path());
    test::Recorder recorder;
    simulation.run({&recorder});
    for (std::size_t i = 0; i < recorder.epochs.size(); i += step) {
      const simulation::Epoch& epoch = recorder.epochs[i];
      const positioning::Fix& fix = epoch.observed.fix;
      if (!fix.solved()) continue;
      const Eigen::Vector3d error = geodesy::enu_from_ecef_rotation(epoch.truth.position) *
                                    (fix.position_ecef - geodesy::ecef_from_geodetic(epoch.truth.position));
      const Eigen::Vector3d variance = fix.covariance_enu.diagonal();
      ++fixes;
      horizontal += error.head<2>().norm() <= 2 * std::sqrt(variance.head<2>().sum()) ? 1 : 0;
      vertical += std::abs(error.z()) <= 2 * std::sqrt(variance.z()) ? 1 : 0;
    }
  }
  void expect_at_least(double fraction) const {
    ASSERT_GT(fixes, 50);
    EXPECT_GE(horizontal, fraction * fixes) << fixes;
    EXPECT_GE(vertical, fraction * fixes) << fixes;
  }
};

// Different range errors with each seed. They last longer than a minute, so each seed yields one independent
// result.
TEST(ReportedAccuracy, HoldsUnderAnOpenSky) {
  Within within;
  for (std::uint64_t seed = 1; seed <= 12; ++seed) {
    within.add(R"(
city: {open: true, origin: {latitude_deg: 48.1, longitude_deg: 11.6, height_m: 500}}
sky: {nominal: true}
start: 2026-06-01T08:00:00Z
trajectory: {waypoints: [{east_m: 0, north_m: 0}, {east_m: 400, north_m: 100}], speed_mps: 7, height_above_terrain_m: 1.5}
receivers: [{name: a}]
)",
               seed, 10);
  }
  within.expect_at_least(0.9);
}

// The drive of `canyon demo`, with three seeds.
TEST(ReportedAccuracy, HoldsInStreets) {
  const TextFile file(std::filesystem::path(canyon_source_dir) / "examples/synthetic_drive.yaml");
  std::string yaml(file.text());
  yaml.erase(yaml.rfind("seed: 1"));
  Within within;
  for (std::uint64_t seed = 1; seed <= 3; ++seed) within.add(yaml, seed, 1);
  within.expect_at_least(0.8);
}

}  // namespace
}  // namespace canyon
