#include "canyon/orbit/navigation_review.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "canyon/base/record_notes.hpp"
#include "canyon/base/take_out.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/frames.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/gnss/broadcast_messages.hpp"
#include "canyon/orbit/broadcast_sky.hpp"
#include "canyon/orbit/slot_tables.hpp"
#include "canyon/rinex/navigation_reader.hpp"

namespace canyon::orbit {
namespace {

/// How far apart in time two records may be to be compared, and how much they may differ: ten times what
/// those of real days do.
struct Likeness {
  double longest_s, step_s, distance_m;
  int power;
  [[nodiscard]] double allowed_m(double gap_s) const {
    return distance_m * (1 + std::pow(gap_s / step_s, power));
  }
};
Likeness likeness(const gnss::KeplerEphemeris&) {
  return {86'400, 7200, 50, 3};
}
Likeness likeness(const gnss::GlonassEphemeris&) {
  return {3 * 3600, 1800, 30, 2};
}
Likeness likeness(const gnss::SbasEphemeris&) {
  return {3600, 300, 1000, 2};
}

/// The difference of two records at one instant.
struct Difference {
  double position_m = 0, clock_s = 0;
  bool orbit_fits = false, clock_fits = false;
  [[nodiscard]] bool fits() const { return orbit_fits && clock_fits; }
};

template <typename Ephemeris>
std::optional<Difference> difference(const Ephemeris& a, const Ephemeris& b) {
  const double gap_s = std::abs(b.toe - a.toe);
  const Likeness like = likeness(a);
  if (gap_s > like.longest_s) return std::nullopt;
  const geodesy::GpsTime middle = a.toe + (b.toe - a.toe) / 2;
  const SatelliteState x = propagate(a, middle), y = propagate(b, middle);
  constexpr double kClock_s = 0.2e-6;
  Difference d{(x.position_m - y.position_m).norm(), std::abs(x.clock_bias_s - y.clock_bias_s)};
  d.orbit_fits = d.position_m <= like.allowed_m(gap_s);
  d.clock_fits = d.clock_s <= kClock_s * (1 + gap_s / like.step_s);
  return d;
}

/// How far the plane of a GLONASS record's orbit is from that of its slot [rad, east], by the longitudes of
/// their ascending nodes; 0 for spares, which have no slot. The nodes of 2016 to 2024 are within 5 deg.
double off_plane(const gnss::GlonassEphemeris& e) {
  static const std::vector<Slot> slots = nominal_slots(gnss::System::GLONASS);
  if (e.id.number < 1 || e.id.number > slots.size()) return 0;
  const Slot& slot = slots[e.id.number - 1U];
  const Eigen::Vector3d r(e.position_m.data());
  const Eigen::Vector3d v =
      Eigen::Vector3d(e.velocity_mps.data()) + Eigen::Vector3d(0, 0, slot.earth_rate).cross(r);
  const Eigen::Vector3d normal = r.cross(v);
  const double nominal = slot.node_longitude_rad + (slot.node_rate - slot.earth_rate) * (e.toe - slot.epoch);
  return std::remainder(std::atan2(normal.x(), -normal.y()) - nominal, 2 * geodesy::kPi);
}

class NavigationReview {
 public:
  NavigationReview(gnss::NavigationData& data, std::vector<std::filesystem::path> sources)
      : data_(data), sources_(std::move(sources)) {
    for (std::size_t i = sources_.size(); i < data.sources.size(); ++i)
      sources_.emplace_back(data.sources[i]);
  }

  void run() {
    leave_out_other_planes();
    review(data_.kepler);
    review(data_.glonass);
    review(data_.sbas);
    if (const auto& bad = notes_.first_bad(); bad && data_.empty()) {
      throw InputError(bad->file(), bad->line(), "no usable ephemeris: " + bad->problem(),
                       "fetch the file again or give another");
    }
    const std::vector<std::string> own = notes_.lines();
    data_.warnings.insert(data_.warnings.end(), own.begin(), own.end());
  }

 private:
  /// The planes of GLONASS turn by 15 deg an hour under the Earth, so that they tell a whole file in Moscow's
  /// time, which its records, all wrong alike, do not. Where most records lie elsewhere by another angle, the
  /// file may be of another constellation, such as a simulator's.
  void leave_out_other_planes() {
    constexpr double kAllowed = geodesy::radians(12), kMoscow = geodesy::radians(3 * 15.04);
    std::vector<std::uint8_t> gone(data_.glonass.size());
    std::ptrdiff_t in_moscow = 0;
    for (std::size_t i = 0; i < gone.size(); ++i) {
      const double off = off_plane(data_.glonass[i]);
      gone[i] = std::abs(off) > kAllowed ? 1 : 0;
      in_moscow += std::abs(off - kMoscow) < kAllowed ? 1 : 0;
    }
    const auto elsewhere = std::count(gone.begin(), gone.end(), 1);
    if (elsewhere == 0) return;
    const bool most = 2 * elsewhere > static_cast<std::ptrdiff_t>(gone.size());
    const bool moscow = 2 * in_moscow > elsewhere;
    const auto first = static_cast<std::size_t>(std::find(gone.begin(), gone.end(), 1) - gone.begin());
    if (most && !moscow) {
      notes_.say(remark(data_.glonass[first],
                        fmt::format("{} of {} GLONASS orbits lie elsewhere than the planes of their slots",
                                    elsewhere, gone.size()),
                        "right for a simulated constellation; else their times are of another zone"));
      return;
    }
    for (std::size_t i = 0; i < gone.size(); ++i) {
      if (gone[i] == 0) continue;
      notes_.bad(
          remark(data_.glonass[i], fmt::format("orbit {:.0f} deg from the plane of its slot: {}",
                                               geodesy::degrees(std::abs(off_plane(data_.glonass[i]))),
                                               moscow ? "the time seems to be Moscow's, 3 h ahead of UTC"
                                                      : "the time or the satellite's number is wrong")),
          1, "record left out");
    }
    // Spares, which have no slot, go with the others of their file.
    if (most) std::fill(gone.begin(), gone.end(), 1);
    take_out(data_.glonass, gone, [](const gnss::GlonassEphemeris&) {});
  }

  /// Records in order of satellite and time.
  template <typename Ephemeris>
  void review(std::vector<Ephemeris>& records) {
    std::vector<std::uint8_t> gone(records.size());
    for (std::size_t begin = 0, end = 0; begin < records.size(); begin = end) {
      std::vector<std::size_t> healthy;
      for (end = begin; end < records.size() && records[end].id == records[begin].id; ++end)
        if (is_healthy(records[end])) healthy.push_back(end);
      review_satellite(records, healthy, gone);
    }
    take_out(records, gone, [](const Ephemeris&) {});
  }

  template <typename Ephemeris>
  void review_satellite(const std::vector<Ephemeris>& records, const std::vector<std::size_t>& of_satellite,
                        std::vector<std::uint8_t>& gone) {
    constexpr std::size_t kReach = 2;
    const std::size_t n = of_satellite.size();
    std::vector<std::optional<Difference>> nearest(n);  // to a record that it contradicts
    std::vector<std::size_t> against(n);
    std::vector<bool> supported(n);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t k = i + 1; k < std::min(i + 1 + kReach, n); ++k) {
        const auto d = difference(records[of_satellite[i]], records[of_satellite[k]]);
        if (!d) continue;
        if (d->fits()) {
          supported[i] = supported[k] = true;
          continue;
        }
        for (const auto& [one, other] : {std::pair(i, k), std::pair(k, i)}) {
          if (nearest[one] && (supported[against[one]] || !supported[other])) continue;
          nearest[one] = d;
          against[one] = other;
        }
      }
    }
    for (std::size_t i = 0; i < n; ++i) {
      if (supported[i] || !nearest[i]) continue;
      const Ephemeris& e = records[of_satellite[i]];
      const std::string what = fmt::format("the {} of {} at {} contradicts its other records by {}",
                                           nearest[i]->orbit_fits ? "clock" : "orbit", to_string(e.id),
                                           geodesy::format_gpst(e.toe, 0), size_text(*nearest[i]));
      if (any_supported_near(supported, i, kReach)) {
        gone[of_satellite[i]] = 1;
        notes_.bad(remark(e, what), 1, "record left out");
      } else if (against[i] > i) {
        notes_.say(remark(e, what, "no third record says which one is right: both are used"));
      }
    }
  }

