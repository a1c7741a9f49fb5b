#include "canyon/sky/orbit/sp3_file.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/read_report.hpp"
#include "canyon/base/text.hpp"
#include "canyon/sky/rinex/fields.hpp"

namespace canyon::orbit {

namespace {

using geodesy::GpsTime;

// Clocks from here on stand for "unknown" (999999.999999).
constexpr double kBadClock_us = 999'999;

class Reader {
 public:
  Reader(TextFile& file, const std::set<gnss::System>& systems) : file_(file), systems_(systems) {
    result_.report = ReadReport(file.path());
  }

  Sp3File read() {
    read_first_line();
    while (const std::optional<std::string_view> line = file_.next_line()) {
      const bool cut = !file_.text().ends_with('\n') && !file_.peek_line();
      if (line->substr(0, 3) == "EOF") {
        if (!another_follows()) return finish();
        continue;
      }
      const char kind = line->empty() ? ' ' : line->front();
      if (line->substr(0, 2) == "%c") {
        read_time_system(*line);
      } else if (cut) {
        break;  // half a line may read as another number
      } else if (kind == '*') {
        in_epoch_ = false;
        report().guard([&] { read_epoch(*line); });
      } else if (kind == 'P' && (in_epoch_ || result_.epochs.empty())) {
        report().guard([&] { read_position(*line); });
      } else if (!result_.epochs.empty() &&
                 (std::string_view("PVE/%+#i ").find(kind) == std::string_view::npos ||
                  is_cut_record(*line))) {
        report().loss(file_.line(), "line of a kind that SP3 does not have");
      } else if (!result_.epochs.empty() && kind == ' ' && !trim(*line).empty()) {
        in_epoch_ = false;  // an epoch that has lost its mark: what follows is of another time
        report().loss(file_.line(), "line without a mark, with all positions to the next epoch");
      }
      // Satellite lists, accuracies, comments, velocities (V) and correlations (EP, EV) hold nothing needed
      // here.
    }
    report().loss(file_.line(), "ends without the line EOF", "the file may be cut short: fetch it again");
    return finish();
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
    // Columns 47 to 51: "IGS20", "ITR05", "WGS84".
    const std::string_view axes = trim(column(line, 46, 5));
    for (const std::string_view inertial : {"ECI", "J2000", "GCRF", "ICRF", "EME"})
      if (axes.starts_with(inertial))
        throw file_.error(fmt::format("its coordinates are of {}, which does not turn with the Earth", axes),
                          "give orbits in an ITRF or WGS 84");
    announced_ += static_cast<std::size_t>(std::max(0LL, parse_integer(column(line, 32, 7)).value_or(0)));
    time_system_.clear();
  }

  /// "E05 ...": a record of a position without its P. EP and EV are correlations.
  static bool is_cut_record(std::string_view line) {
    return line.front() == 'E' && line.substr(0, 2) != "EP" && line.substr(0, 2) != "EV";
  }

  /// Files that were joined by cat have headers behind the line EOF.
  [[nodiscard]] bool another_follows() {
    while (const auto line = file_.peek_line()) {
      if (!line->empty() && line->front() == '#') {
        read_first_line();
        return true;
      }
      if (!trim(*line).empty()) return false;
      (void)file_.next_line();
    }
    return false;
  }

  // The first of the two %c lines names it, the other does not.
  void read_time_system(std::string_view line) {
    if (!time_system_.empty()) return;
    time_system_ = column(line, 9, 3);
    if (rinex::is_time_system(time_system_)) return;
    throw file_.error(fmt::format("time system '{}' is not known", time_system_),
                      "known are GPS, GAL, QZS, IRN, BDT, TAI, UTC and GLO");
  }

  /// The time in columns 4 to 31, as in the first line and in those of epochs.
  [[nodiscard]] std::optional<GpsTime> time_of(std::string_view line) const {
    if (time_system_.empty()) throw file_.error("an epoch before the time system (%c)");
    return rinex::time_in(line, {{{3, 4}, {8, 2}, {11, 2}, {14, 2}, {17, 2}, {20, 11}}}, time_system_);
  }

  [[nodiscard]] ReadReport& report() { return result_.report; }

  void read_epoch(std::string_view line) {
    const auto t = time_of(line);
    if (!t || !trim(column(line, 31, line.size())).empty())
      throw file_.error(fmt::format("'{}' is not an epoch", trim(line)));
    if (!result_.epochs.empty() && *t <= result_.epochs.back()) {
      throw file_.error(fmt::format("epoch {} does not follow the one before", geodesy::format_gpst(*t, 0)));
    }
    result_.epochs.push_back(*t);
    in_epoch_ = true;
  }

