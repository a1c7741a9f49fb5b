#pragma once

#include <Eigen/Core>
#include <cmath>
#include <span>
#include <vector>

namespace canyon::propagation {

/// An upright cylinder about an antenna.
struct Surroundings {
  double radius_m = 0, half_height_m = 0;

  /// From the middle along a unit vector.
  [[nodiscard]] double extent_m(const Eigen::Vector3d& along) const {
    return radius_m * along.head<2>().norm() + half_height_m * std::abs(along.z());
  }
  /// The radius of a ball about it.
  [[nodiscard]] double reach_m() const { return std::hypot(radius_m, half_height_m); }
  /// Whether a place lies in `share` of it.
  [[nodiscard]] bool hold(const Eigen::Vector3d& from_middle, double share) const {
    return from_middle.head<2>().norm() <= share * radius_m &&
           std::abs(from_middle.z()) <= share * half_height_m;
  }
};

/// Where an antenna hardly moves: what may be found from everywhere in kAntennas about `centre()`, of
/// directions within kSpread of `directions()`, is looked for once.
class Stay {
 public:
  static constexpr Surroundings kAntennas{5, 0.5};
  static constexpr double kSpread = 2e-3;  ///< chord of directions: some 14 s of a satellite's motion

  /// Goes on while antenna and directions hold, and begins anew where they do not. @return whether it begins
  bool begins(const Eigen::Vector3d& antenna, std::span<const Eigen::Vector3d> directions) {
    if (holds(antenna, directions)) return false;
    centre_ = antenna;
    directions_.assign(directions.begin(), directions.end());
    return true;
  }
  [[nodiscard]] const Eigen::Vector3d& centre() const { return centre_; }
  [[nodiscard]] const std::vector<Eigen::Vector3d>& directions() const { return directions_; }

 private:
  [[nodiscard]] bool holds(const Eigen::Vector3d& antenna,
                           std::span<const Eigen::Vector3d> directions) const {
    if (directions_.size() != directions.size() || !kAntennas.hold(antenna - centre_, 1)) return false;
    for (std::size_t i = 0; i < directions.size(); ++i)
      if ((directions[i] - directions_[i]).squaredNorm() > kSpread * kSpread) return false;
    return true;
  }

  Eigen::Vector3d centre_ = Eigen::Vector3d::Constant(1e300);
  std::vector<Eigen::Vector3d> directions_;
};

}  // namespace canyon::propagation
