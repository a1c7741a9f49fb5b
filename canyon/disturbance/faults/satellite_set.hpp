#pragma once

#include <string>
#include <vector>

#include "canyon/gnss/satellite_id.hpp"
#include "canyon/options/visitor.hpp"

namespace canyon::disturbance {

/// Satellites by name: "G05" for one, "GPS" for a system; none: all of them.
using SatelliteSet = std::vector<std::string>;

[[nodiscard]] bool holds(const SatelliteSet& set, gnss::SatelliteId id);
/// Throws InputError for a name that is neither a satellite's nor a system's.
void check_satellites(const SatelliteSet& set);
/// The field `satellites` of options; a reader checks the names.
void visit_satellites(options::Visitor& v, SatelliteSet& set);

}  // namespace canyon::disturbance
