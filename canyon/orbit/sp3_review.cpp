// Declared in canyon/orbit/sp3_file.hpp.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <optional>
#include <utility>

#include "canyon/base/statistics.hpp"
#include "canyon/base/take_out.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/orbit/sky.hpp"
#include "canyon/orbit/sp3_file.hpp"

namespace canyon::orbit {
namespace {

using geodesy::GpsTime;

/// Records of one satellite that can be compared with one another.
using Chain = std::vector<std::size_t>;

/// How far the middle one of three records is from where the others put it, and how far it may be.
struct Miss {
  double distance = 0, allowed = 0;
  [[nodiscard]] bool fits() const { return distance <= allowed; }
};
/// Empty where three records say nothing about one another.
using Judge = std::function<std::optional<Miss>(std::size_t, std::size_t, std::size_t)>;

/// A chain, with the miss of each but its ends; kept up to date while records are taken out.
class JudgedChain {
 public:
  JudgedChain(Chain chain, Judge judge)
      : chain_(std::move(chain)), judge_(std::move(judge)), misses_(chain_.size()) {
    for (std::size_t i = 0; i < chain_.size(); ++i) update(i);
  }

  [[nodiscard]] std::size_t size() const { return chain_.size(); }
  [[nodiscard]] std::size_t record(std::size_t i) const { return chain_[i]; }
  [[nodiscard]] bool fails(std::size_t i) const { return misses_[i] && !misses_[i]->fits(); }
  [[nodiscard]] double distance(std::size_t i) const { return misses_[i] ? misses_[i]->distance : 0; }

  /// Whether no three records with the i-th fit, and some three do not.
  [[nodiscard]] bool stray(std::size_t i) const {
    bool any_fails = false;
    for (std::size_t k = i == 0 ? 0 : i - 1; k < std::min(i + 2, size()); ++k) {
      if (misses_[k] && misses_[k]->fits()) return false;
      any_fails = any_fails || fails(k);
    }
    return any_fails;
  }
  /// The value jumps between the i-th and the one behind it.
  [[nodiscard]] bool jumps_behind(std::size_t i) const { return i + 1 < size() && fails(i) && fails(i + 1); }

  void take_out(std::size_t i) {
    chain_.erase(chain_.begin() + static_cast<std::ptrdiff_t>(i));
    misses_.erase(misses_.begin() + static_cast<std::ptrdiff_t>(i));
    for (std::size_t k = i == 0 ? 0 : i - 1; k < std::min(i + 1, size()); ++k) update(k);
  }

 private:
  void update(std::size_t i) {
    misses_[i].reset();
    if (i > 0 && i + 1 < size()) misses_[i] = judge_(chain_[i - 1], chain_[i], chain_[i + 1]);
  }

  Chain chain_;
  Judge judge_;
  std::vector<std::optional<Miss>> misses_;
};

/// A record that is left out, and by how far it misses.
struct Stray {
  std::size_t record = 0;
  double distance = 0;
};

/// Takes the strays out, farthest first: one wrong record makes three misses. Empty where most are strays.
std::optional<std::vector<Stray>> take_out_strays(JudgedChain& chain) {
  std::size_t at_first = 0;
  for (std::size_t i = 0; i < chain.size(); ++i) at_first += chain.stray(i) ? 1 : 0;
  if (2 * at_first > chain.size()) return std::nullopt;
  std::vector<Stray> strays;
  while (true) {
    std::optional<std::size_t> worst;
    for (std::size_t i = 0; i < chain.size(); ++i) {
      if (chain.stray(i) && (!worst || chain.distance(i) > chain.distance(*worst))) worst = i;
    }
    if (!worst) return strays;
    strays.push_back({chain.record(*worst), chain.distance(*worst)});
    chain.take_out(*worst);
  }
}

/// Takes out stretches that agree in themselves and are `limit` or more from their neighbours (another
/// satellite's positions): of two the shorter one.
void take_out_stretches(JudgedChain& chain, double limit, std::vector<Stray>& strays) {
  const auto far = [&](std::size_t i) {
    return chain.jumps_behind(i) && std::min(chain.distance(i), chain.distance(i + 1)) > limit;
  };
  while (true) {
    std::vector<std::size_t> begins{0};
    for (std::size_t i = 0; i + 1 < chain.size(); ++i)
      if (far(i)) begins.push_back(i + 1);
    if (begins.size() == 1) return;
    begins.push_back(chain.size());
    std::size_t shortest = 0;
    for (std::size_t k = 1; k + 1 < begins.size(); ++k) {
      if (begins[k + 1] - begins[k] < begins[shortest + 1] - begins[shortest]) shortest = k;
    }
    for (std::size_t n = begins[shortest + 1] - begins[shortest]; n > 0; --n) {
      const std::size_t i = begins[shortest];
      strays.push_back({chain.record(i), chain.distance(i)});
      chain.take_out(i);
    }
  }
}

/// Earth's attraction with its flattening [m/s^2].
Eigen::Vector3d gravity(const Eigen::Vector3d& p) {
  const double r2 = p.squaredNorm(), r = std::sqrt(r2);
  const double central = geodesy::kEarthMu / (r2 * r);
  const double flattening =
      1.5 * geodesy::kEarthJ2 * central * geodesy::kSemiMajorAxis * geodesy::kSemiMajorAxis / r2;
  const double z2 = 5 * p.z() * p.z() / r2;
  return {-p.x() * (central + flattening * (1 - z2)), -p.y() * (central + flattening * (1 - z2)),
          -p.z() * (central + flattening * (3 - z2))};
}

/// Distances from the Earth's centre that a system's satellites have [m].
std::pair<double, double> radii(gnss::System system) {
  switch (system) {
    case gnss::System::GPS:
    case gnss::System::GLONASS:
      return {23e6, 30e6};
    case gnss::System::Galileo:  // two are eccentric: 23,300 to 32,700 km
      return {22e6, 34e6};
    case gnss::System::BeiDou:  // medium, geostationary and inclined geosynchronous
      return {26e6, 46e6};
    case gnss::System::QZSS:
    case gnss::System::SBAS:
      break;
  }
  return {36e6, 49e6};
}

class Sp3Review {
 public:
  explicit Sp3Review(Sp3File& sp3) : sp3_(sp3), notes_(sp3.notes) {}

