#include "canyon/positioning/position_filter.hpp"

#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "canyon/base/input_error.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/positioning/pseudorange_model.hpp"

namespace canyon::positioning {
namespace {

using geodesy::kSpeedOfLight;
using gnss::kConstellations;
using gnss::System;

// States: ECEF position and velocity, clock drift [m/s], each constellation's clock [m].
constexpr int kPosition = 0;
constexpr int kVelocity = 3;
constexpr int kDrift = 6;
constexpr int kClock = 7;
constexpr int kStates = kClock + static_cast<int>(kConstellations.size());
using StateVector = Eigen::Matrix<double, kStates, 1>;
using StateMatrix = Eigen::Matrix<double, kStates, kStates>;

/// Standard deviation of what a start knows nothing of: a fix's own position and clocks, which its
/// measurements then tell again. 1e-8 of the weight of a pseudorange of 1 m.
constexpr double kUnknown_m = 1e4;
/// A third of u-blox's limits of speed in the model "automotive", 100 and 15 m/s.
constexpr double kUnknownSpeedHorizontal_mps = 100.0 / 3;
constexpr double kUnknownSpeedVertical_mps = 5;
/// A third of ClockOptions' largest drift, 1e-4.
constexpr double kUnknownDrift_mps = 1e-4 / 3 * kSpeedOfLight;
/// Walk of a constellation's clock beside the oscillator [m/sqrt(s)]: 0.5 m, the order of what a broadcast
/// clock's renewal changes, over the two hours between renewals.
constexpr double kClockWalk = 0.006;
constexpr double kMillisecond_m = 1e-3 * kSpeedOfLight;
/// A common innovation beyond this is no detour of signals, nor a drift's surprise if it is beyond so many
/// standard deviations too.
constexpr double kClockStep_m = 1000;
constexpr double kClockStepSigmas = 6;

/// Of the clock that a system's satellites have, among kConstellations.
std::size_t clock_index(System system) {
  return static_cast<std::size_t>(clock_system(system));
}
int clock_of(System system) {
  return kClock + static_cast<int>(clock_index(system));
}

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// A measurement's linear equation: innovation = gradient . error + noise.
struct Row {
  StateVector gradient = StateVector::Zero();
  double innovation = 0;
  double sigma = 1;
};

struct Track {
  geodesy::GpsTime time;
  geodesy::GpsTime measured;  ///< when a measurement last passed the gate
  std::optional<geodesy::GpsTime> astray_since;
  std::array<std::optional<geodesy::GpsTime>, kConstellations.size()> system_astray_since;
  std::array<bool, kConstellations.size()> known{};  ///< the constellation has a clock
  StateVector x = StateVector::Zero();
  StateMatrix p = StateMatrix::Zero();

