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

/// As Arrival::messages takes them; the caller's must live on.
[[nodiscard]] inline std::shared_ptr<const gnss::NavigationData> lent(const gnss::NavigationData& messages) {
  return {std::shared_ptr<const gnss::NavigationData>(), &messages};
}

}  // namespace canyon::simulation
