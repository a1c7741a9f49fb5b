#include "canyon/tracking/path_phase.hpp"

#include <fmt/format.h>

#include <cmath>
#include <iterator>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/tracking/noise.hpp"

namespace canyon::tracking {

PathPhases::PathPhases(std::uint64_t seed, std::string_view receiver)
    : seed_(seed), prefix_(fmt::format("{}/phase/", receiver)) {}

double PathPhases::phase_rad(std::string_view satellite, std::uint64_t reflector, double excess_m,
                             double wavelength_m) const {
  if (!std::isfinite(excess_m) || !(wavelength_m > 0) || !std::isfinite(wavelength_m)) {
    throw InputError(
        fmt::format("a path of {} m at a wavelength of {} m has no phase", excess_m, wavelength_m),
        "both must be finite and the wavelength above 0");
  }
  fmt::memory_buffer key;
  fmt::format_to(std::back_inserter(key), "{}{}/{}", prefix_, satellite, reflector);
  RandomStream stream(seed_, std::string_view(key.data(), key.size()));
  const double cycles = stream.uniform() - excess_m / wavelength_m;
  // (-0.5, 0.5] cycles
  return 2 * geodesy::kPi * (cycles - std::ceil(cycles - 0.5));
}

double excess_rate_mps(const Eigen::Vector3d& satellite, const Eigen::Vector3d& arrival,
                       const Eigen::Vector3d& velocity, double excess_m,
                       const Eigen::Vector3d& satellite_rate) {
  const Eigen::Vector3d between = satellite - arrival;
  const double square = between.squaredNorm();
  if (!(square > 0)) return 0;
  return between.dot(velocity) + 2 * excess_m * between.dot(satellite_rate) / square;
}

}  // namespace canyon::tracking