  void run() {
    require_kilometres();
    std::size_t hopeless = 0;
    for (auto& [id, records] : sp3_.records) {
      leave_out_radii(id, records);
      if (review_positions(id, records)) continue;
      ++hopeless;
      const Sp3Record first = records.front();
      records.clear();
      notes_.bad(first.line, fmt::format("{} does not move as a satellite does", to_string(id)),
                 "the satellite is left out");
    }
    require_orbits(hopeless);
    report_strays();
    require_clocks();
    for (auto& [id, records] : sp3_.records) review_clocks(id, records);
  }

 private:
  [[nodiscard]] const Sp3Record& first_record() const { return sp3_.records.begin()->second.front(); }

  void require_kilometres() const {
    std::vector<double> all_m;
    for (const auto& [id, records] : sp3_.records) {
      for (const Sp3Record& r : records)
        if (r.good_position) all_m.push_back(r.position_m.norm());
    }
    const std::optional<double> middle = median(all_m);
    if (!middle) return;
    constexpr double kNearest_m = 20e6, kFarthest_m = 50e6;
    if (*middle >= kNearest_m && *middle <= kFarthest_m) return;
    const auto as = [&](double factor) {
      return *middle * factor >= kNearest_m && *middle * factor <= kFarthest_m;
    };
    throw InputError(notes_.path(), first_record().line,
                     fmt::format("the satellites are {:.6g} km from the Earth's centre{}", *middle / 1e3,
                                 as(1e-3)  ? ": the positions are in metres"
                                 : as(1e3) ? ": the positions are in thousands of kilometres"
                                           : ""),
                     "SP3 has kilometres from the Earth's centre: write them so");
  }

  void leave_out_radii(gnss::SatelliteId id, std::vector<Sp3Record>& records) {
    const std::pair<double, double> range = radii(id.system);
    const auto within = [&](double radius) { return radius >= range.first && radius <= range.second; };
    std::erase_if(records, [&](const Sp3Record& r) {
      const double radius = r.position_m.norm();
      if (!r.good_position || within(radius)) return false;
      notes_.bad(r.line,
                 fmt::format("{} at {} is {:.6g} km from the Earth's centre, which no {} satellite is{}",
                             to_string(id), geodesy::format_gpst(r.t, 0), radius / 1e3, name(id.system),
                             within(radius * 1e-3) ? " (in metres?)" : ""));
      return true;
    });
  }

