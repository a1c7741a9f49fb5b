#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "canyon/city/fwd.hpp"
#include "canyon/geodesy/gps_time.hpp"
#include "canyon/orbit/sky.hpp"
#include "canyon/raytrace/ray_scene.hpp"

namespace canyon::disturbance {

/// Input of the effect of one fault on one receiver, beside the fault's own options.
struct FaultContext {
  std::string name;                       ///< of the fault
  geodesy::GpsTime begin;                 ///< its first instant
  std::optional<geodesy::GpsTime> end;    ///< behind its last one; empty: none
  std::uint64_t seed = 1;                 ///< of the run
  std::string receiver;                   ///< random streams are RandomStream(seed, receiver + "/..." + name)
  std::shared_ptr<const orbit::Sky> sky;  ///< the true one
  std::shared_ptr<const city::City> city;
  std::shared_ptr<const raytrace::RayScene> rays;
};

}  // namespace canyon::disturbance
