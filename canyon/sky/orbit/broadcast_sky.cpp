#include "canyon/sky/orbit/broadcast_sky.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::orbit {
namespace {

/// Two records count as equally close within this limit: signals received together were sent 0.07 to 0.14 s
/// before, and an epoch midway between two records must use the newer one for all, as if chosen at reception.
constexpr double kTie_s = 0.3;

using geodesy::GpsTime;

constexpr std::size_t kNumbers = 256;  // SatelliteId::number is a byte

// A record in the form used by the search.
struct Entry {
  GpsTime toe;
  GpsTime transmission;
  gnss::Validity validity;
  int record = 0;  ///< into NavigationData::kepler, ::glonass or ::sbas
  bool healthy = false;
};

// The records of a satellite by ascending toe, one for each toe.
struct Series {
  std::vector<Entry> entries;
  double reach_s = 0;  ///< of the longest validity

  template <typename Ephemeris>
  void add(const Ephemeris& e, int record) {
    const Entry entry{e.toe, e.transmission, validity(e), record, is_healthy(e)};
    reach_s = std::max({reach_s, entry.validity.before_s, entry.validity.after_s});
    entries.push_back(entry);
  }

  // Of records with one toe only the newest message is used; of equal ones the last one read.
  void finish() {
    std::stable_sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
      return std::tie(a.toe, a.transmission) < std::tie(b.toe, b.transmission);
    });
    std::size_t kept = 0;
    for (std::size_t i = 0; i < entries.size(); ++i)
      if (i + 1 == entries.size() || entries[i + 1].toe != entries[i].toe) entries[kept++] = entries[i];
    entries.resize(kept);
  }

  // The closest toe; of equal ones the later.
  [[nodiscard]] const Entry* closest(GpsTime t) const {
    const Entry* best = nullptr;
    walk(t, [&best](const Entry& entry) {
      best = &entry;
      return true;
    });
    return best;
  }

  // The closest one within its own validity.
  [[nodiscard]] const Entry* closest_valid(GpsTime t) const {
    const Entry* best = nullptr;
    walk(t, [&](const Entry& entry) {
      const double age = t - entry.toe;
      if (entry.validity.contains(age)) best = &entry;
      return best != nullptr || std::abs(age) > reach_s;
    });
    return best;
  }

 private:
  // Passes entries in order of |t - toe| until `done` returns true.
  template <typename Done>
  void walk(GpsTime t, Done done) const {
    auto right = std::lower_bound(entries.begin(), entries.end(), t,
                                  [](const Entry& entry, GpsTime at) { return entry.toe < at; });
    auto left = right;
    while (left != entries.begin() || right != entries.end()) {
      const bool take_right = left == entries.begin() ||
                              (right != entries.end() && right->toe - t <= t - std::prev(left)->toe + kTie_s);
      if (done(take_right ? *right++ : *--left)) return;
    }
  }
};

/// Group delays of single signals from the messages nearest in time.
void set_delays(const std::vector<const gnss::SignalDelays*>& delays, GpsTime t, SatelliteState& state) {
  // A satellite sends several messages, each with fields for some of its signals.
  std::array<const gnss::SignalDelays*, gnss::kMaxSignals> nearest{};
  for (const gnss::SignalDelays* each : delays) {
    for (std::size_t i = 0; i < nearest.size(); ++i) {
      if (std::isinf(each->group_delay_s[i])) continue;
      const bool nearer = nearest[i] == nullptr || std::abs(t - each->toc) < std::abs(t - nearest[i]->toc);
      if (nearer) nearest[i] = each;
    }
  }
  for (std::size_t i = 0; i < nearest.size(); ++i) {
    if (nearest[i] == nullptr || std::isnan(nearest[i]->group_delay_s[i])) continue;
    (i == 0 ? state.group_delay_s : state.more_group_delays_s[i - 1]) = nearest[i]->group_delay_s[i];
  }
}

// Result of `f` for a record of a satellite.
template <typename F>
auto record_value(const gnss::NavigationData& data, gnss::SatelliteId id, const Entry& entry, F f) {
  const auto record = static_cast<std::size_t>(entry.record);
  if (id.system == gnss::System::GLONASS) return f(data.glonass[record]);
  if (id.system == gnss::System::SBAS) return f(data.sbas[record]);
  return f(data.kepler[record]);
}

