#include "canyon/sky/rinex/android_log.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"

namespace canyon::rinex {
namespace {

bool is_letter(char c) {
  return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
}

/// A comment's text; empty for another line.
std::optional<std::string_view> comment_of(std::string_view line) {
  line = trim(line);
  if (line.empty() || line.front() != '#') return std::nullopt;
  return trim(line.substr(1));
}

/// The first field if it can be a kind of line: letters followed by a comma.
std::string_view kind_of(std::string_view line) {
  const std::size_t comma = line.find(',');
  if (comma == std::string_view::npos) return {};
  const std::string_view kind = trim(line.substr(0, comma));
  return std::all_of(kind.begin(), kind.end(), is_letter) ? kind : std::string_view();
}

/// Some logs have their column names in a line that is not a comment.
bool names_columns(std::string_view line) {
  const std::string_view second = trim(line.substr(line.find(',') + 1));
  return !second.empty() && is_letter(second.front()) && second.find("ime") != std::string_view::npos &&
         second.find("ime") < second.find(',');
}

using geodesy::GpsTime;
using gnss::SatelliteId;
using gnss::System;

enum Column : std::size_t {
  TimeNanos,
  FullBiasNanos,
  BiasNanos,
  BiasUncertainty,
  DiscontinuityCount,
  Svid,
  Constellation,
  State,
  ReceivedSvTimeNanos,
  ReceivedSvTimeUncertainty,
  TimeOffsetNanos,
  Cn0,
  Rate,
  RateUncertainty,
  DeltaRangeState,
  DeltaRange,
  DeltaRangeUncertainty,
  CarrierFrequency,
  CodeType,
  Multipath
};
constexpr std::string_view kColumns =
    "TimeNanos FullBiasNanos BiasNanos BiasUncertaintyNanos HardwareClockDiscontinuityCount Svid "
    "ConstellationType State ReceivedSvTimeNanos ReceivedSvTimeUncertaintyNanos TimeOffsetNanos Cn0DbHz "
    "PseudorangeRateMetersPerSecond PseudorangeRateUncertaintyMetersPerSecond AccumulatedDeltaRangeState "
    "AccumulatedDeltaRangeMeters AccumulatedDeltaRangeUncertaintyMeters CarrierFrequencyHz CodeType "
    "MultipathIndicator";

constexpr std::int64_t kMillisecond_ns = 1'000'000;
constexpr std::int64_t kSecond_ns = GpsTime::kNanosecondsPerSecond;
constexpr std::int64_t kDay_ns = 86'400 * kSecond_ns;
/// Codes as in the versions of RINEX from 3.03 on.
constexpr double kVersion = 3.05;
constexpr std::int64_t kEarliest_ns = 1024 * GpsTime::kNanosecondsPerWeek;  ///< 1999
/// Beyond it the phone's estimate of its clock has restarted, whatever its count of discontinuities.
constexpr std::int64_t kHeldWithin_ns = 10 * kMillisecond_ns;
/// Limits of uncertainties: ProcessGnssMeas.m and SetDataFilter.m of Google's GPS measurement tools for
/// times, rates and the clock's bias, which a phone guesses to seconds before its first fix; a delta range
/// that is known to a wavelength at best is no phase.
constexpr double kMaxBias_ns = 1e7, kMaxTime_ns = 500, kMaxRate_mps = 10, kMaxDeltaRange_m = 0.3;
/// Minimum and maximum travel times with the clock's 10 ms: 64 ms from a GLONASS satellite in the zenith, 140
/// ms from an inclined geosynchronous one at the horizon. Their middle resolves ambiguous times.
constexpr std::int64_t kMin_ns = 50 * kMillisecond_ns, kGreatest_ns = 150 * kMillisecond_ns;
constexpr std::int64_t kUsual_ns = 86 * kMillisecond_ns;
constexpr double kGreatestRate_mps = 1e4, kGreatestCn0 = 70;
/// Maximum distance of a carrier from the nearest signal's: GLONASS's channels reach 4 MHz.
constexpr double kSameCarrier_hz = 5e6;
constexpr std::uint8_t kLostLock = 1, kHalfCycle = 2;

/// The part of a satellite's time known in a sync state (GnssMeasurement.getReceivedSvTimeNanos()).
struct Span {
  std::string_view systems;
  std::uint32_t states;
  std::int64_t length_ns;
};
/// Longest first. Shorter ones (a bit, a code) do not determine a pseudorange.
constexpr Span kSpans[] = {
    {"GJCE", android::kTowDecoded | android::kTowKnown, GpsTime::kNanosecondsPerWeek},
    {"R", android::kGlonassTimeOfDayDecoded | android::kGlonassTimeOfDayKnown, kDay_ns},
    {"GJC", android::kSubframeSync, 6 * kSecond_ns},
    {"R", android::kGlonassStringSync, 2 * kSecond_ns},
    {"E", android::kE1PageSync, 2 * kSecond_ns},
    {"C", android::kD2SubframeSync, 600 * kMillisecond_ns},
    {"E", android::kE1SecondaryCodeLock, 100 * kMillisecond_ns},
};

std::optional<System> system_of(long long constellation) {
  switch (constellation) {
    case android::kGps:
      return System::GPS;
    case android::kGlonass:
      return System::GLONASS;
    case android::kQzss:
      return System::QZSS;
    case android::kBeiDou:
      return System::BeiDou;
    case android::kGalileo:
      return System::Galileo;
    default:
      return std::nullopt;
  }
}

/// GPS time is a log's time counter minus this bias.
struct HeldBias {
  std::int64_t whole_ns = 0;
  double rest_ns = 0;  ///< within half a nanosecond
  long long discontinuities = 0;
};

class AndroidReader {
 public:
  AndroidReader(const std::filesystem::path& path, const ObservationOptions& options)
      : log_(TextFile::streamed(path), "Raw", kColumns),
        options_(options),
        result_{{}, {}, ObservationReport(path)} {
    options_.validate();
  }

