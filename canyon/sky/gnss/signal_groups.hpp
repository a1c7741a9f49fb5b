#pragma once

#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/options/fwd.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"
#include "canyon/sky/gnss/signals.hpp"

// Groups of signals by name: what receivers treat alike.
//
// A group is a system ("BeiDou"), a signal ("B1I"), a block or generation of satellites ("GPS-IIF",
// "BeiDou-2"), or an orbit ("BeiDou-GEO"); several joined by & mean what all of them have in common
// ("BeiDou-2&BeiDou-IGSO").

namespace canyon::gnss {

/// Whether a satellite's signal belongs to a group. A satellite of unknown block is of its system's current
/// one. False for a name that is none.
[[nodiscard]] bool in_group(std::string_view group, SatelliteId id, const Signal& signal,
                            geodesy::GpsTime time);
/// Throws InputError for a name that is no group's, listing those that are.
void check_group(std::string_view group);

/// A number for each of some groups; what belongs to several of them has their sum.
using GroupValues = std::map<std::string, double>;
[[nodiscard]] double sum_of(const GroupValues& values, SatelliteId id, const Signal& signal,
                            geodesy::GpsTime time);

/// A number for each of some signals by name ("L5"); value_of() gives others `otherwise`.
using SignalValues = std::map<std::string, double>;
[[nodiscard]] double value_of(const SignalValues& values, const Signal& signal, double otherwise);

/// Throws InputError for a name that no satellite's signal has or that recordings alone have, and for one
/// that is given twice.
void check_signals(const std::vector<std::string>& names);

/// Fields of options: signals, groups, and numbers of groups ("[BeiDou=1.5, L5=-2]") and of signals.
void visit_signals(options::Visitor& v, const options::Field& field, std::vector<std::string>& names);
void visit_groups(options::Visitor& v, const options::Field& field, std::vector<std::string>& groups);
void visit_group_values(options::Visitor& v, const options::Field& field, GroupValues& values,
                        const options::Range& range);
void visit_signal_values(options::Visitor& v, const options::Field& field, SignalValues& values,
                         const options::Range& range);

}  // namespace canyon::gnss
