#include "canyon/sky/orbit/precise_sky.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>

#include "canyon/base/file_kind.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/text.hpp"
#include "canyon/sky/orbit/nominal_constellation.hpp"
#include "canyon/sky/rinex/fields.hpp"

namespace canyon::orbit {
namespace {

using geodesy::GpsTime;
using geodesy::kEarthRotationRate;
using geodesy::kSpeedOfLight;

constexpr std::size_t kPoints = 11;

/// A record ready for interpolation.
struct Node {
  double anomaly = 0;    ///< true anomaly of the reference orbit
  Eigen::Vector3d rest;  ///< position in the axes of Table::origin, minus the reference orbit
};

struct TabulatedOrbit {
  std::vector<Sp3Record> records;
  std::vector<Node> nodes;  ///< one for each record
  ReferenceOrbit reference;
  double carrier_frequency_hz = 0;
};

/// Position and velocity, in the axes of Table::origin, of the polynomial through 11 nodes plus the reference
/// orbit. The variable is the true anomaly: as functions of it the equations of an eccentric orbit have no
/// poles near the real axis, so that the polynomials converge fast also at perigee.
std::pair<Eigen::Vector3d, Eigen::Vector3d> interpolate(const TabulatedOrbit& series, std::size_t first,
                                                        GpsTime t) {
  const ReferenceOrbit::State reference = series.reference.at(t);
  const Node* const nodes = &series.nodes[first];
  std::array<double, kPoints> x{};
  for (std::size_t i = 0; i < kPoints; ++i) x[i] = nodes[i].anomaly - reference.true_anomaly_rad;
  Eigen::Vector3d value = Eigen::Vector3d::Zero();
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
  for (std::size_t j = 0; j < kPoints; ++j) {
    double weight = 1;
    double derivative = 0;  // product rule, factor by factor
    for (std::size_t k = 0; k < kPoints; ++k) {
      if (k == j) continue;
      const double scale = 1 / (x[j] - x[k]);
      derivative = (weight - derivative * x[k]) * scale;
      weight *= -x[k] * scale;
    }
    value += weight * nodes[j].rest;
    slope += derivative * nodes[j].rest;
  }
  return {reference.position_m + value, reference.velocity_mps + slope * reference.true_anomaly_rate};
}

double carrier_frequency(gnss::SatelliteId id) {
  int channel = 0;
  for (const OrbitSlot& slot : nominal_slots(id.system))
    if (slot.id == id) channel = slot.glonass_channel;
  return l1_frequency_hz(id.system, channel);
}

/// Files as one, in order of their first epoch.
Sp3File joined_files(std::vector<Sp3File> files) {
  std::sort(files.begin(), files.end(),
            [](const Sp3File& a, const Sp3File& b) { return a.epochs.front() < b.epochs.front(); });
  Sp3File joined;
  for (Sp3File& file : files) {
    joined.epochs.insert(joined.epochs.end(), file.epochs.begin(), file.epochs.end());
    for (auto& [id, records] : file.records) {
      std::vector<Sp3Record>& all = joined.records[id];
      all.insert(all.end(), records.begin(), records.end());
    }
  }
  std::sort(joined.epochs.begin(), joined.epochs.end());
  joined.epochs.erase(std::unique(joined.epochs.begin(), joined.epochs.end()), joined.epochs.end());
  for (auto& [id, records] : joined.records) {
    std::stable_sort(records.begin(), records.end(), [](const Sp3Record& a, const Sp3Record& b) {
      const auto bad = [](const Sp3Record& r) { return !r.good_position || !r.good_clock; };
      return a.t < b.t || (a.t == b.t && bad(a) < bad(b));
    });
    records.erase(std::unique(records.begin(), records.end(),
                              [](const Sp3Record& a, const Sp3Record& b) { return a.t == b.t; }),
                  records.end());
  }
  return joined;
}

using geodesy::GpsTime;

// Clocks of this value or more mean "unknown" (999999.999999).
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
        break;  // half a line may parse as another number
      } else if (kind == '*') {
        in_epoch_ = false;
        report().guard([&] { read_epoch(*line); });
      } else if (kind == 'P' && (in_epoch_ || result_.epochs.empty())) {
        report().guard([&] { read_position(*line); });
      } else if (!result_.epochs.empty() &&
                 (std::string_view("PVE/%+#i ").find(kind) == std::string_view::npos ||
                  is_cut_record(*line))) {
        report().loss(file_.line(), "line of a kind not defined in SP3");
      } else if (!result_.epochs.empty() && kind == ' ' && !trim(*line).empty()) {
        in_epoch_ = false;  // an epoch line without its mark: the following positions are of another time
        report().loss(file_.line(), "line without a mark, with all positions to the next epoch");
      }
      // Satellite lists, accuracies, comments, velocities (V) and correlations (EP, EV) are not needed here.
    }
    report().loss(file_.line(), "ends without the line EOF", "the file may be cut short: fetch it again");
    return finish();
  }

 private:
  void read_first_line() {
    const std::string_view line = file_.next_line().value_or("");
    if (line.size() < 3 || line[0] != '#' || (line[2] != 'P' && line[2] != 'V'))
      throw file_.error("is not an SP3 file", "its first line begins with #cP, #cV, #dP or #dV");
    if (line[1] != 'c' && line[1] != 'd')
      throw file_.error(fmt::format("SP3-{} is not supported", line[1]), "give SP3-c or SP3-d");
    // Columns 47 to 51: "IGS20", "ITR05", "WGS84".
    const std::string_view axes = trim(column(line, 46, 5));
    for (const std::string_view inertial : {"ECI", "J2000", "GCRF", "ICRF", "EME"})
      if (axes.starts_with(inertial))
        throw file_.error(
            fmt::format("its coordinates are in {}, which does not rotate with the Earth", axes),
            "give orbits in an ITRF or WGS 84");
    announced_ += static_cast<std::size_t>(std::max(0LL, parse_integer(column(line, 32, 7)).value_or(0)));
    time_system_.clear();
  }

  /// "E05 ...": a position record without its P. EP and EV are correlations.
  static bool is_cut_record(std::string_view line) {
    return line.front() == 'E' && line.substr(0, 2) != "EP" && line.substr(0, 2) != "EV";
  }

  /// Files joined by cat have headers after the line EOF.
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

  // Only the first of the two %c lines has it.
  void read_time_system(std::string_view line) {
    if (!time_system_.empty()) return;
    time_system_ = column(line, 9, 3);
    if (rinex::is_time_system(time_system_)) return;
    throw file_.error(fmt::format("time system '{}' is not known", time_system_),
                      "use GPS, GAL, QZS, IRN, BDT, TAI, UTC or GLO");
  }

  /// The time in columns 4 to 31 of the first line and of epoch lines.
  [[nodiscard]] std::optional<GpsTime> time_of(std::string_view line) const {
    if (time_system_.empty()) throw file_.error("an epoch before the time system (%c)");
    return rinex::time_in(line, {{{3, 4}, {8, 2}, {11, 2}, {14, 2}, {17, 2}, {20, 11}}}, time_system_);
  }

  [[nodiscard]] ReadReport& report() { return result_.report; }

  void read_epoch(std::string_view line) {
    const auto t = time_of(line);
    if (!t || !trim(column(line, 31, line.size())).empty())
      throw file_.error(fmt::format("'{}' is not an epoch", trim(line)));
    if (!result_.epochs.empty() && *t <= result_.epochs.back())
      throw file_.error(fmt::format("epoch {} does not follow the one before", geodesy::format_gpst(*t, 0)));
    result_.epochs.push_back(*t);
    in_epoch_ = true;
  }

  void read_position(std::string_view line) {
    if (result_.epochs.empty()) throw file_.error("a position before the first epoch");
    constexpr std::size_t kMax = 80;
    if (trim(line).size() > kMax) throw file_.error("a line of more than 80 columns");
    const std::string_view name = column(line, 1, 3);
    const std::optional<gnss::SatelliteId> id = gnss::parse_satellite(name);
    if (!id) {
      // NavIC, low orbiters and future systems are skipped.
      const bool other =
          name.size() == 3 && name[0] >= 'A' && name[0] <= 'Z' && parse_integer(name.substr(1));
      if (other && !gnss::system_from_letter(name[0])) return;
      throw file_.error(fmt::format("'{}' is not a satellite", name));
    }
    if (systems_.count(id->system) == 0) return;
    Sp3Record record;
    record.t = result_.epochs.back();
    record.line = file_.line();
    for (std::size_t i = 0; i < 3; ++i)
      record.position_m[static_cast<Eigen::Index>(i)] = number(line, 4 + 14 * i, "coordinate") * 1e3;
    require_columns(line);
    record.good_position = record.position_m != Eigen::Vector3d::Zero();
    // Blank or asterisks: the writer had no clock.
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

  /// Numbers are right-aligned in their columns (F14.6; other digit counts occur), and a blank follows the
  /// last: a lost or added character shifts the following ones.
  void require_columns(std::string_view line) const {
    bool moved = !trim(column(line, 60, 1)).empty();
    for (std::size_t i = 0; i < 4; ++i) {
      const std::string_view field = column(line, 4 + 14 * i, 14);
      moved = moved || (!trim(field).empty() && (field.size() < 14 || field.back() == ' '));
    }
    if (moved) throw file_.error("a number has lost or gained a character");
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
    report().require_majority(good);
    if (result_.epochs.empty()) throw file_.error("has no epoch");
    if (result_.records.empty()) throw file_.error("has no satellite of the chosen systems");
    if (announced_ > result_.epochs.size()) {
      report().loss(
          1,
          fmt::format("the header declares {} epochs, but {} were read", announced_, result_.epochs.size()),
          "the file may be cut short");
    }
    note_without("position", [](const Sp3Record& r) { return r.good_position; });
    note_without("clock", [](const Sp3Record& r) { return r.good_clock; });
    result_.step_s = modal_step();
    return std::move(result_);
  }

  /// Notes the satellites without any good record. Throws InputError if these are all satellites.
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

  [[nodiscard]] double modal_step() const {
    std::map<std::int64_t, int> counts;
    const std::vector<GpsTime>& epochs = result_.epochs;
    for (std::size_t i = 1; i < epochs.size(); ++i)
      ++counts[epochs[i].nanoseconds() - epochs[i - 1].nanoseconds()];
    const auto maximum = std::max_element(counts.begin(), counts.end(),
                                          [](const auto& a, const auto& b) { return a.second < b.second; });
    return maximum == counts.end() ? 0 : static_cast<double>(maximum->first) * 1e-9;
  }

  TextFile& file_;
  const std::set<gnss::System>& systems_;
  std::string time_system_;
  std::size_t announced_ = 0;  ///< epochs
  bool in_epoch_ = false;      ///< the last epoch line was readable
  Sp3File result_;
};

}  // namespace