  /// False where most positions contradict one another.
  [[nodiscard]] bool review_positions(gnss::SatelliteId id, std::vector<Sp3Record>& records) {
    Chain good;
    std::vector<Eigen::Vector3d> places(records.size()), pulls(records.size());
    for (std::size_t i = 0; i < records.size(); ++i) {
      if (!records[i].good_position) continue;
      good.push_back(i);
      places[i] = rotate_earth(records[i].position_m, sp3_.epochs.front() - records[i].t);
      pulls[i] = gravity(places[i]);
    }
    double usual = 0;
    const Judge judge = [&](std::size_t a, std::size_t b, std::size_t c) -> std::optional<Miss> {
      if (records[b].maneuver || records[c].maneuver) return std::nullopt;
      return miss(records, places, pulls, {a, b, c}, usual);
    };
    usual = usual_miss(good, judge);
    JudgedChain chain(good, judge);
    auto strays = take_out_strays(chain);
    if (!strays) return false;
    constexpr double kLargestManeuver_mps = 5;
    take_out_stretches(chain, kLargestManeuver_mps * sp3_.step_s, *strays);
    for (std::size_t i = 0; i < chain.size(); ++i) {
      if (!chain.fails(i) || (i > 0 && chain.fails(i - 1))) continue;
      // A change of velocity at a record or between it and the next.
      records[chain.record(i + 1)].maneuver = true;
      if (!chain.jumps_behind(i)) records[chain.record(i)].maneuver = true;
      notes_.say(
          records[chain.record(i)].line,
          fmt::format("{} at {} changes its orbit by {:.3g} m, as by a maneuver that is not marked (M)",
                      to_string(id), geodesy::format_gpst(records[chain.record(i)].t, 0), chain.distance(i)),
          "no orbit reaches across it");
    }
    take_away(id, records, *strays);
    return true;
  }

  /// Where three records are alike enough in time, by integrating the acceleration twice: exact for a
  /// parabola of accelerations.
  [[nodiscard]] std::optional<Miss> miss(const std::vector<Sp3Record>& records,
                                         const std::vector<Eigen::Vector3d>& places,
                                         const std::vector<Eigen::Vector3d>& pulls,
                                         const std::array<std::size_t, 3>& at, double usual) const {
    const std::size_t a = at[0], b = at[1], c = at[2];
    const double before = records[b].t - records[a].t, after = records[c].t - records[b].t;
    const double longer = std::max(before, after), all = before + after;
    if (longer > 2.5 * sp3_.step_s) return std::nullopt;
    const auto pull = [&](double t) -> Eigen::Vector3d {  // since the middle record
      return pulls[a] * (t * (t - after) / (before * all)) -
             pulls[b] * ((t + before) * (t - after) / (before * after)) +
             pulls[c] * ((t + before) * t / (all * after));
    };
    // Green's function of the chord, by Simpson's rule on either side of the middle record.
    const Eigen::Vector3d bend =
        before * after / (6 * all) *
        (before * (2 * pull(-before / 2) + pulls[b]) + after * (pulls[b] + 2 * pull(after / 2)));
    const Eigen::Vector3d expected = (after * places[a] + before * places[c]) / all - bend;
    const double radius = places[b].norm();
    const double turn = std::sqrt(geodesy::kEarthMu / (radius * radius * radius)) * longer;
    constexpr double kUnexplained_mps2 = 1e-4, kLeast_m = 10, kUsual = 6;
    const double most = kLeast_m + kUnexplained_mps2 * before * after;
    const double truncation =
        radius * (0.02 * std::pow(turn, 6) + 0.04 * std::pow(turn, 5) * std::abs(after - before) / longer);
    return Miss{(places[b] - expected).norm(), std::min(most, kLeast_m + kUsual * usual) + truncation};
  }

  [[nodiscard]] static double usual_miss(const Chain& chain, const Judge& judge) {
    std::vector<double> all;
    for (std::size_t i = 1; i + 1 < chain.size(); ++i) {
      if (const auto miss = judge(chain[i - 1], chain[i], chain[i + 1])) all.push_back(miss->distance);
    }
    return median(all).value_or(0);
  }

  void take_away(gnss::SatelliteId id, std::vector<Sp3Record>& records, const std::vector<Stray>& strays) {
    std::vector<bool> gone(records.size());
    for (const Stray& stray : strays) {
      gone[stray.record] = true;
      const Sp3Record& r = records[stray.record];
      strays_of_epoch_[r.t].push_back({id, r.line, stray.distance});
    }
    take_out(records, gone, [](const Sp3Record&) {});
  }

  void require_orbits(std::size_t hopeless) {
    if (2 * hopeless <= sp3_.records.size()) {
      std::erase_if(sp3_.records, [](const auto& entry) { return entry.second.empty(); });
      if (!sp3_.records.empty()) return;
    }
    const std::size_t all = sp3_.records.size();
    throw InputError(
        notes_.path(), notes_.first_bad() ? notes_.first_bad()->line() : 0,
        hopeless > 0         ? fmt::format("the positions of {} of {} satellites do not move as satellites "
                                                   "do from epoch to epoch",
                                           hopeless, all)
        : notes_.first_bad() ? notes_.first_bad()->problem()
                             : std::string(),
        "SP3 has kilometres in Earth-fixed axes at the times of its epochs: fetch the file again");
  }

