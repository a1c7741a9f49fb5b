#pragma once

#include <memory>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/simulation/environment.hpp"
#include "tests/support/circular_sky.hpp"

namespace canyon::test {

/// The synthetic city under GPS and Galileo; shared by all tests of a program.
inline const simulation::Environment& downtown() {
  static const simulation::Environment environment(
      city::synthetic_city({}),
      std::make_shared<CircularSky>(std::vector{gnss::System::GPS, gnss::System::Galileo}));
  return environment;
}

}  // namespace canyon::test