  static bool any_supported_near(const std::vector<bool>& supported, std::size_t i, std::size_t reach) {
    for (std::size_t k = i - std::min(i, reach); k <= std::min(i + reach, supported.size() - 1); ++k)
      if (supported[k]) return true;
    return false;
  }

  static std::string size_text(const Difference& d) {
    return d.orbit_fits ? fmt::format("{:.3g} us", d.clock_s * 1e6)
                        : fmt::format("{:.3g} km", d.position_m / 1e3);
  }

  template <typename Ephemeris>
  [[nodiscard]] InputError remark(const Ephemeris& e, std::string_view what,
                                  std::string_view cure = {}) const {
    const auto source = static_cast<std::size_t>(e.source);
    return {source < sources_.size() ? sources_[source] : std::filesystem::path(), e.line, what, cure};
  }

  gnss::NavigationData& data_;
  std::vector<std::filesystem::path> sources_;
  RecordNotes notes_;
};

}  // namespace

void review_navigation(gnss::NavigationData& data, const std::vector<std::filesystem::path>& sources) {
  NavigationReview(data, sources).run();
}

gnss::NavigationData read_navigation(const std::vector<std::filesystem::path>& paths) {
  gnss::NavigationData data = rinex::read_rinex_navigation(paths);
  review_navigation(data, paths);
  return data;
}

}  // namespace canyon::orbit
