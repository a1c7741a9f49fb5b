#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <string>
#include <string_view>

namespace canyon::tracking {

/// Carrier phases of paths: random where a model cannot know them, driven by geometry where it can.
///
/// A path that is `excess` metres longer than the direct one arrives with
///   phase = phi0 - 2 pi excess / wavelength,
/// phi0 uniform on [0, 2 pi), drawn from seed, receiver, satellite and reflector alone: no model of a city
/// knows a wall to centimetres. Writing the phase with the excess path itself is the exact integral of
/// d(phase)/dt = -2 pi / wavelength d(excess)/dt, so it needs no memory and does not depend on the steps, on
/// their order, or on what else arrives. Const, thread-safe.
class PathPhases {
 public:
  PathPhases(std::uint64_t seed, std::string_view receiver);

  /// Phase [rad] in (-pi, pi].
  /// @param satellite e.g. "G05"; @param reflector any number that stays the same while the signal comes over
  /// the same surface; @param excess_m finite; @param wavelength_m > 0
  [[nodiscard]] double phase_rad(std::string_view satellite, std::uint64_t reflector, double excess_m,
                                 double wavelength_m) const;

 private:
  std::uint64_t seed_;
  std::string prefix_;
};

/// Rate [m/s] at which a path over a plane mirror at rest grows against the direct path:
///   (e - a) . v + 2 m (e - a) . e' / |e - a|^2
/// with antenna velocity v. The first term is the difference of the two Doppler shifts; the second is the
/// satellite's motion over the sky (1.5e-4 rad/s for GPS: centimetres per second), as in docs/receiver.md.
/// @param satellite unit vector e from antenna to satellite; @param arrival unit vector a from the antenna to
/// where the path comes from; @param velocity of the antenna [m/s]; all in one frame
/// @param excess_m m; @param satellite_rate e' [rad/s], the change of e by the satellite's motion alone
/// 0 where both directions coincide (a direct path).
[[nodiscard]] double excess_rate_mps(const Eigen::Vector3d& satellite, const Eigen::Vector3d& arrival,
                                     const Eigen::Vector3d& velocity, double excess_m = 0,
                                     const Eigen::Vector3d& satellite_rate = Eigen::Vector3d::Zero());

/// Frequency of a path against the direct one [Hz], -excess_rate / wavelength: SignalPath::fading_hz where
/// the direct path is tracked. Where another is, subtract that one's.
[[nodiscard]] inline double fading_rate_hz(double excess_rate_mps, double wavelength_m) {
  return -excess_rate_mps / wavelength_m;
}

}  // namespace canyon::tracking
