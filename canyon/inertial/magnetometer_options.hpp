#pragma once

#include <cstdint>
#include <optional>

#include "canyon/inertial/imu_options.hpp"
#include "canyon/options/fwd.hpp"

namespace canyon::inertial {

/// Parts, which give the numbers that are not stated; docs/imu.md has their sources.
enum class MagnetometerProfile : std::uint8_t { Ideal, Ist8310, Rm3100 };

/// A magnetometer of three axes on the vehicle. Empty numbers: by the profile.
struct MagnetometerOptions {
  MagnetometerProfile profile = MagnetometerProfile::Ist8310;
  double rate_hz = 50;  ///< samples, [0.1, 1000]
  ImuAxes axes = ImuAxes::Flu;
  Orientation orientation;
  std::optional<double> noise_ut;             ///< standard deviation of a sample, [0, 100]
  std::optional<double> bias_instability_ut;  ///< lowest Allan deviation, [0, 100]
  std::optional<double> hard_iron_ut;         ///< standard deviation of the field of the vehicle, [0, 1000]
  std::optional<double> soft_iron;            ///< standard deviation of each element of I + M, [0, 1]
  std::optional<double> resolution_ut;        ///< step of the reading, [0, 100]; 0: none
  std::optional<double> range_ut;             ///< largest value, (0, 1e6]; infinity: no limit
  double delay_s = 0;                         ///< age of the field that a sample states, [0, 10]
  double surroundings_ut = 0;  ///< standard deviation of the field of things by the way, [0, 1000]
  double surroundings_m = 10;  ///< way after which it is another, [0.1, 10000]

  void validate() const;
};

/// The numbers of the options, those of the profile where they are empty [T].
[[nodiscard]] TriadNumbers magnetometer_numbers(const MagnetometerOptions& options);

void visit(options::Visitor& v, MagnetometerOptions& o);

}  // namespace canyon::inertial
