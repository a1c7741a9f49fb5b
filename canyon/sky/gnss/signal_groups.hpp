#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/options/fwd.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"
#include "canyon/sky/gnss/signals.hpp"

// Groups of signals by name, which receivers treat alike.
// A group is a system ("BeiDou"), a signal ("B1I"), a block or generation of satellites ("GPS-IIF",
// "BeiDou-2"), or an orbit ("BeiDou-GEO"); several joined by & mean their intersection
// ("BeiDou-2&BeiDou-IGSO").

namespace canyon::gnss {

/// Whether a satellite's signal belongs to a group. A satellite of unknown block counts as its system's
/// current block. False for an unknown group name.
[[nodiscard]] bool in_group(std::string_view group, SatelliteId id, const Signal& signal,
                            geodesy::GpsTime time);
/// Throws InputError for a name that is not a group, with the list of groups.
void check_group(std::string_view group);

/// A number for each of some groups; the values of overlapping groups add up.
using GroupValues = std::map<std::string, double>;
[[nodiscard]] double sum_of(const GroupValues& values, SatelliteId id, const Signal& signal,
                            geodesy::GpsTime time);

/// A number for each of some signals by name ("L5"); value_of() returns `otherwise` for others.
using SignalValues = std::map<std::string, double>;
[[nodiscard]] double value_of(const SignalValues& values, const Signal& signal, double otherwise);

/// Throws InputError for an unknown name, one only in recordings, and a repeated one.
void check_signals(const std::vector<std::string>& names);

/// Fields of options: signals, groups, and numbers of groups ("[BeiDou=1.5, L5=-2]") and of signals.
void visit_signals(options::Visitor& v, const options::Field& field, std::vector<std::string>& names);
void visit_groups(options::Visitor& v, const options::Field& field, std::vector<std::string>& groups);
void visit_group_values(options::Visitor& v, const options::Field& field, GroupValues& values,
                        const options::Range& range);
void visit_signal_values(options::Visitor& v, const options::Field& field, SignalValues& values,
                         const options::Range& range);

}  // namespace canyon::gnss
