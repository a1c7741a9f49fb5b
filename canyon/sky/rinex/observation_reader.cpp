#include "canyon/sky/rinex/observation_reader.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <span>
#include <utility>

#include "canyon/base/file_kind.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/sky/rinex/android_log.hpp"
#include "canyon/sky/rinex/compact_lines.hpp"
#include "canyon/sky/rinex/fields.hpp"
#include "canyon/sky/rinex/observation_fields.hpp"

namespace canyon::rinex {
namespace {

using gnss::SatelliteId;
using gnss::System;

/// An observation is F14.3, I1, I1.
constexpr std::size_t kField = 16;
constexpr std::size_t kFieldsPerLine2 = 5;
constexpr std::size_t kSatellitesPerLine2 = 12;

/// "G05" as in gnss::parse_satellite(), but only in capitals.
std::optional<SatelliteId> satellite(std::string_view text) {
  if (text.size() != 3 || text[0] < 'A' || text[0] > 'Z') return std::nullopt;
  return gnss::parse_satellite(text);
}

/// Indices of the values of one code among the fields of a satellite; -1: none.
struct Columns {
  std::array<char, 3> code{};
  std::array<int, 4> at{-1, -1, -1, -1};  ///< pseudorange, phase, Doppler, C/N0
  std::array<double, 4> factor{1, 1, 1, 1};
};

struct SignalColumns {
  const gnss::Signal* signal;
  std::vector<Columns> codes;  ///< best first
};

}  // namespace

struct RinexObservationReader::Impl {
  ObservationReport report;
  CompactLines lines;
  ObservationOptions options;
  HeaderRecords records;
  std::shared_ptr<const ObservationHeader> shared;  ///< records' header; null if it has changed
  std::array<std::vector<SignalColumns>, gnss::kSystemCount> columns;  ///< in the order of gnss::signals_of()
  std::array<bool, gnss::kSystemCount> wanted{};
  bool cut = false;  ///< the gzip data ended early, and the report has a line about it
  std::optional<geodesy::GpsTime> previous;
  std::string row;                         ///< a satellite's fields without its name
  std::vector<std::array<char, 3>> names;  ///< version 2: satellites of the epoch
  std::array<std::array<bool, 100>, gnss::kSystemCount> seen{};

  Impl(TextFile stream, ObservationOptions o)
      : report(stream.path()), lines(std::move(stream), report.notes), options(std::move(o)) {
    options.validate();
    for (const System s : options.systems) wanted[static_cast<std::size_t>(s)] = true;
    read_header();
  }

  [[nodiscard]] bool version2() const { return records.major() == 2; }

  [[nodiscard]] const std::string& time_system() const { return records.header().time_system; }

  void damaged(int line, std::string_view what) { report.notes.loss(line, what); }
  void skip(std::string_view what) { report.notes.remark(lines.line(), what, ReadReport::kLeftOut); }

  // --- header

  void read_header() {
    const auto first = lines.next_line();
    if (!first) throw InputError(lines.path(), 0, "is empty", "give a RINEX observation file");
    if (const auto fault = records.begin(*first)) throw lines.error(fault->problem, fault->hint);
    read_header_lines();
  }

  void read_header_lines() {
    while (const auto line = lines.next_line()) {
      const HeaderRecords::Result result = records.apply(*line);
      if (result.outcome == HeaderRecords::Outcome::End) {
        choose_columns();
        return;
      }
      note(result);
    }
    throw InputError(lines.path(), 0, "RINEX header has no END OF HEADER",
                     "the file is cut short: fetch it again");
  }

  static bool is_first_line(std::string_view line) {
    return trim(column(line, 60, 20)) == "RINEX VERSION / TYPE";
  }
  /// Files joined by cat have headers between the epochs.
  void read_another_header(std::string_view first) {
    change_header([&] {
      records = {};
      if (const auto fault = records.begin(first)) throw lines.error(fault->problem, fault->hint);
      read_header_lines();
    });
  }
  /// Calls `change`, which changes the records from here on; notes a change of the antenna's position.
  template <typename Change>
  void change_header(const Change& change) {
    const int line = lines.line();
    const auto before = records.header().antenna_ecef();
    change();
    shared.reset();
    const auto now = records.header().antenna_ecef();
    if (now && now != before)
      report.notes.guess(line, "header records within the file move the antenna", "they apply from there on");
  }

