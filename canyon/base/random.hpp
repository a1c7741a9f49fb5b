#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace canyon {

/// Finaliser of SplitMix64 (G. L. Steele, D. Lea, C. H. Flood, OOPSLA 2014, figure 18): neighbours have
/// nothing in common. A bijection; 0 stays 0.
[[nodiscard]] constexpr std::uint64_t mix64(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
  return z ^ (z >> 31);
}
/// Step of SplitMix64's state, and of hashes that mix64() makes of sequences.
inline constexpr std::uint64_t kGolden64 = 0x9e3779b97f4a7c15U;

/// A seeded stream of random numbers whose bytes do not depend on the standard library, the machine, or what
/// other streams do. Streams of one seed and different keys are independent.
///
/// xoshiro256++ (Blackman & Vigna 2019), its state drawn by SplitMix64 from the seed and the key's FNV-1a
/// hash.
class RandomStream {
 public:
  RandomStream(std::uint64_t seed, std::string_view key);
  /// A stream that continues from a generator state, which must not be all zeros.
  [[nodiscard]] static RandomStream from_state(const std::array<std::uint64_t, 4>& state);

  [[nodiscard]] std::uint64_t next();
  /// Uniform in [0, 1), 53 bits.
  [[nodiscard]] double uniform();
  /// Standard normal, by the ratio of uniforms (Kinderman & Monahan 1977): exact in distribution, and the
  /// value comes from one product and one quotient, so that no library's log() or cos() shows in its last
  /// bits.
  [[nodiscard]] double normal();

 private:
  RandomStream() = default;

  std::array<std::uint64_t, 4> state_{};
};

/// Shares [0, 1) of one axis for `n` points. Drawn alone, or as a Latin hypercube (McKay, Beckman, Conover,
/// Technometrics 21, 1979): each of the n strata [k/n, (k+1)/n) has one point, and axes with independent
/// streams have their strata in independent orders.
[[nodiscard]] std::vector<double> draw_sample(RandomStream random, std::size_t n, bool latin);

}  // namespace canyon
