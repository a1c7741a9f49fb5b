#include "canyon/analysis/calibration/direct_estimates.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <map>
#include <utility>

#include "canyon/analysis/validation/statistics.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/base/text.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/sky/gnss/signal_groups.hpp"

namespace canyon::calibration {
namespace {

using Verdict = Estimate::Verdict;

/// A signal with fewer pseudoranges counts as not tracked.
constexpr std::size_t kMinOfSignal = 20;

/// Fraction of the C/N0 values of hidden satellites below the tracking threshold, due to the noise of C/N0;
/// and fraction of the first values after gaps below the acquisition threshold.
constexpr double kWeakestFraction = 0.01, kWeakestFoundFraction = 0.1;
/// A lost signal whose last C/N0 is within this of the threshold was lost because of it.
constexpr double kNear_dB = 4;
constexpr long kMinLosses = 10;
/// Loops coast for up to this time; shorter gaps give no information on a threshold.
constexpr double kGap_s = 3;
constexpr std::size_t kMinGaps = 20;

constexpr std::array<const char*, 9> kGroups{"BeiDou-GEO", "BeiDou-IGSO", "BeiDou-MEO",
                                             "BeiDou-2",   "BeiDou-3",    "GPS-IIR",
                                             "GPS-IIRM",   "GPS-IIF",     "GPS-III"};

std::string list_of(const std::vector<std::string>& items) {
  return fmt::format("[{}]", fmt::join(items, ", "));
}

Estimate list_estimate(const char* key, const std::vector<std::string>& before,
                       const std::vector<std::string>& after, std::string basis) {
  return {key,
          {},
          list_of(before),
          list_of(after),
          {},
          before == after ? Verdict::Agrees : Verdict::Fitted,
          std::move(basis)};
}

/// Sets the value of the recordings, its interval, and whether the interval contains the profile's value.
void judge(Estimate& estimate, double before, double value, double low, double high, double half_step) {
  estimate.recorded = rounded(value, half_step);
  estimate.interval = fmt::format("{} to {}", rounded(low, half_step), rounded(high, half_step));
  estimate.verdict = before < low || before > high ? Verdict::Fitted : Verdict::Agrees;
}

void add_leaves_out(std::span<const Observed> recorded, std::span<const std::set<gnss::System>> skies,
                    const std::map<const gnss::Signal*, std::size_t>& counts,
                    const simulation::ReceiverConfig& receiver, Calibration& result) {
  struct ObservedSignal {
    double clear_s = 0;
    std::size_t tracked = 0;
    std::set<gnss::SatelliteId> satellites;
  };
  std::map<std::string, ObservedSignal> seen;
  for (const Observed& e : recorded) {
    for (const Series& series : e.series) {
      if (!series.first()) continue;
      std::size_t tracked = 0, high = 0;
      for (const Sample& s : series.samples) {
        tracked += s.tracked ? 1 : 0;
        high += s.clear && s.elevation_rad >= validation::kTrackableElevation_rad ? 1 : 0;
      }
      for (const char* group : kGroups) {
        if (!gnss::in_group(group, series.id, *series.signal, e.times.front())) continue;
        ObservedSignal& of = seen[group];
        of.tracked += tracked;
        of.clear_s += static_cast<double>(high) * e.interval_s;
        if (high > 0) of.satellites.insert(series.id);
      }
    }
  }
  std::vector<std::string> after, basis;
  for (const std::string& group : receiver.options.leaves_out) {
    const auto of = seen.find(group);
    if (of == seen.end() || of->second.tracked < kMinOfSignal)
      after.push_back(group);
    else
      basis.push_back(fmt::format("{} is tracked", group));
  }
  for (const auto& [group, of] : seen) {
    if (of.tracked > 0 || of.clear_s < validation::kTrackable_s) continue;
    if (std::find(after.begin(), after.end(), group) == after.end()) after.push_back(group);
    basis.push_back(fmt::format("{} never tracked, {} satellites high and clear for {:.0f} s", group,
                                of.satellites.size(), of.clear_s));
  }
  std::set<gnss::System> offered;
  for (const auto& systems : skies) offered.insert(systems.begin(), systems.end());
  for (const gnss::System system : offered) {
    const bool any = std::any_of(counts.begin(), counts.end(), [system](const auto& of) {
      return of.first->system == system && of.second >= kMinOfSignal;
    });
    const std::string name(gnss::name(system));
    if (any || receiver::tracked_signals(receiver.options.tracks, system).empty()) continue;
    if (std::find(after.begin(), after.end(), name) == after.end()) after.push_back(name);
    basis.push_back(fmt::format("{} never recorded", name));
  }
  result.add(list_estimate("exclude_signals", receiver.options.leaves_out, after,
                           basis.empty() ? "every group that is high and clear for a minute is tracked"
                                         : fmt::format("{}", fmt::join(basis, "; "))));
}

/// A reported C/N0 and its epoch, counted over all recordings.
struct ReportedCn0 {
  double cn0_dbhz = 0;
  std::size_t epoch = 0;
};

/// The C/N0 of satellites' first signals near the limits of lock.
struct LockRecord {
  std::vector<ReportedCn0> hidden;  ///< of satellites that are hidden in the map
  std::vector<ReportedCn0> last;    ///< before a signal is lost
  std::vector<ReportedCn0> found;   ///< first ones after gaps
};

LockRecord lock_record(std::span<const Observed> recorded) {
  LockRecord record;
  std::size_t offset = 0;
  for (const Observed& e : recorded) {
    for (const Series& series : e.series) {
      if (!series.first()) continue;
      const Sample *before = nullptr, *tracked = nullptr;  // of the previous epoch, and the last tracked one
      for (const Sample& s : series.samples) {
        if (before != nullptr && before->epoch + 1 != s.epoch) tracked = nullptr;
        if (s.tracked && s.cn0_dbhz) {
          const ReportedCn0 reported{*s.cn0_dbhz, offset + s.epoch};
          if (!s.clear) record.hidden.push_back(reported);
          if (tracked != nullptr && e.times[s.epoch] - e.times[tracked->epoch] > kGap_s)
            record.found.push_back(reported);
          tracked = &s;
        } else if (tracked != nullptr && tracked == before) {
          record.last.push_back({*tracked->cn0_dbhz, offset + tracked->epoch});
        }
        before = &s;
      }
    }
    offset += e.times.size();
  }
  return record;
}

std::vector<double> cn0_of(const std::vector<ReportedCn0>& all) {
  std::vector<double> values;
  for (const ReportedCn0& s : all) values.push_back(s.cn0_dbhz);
  return values;
}

/// A quantile of reported C/N0, with its bootstrap interval.
Estimate threshold_of(const std::vector<ReportedCn0>& all, double fraction, const char* key, double before,
                      std::span<const std::vector<std::uint16_t>> sample_count) {
  Estimate estimate{key, "dB-Hz", options::show(before)};
  const auto value = quantile(cn0_of(all), fraction);
  if (!value) return estimate;
  std::vector<double> sampled;
  for (const auto& weights : sample_count) {
    std::vector<double> values;
    for (const ReportedCn0& s : all) values.insert(values.end(), weights[s.epoch], s.cn0_dbhz);
    if (const auto sample_quantile = quantile(values, fraction)) sampled.push_back(*sample_quantile);
  }
  constexpr double kHalfStep = 0.5;  // reported C/N0 are steps of a decibel
  judge(estimate, before, *value, quantile(sampled, 0.025).value_or(*value) - kHalfStep,
        quantile(sampled, 0.975).value_or(*value) + kHalfStep, kHalfStep);
  return estimate;
}

/// An estimate as unidentified, if the recordings have too little information.
Estimate unidentified(const Estimate& e) {
  return {e.key, e.unit, e.before, {}, {}, Verdict::Unidentified, e.basis};
}

}  // namespace

void Calibration::add(Estimate estimate) {
  if (estimate.verdict == Verdict::Fitted) values[estimate.key] = estimate.recorded;
  estimates.push_back(std::move(estimate));
}

void add_tracked(std::span<const Observed> recorded, std::span<const std::set<gnss::System>> skies,
                 const simulation::ReceiverConfig& receiver, Calibration& result) {
  std::map<const gnss::Signal*, std::size_t> counts;
  for (const Observed& e : recorded) {
    for (const Series& series : e.series) {
      counts[series.signal] += static_cast<std::size_t>(std::count_if(
          series.samples.begin(), series.samples.end(), [](const Sample& s) { return s.tracked; }));
    }
  }
  const auto is_recorded = [&counts](const gnss::Signal& signal) {
    const auto of = counts.find(&signal);
    return signal.only_recorded.empty() && of != counts.end() && of->second >= kMinOfSignal;
  };
  // Names of signals are common to several systems: a name stays if a system that sends it has it recorded.
  std::vector<std::string> after, logged;
  for (const gnss::System system : gnss::kAllSystems) {
    const auto tracked = receiver::tracked_signals(receiver.options.tracks, system);
    const auto signals = gnss::signals_of(system);
    const bool known = std::any_of(signals.begin(), signals.end(), is_recorded);
    for (const gnss::Signal& signal : signals) {
      const bool before = std::find(tracked.begin(), tracked.end(), &signal) != tracked.end();
      const bool now = known ? is_recorded(signal) : before;
      if (now && !before && !receiver.options.signal.antenna.receives(signal::band_of(signal.carrier_hz))) {
        result.notes.push_back(
            fmt::format("{} {} is recorded, but the profile's antenna does not receive it: choose another "
                        "(signal.antenna)",
                        gnss::name(system), signal.name));
        continue;
      }
      const std::string name(signal.name);
      if (now != before)
        logged.push_back(fmt::format("{} {} is {}recorded", gnss::name(system), name, now ? "" : "not "));
      if (now && std::find(after.begin(), after.end(), name) == after.end()) after.push_back(name);
    }
  }
  if (logged.empty()) after = receiver.options.tracks;
  result.add(
      list_estimate("tracks", receiver.options.tracks, after,
                    logged.empty() ? "the recorded signals" : fmt::format("{}", fmt::join(logged, "; "))));
  add_leaves_out(recorded, skies, counts, receiver, result);
}

void add_step(std::span<const Observed> recorded, const simulation::ReceiverConfig& receiver,
              Calibration& result) {
  std::vector<double> reported;
  for (const Observed& e : recorded) {
    for (const Series& series : e.series) {
      for (const Sample& s : series.samples)
        if (s.tracked && s.cn0_dbhz) reported.push_back(*s.cn0_dbhz);
    }
  }
  const double before = receiver.options.signal.cn0_step_db;
  Estimate estimate{"signal.cn0_step_db", "dB", options::show(before)};
  constexpr std::size_t kMin = 100;
  if (reported.size() < kMin) {
    estimate.basis = fmt::format("{} reported C/N0", reported.size());
    return result.add(std::move(estimate));
  }
  double step = 0;
  for (const double tried : {1.0, 0.5, 0.25, 0.2, 0.1, 0.05}) {
    const auto whole = std::count_if(reported.begin(), reported.end(), [tried](double value) {
      return std::abs(std::remainder(value, tried)) < 1e-3;
    });
    if (static_cast<double>(whole) > 0.995 * static_cast<double>(reported.size())) {
      step = tried;
      break;
    }
  }
  estimate.recorded = options::show(step);
  estimate.verdict = step == before ? Verdict::Agrees : Verdict::Fitted;
  estimate.basis = fmt::format("the coarsest step of {} reported C/N0{}", reported.size(),
                               step == 0 ? ": finer than 0.05" : "");
  result.add(std::move(estimate));
}

void add_phase_threshold(std::span<const Observed> recorded, const simulation::ReceiverConfig& receiver,
                         std::span<const std::vector<std::uint16_t>> sample_count, Calibration& result) {
  struct Item {
    double cn0_dbhz = 0;
    bool phase = false;
    std::size_t epoch = 0;
  };
  std::vector<Item> items;
  std::size_t offset = 0, with = 0;
  for (const Observed& e : recorded) {
    for (const Series& series : e.series) {
      for (const Sample& s : series.samples) {
        if (!s.clear || !s.tracked || !s.cn0_dbhz) continue;
        items.push_back({*s.cn0_dbhz, s.phase, offset + s.epoch});
        with += s.phase ? 1 : 0;
      }
    }
    offset += e.times.size();
  }
  const double before = receiver.options.signal.phase_threshold_dbhz;
  Estimate estimate{"signal.phase_threshold_dbhz", "dB-Hz", options::show(before)};
  constexpr std::size_t kMin = 30;
  if (with < kMin || items.size() - with < kMin) {
    estimate.basis = fmt::format("{} clear signals with a phase and {} without", with, items.size() - with);
    return result.add(std::move(estimate));
  }
  std::sort(items.begin(), items.end(), [](const Item& a, const Item& b) { return a.cn0_dbhz < b.cn0_dbhz; });
  // The threshold with the fewest misclassified items, in the middle between two reported values.
  const auto threshold = [&items](const auto& times) {
    long wrong = 0, minimum = 0;
    for (const Item& item : items) wrong += item.phase ? 0 : times(item);
    minimum = wrong;
    double best = items.front().cn0_dbhz;
    for (std::size_t i = 0; i < items.size(); ++i) {
      wrong += (items[i].phase ? 1 : -1) * times(items[i]);
      if (i + 1 < items.size() && items[i + 1].cn0_dbhz == items[i].cn0_dbhz) continue;
      if (wrong < minimum) {
        minimum = wrong;
        best = i + 1 < items.size() ? (items[i].cn0_dbhz + items[i + 1].cn0_dbhz) / 2 : items[i].cn0_dbhz;
      }
    }
    return std::pair(best, minimum);
  };
  const auto [value, wrong] = threshold([](const Item&) { return 1L; });
  std::vector<double> sampled;
  for (const auto& weights : sample_count) {
    sampled.push_back(
        threshold([&](const Item& item) { return static_cast<long>(weights[item.epoch]); }).first);
  }
  const double half_step = std::max(0.5 * receiver.options.signal.cn0_step_db, 0.25);
  judge(estimate, before, value, std::min(quantile(sampled, 0.025).value_or(value), value) - half_step,
        std::max(quantile(sampled, 0.975).value_or(value), value) + half_step, half_step);
  estimate.basis = fmt::format("{} clear signals, {} without a phase, {} misclassified", items.size(),
                               items.size() - with, wrong);
  // A threshold that explains few of the missing phases is rejected.
  if (2 * static_cast<std::size_t>(wrong) > items.size() - with) {
    estimate.basis += ": strength does not separate them";
    estimate.verdict = Verdict::Unidentified;
  }
  result.add(std::move(estimate));
}

void add_lock_thresholds(std::span<const Observed> recorded, const simulation::ReceiverConfig& receiver,
                         std::span<const std::vector<std::uint16_t>> sample_count, Calibration& result) {
  const tracking::SignalLockOptions& lock = receiver.options.signal.lock;
  const LockRecord record = lock_record(recorded);
  const auto lost_near = [&record](double threshold) {
    return std::count_if(record.last.begin(), record.last.end(),
                         [=](const ReportedCn0& s) { return s.cn0_dbhz <= threshold + kNear_dB; });
  };

  Estimate tracking = threshold_of(record.hidden, kWeakestFraction, "signal.lock.tracking_threshold_dbhz",
                                   lock.tracking_threshold_dbhz, sample_count);
  const auto weakest = quantile(cn0_of(record.hidden), kWeakestFraction);
  const auto lost = weakest ? lost_near(*weakest) : 0;
  tracking.basis = fmt::format("{} C/N0 of hidden satellites, {} losses from within {:g} dB of their weakest",
                               record.hidden.size(), lost, kNear_dB);
  // If signals are not lost near their weakest values, the recordings do not show how weak they may be.
  result.add(lost >= kMinLosses ? tracking : unidentified(tracking));
  const double lowest = *parse_double(result.estimates.back().after());

  Estimate acquisition =
      threshold_of(record.found, kWeakestFoundFraction, "signal.lock.acquisition_threshold_dbhz",
                   lock.acquisition_threshold_dbhz, sample_count);
  acquisition.basis = fmt::format("the first C/N0 after {} gaps", record.found.size());
  bool identified = record.found.size() >= kMinGaps;
  const bool fitted = identified && acquisition.verdict == Verdict::Fitted;
  if ((fitted ? *parse_double(acquisition.recorded) : lock.acquisition_threshold_dbhz) < lowest) {
    identified = true;
    acquisition.recorded = options::show(lowest);
    acquisition.interval.clear();
    acquisition.verdict = Verdict::Fitted;
    acquisition.basis = "no lower than the tracking threshold";
  }
  result.add(identified ? acquisition : unidentified(acquisition));
}

namespace {

Sample sample_of(const validation::ComparedSignal& s, std::size_t epoch,
                 const validation::ComparedSatellite& of) {
  return {epoch,
          of.clear,
          s.measured.tracked,
          s.measured.phase.residual_m.has_value(),
          of.elevation_rad,
          s.measured.cn0_dbhz};
}

}  // namespace

Observed observed(const validation::Comparison& comparison) {
  Observed result;
  std::map<std::pair<gnss::SatelliteId, const gnss::Signal*>, Series> series;
  for (std::size_t e = 0; e < comparison.epochs.size(); ++e) {
    const validation::ComparedEpoch& epoch = comparison.epochs[e];
    result.times.push_back(epoch.time);
    for (std::size_t i = epoch.first; i < epoch.first + epoch.count; ++i) {
      const validation::ComparedSatellite& satellite = comparison.satellites[i];
      const auto add = [&](const validation::ComparedSignal& signal) {
        Series& of = series[{satellite.id, signal.signal}];
        of.id = satellite.id;
        of.signal = signal.signal;
        of.samples.push_back(sample_of(signal, e, satellite));
      };
      add(satellite);
      for (const validation::ComparedSignal& signal : satellite.more) add(signal);
    }
  }
  result.interval_s = validation::interval_of(result.times);
  for (auto& [key, of] : series) result.series.push_back(std::move(of));
  return result;
}

validation::Recording part_of(const validation::Recording& recording, std::size_t first, std::size_t count) {
  const validation::PseudorangeResiduals& all = recording.residuals;
  assert(count > 0 && first + count <= all.epochs.size());
  validation::Recording part;
  part.antenna_above_terrain_m = recording.antenna_above_terrain_m;
  part.ionosphere = recording.ionosphere;
  part.troposphere = recording.troposphere;
  const auto copy = [](const auto& from, std::size_t begin, std::size_t n, auto& to) {
    to.assign(from.begin() + static_cast<std::ptrdiff_t>(begin),
              from.begin() + static_cast<std::ptrdiff_t>(begin + n));
  };
  copy(recording.antennas, first, count, part.antennas);
  copy(recording.measurements, first, count, part.measurements);
  validation::PseudorangeResiduals& residuals = part.residuals;
  copy(all.epochs, first, count, residuals.epochs);
  const validation::ResidualEpoch begin = residuals.epochs.front(), last = residuals.epochs.back();
  copy(all.observations, begin.first, last.first + last.count - begin.first, residuals.observations);
  copy(all.further, begin.first_further, last.first_further + last.further - begin.first_further,
       residuals.further);
  for (validation::ResidualEpoch& epoch : residuals.epochs) {
    epoch.first -= begin.first;
    epoch.first_further -= begin.first_further;
  }
  for (validation::PseudorangeResidual& o : residuals.observations) o.epoch -= first;
  for (validation::PseudorangeResidual& o : residuals.further) o.epoch -= first;
  for (const validation::Recording::ReportedFix& fix : recording.reported_fixes)
    if (fix.time >= begin.reception && fix.time <= last.reception) part.reported_fixes.push_back(fix);
  return part;
}

}  // namespace canyon::calibration
