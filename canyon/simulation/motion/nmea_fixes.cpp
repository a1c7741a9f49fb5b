#include "canyon/simulation/motion/nmea_fixes.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>

#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/simulation/motion/nmea_positions.hpp"
#include "canyon/simulation/motion/nmea_sentences.hpp"
#include "canyon/simulation/motion/recorded_path.hpp"

namespace canyon::simulation {
namespace {

using geodesy::Geodetic;
using geodesy::GpsTime;

constexpr std::int64_t kNanosecondsPerDay = 86'400 * GpsTime::kNanosecondsPerSecond;

GpsTime midnight_of(int year, int month, int day) {
  geodesy::CalendarTime midnight;
  midnight.year = year;
  midnight.month = month;
  midnight.day = day;
  return geodesy::gps_from_utc(midnight);
}
GpsTime midnight_of(GpsTime t) {
  const geodesy::CalendarTime date = geodesy::utc_from_gps(t);
  return midnight_of(date.year, date.month, date.day);
}

/// A sentence that says the date.
struct Dated {
  std::size_t before = 0;  ///< the GGA sentence that it stands before
  std::int64_t time_of_day_ns = 0;
  GpsTime midnight;
  bool zda = false;
  bool checked = false;
  std::int64_t day = 0;  ///< days from the first date to the day that the log's first GGA would be of
};

/// The date of a valid RMC, or of a ZDA; nothing of other sentences and of empty fields. An RMC that is not
/// valid has whatever its receiver believed before its first fix.
std::optional<Dated> read_date(const TextFile& file, const NmeaSentence& sentence) {
  std::array<std::string_view, 3> text;  // day, month, year
  Dated dated;
  dated.zda = sentence.is("ZDA");
  dated.checked = sentence.checked;
  if (sentence.is("RMC")) {
    const std::string_view date = sentence.field(9);
    if (is_void(sentence.field(2), sentence.field(12)) || date.size() != 6) return std::nullopt;
    text = {date.substr(0, 2), date.substr(2, 2), date.substr(4, 2)};
  } else if (dated.zda && !sentence.field(4).empty()) {
    text = {sentence.field(2), sentence.field(3), sentence.field(4)};
  } else {
    return std::nullopt;
  }
  if (sentence.field(1).empty()) return std::nullopt;
  std::array<int, 3> value{};
  for (std::size_t k = 0; k < 3; ++k) {
    const auto number = parse_integer(text[k]);
    if (!number || *number < 0 || *number > 9999) {
      throw file.error(fmt::format("the date '{}' is not day, month, year", text[k]));
    }
    value[k] = static_cast<int>(*number);
  }
  if (!dated.zda) value[2] += value[2] < 80 ? 2000 : 1900;
  dated.time_of_day_ns = nmea_time_of_day(file, sentence.field(1));
  try {
    dated.midnight = midnight_of(value[2], value[1], value[0]);
  } catch (const InputError& e) {
    throw file.error(e.problem(), e.cure());
  }
  return dated;
}

/// An RMC or GLL sentence that says that there is no fix.
struct Void {
  std::size_t before = 0;  ///< the position that it stands before
  std::string time;
  bool checked = false;
};

/// A position of another kind of sentence than the one that is read.
struct OtherPosition {
  const NmeaPositionKind* kind = nullptr;
  NmeaPosition position;
};

/// The sentences of a log that have a use.
struct NmeaLog {
  const NmeaPositionKind* kind = nullptr;  ///< of the positions
  std::vector<NmeaPosition> ggas;
  std::vector<Dated> dates;
  std::vector<Void> voids;
  std::vector<OtherPosition> others;
  RecordNotes notes;                      ///< bad: sentences that are whole and make no sense
  std::optional<InputError> passed_over;  ///< why no sentence of a better kind is read

