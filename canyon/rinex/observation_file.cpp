#include "canyon/rinex/observation_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "canyon/base/file_kind.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/stray_times.hpp"
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
  std::vector<std::string> lines = notes.lines();
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

std::string_view wanted_words(const ObservationOptions& options) {
  return options.all_signals ? "an observation of a known signal" : "an L1-band observation";
}

void finish_observations(const std::filesystem::path& path, const ObservationOptions& options,
                         RinexObservations& recorded) {
  ObservationReport& report = recorded.report;
  geodesy::leave_out_stray_times(
      recorded.epochs, [](const ObservationEpoch& epoch) { return epoch.receiver_time; },
      [&](const ObservationEpoch& epoch) {
        --report.epochs;
        report.observations -= epoch.signals.size();
        report.notes.bad(epoch.line, "time of the epoch contradicts those around it");
      });
  if (report.observations > 0) return;
  const std::string_view words = wanted_words(options);
  const std::vector<std::string> reasons = report.warnings();
  throw InputError(path, 0,
                   report.notes.first_bad()
                       ? fmt::format("no observation can be read: {}", report.notes.first_bad()->what())
                       : fmt::format("holds no {} of a wanted system{}{}", words.substr(words.find(' ') + 1),
                                     reasons.empty() ? "" : ": ", fmt::join(reasons, ", ")),
                   "fetch the file again or give another");
}

RinexObservations read_observations(const std::filesystem::path& path, const ObservationOptions& options) {
  return file_kind(path) == FileKind::GnssLogger ? read_android_observations(path, options)
                                                 : read_rinex_observations(path, options);
}

}  // namespace canyon::rinex
