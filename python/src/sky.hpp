#pragma once

#include "canyon/simulation/simulator.hpp"
#include "python/src/binding.hpp"

namespace canyon::python {

/// A sky with the satellites that it may answer for.
struct SkyHandle {
  simulation::BuiltSky built;
  std::vector<gnss::SatelliteId> satellites;
};
using SkyPtr = std::shared_ptr<SkyHandle>;

}  // namespace canyon::python