  void note(const HeaderRecords::Result& result) {
    if (result.outcome == HeaderRecords::Outcome::Fatal)
      throw lines.error(result.reason, "the file is damaged: fetch it again");
    if (result.outcome == HeaderRecords::Outcome::Damaged) damaged(lines.line(), result.reason);
  }

  void choose_columns() {
    bool any = false;
    std::string listed;
    for (const auto& [letter, types] : records.header().types)
      for (const std::string& type : types)
        listed += (listed.empty() ? "" : " ") + (letter == ' ' ? type : letter + (":" + type));
    for (const System system : gnss::kAllSystems) {
      const auto index = static_cast<std::size_t>(system);
      columns[index].clear();
      if (!wanted[index]) continue;
      const std::span<const gnss::Signal> signals = gnss::signals_of(system);
      for (const gnss::Signal& signal : signals.first(options.all_signals ? signals.size() : 1)) {
        SignalColumns& signal_entry = columns[index].emplace_back(SignalColumns{&signal, {}});
        for (const std::string& code : wanted_codes(options, signal, records.header().version)) {
          const Columns found = columns_of(system, code);
          if (found.at[0] >= 0) signal_entry.codes.push_back(found);
        }
        if (signal_entry.codes.empty()) columns[index].pop_back();
        any = any || !columns[index].empty();
      }
    }
    if (options.all_signals) list_unknown();
    if (any) return;
    throw InputError(
        lines.path(), 0,
        fmt::format("has no {} of a wanted system (types of observation: {})",
                    options.all_signals ? "pseudorange of a known signal" : "L1-band pseudorange",
                    listed.empty() ? "none" : listed.substr(0, 200)),
        options.all_signals ? "choose other systems or codes"
                            : "record L1-band pseudoranges, or choose other systems or codes");
  }

  /// Rows of version2_types() that apply to a system in this file.
  template <typename Visit>
  void each_version2(System system, Visit visit) const {
    const double version = records.header().version;
    for (const Version2Types& types : version2_types())
      if (version >= types.from && version < types.before &&
          types.systems.find(gnss::letter(system)) != std::string_view::npos)
        visit(types);
  }

  [[nodiscard]] Columns columns_of(System system, const std::string& code) const {
    Columns result;
    result.code = {code[0], code[1], '\0'};
    const char letter = version2() ? ' ' : gnss::letter(system);
    const auto found = records.header().types.find(letter);
    if (found == records.header().types.end()) return result;
    const auto location = [&types = found->second](const std::string& type) {
      const auto at = std::find(types.begin(), types.end(), type);
      return at == types.end() ? -1 : static_cast<int>(at - types.begin());
    };
    const Version2Types* old = nullptr;  // the first with an existing pseudorange
    if (version2()) {
      each_version2(system, [&](const Version2Types& types) {
        if (old == nullptr && types.code == code && location(std::string(types.range)) >= 0) old = &types;
      });
      if (old == nullptr) return result;
    }
    for (std::size_t kind = 0; kind < kObservationKinds.size(); ++kind) {
      std::string type = kObservationKinds[kind] + code;
      if (old != nullptr)
        type = kind == 0 ? std::string(old->range) : std::string{kObservationKinds[kind], old->band};
      result.at[kind] = location(type);
      if (result.at[kind] >= 0) result.factor[kind] = records.factor(letter, type);
    }
    return result;
  }

  /// Lists the header's codes without a signal, except pseudo-observations (channel numbers).
  void list_unknown() {
    for (const auto& [letter, types] : records.header().types) {
      for (const std::string& type : types) {
        if (kObservationKinds.find(type[0]) == std::string_view::npos && type[0] != 'P') continue;
        bool any_wanted = false, known = false;
        for (const System system : gnss::kAllSystems) {
          if (!wanted[static_cast<std::size_t>(system)]) continue;
          if (letter == ' ') {
            any_wanted = true;
            each_version2(system, [&](const Version2Types& old) {
              const bool range = type[0] == 'C' || type[0] == 'P';
              known = known || (range ? type == old.range : type[1] == old.band);
            });
          } else if (letter == gnss::letter(system)) {
            any_wanted = true;
            known = is_known_code(system, std::string_view(type).substr(1), records.header().version);
          }
        }
        if (any_wanted && !known)
          report.unknown_codes[letter].insert(printable(letter == ' ' ? type : type.substr(1)));
      }
    }
  }

  // --- epochs

