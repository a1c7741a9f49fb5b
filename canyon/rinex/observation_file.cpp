#include "canyon/rinex/observation_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <utility>

#include "canyon/base/file_kind.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/stray_times.hpp"
#include "canyon/geodesy/time_scales.hpp"
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

namespace {

/// Leaves out single pseudoranges, and single carrier phases, that contradict their neighbours by kilometres:
/// code minus phase leaves the way between the epochs before and behind, which agree. Reflections do not move
/// a code so far from its phase. A slip of the phase stays, and a phase whose receiver says that it begins
/// anew.
class Contradictions {
 public:
  explicit Contradictions(RinexObservations& recorded) : recorded_(recorded) {}

  void leave_out() {
    for (ObservationEpoch& epoch : recorded_.epochs) {
      for (ObservedSignal& signal : epoch.signals) {
        if (!signal.pseudorange_m || !signal.carrier_phase_cycles) continue;
        const std::string_view code(signal.code.data());
        std::deque<Seen>& last = last_[{signal.id, std::string(code)}];
        last.push_back({&epoch, &signal, *signal.carrier_phase_cycles * wavelength_m(signal)});
        if (last.size() < 3) continue;
        if (is_contradicted(last)) {
          last.erase(last.begin() + 1);
        } else {
          last.pop_front();
        }
      }
    }
  }

 private:
  struct Seen {
    const ObservationEpoch* epoch;
    ObservedSignal* signal;
    double phase_m;
    [[nodiscard]] double range_m() const { return *signal->pseudorange_m; }
    [[nodiscard]] double code_minus_phase_m() const { return range_m() - phase_m; }
  };

  [[nodiscard]] double wavelength_m(const ObservedSignal& signal) const {
    const auto channel = recorded_.header.glonass_channels.find(signal.id);
    const double l1_hz = gnss::l1_frequency_hz(
        signal.id.system, channel == recorded_.header.glonass_channels.end() ? 0 : channel->second);
    return geodesy::kSpeedOfLight /
           (signal.signal == nullptr ? l1_hz : gnss::carrier_hz(*signal.signal, l1_hz));
  }

  bool is_contradicted(const std::deque<Seen>& three) {
    constexpr double kFar_m = 1000, kAlike = 0.1;
    const Seen &before = three[0], &here = three[1], &behind = three[2];
    const double share = (here.epoch->receiver_time - before.epoch->receiver_time) /
                         (behind.epoch->receiver_time - before.epoch->receiver_time);
    const auto off_m = [&](const auto& value) {
      return value(here) - value(before) - share * (value(behind) - value(before));
    };
    const double away_m = std::abs(off_m([](const Seen& seen) { return seen.code_minus_phase_m(); }));
    if (away_m < kFar_m ||
        std::abs(behind.code_minus_phase_m() - before.code_minus_phase_m()) > kAlike * away_m)
      return false;
    const bool code = std::abs(off_m([](const Seen& seen) { return seen.range_m(); })) >
                      std::abs(off_m([](const Seen& seen) { return seen.phase_m; }));
    if (!code && ((here.signal->loss_of_lock | behind.signal->loss_of_lock) & 1) != 0) return false;
    recorded_.report.notes.bad(here.epoch->line,
                               fmt::format("the {} of '{} {}' at {} contradicts those around it by {:.1f} km",
                                           code ? "pseudorange" : "carrier phase", to_string(here.signal->id),
                                           here.signal->code.data(),
                                           geodesy::format_gpst(here.epoch->receiver_time, 1), away_m / 1e3));
    (code ? here.signal->pseudorange_m : here.signal->carrier_phase_cycles).reset();
    return true;
  }

  RinexObservations& recorded_;
  std::map<std::pair<gnss::SatelliteId, std::string>, std::deque<Seen>> last_;
};

}  // namespace

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
  if (report.observations > 0) return Contradictions(recorded).leave_out();
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