  RinexObservations read() {
    while (log_.next()) {
      ++lines_;
      if (const std::string problem = take(); !problem.empty()) damaged(problem);
    }
    end_epoch();
    if (const auto& cut = log_.file().cut_warning()) result_.report.notes.loss(*cut, 1, cut->hint());
    if (lines_ == 0) {
      throw InputError(log_.file().path(), 0,
                       fmt::format("is a log of Android's GnssLogger without a line of 'Raw' (it has {})",
                                   android_log_kinds_text(log_.file().path())),
                       "enable raw measurements in the app; use its fixes as a path of format gnsslogger");
    }
    ObservationHeader& header = result_.header;
    header.format = "Android GnssLogger";
    header.version = kVersion;
    header.system = 'M';
    header.program = log_.version();
    header.receiver = log_.device();
    return std::move(result_);
  }

 private:
  void damaged(std::string_view what) { result_.report.notes.loss(log_.file().line(), what); }
  void skip(std::string_view what) {
    result_.report.notes.remark(log_.file().line(), what, ReadReport::kLeftOut);
  }

  [[nodiscard]] std::string no_number(Column column) const {
    return fmt::format("{} '{}' is not a number", log_.name(column), log_.text(column).substr(0, 40));
  }

  /// Adds a line to the epoch; returns the problem of a damaged one.
  [[nodiscard]] std::string take() {
    for (const Column column : {TimeNanos, Svid, Constellation, State, ReceivedSvTimeNanos})
      if (!log_.integer(column)) return no_number(column);
    if (log_.text(FullBiasNanos).empty()) {
      skip("line of a phone without time (no FullBiasNanos)");
      return {};
    }
    if (!log_.integer(FullBiasNanos)) return no_number(FullBiasNanos);
    if (log_.number(BiasUncertainty).value_or(0) > kMaxBias_ns) {
      skip("line of a phone with a clock uncertainty above 10 ms (BiasUncertaintyNanos)");
      return {};
    }
    for (const Column column : {BiasNanos, TimeOffsetNanos, Cn0, Rate, DeltaRange, CarrierFrequency})
      if (!log_.text(column).empty() && !log_.number(column)) return no_number(column);
    if (std::string problem = begin_epoch(); !problem.empty()) return problem;

    const long long constellation = *log_.integer(Constellation);
    const auto system = system_of(constellation);
    if (!system || options_.systems.count(*system) == 0) {
      skip(system ? fmt::format("observation of {}", gnss::name(*system))
                  : other_constellation(constellation));
      return {};
    }
    return take_signal(*system);
  }

