#include "canyon/study/drives.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/base/random.hpp"
#include "canyon/geodesy/constants.hpp"

namespace canyon::study {
namespace {

using Eigen::Vector3d;

constexpr int kMostStarts = 2000;
constexpr int kWays = 8;
constexpr std::array kLegs_m{150.0, 100.0, 70.0, 45.0, 25.0};
constexpr double kMargin_m = 3;
constexpr double kShareOfBounds = 0.8;

class Driver {
 public:
  Driver(const simulation::CityScene& scene, const DriveOptions& options, std::uint64_t seed,
         const std::string& number)
      : scene_(scene), options_(options), random_(seed, "study drive " + number), box_(scene.city.bounds()) {}

  /// Corners in the city's frame; empty where the way ended early.
  std::vector<Vector3d> drive() {
    const auto start = begin();
    if (!start) return {};
    std::vector<Vector3d> corners{*start};
    double driven_m = 0, heading = 2 * geodesy::kPi * random_.uniform();
    while (driven_m < options_.length_m) {
      const auto next = leg(corners, heading);
      if (!next) return {};
      Vector3d end = *next;
      const double length_m = (end - corners.back()).norm(), left_m = options_.length_m - driven_m;
      if (length_m > left_m) end = corners.back() + (end - corners.back()) * (left_m / length_m);
      driven_m += length_m;
      heading = std::atan2(end.y() - corners.back().y(), end.x() - corners.back().x());
      corners.push_back(end);
    }
    return corners;
  }

 private:
  [[nodiscard]] std::optional<Vector3d> on_terrain(double x, double y) const {
    const auto height = scene_.scene.terrain_height(x, y);
    if (!height) return std::nullopt;
    return Vector3d(x, y, *height + options_.height_m);
  }

  std::optional<Vector3d> begin() {
    const Vector3d middle = 0.5 * (box_.min + box_.max), half = 0.5 * kShareOfBounds * (box_.max - box_.min);
    const double x = middle.x() + (2 * random_.uniform() - 1) * half.x();
    const double y = middle.y() + (2 * random_.uniform() - 1) * half.y();
    const auto at = on_terrain(x, y);
    if (!at || scene_.scene.placement(*at) != raytrace::Placement::Free) return std::nullopt;
    return at;
  }

  [[nodiscard]] bool free(const Vector3d& from, const Vector3d& to, double further_m) const {
    const Vector3d way = to - from;
    const double length = way.norm();
    return length > 0 && !scene_.scene.occluded({from, way / length, length + further_m},
                                                scene_.scene.surface_offset_m(from));
  }

  /// The end of the next leg: the longest of the ways drawn, of equals the first.
  std::optional<Vector3d> leg(const std::vector<Vector3d>& corners, double heading) {
    const Vector3d& from = corners.back();
    std::optional<Vector3d> best;
    double best_m = 0;
    for (int way = 0; way < kWays; ++way) {
      // The first ways go ahead and aside, the last two anywhere.
      const double reach = way < kWays - 2 || corners.size() == 1 ? 0.67 * geodesy::kPi : geodesy::kPi;
      const double to = heading + (2 * random_.uniform() - 1) * reach;
      for (const double length_m : kLegs_m) {
        if (length_m <= best_m) break;
        const auto end = on_terrain(from.x() + length_m * std::cos(to), from.y() + length_m * std::sin(to));
        if (!end || !(box_.min.head<2>().array() <= end->head<2>().array()).all() ||
            !(end->head<2>().array() <= box_.max.head<2>().array()).all() || !free(from, *end, kMargin_m) ||
            !clears_corner(corners, *end) || scene_.scene.placement(*end) != raytrace::Placement::Free) {
          continue;
        }
        best = end;
        best_m = length_m;
        break;
      }
      if (best && way >= 3) break;
    }
    return best;
  }

  /// The arc of a smooth drive lies between the corner and this chord.
  [[nodiscard]] bool clears_corner(const std::vector<Vector3d>& corners, const Vector3d& end) const {
    if (corners.size() < 2) return true;
    const Vector3d& at = corners.back();
    const Vector3d& before = corners[corners.size() - 2];
    const double cut_m = 0.45 * std::min((at - before).norm(), (end - at).norm());
    return free(at + cut_m * (before - at).normalized(), at + cut_m * (end - at).normalized(), 0);
  }

  const simulation::CityScene& scene_;
  const DriveOptions& options_;
  RandomStream random_;
  city::Box box_;
};

}  // namespace

simulation::TrajectoryConfig random_drive(const simulation::CityScene& scene, const DriveOptions& options,
                                          std::uint64_t seed, const std::string& number) {
  if (scene.city.mesh.triangles.empty()) {
    throw InputError("drives are drawn between buildings, and the city has none",
                     "give trajectories instead");
  }
  Driver driver(scene, options, seed, number);
  for (int i = 0; i < kMostStarts; ++i) {
    const std::vector<Vector3d> corners = driver.drive();
    if (corners.empty()) continue;
    simulation::TrajectoryConfig way;
    for (const Vector3d& corner : corners)
      way.waypoints.push_back(scene.city.frame.geodetic_from_local(corner));
    way.speed_mps = options.speed_mps;
    way.acceleration_mps2 = options.acceleration_mps2;
    way.height_above_terrain_m = options.height_m;
    return way;
  }
  throw InputError(
      fmt::format("no drive of {} m was found in the city '{}'", options.length_m, scene.city.name),
      "ask for shorter ones, or for a city with terrain and streets");
}

}  // namespace canyon::study