  [[nodiscard]] Eigen::Vector3d position() const { return x.segment<3>(kPosition); }
  [[nodiscard]] Eigen::Vector3d velocity() const { return x.segment<3>(kVelocity); }
  [[nodiscard]] bool knows(System system) const { return known[clock_index(system)]; }
};

/// Over dt white acceleration of density q gives position and velocity q dt^3 / 3, q dt^2 / 2, q dt
/// (Bar-Shalom, Li & Kirubarajan, Estimation with Applications to Tracking and Navigation, eq. 6.2.2-4), and
/// likewise the clock from its drift, plus white frequency.
void predict(Track& track, double dt, const PositionFilterOptions& options) {
  StateMatrix f = StateMatrix::Identity();
  f.block<3, 3>(kPosition, kVelocity).diagonal().setConstant(dt);
  for (const System system : kConstellations) {
    if (track.knows(system)) f(clock_of(system), kDrift) = dt;
  }
  const Eigen::Matrix3d enu_from_ecef =
      geodesy::enu_from_ecef_rotation(geodesy::geodetic_from_ecef(track.position()));
  const Eigen::Vector3d density(std::pow(options.acceleration_horizontal, 2),
                                std::pow(options.acceleration_horizontal, 2),
                                std::pow(options.acceleration_vertical, 2));
  const Eigen::Matrix3d acceleration = enu_from_ecef.transpose() * density.asDiagonal() * enu_from_ecef;
  track.x = f * track.x;
  track.p = f * track.p * f.transpose();
  track.p.block<3, 3>(kPosition, kPosition) += acceleration * (dt * dt * dt / 3);
  track.p.block<3, 3>(kPosition, kVelocity) += acceleration * (dt * dt / 2);
  track.p.block<3, 3>(kVelocity, kPosition) += acceleration * (dt * dt / 2);
  track.p.block<3, 3>(kVelocity, kVelocity) += acceleration * dt;
  const double c2 = kSpeedOfLight * kSpeedOfLight;
  const double white = c2 * options.clock_frequency_density;
  const double walk = c2 * options.clock_drift_density;
  track.p(kDrift, kDrift) += walk * dt;
  for (const System a : kConstellations) {
    if (!track.knows(a)) continue;
    track.p(kDrift, clock_of(a)) += walk * dt * dt / 2;
    track.p(clock_of(a), kDrift) += walk * dt * dt / 2;
    track.p(clock_of(a), clock_of(a)) += kClockWalk * kClockWalk * dt;
    for (const System b : kConstellations) {
      if (track.knows(b)) track.p(clock_of(a), clock_of(b)) += white * dt + walk * dt * dt * dt / 3;
    }
  }
}

Row pseudorange_row(const Track& track, const RangedSatellite& satellite) {
  const int clock = clock_of(satellite.measured->id.system);
  Row row;
  row.gradient.segment<3>(kPosition) = -satellite.direction;
  row.gradient(clock) = 1;
  row.innovation = satellite.pseudorange_m - satellite.range_m - satellite.atmosphere_m - track.x(clock);
  row.sigma = satellite.sigma_m;
  return row;
}

Row doppler_row(const Track& track, const RangedSatellite& satellite) {
  const DopplerEquation doppler = doppler_equation(satellite);
  const Eigen::Vector3d relative = doppler.satellite_mps - track.velocity();
  const double approach = satellite.direction.dot(relative);
  Row row;
  // Moving across the line of sight turns it: d(e.u)/dp = -(u - e (e.u)) / range.
  row.gradient.segment<3>(kPosition) =
      -(relative - approach * satellite.direction) / (satellite.range_m * doppler.g);
  row.gradient.segment<3>(kVelocity) = -satellite.direction / doppler.g;
  row.gradient(kDrift) = 1 - doppler.measured_mps / kSpeedOfLight;
  row.innovation = doppler.measured_mps + kSpeedOfLight * satellite.state.clock_drift - approach / doppler.g -
                   row.gradient(kDrift) * track.x(kDrift);
  row.sigma = doppler.sigma_mps;
  return row;
}

/// Scalar updates at one point of linearisation, by Joseph's form: P = (I - K h) P (I - K h)^T + K R K^T.
class Update {
 public:
  explicit Update(Track& track) : track_(track) {}

  /// False, and nothing changed, where the innovation lies beyond `gate_sigmas`.
  bool take(const Row& row, double gate_sigmas) {
    const StateVector ph = track_.p * row.gradient;
    const double noise = row.sigma * row.sigma;
    const double variance = row.gradient.dot(ph) + noise;
    const double innovation = row.innovation - row.gradient.dot(correction_);
    if (std::abs(innovation) > gate_sigmas * std::sqrt(variance)) return false;
    const StateVector gain = ph / variance;
    correction_ += gain * innovation;
    track_.p -= gain * ph.transpose();
    const StateVector left = track_.p * row.gradient;
    track_.p += (noise * gain - left) * gain.transpose();
    track_.p = ((track_.p + track_.p.transpose()) / 2).eval();
    return true;
  }
  void finish() { track_.x += correction_; }