  static std::string other_constellation(long long number) {
    if (number == android::kSbas) return "observation of SBAS";
    if (number == android::kNavIc) return "observation of NavIC";
    return fmt::format("observation of constellation {}", number);
  }

  // --- epochs

  [[nodiscard]] std::string begin_epoch() {
    const long long time_ns = *log_.integer(TimeNanos);
    const double bias_ns = log_.number(BiasNanos).value_or(0);
    const long long full_ns = *log_.integer(FullBiasNanos);
    if (std::max(std::abs(static_cast<double>(time_ns)), std::abs(static_cast<double>(full_ns))) > 4e18 ||
        std::abs(bias_ns) > 1e9 || time_ns - full_ns < kEarliest_ns)
      return fmt::format("TimeNanos {} and FullBiasNanos {} give an impossible time", time_ns, full_ns);
    const std::int64_t whole_ns = full_ns + std::llround(bias_ns);
    if (epoch_ && time_ns == time_ns_) return {};
    end_epoch();
    time_ns_ = time_ns;
    const HeldBias reported{whole_ns, bias_ns - std::round(bias_ns),
                            log_.integer(DiscontinuityCount).value_or(0)};
    const bool goes_on = held_ && held_->discontinuities == reported.discontinuities &&
                         std::abs(held_->whole_ns - whole_ns) < kHeldWithin_ns;
    epoch_.emplace();
    epoch_->power_failure = held_ && !goes_on;
    epoch_->line = log_.file().line();
    if (!goes_on) held_ = reported;
    epoch_->receiver_time = GpsTime::from_nanoseconds(time_ns - held_->whole_ns);
    return {};
  }

  void end_epoch() {
    if (!epoch_) return;
    sort(epoch_->signals);
    result_.report.observations += epoch_->signals.size();
    ++result_.report.flags[epoch_->power_failure ? 1 : 0];
    ++result_.report.epochs;
    result_.epochs.push_back(std::move(*epoch_));
    epoch_.reset();
  }

  static void sort(std::vector<ObservedSignal>& signals) {
    std::stable_sort(signals.begin(), signals.end(), [](const ObservedSignal& a, const ObservedSignal& b) {
      return std::pair(a.id, gnss::index_of(*a.signal)) < std::pair(b.id, gnss::index_of(*b.signal));
    });
  }

  // --- signals

  [[nodiscard]] std::string take_signal(System system) {
    const long long svid = *log_.integer(Svid);
    const long long number = svid - (system == System::QZSS && svid > 0 ? android::kQzssOffset : 0);
    if (system == System::GLONASS && number >= 93 && number <= 106) {
      skip("observation of a GLONASS satellite with unknown slot");
      return {};
    }
    if (number < 1 || number > (system == System::BeiDou ? 63 : 40))
      return fmt::format("Svid {} is not a satellite of {}", log_.text(Svid), gnss::name(system));
    const auto state = static_cast<std::uint32_t>(*log_.integer(State));
    if ((state & (android::kCodeLock | android::kE1CodeLock)) == 0) {
      skip("line without code lock");
      return {};
    }
    ObservedSignal signal;
    signal.id = {system, static_cast<std::uint8_t>(number)};
    double carrier_hz = 0;
    std::size_t rank = 0;
    if (!find_signal(signal, carrier_hz, rank)) return {};
    if (std::string problem = measure(state, carrier_hz, signal); !problem.empty()) return problem;
    return add(signal, rank);
  }

