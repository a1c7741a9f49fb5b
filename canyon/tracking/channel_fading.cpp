#include "canyon/tracking/channel_fading.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>
#include <utility>

#include "canyon/geodesy/constants.hpp"

namespace canyon::tracking {

double integrated_power(std::complex<double> s_per_s, double integration_s) {
  const std::complex<double> x = s_per_s * integration_s;
  // The series where the differences lose digits; the next term is x^3 / 60.
  if (std::abs(x) < 1e-3) return (1.0 - x / 3.0 + x * x / 12.0).real();
  const std::complex<double> inverse = std::conj(x) / std::norm(x);
  return 2 * (inverse - (1.0 - std::exp(-x)) * inverse * inverse).real();
}

double filtered_share(std::complex<double> s_per_s, double loop_bandwidth_hz) {
  const double k = 4 * loop_bandwidth_hz;
  return k * (k + s_per_s.real()) / std::norm(k + s_per_s);
}

BundleShare bundle_share(std::complex<double> s_per_s, double loop_bandwidth_hz, double integration_s) {
  const double k = 4 * loop_bandwidth_hz;
  const double share = filtered_share(s_per_s, loop_bandwidth_hz);
  BundleShare result;
  result.frequency_hz =
      std::min(std::sqrt(std::max(0.0, 1 / share - 1)) * k / (2 * geodesy::kPi), 0.1 / integration_s);
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
  for (const Fade& fade : before_) {
    if (fade.reflector == reflector && fade.diffuse == diffuse) return &fade;
  }
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
  if (known == nullptr) {
    value = draw();
  } else if (decay == 0) {
    value = known->value;
  } else {
    value = std::exp(-decay) * known->value + std::sqrt(-std::expm1(-2 * decay)) * draw();
  }
  now_.push_back({reflector, true, value});
  return value;
}

}  // namespace canyon::tracking
