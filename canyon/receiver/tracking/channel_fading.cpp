#include "canyon/receiver/tracking/channel_fading.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <cassert>
#include <cmath>
#include <iterator>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"

namespace canyon::tracking {

double integrated_power(std::complex<double> s_per_s, double integration_s) {
  const std::complex<double> x = s_per_s * integration_s;
  // Series used if the differences lose digits; the next term is x^3 / 60.
  if (std::abs(x) < 1e-3) return (1.0 - x / 3.0 + x * x / 12.0).real();
  const std::complex<double> inverse = std::conj(x) / std::norm(x);
  return 2 * (inverse - (1.0 - std::exp(-x)) * inverse * inverse).real();
}

double filtered_fraction(std::complex<double> s_per_s, double loop_bandwidth_hz) {
  const double k = 4 * loop_bandwidth_hz;
  return k * (k + s_per_s.real()) / std::norm(k + s_per_s);
}

ClusterWeight cluster_weight(std::complex<double> s_per_s, double loop_bandwidth_hz, double integration_s) {
  const double k = 4 * loop_bandwidth_hz;
  const double fraction = filtered_fraction(s_per_s, loop_bandwidth_hz);
  ClusterWeight result;
  result.frequency_hz =
      std::min(std::sqrt(std::max(0.0, 1 / fraction - 1)) * k / (2 * geodesy::kPi), 0.1 / integration_s);
  const double ratio = 2 * geodesy::kPi * result.frequency_hz / k;
  result.coherent = 1 / (1 + ratio * ratio);
  result.integrated = integrated_power(s_per_s, integration_s);
  return result;
}

PathFades::PathFades(std::string satellite, RandomStream stream)
    : satellite_(std::move(satellite)), stream_(stream) {}

void PathFades::next_epoch() {
  std::swap(before_, now_);
  now_.clear();
}

void PathFades::clear() {
  before_.clear();
  now_.clear();
}

const PathFades::Fade* PathFades::before(std::uint64_t reflector, bool diffuse) const {
  for (const Fade& fade : before_)
    if (fade.reflector == reflector && fade.diffuse == diffuse) return &fade;
  return nullptr;
}

std::complex<double> PathFades::draw() {
  const double real = stream_.normal();
  const double imaginary = stream_.normal();
  return std::complex<double>(real, imaginary) * std::sqrt(0.5);
}

std::complex<double> PathFades::fixed(const PathPhases& phases, std::uint64_t reflector) {
  const Fade* known = before(reflector, false);
  const std::complex<double> value =
      known != nullptr ? known->value : std::polar(1.0, phases.phase_rad(satellite_, reflector));
  now_.push_back({reflector, false, value});
  return value;
}

std::complex<double> PathFades::rayleigh(std::uint64_t reflector, double decay) {
  assert(decay >= 0);
  const Fade* known = before(reflector, true);
  std::complex<double> value;
  if (known == nullptr)
    value = draw();
  else if (decay == 0)
    value = known->value;
  else
    value = std::exp(-decay) * known->value + std::sqrt(-std::expm1(-2 * decay)) * draw();
  now_.push_back({reflector, true, value});
  return value;
}

PathPhases::PathPhases(std::uint64_t seed, std::string_view receiver)
    : seed_(seed), prefix_(fmt::format("{}/phase/", receiver)) {}

double PathPhases::phase_rad(std::string_view satellite, std::uint64_t reflector) const {
  fmt::memory_buffer key;
  fmt::format_to(std::back_inserter(key), "{}{}/{}", prefix_, satellite, reflector);
  RandomStream stream(seed_, std::string_view(key.data(), key.size()));
  const double cycles = stream.uniform();
  // (-0.5, 0.5] cycles
  return 2 * geodesy::kPi * (cycles - std::ceil(cycles - 0.5));
}

double path_rate_mps(const orbit::LineOfSight& line, const Eigen::Vector3d& antenna_velocity_ecef,
                     const propagation::Path& path, const Eigen::Matrix3d& ecef_from_enu) {
  const Eigen::Vector3d& e = line.direction_ecef;
  const Eigen::Vector3d& satellite = line.velocity_at_reception_mps;
  if (path.kind == propagation::PathKind::Transmitted) return path.range_rate_mps;
  double rate = e.dot(satellite);
  if (path.kind == propagation::PathKind::Direct) {
    rate -= e.dot(antenna_velocity_ecef);
  } else {
    const Eigen::Vector3d arrival = ecef_from_enu * path.arrival;
    rate -= (arrival + ecef_from_enu * path.scattering_offset).dot(antenna_velocity_ecef);
    const Eigen::Vector3d relative = satellite - antenna_velocity_ecef;
    const Eigen::Vector3d rotation_rate = (relative - e * e.dot(relative)) / line.range_m;
    const Eigen::Vector3d normal = e - arrival;
    const double squared = normal.squaredNorm();
    if (path.order == 2) {
      const Eigen::Vector3d between = path.point - path.far_point;
      rate += rotation_rate.dot(ecef_from_enu * between - path.leg_m * arrival +
                                (path.leg_m + between.norm()) * e);
    } else if (squared > 1e-8) {  // at grazing incidence e and a agree and the excess is zero
      rate += 2 * path.excess_m * normal.dot(rotation_rate) / squared;
    }
  }
  const Eigen::Vector3d omega(0, 0, geodesy::kEarthRotationRate);
  const Eigen::Vector3d inertial = satellite + omega.cross(line.position_at_reception_m);
  return rate / (1 + e.dot(inertial) / geodesy::kSpeedOfLight);
}

}  // namespace canyon::tracking
