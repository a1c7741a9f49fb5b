#pragma once

#include <Eigen/Core>
#include <bit>
#include <cmath>
#include <cstddef>
#include <span>
#include <vector>

#include "canyon/base/random.hpp"

namespace canyon::disturbance {

/// Normal numbers over the sky that are alike in directions close to each other: those of nodes all over it,
/// blended. A direction has the same number, whatever other directions are requested.
///
/// Nodes lie on a Fibonacci lattice, 1.1 `angle` apart. A direction at the angle g from a node has it with
/// the weight exp(-2 (1 - cos g) / angle^2), and all weights of a direction have unit norm, so that
/// independent numbers of unit variance at the nodes give one at each direction. Two directions at the angle
/// g then correlate by
///
///     f(2 K cos(g / 2)) / f(2 K),  f(x) = sinh(x) / x, K = 2 / angle^2
///
/// (the integral of both weights over the sphere; exp(-g^2 / (2 angle^2)) for small angles) within 0.025
/// (RMS; 0.15 at worst), by what sums over nodes differ from integrals.
class SkyNodes {
 public:
  /// Share of one node's number in a direction.
  struct Share {
    std::size_t node;  ///< below size()
    double weight;
  };

  /// @param angle_rad at which directions correlate by exp(-1/2), (0, pi/2]
  explicit SkyNodes(double angle_rad);

  [[nodiscard]] std::size_t size() const { return nodes_.size(); }
  /// Fills `numbers` with one for each node: heads of 64 tossed coins, which are as good as normal where a
  /// dozen nodes are blended (their probabilities differ by less than 0.001), in a tenth of the time.
  static void draw(RandomStream& stream, std::span<double> numbers);
  /// Shares of nodes' numbers in a direction (unit, ENU, not below the horizon). `shares` is the caller's:
  /// nothing is allocated once it has grown.
  void shares(const Eigen::Vector3d& direction, std::vector<Share>& shares) const;
  /// The number of that direction.
  [[nodiscard]] static double blend(std::span<const Share> shares, std::span<const double> numbers);

 private:
  double angle_rad_;
  double count_;  // of the whole lattice, of which nodes_ are the upper part
  std::vector<Eigen::Vector3d> nodes_;
};

/// P(normal > z), of a standard normal number.
[[nodiscard]] inline double upper_tail(double z) {
  return 0.5 * std::erfc(z * std::sqrt(0.5));
}

/// One of SkyNodes::draw()'s.
[[nodiscard]] inline double coins(std::uint64_t bits) {
  return (std::popcount(bits) - 32) / 4.0;
}
[[nodiscard]] inline double coins(RandomStream& stream) {
  return coins(stream.next());
}

}  // namespace canyon::disturbance
