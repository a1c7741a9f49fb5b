#include "canyon/sky/orbit/precise_sky.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "canyon/base/file_kind.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/sky/orbit/nominal_constellation.hpp"
#include "canyon/sky/orbit/sp3_file.hpp"

namespace canyon::orbit {
namespace {

using geodesy::GpsTime;
using geodesy::kEarthRotationRate;
using geodesy::kSpeedOfLight;

constexpr std::size_t kPoints = 11;

/// A record ready for interpolation.
struct Node {
  double anomaly = 0;    ///< true anomaly of the reference orbit
  Eigen::Vector3d rest;  ///< position in the axes of Table::origin, less the reference orbit
};

struct TabulatedOrbit {
  std::vector<Sp3Record> records;
  std::vector<Node> nodes;  ///< one for each record
  ReferenceOrbit reference;
  double carrier_frequency_hz = 0;
};

/// Position and velocity, in the axes of Table::origin, of the polynomial through 11 nodes plus the reference
/// orbit. The variable is the true anomaly: in it the equations of an eccentric orbit have no poles near the
/// real axis, so that the polynomials converge fast at perigee too.
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
  for (const Slot& slot : nominal_slots(id.system)) {
    if (slot.id == id) channel = slot.glonass_channel;
  }
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

}  // namespace

struct PreciseSky::Table {
  std::string names;  ///< of all files
  GpsTime origin;     ///< first epoch; its axes are the common ones
  GpsTime last;
  double spacing_s = 0;  ///< of epochs; of files with several the longest
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

  /// The record closest to the middle that a polynomial goes through.
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
      // The second velocity, taken with the first reference, is free of the polynomial's error.
      const auto [position, velocity] = interpolate(s, first, epoch);
      s.reference = ReferenceOrbit(epoch, position, velocity);
      // The elements of one instant carry short periods, which put the mean motion off by 1e-4: let the
      // reference keep pace from the first to the last record.
      const auto lag_s = [&s](const Sp3Record& r) {
        const ReferenceOrbit::State at = s.reference.at(r.t);
        const double v2 = at.velocity_mps.squaredNorm();
        return v2 > 0 ? (at.position_m - r.position_m).dot(at.velocity_mps) / v2 : 0;
      };
      for (int i = 0; i < 3 && begin->t < end->t; ++i) {
        s.reference.scale_mean_motion(1 - (lag_s(*end) - lag_s(*begin)) / (end->t - begin->t));
      }
      make_nodes(s);
    }
  }

  /// The records around `t`, one of them twice where `t` is its epoch; or why there are none.
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
    if (b.missing.empty() && !joined(records[b.low], records[b.high])) {
      b.missing = "has a gap or a maneuver at that time";
    }
    if (b.missing.empty()) b.series = &found->second;
    return b;
  }

  /// True where nothing but a short gap lies between neighbours, or none for one record.
  [[nodiscard]] bool joined(const Sp3Record& a, const Sp3Record& b) const {
    return &a == &b || (!b.maneuver && b.t - a.t <= kMaxGap * spacing_s * (1 + 1e-9));
  }

  /// First of the 11 records of the polynomial; empty where too few follow one another.
  [[nodiscard]] std::optional<std::size_t> window(const Bracket& b, GpsTime t) const {
    const std::vector<Sp3Record>& records = b.series->records;
    // The unbroken run around the bracket, as far as a window reaches.
    std::size_t begin = b.low;
    while (begin > 0 && b.low - begin < kPoints && records[begin - 1].good_position &&
           joined(records[begin - 1], records[begin])) {
      --begin;
    }
    std::size_t end = b.high + 1;
    while (end < records.size() && end - b.high <= kPoints && records[end].good_position &&
           joined(records[end - 1], records[end])) {
      ++end;
    }
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
  // On an epoch the slope is that of the interval ahead, else of the one behind. Without a neighbour the
  // clock's slope is unknown and taken as 0.
  const Sp3Record* from = &low;
  const Sp3Record* to = &high;
  if (b.low == b.high) {
    const auto usable = [&](std::size_t i) { return i < records.size() && records[i].good_clock; };
    if (usable(b.high + 1) && !records[b.high + 1].clock_event && table_->joined(high, records[b.high + 1])) {
      to = &records[b.high + 1];
    } else if (b.low > 0 && usable(b.low - 1) && !low.clock_event &&
               table_->joined(records[b.low - 1], low)) {
      from = &records[b.low - 1];
    }
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

}  // namespace canyon::orbit