std::string hours(double seconds) {
  seconds = std::abs(seconds);
  return seconds < 5400        ? fmt::format("{:.0f} min", seconds / 60)
         : seconds < 2 * 86400 ? fmt::format("{:.1f} h", seconds / 3600)
                               : fmt::format("{:.1f} days", seconds / 86400);
}

struct EarthModel {
  double mu;     ///< gravitational constant [m^3/s^2]
  double omega;  ///< rotation rate [rad/s]
};

// The constants used in each system's control segment: part of the message definition, not physical truth.
EarthModel earth_model(gnss::System system) {
  // OS-SIS-ICD 2.0, table 62; BDS-SIS-ICD B1I 3.0, 3.2
  if (system == gnss::System::Galileo) return {3.986004418e14, 7.2921151467e-5};
  if (system == gnss::System::BeiDou) return {3.986004418e14, 7.2921150e-5};
  return {3.986005e14, 7.2921151467e-5};  // IS-GPS-200 table 20-IV; also used by IS-QZSS-PNT
}

// Newton's iteration from E = M + e sin M; quadratic, so the last step confirms the preceding one.
// Broadcast eccentricities (below 0.5) need three or four steps.
double eccentric_anomaly(double mean_anomaly, double e) {
  double anomaly = mean_anomaly + e * std::sin(mean_anomaly);
  for (int i = 0; i < 12; ++i) {
    const double step = (anomaly - e * std::sin(anomaly) - mean_anomaly) / (1 - e * std::cos(anomaly));
    anomaly -= step;
    if (std::abs(step) < 1e-9) break;  // the remaining error is of the order of its square
  }
  return anomaly;
}

// Rotates position and velocity about z by `angle`, in a frame that rotates with `rate` [rad/s].
void rotate_z(double angle, double rate, Eigen::Vector3d& p, Eigen::Vector3d& v) {
  const double c = std::cos(angle), s = std::sin(angle);
  const Eigen::Vector3d q(c * p.x() + s * p.y(), -s * p.x() + c * p.y(), p.z());
  const Eigen::Vector3d w(c * v.x() + s * v.y(), -s * v.x() + c * v.y(), v.z());
  p = q;
  v = w + rate * Eigen::Vector3d(q.y(), -q.x(), 0);
}

void rotate_x_minus_5_deg(Eigen::Vector3d& a) {
  static const double c = std::cos(geodesy::radians(-5)), s = std::sin(geodesy::radians(-5));
  a = Eigen::Vector3d(a.x(), c * a.y() + s * a.z(), -s * a.y() + c * a.z());
}

}  // namespace

struct BroadcastSky::Index {
  struct Satellite {
    Series main;                                    ///< all except Galileo's F/NAV
    Series fallback;                                ///< Galileo F/NAV
    std::vector<const gnss::SignalDelays*> delays;  ///< by toc
  };
  std::vector<gnss::SatelliteId> ids;
  std::array<std::array<std::int16_t, kNumbers>, gnss::kSystemCount> slot;  ///< into satellites; -1: none
  std::vector<Satellite> satellites;
  GpsTime first, last;

  struct Choice {
    const Entry* entry = nullptr;  ///< null: nothing within validity
    bool stale = false;
  };

  [[nodiscard]] const Satellite* find(gnss::SatelliteId id) const {
    const auto system = static_cast<std::size_t>(id.system);
    if (system >= gnss::kSystemCount) return nullptr;
    const std::int16_t s = slot[system][id.number];
    return s < 0 ? nullptr : &satellites[static_cast<std::size_t>(s)];
  }

  // A valid one, I/NAV before F/NAV; else, if allowed, the closest of all.
  [[nodiscard]] static Choice choose(const Satellite& satellite, GpsTime t, bool allow_stale) {
    for (const Series* series : {&satellite.main, &satellite.fallback})
      if (const Entry* entry = series->closest_valid(t)) return {entry, false};
    if (!allow_stale) return {};
    return {closest(satellite, t), true};
  }

  [[nodiscard]] static const Entry* closest(const Satellite& satellite, GpsTime t) {
    const Entry* a = satellite.main.closest(t);
    const Entry* b = satellite.fallback.closest(t);
    if (a == nullptr || b == nullptr) return a == nullptr ? b : a;
    return std::abs(t - b->toe) < std::abs(t - a->toe) ? b : a;
  }

