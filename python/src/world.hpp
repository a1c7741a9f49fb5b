#pragma once

#include "canyon/simulation/city_scene.hpp"
#include "canyon/simulation/simulator.hpp"
#include "python/src/binding.hpp"

namespace canyon::python {

/// A sky with the satellites that it may answer for.
struct SkyHandle {
  simulation::BuiltSky built;
  std::vector<gnss::SatelliteId> satellites;
};
using SkyPtr = std::shared_ptr<SkyHandle>;

/// The city of `load`, called without the interpreter's lock. Its cautions become Python's warnings.
template <typename Load>
std::shared_ptr<simulation::CityScene> scene_of(const Load& load) {
  std::vector<std::string> warnings;
  std::shared_ptr<simulation::CityScene> scene;
  {
    const py::gil_scoped_release release;
    scene = std::make_shared<simulation::CityScene>(load(warnings));
  }
  for (const std::string& line : warnings) {
    if (PyErr_WarnEx(PyExc_UserWarning, line.c_str(), 1) != 0) throw py::error_already_set();
  }
  return scene;
}

}  // namespace canyon::python