struct PreciseSky::Table {
  std::string names;  ///< of all files
  GpsTime origin;     ///< first epoch, whose axes are the common ones
  GpsTime last;
  double spacing_s = 0;  ///< of epochs; for several files the longest
  std::map<gnss::SatelliteId, TabulatedOrbit> series;
  ReadReport report;

  Table(std::vector<TextFile> files, const std::set<gnss::System>& systems) {
    std::vector<Sp3File> parts;
    for (TextFile& file : files) {
      parts.push_back(read_as(FileKind::Sp3, file.path(), [&] { return read_sp3(file, systems); }));
      spacing_s = std::max(spacing_s, parts.back().step_s);
      report.append(parts.back().report);
      names += (names.empty() ? "" : ", ") + file.path().filename().string();
    }
    Sp3File sp3 = joined_files(std::move(parts));
    origin = sp3.epochs.front();
    last = sp3.epochs.back();
    for (auto& [id, records] : sp3.records) {
      TabulatedOrbit& s = series[id];
      s.carrier_frequency_hz = carrier_frequency(id);
      s.records = std::move(records);
      for (Sp3Record& r : s.records) r.position_m = rotate_earth(r.position_m, origin - r.t);
      make_nodes(s);
      fit_reference(s);
    }
  }

  static void make_nodes(TabulatedOrbit& s) {
    s.nodes.clear();
    for (const Sp3Record& r : s.records) {
      const ReferenceOrbit::State reference = s.reference.at(r.t);
      s.nodes.push_back({reference.true_anomaly_rad, r.position_m - reference.position_m});
    }
  }

