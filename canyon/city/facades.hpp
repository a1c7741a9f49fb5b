#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "canyon/base/options/fwd.hpp"
#include "canyon/city/fwd.hpp"

namespace canyon::city {

/// Materials of the walls of a city whose source does not state them.
struct FacadeOptions {
  enum class Named : std::uint8_t {
    BySource,  ///< a map's tags stay, names of a mesh's textures do not
    Keep,
    Redraw
  };
  FacadeMix mix = FacadeMix::ByBuilding;
  std::map<std::string, double> shares;  ///< instead of the mix: by facade type, [0, 100], over their sum
  Named named = Named::BySource;         ///< materials that the source names

  /// Whether anything is drawn at all.
  [[nodiscard]] bool drawn() const { return mix != FacadeMix::AsGiven || !shares.empty(); }
  /// Whether walls keep a material that is not Unknown, from a source whose names are materials or not.
  [[nodiscard]] bool keeps_named(bool source_is_trusted) const {
    return named == Named::Keep || (named == Named::BySource && source_is_trusted);
  }
  /// Throws InputError naming the field and its bound.
  void validate() const;
};
/// Visits its fields.
void visit(options::Visitor& v, FacadeOptions& o);

/// The shares that a building draws from, by facade type, 1 in all; empty where nothing is drawn.
/// @param height_m of the building, from its lowest to its highest point: for FacadeMix::ByBuilding
/// @param named Object::facades of the building: likewise
[[nodiscard]] std::map<std::string, double> facade_shares(const FacadeOptions& options, double height_m = 0,
                                                          FacadeMix named = FacadeMix::ByBuilding);

/// Draws one facade type for each building and gives its material to the building's walls: the triangles of
/// Surface::Building steeper than 60 deg. Roofs, floors, ground, foliage and vehicles stay. A building is an
/// object; where all buildings are one object it is each of that object's connected parts. The draw depends
/// on the seed and the object's name alone, and where names repeat on the number among equal ones, so that a
/// building has its facade whatever conflicts with it.
/// @param keep_named walls whose material is not Unknown stay
/// @return "facades drawn: 62 coated_glass, 38 concrete; 3 of 103 buildings keep theirs", empty where nothing
///   is drawn. Throws InputError like options.validate().
std::string dress_facades(City& city, const FacadeOptions& options, bool keep_named, std::uint64_t seed);

}  // namespace canyon::city