  void leave_out(NmeaPosition& gga, std::string_view why) {
    gga.fix = false;
    notes.skip(gga.line, why);
  }
  /// "GGA sentence without a fix".
  [[nodiscard]] std::string sentence(std::string_view what) const {
    return fmt::format("{} sentence {}", kind->name, what);
  }
  [[nodiscard]] std::size_t places() const {
    return static_cast<std::size_t>(std::count_if(
        ggas.begin(), ggas.end(), [](const NmeaPosition& gga) { return gga.fix && gga.altitude; }));
  }
  [[nodiscard]] bool has_fix() const {
    return std::any_of(ggas.begin(), ggas.end(), [](const NmeaPosition& gga) { return gga.fix; });
  }
};
constexpr std::string_view kDamaged = "damaged sentence (cut short, or with a wrong checksum)";
constexpr std::string_view kWithoutFix = "without a fix";

/// Keeps a position of a kind that is not read; one that is damaged says nothing.
void take_other(const TextFile& file, const NmeaSentence& sentence, NmeaLog& log) {
  for (const NmeaPositionKind& kind : kNmeaPositionKinds) {
    if (&kind == log.kind || !sentence.is(kind.name) || sentence.fields.size() < kind.fields) continue;
    try {
      const NmeaPosition position = read_position(file, kind, sentence);
      if (position.fix) log.others.push_back({&kind, position});
    } catch (const InputError&) {
      return;
    }
  }
}

void take_sentence(const TextFile& file, const NmeaSentence& sentence, NmeaLog& log) {
  take_other(file, sentence, log);
  const bool position = sentence.is(log.kind->name);
  if (position && sentence.fields.size() < log.kind->fields) return log.notes.skip(file.line(), kDamaged);
  log.notes.guard([&] {
    if (position) {
      log.ggas.push_back(read_position(file, *log.kind, sentence));
      if (!log.ggas.back().fix) log.notes.skip(file.line(), log.sentence(kWithoutFix));
    }
    if (auto dated = read_date(file, sentence)) {
      dated->before = log.ggas.size();
      log.dates.push_back(*dated);
    }
  });
  if (sentence.is("GSA") && !log.ggas.empty()) {
    long long& dimensions = log.ggas.back().dimensions;
    dimensions = std::max(dimensions, parse_integer(sentence.field(2)).value_or(0));
  }
  for (const NmeaPositionKind& kind : kNmeaPositionKinds) {
    if (position || kind.status == 0 || !sentence.is(kind.name) || sentence.field(kind.time).empty())
      continue;
    if (is_void(sentence.field(kind.status), sentence.field(kind.mode)))
      log.voids.push_back({log.ggas.size(), std::string(sentence.field(kind.time)), sentence.checked});
  }
}

/// Leaves out positions beside a sentence that says that there is no fix at their time. Positions that no
/// receiver measured (quality 6 and above) stay.
void leave_out_voids(const TextFile& file, NmeaLog& log) {
  for (const Void& none : log.voids) {
    log.notes.guard([&] {
      const std::int64_t time = nmea_time_of_day(file, none.time);
      for (std::size_t k = none.before - std::min<std::size_t>(none.before, 1);
           k < std::min(none.before + 1, log.ggas.size()); ++k) {
        NmeaPosition& gga = log.ggas[k];
        if (gga.fix && gga.quality < 6 && gga.time_of_day_ns == time)
          log.leave_out(gga, log.sentence("of an instant that RMC or GLL calls void"));
      }
    });
  }
}

/// Leaves out positions that all GSA sentences behind them call no fix, and altitudes of 0 that two
/// dimensions do not measure.
void hear_dimensions(NmeaLog& log) {
  for (NmeaPosition& gga : log.ggas) {
    if (!gga.fix || gga.quality >= 6) continue;
    if (gga.dimensions == 1) log.leave_out(gga, log.sentence("of an instant that GSA calls without a fix"));
    if (gga.dimensions == 2 && gga.zero_altitude) gga.altitude = false;
  }
}

NmeaLog read_log(const std::filesystem::path& path, const NmeaPositionKind& positions) {
  TextFile file(path);
  NmeaLog log;
  log.kind = &positions;
  log.notes = RecordNotes(path);
  bool any_checked = false;
  const auto take = [&](const NmeaSentence& sentence) {
    const bool used = sentence.is("ZDA") || sentence.is("GSA") ||
                      std::any_of(kNmeaPositionKinds.begin(), kNmeaPositionKinds.end(),
                                  [&](const NmeaPositionKind& kind) { return sentence.is(kind.name); });
    if (!used) return;
    any_checked = any_checked || sentence.checked;
    take_sentence(file, sentence, log);
  };
  while (const auto line = file.next_line()) {
    for (std::size_t damaged = each_nmea_sentence(*line, take); damaged > 0; --damaged)
      log.notes.skip(file.line(), kDamaged);
  }
  if (any_checked) {
    // Where sentences have checksums, one without is cut short: its last number may be.
    for (NmeaPosition& gga : log.ggas)
      if (!gga.checked && gga.fix) log.leave_out(gga, kDamaged);
    std::erase_if(log.dates, [](const Dated& d) { return !d.checked; });
    std::erase_if(log.voids, [](const Void& v) { return !v.checked; });
    std::erase_if(log.others, [](const OtherPosition& o) { return !o.position.checked; });
  }
  leave_out_voids(file, log);
  hear_dimensions(log);
  return log;
}

/// The log of the first kind of sentence that has a fix; that of GGA where none has. GNS takes GGA's place
/// where it has more.
NmeaLog read_log(const std::filesystem::path& path) {
  NmeaLog first = read_log(path, kNmeaPositionKinds.front());
  const NmeaPositionKind& gns = kNmeaPositionKinds[1];
  const auto places_of_gns = static_cast<std::size_t>(
      std::count_if(first.others.begin(), first.others.end(),
                    [&](const OtherPosition& o) { return o.kind == &gns && o.position.altitude; }));
  if (first.has_fix() && places_of_gns > first.places()) {
    NmeaLog log = read_log(path, gns);
    if (log.places() > first.places()) return log;
  }
  for (std::size_t k = 1; k < kNmeaPositionKinds.size() && !first.has_fix(); ++k) {
    NmeaLog log = read_log(path, kNmeaPositionKinds[k]);
    if (!log.has_fix()) continue;
    if (const auto& bad = first.notes.first_bad(); bad && first.notes.bad_count() > log.notes.bad_count())
      log.passed_over = *bad;
    return log;
  }
  return first;
}

/// Names positions at instants for which the sentences that are read have none.
void note_others(NmeaLog& log) {
  std::vector<std::int64_t> known;
  for (const NmeaPosition& gga : log.ggas)
    if (gga.fix) known.push_back(gga.time_of_day_ns);
  std::sort(known.begin(), known.end());
  // Some receivers cut the seconds of one of them.
  constexpr std::int64_t kNear_ns = 400'000'000;
  std::vector<const OtherPosition*> alone;
  for (const OtherPosition& other : log.others) {
    const std::int64_t time = other.position.time_of_day_ns;
    const auto at = std::lower_bound(known.begin(), known.end(), time - kNear_ns);
    if (at != known.end() && *at <= time + kNear_ns) continue;
    alone.push_back(&other);
    known.insert(std::upper_bound(known.begin(), known.end(), time), time);
  }
  // A damaged sentence has been named.
  if (alone.size() < 2 || alone.size() <= log.notes.count(kDamaged)) return;
  for (const OtherPosition* const other : alone) {
    log.notes.skip(other->position.line,
                   fmt::format("{} position at an instant without {}", other->kind->name, log.kind->name),
                   "not read");
  }
}

std::int64_t floor_days(std::int64_t ns) {
  return ns >= 0 ? ns / kNanosecondsPerDay : -((kNanosecondsPerDay - 1 - ns) / kNanosecondsPerDay);
}

/// The instant with this time of day that lies closest to `near`, both in nanoseconds from one midnight.
std::int64_t closest(std::int64_t time_of_day_ns, std::int64_t near) {
  return time_of_day_ns + floor_days(near - time_of_day_ns + kNanosecondsPerDay / 2) * kNanosecondsPerDay;
}

/// Leaves the dates that can be trusted: RMC's where there are any, else those of ZDA beside a fix (it has no
/// status); and none that contradicts the majority of the five around it. Returns the midnight from which
/// Dated::day counts.
std::optional<GpsTime> trusted_dates(NmeaLog& log, const std::vector<std::int64_t>& since_ns) {
  std::vector<Dated>& dates = log.dates;
  const bool rmc = std::any_of(dates.begin(), dates.end(), [](const Dated& d) { return !d.zda; });
  const auto beside_fix = [&](const Dated& d) {
    return (d.before > 0 && log.ggas[d.before - 1].fix) ||
           (d.before < log.ggas.size() && log.ggas[d.before].fix);
  };
  dates.erase(std::remove_if(dates.begin(), dates.end(),
                             [&](const Dated& d) { return d.zda && (rmc || !beside_fix(d)); }),
              dates.end());
  if (since_ns.empty()) dates.clear();
  if (dates.empty()) return std::nullopt;
  const GpsTime first_midnight = dates.front().midnight;
  for (Dated& date : dates) {
    const std::size_t near = std::min(date.before, since_ns.size() - 1);
    date.day = std::llround((date.midnight - first_midnight) / 86'400.0) -
               floor_days(closest(date.time_of_day_ns, since_ns[near]) - date.time_of_day_ns);
  }
  std::vector<Dated> kept;
  for (std::size_t i = 0; i < dates.size(); ++i) {
    const std::size_t from = i < 2 ? 0 : i - 2, to = std::min(dates.size(), i + 3);
    bool outvoted = false;
    for (std::size_t k = from; k < to && !outvoted; ++k) {
      const auto votes = std::count_if(dates.begin() + static_cast<std::ptrdiff_t>(from),
                                       dates.begin() + static_cast<std::ptrdiff_t>(to),
                                       [&](const Dated& d) { return d.day == dates[k].day; });
      outvoted = dates[k].day != dates[i].day && 2 * votes > static_cast<std::ptrdiff_t>(to - from);
    }
    if (!outvoted) kept.push_back(dates[i]);
  }
  dates = std::move(kept);
  return first_midnight;
}

/// Dated::day for a GGA sentence: that of the date before or behind it whose time of day is closer; 0 without
/// dates.
std::int64_t day_of(const std::vector<Dated>& dates, std::size_t gga, std::int64_t time_of_day_ns) {
  if (dates.empty()) return 0;
  const auto behind = std::upper_bound(dates.begin(), dates.end(), gga,
                                       [](std::size_t i, const Dated& d) { return i < d.before; });
  if (behind == dates.begin()) return behind->day;
  if (behind == dates.end()) return dates.back().day;
  const auto apart = [&](const Dated& d) {
    const std::int64_t ns = std::abs(d.time_of_day_ns - time_of_day_ns);
    return std::min(ns, kNanosecondsPerDay - ns);
  };
  return apart(*behind) < apart(*std::prev(behind)) ? behind->day : std::prev(behind)->day;
}

/// Nanoseconds of each GGA sentence from the midnight before the first fix; sentences without a fix count as
/// the fix before them.
std::vector<std::int64_t> unwrapped(const std::vector<NmeaPosition>& ggas) {
  const auto first = std::find_if(ggas.begin(), ggas.end(), [](const NmeaPosition& gga) { return gga.fix; });
  std::int64_t last_ns = first == ggas.end() ? 0 : first->time_of_day_ns;
  std::vector<std::int64_t> since_ns;
  since_ns.reserve(ggas.size());
  for (const NmeaPosition& gga : ggas) {
    if (gga.fix) last_ns = closest(gga.time_of_day_ns, last_ns);
    since_ns.push_back(last_ns);
  }
  return since_ns;
}

/// NMEA 0183's word for positions of a quality that no receiver measured.
std::string_view unmeasured(long long quality) {
  return quality == 6 ? "estimated" : quality == 7 ? "entered by hand" : quality == 8 ? "simulated" : "";
}

InputError nothing_usable(const NmeaLog& log, std::size_t without_altitude) {
  if (log.notes.first_bad()) return *log.notes.first_bad();
  if (log.passed_over) return *log.passed_over;
  if (without_altitude > 0) {
    return {log.notes.path(), 0, fmt::format("none of its {} fixes has an altitude", without_altitude),
            "trajectory.height_above_terrain_m does without"};
  }
  return {
      log.notes.path(), 0,
      fmt::format("no usable GGA sentence ({} without fix, {} damaged or with a wrong checksum), and no GNS, "
                  "RMC or GLL sentence with a fix",
                  log.notes.count(log.sentence(kWithoutFix)), log.notes.count(kDamaged)),
      "expected lines like $GPGGA,123519,4807.038,N,01131.000,E,1,08,0.9,545.4,M,46.9,M,,*47"};
}

}  // namespace

NmeaFixes read_nmea_fixes(const std::filesystem::path& path, GpsTime start, const HeightReading& heights) {
  NmeaLog log = read_log(path);
  const std::vector<std::int64_t> since_ns = unwrapped(log.ggas);
  const GpsTime first_midnight = trusted_dates(log, since_ns).value_or(midnight_of(start));
  NmeaFixes result;
  result.has_own_dates = !log.dates.empty();
  if (log.passed_over) {
    log.notes.say(log.passed_over->line(), log.passed_over->problem(),
                  fmt::format("positions are those of {}", log.kind->name));
  }
  std::size_t without_altitude = 0;
  double last_height_m = 0;
  for (std::size_t i = 0; i < log.ggas.size(); ++i) {
    const NmeaPosition& gga = log.ggas[i];
    if (!gga.fix) continue;
    if (log.dates.empty() && start == GpsTime{}) {
      throw InputError(path, gga.line,
                       "no RMC or ZDA sentence has the date of a fix, and the scenario has no start",
                       "add 'start: 2026-01-01T12:00:00Z' to the scenario");
    }
    if (const auto how = unmeasured(gga.quality); !how.empty())
      log.notes.skip(gga.line,
                     log.sentence(fmt::format("whose position is {} (quality {})", how, gga.quality)),
                     "it is taken");
    else if (gga.no_satellites)
      log.notes.skip(gga.line, log.sentence("with a fix of 0 satellites"), "it is taken");
    else if (gga.diluted)
      log.notes.skip(gga.line, log.sentence("with a dilution of precision of 50 or more"), "it is taken");
    if (gga.short_longitude)
      log.notes.skip(gga.line, log.sentence("whose longitude has three digits or fewer before its point"),
                     "taken as degrees and minutes, dddmm.mmmm");
    if (!gga.altitude) {
      ++without_altitude;
      log.notes.skip(
          gga.line, log.sentence("without an altitude"),
          heights.needed ? "left out; height_above_terrain_m does without" : "its position is taken");
      if (heights.needed) continue;
    }
    Geodetic place = gga.place;
    if (!gga.altitude) {
      place.height_m = last_height_m;
    } else if (!gga.separation) {
      log.notes.skip(gga.line, log.sentence("without a geoid separation"),
                     heights.geoid_undulation_m != 0 ? "the city's geoid undulation is taken"
                                                     : "its altitude is taken as ellipsoidal height");
      place.height_m += heights.geoid_undulation_m;
    } else if (gga.zero_separation && heights.geoid_undulation_m != 0) {
      log.notes.skip(gga.line, log.sentence("with a geoid separation of 0"),
                     fmt::format("its altitude is taken as ellipsoidal height; the city's geoid undulation "
                                 "is {:.1f} m",
                                 heights.geoid_undulation_m));
    }
    last_height_m = place.height_m;
    // A leap second's time of day is beyond the day that it belongs to.
    const std::int64_t day =
        day_of(log.dates, i, gga.time_of_day_ns) + floor_days(since_ns[i] - gga.time_of_day_ns);
    const GpsTime noon =
        first_midnight + std::chrono::nanoseconds(day * kNanosecondsPerDay + kNanosecondsPerDay / 2);
    result.fixes.push_back(
        {midnight_of(noon) + std::chrono::nanoseconds(gga.time_of_day_ns), place, gga.line});
  }
  if (result.fixes.empty()) throw nothing_usable(log, without_altitude);
  log.notes.require_most(result.fixes.size());
  note_others(log);
  keep_rising(result.fixes, log.notes);
  result.notes = std::move(log.notes);
  return result;
}

std::optional<Geodetic> position_of_gga(std::string_view line) {
  std::optional<Geodetic> place;
  const TextFile text = TextFile::from_string(std::string(line), "GGA");
  (void)each_nmea_sentence(line, [&](const NmeaSentence& sentence) {
    const NmeaPositionKind& gga_kind = kNmeaPositionKinds.front();
    if (place || !sentence.is(gga_kind.name) || sentence.fields.size() < gga_kind.fields) return;
    try {
      const NmeaPosition gga = read_position(text, gga_kind, sentence);
      if (gga.fix && gga.altitude) place = gga.place;
    } catch (const InputError&) {
      return;
    }
  });
  return place;
}

}  // namespace canyon::simulation
