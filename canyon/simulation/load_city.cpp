#include "canyon/simulation/load_city.hpp"

#include "canyon/city/mesh_file.hpp"
#include "canyon/city/synthetic_city.hpp"

namespace canyon::simulation {

city::City load_city(const CityConfig& config) {
  if (config.mesh) return city::read_mesh_city(*config.mesh, config.import);
  if (config.synthetic) return city::synthetic_city(*config.synthetic);
  city::City field;
  field.name = "open field";
  config.import.validate();
  field.frame = geodesy::LocalFrame(config.import.origin);
  return field;
}

}  // namespace canyon::simulation