  void read_position(std::string_view line) {
    if (result_.epochs.empty()) throw file_.error("a position before the first epoch");
    constexpr std::size_t kLongest = 80;
    if (trim(line).size() > kLongest) throw file_.error("a line of more than 80 columns");
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
    record.t = result_.epochs.back();
    record.line = file_.line();
    for (std::size_t i = 0; i < 3; ++i) {
      record.position_m[static_cast<Eigen::Index>(i)] = number(line, 4 + 14 * i, "coordinate") * 1e3;
    }
    require_columns(line);
    record.good_position = record.position_m != Eigen::Vector3d::Zero();
    // Blank or asterisks: a clock that the writer did not have.
    const std::string_view clock = trim(column(line, 46, 14));
    const bool absent = clock.find_first_not_of('*') == std::string_view::npos;
    const double clock_us = absent ? kBadClock_us : number(line, 46, "clock");
    if (std::abs(clock_us) > kBadClock_us + 1)
      throw file_.error(fmt::format("the clock of {}, {:.0f} us, is impossible", to_string(*id), clock_us));
    record.good_clock = std::abs(clock_us) < kBadClock_us;
    record.clock_bias_s = clock_us * 1e-6;
    record.clock_event = column(line, 74, 1) == "E";
    record.maneuver = column(line, 78, 1) == "M";
    std::vector<Sp3Record>& records = result_.records[*id];
    if (!records.empty() && records.back().t == record.t)
      throw file_.error(fmt::format("{} is given twice in one epoch", to_string(*id)));
    records.push_back(record);
  }

  /// The points of a line's numbers stand in equal columns and have equally many digits behind them (F14.6):
  /// a lost or added character changes that.
  void require_columns(std::string_view line) const {
    std::optional<std::pair<std::size_t, std::size_t>> usual;
    for (std::size_t i = 0; i < 4; ++i) {
      const std::string_view field = column(line, 4 + 14 * i, 14);
      const std::size_t point = field.find('.');
      if (point == std::string_view::npos) continue;
      const std::pair places(point, trim(field.substr(point)).size());
      if (places != usual.value_or(places)) throw file_.error("a number has lost or gained a character");
      usual = places;
    }
  }

  [[nodiscard]] double number(std::string_view line, std::size_t begin, const char* what) const {
    const std::optional<double> value = parse_double(column(line, begin, 14));
    if (!value)
      throw file_.error(fmt::format("{} '{}' is not a number", what, trim(column(line, begin, 14))));
    return *value;
  }

  Sp3File finish() {
    std::size_t good = result_.epochs.size();
    for (const auto& [id, records] : result_.records) good += records.size();
    report().require_most(good);
    if (result_.epochs.empty()) throw file_.error("holds no epoch");
    if (result_.records.empty()) throw file_.error("holds no satellite of the chosen systems");
    if (announced_ > result_.epochs.size()) {
      report().loss(
          1,
          fmt::format("the header announces {} epochs, and {} are read", announced_, result_.epochs.size()),
          "the file may be cut short");
    }
    note_without("position", [](const Sp3Record& r) { return r.good_position; });
    note_without("clock", [](const Sp3Record& r) { return r.good_clock; });
    result_.step_s = most_frequent_step();
    return std::move(result_);
  }

  /// Notes the satellites none of whose records is good. Throws InputError where that are all.
  template <typename Good>
  void note_without(std::string_view what, const Good& good) {
    std::vector<std::string> without;
    for (const auto& [id, records] : result_.records)
      if (std::none_of(records.begin(), records.end(), good)) without.push_back(to_string(id));
    if (without.size() == result_.records.size()) {
      throw InputError(file_.path(), 0, fmt::format("no satellite has a {}", what),
                       "give a file with positions and clocks");
    }
    if (without.empty()) return;
    report().remark(0, fmt::format("no {} of {}", what, fmt::join(without, ", ")),
                    "these satellites are left out");
  }

  [[nodiscard]] double most_frequent_step() const {
    std::map<std::int64_t, int> counts;
    const std::vector<GpsTime>& epochs = result_.epochs;
    for (std::size_t i = 1; i < epochs.size(); ++i)
      ++counts[epochs[i].nanoseconds() - epochs[i - 1].nanoseconds()];
    const auto most = std::max_element(counts.begin(), counts.end(),
                                       [](const auto& a, const auto& b) { return a.second < b.second; });
    return most == counts.end() ? 0 : static_cast<double>(most->first) * 1e-9;
  }

