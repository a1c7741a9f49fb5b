#include "canyon/simulation/georeference.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/random.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::simulation {

std::optional<CityShift> draw_city_shift(const Georeference& georeference, std::uint64_t seed) {
  if (georeference.sigma_m == 0 && georeference.heading_sigma_rad == 0) return std::nullopt;
  RandomStream stream(seed, "georeference");
  CityShift shift;
  shift.east_m = georeference.sigma_m * stream.normal();
  shift.north_m = georeference.sigma_m * stream.normal();
  shift.heading_rad = georeference.heading_sigma_rad * stream.normal();
  return shift;
}

void move_city(city::City& city, const CityShift& shift) {
  if (city.mesh.vertices.empty()) return;
  const city::Box bounds = city.bounds();
  const Eigen::Vector2d middle = 0.5 * (bounds.min + bounds.max).head<2>();
  const Eigen::Rotation2Dd rotation(shift.heading_rad);
  const Eigen::Vector2d offset(shift.east_m, shift.north_m);
  for (Eigen::Vector3d& vertex : city.mesh.vertices) {
    const Eigen::Vector2d arm = vertex.head<2>() - middle;
    vertex.head<2>() = middle + rotation * arm + offset;
  }
}

std::string describe(const CityShift& shift) {
  return fmt::format("city moved by east {:.1f} m, north {:.1f} m, turned {:.2f} deg (georeference)",
                     shift.east_m, shift.north_m, geodesy::degrees(shift.heading_rad));
}

}  // namespace canyon::simulation
