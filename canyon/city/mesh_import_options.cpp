#include "canyon/city/mesh_import_options.hpp"

#include <fmt/format.h>

#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"

namespace canyon::city {

void MeshImportOptions::validate() const {
  geodesy::check_geodetic(origin, "city origin");
  if (!offset_m.allFinite() || offset_m.norm() > 1e6) {
    throw InputError("city offset must be finite and at most 1,000 km",
                     "give east_m, north_m and up_m in metres");
  }
  if (!std::isfinite(heading_rad) || std::abs(heading_rad) > 2 * geodesy::kPi) {
    throw InputError(fmt::format("city heading {} rad lies outside [-2 pi, 2 pi]", heading_rad),
                     "give the angle in the unit that its key names");
  }
  if (!(scale > 0) || !(scale <= 1e6)) {
    throw InputError(fmt::format("city scale {} lies outside (0, 1e6]", scale),
                     "1 keeps the unit that the file declares");
  }
  if (up_axis && *up_axis != 'Y' && *up_axis != 'Z') {
    throw InputError(fmt::format("city up axis '{}' is neither Y nor Z", *up_axis));
  }
}

}  // namespace canyon::city
