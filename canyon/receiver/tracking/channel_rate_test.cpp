#include "canyon/receiver/tracking/channel_fading.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/signal_scene.hpp"

namespace canyon::tracking {
namespace {

using namespace canyon::test;

/// Geometric range plus the detour over a fixed point [m] of a satellite at kTime + t; the antenna passes
/// `start` (ENU). The last leg and the difference of the two ranges are exact, not of a plane wave.
struct PathPair {
  orbit::LineOfSight line;
  Eigen::Vector3d antenna;
  double direct_m = 0, over_point_m = 0;
};
PathPair routes(gnss::SatelliteId id, double t, const Eigen::Vector3d& velocity,
                const Eigen::Vector3d& point) {
  PathPair result;
  result.antenna = Eigen::Vector3d(3, 4, 2) + t * velocity;
  result.line = *orbit::line_of_sight(four_systems(), id, kTime + t, kFrame.ecef_from_local(result.antenna));
  result.direct_m = result.line.range_m;
  result.over_point_m =
      (point - result.antenna).norm() +
      orbit::line_of_sight(four_systems(), id, kTime + t, kFrame.ecef_from_local(point))->range_m;
  return result;
}

// Edges and rough facades: central differences of ranges over a point of them. The spherical wave's range
// differs from the plane wave's by d^2 / 2 r, whose rate is below 1e-5 m/s here.
TEST(PathRate, OfAPointAtRestIsTheRateOfItsRange) {
  const Eigen::Vector3d velocity(12, -7, 1);
  double worst = 0;
  int compared = 0;
  for (const SatelliteView& view : open_sky(four_systems(), kTime, kFrame.ecef_from_local({3, 4, 2}))) {
    for (const Eigen::Vector3d& point :
         {Eigen::Vector3d(40, 10, 25), Eigen::Vector3d(-120, 60, 3), Eigen::Vector3d(4, 30, 60)}) {
      for (const PathKind kind : {PathKind::Diffracted, PathKind::Diffuse}) {
        constexpr double kStep = 0.01;  // a point 26 m away: r''' h^2 / 6 is 7e-5 m/s
        const PathPair before = routes(view.line.id, -kStep, velocity, point);
        const PathPair now = routes(view.line.id, 0, velocity, point);
        const PathPair after = routes(view.line.id, kStep, velocity, point);
        Path path;
        path.kind = kind;
        path.arrival = (point - now.antenna).normalized();
        path.excess_m = now.over_point_m - now.direct_m;
        const double rate = path_rate_mps(now.line, kEcefFromEnu * velocity, path, kEcefFromEnu);
        const double difference = (after.over_point_m - before.over_point_m) / (2 * kStep);
        worst = std::max(worst, std::abs(rate - difference));
        ++compared;
      }
    }
  }
  EXPECT_GT(compared, 100);
  EXPECT_LT(worst, 1e-3);
  std::printf("rate over a point at rest: within %.1e m/s of differences\n", worst);
}

TEST(PathRate, ShowsWhatLeadsOnARoughFacade) {
  const Eigen::Vector3d velocity(12, -7, 0), scattering_offset(0.1, 0.2, -0.05);
  const orbit::LineOfSight line =
      open_sky(four_systems(), kTime, kFrame.ecef_from_local({3, 4, 2})).front().line;
  Path path;
  path.kind = PathKind::Reflected;
  path.arrival = Eigen::Vector3d(1, 2, 1).normalized();
  const auto rate = [&](const Eigen::Vector3d& v) {
    return path_rate_mps(line, kEcefFromEnu * v, path, kEcefFromEnu);
  };
  const double ideal = rate(velocity), at_rest = rate(Eigen::Vector3d::Zero());
  path.scattering_offset = scattering_offset;
  EXPECT_NEAR(rate(velocity) - ideal, -velocity.dot(scattering_offset), 1e-4);
  EXPECT_EQ(rate(Eigen::Vector3d::Zero()), at_rest);
}

}  // namespace
}  // namespace canyon::tracking
