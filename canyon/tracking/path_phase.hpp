#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace canyon::tracking {

/// Random carrier phases of paths: phi0 uniform on (-pi, pi], drawn from seed, receiver, satellite and
/// reflector alone, since no model of a city knows a wall to centimetres. The detour's part, -2 pi excess /
/// wavelength, is in signal::path_amplitude(): the exact integral of the fading, without memory. Const,
/// thread-safe.
class PathPhases {
 public:
  PathPhases(std::uint64_t seed, std::string_view receiver);

  /// [rad]. @param satellite e.g. "G05"; @param reflector any number that stays the same while the signal
  /// comes over the same surface
  [[nodiscard]] double phase_rad(std::string_view satellite, std::uint64_t reflector) const;

 private:
  std::uint64_t seed_;
  std::string prefix_;
};

/// Frequency of a path against the one that is tracked [Hz], -excess_rate / wavelength, excess_rate that of
/// its length against the other's: SignalPath::fading_hz.
[[nodiscard]] inline double fading_rate_hz(double excess_rate_mps, double wavelength_m) {
  return -excess_rate_mps / wavelength_m;
}

}  // namespace canyon::tracking
