#pragma once

#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <span>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/options/fwd.hpp"
#include "canyon/base/options/switch.hpp"
#include "canyon/base/random.hpp"
#include "canyon/base/thread_cache.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/gnss/signal_groups.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::sky {

/// Broadcast ionosphere delay [m] on `frequency_hz` (IS-GPS-200, 20.3.3.5.2.5; scaled from L1 by f^-2).
/// 0 at or below the horizon.
[[nodiscard]] double klobuchar_delay_m(const gnss::Klobuchar& model, geodesy::GpsTime t,
                                       const geodesy::Geodetic& receiver, double azimuth_rad,
                                       double elevation_rad, double frequency_hz);

/// Coefficients, and the system that broadcasts them.
using SystemKlobuchar = std::map<gnss::System, gnss::Klobuchar>::value_type;
/// Broadcast ionosphere delay by the formula of the coefficients' system: BeiDou uses geographic latitudes, a
/// shell at 375 km and its own limits, and is scaled from B1I (BDS-SIS-ICD-B1I-3.0, 5.2.4.7).
[[nodiscard]] double klobuchar_delay_m(const SystemKlobuchar& system_entry, geodesy::GpsTime t,
                                       const geodesy::Geodetic& receiver, double azimuth_rad,
                                       double elevation_rad, double frequency_hz);

/// Troposphere delay [m]: Saastamoinen's zenith delay in the standard atmosphere with 70 % humidity at the
/// receiver's height (as RTKLIB's tropmodel from -100 m to its limit of 10 km), mapped by slant_delay_m().
/// Continuous in height: below sea level the value of sea level, above 11 km falling by 1/e in 6.3 km. 0 at
/// or below the horizon.
[[nodiscard]] double saastamoinen_delay_m(const geodesy::Geodetic& receiver, double elevation_rad,
                                          double relative_humidity = 0.7);
/// The same at the zenith [m].
[[nodiscard]] double saastamoinen_zenith_m(const geodesy::Geodetic& receiver, double relative_humidity = 0.7);
/// A zenith delay mapped as in RTCA DO-229: within 1 % of Niell's from 2.5 deg up. 0 at or below the horizon.
[[nodiscard]] double slant_delay_m(double zenith_m, double elevation_rad);

/// Klobuchar coefficients of a system, else of GPS, with their system. Throws InputError if there are
/// neither.
[[nodiscard]] const SystemKlobuchar& klobuchar_of(const std::map<gnss::System, gnss::Klobuchar>& klobuchar,
                                                  gnss::System system);

/// Delay by the requested models of ionosphere (klobuchar_of()) and troposphere (saastamoinen_delay_m()) [m].
/// Throws InputError if the ionosphere has no coefficients.
[[nodiscard]] double atmosphere_m(bool ionosphere, bool troposphere,
                                  const std::map<gnss::System, gnss::Klobuchar>& klobuchar,
                                  gnss::System system, double carrier_frequency_hz, geodesy::GpsTime time,
                                  const geodesy::Geodetic& position,
                                  const geodesy::AzimuthElevation& look_angles);

// Range errors unknown to receivers: of broadcast orbits and clocks, and of the models by which receivers
// correct the atmosphere. docs/errors.md has the budget.
/// A random function of time and position with mean 0 and variance 1 over its realizations: a sum of waves of
/// equal amplitude, with frequencies and wave vectors sampled from a normal spectral density and uniform
/// phases (spectral representation: M. Shinozuka, G. Deodatis, Appl. Mech. Rev. 44(4), 1991). Its
/// autocorrelation is exp(-dt^2 / (2 time^2) - dx^2 / (2 length^2)). It is smooth and stateless: the value at
/// each instant and position does not depend on the order of calls.
class RandomWaves {
 public:
  /// @param time_s > 0; @param length_m > 0, infinite: equal at all positions
  RandomWaves(RandomStream stream, double time_s, double length_m);
  /// @param point in a frame common to all callers [m]
  [[nodiscard]] double at(geodesy::GpsTime time, const Eigen::Vector3d& point) const;

 private:
  using Waves = std::array<double, 24>;
  Waves frequency_hz_, x_per_m_, y_per_m_, z_per_m_, phase_cycles_;
};

/// Range errors of a satellite's signals at one position and instant.
struct RangeErrors {
  /// Error of the satellite's broadcast orbit and clock, in code and phase alike [m].
  double orbit_clock_m = 0;
  /// The true ionosphere: delay of a code at 1575.42 MHz [m], of others by f^-2, an advance of phases. 0
  /// without a broadcast model.
  double ionosphere_m = 0;
  double troposphere_m = 0;  ///< the true delay [m]
};