  void report_strays() {
    for (const auto& [t, strays] : strays_of_epoch_) {
      constexpr std::size_t kFewest = 3;
      if (strays.size() >= kFewest && 2 * strays.size() > sp3_.records.size()) {
        notes_.bad(strays.front().line,
                   fmt::format("epoch {} contradicts those around it: the positions of {} satellites do not "
                               "fit its time",
                               geodesy::format_gpst(t, 0), strays.size()));
        continue;
      }
      for (const StrayPosition& stray : strays) {
        notes_.bad(stray.line,
                   fmt::format("the position of {} at {} contradicts those around it by {:.3g} km",
                               to_string(stray.id), geodesy::format_gpst(t, 0), stray.distance_m / 1e3));
      }
    }
  }

  /// Satellites none of whose records is good, and the line of the first record.
  template <typename Good>
  [[nodiscard]] std::pair<std::vector<std::string>, int> without_any(const Good& good) const {
    std::pair<std::vector<std::string>, int> without;
    for (const auto& [id, records] : sp3_.records) {
      if (records.empty() || std::any_of(records.begin(), records.end(), good)) continue;
      if (without.first.empty()) without.second = records.front().line;
      without.first.push_back(to_string(id));
    }
    return without;
  }

  void note_places() {
    const auto [without, line] = without_any([](const Sp3Record& r) { return r.good_position; });
    if (without.empty() || without.size() == sp3_.records.size()) return;
    notes_.say(line, fmt::format("no position of {}", fmt::join(without, ", ")),
               "these satellites are left out");
  }

  void require_clocks() {
    note_places();
    const auto [without, line] = without_any([](const Sp3Record& r) { return r.good_clock; });
    if (without.empty()) return;
    if (without.size() == sp3_.records.size()) {
      throw InputError(notes_.path(), line,
                       "no satellite has a clock (999999.999999 and blank stand for none)",
                       "give a file with clocks");
    }
    notes_.say(line, fmt::format("no clock of {}", fmt::join(without, ", ")),
               "these satellites are left out");
  }

  void review_clocks(gnss::SatelliteId id, std::vector<Sp3Record>& records) {
    constexpr double kLargest_s = 0.07, kAllowed_s = 100e-9;
    std::vector<Stray> strays;
    Chain good;
    for (std::size_t i = 0; i < records.size(); ++i) {
      if (!records[i].good_clock) continue;
      if (std::abs(records[i].clock_bias_s) <= kLargest_s) {
        good.push_back(i);
      } else {
        strays.push_back({i, records[i].clock_bias_s});
      }
    }
    const Judge judge = [&](std::size_t a, std::size_t b, std::size_t c) -> std::optional<Miss> {
      if (records[b].clock_event || records[c].clock_event) return std::nullopt;
      const double before = records[b].t - records[a].t, after = records[c].t - records[b].t;
      if (std::max(before, after) > 2.5 * sp3_.step_s) return std::nullopt;
      const double expected =
          (records[a].clock_bias_s * after + records[c].clock_bias_s * before) / (before + after);
      return Miss{std::abs(records[b].clock_bias_s - expected), kAllowed_s};
    };
    JudgedChain chain(good, judge);
    const auto stray_clocks = take_out_strays(chain);
    if (!stray_clocks) {
      for (Sp3Record& r : records) r.good_clock = false;
      notes_.bad(records.front().line,
                 fmt::format("the clock of {} jumps from record to record", to_string(id)),
                 "the satellite is left out");
      return;
    }
    strays.insert(strays.end(), stray_clocks->begin(), stray_clocks->end());
    for (const Stray& stray : strays) {
      Sp3Record& r = records[stray.record];
      r.good_clock = false;
      notes_.bad(r.line, fmt::format("the clock of {} at {} contradicts those around it by {:.3g} us",
                                     to_string(id), geodesy::format_gpst(r.t, 0), stray.distance * 1e6));
    }
    for (std::size_t i = 0; i < chain.size(); ++i) {
      if (!chain.jumps_behind(i)) continue;
      Sp3Record& r = records[chain.record(i + 1)];
      r.clock_event = true;
      notes_.say(r.line,
                 fmt::format("the clock of {} jumps before {}, which is not marked (E)", to_string(id),
                             geodesy::format_gpst(r.t, 0)),
                 "no clock reaches across it");
    }
  }

  struct StrayPosition {
    gnss::SatelliteId id;
    int line = 0;
    double distance_m = 0;
  };

  Sp3File& sp3_;
  RecordNotes& notes_;
  std::map<GpsTime, std::vector<StrayPosition>> strays_of_epoch_;
};

}  // namespace

void review_sp3(Sp3File& sp3) {
  Sp3Review(sp3).run();
}

}  // namespace canyon::orbit