  /// The record closest to the middle at which a polynomial can be evaluated.
  [[nodiscard]] std::optional<std::size_t> centre_of_good_records(const TabulatedOrbit& s) const {
    const std::size_t count = s.records.size();
    for (std::size_t i = 0; i < count; ++i) {
      // Middle, one before, one after, two before, ...
      const std::size_t k = i % 2 == 0 ? count / 2 + i / 2 : count / 2 - (i + 1) / 2;
      if (k < count && s.records[k].good_position && window({&s, k, k, {}}, s.records[k].t)) return k;
    }
    return std::nullopt;
  }

  void fit_reference(TabulatedOrbit& s) const {
    const std::optional<std::size_t> centre = centre_of_good_records(s);
    if (!centre) return;
    const GpsTime epoch = s.records[*centre].t;
    const std::size_t first = *window({&s, *centre, *centre, {}}, epoch);
    const auto good = [](const Sp3Record& r) { return r.good_position; };
    const auto begin = std::find_if(s.records.begin(), s.records.end(), good);
    const auto end = std::find_if(s.records.rbegin(), s.records.rend(), good);
    for (int round = 0; round < 2; ++round) {
      // The second velocity, computed with the first reference, has no polynomial error.
      const auto [position, velocity] = interpolate(s, first, epoch);
      s.reference = ReferenceOrbit(epoch, position, velocity);
      // The elements of one instant contain short periods, which change the mean motion by 1e-4: scale the
      // reference's mean motion to match the first and last records.
      const auto lag_s = [&s](const Sp3Record& r) {
        const ReferenceOrbit::State at = s.reference.at(r.t);
        const double v2 = at.velocity_mps.squaredNorm();
        return v2 > 0 ? (at.position_m - r.position_m).dot(at.velocity_mps) / v2 : 0;
      };
      for (int i = 0; i < 3 && begin->t < end->t; ++i)
        s.reference.scale_mean_motion(1 - (lag_s(*end) - lag_s(*begin)) / (end->t - begin->t));
      make_nodes(s);
    }
  }

