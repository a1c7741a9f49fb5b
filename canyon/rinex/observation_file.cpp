#include "canyon/rinex/observation_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

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

/// The changes of carrier phases and Dopplers beside those of pseudoranges: the same, but for noise, in all
/// receivers. Other units and signs are named, and signals whose columns are another's.
class Rates {
 public:
  /// "GPS 1C"
  static std::string name(gnss::System system, std::string_view code) {
    return fmt::format("{} {}", gnss::name(system), code);
  }
  /// A signal at two epochs: what phase, pseudorange and Doppler [m/s] say of the way in between.
  void add(const std::string& signal, double seconds, double range_m, double phase_m,
           std::optional<double> rate_mps) {
    constexpr double kLongest_s = 35, kLeast_m = 30;
    if (!(seconds > 0 && seconds < kLongest_s) || std::abs(range_m) < kLeast_m) return;
    std::vector<double>& phases = phases_[signal];
    if (phases.size() > kMost) return;
    phases.push_back(phase_m / range_m);
    if (rate_mps) dopplers_[signal].push_back(*rate_mps * seconds / range_m);
  }
  void say(RecordNotes& notes) {
    for (const auto& [share, signals] : unlike(phases_, 0.15)) {
      const bool metres = are_metres(share);
      notes.say(0,
                fmt::format("carrier phases{} change by {:.2g} times what pseudoranges do{}", signals, share,
                            metres ? ": they seem to be in metres" : ""),
                signals.empty() || metres ? "RINEX has cycles, which grow with the distance"
                                          : "RINEX has cycles of this signal; is it another's column?");
    }
    for (const auto& [share, signals] : unlike(dopplers_, 0.25)) {
      notes.say(0, fmt::format("Dopplers{} are {:.2g} times what pseudoranges say", signals, share),
                "RINEX has Hz, positive for satellites that come closer");
    }
  }

 private:
  static constexpr std::size_t kMost = 5000;

  /// Whether cycles are written as metres, by their share of pseudoranges: a wavelength.
  static bool are_metres(double share) { return share > 0.1 && share < 0.35; }

  /// The middles of shares that are farther from 1 than `near`, and " of" their signals; empty: of all.
  static std::vector<std::pair<double, std::string>> unlike(
      std::map<std::string, std::vector<double>>& shares, double near) {
    constexpr std::size_t kLeast = 30;
    constexpr double kAlike = 0.02;
    std::vector<std::pair<double, std::string>> found;
    std::size_t judged = 0;
    for (auto& [signal, of] : shares) {
      if (of.size() < kLeast) continue;
      ++judged;
      const auto middle = of.begin() + static_cast<std::ptrdiff_t>(of.size() / 2);
      std::nth_element(of.begin(), middle, of.end());
      if (std::abs(*middle - 1) > near) found.emplace_back(*middle, " of " + signal);
    }
    const bool alike = std::all_of(found.begin(), found.end(), [&](const auto& each) {
      const double first = found.front().first;
      return std::abs(each.first - first) < kAlike * std::abs(first) ||
             (are_metres(each.first) && are_metres(first));
    });
    if (found.size() == judged && alike && !found.empty()) return {{found.front().first, ""}};
    return found;
  }

  std::map<std::string, std::vector<double>> phases_, dopplers_;
};

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
        if (last.size() > 1) compare(last[last.size() - 2], last.back());
        if (last.size() < 3) continue;
        if (is_contradicted(last)) {
          last.erase(last.begin() + 1);
        } else {
          last.pop_front();
        }
      }
    }
    rates_.say(recorded_.report.notes);
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

  void compare(const Seen& before, const Seen& here) {
    if ((here.signal->loss_of_lock & 1) != 0) return;
    std::optional<double> rate_mps;
    if (before.signal->doppler_hz && here.signal->doppler_hz) {
      rate_mps = -0.5 * (*before.signal->doppler_hz + *here.signal->doppler_hz) * wavelength_m(*here.signal);
    }
    rates_.add(Rates::name(here.signal->id.system, here.signal->code.data()),
               here.epoch->receiver_time - before.epoch->receiver_time, here.range_m() - before.range_m(),
               here.phase_m - before.phase_m, rate_mps);
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
  Rates rates_;
  std::map<std::pair<gnss::SatelliteId, std::string>, std::deque<Seen>> last_;
};

}  // namespace

void finish_observations(const std::filesystem::path& path, const ObservationOptions& options,
                         RinexObservations& recorded) {
  ObservationReport& report = recorded.report;
  std::size_t stray = 0;
  geodesy::leave_out_stray_times(
      recorded.epochs, [](const ObservationEpoch& epoch) { return epoch.receiver_time; },
      [&](const ObservationEpoch& epoch) {
        ++stray;
        --report.epochs;
        report.observations -= epoch.signals.size();
        report.notes.bad(epoch.line, "time of the epoch contradicts those around it");
      });
  if (stray > recorded.epochs.size()) {
    throw InputError(path, report.notes.first_bad()->line(),
                     fmt::format("the times of {} of {} epochs do not follow the others", stray,
                                 stray + recorded.epochs.size()),
                     "sort the epochs by time");
  }
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