  /// Finds signal and code from the line's carrier and code. @param rank of the code, 0 is the best
  [[nodiscard]] bool find_signal(ObservedSignal& found, double& carrier_hz, std::size_t& rank) {
    const std::span<const gnss::Signal> signals = gnss::signals_of(found.id.system);
    const double reported_hz = log_.number(CarrierFrequency).value_or(signals.front().carrier_hz);
    const auto distance = [&](const gnss::Signal& s) {
      return std::abs(nominal_carrier_hz(s, reported_hz) - reported_hz);
    };
    const auto nearest = std::min_element(
        signals.begin(), signals.end(),
        [&](const gnss::Signal& a, const gnss::Signal& b) { return distance(a) < distance(b); });
    const std::string_view type = log_.text(CodeType);
    const bool known = distance(*nearest) <= kSameCarrier_hz;
    for (const gnss::Signal& signal : signals) {
      if (!known || signal.carrier_hz != nearest->carrier_hz) continue;
      const std::string code =
          type.size() == 1 ? std::string{signal.code[0], type[0]} : std::string(signal.code);
      const std::vector<std::string> codes = wanted_codes(options_, signal, kVersion);
      const auto at = std::find(codes.begin(), codes.end(), code);
      if (at == codes.end()) continue;
      found.signal = &signal;
      found.code = {code[0], code[1], '\0'};
      rank = static_cast<std::size_t>(at - codes.begin());
      carrier_hz = nominal_carrier_hz(signal, reported_hz);
      return true;
    }
    if (!options_.all_signals) {
      skip("line of a signal other than that near L1");
    } else {
      result_.report.unknown_codes[gnss::letter(found.id.system)].insert(
          known ? nearest->code.front() + std::string(type.substr(0, 8))
                : fmt::format("{:.7g} Hz", reported_hz));
    }
    return false;
  }

  /// Logs have single-precision carriers: 1575420030 Hz.
  static double nominal_carrier_hz(const gnss::Signal& signal, double reported_hz) {
    if (signal.channel_hz == 0) return signal.carrier_hz;
    const double channel = std::round((reported_hz - signal.carrier_hz) / signal.channel_hz);
    return signal.carrier_hz + signal.channel_hz * std::clamp(channel, -7.0, 13.0);
  }

  [[nodiscard]] std::string measure(std::uint32_t state, double carrier_hz, ObservedSignal& signal) {
    if (const auto cn0 = log_.number(Cn0)) {
      if (*cn0 < 0 || *cn0 > kGreatestCn0) return fmt::format("Cn0DbHz {} is impossible", *cn0);
      signal.cn0_dbhz = cn0;
    }
    const auto rate_mps = log_.number(Rate);
    if (rate_mps && std::abs(*rate_mps) > kGreatestRate_mps)
      return fmt::format("PseudorangeRateMetersPerSecond {} is impossible", *rate_mps);
    if (std::abs(log_.number(TimeOffsetNanos).value_or(0)) > 1e9)
      return fmt::format("TimeOffsetNanos {} is impossible", log_.text(TimeOffsetNanos));
    const double offset_s = 1e-9 * log_.number(TimeOffsetNanos).value_or(0);
    const double moved_m = rate_mps.value_or(0) * offset_s;  // since the tag
    if (std::string problem = measure_range(state, offset_s, moved_m, signal); !problem.empty())
      return problem;
    // Without a channel the carrier of a GLONASS satellite is unknown.
    const bool scaled = signal.id.system != System::GLONASS || !log_.text(CarrierFrequency).empty();
    const double wavelength_m = geodesy::kSpeedOfLight / carrier_hz;
    if (rate_mps && scaled) {
      if (log_.number(RateUncertainty).value_or(0) <= kMaxRate_mps)
        signal.doppler_hz = -*rate_mps / wavelength_m;
      else
        skip(fmt::format("Doppler value with an uncertainty above {:g} m/s", kMaxRate_mps));
    }
    const auto phase = static_cast<std::uint32_t>(log_.integer(DeltaRangeState).value_or(0));
    const auto range_m = log_.number(DeltaRange);
    if ((phase & (android::kReset | android::kCycleSlip)) != 0) signal.loss_of_lock |= kLostLock;
    if ((phase & android::kHalfCycleReported) != 0 && (phase & android::kHalfCycleResolved) == 0)
      signal.loss_of_lock |= kHalfCycle;
    if ((phase & android::kValid) != 0 && range_m && scaled &&
        log_.number(DeltaRangeUncertainty).value_or(0) <= kMaxDeltaRange_m)
      signal.carrier_phase_cycles = (*range_m - moved_m) / wavelength_m;
    const auto multipath = log_.integer(Multipath).value_or(0);
    if (multipath == 1 || multipath == 2) signal.multipath = multipath == 1;
    return {};
  }

