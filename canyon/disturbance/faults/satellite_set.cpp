#include "canyon/disturbance/faults/satellite_set.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "canyon/base/text.hpp"

namespace canyon::disturbance {
namespace {

/// The largest number that RINEX 3.05 has for a satellite of the system (5.2, table 1).
int last_number(gnss::System system) {
  constexpr std::array<int, gnss::kAllSystems.size()> kLast{32, 28, 36, 63, 10, 58};
  return kLast[static_cast<std::size_t>(system)];
}

bool is_system(std::string_view name) {
  return std::any_of(gnss::kAllSystems.begin(), gnss::kAllSystems.end(), [&](gnss::System system) {
    return lower_case(std::string(name)) == lower_case(std::string(gnss::name(system)));
  });
}

}  // namespace

bool holds(const SatelliteSet& set, gnss::SatelliteId id) {
  return set.empty() || std::any_of(set.begin(), set.end(), [&](const std::string& name) {
           return is_system(name) ? gnss::system_from_name(name) == id.system
                                  : gnss::parse_satellite(name) == id;
         });
}

void check_satellites(const SatelliteSet& set) {
  for (const std::string& name : set) {
    const auto id = gnss::parse_satellite(name);
    if (is_system(name) || (id && id->number >= 1 && id->number <= last_number(id->system))) continue;
    throw InputError(
        fmt::format("'{}' is not a satellite", name),
        "write names such as G05, R12, E11, C30, J02, S23, or systems: GPS, GLONASS, Galileo, BeiDou, QZSS, "
        "SBAS");
  }
}

void visit_satellites(options::Visitor& v, SatelliteSet& set) {
  v.texts({"satellites", "", "names (G05) or systems (GPS), one or a list", "all"}, set);
  if (!v.reads()) return;
  try {
    check_satellites(set);
  } catch (const InputError& error) {
    throw v.fault("satellites", error.problem(), error.cure());
  }
}

}  // namespace canyon::disturbance