  std::optional<ObservationEpoch> next() {
    bool lost = false;  // after a damaged epoch line: the following lines belong to it
    while (const auto line = lines.next_line()) {
      if (is_blank(*line) || trim(column(*line, 60, 20)) == "COMMENT") continue;
      if (is_first_line(*line)) {
        read_another_header(*line);
        lost = false;
        continue;
      }
      const std::optional<EpochLine> parsed =
          version2() ? epoch_line2(*line, time_system()) : epoch_line3(*line, time_system());
      if (!parsed) {
        if (!lost || (!version2() && line->front() == '>'))
          damaged(lines.line(), "no epoch line, with all that follows to the next one");
        lost = true;
        continue;
      }
      lost = false;
      ++report.flags[static_cast<std::size_t>(parsed->flag)];
      const EpochLine epoch = *parsed;
      if (epoch.flag >= 2 && epoch.flag <= 5) {
        change_header([&] { read_event(epoch); });
        continue;
      }
      ObservationEpoch result;
      result.line = lines.line();
      // Copies the contents of `line` before it becomes invalid.
      const bool complete = !version2() || read_names(*line, epoch.count);
      if (!complete) {
        damaged(result.line, "list of satellites is damaged");
        lost = true;
        continue;
      }
      const bool taken = epoch.flag != 6 && follows(*epoch.time, result.line);
      read_satellites(epoch.count, taken, result);
      if (!taken) continue;
      result.receiver_time = *epoch.time;
      result.power_failure = epoch.flag == 1;
      result.receiver_clock_offset_s = epoch.clock_offset_s;
      if (!shared) shared = std::make_shared<ObservationHeader>(records.header());
      result.header = shared;
      ++report.epochs;
      report.observations += result.signals.size();
      return result;
    }
    if (lines.cut_warning() && !std::exchange(cut, true))
      report.notes.loss(*lines.cut_warning(), 1, lines.cut_warning()->hint());
    return std::nullopt;
  }

  bool follows(geodesy::GpsTime t, int line) {
    const bool later = !previous || t > *previous;
    // Compared with the preceding line, used or not: one damaged time must not suppress the rest.
    previous = t;
    if (!later) damaged(line, kDoesNotFollow);
    return later;
  }

  void read_event(const EpochLine& event) {
    constexpr int kMoves = 2, kNewSite = 3;
    const int begin = lines.line();
    const std::string marker = records.header().marker;
    bool is_located = event.flag != kNewSite;
    if (event.flag <= kNewSite) records.set_moving(event.flag == kMoves);
    for (std::size_t i = 0; i < event.count; ++i) {
      const auto line = lines.next_line();
      if (!line) return damaged(lines.line(), "the file ends within an event");
      if (version2() ? epoch_line2(*line, time_system()).has_value()
                     : !line->empty() && line->front() == '>') {
        damaged(lines.line(), "an event has fewer records than it declares");
        lines.unread_line();
        break;
      }
      is_located = is_located || trim(column(*line, 60, 20)) == "APPROX POSITION XYZ";
      const HeaderRecords::Result result = records.apply(*line);
      if (result.outcome == HeaderRecords::Outcome::End) continue;
      note(result);
    }
    if (!is_located && records.header().marker != marker) {
      records.forget_position();
      report.notes.guess(begin, "event of a new site without its position",
                         "the antenna has no position from there on");
    }
    choose_columns();
  }

  /// Version 2: the epoch's satellites, on this line and its continuation lines.
  [[nodiscard]] bool read_names(std::string_view line, std::size_t count) {
    names.clear();
    const int at = lines.line();
    while (true) {
      const std::size_t here = std::min(count - names.size(), kSatellitesPerLine2);
      for (std::size_t i = 0; i < here; ++i) {
        const std::string_view name = column(line, 32 + 3 * i, 3);
        if (name.size() != 3 || !is_digit(name[2])) return false;
        names.push_back({name[0] == ' ' ? implied_system() : name[0], name[1], name[2]});
      }
      if (names.size() == count) return true;
      const auto next_line = lines.next_line();
      if (!next_line || lines.line() > at + 100 || !is_blank(column(*next_line, 0, 32))) return false;
      line = *next_line;
    }
  }
  [[nodiscard]] char implied_system() const {
    return records.header().system == 'M' ? 'G' : records.header().system;
  }

