#include "canyon/paths/disturbance/skyline.hpp"

#include <algorithm>
#include <cassert>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/paths/propagation/index/knife_edge.hpp"

namespace canyon::disturbance {

namespace {

constexpr double kL1Wavelength_m = geodesy::kSpeedOfLight / 1575.42e6;
/// Azimuth after which obstacles are independent; radius of the rounded edges.
constexpr double kWidth_deg = 30, kEdgeRadius_m = 1;
/// Independent fields of numbers.
enum Field : std::uint64_t { kHeight, kDistance };

/// x with (1 + x) exp(-x) = p: the upper quantile of a gamma distribution of shape 2 and scale 1.
double gamma2_upper_quantile(double p) {
  if (p >= 1) return 0;
  double x = p > 0.5 ? std::sqrt(2 * (1 - p)) : -std::log(p) + std::log1p(-std::log(p));
  for (int i = 0; i < 4; ++i) x += ((1 + x) * std::exp(-x) - p) / (x * std::exp(-x));
  return x;
}

/// Smooth interpolation weight between two lattice points, with zero slope at both.
double eased(double fraction) {
  return fraction * fraction * (3 - 2 * fraction);
}

}  // namespace

Skyline::Skyline(const ShadowingOptions& options, std::uint64_t seed)
    : numbers_((options.skyline.validate(), skyline_numbers(options))),
      root_(RandomStream(seed, "/skyline").next()),
      nodes_(static_cast<std::size_t>(std::round(2 * geodesy::kPi / geodesy::radians(kWidth_deg)))) {}

double Skyline::number(std::uint64_t field, std::size_t node) const {
  const std::uint64_t node_hash = mix64(root_ + kGolden64 * (field + 16 * node));
  // Each node has its own lattice origin.
  const double x = position_.x() / SkylineOptions::kLength_m + static_cast<double>(node_hash >> 44U) / 0x1p20;
  const double y =
      position_.y() / SkylineOptions::kLength_m + static_cast<double>((node_hash >> 24U) & 0xfffffU) / 0x1p20;
  const double column = std::floor(x), row = std::floor(y);
  const double along = eased(x - column), across = eased(y - row);
  double sum = 0, square = 0;
  for (int corner = 0; corner < 4; ++corner) {
    const int right = corner & 1, up = corner >> 1;
    const double weight = (right != 0 ? along : 1 - along) * (up != 0 ? across : 1 - across);
    const auto i = static_cast<std::uint64_t>(static_cast<std::int64_t>(column) + right);
    const auto j = static_cast<std::uint64_t>(static_cast<std::int64_t>(row) + up);
    sum += weight * coins(mix64(mix64(node_hash + kGolden64 * i) + kGolden64 * j));
    square += weight * weight;
  }
  return sum / std::sqrt(square);
}

void Skyline::go_to(const Eigen::Vector2d& point, double height_m) {
  position_ = point;
  height_m_ = height_m;
  if (empty()) return;
  for (std::size_t k = 0; k < nodes_.size(); ++k) nodes_[k] = {number(kHeight, k), number(kDistance, k)};
}

Skyline::Obstacle Skyline::obstacle(double azimuth_rad) const {
  const double cycles = azimuth_rad / (2 * geodesy::kPi);
  const double at = (cycles - std::floor(cycles)) * static_cast<double>(nodes_.size());
  const std::size_t before = static_cast<std::size_t>(at) % nodes_.size(),
                    after = (before + 1) % nodes_.size();
  const double between = geodesy::kPi / 2 * (at - std::floor(at));
  const double w0 = std::cos(between), w1 = std::sin(between);
  const Node &a = nodes_[before], &b = nodes_[after];
  const double tail = upper_tail(w0 * a.height + w1 * b.height);
  if (tail >= *numbers_.fraction) return {0, SkylineOptions::kDistance_m};
  const double distance_m = SkylineOptions::kDistance_m *
                            std::exp(SkylineOptions::kDistanceSigma * (w0 * a.distance + w1 * b.distance));
  const double top_m =
      SkylineOptions::kBase_m + 0.5 * numbers_.height_m * gamma2_upper_quantile(tail / *numbers_.fraction);
  return {(top_m - height_m_) / distance_m, distance_m};
}

double Skyline::top_rad(double azimuth_rad) const {
  return empty() ? 0 : std::max(0.0, std::atan(obstacle(azimuth_rad).slope));
}

double Skyline::level_db(const Eigen::Vector3d& arrival) const {
  if (empty() || arrival.head<2>().norm() < 1e-6) return 0;
  const Obstacle o = obstacle(std::atan2(arrival.x(), arrival.y()));
  if (o.slope <= 0) return 0;
  const double below = std::atan(o.slope) - std::asin(std::min(std::abs(arrival.z()), 1.0));
  const double nu = std::copysign(std::sqrt(2 * o.distance_m / kL1Wavelength_m), below) * std::abs(below);
  const double round_edge_db =
      below > 0 ? propagation::rounded_edge_loss_db(kEdgeRadius_m, o.distance_m, below, kL1Wavelength_m) : 0;
  return -propagation::approximate_knife_edge_loss_db(nu) - round_edge_db;
}

namespace {

/// Angles: spacing of the lattice, and reach of a node (exp(-6.25) there).
constexpr double kSpacing = 1.1;
constexpr double kReach = 2.5;

}  // namespace

SkyNodes::SkyNodes(double angle_rad) : angle_rad_(angle_rad) {
  assert(angle_rad > 0 && angle_rad <= geodesy::kPi / 2);
  // The cell area of a hexagonal lattice is sqrt(3) / 2 of the squared spacing.
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

void SkyNodes::weights(const Eigen::Vector3d& direction, std::vector<NodeWeight>& weights) const {
  weights.clear();
  const double steepness = 2 / (angle_rad_ * angle_rad_);
  const double nearest = 1 - std::min(kReach * kReach / steepness, 2.0);
  double square = 0;
  // Nodes are sorted downwards from the zenith: those at the heights of the circle around the direction.
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
    weights.push_back({i, weight});
    square += weight * weight;
  }
  assert(square > 0);
  const double unit = 1 / std::sqrt(square);
  for (NodeWeight& fraction : weights) fraction.weight *= unit;
}

}  // namespace canyon::disturbance
