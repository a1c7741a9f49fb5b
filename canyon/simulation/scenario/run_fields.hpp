#pragma once

#include "canyon/options/fwd.hpp"

namespace canyon::simulation {

struct Scenario;

/// The fields of a scenario that say which run is made of it: duration_s, rate_hz or interval_s, seed.
/// Command lines change them.
void visit_run(options::Visitor& v, Scenario& scenario);

}  // namespace canyon::simulation