  [[nodiscard]] std::string measure_range(std::uint32_t state, double offset_s, double moved_m,
                                          ObservedSignal& signal) {
    const System system = signal.id.system;
    const auto* const span = std::find_if(std::begin(kSpans), std::end(kSpans), [&](const Span& s) {
      return s.systems.find(gnss::letter(system)) != std::string_view::npos && (state & s.states) != 0;
    });
    if (span == std::end(kSpans) || (state & android::kMillisecondAmbiguous) != 0) {
      skip("pseudorange whose State leaves the satellite's time ambiguous");
      return {};
    }
    if (log_.number(ReceivedSvTimeUncertainty).value_or(0) > kMaxTime_ns) {
      skip(fmt::format("pseudorange with an uncertainty above {:g} ns", kMaxTime_ns));
      return {};
    }
    const std::int64_t sent_ns = *log_.integer(ReceivedSvTimeNanos);
    if (sent_ns < 0 || sent_ns > GpsTime::kNanosecondsPerWeek)
      return fmt::format("ReceivedSvTimeNanos {} of {} is impossible", sent_ns, gnss::to_string(signal.id));
    std::int64_t received_ns = epoch_->receiver_time.nanoseconds();
    if (system == System::BeiDou) received_ns -= geodesy::kBdtSecondsOffset * kSecond_ns;
    if (system == System::GLONASS)
      received_ns += (3 * 3600 - geodesy::leap_seconds(epoch_->receiver_time)) * kSecond_ns;
    const std::int64_t earliest_ns = kUsual_ns - span->length_ns / 2;
    std::int64_t travel_ns = (received_ns - sent_ns - earliest_ns) % span->length_ns;
    if (travel_ns < 0) travel_ns += span->length_ns;
    travel_ns += earliest_ns;
    if (travel_ns < kMin_ns || travel_ns > kGreatest_ns) {
      return fmt::format("ReceivedSvTimeNanos {} of {} gives an impossible travel time of {:.4g} s", sent_ns,
                         gnss::to_string(signal.id), 1e-9 * static_cast<double>(travel_ns));
    }
    signal.pseudorange_m =
        geodesy::kSpeedOfLight * (1e-9 * (static_cast<double>(travel_ns) - held_->rest_ns) + offset_s) -
        moved_m;
    return {};
  }

  /// Adds a signal. Of two codes of one signal, one with a pseudorange is kept, else the better code.
  [[nodiscard]] std::string add(const ObservedSignal& signal, std::size_t rank) {
    if (epoch_->signals.empty()) ranks_.clear();
    for (std::size_t i = 0; i < epoch_->signals.size(); ++i) {
      ObservedSignal& other = epoch_->signals[i];
      if (other.id != signal.id || other.signal != signal.signal) continue;
      if (other.code == signal.code)
        return fmt::format("{} {} twice in one epoch", gnss::to_string(signal.id), signal.code.data());
      const auto quality = [](const ObservedSignal& s, std::size_t of) {
        return std::pair(!s.pseudorange_m, of);
      };
      if (quality(signal, rank) < quality(other, ranks_[i])) {
        other = signal;
        ranks_[i] = rank;
      }
      return {};
    }
    epoch_->signals.push_back(signal);
    ranks_.push_back(rank);
    return {};
  }

