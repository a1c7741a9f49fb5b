#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <optional>
#include <span>
#include <vector>

#include "canyon/city/fwd.hpp"
#include "canyon/options/fwd.hpp"

namespace canyon::validation {

/// Where cities are compared, and how finely.
struct CityAgreementOptions {
  int places = 500;       ///< [1, 100,000]
  int directions = 1000;  ///< of each place, evenly over the sky; [10, 100,000]
  double mask_deg = 5;    ///< lowest elevation; [0, 89]
  double height_m = 1.5;  ///< of a place above the ground of each city; [0.01, 1000]
  /// West, south, east, north of the places [deg]; empty: where all cities have buildings.
  std::optional<std::array<double, 4>> bbox_deg;
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
/// Visits its numbers.
void visit(options::Visitor& v, CityAgreementOptions& o);

/// How far cities of one district agree about what hides the sky. Shares are in [0, 1].
struct CityAgreement {
  struct OfCity {
    double inside = 0;  ///< of all places that were drawn, those inside a building of it or below its terrain
    double open = 0;    ///< of the directions at the places outdoors, those that nothing hides
  };
  struct OfPair {
    std::size_t first = 0, second = 0;  ///< indices of the cities
    double agree = 0;                   ///< of the directions, those that both hide or neither
    double agree_p05 = 0;               ///< the same at one place: 5 % of the places are below
    double hidden_by_both = 0;          ///< of the directions that either hides; 1 where neither hides any
  };
  std::size_t places = 0;  ///< outdoors in all cities
  std::vector<OfCity> cities;
  std::vector<OfPair> pairs;  ///< each two cities
};

/// Draws places that are outdoors in all cities and casts rays into the sky from each, in each city. A place
/// has the same latitude and longitude in all, and the same height above the ground of each: maps without
/// terrain say no height of the ground. The same cities give the same places.
///
/// Throws InputError where a city has no buildings about the box or where the others have some, and where too
/// few places are outdoors in all.
/// @param cities at least two (asserted)
/// @param progress called with the places that are done and in all, by one thread at a time
[[nodiscard]] CityAgreement compare_cities(
    std::span<const city::City> cities, const CityAgreementOptions& options,
    const std::function<void(std::size_t, std::size_t)>& progress = {});

}  // namespace canyon::validation
