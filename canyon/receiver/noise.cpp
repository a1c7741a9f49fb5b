#include "canyon/receiver/noise.hpp"

#include <fmt/format.h>

#include <cassert>
#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

namespace canyon::receiver {
namespace {

constexpr std::uint64_t rotate_left(std::uint64_t x, int k) {
  return (x << k) | (x >> (64 - k));
}

/// SplitMix64 (Steele, Lea & Flood 2014): steps `state` and returns its scrambled value.
std::uint64_t split_mix(std::uint64_t& state) {
  state += 0x9e3779b97f4a7c15U;
  std::uint64_t z = state;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
  return z ^ (z >> 31);
}

}  // namespace

RandomStream::RandomStream(std::uint64_t seed, std::string_view key) {
  // Neighbouring seeds are spread over all bits before the key comes in.
  std::uint64_t mixer = split_mix(seed) ^ fnv1a(key);
  for (std::uint64_t& word : state_) word = split_mix(mixer);
}

RandomStream RandomStream::from_state(const std::array<std::uint64_t, 4>& state) {
  assert((state != std::array<std::uint64_t, 4>{}));
  RandomStream stream;
  stream.state_ = state;
  return stream;
}

std::uint64_t RandomStream::next() {
  const std::uint64_t result = rotate_left(state_[0] + state_[3], 23) + state_[0];
  const std::uint64_t t = state_[1] << 17;
  state_[2] ^= state_[0];
  state_[3] ^= state_[1];
  state_[1] ^= state_[2];
  state_[0] ^= state_[3];
  state_[2] ^= t;
  state_[3] = rotate_left(state_[3], 45);
  return result;
}

double RandomStream::uniform() {
  return static_cast<double>(next() >> 11) * 0x1.0p-53;
}

double RandomStream::normal() {
  // (u, v) uniform on (0, 1] x [-sqrt(2/e), sqrt(2/e)); v/u is normal where u <= exp(-(v/u)^2 / 4).
  constexpr double kTwoSqrtTwoOverE = 1.7155277699214135;
  for (;;) {
    const double u = static_cast<double>((next() >> 11) + 1) * 0x1.0p-53;
    const double v = kTwoSqrtTwoOverE * (uniform() - 0.5);
    const double x = v / u;
    if (x * x <= -4 * std::log(u)) return x;
  }
}

double OuOptions::standard_deviation_m() const {
  return sigma_m_per_sqrt_s / std::sqrt(2 * theta_per_s);
}

void OuOptions::validate() const {
  if (!(theta_per_s > 0) || !std::isfinite(theta_per_s)) {
    throw InputError(fmt::format("theta_per_s of the OU noise is {}", theta_per_s),
                     "it must be above 0 per second");
  }
  if (!std::isfinite(mu_m)) {
    throw InputError(fmt::format("mu_m of the OU noise is {}", mu_m), "it must be a finite number of metres");
  }
  if (!(sigma_m_per_sqrt_s >= 0) || !std::isfinite(sigma_m_per_sqrt_s)) {
    throw InputError(fmt::format("sigma_m_per_sqrt_s of the OU noise is {}", sigma_m_per_sqrt_s),
                     "it must be 0 or more m/sqrt(s)");
  }
}

OuProcess::OuProcess(const OuOptions& options, RandomStream stream) : options_(options), stream_(stream) {
  options_.validate();
}

double OuProcess::advance(double dt_s, double mu_m) {
  if (!(dt_s >= 0) || !std::isfinite(dt_s)) {
    throw InputError(fmt::format("a noise process cannot step by {} s", dt_s),
                     "give epochs in order of time");
  }
  if (!started_) {
    started_ = true;
    value_ = mu_m + options_.standard_deviation_m() * stream_.normal();
    return value_;
  }
  if (dt_s == 0) return value_;
  // expm1 keeps short steps exact: 1 - e^-x loses all digits of x below 1e-16.
  const double decay = std::exp(-options_.theta_per_s * dt_s);
  const double kept = std::sqrt(-std::expm1(-2 * options_.theta_per_s * dt_s));
  value_ = mu_m + (value_ - mu_m) * decay + options_.standard_deviation_m() * kept * stream_.normal();
  return value_;
}

}  // namespace canyon::receiver
