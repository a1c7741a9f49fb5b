#include "canyon/heatmap/cells/cell_solution.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>
#include <limits>
#include <span>

#include "canyon/base/input_error.hpp"
#include "canyon/base/random.hpp"
#include "canyon/errors/atmosphere.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/positioning/protection_level.hpp"
#include "canyon/positioning/pseudorange_model.hpp"
#include "canyon/tracking/noise.hpp"

namespace canyon::heatmap {
namespace {

using Eigen::Index;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using geodesy::kSpeedOfLight;

constexpr std::size_t kMostSets = 4096;
/// PDOPs of one set differ by less within a tile.
constexpr double kDopChange = 1e-3;

/// Right-handed unit axes: the first along a, the third along a x b.
Matrix3d axes_of(const Vector3d& a, const Vector3d& b) {
  const Vector3d third = a.cross(b).normalized();
  Matrix3d axes;
  axes << a, third.cross(a), third;
  return axes;
}

std::size_t hash(const SatelliteSet& set) {
  return static_cast<std::size_t>(
      mix64(set.bits[0] + kGolden64 * (set.bits[1] + (set.drifting ? 1 : 0) + 1)));
}

}  // namespace

Matrix3d rotation_between(std::span<const Vector3d> a, std::span<const Vector3d> b) {
  std::size_t other = 0;
  double largest = 1e-6;
  for (std::size_t i = 1; i < b.size(); ++i) {
    const double sine = b[0].cross(b[i]).norm();
    if (sine <= largest) continue;
    largest = sine;
    other = i;
  }
  if (other == 0) return Matrix3d::Identity();
  return axes_of(a[0], a[other]) * axes_of(b[0], b[other]).transpose();
}

ZenithDelay::ZenithDelay(const geodesy::Geodetic& place) : place_(place) {
  const auto steps = static_cast<std::size_t>((kHighest_m - kLowest_m) / kHeightStep_m);
  for (std::size_t i = 0; i <= steps; ++i) {
    delay_m_.push_back(beyond(kLowest_m + kHeightStep_m * static_cast<double>(i)));
  }
}

double ZenithDelay::beyond(double height_m) const {
  geodesy::Geodetic at = place_;
  at.height_m = height_m;
  return errors::saastamoinen_zenith_m(at);
}

TileSolutions::TileSolutions(const receiver::ReceiverOptions& options,
                             const std::map<gnss::System, gnss::Klobuchar>& klobuchar,
                             const TileSignals& signals, int draws, std::uint64_t seed)
    : options_(options),
      klobuchar_(klobuchar),
      draws_(draws),
      corrects_(options.fix.correct_ionosphere || options.fix.correct_troposphere),
      sine_of_mask_(std::sin(options.fix.elevation_mask_rad)),
      lines_(signals.satellites) {
  if (signals.satellites.size() > kMostSatellites) {
    throw InputError(fmt::format("{} satellites are above the mask at once, more than a map's {}",
                                 signals.satellites.size(), kMostSatellites),
                     "leave satellite systems out, or raise the elevation mask");
  }
  assert(signals.directions.size() == signals.satellites.size());
  slots_.assign(64, 0);
  drawn_m_.resize(3 * static_cast<std::size_t>(draws));
  if (options.noise.enabled && options.fix.weights.weighting != positioning::Weighting::Elevation) {
    // As receiver::Receiver states it, which takes 1 m where there is no noise.
    const double drift_m = options.noise.drift_enabled ? options.noise.drift_mu_sigma_m : 0;
    const double sigma_m = std::hypot(options.noise.ou.standard_deviation_m(), drift_m);
    if (sigma_m > 0) variance_m2_ = sigma_m * sigma_m;
  }
  if (signals.satellites.empty()) return;
  place_satellites(signals);
  // To the microsecond: flight times are rounded to nanoseconds, and the key must not depend on a tile's
  // centre.
  const orbit::LineOfSight& first = signals.satellites.front();
  const std::int64_t time = (first.transmit_time + first.range_m / kSpeedOfLight).nanoseconds();
  time_ = geodesy::GpsTime::from_nanoseconds((time + (time < 0 ? -500 : 500)) / 1000 * 1000);
  if (draws_ > 0) draw_noise(seed);
}

void TileSolutions::place_satellites(const TileSignals& signals) {
  const orbit::LineOfSight& any = signals.satellites.front();
  centre_ecef_ = any.position_at_reception_m - any.range_m * any.direction_ecef;
  const geodesy::Geodetic centre = geodesy::geodetic_from_ecef(centre_ecef_);
  height_m_ = centre.height_m;
  // Radii of curvature of the ellipsoid, prime vertical and meridian (Snyder, Map Projections, USGS 1987,
  // 4-20 and 4-18).
  const double eccentricity2 = geodesy::kFlattening * (2 - geodesy::kFlattening),
               sine = std::sin(centre.latitude_rad);
  const double w2 = 1 - eccentricity2 * sine * sine, prime_vertical = geodesy::kSemiMajorAxis / std::sqrt(w2);
  curvature_east_ = 1 / (prime_vertical + height_m_);
  curvature_north_ = 1 / (prime_vertical * (1 - eccentricity2) / w2 + height_m_);
  if (options_.troposphere || options_.fix.correct_troposphere) zenith_.emplace(centre);

  enu_from_ecef_ = geodesy::enu_from_ecef_rotation(centre);
  std::vector<Vector3d> directions;
  double nearest_m = any.range_m;
  for (std::size_t i = 0; i < signals.satellites.size(); ++i) {
    const TileSatellite& s = satellites_.emplace_back(satellite_of(signals.satellites[i]));
    directions.push_back(s.direction);
    nearest_m = std::min(nearest_m, s.range_m);
  }
  enu_from_city_ = rotation_between(directions, signals.directions);
  sine_change_per_m_ = std::max(curvature_east_, curvature_north_) + 1 / nearest_m;
}

TileSatellite TileSolutions::satellite_of(const orbit::LineOfSight& line) const {
  TileSatellite s;
  s.system = line.id.system;
  s.direction = enu_from_ecef_ * line.direction_ecef;
  s.range_m = line.range_m;
  s.sine = s.direction.z();
  // Up leans towards the place by its distance over the Earth's radius, the satellite away from it.
  const Vector3d& u = s.direction;
  s.sine_slope = Vector3d(u.x() * curvature_east_, u.y() * curvature_north_, 0) -
                 (Vector3d::UnitZ() - u.z() * u) / s.range_m;
  const Vector3d omega(0, 0, geodesy::kEarthRotationRate);
  s.turning =
      1 / (1 + line.direction_ecef.dot(omega.cross(line.position_at_reception_m)) / kSpeedOfLight) - 1;
  s.error_scale = 1 + line.direction_ecef.dot(line.velocity_at_reception_mps) / kSpeedOfLight;
  const positioning::WeightOptions& weights = options_.fix.weights;
  if (weights.weighting == positioning::Weighting::Elevation) {
    const auto weight = [&](double elevation_rad) {
      const double sigma = weights.sigma_m({}, elevation_rad);
      return 1 / (sigma * sigma);
    };
    const double low = std::max(s.sine - 1e-6, -1.0), high = std::min(s.sine + 1e-6, 1.0);
    s.weight = weight(line.elevation_rad);
    s.weight_slope = (weight(std::asin(high)) - weight(std::asin(low))) / (high - low);
  }
  if (options_.ionosphere || options_.fix.correct_ionosphere) {
    const auto ionosphere_at = [&](const Vector3d& enu) {
      const Vector3d ecef = centre_ecef_ + enu_from_ecef_.transpose() * enu;
      const geodesy::Geodetic place = geodesy::geodetic_from_ecef(ecef);
      const geodesy::AzimuthElevation look = geodesy::azimuth_elevation_from_enu(
          geodesy::enu_from_ecef_rotation(place) * (line.position_at_reception_m - ecef));
      return positioning::atmosphere_m(true, false, klobuchar_, line.id.system,
                                       line.state.carrier_frequency_hz,
                                       line.transmit_time + line.range_m / kSpeedOfLight, place, look);
    };
    s.ionosphere_m = ionosphere_at(Vector3d::Zero());
    constexpr double kStep_m = 500;
    for (int axis = 0; axis < 3; ++axis) {
      const Vector3d step = kStep_m * Vector3d::Unit(axis);
      s.ionosphere_slope(axis) = (ionosphere_at(step) - ionosphere_at(-step)) / (2 * kStep_m);
    }
  }
  return s;
}

void TileSolutions::draw_noise(std::uint64_t seed) {
  const receiver::NoiseOptions& noise = options_.noise;
  const std::size_t n = satellites_.size(), draws = static_cast<std::size_t>(draws_);
  noise_m_.assign(2 * n * draws, 0);
  // Here errors from space are each satellite's own.
  const double sigma_m = std::hypot(noise.enabled ? noise.ou.standard_deviation_m() : 0,
                                    options_.orbit_errors ? receiver::kSpaceSigma_m : 0);
  if (sigma_m == 0 && !noise.enabled) return;
  for (std::size_t i = 0; i < n; ++i) {
    const std::string key = fmt::format("heatmap/{}/{}", gnss::to_string(lines_[i].id), time_.nanoseconds());
    RandomStream code(seed, key + "/code"), mean(seed, key + "/mean");
    for (std::size_t draw = 0; draw < draws; ++draw) {
      noise_m_[i * draws + draw] = sigma_m * code.normal();
      if (noise.enabled && noise.drift_enabled)
        noise_m_[(n + i) * draws + draw] = noise.drift_mu_sigma_m * mean.normal();
    }
  }
}

void TileSolutions::solve(SetSolution& solution, const SatelliteSet& set) const {
  const positioning::FixOptions& fix = options_.fix;
  std::array<int, gnss::kSystemCount> count{};
  solution.margin = 1;
  set.for_each([&](std::size_t i) {
    ++count[static_cast<std::size_t>(satellites_[i].system)];
    solution.margin = std::min(solution.margin, satellites_[i].sine - sine_of_mask_);
  });
  const auto clocks = positioning::clocks_of(count);
  std::vector<Row> rows;
  LinearFix weighted(clocks.count), shape(clocks.count);
  set.for_each([&](std::size_t i) {
    const TileSatellite& s = satellites_[i];
    const int clock = clocks.column[static_cast<std::size_t>(s.system)];
    if (clock < 0) return;
    rows.push_back({i, clock});
    weighted.add(s.direction, clock, s.weight);
    shape.add(s.direction, clock, 1);
  });
  const int used = static_cast<int>(rows.size());
  if (!positioning::enough_satellites(used, clocks.count, fix)) return;
  if (rows.size() < weighted.unknowns() || !weighted.factorise()) return;
  std::optional<positioning::Dop> dop;
  if (shape.factorise()) dop = shape.dop();
  solution.doubtful = dop && std::abs(dop->pdop - fix.max_pdop) <= kDopChange * dop->pdop;
  if (!solution.doubtful && !positioning::strong_enough(dop, fix)) return;
  solution.solved = true;
  solution.used = used;
  solution.dop = dop.value_or(kNoDop);
  const Matrix3d covariance = weighted.covariance();
  solution.spread_m = positioning::horizontal_protection_level_m(variance_m2_ * covariance, 1);
  linearise(solution, rows, weighted, covariance);
  add_noise(solution, rows, set.drifting);
}

void TileSolutions::linearise(SetSolution& solution, const std::vector<Row>& rows, const LinearFix& fix,
                              const Matrix3d& covariance) const {
  const auto n = static_cast<Index>(rows.size()), unknowns = static_cast<Index>(fix.unknowns());
  // The least-squares condition H(y)^T W(y) r = 0 at the place found, y from the centre: H changes by
  // G_i = (P_i y)^T / r_i, P_i = I - u_i u_i^T, and W by its slope; both against the residuals r.
  Eigen::MatrixXd k(unknowns, n), unit = Eigen::MatrixXd::Zero(n, unknowns), bend(9, n);
  solution.curvature.setZero();
  solution.turning.setZero();
  solution.ionosphere.setZero();
  solution.ionosphere_slope.setZero();
  solution.troposphere.setZero();
  solution.troposphere_slope.setZero();
  Eigen::VectorXd atmosphere(n);
  const double zenith = zenith_ ? (*zenith_)(height_m_) : 0;
  const double ionosphere_left = (options_.ionosphere ? 1 : 0) - (options_.fix.correct_ionosphere ? 1 : 0);
  const double troposphere_left = (options_.troposphere ? 1 : 0) - (options_.fix.correct_troposphere ? 1 : 0);
  for (Index row = 0; row < n; ++row) {
    const auto [satellite, clock] = rows[static_cast<std::size_t>(row)];
    const TileSatellite& s = satellites_[satellite];
    const Vector3d& u = s.direction;
    unit.row(row).head<3>() = -u.transpose();
    unit(row, clock) = 1;
    const LinearFix::Unknowns gain = fix.gain(u, clock, s.weight);
    k.col(row) = Eigen::Map<const Eigen::VectorXd>(gain.data(), unknowns);
    const Vector3d gain_of_error = k.col(row).head<3>();
    const Matrix3d across = (Matrix3d::Identity() - u * u.transpose()) / s.range_m;
    const Matrix3d turns = covariance * (s.weight * across) +
                           gain_of_error / s.weight * (s.weight_slope * s.sine_slope.transpose());
    bend.col(row) = Eigen::Map<const Eigen::Matrix<double, 9, 1>>(turns.data());
    Eigen::Matrix<double, 1, 6> quadratic;  // |P y|^2 / (2 r)
    quadratic << across(0, 0) / 2, across(1, 1) / 2, across(2, 2) / 2, across(0, 1), across(0, 2),
        across(1, 2);
    solution.curvature += gain_of_error * quadratic;
    solution.turning -= gain_of_error * (s.turning * u.transpose());
    solution.ionosphere += gain_of_error * s.ionosphere_m;
    solution.ionosphere_slope += gain_of_error * s.ionosphere_slope.transpose();
    solution.troposphere += gain_of_error / s.sine;
    solution.troposphere_slope -= gain_of_error * s.sine_slope.transpose() / (s.sine * s.sine);
    atmosphere(row) = ionosphere_left * s.ionosphere_m + troposphere_left * zenith / s.sine;
  }
  // The bend follows the residuals (I - unit k) m.
  const Eigen::MatrixXd bend_of_error = bend - (bend * unit) * k;
  const double mean = options_.noise.enabled ? options_.noise.ou.mu_m : 0;
  solution.columns.assign(satellites_.size(), SetSolution::Column::Zero());
  solution.constant.setZero();
  for (Index row = 0; row < n; ++row) {
    const std::size_t i = rows[static_cast<std::size_t>(row)].satellite;
    SetSolution::Column& c = solution.columns[i];
    c.head<3>() = k.col(row).head<3>();
    c.tail<9>() = bend_of_error.col(row);
    c *= satellites_[i].error_scale;
    solution.constant += mean * c;
  }
  solution.constant.tail<9>() += bend_of_error * atmosphere;
}

void TileSolutions::add_noise(SetSolution& solution, const std::vector<Row>& rows, bool drifting) const {
  const auto draws = static_cast<std::size_t>(draws_);
  solution.noise.assign(3 * draws, 0);
  for (const auto& [satellite, clock] : rows) {
    const SetSolution::Column& c = solution.columns[satellite];
    for (std::size_t draw = 0; draw < draws; ++draw) {
      const double error = drawn_noise_m(satellite, draw, drifting);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        solution.noise[axis * draws + draw] += error * c(static_cast<Index>(axis));
      }
    }
  }
}

