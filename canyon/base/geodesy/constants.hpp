#pragma once

namespace canyon::geodesy {

/// Speed of light in vacuum [m/s] (IS-GPS-200, 20.3.4.3; exact by SI).
inline constexpr double kSpeedOfLight = 299792458.0;
/// Earth's rotation rate [rad/s], WGS 84 (IS-GPS-200, table 20-IV). Also for every Sagnac correction.
inline constexpr double kEarthRotationRate = 7.2921151467e-5;

/// WGS 84 (NGA.STND.0036, table 3.1): semi-major axis [m], flattening, GM with the atmosphere [m^3/s^2]; and
/// the dynamic form factor J2 (EGM96; Vallado, Fundamentals of Astrodynamics, appendix D).
inline constexpr double kSemiMajorAxis = 6'378'137;
inline constexpr double kFlattening = 1 / 298.257223563;
inline constexpr double kEarthMu = 3.986004418e14;
inline constexpr double kEarthJ2 = 1.08262668e-3;
/// PZ-90.11, for GLONASS (ICD GLONASS L1, L2 5.1, table 3.2 and A.3.1.2): the same constants, and the Earth's
/// rotation rate [rad/s].
inline constexpr double kPz90SemiMajorAxis = 6'378'136;
inline constexpr double kPz90Mu = 3.986004418e14;
inline constexpr double kPz90J2 = 1.08262575e-3;
inline constexpr double kPz90RotationRate = 7.292115e-5;

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
