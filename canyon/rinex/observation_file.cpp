// Declared in canyon/rinex/observation_reader.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/stray_times.hpp"
#include "canyon/rinex/fields.hpp"
#include "canyon/rinex/observation_reader.hpp"

namespace canyon::rinex {

void ObservationOptions::validate() const {
  if (systems.empty()) throw InputError("systems: none is given", "name at least one satellite system");
  for (const auto& [system, list] : codes) {
    for (const std::string& code : list) {
      if (code.size() == 2 && is_digit(code[0]) && code[1] >= 'A' && code[1] <= 'Z') continue;
      throw InputError(fmt::format("codes: '{}' of {} is not an observation code", code, gnss::name(system)),
                       "a code is a band's digit and a capital letter, such as 1C");
    }
    if (list.empty()) {
      throw InputError(fmt::format("codes: none is given for {}", gnss::name(system)), "name at least one");
    }
  }
}

std::vector<std::string> ObservationReport::warnings() const {
  std::vector<std::string> lines = damages;
  if (damaged > damages.size()) {
    lines.push_back(fmt::format("{} more damaged records, left out as well", damaged - damages.size()));
  }
  for (const ImpossibleValues& each : impossible) {
    if (each.count > 0)
      lines.push_back(each.first + (each.count > 1 ? fmt::format(" ({} in all)", each.count) : ""));
  }
  for (const auto& [what, count] : skipped) lines.push_back(fmt::format("{} {} skipped", count, what));
  for (const auto& [letter, codes] : unknown_codes) {
    lines.push_back(fmt::format("{} {}{} not known: {}", codes.size(),
                                letter == ' ' ? "types of observation" : "codes of ",
                                letter == ' ' ? "" : std::string(1, letter), fmt::join(codes, " ")));
  }
  return lines;
}

namespace {

void leave_out_stray_epochs(const std::filesystem::path& path, RinexObservations& recorded) {
  std::vector<geodesy::GpsTime> times;
  for (const ObservationEpoch& epoch : recorded.epochs) times.push_back(epoch.receiver_time);
  const std::vector<bool> stray = geodesy::stray_times(times);
  std::vector<ObservationEpoch> kept;
  for (std::size_t i = 0; i < stray.size(); ++i) {
    ObservationEpoch& epoch = recorded.epochs[i];
    if (!stray[i]) {
      kept.push_back(std::move(epoch));
      continue;
    }
    --recorded.report.epochs;
    recorded.report.observations -= epoch.signals.size();
    if (++recorded.report.damaged > kListedDamages) continue;
    recorded.report.damages.emplace_back(
        InputError(path, epoch.line, "time of the epoch contradicts those around it", "left out").what());
  }
  recorded.epochs = std::move(kept);
}

}  // namespace

RinexObservations read_rinex_observations(const std::filesystem::path& path,
                                          const ObservationOptions& options) {
  ObservationOptions any_order = options;
  any_order.any_order = true;
  RinexObservationReader reader(path, any_order);
  RinexObservations result;
  while (auto epoch = reader.next()) result.epochs.push_back(std::move(*epoch));
  result.header = reader.header();
  result.report = reader.report();
  leave_out_stray_epochs(path, result);
  if (result.report.observations == 0) {
    throw InputError(
        path, 0,
        result.report.damaged > 0
            ? "no observation can be read: " + result.report.damages.front()
            : fmt::format("holds no {} of a wanted system",
                          options.all_signals ? "observation of a known signal" : "L1-band observation"),
        "fetch the file again or give another");
  }
  return result;
}

}  // namespace canyon::rinex
