#pragma once

#include <algorithm>
#include <memory>
#include <mutex>
#include <utility>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/propagation/propagator.hpp"
#include "canyon/raytrace/ray_scene.hpp"

namespace canyon::simulation {

/// A city and the rays through it. Hosts that move things hold one and share it between environments.
struct CityScene {
  /// The scene borrows the mesh beside it: neither can be moved.
  explicit CityScene(city::City c)
      : city(std::move(c)), scene(std::shared_ptr<const city::Mesh>(std::shared_ptr<void>(), &city.mesh)) {}
  CityScene(const CityScene&) = delete;
  CityScene& operator=(const CityScene&) = delete;

  /// Propagators of equal options share their memory, which is large. Unused ones are kept until the next
  /// call. Thread-safe.
  [[nodiscard]] propagation::Propagator propagator(const propagation::PropagationOptions& options) {
    const std::lock_guard lock(mutex_);
    const auto equal = [&](const propagation::Propagator& each) { return each.options() == options; };
    std::erase_if(propagators_, [&](const auto& each) { return !each.is_shared() && !equal(each); });
    const auto found = std::find_if(propagators_.begin(), propagators_.end(), equal);
    return found != propagators_.end() ? *found
                                       : propagators_.emplace_back(city.mesh, scene, options, city.seed);
  }

  city::City city;
  raytrace::RayScene scene;

 private:
  std::mutex mutex_;
  std::vector<propagation::Propagator> propagators_;
};

}  // namespace canyon::simulation