  void read_satellites(std::size_t count, bool taken, ObservationEpoch& epoch) {
    for (auto& system_entry : seen) system_entry.fill(false);
    for (std::size_t i = 0; i < count; ++i) {
      std::array<char, 3> name{};
      bool whole = true;
      const int line = lines.line() + 1;
      if (version2()) {
        name = names[i];
        whole = read_row2();
      } else {
        whole = read_row3(name);
      }
      if (!whole) {
        damaged(lines.line(),
                fmt::format("the epoch of line {} ends after {} of {} satellites", epoch.line, i, count));
        return;
      }
      if (taken) take({name.data(), name.size()}, line, epoch);
    }
  }

  /// False at the end of the file or at the next epoch.
  [[nodiscard]] bool read_row3(std::array<char, 3>& name) {
    const auto line = lines.next_line();
    if (!line) return false;
    if (!line->empty() && line->front() == '>') {
      lines.unread_line();
      return false;
    }
    name.fill(' ');
    const std::string_view own = column(*line, 0, 3);
    std::copy(own.begin(), own.end(), name.begin());
    row.assign(column(*line, 3, std::string_view::npos));
    return true;
  }

  [[nodiscard]] bool read_row2() {
    row.clear();
    const auto types = records.header().types.find(' ');
    const std::size_t n = types == records.header().types.end() ? 0 : types->second.size();
    const std::size_t needed = (n + kFieldsPerLine2 - 1) / kFieldsPerLine2;
    for (std::size_t i = 0; i < needed; ++i) {
      const auto line = lines.next_line();
      if (!line) return false;
      if (epoch_line2(*line, time_system())) {
        lines.unread_line();
        return false;
      }
      row += line->substr(0, kField * kFieldsPerLine2);
      row.resize((i + 1) * kField * kFieldsPerLine2, ' ');
    }
    return true;
  }

  void take(std::string_view name, int line, ObservationEpoch& epoch) {
    if (other_system(name)) return skip(fmt::format("observation of system {}", name[0]));
    const auto id = satellite(name);
    if (!id || id->number >= 100)
      return damaged(line, fmt::format("'{}' is not a satellite", printable(name)));
    const auto system = static_cast<std::size_t>(id->system);
    if (!wanted[system]) return skip(fmt::format("observation of {}", gnss::name(id->system)));
    if (std::exchange(seen[system][id->number], true))
      return damaged(line, fmt::format("{} twice in one epoch", gnss::to_string(*id)));
    const std::size_t before = epoch.signals.size();
    for (const SignalColumns& signal_entry : columns[system]) {
      std::optional<ObservedSignal> best;
      for (const Columns& c : signal_entry.codes) {
        ObservedSignal signal;
        signal.id = *id;
        signal.signal = signal_entry.signal;
        const auto measured = read_signal(c, line, signal);
        if (!measured) {
          epoch.signals.resize(before);
          return damaged(
              line, fmt::format("an observation of {} is not a number in its columns", gnss::to_string(*id)));
        }
        if (*measured && (!best || signal.pseudorange_m)) best = signal;
        if (best && best->pseudorange_m) break;
      }
      if (best) epoch.signals.push_back(*best);
    }
    if (epoch.signals.size() == before) skip(fmt::format("satellite without {}", wanted_words(options)));
  }

  static std::string printable(std::string_view text) {
    std::string result(text);
    std::replace_if(
        result.begin(), result.end(), [](char c) { return c < ' ' || c > '~'; }, '?');
    return result;
  }

  /// Whether anything was measured; empty if a field is not a number.
  [[nodiscard]] std::optional<bool> read_signal(const Columns& c, int line, ObservedSignal& signal) {
    const std::string_view text = row;
    std::array<std::optional<double>, 4> values;
    for (std::size_t kind = 0; kind < 4; ++kind) {
      if (c.at[kind] < 0) continue;
      double value = 0;
      const std::string_view digits = column(text, kField * static_cast<std::size_t>(c.at[kind]), 14);
      const ObservationField field = parse_field(digits, value);
      if (field == ObservationField::Bad) return std::nullopt;
      // RINEX writes missing values as blank or 0.0 (3.05, table A3; 2.11, table A2).
      if (field != ObservationField::Number || value == 0) continue;
      value /= c.factor[kind];
      const Plausible& range = kPlausibleValues[kind];
      if (value >= range.least && value <= range.maximum)
        values[kind] = value;
      else
        note_impossible(kind, line, signal.id, value);
    }
    signal.code = c.code;
    signal.pseudorange_m = values[0];
    signal.carrier_phase_cycles = values[1];
    signal.doppler_hz = values[2];
    signal.cn0_dbhz = values[3];
    if (const auto lli = indicator(c.at[1], 14)) signal.loss_of_lock = static_cast<std::uint8_t>(*lli & 7);
    if (!signal.cn0_dbhz) {
      auto strength = indicator(c.at[0], 15);
      if (!strength || *strength == 0) strength = indicator(c.at[1], 15);
      if (strength && *strength > 0) {
        // RINEX 3.05, standardized signal strength indicator: digit n means 6 n to 6 n + 5 dB-Hz.
        signal.cn0_dbhz = 6.0 * *strength + 3;
        signal.cn0_from_indicator = true;
      }
    }
    return values[0] || values[1] || values[2] || values[3];
  }

