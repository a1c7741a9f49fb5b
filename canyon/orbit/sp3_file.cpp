#include "canyon/orbit/sp3_file.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>

#include "canyon/base/longest_rise.hpp"
#include "canyon/base/record_notes.hpp"
#include "canyon/base/text.hpp"
#include "canyon/geodesy/time_scales.hpp"

namespace canyon::orbit {
namespace {

using geodesy::CalendarTime;
using geodesy::GpsTime;

// Clocks from here on stand for "unknown" (999999.999999).
constexpr double kBadClock_us = 999'999;
// So few epochs in a row apart from the others are wrong dates.
constexpr std::size_t kFewEpochs = 3;

class Reader {
 public:
  Reader(TextFile& file, const std::set<gnss::System>& systems)
      : file_(file), systems_(systems), left_out_(file.path()) {}

  Sp3File read() {
    read_first_line();
    while (const std::optional<std::string_view> line = file_.next_line()) {
      if (line->substr(0, 3) == "EOF") {
        if (!another_follows()) return finish();
        continue;
      }
      const char kind = line->empty() ? ' ' : line->front();
      if (line->substr(0, 2) == "##") {
        if (const auto step = parse_double(column(*line, 24, 14))) announced_step_s_ = *step;
      } else if (line->substr(0, 2) == "%c") {
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
    announced_ += static_cast<std::size_t>(std::max(0LL, parse_integer(column(line, 32, 7)).value_or(0)));
    time_system_.clear();
    first_line_ = line;
  }

  /// Files that were joined by cat have headers behind the line EOF.
  [[nodiscard]] bool another_follows() {
    while (const auto line = file_.peek_line()) {
      if (!line->empty() && line->front() == '#') {
        const std::string first = first_line_;
        read_first_line();
        first_line_ = first;
        return true;
      }
      if (!trim(*line).empty()) return false;
      (void)file_.next_line();
    }
    return false;
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

  /// The time in columns 4 to 31, as in the first line and in those of epochs.
  [[nodiscard]] GpsTime time_of(std::string_view line) const {
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
      return gps_time(c) + (*second - c.second);
    } catch (const InputError& e) {
      throw file_.error(e.problem(), e.cure());
    }
  }

  void read_epoch(std::string_view line) {
    const GpsTime t = time_of(line);
    if (epochs_.empty()) compare_first_line(t);
    epochs_.push_back(t);
    epoch_lines_.push_back(file_.line());
  }

  void compare_first_line(GpsTime t) {
    try {
      const GpsTime stated = time_of(first_line_);
      if (stated == t) return;
      left_out_.say(file_.line(),
                    fmt::format("the first epoch is {}, but the first line of the file says {}",
                                geodesy::format_gpst(t, 0), geodesy::format_gpst(stated, 0)),
                    "the lines of epochs count");
    } catch (const InputError&) {
      // Not a time: only the lines of epochs count.
    }
  }

  [[nodiscard]] InputError bad_epoch(std::string_view line) const {
    return file_.error(fmt::format("'{}' is not an epoch", trim(line)));
  }

  void read_position(std::string_view line) {
    if (epochs_.empty()) throw file_.error("a position before the first epoch");
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
    record.t = epochs_.back();
    record.line = file_.line();
    for (std::size_t i = 0; i < 3; ++i) {
      record.position_m[static_cast<Eigen::Index>(i)] = number(line, 4 + 14 * i, "coordinate") * 1e3;
    }
    record.good_position = record.position_m != Eigen::Vector3d::Zero();
    // Blank or asterisks: a clock that the writer did not have.
    const std::string_view clock = trim(column(line, 46, 14));
    const bool absent = clock.find_first_not_of('*') == std::string_view::npos;
    const double clock_us = absent ? kBadClock_us : number(line, 46, "clock");
    record.good_clock = std::abs(clock_us) < kBadClock_us;
    record.clock_bias_s = clock_us * 1e-6;
    record.clock_event = column(line, 74, 1) == "E";
    record.maneuver = column(line, 78, 1) == "M";
    std::vector<Read>& records = records_[*id];
    const std::size_t epoch = epochs_.size() - 1;
    if (!records.empty() && records.back().epoch == epoch) {
      throw file_.error(fmt::format("{} is given twice in one epoch", to_string(*id)));
    }
    records.push_back({record, epoch});
  }

  [[nodiscard]] double number(std::string_view line, std::size_t begin, const char* what) const {
    const std::optional<double> value = parse_double(column(line, begin, 14));
    if (!value)
      throw file_.error(fmt::format("{} '{}' is not a number", what, trim(column(line, begin, 14))));
    return *value;
  }

  Sp3File finish() {
    if (epochs_.empty()) throw file_.error("holds no epoch");
    if (records_.empty()) throw file_.error("holds no satellite of the chosen systems");
    leave_out_epochs();
    compare_announced();
    for (const auto& [id, records] : records_) {
      for (const Read& read : records)
        if (!stray_[read.epoch]) result_.records[id].push_back(read.record);
    }
    if (result_.records.empty()) throw file_.error("holds no satellite of the chosen systems");
    result_.warnings = left_out_.take();
    review_sp3(result_, file_.path());
    return std::move(result_);
  }

  /// Epochs whose times do not rise, and few that stand apart from the others.
  void leave_out_epochs() {
    stray_ = outside_longest_rise(epochs_);
    std::vector<std::size_t> rising;
    for (std::size_t i = 0; i < epochs_.size(); ++i) {
      if (!stray_[i]) {
        rising.push_back(i);
        continue;
      }
      left_out_.add(epoch_lines_[i], fmt::format("epoch {} is not in order with those around it",
                                                 geodesy::format_gpst(epochs_[i], 0)));
    }
    if (2 * rising.size() < epochs_.size()) {
      throw InputError(file_.path(), epoch_lines_.front(), "the epochs are not in the order of time",
                       "sort them, or fetch the file again");
    }
    const double step_s = most_frequent_step(rising);
    std::size_t begin = 0, longest = 0;
    std::vector<std::pair<std::size_t, std::size_t>> runs;  // without holes that no polynomial bridges
    for (std::size_t i = 1; i <= rising.size(); ++i) {
      if (i < rising.size() && epochs_[rising[i]] - epochs_[rising[i - 1]] <= 2.5 * step_s) continue;
      runs.emplace_back(begin, i);
      longest = std::max(longest, i - begin);
      begin = i;
    }
    for (const auto& [from, to] : runs) {
      if (to - from > kFewEpochs || to - from == longest) continue;
      for (std::size_t i = from; i < to; ++i) {
        stray_[rising[i]] = true;
        left_out_.add(epoch_lines_[rising[i]],
                      fmt::format("epoch {} stands apart from the others of the file",
                                  geodesy::format_gpst(epochs_[rising[i]], 0)));
      }
    }
    for (const std::size_t i : rising)
      if (!stray_[i]) result_.epochs.push_back(epochs_[i]);
    result_.step_s = step_s;
  }

  [[nodiscard]] double most_frequent_step(const std::vector<std::size_t>& rising) const {
    std::map<std::int64_t, int> counts;
    for (std::size_t i = 1; i < rising.size(); ++i)
      ++counts[epochs_[rising[i]].nanoseconds() - epochs_[rising[i - 1]].nanoseconds()];
    const auto most = std::max_element(counts.begin(), counts.end(),
                                       [](const auto& a, const auto& b) { return a.second < b.second; });
    return most == counts.end() ? 0 : static_cast<double>(most->first) * 1e-9;
  }

  /// What the header says of epochs, against what is there.
  void compare_announced() {
    const std::vector<GpsTime>& epochs = result_.epochs;
    if (epochs.size() < 2) return;
    const auto all =
        static_cast<std::size_t>(std::lround((epochs.back() - epochs.front()) / result_.step_s)) + 1;
    if (all > epochs.size()) {
      std::size_t i = 1;
      while (i + 1 < epochs.size() && epochs[i] - epochs[i - 1] <= 1.5 * result_.step_s) ++i;
      left_out_.say(0,
                    fmt::format("{} epochs are missing, the first after {}", all - epochs.size(),
                                geodesy::format_gpst(epochs[i - 1], 0)),
                    "no orbit reaches over more than one missing epoch");
    }
    if (announced_ > epochs_.size()) {
      left_out_.say(
          1, fmt::format("the header announces {} epochs, and there are {}", announced_, epochs_.size()),
          "the file may be cut short");
    }
    if (announced_step_s_ > 0 && std::abs(announced_step_s_ - result_.step_s) > 1e-3) {
      left_out_.say(2,
                    fmt::format("the header says an interval of {:g} s, and the epochs are {:g} s apart",
                                announced_step_s_, result_.step_s),
                    "the lines of epochs count");
    }
  }

  /// A record of an epoch, the number of which is that in epochs_.
  struct Read {
    Sp3Record record;
    std::size_t epoch = 0;
  };

  TextFile& file_;
  const std::set<gnss::System>& systems_;
  RecordNotes left_out_;
  std::string time_system_, first_line_;
  std::size_t announced_ = 0;  ///< epochs
  double announced_step_s_ = 0;
  std::vector<GpsTime> epochs_;
  std::vector<int> epoch_lines_;
  std::vector<bool> stray_;  ///< by epoch
  std::map<gnss::SatelliteId, std::vector<Read>> records_;
  Sp3File result_;
};

}  // namespace

Sp3File read_sp3(TextFile& file, const std::set<gnss::System>& systems) {
  return Reader(file, systems).read();
}

}  // namespace canyon::orbit
