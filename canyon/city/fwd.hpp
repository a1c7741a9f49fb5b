#pragma once

#include <cstdint>

namespace canyon::city {

enum class Surface : std::uint8_t { Building, Terrain, Foliage, Vehicle };

/// Of facades, roofs and ground; decides reflection strength. `Unknown` counts as concrete.
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

struct Mesh;
struct Object;
struct City;
struct Box;  // NOLINT(bugprone-forward-declaration-namespace): other libraries have one too

}  // namespace canyon::city