  void note_impossible(std::size_t kind, int line, SatelliteId id, double value) {
    const Plausible& range = kPlausibleValues[kind];
    report.notes.loss(
        line, fmt::format("'{}' has a {} of {:.10g} {}", to_string(id), range.what, value, range.unit),
        fmt::format("values outside {:g} to {:g} are left out", range.least, range.maximum));
  }

  [[nodiscard]] std::optional<int> indicator(int field, std::size_t offset) const {
    if (field < 0) return std::nullopt;
    const std::string_view c = column(row, kField * static_cast<std::size_t>(field) + offset, 1);
    if (c.empty() || !is_digit(c[0])) return std::nullopt;
    return c[0] - '0';
  }
};

RinexObservationReader::RinexObservationReader(const std::filesystem::path& path, ObservationOptions options)
    : impl_(std::make_unique<Impl>(TextFile::streamed(path), std::move(options))) {}
RinexObservationReader::RinexObservationReader(std::string text, const std::filesystem::path& name,
                                               ObservationOptions options)
    : impl_(std::make_unique<Impl>(TextFile::from_string(std::move(text), name), std::move(options))) {}
RinexObservationReader::~RinexObservationReader() = default;
RinexObservationReader::RinexObservationReader(RinexObservationReader&&) noexcept = default;
RinexObservationReader& RinexObservationReader::operator=(RinexObservationReader&&) noexcept = default;

std::optional<ObservationEpoch> RinexObservationReader::next() {
  return impl_->next();
}
const ObservationHeader& RinexObservationReader::header() const {
  return impl_->records.header();
}
const ObservationReport& RinexObservationReader::report() const {
  return impl_->report;
}

RinexObservations read_rinex_observations(const std::filesystem::path& path,
                                          const ObservationOptions& options) {
  RinexObservationReader reader =
      read_as(FileKind::RinexObservation, path, [&] { return RinexObservationReader(path, options); });
  RinexObservations result;
  result.header = reader.header();
  while (auto epoch = reader.next()) result.epochs.push_back(std::move(*epoch));
  result.report = reader.report();
  finish_observations(path, options, result);
  return result;
}

void ObservationOptions::validate() const {
  if (systems.empty()) throw InputError("systems: none is given", "name at least one satellite system");
  for (const auto& [system, list] : codes) {
    for (const std::string& code : list) {
      if (code.size() == 2 && is_digit(code[0]) && code[1] >= 'A' && code[1] <= 'Z') continue;
      throw InputError(fmt::format("codes: '{}' of {} is not an observation code", code, gnss::name(system)),
                       "give a band's digit and a capital letter, such as 1C");
    }
    if (list.empty())
      throw InputError(fmt::format("codes: none is given for {}", gnss::name(system)), "name at least one");
  }
}

ReadReport ObservationReport::all() const {
  ReadReport all = notes;
  for (const auto& [letter, codes] : unknown_codes) {
    all.add_line(ReadReport::Level::Guess,
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
      report.notes.loss(epoch->line, "time of the epoch is not before the later ones");
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
                       : fmt::format("has no {} of a wanted system{}{}", words.substr(words.find(' ') + 1),
                                     reasons.empty() ? "" : ": ", fmt::join(reasons, ", ")),
                   "fetch the file again or give another");
}

RinexObservations read_observations(const std::filesystem::path& path, const ObservationOptions& options) {
  return file_kind(path) == FileKind::GnssLogger ? read_android_observations(path, options)
                                                 : read_rinex_observations(path, options);
}

}  // namespace canyon::rinex