  // The record in use, healthy or not; null: none.
  [[nodiscard]] const Entry* find(gnss::SatelliteId id, GpsTime t, bool allow_stale) const {
    const Satellite* satellite = find(id);
    return satellite != nullptr ? choose(*satellite, t, allow_stale).entry : nullptr;
  }

  [[nodiscard]] Satellite& at(gnss::SatelliteId id) {
    std::int16_t& s = slot[static_cast<std::size_t>(id.system)][id.number];
    if (s < 0) {
      s = static_cast<std::int16_t>(satellites.size());
      satellites.emplace_back();
      ids.push_back(id);
    }
    return satellites[static_cast<std::size_t>(s)];
  }

  Index(const gnss::NavigationData& data, const std::set<gnss::System>& systems) {
    for (auto& row : slot) row.fill(-1);
    for (std::size_t i = 0; i < data.kepler.size(); ++i) {
      const gnss::KeplerEphemeris& e = data.kepler[i];
      if (systems.count(e.id.system) == 0) continue;
      Satellite& satellite = at(e.id);
      (is_galileo_fnav(e) ? satellite.fallback : satellite.main).add(e, static_cast<int>(i));
    }
    const auto add_states = [&](const auto& records) {
      for (std::size_t i = 0; i < records.size(); ++i) {
        if (systems.count(records[i].id.system) == 0) continue;
        at(records[i].id).main.add(records[i], static_cast<int>(i));
      }
    };
    add_states(data.glonass);
    add_states(data.sbas);
    for (const gnss::SignalDelays& delays : data.signal_delays) {
      const std::int16_t s = slot[static_cast<std::size_t>(delays.id.system)][delays.id.number];
      if (s >= 0) satellites[static_cast<std::size_t>(s)].delays.push_back(&delays);
    }
    std::sort(ids.begin(), ids.end());
    bool any = false;
    for (Satellite& satellite : satellites) {
      for (Series* series : {&satellite.main, &satellite.fallback}) {
        series->finish();
        if (series->entries.empty()) continue;
        const GpsTime begin = series->entries.front().toe, end = series->entries.back().toe;
        first = any ? std::min(first, begin) : begin;
        last = any ? std::max(last, end) : end;
        any = true;
      }
    }
  }
};

BroadcastSky::BroadcastSky(gnss::NavigationData data, BroadcastOptions options)
    : data_(std::move(data)),
      options_(std::move(options)),
      glonass_(data_.glonass.size()),
      index_(std::make_unique<Index>(data_, options_.systems)) {
  if (index_->ids.empty()) {
    std::string wanted;
    for (const gnss::System system : options_.systems) {
      wanted += wanted.empty() ? "" : ", ";
      wanted += name(system);
    }
    std::string files;
    for (const std::string& file : data_.sources) files += (files.empty() ? "" : ", ") + file;
    throw InputError(fmt::format("no ephemeris of {} in {}", wanted.empty() ? "no system at all" : wanted,
                                 files.empty() ? "the navigation data" : files),
                     "give other systems, or their navigation files");
  }
}

BroadcastSky::~BroadcastSky() = default;

std::vector<gnss::SatelliteId> BroadcastSky::satellites() const {
  return index_->ids;
}

std::optional<SatelliteState> BroadcastSky::state(gnss::SatelliteId id, GpsTime t) const {
  const Index::Satellite* satellite = index_->find(id);
  if (satellite == nullptr) return std::nullopt;
  const Entry* entry = Index::choose(*satellite, t, options_.allow_stale).entry;
  if (entry == nullptr || (!entry->healthy && !options_.allow_unhealthy)) return std::nullopt;
  const auto record = static_cast<std::size_t>(entry->record);
  SatelliteState state =
      id.system == gnss::System::GLONASS
          ? glonass_[record].propagate(data_.glonass[record], t)
          : record_value(data_, id, *entry, [t](const auto& e) { return propagate(e, t); });
  set_delays(satellite->delays, t, state);
  return state;
}