  /// The records around `t`, the same one twice if `t` is its epoch; or the reason why there are none.
  struct Bracket {
    const TabulatedOrbit* series = nullptr;
    std::size_t low = 0;
    std::size_t high = 0;
    std::string missing;
  };

  [[nodiscard]] Bracket bracket(gnss::SatelliteId id, GpsTime t) const {
    Bracket b;
    const auto found = series.find(id);
    if (found == series.end()) {
      b.missing = "is not in the file";
      return b;
    }
    const std::vector<Sp3Record>& records = found->second.records;
    const auto high = std::lower_bound(records.begin(), records.end(), t,
                                       [](const Sp3Record& r, GpsTime when) { return r.t < when; });
    if (high == records.end() || (high == records.begin() && high->t != t)) {
      b.missing = "has no records around that time";
      return b;
    }
    b.high = static_cast<std::size_t>(high - records.begin());
    b.low = high->t == t ? b.high : b.high - 1;
    for (const std::size_t i : {b.low, b.high}) {
      if (!records[i].good_position) b.missing = "has a position marked as bad next to that time";
      if (!records[i].good_clock) b.missing = "has a clock marked as bad next to that time";
    }
    if (b.low != b.high && records[b.high].clock_event) b.missing = "has a jump of its clock at that time";
    if (b.missing.empty() && !joined(records[b.low], records[b.high]))
      b.missing = "has a gap or a maneuver at that time";
    if (b.missing.empty()) b.series = &found->second;
    return b;
  }

  /// True if there is at most a short gap between neighbours; also for a single record.
  [[nodiscard]] bool joined(const Sp3Record& a, const Sp3Record& b) const {
    return &a == &b || (!b.maneuver && b.t - a.t <= kMaxGap * spacing_s * (1 + 1e-9));
  }

  /// First of the 11 records of the polynomial; empty if there are fewer successive records.
  [[nodiscard]] std::optional<std::size_t> window(const Bracket& b, GpsTime t) const {
    const std::vector<Sp3Record>& records = b.series->records;
    // The unbroken run around the bracket, as far as a window extends.
    std::size_t begin = b.low;
    while (begin > 0 && b.low - begin < kPoints && records[begin - 1].good_position &&
           joined(records[begin - 1], records[begin]))
      --begin;
    std::size_t end = b.high + 1;
    while (end < records.size() && end - b.high <= kPoints && records[end].good_position &&
           joined(records[end - 1], records[end]))
      ++end;
    if (end - begin < kPoints) return std::nullopt;
    const std::size_t nearest = t - records[b.low].t <= records[b.high].t - t ? b.low : b.high;
    const std::size_t first = nearest - std::min(nearest - begin, kPoints / 2);
    return std::min(first, end - kPoints);
  }
};

PreciseSky::PreciseSky(const std::filesystem::path& path, std::set<gnss::System> systems)
    : PreciseSky(TextFile(path), std::move(systems)) {}

PreciseSky::PreciseSky(const std::vector<std::filesystem::path>& paths, std::set<gnss::System> systems) {
  std::vector<TextFile> files;
  for (const auto& path : paths) files.emplace_back(path);
  table_ = std::make_unique<Table>(std::move(files), systems);
}