struct RangeErrorOptions {
  /// Default: on with nominal satellites and navigation files, and if a receiver uses corrections.
  options::Switch enabled = false;
  /// Range error of broadcast orbit and clock, standard deviation by groups of signals [m], [0, 1e4].
  /// Defaults: global mean signal-in-space range errors of 2017 (O. Montenbruck, P. Steigenberger, A.
  /// Hauschild, Adv. Space Res. 61(12), 2018); QZSS and SBAS are assumed equal to GPS.
  gnss::GroupValues orbit_clock_m{{"BeiDou", 1},    {"GLONASS", 2}, {"GPS", 0.6},
                                  {"Galileo", 0.2}, {"QZSS", 0.6},  {"SBAS", 0.6}};
  double orbit_clock_time_s = 3600;  ///< [60, 1e6]; assumed: between two uploads and updates
  /// Standard deviation of the broadcast model's error over its slant delay [1], [0, 2]. The model removes at
  /// least half of the error's rms (IS-GPS-200, 20.3.3.5.2.5): s / sqrt(1 + s^2) = 0.5 gives 0.58.
  double ionosphere_fraction = 0.6;
  double ionosphere_time_s = 7200;  ///< [60, 1e6]; assumed
  /// Solar flux at 10.7 cm of a sky without its own coefficients [sfu], [50, 400]. Default: medium activity
  /// with nominal satellites, else the mean of the date's year.
  std::optional<double> solar_flux_sfu;
  double ionosphere_length_m = 1.8e6;  ///< [1e3, 1e8]; assumed: with ionosphere_fraction a gradient of mm/km
  /// Deviation of the zenith delay from the standard atmosphere, sigma [m], [0, 1]; assumed: 0.05 by weather.
  double troposphere_m = 0.05;
  double troposphere_time_s = 10'800;  ///< [60, 1e6]; assumed
  double troposphere_length_m = 3e5;   ///< [1e3, 1e8]; assumed
  /// Throws InputError with the field that is out of range.
  void validate() const;
};
void visit(options::Visitor& v, RangeErrorOptions& o);

/// The errors of one run, equal for all of its receivers and bands: functions of satellite, position and
/// time, sampled by the seed. Const and thread-safe.
///
/// Orbit and clock: one part along the line of sight, equal everywhere, and along-track and cross-track
/// errors of the satellite, of which 2 % affect a range. Ionosphere: the broadcast model of GPS at the pierce
/// point of a shell at 350 km, times 1 plus a smooth field of the shell, plus travelling disturbances.
/// Troposphere: Saastamoinen's zenith delay plus a smooth field of zenith delays, mapped as in RTCA DO-229.
class RangeErrorModel {
 public:
  /// @param klobuchar GPS's, or the first available; empty: no ionosphere
  RangeErrorModel(const RangeErrorOptions& options, std::uint64_t seed,
                  std::span<const gnss::SatelliteId> satellites,
                  const std::map<gnss::System, gnss::Klobuchar>& klobuchar);

  /// The same budget sampled with another seed, for some of the satellites.
  [[nodiscard]] RangeErrorModel sampled_by(std::uint64_t seed,
                                           std::span<const gnss::SatelliteId> satellites) const;

  [[nodiscard]] const RangeErrorOptions& options() const { return options_; }
  [[nodiscard]] bool has_ionosphere() const { return !klobuchar_.empty(); }
  /// Data common to all satellites of an epoch.
  struct Reception {
    geodesy::GpsTime time;
    Eigen::Vector3d receiver_ecef = Eigen::Vector3d::Zero();
    geodesy::Geodetic position;
    double zenith_m = 0;  ///< the troposphere's true zenith delay
  };
  /// @param receiver_ecef [m]
  [[nodiscard]] Reception reception(geodesy::GpsTime time, const Eigen::Vector3d& receiver_ecef) const;
  /// @param line of a satellite for this reception
  [[nodiscard]] RangeErrors at(const orbit::LineOfSight& line, const Reception& reception) const;

 private:
  struct OfSatellite {
    double range_m;  ///< standard deviation
    RandomWaves range, along, cross;
  };
  [[nodiscard]] double orbit_clock_m(const orbit::LineOfSight& line, geodesy::GpsTime reception) const;
  [[nodiscard]] double ionosphere_m(const orbit::LineOfSight& line, const Reception& reception) const;

  RangeErrorOptions options_;
  std::map<gnss::SatelliteId, OfSatellite> satellites_;
  std::uint64_t number_ = next_cache_id();             ///< copies share it
  std::map<gnss::System, gnss::Klobuchar> klobuchar_;  ///< one or none
  RandomWaves ionosphere_, travelling_, troposphere_;
};

}  // namespace canyon::sky