std::string BroadcastSky::source(gnss::SatelliteId id, GpsTime t) const {
  const Index::Satellite* satellite = index_->find(id);
  if (satellite == nullptr) return fmt::format("no ephemeris of {} in the navigation data", to_string(id));
  const Index::Choice choice = Index::choose(*satellite, t, options_.allow_stale);
  const Entry& entry = choice.entry != nullptr ? *choice.entry : *Index::closest(*satellite, t);

  const auto file =
      static_cast<std::size_t>(record_value(data_, id, entry, [](const auto& e) { return e.source; }));
  std::string text = file < data_.sources.size() ? data_.sources[file] + ", " : std::string();
  if (id.system == gnss::System::Galileo)
    text += is_galileo_fnav(data_.kepler[static_cast<std::size_t>(entry.record)]) ? "F/NAV, " : "I/NAV, ";
  text += "toe " + geodesy::format_gpst(entry.toe, 0);

  const double age = t - entry.toe;
  const std::string limit =
      fmt::format("{} {} toe, {} allows {}", hours(age), age < 0 ? "before" : "after", name(id.system),
                  hours(age < 0 ? entry.validity.before_s : entry.validity.after_s));
  if (choice.entry == nullptr)
    return fmt::format("none: the closest ephemeris is {}; allow_stale: true uses it ({})", limit, text);
  if (choice.stale) text += ", stale: " + limit;
  if (!entry.healthy) {
    text += ", " + health_text(id, t);
    if (!options_.allow_unhealthy) text = "none: " + text;
  }
  return text;
}

SatelliteHealth BroadcastSky::health(gnss::SatelliteId id, GpsTime t) const {
  const Entry* entry = index_->find(id, t, options_.allow_stale);
  if (entry == nullptr) return SatelliteHealth::Unknown;
  return entry->healthy ? SatelliteHealth::Healthy : SatelliteHealth::Unhealthy;
}

std::string BroadcastSky::health_text(gnss::SatelliteId id, GpsTime t) const {
  const Entry* entry = index_->find(id, t, options_.allow_stale);
  if (entry == nullptr || entry->healthy) return {};
  const int health = record_value(data_, id, *entry, [](const auto& e) { return e.health; });
  return health == 0 ? "unhealthy (no accuracy prediction)" : fmt::format("unhealthy (health {})", health);
}

bool BroadcastSky::covers(GpsTime t) const {
  return std::any_of(index_->satellites.begin(), index_->satellites.end(), [&](const Index::Satellite& s) {
    const Entry* entry = Index::choose(s, t, options_.allow_stale).entry;
    return entry != nullptr && (entry->healthy || options_.allow_unhealthy);
  });
}

std::pair<GpsTime, GpsTime> BroadcastSky::span() const {
  return {index_->first, index_->last};
}

