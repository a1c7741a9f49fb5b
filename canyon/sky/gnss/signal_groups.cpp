#include "canyon/sky/gnss/signal_groups.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>

#include "canyon/base/input_error.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/text.hpp"

namespace canyon::gnss {
namespace {

/// Blocks, and orbits of BeiDou.
std::vector<std::string_view> kinds() {
  std::vector<std::string_view> names = block_names();
  names.insert(names.end(), {"BeiDou-GEO", "BeiDou-IGSO", "BeiDou-MEO"});
  return names;
}

/// CSNO's constellation list: geostationary, inclined geosynchronous and medium orbits by PRN.
std::string_view beidou_orbit(int prn) {
  if (prn <= 5 || (prn >= 59 && prn <= 63)) return "BeiDou-GEO";
  if (prn <= 10 || prn == 13 || prn == 16 || (prn >= 38 && prn <= 40)) return "BeiDou-IGSO";
  return "BeiDou-MEO";
}

bool is_name(std::string_view name) {
  const auto among = [&](const std::vector<std::string_view>& names) {
    return std::find(names.begin(), names.end(), name) != names.end();
  };
  return among(kinds()) || among(signal_names()) ||
         std::any_of(kAllSystems.begin(), kAllSystems.end(),
                     [&](System system) { return name == gnss::name(system); });
}

/// Calls `each` with every group name of a signal until it returns false; returns whether it never did.
template <class Each>
bool all_names(std::string_view group, const Each& each) {
  while (true) {
    const std::size_t end = std::min(group.find('&'), group.size());
    if (!each(trim(group.substr(0, end)))) return false;
    if (end == group.size()) return true;
    group.remove_prefix(end + 1);
  }
}

/// Reports errors of `check` at the field's location in the text.
template <class Check>
void run_check(const options::Visitor& v, const options::Field& field, const Check& check) {
  if (!v.reads()) return;
  try {
    check();
  } catch (const InputError& error) {
    throw v.fault(field.name, error.problem(), error.hint());
  }
}

}  // namespace

bool in_group(std::string_view group, SatelliteId id, const Signal& signal, geodesy::GpsTime time) {
  return all_names(group, [&](std::string_view name) {
    if (name == signal.name || name == gnss::name(id.system) || name == block_of(id, time)) return true;
    return id.system == System::BeiDou && name == beidou_orbit(id.number);
  });
}

void check_group(std::string_view group) {
  static_cast<void>(all_names(group, [&](std::string_view name) {
    if (is_name(name)) return true;
    std::array<std::string_view, kSystemCount> systems;
    std::transform(kAllSystems.begin(), kAllSystems.end(), systems.begin(),
                   [](System system) { return gnss::name(system); });
    throw InputError(fmt::format("'{}' is not a signal group", name),
                     fmt::format("give systems ({}), signals (L1CA, B1I, ...) or {}; & is their intersection",
                                 fmt::join(systems, ", "), fmt::join(kinds(), ", ")));
  }));
}

double sum_of(const GroupValues& values, SatelliteId id, const Signal& signal, geodesy::GpsTime time) {
  double sum = 0;
  for (const auto& [group, value] : values)
    if (in_group(group, id, signal, time)) sum += value;
  return sum;
}

double value_of(const SignalValues& values, const Signal& signal, double otherwise) {
  const auto found = values.find(std::string(signal.name));
  return found != values.end() ? found->second : otherwise;
}

void check_signals(const std::vector<std::string>& names) {
  const std::vector<std::string_view> known = signal_names(true);
  for (auto name = names.begin(); name != names.end(); ++name) {
    if (std::find(known.begin(), known.end(), *name) == known.end()) {
      for (const System system : kAllSystems) {
        for (const Signal& signal : signals_of(system)) {
          if (signal.name != *name) continue;
          throw InputError(fmt::format("no receiver here tracks {}: {}", *name, signal.only_recorded),
                           fmt::format("it is only in recordings; choose from {}", fmt::join(known, ", ")));
        }
      }
      throw InputError(fmt::format("no satellite sends a signal '{}'", *name),
                       fmt::format("choose from {}", fmt::join(known, ", ")));
    }
    if (std::find(names.begin(), name, *name) != name)
      throw InputError(fmt::format("'{}' is given twice", *name), "name each signal once");
  }
}

void visit_signals(options::Visitor& v, const options::Field& field, std::vector<std::string>& names) {
  v.texts(field, names);
  run_check(v, field, [&] { check_signals(names); });
}

void visit_groups(options::Visitor& v, const options::Field& field, std::vector<std::string>& groups) {
  v.texts(field, groups);
  run_check(v, field, [&] {
    for (const std::string& group : groups) check_group(group);
  });
}

void visit_group_values(options::Visitor& v, const options::Field& field, GroupValues& values,
                        const options::Range& range) {
  v.named_numbers(field, values, range, "GROUP=NUMBER");
  run_check(v, field, [&] {
    for (const auto& [group, value] : values) check_group(group);
  });
}

void visit_signal_values(options::Visitor& v, const options::Field& field, SignalValues& values,
                         const options::Range& range) {
  v.named_numbers(field, values, range, "SIGNAL=NUMBER");
  run_check(v, field, [&] {
    for (const auto& [name, value] : values) check_signals({name});
  });
}

}  // namespace canyon::gnss
