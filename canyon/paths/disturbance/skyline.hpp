#pragma once

#include <Eigen/Core>
#include <bit>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>
#include <vector>

#include "canyon/base/random.hpp"
#include "canyon/paths/disturbance/shadowing_options.hpp"

namespace canyon::disturbance {

/// Obstacles on the ground that a map lacks, around one antenna: in each azimuth one or none, with a height
/// and a distance. It is a field over positions, fixed in the world: a second pass and other receivers get
/// the same obstacles. SkylineOptions has the distributions.
///
/// Normal numbers are at nodes of azimuth, each with a square lattice of points. A position blends the four
/// nearest lattice points, an azimuth the two nearest nodes, with weights of unit norm, so that every number
/// is normal with unit variance.
class Skyline {
 public:
  /// Obstacles of skyline_numbers(). Throws InputError if SkylineOptions::validate() does.
  Skyline(const ShadowingOptions& options, std::uint64_t seed);

  /// True if there are no obstacles.
  [[nodiscard]] bool empty() const { return *numbers_.fraction == 0; }
  /// Moves the antenna. Calls may come in any order of positions.
  /// @param point east, north in the city's frame [m]; @param height_m of the antenna above the ground [m]
  void go_to(const Eigen::Vector2d& point, double height_m);
  /// Change of a path's level by the obstacles at the position of the last go_to() [dB], at most 0: the
  /// diffraction over a rounded edge (ITU-R P.526-15, 4.1 and 4.2) at L1.
  /// @param arrival direction of arrival of the path: unit, ENU; also below the horizon
  [[nodiscard]] double level_db(const Eigen::Vector3d& arrival) const;
  /// Elevation of the obstacle's top in an azimuth (clockwise from north) [rad], [0, pi/2); 0 without one.
  [[nodiscard]] double top_rad(double azimuth_rad) const;

 private:
  struct Obstacle {
    double slope;  ///< tangent of its top's elevation; at most 0: none
    double distance_m;
  };
  [[nodiscard]] Obstacle obstacle(double azimuth_rad) const;
  /// A number of unit variance at the antenna's position, in an azimuth node.
  [[nodiscard]] double number(std::uint64_t field, std::size_t node) const;

  SkylineOptions numbers_;
  std::uint64_t root_;
  Eigen::Vector2d position_ = Eigen::Vector2d::Zero();
  double height_m_ = 0;
  /// The numbers of an azimuth node.
  struct Node {
    double height, distance;
  };
  std::vector<Node> nodes_;
};

/// One of the nodes of SkyNodes::draw().
[[nodiscard]] inline double coins(std::uint64_t bits) {
  return (std::popcount(bits) - 32) / 4.0;
}
[[nodiscard]] inline double coins(RandomStream& stream) {
  return coins(stream.next());
}

/// Normal numbers over the sky, correlated between nearby directions: a blend of the numbers of nodes all
/// over the sky. The number of a direction does not depend on the other requested directions.
///
/// Nodes are on a Fibonacci lattice, 1.1 `angle` apart. A node at the angle g from a direction has the weight
/// exp(-2 (1 - cos g) / angle^2). All weights of a direction have unit norm, so that independent numbers of
/// unit variance at the nodes give one at each direction. Two directions at the angle g then correlate by
///
///     f(2 K cos(g / 2)) / f(2 K),  f(x) = sinh(x) / x, K = 2 / angle^2
///
/// (the integral of both weights over the sphere; exp(-g^2 / (2 angle^2)) for small angles) within 0.025
/// (RMS; 0.15 at worst), the difference between sums over nodes and integrals.
class SkyNodes {
 public:
  /// Weight of one node's number in a direction.
  struct NodeWeight {
    std::size_t node;  ///< below size()
    double weight;
  };

  /// @param angle_rad at which directions correlate by exp(-1/2), (0, pi/2]
  explicit SkyNodes(double angle_rad);

  [[nodiscard]] std::size_t size() const { return nodes_.size(); }
  /// Fills `numbers` with one for each node: the standardized number of heads in 64 coin tosses. A blend of a
  /// dozen of them is as good as normal (probabilities differ by less than 0.001), in a tenth of the time.
  /// They are multiples of 1/4.
  template <typename Numbers>
  static void draw(RandomStream& stream, Numbers&& numbers) {
    for (auto& number : numbers) number = static_cast<std::decay_t<decltype(number)>>(coins(stream));
  }
  /// Weights of nodes' numbers in a direction (unit, ENU, not below the horizon). `weights` belongs to the
  /// caller: nothing is allocated once it has grown.
  void weights(const Eigen::Vector3d& direction, std::vector<NodeWeight>& weights) const;
  /// The number of the last direction.
  template <typename Numbers>
  [[nodiscard]] static double blend(std::span<const NodeWeight> weights, const Numbers& numbers) {
    double sum = 0;
    for (const NodeWeight& node_weight : weights) sum += node_weight.weight * numbers[node_weight.node];
    return sum;
  }

 private:
  double angle_rad_;
  double count_;  // of the whole lattice; nodes_ are its upper part
  std::vector<Eigen::Vector3d> nodes_;
};

/// P(normal > z), of a standard normal number.
[[nodiscard]] inline double upper_tail(double z) {
  return 0.5 * std::erfc(z * std::sqrt(0.5));
}

}  // namespace canyon::disturbance
