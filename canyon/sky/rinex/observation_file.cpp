#include "canyon/sky/rinex/observation_file.hpp"

#include <fmt/format.h>

#include <iterator>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/file_kind.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/sky/rinex/fields.hpp"

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

ReadReport ObservationReport::all() const {
  ReadReport all = notes;
  for (const auto& [letter, codes] : unknown_codes) {
    all.say(ReadReport::Level::Guess,
            fmt::format("{} {}{} not known: {}", codes.size(),
                        letter == ' ' ? "types of observation" : "codes of ",
                        letter == ' ' ? "" : std::string(1, letter), fmt::join(codes, " ")));
  }
  return all;
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
  std::vector<ObservationEpoch>& epochs = recorded.epochs;
  const std::size_t count_before = epochs.size();
  std::vector<ObservationEpoch> rising;  // latest first
  for (auto epoch = epochs.rbegin(); epoch != epochs.rend(); ++epoch) {
    if (rising.empty() || epoch->receiver_time < rising.back().receiver_time) {
      rising.push_back(std::move(*epoch));
    } else {
      --report.epochs;
      report.observations -= epoch->signals.size();
      report.notes.loss(epoch->line, "time of the epoch is not before those behind it");
    }
  }
  epochs.assign(std::make_move_iterator(rising.rbegin()), std::make_move_iterator(rising.rend()));
  const std::size_t lost = count_before - epochs.size() + report.notes.count(kDoesNotFollow);
  if (lost > epochs.size()) {
    throw InputError(
        path, 0,
        fmt::format("the times of {} of {} epochs do not follow one another", lost, lost + epochs.size()),
        "sort the epochs by time");
  }
  if (report.observations > 0) return;
  const std::string_view words = wanted_words(options);
  const std::vector<std::string> reasons = report.lines();
  throw InputError(path, 0,
                   report.notes.first_loss()
                       ? fmt::format("no observation can be read: {}", report.notes.first_loss()->what())
                       : fmt::format("holds no {} of a wanted system{}{}", words.substr(words.find(' ') + 1),
                                     reasons.empty() ? "" : ": ", fmt::join(reasons, ", ")),
                   "fetch the file again or give another");
}

RinexObservations read_observations(const std::filesystem::path& path, const ObservationOptions& options) {
  return file_kind(path) == FileKind::GnssLogger ? read_android_observations(path, options)
                                                 : read_rinex_observations(path, options);
}

}  // namespace canyon::rinex