  AndroidLog log_;
  ObservationOptions options_;
  RinexObservations result_;
  std::size_t lines_ = 0;
  long long time_ns_ = 0;  ///< of the epoch
  std::optional<HeldBias> held_;
  std::optional<ObservationEpoch> epoch_;
  std::vector<std::size_t> ranks_;  ///< of the codes of its signals
};

}  // namespace

std::map<std::string, std::size_t> android_log_kinds(const std::filesystem::path& path) {
  std::map<std::string, std::size_t> kinds;
  TextFile file = TextFile::streamed(path);
  while (const auto line = file.next_line()) {
    const std::string_view kind = kind_of(*line);
    if (!kind.empty() && kind.size() < 32) ++kinds[std::string(kind)];
  }
  return kinds;
}

std::string android_log_kinds_text(const std::filesystem::path& path) {
  std::vector<std::string> parts;
  for (const auto& [kind, count] : android_log_kinds(path))
    parts.push_back(fmt::format("{} {}", kind, count));
  return parts.empty() ? "no line" : fmt::format("{}", fmt::join(parts, ", "));
}

bool AndroidLog::next() {
  while (const auto line = file_.next_line()) {
    if (const auto comment = comment_of(*line)) {
      if (kind_of(*comment) == kind_) read_columns(*comment);
      if (comment->starts_with("Version:")) read_version(*comment);
      continue;
    }
    if (kind_of(*line) != kind_) continue;
    if (kind_ == "Raw" && names_columns(*line)) {
      read_columns(*line);
      continue;
    }
    if (at_.empty()) {
      throw file_.error(
          fmt::format("a line of '{0}' before any header '# {0},...' that names its columns", kind_),
          "keep the comments at the head of the log");
    }
    fields_ = split(*line, ',');
    return true;
  }
  return false;
}

void AndroidLog::read_columns(std::string_view line) {
  std::vector<std::string_view> found = split(line, ',');
  for (std::string_view& each : found) each = trim(each);
  at_.assign(names_.size(), -1);
  for (std::size_t column = 0; column < names_.size(); ++column) {
    for (const std::string_view name : split(names_[column], '|')) {
      const auto at = std::find(found.begin(), found.end(), name);
      if (at == found.end()) continue;
      at_[column] = static_cast<int>(at - found.begin());
      break;
    }
  }
}

/// "Version: v3.0.6.4 Platform: 14 Manufacturer: Google Model: Pixel 7".
void AndroidLog::read_version(std::string_view comment) {
  const auto part = [&](std::string_view label, std::string_view next) {
    const std::size_t at = comment.find(label);
    if (at == std::string_view::npos) return std::string();
    const std::size_t begin = at + label.size();
    const std::size_t end = next.empty() ? std::string_view::npos : comment.find(next, begin);
    const std::string_view text = trim(comment.substr(begin, end - begin));
    return text == "null" ? std::string() : std::string(text);
  };
  version_ = part("Version:", " Platform:");
  device_ = std::string(trim(part("Manufacturer:", " Model:") + " " + part("Model:", {})));
}

std::string_view AndroidLog::text(std::size_t column) const {
  if (!has(column) || static_cast<std::size_t>(at_[column]) >= fields_.size()) return {};
  return trim(fields_[static_cast<std::size_t>(at_[column])]);
}

std::optional<long long> AndroidLog::integer(std::size_t column) const {
  return parse_integer(text(column));
}

std::optional<double> AndroidLog::number(std::size_t column) const {
  return parse_double(text(column));
}

std::string_view AndroidLog::name(std::size_t column) const {
  return names_[column].substr(0, names_[column].find('|'));
}

RinexObservations read_android_observations(const std::filesystem::path& path,
                                            const ObservationOptions& options) {
  RinexObservations recorded = AndroidReader(path, options).read();
  finish_observations(path, options, recorded);
  return recorded;
}

}  // namespace canyon::rinex
