#include "canyon/disturbance/sky_nodes.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "canyon/geodesy/constants.hpp"

namespace canyon::disturbance {
namespace {

/// Angles: spacing of the lattice, and reach of a node (exp(-6.25) there).
constexpr double kSpacing = 1.1;
constexpr double kReach = 2.5;

}  // namespace

SkyNodes::SkyNodes(double angle_rad) : angle_rad_(angle_rad) {
  assert(angle_rad > 0 && angle_rad <= geodesy::kPi / 2);
  // A cell of a hexagonal lattice has sqrt(3) / 2 of its spacing's square.
  const double spacing = kSpacing * angle_rad;
  count_ = std::ceil(4 * geodesy::kPi / (std::sqrt(0.75) * spacing * spacing));
  const double lowest = -std::sin(std::min(kReach * angle_rad, geodesy::kPi / 2));
  const double golden = geodesy::kPi * (3 - std::sqrt(5));
  for (double i = 0; i < count_; ++i) {
    const double up = 1 - (2 * i + 1) / count_;
    if (up < lowest) break;
    const double across = std::sqrt(1 - up * up);
    nodes_.emplace_back(across * std::cos(golden * i), across * std::sin(golden * i), up);
  }
}

void SkyNodes::draw(RandomStream& stream, std::span<double> numbers) {
  for (double& number : numbers) number = coins(stream);
}

void SkyNodes::shares(const Eigen::Vector3d& direction, std::vector<Share>& shares) const {
  shares.clear();
  const double steepness = 2 / (angle_rad_ * angle_rad_);
  const double nearest = 1 - std::min(kReach * kReach / steepness, 2.0);
  double square = 0;
  // Nodes come from the zenith down: those between the heights of the circle about the direction.
  const double reach = std::acos(nearest), from_zenith = std::acos(std::clamp(direction.z(), -1.0, 1.0));
  const auto above = [this](double angle) {
    const double nodes = count_ * (1 - std::cos(std::clamp(angle, 0.0, geodesy::kPi))) / 2;
    return std::min(static_cast<std::size_t>(nodes), nodes_.size());
  };
  const std::size_t end = std::min(above(from_zenith + reach) + 1, nodes_.size());
  for (std::size_t i = above(from_zenith - reach); i < end; ++i) {
    const double cosine = nodes_[i].dot(direction);
    if (cosine < nearest) continue;
    const double weight = std::exp(steepness * (cosine - 1));
    shares.push_back({i, weight});
    square += weight * weight;
  }
  assert(square > 0);
  const double unit = 1 / std::sqrt(square);
  for (Share& share : shares) share.weight *= unit;
}

double SkyNodes::blend(std::span<const Share> shares, std::span<const double> numbers) {
  double sum = 0;
  for (const Share& share : shares) sum += share.weight * numbers[share.node];
  return sum;
}

}  // namespace canyon::disturbance
