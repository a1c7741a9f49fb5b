#include "canyon/orbit/sp3_file.hpp"

#include <fmt/format.h>

#include <cmath>
#include <optional>
#include <string_view>

#include "canyon/base/text.hpp"
#include "canyon/geodesy/time_scales.hpp"

namespace canyon::orbit {
namespace {

using geodesy::CalendarTime;
using geodesy::GpsTime;

// Clocks from here on stand for "unknown" (999999.999999).
constexpr double kBadClock_us = 999'999;

class Reader {
 public:
  Reader(TextFile& file, const std::set<gnss::System>& systems) : file_(file), systems_(systems) {}

  Sp3File read() {
    read_first_line();
    while (const std::optional<std::string_view> line = file_.next_line()) {
      if (line->substr(0, 3) == "EOF") return finish();
      const char kind = line->empty() ? ' ' : line->front();
      if (line->substr(0, 2) == "%c") {
        read_time_system(*line);
      } else if (kind == '*') {
        read_epoch(*line);
      } else if (kind == 'P') {
        read_position(*line);
      }
      // Satellite lists, accuracies, comments, velocities (V) and correlations (EP, EV) hold nothing needed
      // here.
    }
    throw file_.error("ends without the line EOF", "the file is cut short: fetch it again");
  }

 private:
  void read_first_line() {
    const std::string_view line = file_.next_line().value_or("");
    if (line.size() < 3 || line[0] != '#' || (line[2] != 'P' && line[2] != 'V')) {
      throw file_.error("is not an SP3 file", "its first line begins with #cP, #cV, #dP or #dV");
    }
    if (line[1] != 'c' && line[1] != 'd') {
      throw file_.error(fmt::format("SP3-{} is not read", line[1]), "give SP3-c or SP3-d");
    }
  }

  // Only the first of the two %c lines names it.
  void read_time_system(std::string_view line) {
    if (!time_system_.empty()) return;
    time_system_ = column(line, 9, 3);
    for (const char* known : {"GPS", "GAL", "QZS", "IRN", "BDT", "TAI", "UTC", "GLO"}) {
      if (time_system_ == known) return;
    }
    throw file_.error(fmt::format("time system '{}' is not known", time_system_),
                      "known are GPS, GAL, QZS, IRN, BDT, TAI, UTC and GLO");
  }

  [[nodiscard]] GpsTime gps_time(const CalendarTime& c) const {
    if (time_system_ == "UTC" || time_system_ == "GLO") return geodesy::gps_from_utc(c);  // GLO: GLONASS UTC
    const GpsTime t = geodesy::gps_from_calendar(c);
    if (time_system_ == "BDT") return t + std::chrono::seconds(geodesy::kBdtSecondsOffset);
    if (time_system_ == "TAI") return t - std::chrono::seconds(19);
    return t;
  }

  void read_epoch(std::string_view line) {
    if (time_system_.empty()) throw file_.error("an epoch before the time system (%c)");
    const auto integer = [&](std::size_t begin, std::size_t length) {
      const std::optional<long long> value = parse_integer(column(line, begin, length));
      if (!value || *value < 0 || *value > 9999) throw bad_epoch(line);
      return static_cast<int>(*value);
    };
    const std::optional<double> second = parse_double(column(line, 20, 11));
    if (!second || *second < 0 || *second >= 61) throw bad_epoch(line);
    CalendarTime c;
    c.year = integer(3, 4);
    c.month = integer(8, 2);
    c.day = integer(11, 2);
    c.hour = integer(14, 2);
    c.minute = integer(17, 2);
    c.second = static_cast<int>(*second);
    try {
      t_ = gps_time(c) + (*second - c.second);
    } catch (const InputError& e) {
      throw file_.error(e.problem(), e.cure());
    }
    if (!result_.epochs.empty() && *t_ <= result_.epochs.back()) {
      throw file_.error(
          fmt::format("epoch {} is not after the epoch before it", geodesy::format_gpst(*t_, 0)));
    }
    result_.epochs.push_back(*t_);
  }

  [[nodiscard]] InputError bad_epoch(std::string_view line) const {
    return file_.error(fmt::format("'{}' is not an epoch", trim(line)));
  }

  void read_position(std::string_view line) {
    if (!t_) throw file_.error("a position before the first epoch");
    const std::string_view name = column(line, 1, 3);
    const std::optional<gnss::SatelliteId> id = gnss::parse_satellite(name);
    if (!id) {
      // NavIC, low orbiters and systems to come are passed over.
      const bool other =
          name.size() == 3 && name[0] >= 'A' && name[0] <= 'Z' && parse_integer(name.substr(1));
      if (other && !gnss::system_from_letter(name[0])) return;
      throw file_.error(fmt::format("'{}' is not a satellite", name));
    }
    if (systems_.count(id->system) == 0) return;
    Sp3Record record;
    record.t = *t_;
    for (std::size_t i = 0; i < 3; ++i) {
      record.position_m[static_cast<Eigen::Index>(i)] = number(line, 4 + 14 * i, "coordinate") * 1e3;
    }
    record.good_position = record.position_m != Eigen::Vector3d::Zero();
    const double clock_us = number(line, 46, "clock");
    record.good_clock = std::abs(clock_us) < kBadClock_us;
    record.clock_bias_s = clock_us * 1e-6;
    record.clock_event = column(line, 74, 1) == "E";
    record.maneuver = column(line, 78, 1) == "M";
    std::vector<Sp3Record>& records = result_.records[*id];
    if (!records.empty() && records.back().t == *t_) {
      throw file_.error(fmt::format("{} is given twice in one epoch", to_string(*id)));
    }
    records.push_back(record);
  }

  [[nodiscard]] double number(std::string_view line, std::size_t begin, const char* what) const {
    const std::optional<double> value = parse_double(column(line, begin, 14));
    if (!value)
      throw file_.error(fmt::format("{} '{}' is not a number", what, trim(column(line, begin, 14))));
    return *value;
  }

  Sp3File finish() {
    if (result_.epochs.empty()) throw file_.error("holds no epoch");
    if (result_.records.empty()) throw file_.error("holds no satellite of the chosen systems");
    return std::move(result_);
  }

  TextFile& file_;
  const std::set<gnss::System>& systems_;
  std::string time_system_;
  std::optional<GpsTime> t_;
  Sp3File result_;
};

}  // namespace

Sp3File read_sp3(TextFile& file, const std::set<gnss::System>& systems) {
  return Reader(file, systems).read();
}

}  // namespace canyon::orbit
