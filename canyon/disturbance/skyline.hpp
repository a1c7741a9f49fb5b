#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <limits>
#include <vector>

#include "canyon/disturbance/shadowing_options.hpp"
#include "canyon/geodesy/gps_time.hpp"

namespace canyon::disturbance {

/// Skyline of the obstacles that a map lacks, about one antenna: in each azimuth one obstacle or none, with
/// a height, a distance and a kind. It is a field over places, fixed in the world: a second pass and other
/// receivers meet the same obstacles. SkylineNumbers has the distributions.
///
/// Normal numbers stand at nodes of azimuth, each with a square lattice of places. A place blends the four
/// nodes about it, an azimuth the two beside it, with weights of unit norm, so that every number is normal
/// with unit variance. A part of the variance changes with time, for traffic.
class Skyline {
 public:
  /// Obstacles of skyline_numbers(). Throws InputError where SkylineOptions::validate() does.
  Skyline(const ShadowingOptions& options, std::uint64_t seed);

  /// Whether there are no obstacles.
  [[nodiscard]] bool empty() const { return numbers_.share == 0; }
  /// Moves the antenna. Calls may come in any order of time and place.
  /// @param place east, north in the city's frame [m]; @param height_m of the antenna above the ground [m]
  void go_to(const Eigen::Vector2d& place, double height_m, geodesy::GpsTime time);
  /// The level that the obstacles leave of a path at the place of the last go_to() [dB], at most 0.
  /// @param arrival direction that the path comes from: unit, ENU; below the horizon as above it
  /// @param leg_m from the antenna to the surface that the path comes from: obstacles behind it do not count,
  /// but for the ground's reflection, which comes from below the horizon. Infinite for direct paths
  [[nodiscard]] double level_db(const Eigen::Vector3d& arrival,
                                double leg_m = std::numeric_limits<double>::infinity()) const;
  /// Elevation of the obstacle's top in an azimuth (clockwise from north) [rad], [0, pi/2); 0 without one.
  [[nodiscard]] double top_rad(double azimuth_rad) const;

 private:
  struct Obstacle {
    double slope;  ///< tangent of its top's elevation; at most 0: none
    double distance_m;
    bool foliage;
  };
  [[nodiscard]] Obstacle obstacle(double azimuth_rad) const;
  /// A number of unit variance at the antenna's place, in an azimuth node. @param slot of time
  [[nodiscard]] double number(std::uint64_t field, std::size_t node, std::int64_t slot) const;

  SkylineNumbers numbers_;
  std::uint64_t root_;
  Eigen::Vector2d place_ = Eigen::Vector2d::Zero();
  double height_m_ = 0;
  /// The numbers of an azimuth node.
  struct Node {
    double height, distance, kind;
  };
  std::vector<Node> nodes_;
};

}  // namespace canyon::disturbance
