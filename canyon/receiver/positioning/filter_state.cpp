#include "canyon/receiver/positioning/filter_state.hpp"

#include <algorithm>
#include <utility>

#include "canyon/base/arithmetic.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/receiver/positioning/least_squares.hpp"

namespace canyon::positioning {

using geodesy::kSpeedOfLight;
using gnss::kConstellations;
using gnss::System;

namespace {

/// A third of u-blox's limits of speed in the model "automotive", 100 and 15 m/s.
constexpr double kUnknownSpeedHorizontal_mps = 100.0 / 3;
constexpr double kUnknownSpeedVertical_mps = 5;
/// Random walk of a constellation's clock relative to the oscillator [m/sqrt(s)]: 0.5 m, the order of a jump
/// between broadcast clocks, over the two hours between their updates.
constexpr double kClockWalk = 0.006;
constexpr double kMillisecond_m = 1e-3 * kSpeedOfLight;
/// A common innovation beyond this is a clock step, if it is also beyond this many standard deviations:
/// detours of signals and an unexpected drift are smaller.
constexpr double kClockStep_m = 1000;
constexpr double kClockStepSigmas = 6;
/// Pseudoranges have a clock of their own if it diverges from the drift of the Dopplers by a higher mean rate
/// over this time. Echoes common to all satellites would have to grow by the product, 100 m.
constexpr double kCodeClock_mps = 10;
constexpr double kCodeClock_s = 10;

}  // namespace

Eigen::Matrix3d unknown_velocity(const Eigen::Vector3d& position_ecef) {
  const Eigen::Matrix3d enu_from_ecef =
      geodesy::enu_from_ecef_rotation(geodesy::geodetic_from_ecef(position_ecef));
  const Eigen::Vector3d speed(kUnknownSpeedHorizontal_mps, kUnknownSpeedHorizontal_mps,
                              kUnknownSpeedVertical_mps);
  return geodesy::rotated(enu_from_ecef.transpose(), speed.cwiseAbs2().asDiagonal());
}

namespace {

/// Four elements of a column: GCC does not vectorize loops of twelve.
using Four = double __attribute__((vector_size(32), aligned(8), may_alias));
constexpr std::ptrdiff_t kFours = kStates / 4;
static_assert(kStates % 4 == 0);
Four* fours(const auto& of) {
  return reinterpret_cast<Four*>(const_cast<double*>(of.data()));
}

/// A gradient has 4 or 7 of 12 elements.
CANYON_CLONES StateVector product(const StateMatrix& p, const StateVector& gradient) {
  StateVector sum = StateVector::Zero();
  for (std::ptrdiff_t i = 0; i < kStates; ++i)
    for (std::ptrdiff_t k = 0; gradient[i] != 0 && k < kFours; ++k)
      fours(sum)[k] += gradient[i] * fours(p)[kFours * i + k];
  return sum;
}

/// Adds a b' + b a'; a symmetric matrix stays exactly symmetric.
CANYON_CLONES void add_symmetric(StateMatrix& p, const StateVector& a, const StateVector& b) {
  for (std::ptrdiff_t i = 0; i < kStates; ++i)
    for (std::ptrdiff_t k = 0; k < kFours; ++k)
      fours(p)[kFours * i + k] += fours(a)[k] * b[i] + fours(b)[k] * a[i];
}

/// Subtracts a b' from p.
CANYON_CLONES void take_outer(StateMatrix& p, const StateVector& a, const StateVector& b) {
  for (std::ptrdiff_t i = 0; i < kStates; ++i)
    for (std::ptrdiff_t k = 0; k < kFours; ++k) fours(p)[kFours * i + k] -= fours(a)[k] * b[i];
}

}  // namespace

bool Update::take(const FilterRow& row, double gate_sigmas) {
  StateMatrix& p = state_.p;
  const StateVector ph = product(p, row.gradient);
  const double noise = row.sigma * row.sigma;
  const double variance = row.gradient.dot(ph) + noise;
  const double innovation = row.innovation - row.gradient.dot(correction_);
  if (std::abs(innovation) > gate_sigmas * std::sqrt(variance)) return false;
  const StateVector gain = ph / variance;
  correction_ += gain * innovation;
  // Joseph's form: P - K h' P - P h K' + K (h' P h + noise) K'.
  add_symmetric(p, gain, gain * (variance / 2) - ph);
  taken_.push_back({row, gain, 0, 0});
  return true;
}

void report_accuracy(FilterState& filter, std::span<AcceptedRow> taken, double excess,
                     const PositionFilterOptions& options) {
  const double lasting = options.error_correlation_s > 0 ? excess : 0;
  const double lasting_corrected = std::max(0.0, lasting - 1);
  StateMatrix& s = filter.reported_covariance;
  // The errors' covariances are linear: C becomes Q C, minus b R K for the satellite's own row.
  StateMatrix until = StateMatrix::Identity();  // Q', Q the product of I - K h' over the rows so far
  double fractions = 0;
  std::ptrdiff_t pseudoranges = 0;
  for (AcceptedRow& each : taken) {
    const FilterRow& row = each.row;
    const StateVector& gain = each.gain;
    StateVector m = product(s, row.gradient);
    double variance = row.gradient.dot(m);
    const double unit = row.fraction * row.sigma;
    if (row.satellite) {
      fractions += row.fraction * row.fraction;
      ++pseudoranges;
      const auto at =
          std::find_if(filter.lasting.begin(), filter.lasting.end(),
                       [&row](const CorrelatedError& l) { return l.satellite == *row.satellite; });
      each.lasting = static_cast<std::size_t>(at - filter.lasting.begin());
      each.lasting_sigma = unit * std::sqrt(row.fraction < 1 ? lasting_corrected : lasting);
      if (at == filter.lasting.end())
        filter.lasting.push_back({*row.satellite, StateVector::Zero(), filter.time});
      CorrelatedError& error = filter.lasting[each.lasting];
      error.taken = filter.time;
      const StateVector covariance = until.transpose().lazyProduct(error.covariance);
      variance += excess * unit * unit + 2 * each.lasting_sigma * row.gradient.dot(covariance);
      m += each.lasting_sigma * covariance;
    } else {
      variance += unit * unit;
    }
    add_symmetric(s, gain, gain * (variance / 2) - m);
    take_outer(until, product(until, row.gradient), gain);
  }
  for (CorrelatedError& error : filter.lasting)
    error.covariance = until.transpose().lazyProduct(error.covariance).eval();
  StateMatrix after = StateMatrix::Identity();  // R, the product over the rows after one
  for (auto each = taken.rbegin(); each != taken.rend(); ++each) {
    const StateVector reached = product(after, each->gain);
    if (each->row.satellite) filter.lasting[each->lasting].covariance -= each->lasting_sigma * reached;
    take_outer(after, reached, each->row.gradient);
  }
  if (pseudoranges > 0) filter.noise_fraction = fractions / static_cast<double>(pseudoranges);
}

void predict(FilterState& filter, double dt, const PositionFilterOptions& options) {
  const Eigen::Matrix3d enu_from_ecef =
      geodesy::enu_from_ecef_rotation(geodesy::geodetic_from_ecef(filter.position()));
  const Eigen::Vector3d density(std::pow(options.acceleration_horizontal, 2),
                                std::pow(options.acceleration_horizontal, 2),
                                std::pow(options.acceleration_vertical, 2));
  const Eigen::Matrix3d acceleration = geodesy::rotated(enu_from_ecef.transpose(), density.asDiagonal());
  // The transition matrix is I, except dt from velocity to position, and from drift to clocks.
  const auto move = [&](int to, int from) {
    filter.x(to) += dt * filter.x(from);
    for (CorrelatedError& lasting : filter.lasting) lasting.covariance(to) += dt * lasting.covariance(from);
  };
  const auto each = [&](const auto& function) {
    for (int i = 0; i < 3; ++i) function(kPosition + i, kVelocity + i);
    for (const System system : kConstellations) {
      if (filter.knows(system)) function(clock_of(system), kDrift);
    }
  };
  each(move);
  // Drops correlations below 1 %.
  const double forgets_s = std::max(options.error_correlation_s, 1e-9);
  std::erase_if(filter.lasting,
                [&](const CorrelatedError& l) { return filter.time + dt - l.taken > 4.6 * forgets_s; });
  for (CorrelatedError& lasting : filter.lasting) lasting.covariance *= std::exp(-dt / forgets_s);
  const double c2 = kSpeedOfLight * kSpeedOfLight;
  const double white = c2 * options.clock_frequency_density;
  const double walk = c2 * options.clock_drift_density;
  for (const bool reported_covariance : {false, true}) {
    StateMatrix& p = reported_covariance ? filter.reported_covariance : filter.p;
    const double fraction = reported_covariance ? filter.noise_fraction : 1;
    each([&p, dt](int to, int from) { p.row(to) += dt * p.row(from); });
    each([&p, dt](int to, int from) { p.col(to) += dt * p.col(from); });
    p.block<3, 3>(kPosition, kPosition) += fraction * acceleration * (dt * dt * dt / 3);
    p.block<3, 3>(kPosition, kVelocity) += fraction * acceleration * (dt * dt / 2);
    p.block<3, 3>(kVelocity, kPosition) += fraction * acceleration * (dt * dt / 2);
    p.block<3, 3>(kVelocity, kVelocity) += fraction * acceleration * dt;
    p(kDrift, kDrift) += fraction * walk * dt;
    for (const System a : kConstellations) {
      if (!filter.knows(a)) continue;
      p(kDrift, clock_of(a)) += fraction * walk * dt * dt / 2;
      p(clock_of(a), kDrift) += fraction * walk * dt * dt / 2;
      p(clock_of(a), clock_of(a)) += fraction * kClockWalk * kClockWalk * dt;
      for (const System b : kConstellations)
        if (filter.knows(b)) p(clock_of(a), clock_of(b)) += fraction * (white * dt + walk * dt * dt * dt / 3);
    }
  }
}

FilterRow pseudorange_row(const FilterState& filter, const RangedSatellite& satellite) {
  const int clock = clock_of(satellite.measured->id.system);
  FilterRow row;
  row.gradient.segment<3>(kPosition) = -satellite.direction;
  row.gradient(clock) = 1;
  row.innovation = satellite.pseudorange_m - satellite.range_m - satellite.space_m - filter.x(clock);
  row.sigma = satellite.sigma_m;
  row.satellite = satellite.measured->id;
  row.fraction = satellite.measured->reported_sigma_ratio;
  return row;
}

FilterRow doppler_row(const FilterState& filter, const RangedSatellite& satellite) {
  const DopplerEquation doppler = doppler_equation(satellite);
  const Eigen::Vector3d relative = doppler.satellite_mps - filter.velocity();
  const double approach = satellite.direction.dot(relative);
  FilterRow row;
  // Motion across the line of sight rotates it: d(e.u)/dp = -(u - e (e.u)) / range.
  row.gradient.segment<3>(kPosition) =
      -(relative - approach * satellite.direction) / (satellite.range_m * doppler.g);
  row.gradient.segment<3>(kVelocity) = -satellite.direction / doppler.g;
  row.gradient(kDrift) = 1 - doppler.measured_mps / kSpeedOfLight;
  row.innovation = doppler.measured_mps + kSpeedOfLight * satellite.state.clock_drift - approach / doppler.g -
                   row.gradient(kDrift) * filter.x(kDrift);
  row.sigma = doppler.sigma_mps;
  row.fraction = satellite.measured->reported_sigma_ratio;
  return row;
}

/// Adds a variance common to all clocks.
void widen_clocks(FilterState& filter, double variance_m2) {
  for (const System a : kConstellations) {
    for (const System b : kConstellations) {
      if (!filter.knows(a) || !filter.knows(b)) continue;
      filter.p(clock_of(a), clock_of(b)) += variance_m2;
      filter.reported_covariance(clock_of(a), clock_of(b)) += variance_m2;
    }
  }
}

/// Estimates the motion of the pseudoranges' clock in `dt` seconds relative to the drift. Returns its mean
/// square, or 0 for a clock that follows the drift.
double code_clock_m2(CodeClock& own, const FilterState& filter, double step_m, double dt) {
  const System of = *std::find_if(kConstellations.begin(), kConstellations.end(),
                                  [&filter](System system) { return filter.knows(system); });
  const double clock_m = filter.x(clock_of(of)) + step_m;
  const double lateral_m = clock_m - std::exchange(own.clock_m, clock_m) - dt * filter.x(kDrift);
  if (std::exchange(own.of, of) != of || dt <= 0) return 0;
  const double weight = -std::expm1(-dt / kCodeClock_s);
  own.rate_mps += weight * (lateral_m / dt - own.rate_mps);
  own.mean_square_m2 += weight * (lateral_m * lateral_m - own.mean_square_m2);
  return std::abs(own.rate_mps) > kCodeClock_mps ? own.mean_square_m2 : 0;
}

void update_clocks(FilterState& filter, CodeClock& own, FilterEpoch& epoch, double dt) {
  std::vector<double>& common = epoch.innovations;
  common.clear();
  std::array<std::vector<double>, kConstellations.size()> new_residuals;
  double variance = 0;
  for (const RangedSatellite& satellite : epoch.satellites) {
    if (!satellite.above_mask) continue;
    const System system = satellite.measured->id.system;
    const FilterRow row = pseudorange_row(filter, satellite);
    if (filter.knows(system)) {
      common.push_back(row.innovation);
      variance = std::max(variance, row.gradient.dot(filter.p * row.gradient) + row.sigma * row.sigma);
    } else {
      new_residuals[clock_index(system)].push_back(row.innovation);
    }
  }
  if (!common.empty()) {
    const double step = upper_median(common);
    if (std::abs(step) > std::max(kClockStep_m, kClockStepSigmas * std::sqrt(variance))) {
      const double milliseconds = std::round(step / kMillisecond_m);
      const bool whole = milliseconds != 0 && std::abs(step - milliseconds * kMillisecond_m) < kClockStep_m;
      for (const System a : kConstellations)
        if (filter.knows(a)) filter.x(clock_of(a)) += whole ? milliseconds * kMillisecond_m : step;
      if (!whole) widen_clocks(filter, kUnknown_m * kUnknown_m);
      own.of.reset();
      // The time since the last epoch is by the clock, and was wrong by the clock's step.
      if (whole) filter.x.segment<3>(kPosition) -= filter.velocity() * milliseconds * 1e-3;
    } else {
      widen_clocks(filter, code_clock_m2(own, filter, step, dt));
    }
  }
  for (const System system : kConstellations) {
    auto& innovations = new_residuals[clock_index(system)];
    if (innovations.empty()) continue;
    const int clock = clock_of(system);
    filter.known[clock_index(system)] = true;
    filter.x(clock) += upper_median(innovations);
    for (StateMatrix* p : {&filter.p, &filter.reported_covariance}) {
      p->row(clock).setZero();
      p->col(clock).setZero();
      (*p)(clock, clock) = kUnknown_m * kUnknown_m;
    }
    for (CorrelatedError& lasting : filter.lasting) lasting.covariance(clock) = 0;
  }
}

}  // namespace canyon::positioning
