#pragma once

#include <cstdint>

namespace canyon::city {

enum class Surface : std::uint8_t { Building, Terrain, Foliage, Vehicle };

/// The material of facades, roofs and ground; it determines reflections. `Unknown`: concrete.
enum class Material : std::uint8_t {
  Unknown,
  Concrete,
  Glass,
  Brick,
  Metal,
  Stone,
  Wood,
  Plaster,
  Ground,
  Foliage
};

/// Mixes of facade types among the buildings of a district. docs/city.md has the numbers and their sources.
enum class FacadeMix : std::uint8_t {
  AsGiven,             ///< as given by the source
  Traditional,         ///< 3GPP TR 38.901, 7.4.3: the building of its low-loss model
  ThermallyEfficient,  ///< the same, high-loss model: coated glazing
  UrbanStock,          ///< four of five buildings Traditional, one ThermallyEfficient (ITU-R M.2412)
  Europe,              ///< assumed
  EastAsia,            ///< assumed
  ByBuilding  ///< each building Traditional, UrbanStock or ThermallyEfficient: by its tags, else height
};

struct Mesh;
struct Object;
struct City;
struct Box;  // NOLINT(bugprone-forward-declaration-namespace): other libraries also have one

}  // namespace canyon::city
