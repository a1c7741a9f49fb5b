#pragma once

#include <cstdint>
#include <map>
#include <string>

#include "canyon/base/options/fwd.hpp"
#include "canyon/city/fwd.hpp"

namespace canyon::city {

/// Wall materials of a city whose source does not give them.
struct FacadeOptions {
  enum class Named : std::uint8_t {
    BySource,  ///< keeps a map's tags, but not the names of a mesh's textures
    Keep,
    Redraw
  };
  FacadeMix mix = FacadeMix::ByBuilding;
  std::map<std::string, double> fractions;  ///< weights by facade type instead of the mix, [0, 100]; any sum
  Named named = Named::BySource;            ///< materials named by the source

  /// Whether anything is sampled.
  [[nodiscard]] bool is_sampled() const { return mix != FacadeMix::AsGiven || !fractions.empty(); }
  /// Whether walls keep a known material. @param source_is_trusted the source's names are real materials
  [[nodiscard]] bool keeps_named(bool source_is_trusted) const {
    return named == Named::Keep || (named == Named::BySource && source_is_trusted);
  }
  /// Throws InputError with the field and its bound.
  void validate() const;
};
void visit(options::Visitor& v, FacadeOptions& o);

/// The probabilities of a building's facade types, with sum 1; empty if nothing is sampled.
/// @param height_m of the building, from its lowest to its highest point: for FacadeMix::ByBuilding
/// @param named Object::facades of the building: likewise
[[nodiscard]] std::map<std::string, double> facade_fractions(const FacadeOptions& options,
                                                             double height_m = 0,
                                                             FacadeMix named = FacadeMix::ByBuilding);

/// Samples one facade type for each building and sets its material on the building's walls: the triangles of
/// Surface::Building steeper than 60 deg. Roofs, floors, ground, foliage and vehicles are unchanged. A
/// building is an object; if all buildings are one object, it is each of that object's connected parts. The
/// sample depends only on the seed and the object's name, and for repeated names on the number among equal
/// ones, so that a building's facade does not depend on the other objects.
/// @param keep_named walls with a material other than Unknown keep it
/// @return "facades drawn: 62 coated_glass, 38 concrete; 3 of 103 buildings keep theirs", empty if nothing
///   is sampled. Throws InputError like options.validate().
std::string assign_facades(City& city, const FacadeOptions& options, bool keep_named, std::uint64_t seed);

}  // namespace canyon::city