SatelliteState propagate(const gnss::KeplerEphemeris& e, geodesy::GpsTime t) {
  const EarthModel earth = earth_model(e.id.system);
  const double tk = t - e.toe;
  const double a = e.sqrt_a * e.sqrt_a;

  // IS-GPS-200 table 20-IV, and its derivatives (table 30-II notes; Remondi 2004).
  const double n = std::sqrt(earth.mu / (a * a * a)) + e.mean_motion_difference;
  const double anomaly = eccentric_anomaly(e.mean_anomaly + n * tk, e.eccentricity);
  const double sin_e = std::sin(anomaly), cos_e = std::cos(anomaly);
  const double root = std::sqrt(1 - e.eccentricity * e.eccentricity);
  const double anomaly_rate = n / (1 - e.eccentricity * cos_e);

  const double phi = std::atan2(root * sin_e, cos_e - e.eccentricity) + e.argument_of_perigee;
  const double phi_rate = root * anomaly_rate / (1 - e.eccentricity * cos_e);
  const double sin_2phi = std::sin(2 * phi), cos_2phi = std::cos(2 * phi);

  const double u = phi + e.cus * sin_2phi + e.cuc * cos_2phi;
  const double r = a * (1 - e.eccentricity * cos_e) + e.crs * sin_2phi + e.crc * cos_2phi;
  const double i = e.inclination + e.inclination_rate * tk + e.cis * sin_2phi + e.cic * cos_2phi;
  const double u_rate = phi_rate * (1 + 2 * (e.cus * cos_2phi - e.cuc * sin_2phi));
  const double r_rate =
      a * e.eccentricity * sin_e * anomaly_rate + 2 * phi_rate * (e.crs * cos_2phi - e.crc * sin_2phi);
  const double i_rate = e.inclination_rate + 2 * phi_rate * (e.cis * cos_2phi - e.cic * sin_2phi);

  const bool geo = is_beidou_geo(e.id);
  const geodesy::GpsTime toe_of_system =
      e.id.system == gnss::System::BeiDou ? e.toe - std::chrono::seconds(geodesy::kBdtSecondsOffset) : e.toe;
  // A BeiDou GEO is computed in a frame that does not rotate with the Earth, and rotated afterwards.
  const double node_rate = geo ? e.right_ascension_rate : e.right_ascension_rate - earth.omega;
  const double node = e.right_ascension + node_rate * tk - earth.omega * toe_of_system.seconds_of_week();

  const double cos_u = std::cos(u), sin_u = std::sin(u);
  const double cos_i = std::cos(i), sin_i = std::sin(i);
  const double cos_node = std::cos(node), sin_node = std::sin(node);
  const double x = r * cos_u, y = r * sin_u;
  const double x_rate = r_rate * cos_u - y * u_rate, y_rate = r_rate * sin_u + x * u_rate;
  const double across = y * cos_i, across_rate = y_rate * cos_i - y * sin_i * i_rate;

  SatelliteState state;
  Eigen::Vector3d& p = state.position_m;
  Eigen::Vector3d& v = state.velocity_mps;
  p = {x * cos_node - across * sin_node, x * sin_node + across * cos_node, y * sin_i};
  v = {x_rate * cos_node - across_rate * sin_node - p.y() * node_rate,
       x_rate * sin_node + across_rate * cos_node + p.x() * node_rate, y_rate * sin_i + y * cos_i * i_rate};
  if (geo) {
    // BDS-SIS-ICD B1I 5.2.4.12: R_z(omega tk) R_x(-5 deg).
    rotate_x_minus_5_deg(p);
    rotate_x_minus_5_deg(v);
    rotate_z(earth.omega * tk, earth.omega, p, v);
  }

  // IS-GPS-200, 20.3.3.3.3.1: polynomial and relativity of the eccentric orbit.
  const double dt = t - e.toc;
  const double relativity = -2 * std::sqrt(earth.mu) * e.eccentricity * e.sqrt_a /
                            (geodesy::kSpeedOfLight * geodesy::kSpeedOfLight);
  state.clock_bias_s = e.af0 + dt * (e.af1 + dt * e.af2) + relativity * sin_e;
  state.clock_drift = e.af1 + 2 * e.af2 * dt + relativity * cos_e * anomaly_rate;
  const auto delays = gnss::group_delays_s(e, is_galileo_fnav(e));
  state.group_delay_s = delays.front();
  std::copy(delays.begin() + 1, delays.end(), state.more_group_delays_s.begin());
  state.carrier_frequency_hz = l1_frequency_hz(e.id.system);
  return state;
}

