#include "canyon/rinex/observation_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/stray_times.hpp"
#include "canyon/rinex/android_log.hpp"
#include "canyon/rinex/android_observations.hpp"
#include "canyon/rinex/fields.hpp"

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

std::vector<std::string> wanted_codes(const ObservationOptions& options, const gnss::Signal& signal,
                                      double version) {
  if (options.systems.count(signal.system) == 0) return {};
  if (gnss::index_of(signal) == 0) {
    const auto own = options.codes.find(signal.system);
    if (own != options.codes.end()) return own->second;
    if (!options.all_signals) return default_codes(signal.system, version);
  } else if (!options.all_signals) {
    return {};
  }
  return signal_codes(signal, version);
}

void note_damage(ObservationReport& report, const std::filesystem::path& path, int line,
                 std::string_view what) {
  ++report.damaged;
  if (report.damages.size() >= kListedDamages) return;
  report.damages.emplace_back(InputError(path, line, what, "left out").what());
}

std::string_view wanted_words(const ObservationOptions& options) {
  return options.all_signals ? "an observation of a known signal" : "an L1-band observation";
}

void finish_observations(const std::filesystem::path& path, const ObservationOptions& options,
                         RinexObservations& recorded) {
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
    note_damage(recorded.report, path, epoch.line, "time of the epoch contradicts those around it");
  }
  recorded.epochs = std::move(kept);
  if (recorded.report.observations > 0) return;
  const std::string_view words = wanted_words(options);
  const std::vector<std::string> reasons = recorded.report.warnings();
  throw InputError(path, 0,
                   recorded.report.damaged > 0
                       ? "no observation can be read: " + recorded.report.damages.front()
                       : fmt::format("holds no {} of a wanted system{}{}", words.substr(words.find(' ') + 1),
                                     reasons.empty() ? "" : ": ", fmt::join(reasons, ", ")),
                   "fetch the file again or give another");
}

RinexObservations read_observations(const std::filesystem::path& path, const ObservationOptions& options) {
  return is_android_log(path) ? read_android_observations(path, options)
                              : read_rinex_observations(path, options);
}

}  // namespace canyon::rinex
