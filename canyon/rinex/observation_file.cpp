#include "canyon/rinex/observation_file.hpp"

#include <fmt/format.h>

#include "canyon/base/longest_rise.hpp"
#include "canyon/rinex/android_log.hpp"
#include "canyon/rinex/android_observations.hpp"
#include "canyon/rinex/fields.hpp"

namespace canyon::rinex {

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
  const std::vector<bool> stray = outside_longest_rise(times);
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