namespace {

using Vector6d = Eigen::Matrix<double, 6, 1>;

constexpr double kOmega = geodesy::kPz90RotationRate;
constexpr double kMaxStep = 60;  // [s]

// Equations of motion in the rotating frame, ICD GLONASS L1, L2 5.1, A.3.1.2.
Vector6d derivative(const Vector6d& x, const Eigen::Vector3d& luni_solar) {
  const double r2 = x.head<3>().squaredNorm();
  const double r = std::sqrt(r2);
  const double flattening = 1.5 * geodesy::kPz90J2 * geodesy::kPz90Mu * geodesy::kPz90SemiMajorAxis *
                            geodesy::kPz90SemiMajorAxis / (r2 * r2 * r);
  const double z2 = 5 * x[2] * x[2] / r2;
  const double central = -geodesy::kPz90Mu / (r2 * r);
  Vector6d d;
  d.head<3>() = x.tail<3>();
  const double in_plane = central - flattening * (1 - z2);
  d[3] = (in_plane + kOmega * kOmega) * x[0] + 2 * kOmega * x[4] + luni_solar[0];
  d[4] = (in_plane + kOmega * kOmega) * x[1] - 2 * kOmega * x[3] + luni_solar[1];
  d[5] = (central - flattening * (3 - z2)) * x[2] + luni_solar[2];
  return d;
}

Vector6d at_toe(const gnss::GlonassEphemeris& e) {
  Vector6d x;
  x << e.position_m[0], e.position_m[1], e.position_m[2], e.velocity_mps[0], e.velocity_mps[1],
      e.velocity_mps[2];
  return x;
}

/// Integrates `left` seconds by whole steps plus the rest, so the result is continuous in time. Steps of 60 s
/// give an error of 1.3 mm after 30 min.
void integrate(const gnss::GlonassEphemeris& e, Vector6d& x, double left) {
  const Eigen::Vector3d luni_solar(e.acceleration_mps2[0], e.acceleration_mps2[1], e.acceleration_mps2[2]);
  while (left != 0) {
    const double h = std::abs(left) > kMaxStep ? std::copysign(kMaxStep, left) : left;
    const Vector6d k1 = derivative(x, luni_solar);
    const Vector6d k2 = derivative(x + h / 2 * k1, luni_solar);
    const Vector6d k3 = derivative(x + h / 2 * k2, luni_solar);
    const Vector6d k4 = derivative(x + h * k3, luni_solar);
    x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
    left -= h;
  }
}

SatelliteState state_of(const gnss::GlonassEphemeris& e, const Vector6d& x, double dt) {
  SatelliteState state;
  state.position_m = x.head<3>();
  state.velocity_mps = x.tail<3>();
  // ICD GLONASS 4.4: tau_n and gamma_n contain relativity.
  state.clock_bias_s = e.clock_bias_s + e.frequency_bias * dt;
  state.clock_drift = e.frequency_bias;
  state.carrier_frequency_hz = l1_frequency_hz(gnss::System::GLONASS, e.channel);
  const auto signals = gnss::signals_of(gnss::System::GLONASS);
  for (std::size_t i = 1; i < signals.size(); ++i) {
    if (signals[i].group_delay != gnss::GroupDelay::DeltaTau) continue;
    state.more_group_delays_s[i - 1] = e.group_delay_difference_s;  // ICD GLONASS 4.4: delay of L2
  }
  return state;
}

}  // namespace

SatelliteState propagate(const gnss::GlonassEphemeris& e, geodesy::GpsTime t) {
  Vector6d x = at_toe(e);
  const double dt = t - e.toe;
  integrate(e, x, dt);
  return state_of(e, x, dt);
}

struct GlonassOrbit::Steps {
  static constexpr int kEach = 30;
  std::array<std::array<Vector6d, kEach + 1>, 2> after;  ///< forwards, backwards

  explicit Steps(const gnss::GlonassEphemeris& e) {
    for (std::size_t route = 0; route < 2; ++route) {
      after[route][0] = at_toe(e);
      for (std::size_t i = 1; i <= kEach; ++i) {
        after[route][i] = after[route][i - 1];
        integrate(e, after[route][i], route == 0 ? kMaxStep : -kMaxStep);
      }
    }
  }
};

SatelliteState GlonassOrbit::propagate(const gnss::GlonassEphemeris& e, geodesy::GpsTime t) const {
  std::call_once(computed_, [&] { steps_ = std::make_shared<const Steps>(e); });
  const double dt = t - e.toe;
  // The last step of integrate() may be a whole one.
  const double steps = std::ceil(std::abs(dt) / kMaxStep) - 1;
  const auto whole = static_cast<std::size_t>(std::clamp<double>(steps, 0, Steps::kEach));
  Vector6d x = steps_->after[dt < 0 ? 1 : 0][whole];
  integrate(e, x, dt - std::copysign(static_cast<double>(whole) * kMaxStep, dt));
  return state_of(e, x, dt);
}

SatelliteState propagate(const gnss::SbasEphemeris& e, geodesy::GpsTime t) {
  const double dt = t - e.toe;
  const Eigen::Map<const Eigen::Vector3d> position(e.position_m.data()), velocity(e.velocity_mps.data()),
      acceleration(e.acceleration_mps2.data());
  SatelliteState state;
  state.position_m = position + velocity * dt + acceleration * (dt * dt / 2);
  state.velocity_mps = velocity + acceleration * dt;
  state.clock_bias_s = e.clock_bias_s + e.clock_drift * dt;
  state.clock_drift = e.clock_drift;
  state.carrier_frequency_hz = l1_frequency_hz(gnss::System::SBAS);
  return state;
}

}  // namespace canyon::orbit
