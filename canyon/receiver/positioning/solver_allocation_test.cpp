// The fix and the position filter allocate only the vectors and maps of their results.

#include <gtest/gtest.h>

#include "canyon/receiver/positioning/position_filter.hpp"
#include "canyon/receiver/positioning/pseudorange_model.hpp"
#include "tests/support/circular_sky.hpp"
#include "tests/support/count_allocations.hpp"
#include "tests/support/test_drive.hpp"

#ifdef CANYON_COUNTS_ALLOCATIONS

namespace canyon::positioning {
namespace {

using test::allocations;

long allocations_of_copy(const Fix& fix) {
  const long before = allocations;
  const Fix copy = fix;
  EXPECT_EQ(copy.used, fix.used);
  return allocations - before;
}

TEST(Solvers, AllocateTheirAnswersAlone) {
  const test::CircularSky sky({gnss::System::GPS, gnss::System::Galileo});
  test::TestDrive drive(sky, test::CircularSky::kEpoch + std::chrono::hours(5),
                        geodesy::Geodetic::from_degrees(22.3, 114.18, 30), 1);
  drive.doppler = true;
  FixOptions options;
  options.raim.enabled = options.covariance_by_residuals = true;
  PositionFilter filter({}, options);
  Eigen::Vector3d start = drive.position();
  std::vector<RangedSatellite> satellites;
  for (int epoch = 0; epoch < 60; ++epoch, drive.advance(0.1)) {
    const geodesy::GpsTime time = drive.receiver_time();
    const std::vector<Measurement> measurements = drive.measure();
    range_satellites(time, measurements, sky, options, satellites);
    const long before = allocations;
    const Fix fix = solve_fix(time, satellites, options, {}, start);
    const long fix_baseline = allocations - before;
    const Fix filtered = filter.update(time, satellites, fix, {});
    const long filter_allocations = allocations - before - fix_baseline;
    ASSERT_TRUE(fix.solved() && filtered.solved()) << epoch << reason(fix.status);
    start = fix.position_ecef;
    if (epoch < 10) continue;
    EXPECT_EQ(fix_baseline, allocations_of_copy(fix)) << epoch;
    EXPECT_EQ(filter_allocations, allocations_of_copy(filtered)) << epoch;
  }
}

}  // namespace
}  // namespace canyon::positioning

#endif
