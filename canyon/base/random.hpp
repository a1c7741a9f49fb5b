#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>
#include <vector>

namespace canyon {

/// Finaliser of SplitMix64 (G. L. Steele, D. Lea, C. H. Flood, OOPSLA 2014, figure 18): decorrelates
/// neighbouring inputs. A bijection; 0 stays 0.
[[nodiscard]] constexpr std::uint64_t mix64(std::uint64_t z) {
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9U;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebU;
  return z ^ (z >> 31);
}
/// Increment of SplitMix64's state, and of hashes of sequences by mix64().
inline constexpr std::uint64_t kGolden64 = 0x9e3779b97f4a7c15U;

/// A seeded stream of random numbers. Its bytes do not depend on the standard library, the machine or other
/// streams. Streams of one seed with different keys are independent.
/// xoshiro256++ (Blackman & Vigna 2019), seeded by SplitMix64 from the seed and the key's FNV-1a hash.
class RandomStream {
 public:
  RandomStream(std::uint64_t seed, std::string_view key);
  /// A stream that continues from a generator state, which must not be all zeros.
  [[nodiscard]] static RandomStream from_state(const std::array<std::uint64_t, 4>& state);

  [[nodiscard]] std::uint64_t next();
  /// Uniform in [0, 1), 53 bits.
  [[nodiscard]] double uniform();
  /// Standard normal, by the ratio of uniforms (Kinderman & Monahan 1977): exact in distribution. The value
  /// comes from one product and one quotient, so its last bits do not depend on the library's log() or cos().
  [[nodiscard]] double normal();

 private:
  RandomStream() = default;

  std::array<std::uint64_t, 4> state_{};
};

/// Fractions [0, 1) of one axis for `n` points, sampled independently or as a Latin hypercube (McKay,
/// Beckman, Conover, Technometrics 21, 1979): each of the n strata [k/n, (k+1)/n) has one point, and axes
/// with independent streams have their strata in independent orders.
[[nodiscard]] std::vector<double> draw_sample(RandomStream random, std::size_t n, bool latin);

}  // namespace canyon
