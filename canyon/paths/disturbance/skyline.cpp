#include "canyon/paths/disturbance/skyline.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/random.hpp"
#include "canyon/paths/propagation/index/knife_edge.hpp"
#include "canyon/paths/signal/radio_materials.hpp"

namespace canyon::disturbance {

namespace {

constexpr double kL1_hz = 1575.42e6;
constexpr double kL1Wavelength_m = geodesy::kSpeedOfLight / kL1_hz;
/// Azimuth after which other obstacles are seen; width of a crown; radius that edges are rounded with.
constexpr double kWidth_deg = 30, kCrown_m = 5, kEdgeRadius_m = 1;
/// Fields of numbers that do not depend on each other.
enum Field : std::uint64_t { kHeight, kMovingHeight, kDistance, kKind };

/// x with (1 + x) exp(-x) = p: the upper quantile of a gamma distribution of shape 2 and scale 1.
double gamma2_upper_quantile(double p) {
  if (p >= 1) return 0;
  double x = p > 0.5 ? std::sqrt(2 * (1 - p)) : -std::log(p) + std::log1p(-std::log(p));
  for (int i = 0; i < 4; ++i) x += ((1 + x) * std::exp(-x) - p) / (x * std::exp(-x));
  return x;
}

/// Share of the way from one lattice point to the next, with no slope at either.
double eased(double share) {
  return share * share * (3 - 2 * share);
}

}  // namespace

Skyline::Skyline(const ShadowingOptions& options, std::uint64_t seed)
    : numbers_((options.skyline.validate(), skyline_numbers(options))),
      root_(RandomStream(seed, "/skyline").next()),
      nodes_(static_cast<std::size_t>(std::round(2 * geodesy::kPi / geodesy::radians(kWidth_deg)))) {}

double Skyline::number(std::uint64_t field, std::size_t node, std::int64_t slot) const {
  const std::uint64_t of_node =
      mix64(root_ + kGolden64 * (field + 16 * node) + mix64(static_cast<std::uint64_t>(slot) + kGolden64));
  // Lattices of the nodes begin at places of their own.
  const double length_m = numbers_.length_m;
  const double x = place_.x() / length_m + static_cast<double>(of_node >> 44U) / 0x1p20;
  const double y = place_.y() / length_m + static_cast<double>((of_node >> 24U) & 0xfffffU) / 0x1p20;
  const double column = std::floor(x), row = std::floor(y);
  const double along = eased(x - column), across = eased(y - row);
  double sum = 0, square = 0;
  for (int corner = 0; corner < 4; ++corner) {
    const int right = corner & 1, up = corner >> 1;
    const double weight = (right != 0 ? along : 1 - along) * (up != 0 ? across : 1 - across);
    const auto i = static_cast<std::uint64_t>(static_cast<std::int64_t>(column) + right);
    const auto j = static_cast<std::uint64_t>(static_cast<std::int64_t>(row) + up);
    const std::uint64_t bits = mix64(mix64(of_node + kGolden64 * i) + kGolden64 * j);
    sum += weight * coins(bits);
    square += weight * weight;
  }
  return sum / std::sqrt(square);
}

void Skyline::go_to(const Eigen::Vector2d& place, double height_m, geodesy::GpsTime time) {
  place_ = place;
  height_m_ = height_m;
  if (empty()) return;
  const double slots = static_cast<double>(time.nanoseconds()) * 1e-9 / numbers_.moving_s;
  const auto slot = static_cast<std::int64_t>(std::floor(slots));
  const double later = geodesy::kPi / 2 * (slots - std::floor(slots));
  const double moving = std::sqrt(*numbers_.moving_share), fixed = std::sqrt(1 - *numbers_.moving_share);
  for (std::size_t k = 0; k < nodes_.size(); ++k) {
    nodes_[k].height = fixed * number(kHeight, k, 0);
    if (moving > 0) {
      nodes_[k].height += moving * (std::cos(later) * number(kMovingHeight, k, slot) +
                                    std::sin(later) * number(kMovingHeight, k, slot + 1));
    }
    nodes_[k].distance = number(kDistance, k, 0);
    nodes_[k].kind = number(kKind, k, 0);
  }
}

Skyline::Obstacle Skyline::obstacle(double azimuth_rad) const {
  const double turns = azimuth_rad / (2 * geodesy::kPi);
  const double at = (turns - std::floor(turns)) * static_cast<double>(nodes_.size());
  const std::size_t before = static_cast<std::size_t>(at) % nodes_.size(),
                    after = (before + 1) % nodes_.size();
  const double between = geodesy::kPi / 2 * (at - std::floor(at));
  const double w0 = std::cos(between), w1 = std::sin(between);
  const Node &a = nodes_[before], &b = nodes_[after];
  const double tail = upper_tail(w0 * a.height + w1 * b.height);
  if (tail >= *numbers_.share) return {0, numbers_.distance_m, false};
  const double distance_m =
      numbers_.distance_m * std::exp(numbers_.distance_sigma * (w0 * a.distance + w1 * b.distance));
  const double top_m =
      SkylineOptions::kBase_m + 0.5 * numbers_.height_m * gamma2_upper_quantile(tail / *numbers_.share);
  return {(top_m - height_m_) / distance_m, distance_m,
          upper_tail(w0 * a.kind + w1 * b.kind) < *numbers_.foliage_share};
}

double Skyline::top_rad(double azimuth_rad) const {
  return empty() ? 0 : std::max(0.0, std::atan(obstacle(azimuth_rad).slope));
}

double Skyline::level_db(const Eigen::Vector3d& arrival, double above_rad) const {
  if (empty()) return 0;
  const double level = arrival.head<2>().norm(), up = std::abs(arrival.z());
  if (level < 1e-6) return 0;
  const Obstacle o = obstacle(std::atan2(arrival.x(), arrival.y()));
  if (o.slope <= 0) return 0;
  const double elevation = std::atan2(up, level), below = std::atan(o.slope) - above_rad;
  if (o.foliage) {
    if (below <= 0) return 0;
    // The way through the crown: in at its top, out on its far side.
    const double depth_m =
        std::min(o.distance_m * (o.slope - std::tan(above_rad)) / std::max(up, 0.1), kCrown_m / level);
    return -signal::foliage_loss_db(signal::FoliageModel::SlantPath, depth_m, kL1_hz, elevation);
  }
  const double nu = std::copysign(std::sqrt(2 * o.distance_m / kL1Wavelength_m), below) * std::abs(below);
  const double of_round_edge_db =
      below > 0 ? propagation::rounded_edge_loss_db(kEdgeRadius_m, o.distance_m, below, kL1Wavelength_m) : 0;
  return -propagation::approximate_knife_edge_loss_db(nu) - of_round_edge_db;
}

bool meets_obstacles(const propagation::Path& path) {
  const bool of_surface =
      path.kind == propagation::PathKind::Reflected || path.kind == propagation::PathKind::Diffuse;
  return !of_surface || path.arrival.z() < 0;  // the ground is in front of them
}

double above_skyline_rad(const raytrace::RayScene* scene, const Eigen::Vector3d& antenna_enu,
                         const Eigen::Vector3d& direction) {
  const double elevation = std::asin(std::min(std::abs(direction.z()), 1.0));
  if (scene == nullptr) return elevation;
  const double azimuth = std::atan2(direction.x(), direction.y());
  double low = 0, high = elevation;
  for (int halving = 0; halving < 6; ++halving) {
    const double middle = (low + high) / 2;
    const Eigen::Vector3d between = geodesy::enu_from_azimuth_elevation(azimuth, middle);
    (scene->occluded({antenna_enu, between}) ? low : high) = middle;
  }
  return low > 0 ? elevation - high : elevation;
}

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
