#pragma once

#include <utility>

#include "canyon/city/city.hpp"
#include "canyon/raytrace/ray_scene.hpp"

namespace canyon::simulation {

/// A city and the rays through it. Hosts that move things hold one and share it between environments.
struct CityScene {
  explicit CityScene(city::City c) : city(std::move(c)), scene(city.mesh) {}
  CityScene(const CityScene&) = delete;
  CityScene& operator=(const CityScene&) = delete;

  city::City city;
  raytrace::RayScene scene;
};

}  // namespace canyon::simulation
