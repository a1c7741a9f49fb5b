#pragma once

namespace canyon::geodesy {

/// Speed of light in vacuum [m/s] (IS-GPS-200, 20.3.4.3; exact by SI).
inline constexpr double kSpeedOfLight = 299792458.0;
/// Earth's rotation rate [rad/s], WGS 84 (IS-GPS-200, table 20-IV). The Sagnac correction of every system
/// uses it.
inline constexpr double kEarthRotationRate = 7.2921151467e-5;

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr double kRadiansPerDegree = kPi / 180.0;
inline constexpr double kDegreesPerRadian = 180.0 / kPi;

[[nodiscard]] constexpr double radians(double degrees) {
  return degrees * kRadiansPerDegree;
}
[[nodiscard]] constexpr double degrees(double radians) {
  return radians * kDegreesPerRadian;
}

}  // namespace canyon::geodesy