  TextFile& file_;
  const std::set<gnss::System>& systems_;
  std::string time_system_;
  std::size_t announced_ = 0;  ///< epochs
  bool in_epoch_ = false;      ///< the last line of an epoch could be read
  Sp3File result_;
};

}  // namespace

Sp3File read_sp3(TextFile& file, const std::set<gnss::System>& systems) {
  return Reader(file, systems).read();
}

using geodesy::kEarthJ2;
using geodesy::kEarthMu;
using geodesy::kSemiMajorAxis;

// Elements from vectors: Vallado, Fundamentals of Astrodynamics, 2.5; secular rates: the same, 9-37 to 9-41.
ReferenceOrbit::ReferenceOrbit(geodesy::GpsTime epoch, const Eigen::Vector3d& position,
                               const Eigen::Vector3d& velocity)
    : epoch_(epoch) {
  const double r = position.norm();
  const double a = 1 / (2 / r - velocity.squaredNorm() / kEarthMu);
  const Eigen::Vector3d h = position.cross(velocity);
  const Eigen::Vector3d to_perigee = velocity.cross(h) / kEarthMu - position / r;
  const double e = to_perigee.norm();
  // The condition is negated, so that NaN is refused.
  if (!(a > kSemiMajorAxis && a < 1e9 && e < 0.9)) return;
  semi_major_axis_ = a;
  eccentricity_ = e;
  axes_.col(2) = h.normalized();
  // A circle has its perigee where we are.
  axes_.col(0) = e > 1e-10 ? (to_perigee / e).eval() : (position / r).eval();
  axes_.col(1) = axes_.col(2).cross(axes_.col(0));
  const double eccentric =
      std::atan2(position.dot(axes_.col(1)) / std::sqrt(1 - e * e), position.dot(axes_.col(0)) + a * e);
  mean_anomaly_ = eccentric - e * std::sin(eccentric);
  mean_motion_ = std::sqrt(kEarthMu / (a * a * a));
  const double p = a * (1 - e * e);
  const double k = 1.5 * mean_motion_ * kEarthJ2 * (kSemiMajorAxis / p) * (kSemiMajorAxis / p);
  const double cos_i = axes_(2, 2);
  node_rate_ = -k * cos_i;
  perigee_rate_ = k * (2 - 2.5 * (1 - cos_i * cos_i));
}

ReferenceOrbit::State ReferenceOrbit::at(geodesy::GpsTime t) const {
  State state;
  const double dt = t - epoch_;
  if (semi_major_axis_ == 0) {
    state.true_anomaly_rad = dt / 3600;
    state.true_anomaly_rate = 1 / 3600.0;
    return state;
  }
  const double e = eccentricity_;
  const double mean = mean_anomaly_ + mean_motion_ * dt;
  const double wrapped = std::remainder(mean, 2 * geodesy::kPi);
  double eccentric = wrapped + e * std::sin(wrapped);
  for (int i = 0; i < 20; ++i) {
    const double step = (eccentric - e * std::sin(eccentric) - wrapped) / (1 - e * std::cos(eccentric));
    eccentric -= step;
    if (std::abs(step) < 1e-15) break;
  }
  const double c = std::cos(eccentric);
  const double s = std::sin(eccentric);
  const double flat = std::sqrt(1 - e * e);
  const double b = semi_major_axis_ * flat;
  const double rate = mean_motion_ / (1 - e * c);
  const Eigen::Matrix3d axes =
      Eigen::AngleAxisd(node_rate_ * dt, Eigen::Vector3d::UnitZ()) * axes_ *
      Eigen::AngleAxisd(perigee_rate_ * dt, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  const Eigen::Vector3d turning = Eigen::Vector3d(0, 0, node_rate_) + perigee_rate_ * axes.col(2);
  state.position_m = axes * Eigen::Vector3d(semi_major_axis_ * (c - e), b * s, 0);
  state.velocity_mps =
      axes * Eigen::Vector3d(-semi_major_axis_ * s * rate, b * c * rate, 0) + turning.cross(state.position_m);
  // The difference of true and mean anomaly has no jump, so the sum counts revolutions as the mean anomaly
  // does.
  state.true_anomaly_rad = mean + (std::atan2(flat * s, c - e) - wrapped);
  state.true_anomaly_rate = rate * flat / (1 - e * c);
  return state;
}

}  // namespace canyon::orbit
