#pragma once

#include <memory>
#include <utility>

#include "canyon/disturbance/faults/fault_timeline.hpp"
#include "canyon/simulation/city_scene.hpp"

namespace canyon::simulation {

/// What faults find around a receiver.
[[nodiscard]] inline disturbance::FaultTimeline::Surroundings surroundings(
    const std::shared_ptr<CityScene>& scene, std::shared_ptr<const orbit::Sky> sky) {
  return {std::move(sky), std::shared_ptr<const city::City>(scene, &scene->city),
          std::shared_ptr<const raytrace::RayScene>(scene, &scene->scene)};
}

/// A pointer without ownership for Arrival::messages; `data` must outlive it.
[[nodiscard]] inline std::shared_ptr<const gnss::NavigationData> unowned(const gnss::NavigationData& data) {
  return {std::shared_ptr<const gnss::NavigationData>(), &data};
}

}  // namespace canyon::simulation
