#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <fstream>
#include <sstream>

#include "canyon/analysis/heatmap/engine/map_source.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "tests/support/program.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::heatmap {
namespace {

/// gdaltransform (PROJ) converts WGS 84 positions at the origin's height to the plane; the largest distance
/// from their x and y in the frame [m], on rings of `radius` [m] around the origin.
double largest_distance(const geodesy::LocalFrame& frame, double radius) {
  const test::TemporaryFolder folder;
  std::vector<Eigen::Vector2d> wanted;
  {
    std::ofstream points(folder / "points");
    for (int i = 0; i < 72; ++i) {
      const double angle = geodesy::radians(5.0 * i);
      // A point of the ring, moved to the origin's height along its plumb line.
      geodesy::Geodetic position =
          frame.geodetic_from_local({radius * std::cos(angle), radius * std::sin(angle), 0});
      position.height_m = frame.origin().height_m;
      wanted.push_back(frame.local_from_geodetic(position).head<2>());
      points << fmt::format("{:.13f} {:.13f}\n", geodesy::degrees(position.longitude_rad),
                            geodesy::degrees(position.latitude_rad));
    }
  }
  const std::string text =
      test::run_program(
          fmt::format("gdaltransform -output_xy -s_srs '+proj=longlat +datum=WGS84 +no_defs' -t_srs "
                      "'{}' < '{}' 2>&1",
                      projection(frame), (folder / "points").string()))
          .output;
  std::istringstream lines(text);
  double worst = 0;
  for (const Eigen::Vector2d& position : wanted) {
    Eigen::Vector2d found(1e9, 1e9);
    lines >> found.x() >> found.y();
    worst = std::max(worst, (found - position).norm());
  }
  return worst;
}

TEST(MapPlane, WithinMillimetresOfTheFrame) {
  CANYON_NEEDS_PROGRAM("gdaltransform");
  for (const double heading_deg : {0.0, 30.0, -120.0}) {
    for (const double latitude_deg : {0.0, -35.0, 85.0}) {
      for (const double height_m : {0.0, 1500.0}) {
        const geodesy::LocalFrame frame(geodesy::Geodetic::from_degrees(latitude_deg, 114.17, height_m),
                                        geodesy::radians(heading_deg));
        const std::string what = fmt::format("{} {} {}", heading_deg, latitude_deg, height_m);
        EXPECT_LT(largest_distance(frame, 10'000), 0.009 + 6e-6 * height_m) << what;
        EXPECT_LT(largest_distance(frame, 2'000), 0.001 + 1.2e-6 * height_m) << what;
      }
    }
  }
}

TEST(MapPlane, ScaleIsThatOfTheOriginsHeight) {
  // M = a (1 - e^2) = 6335439.327, N = a at the equator; both a^2 / b = 6399593.626 at the pole (Snyder
  // 1987).
  const auto at = [](double latitude_deg, double height_m) {
    return projection_scale(geodesy::LocalFrame(geodesy::Geodetic::from_degrees(latitude_deg, 0, height_m)));
  };
  EXPECT_EQ(at(22.3, 0), 1);
  EXPECT_NEAR(at(0, 1000), 1 + 1000 / std::sqrt(6335439.327 * 6378137.0), 1e-12);
  EXPECT_NEAR(at(90, 1000), 1 + 1000 / 6399593.626, 1e-12);
}

TEST(MapPlane, StringHoldsTheOriginToTenthsOfAMicrometre) {
  const geodesy::LocalFrame frame(geodesy::Geodetic::from_degrees(22.298718652, 114.1701234567891, 0));
  EXPECT_EQ(projection(frame),
            "+proj=tmerc +lat_0=22.298718652000 +lon_0=114.170123456789 +k=1.000000000000 +x_0=0 +y_0=0 "
            "+datum=WGS84 +units=m +no_defs");
}

}  // namespace
}  // namespace canyon::heatmap