PreciseSky::PreciseSky(TextFile file, std::set<gnss::System> systems) {
  std::vector<TextFile> files;
  files.push_back(std::move(file));
  table_ = std::make_unique<Table>(std::move(files), systems);
}

PreciseSky::~PreciseSky() = default;

std::vector<gnss::SatelliteId> PreciseSky::satellites() const {
  std::vector<gnss::SatelliteId> ids;
  for (const auto& [id, series] : table_->series) ids.push_back(id);
  return ids;
}

std::optional<SatelliteState> PreciseSky::state(gnss::SatelliteId id, GpsTime t) const {
  const Table::Bracket b = table_->bracket(id, t);
  if (b.series == nullptr) return std::nullopt;
  const std::optional<std::size_t> first = table_->window(b, t);
  if (!first) return std::nullopt;
  const std::vector<Sp3Record>& records = b.series->records;
  const auto [position, velocity] = interpolate(*b.series, *first, t);

  SatelliteState state;
  const double since_origin = t - table_->origin;
  state.position_m = rotate_earth(position, since_origin);
  state.velocity_mps = rotate_earth(velocity, since_origin) -
                       Eigen::Vector3d(0, 0, kEarthRotationRate).cross(state.position_m);

  const Sp3Record& low = records[b.low];
  const Sp3Record& high = records[b.high];
  // At an epoch the slope is that of the next interval, else of the preceding one. Without a neighbour the
  // clock's slope is unknown and set to 0.
  const Sp3Record* from = &low;
  const Sp3Record* to = &high;
  if (b.low == b.high) {
    const auto usable = [&](std::size_t i) { return i < records.size() && records[i].good_clock; };
    if (usable(b.high + 1) && !records[b.high + 1].clock_event && table_->joined(high, records[b.high + 1]))
      to = &records[b.high + 1];
    else if (b.low > 0 && usable(b.low - 1) && !low.clock_event && table_->joined(records[b.low - 1], low))
      from = &records[b.low - 1];
  }
  const double interval = to->t - from->t;
  const double slope = interval > 0 ? (to->clock_bias_s - from->clock_bias_s) / interval : 0;
  // IS-GPS-200, 20.3.3.3.3.1, and its time derivative on a Kepler orbit.
  constexpr double kC2 = kSpeedOfLight * kSpeedOfLight;
  const double relativity = -2 * position.dot(velocity) / kC2;
  const double relativity_rate = -2 * (velocity.squaredNorm() - geodesy::kEarthMu / position.norm()) / kC2;
  state.clock_bias_s = low.clock_bias_s + slope * (t - low.t) + relativity;
  state.clock_drift = slope + relativity_rate;
  state.carrier_frequency_hz = b.series->carrier_frequency_hz;
  return state;
}

std::string PreciseSky::source(gnss::SatelliteId id, GpsTime t) const {
  const std::string& file = table_->names;
  const Table::Bracket b = table_->bracket(id, t);
  if (b.series == nullptr) return fmt::format("{}: {} {}", file, to_string(id), b.missing);
  if (!table_->window(b, t)) {
    return fmt::format("{}: {} has fewer than {} records in a row around that time", file, to_string(id),
                       kPoints);
  }
  return fmt::format("{}, record {}", file, geodesy::format_gpst(b.series->records[b.low].t, 0));
}

const ReadReport& PreciseSky::report() const {
  return table_->report;
}

std::pair<GpsTime, GpsTime> PreciseSky::span() const {
  return {table_->origin, table_->last};
}

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
  // The condition is negated to reject NaN.
  if (!(a > kSemiMajorAxis && a < 1e9 && e < 0.9)) return;
  semi_major_axis_ = a;
  eccentricity_ = e;
  axes_.col(2) = h.normalized();
  // A circle has its perigee at the current position.
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
  const Eigen::Vector3d rotation_rate = Eigen::Vector3d(0, 0, node_rate_) + perigee_rate_ * axes.col(2);
  state.position_m = axes * Eigen::Vector3d(semi_major_axis_ * (c - e), b * s, 0);
  state.velocity_mps = axes * Eigen::Vector3d(-semi_major_axis_ * s * rate, b * c * rate, 0) +
                       rotation_rate.cross(state.position_m);
  // The difference of true and mean anomaly is continuous, so the sum counts revolutions like the mean.
  state.true_anomaly_rad = mean + (std::atan2(flat * s, c - e) - wrapped);
  state.true_anomaly_rate = rate * flat / (1 - e * c);
  return state;
}

}  // namespace canyon::orbit