const SetSolution& TileSolutions::solution(const SatelliteSet& set) {
  if (!sets_.empty() && keys_[last_] == set) return *sets_[last_];
  std::size_t slot = hash(set) & (slots_.size() - 1);
  while (slots_[slot] != 0 && !(keys_[slots_[slot] - 1] == set)) slot = (slot + 1) & (slots_.size() - 1);
  if (slots_[slot] == 0) {
    keys_.push_back(set);
    sets_.push_back(std::make_unique<SetSolution>());
    solve(*sets_.back(), set);
    slots_[slot] = static_cast<std::uint32_t>(sets_.size());
    last_ = sets_.size() - 1;
    if (2 * sets_.size() > slots_.size()) grow();
  } else {
    last_ = slots_[slot] - 1;
  }
  return *sets_[last_];
}

void TileSolutions::grow() {
  slots_.assign(2 * slots_.size(), 0);
  for (std::size_t i = 0; i < keys_.size(); ++i) {
    std::size_t slot = hash(keys_[i]) & (slots_.size() - 1);
    while (slots_[slot] != 0) slot = (slot + 1) & (slots_.size() - 1);
    slots_[slot] = static_cast<std::uint32_t>(i + 1);
  }
}

void TileSolutions::trim() {
  if (sets_.size() < kMostSets) return;
  std::fill(slots_.begin(), slots_.end(), 0);
  keys_.clear();
  sets_.clear();
  last_ = 0;
}

}  // namespace canyon::heatmap