 private:
  Track& track_;
  StateVector correction_ = StateVector::Zero();
};

/// One epoch's satellites around a position.
struct Epoch {
  geodesy::GpsTime time;
  std::vector<RangedSatellite> satellites;
  std::vector<bool> passed;  ///< one per satellite
};

void look_around(Epoch& epoch, const Eigen::Vector3d& position, const FixOptions& fix,
                 const std::map<System, gnss::Klobuchar>& klobuchar) {
  double sum = 0;
  int above = 0;
  for (RangedSatellite& satellite : epoch.satellites) {
    for (int i = 0; i < 3; ++i) place_satellite(satellite, position);
  }
  look_up(epoch.satellites, position, epoch.time, fix, klobuchar);
  for (const RangedSatellite& satellite : epoch.satellites) {
    if (!satellite.above_mask) continue;
    sum += satellite.measured->sigma_m * satellite.measured->sigma_m;
    ++above;
  }
  if (fix.weights.weighting != Weighting::Equal) return;
  for (RangedSatellite& satellite : epoch.satellites) satellite.sigma_m = std::sqrt(sum / std::max(above, 1));
}

void take_dopplers(const Track& track, const Epoch& epoch, double gate_sigmas, Update& update) {
  for (std::size_t i = 0; i < epoch.satellites.size(); ++i) {
    if (epoch.passed[i] && epoch.satellites[i].measured->doppler_hz) {
      update.take(doppler_row(track, epoch.satellites[i]), gate_sigmas);
    }
  }
}

/// A filter that knows what the fix's satellites tell, correlations of position and clocks included: their
/// measurements taken at the fix's position, from (nearly) nothing. Empty where they are not among the
/// measurements.
std::optional<Track> begin(Epoch& epoch, const Fix& fix, const FixOptions& options,
                           const std::map<System, gnss::Klobuchar>& klobuchar) {
  look_around(epoch, fix.position_ecef, options, klobuchar);
  const Eigen::Matrix3d ecef_from_enu = geodesy::enu_from_ecef_rotation(fix.position).transpose();
  Track track;
  track.time = track.measured = epoch.time;
  track.x.segment<3>(kPosition) = fix.position_ecef;
  track.p.block<3, 3>(kPosition, kPosition).diagonal().setConstant(kUnknown_m * kUnknown_m);
  if (fix.velocity_enu_mps) track.x.segment<3>(kVelocity) = ecef_from_enu * *fix.velocity_enu_mps;
  const Eigen::Vector3d speed(kUnknownSpeedHorizontal_mps, kUnknownSpeedHorizontal_mps,
                              kUnknownSpeedVertical_mps);
  track.p.block<3, 3>(kVelocity, kVelocity) =
      ecef_from_enu * speed.cwiseAbs2().asDiagonal() * ecef_from_enu.transpose();
  track.x(kDrift) = fix.clock_drift.value_or(0) * kSpeedOfLight;
  track.p(kDrift, kDrift) = kUnknownDrift_mps * kUnknownDrift_mps;
  for (const auto& [system, bias_s] : fix.clock_bias_s) {
    track.known[clock_index(system)] = true;
    track.x(clock_of(system)) = bias_s * kSpeedOfLight;
    track.p(clock_of(system), clock_of(system)) = kUnknown_m * kUnknown_m;
  }
  Update update(track);
  epoch.passed.assign(epoch.satellites.size(), false);
  int taken = 0;
  for (std::size_t i = 0; i < epoch.satellites.size(); ++i) {
    const gnss::SatelliteId id = epoch.satellites[i].measured->id;
    if (!track.knows(id.system) || !std::binary_search(fix.used.begin(), fix.used.end(), id)) continue;
    epoch.passed[i] =
        update.take(pseudorange_row(track, epoch.satellites[i]), std::numeric_limits<double>::infinity());
    ++taken;
  }
  if (taken < 4) return std::nullopt;
  take_dopplers(track, epoch, std::numeric_limits<double>::infinity(), update);
  update.finish();
  return track;
}

/// The clock's steps, and clocks of constellations that had none.
void mind_clocks(Track& track, const Epoch& epoch) {
  std::vector<double> common;
  std::array<std::vector<double>, kConstellations.size()> of_new;
  double variance = 0;
  for (const RangedSatellite& satellite : epoch.satellites) {
    if (!satellite.above_mask) continue;
    const System system = satellite.measured->id.system;
    const Row row = pseudorange_row(track, satellite);
    if (track.knows(system)) {
      common.push_back(row.innovation);
      variance = std::max(variance, row.gradient.dot(track.p * row.gradient) + row.sigma * row.sigma);
    } else {
      of_new[clock_index(system)].push_back(row.innovation);
    }
  }
  if (!common.empty()) {
    const double step = median(common);
    if (std::abs(step) > std::max(kClockStep_m, kClockStepSigmas * std::sqrt(variance))) {
      const double milliseconds = std::round(step / kMillisecond_m);
      const bool whole = milliseconds != 0 && std::abs(step - milliseconds * kMillisecond_m) < kClockStep_m;
      for (const System a : kConstellations) {
        if (!track.knows(a)) continue;
        track.x(clock_of(a)) += whole ? milliseconds * kMillisecond_m : step;
        for (const System b : kConstellations) {
          if (!whole && track.knows(b)) track.p(clock_of(a), clock_of(b)) += kUnknown_m * kUnknown_m;
        }
      }
      // The clock told the time since the last epoch, and was wrong by its step.
      if (whole) track.x.segment<3>(kPosition) -= track.velocity() * milliseconds * 1e-3;
    }
  }
  for (const System system : kConstellations) {
    const auto& innovations = of_new[clock_index(system)];
    if (innovations.empty()) continue;
    const int clock = clock_of(system);
    track.known[clock_index(system)] = true;
    track.x(clock) += median(innovations);
    track.p.row(clock).setZero();
    track.p.col(clock).setZero();
    track.p(clock, clock) = kUnknown_m * kUnknown_m;
  }
}

/// Keeps the instant since when most of `considered` fail; true when that is `limit_s` ago.
bool astray(std::optional<geodesy::GpsTime>& since, geodesy::GpsTime now, int failed, int considered,
            double limit_s) {
  if (2 * failed <= considered) {
    since.reset();
    return false;
  }
  if (!since) since = now;
  return now - *since >= limit_s;
}

/// One epoch's measurements, at the predicted position; false where the filter is astray.
bool correct(Track& track, Epoch& epoch, const PositionFilterOptions& options) {
  mind_clocks(track, epoch);
  struct Candidate {
    std::size_t index;
    Row row;
  };
  std::vector<Candidate> candidates;
  std::vector<double> innovations;
  for (std::size_t i = 0; i < epoch.satellites.size(); ++i) {
    if (!epoch.satellites[i].above_mask) continue;
    candidates.push_back({i, pseudorange_row(track, epoch.satellites[i])});
    innovations.push_back(candidates.back().row.innovation);
  }
  epoch.passed.assign(epoch.satellites.size(), false);
  if (candidates.empty()) return true;
  const double middle = median(innovations);
  std::stable_sort(candidates.begin(), candidates.end(), [middle](const Candidate& a, const Candidate& b) {
    return std::abs(a.row.innovation - middle) < std::abs(b.row.innovation - middle);
  });
  Update update(track);
  std::array<int, kConstellations.size()> considered{};
  std::array<int, kConstellations.size()> failed{};
  for (const Candidate& candidate : candidates) {
    const std::size_t system = clock_index(epoch.satellites[candidate.index].measured->id.system);
    ++considered[system];
    epoch.passed[candidate.index] = update.take(candidate.row, options.gate_sigmas);
    if (epoch.passed[candidate.index]) {
      track.measured = epoch.time;
    } else {
      ++failed[system];
    }
  }
  take_dopplers(track, epoch, options.gate_sigmas, update);
  update.finish();
  int all_considered = 0;
  int all_failed = 0;
  for (std::size_t system = 0; system < kConstellations.size(); ++system) {
    all_considered += considered[system];
    all_failed += failed[system];
    // A clock can be told wrong by the first satellites of its constellation: it is then learned anew. A lone
    // satellite tells nothing else.
    if (considered[system] >= 2 && astray(track.system_astray_since[system], epoch.time, failed[system],
                                          considered[system], options.coast_s)) {
      track.known[system] = false;
      track.x(kClock + static_cast<int>(system)) = 0;
      track.system_astray_since[system].reset();
    }
  }
  return !astray(track.astray_since, epoch.time, all_failed, all_considered, options.coast_s);
}

/// False where no receiver can be.
bool somewhere(const Track& track) {
  if (!track.x.allFinite()) return false;
  const double height = geodesy::geodetic_from_ecef(track.position()).height_m;
  return is_near_ground(height);
}

void add_geometry(Fix& fix, const Track& track, const Epoch& epoch, const Eigen::Matrix3d& enu_from_ecef) {
  std::array<int, kConstellations.size()> column{};
  column.fill(-1);
  int clocks = 0;
  for (const gnss::SatelliteId id : fix.used) {
    int& each = column[clock_index(id.system)];
    if (each < 0) each = 3 + clocks++;
  }
  fix.unknowns = 3 + std::max(clocks, 1);
  if (fix.used.empty()) return;
  Design design = Design::Zero(static_cast<Eigen::Index>(fix.used.size()), 3 + clocks);
  Eigen::Index row = 0;
  for (std::size_t i = 0; i < epoch.satellites.size(); ++i) {
    if (!epoch.passed[i]) continue;
    RangedSatellite satellite = epoch.satellites[i];
    const System system = satellite.measured->id.system;
    place_satellite(satellite, track.position());
    fix.residuals_m.push_back(satellite.pseudorange_m - satellite.range_m - satellite.atmosphere_m -
                              track.x(clock_of(system)));
    design.row(row).head<3>() = -(enu_from_ecef * satellite.direction).transpose();
    design(row, column[clock_index(system)]) = 1;
    ++row;
  }
  Eigen::ColPivHouseholderQR<Design> qr(design);
  qr.setThreshold(1e-6);
  fix.rank = static_cast<int>(qr.rank());
  if (const std::optional<Cofactor> q = cofactor(design)) fix.dop = dop_from_cofactor(*q);
}

Fix describe(const Track& track, const Epoch& epoch) {
  Fix fix;
  fix.status = FixStatus::Fix;
  fix.iterations = 1;
  fix.position_ecef = track.position();
  fix.position = geodesy::geodetic_from_ecef(fix.position_ecef);
  const Eigen::Matrix3d enu_from_ecef = geodesy::enu_from_ecef_rotation(fix.position);
  fix.covariance_enu = enu_from_ecef * track.p.block<3, 3>(kPosition, kPosition) * enu_from_ecef.transpose();
  fix.velocity_enu_mps = enu_from_ecef * track.velocity();
  fix.velocity_covariance_enu =
      enu_from_ecef * track.p.block<3, 3>(kVelocity, kVelocity) * enu_from_ecef.transpose();
  fix.clock_drift = track.x(kDrift) / kSpeedOfLight;
  for (const System system : kConstellations) {
    if (track.knows(system)) fix.clock_bias_s[system] = track.x(clock_of(system)) / kSpeedOfLight;
  }
  for (std::size_t i = 0; i < epoch.satellites.size(); ++i) {
    if (!epoch.satellites[i].above_mask) continue;
    ++fix.available;
    (epoch.passed[i] ? fix.used : fix.excluded).push_back(epoch.satellites[i].measured->id);
  }
  add_geometry(fix, track, epoch, enu_from_ecef);
  return fix;
}

}  // namespace

struct PositionFilter::State {
  PositionFilterOptions options;
  FixOptions fix;
  std::optional<Track> track;
};

PositionFilter::PositionFilter(const PositionFilterOptions& options, const FixOptions& fix)
    : state_(std::make_unique<State>(State{options, fix, std::nullopt})) {
  options.validate();
  fix.validate();
}
PositionFilter::~PositionFilter() = default;
PositionFilter::PositionFilter(PositionFilter&&) noexcept = default;
PositionFilter& PositionFilter::operator=(PositionFilter&&) noexcept = default;

Fix PositionFilter::update(geodesy::GpsTime receiver_time, const std::vector<Measurement>& measurements,
                           const orbit::Sky& sky, const Fix& fix,
                           const std::map<System, gnss::Klobuchar>& klobuchar) {
  const PositionFilterOptions& options = state_->options;
  Epoch epoch{receiver_time, ranged_satellites(receiver_time, measurements, sky, state_->fix), {}};
  std::optional<Track> track = state_->track;
  bool lost = !track;
  if (track) {
    const double dt = receiver_time - track->time;
    if (dt < 0) {
      throw InputError(fmt::format("the position filter cannot go {} s back in time", -dt),
                       "give epochs in order of time");
    }
    if (receiver_time - track->measured > options.coast_s) {
      track.reset();
      lost = true;
    } else {
      predict(*track, dt, options);
      track->time = receiver_time;
      look_around(epoch, track->position(), state_->fix, klobuchar);
      lost = !correct(*track, epoch, options);
      if (!somewhere(*track)) {
        track.reset();
        lost = true;
      }
    }
  }
  if (lost && fix.solved()) {
    Epoch fresh = epoch;
    if (const std::optional<Track> anew = begin(fresh, fix, state_->fix, klobuchar)) {
      state_->track = anew;
      Fix answer = describe(*anew, fresh);
      answer.excluded = fix.excluded;
      return answer;
    }
  }
  state_->track = track;
  return track ? describe(*track, epoch) : fix;
}

}  // namespace canyon::positioning
