#pragma once

#include <cstdint>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/options/fwd.hpp"
#include "canyon/city/fwd.hpp"

namespace canyon::city {

/// A synthetic downtown: a grid of streets with blocks of buildings, seeded heights, flat ground.
struct SyntheticCityOptions {
  geodesy::Geodetic origin = geodesy::Geodetic::from_degrees(22.3, 114.17, 0);
  int blocks_east = 8;         ///< 1 to 200
  int blocks_north = 8;        ///< 1 to 200
  double block_size_m = 60;    ///< 10 to 500
  double street_width_m = 16;  ///< 4 to 100
  double min_height_m = 12;    ///< 1 to 1000
  double max_height_m = 120;   ///< at least min_height_m; most heights are low, tall ones in the middle
  std::uint64_t seed = 1;
  /// Throws InputError with the field and its bound.
  void validate() const;
};
void visit(options::Visitor& v, SyntheticCityOptions& o);

/// The origin is in the middle of the central crossing, on the ground. Equal options give equal cities.
[[nodiscard]] City synthetic_city(const SyntheticCityOptions& options);

}  // namespace canyon::city
