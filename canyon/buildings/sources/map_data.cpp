#include "canyon/buildings/sources/map_data.hpp"

#include <fmt/format.h>

#include <cmath>

#include "canyon/base/input_error.hpp"

namespace canyon::buildings {

void LonLatBox::validate() const {
  const auto check = [](double value, double limit, const char* bound) {
    if (!(std::abs(value) <= limit)) {
      throw InputError(fmt::format("{} bound of the box is {} deg", bound, value),
                       fmt::format("it must be within [-{0}, {0}]; a box is west,south,east,north", limit));
    }
  };
  check(west, 180, "west");
  check(south, 90, "south");
  check(east, 180, "east");
  check(north, 90, "north");
  if (west > east) {
    throw InputError(fmt::format("west bound {} of the box is east of its east bound {}", west, east),
                     "a box is west,south,east,north; where it crosses the antimeridian, build its two sides "
                     "apart");
  }
  if (!(west < east)) throw InputError(fmt::format("the box has no width: west = east = {}", west));
  if (!(south < north)) {
    throw InputError(fmt::format("south bound {} of the box is not below its north bound {}", south, north),
                     "a box is west,south,east,north");
  }
}

}  // namespace canyon::buildings
