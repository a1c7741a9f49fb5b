#include "canyon/base/random.hpp"

#include <cassert>
#include <cmath>
#include <numeric>
#include <utility>

#include "canyon/base/text.hpp"

namespace canyon {

namespace {

constexpr std::uint64_t rotate_left(std::uint64_t x, int k) {
  return (x << k) | (x >> (64 - k));
}

/// SplitMix64 (Steele, Lea & Flood 2014): steps `state` and returns its scrambled value.
std::uint64_t split_mix(std::uint64_t& state) {
  return mix64(state += kGolden64);
}

}  // namespace

RandomStream::RandomStream(std::uint64_t seed, std::string_view key) {
  // Spreads neighbouring seeds over all bits before the key is mixed in.
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
  // (u, v) uniform on (0, 1] x [-sqrt(2/e), sqrt(2/e)); v/u is normal if u <= exp(-(v/u)^2 / 4).
  constexpr double kTwoSqrtTwoOverE = 1.7155277699214135;
  for (;;) {
    const double u = static_cast<double>((next() >> 11) + 1) * 0x1.0p-53;
    const double v = kTwoSqrtTwoOverE * (uniform() - 0.5);
    const double x = v / u;
    // The tangent of -4 ln(u) at exp(-1/4) is below the curve, so most samples need no logarithm.
    constexpr double kFourFourthRootOfE = 5.136101666750966;
    if (x * x <= 5 - kFourFourthRootOfE * u || x * x <= -4 * std::log(u)) return x;
  }
}

std::vector<double> draw_sample(RandomStream random, std::size_t n, bool latin) {
  std::vector<double> fractions(n);
  for (double& fraction : fractions) fraction = random.uniform();
  if (!latin) return fractions;
  std::vector<std::size_t> strata(n);
  std::iota(strata.begin(), strata.end(), std::size_t{0});
  for (std::size_t i = n; i-- > 1;)
    std::swap(strata[i], strata[static_cast<std::size_t>(random.uniform() * static_cast<double>(i + 1))]);
  for (std::size_t i = 0; i < n; ++i)
    fractions[i] = (static_cast<double>(strata[i]) + fractions[i]) / static_cast<double>(n);
  return fractions;
}

}  // namespace canyon
