#include "canyon/receiver/positioning/position_filter.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/receiver/positioning/filter_state.hpp"
#include "canyon/receiver/positioning/least_squares.hpp"

namespace canyon::positioning {
namespace {

using geodesy::kSpeedOfLight;
using gnss::kConstellations;
using gnss::System;

/// A third of ClockOptions' largest drift, 1e-4.
constexpr double kUnknownDrift_mps = 1e-4 / 3 * kSpeedOfLight;
/// Innovations beyond this many standard deviations are rejected.
constexpr double kGateSigmas = 4;

void look_around(FilterEpoch& epoch, const Eigen::Vector3d& position, const FixOptions& fix,
                 const std::map<System, gnss::Klobuchar>& klobuchar) {
  double sum = 0;
  int above = 0;
  for (RangedSatellite& satellite : epoch.satellites)
    for (int i = 0; i < 3; ++i) update_satellite_geometry(satellite, position);
  look_up(epoch.satellites, position, epoch.time, fix, klobuchar);
  for (const RangedSatellite& satellite : epoch.satellites) {
    if (!satellite.above_mask) continue;
    sum += satellite.measured->sigma_m * satellite.measured->sigma_m;
    ++above;
  }
  if (fix.weights.weighting != Weighting::Equal) return;
  for (RangedSatellite& satellite : epoch.satellites) satellite.sigma_m = std::sqrt(sum / std::max(above, 1));
}

/// Counts of Dopplers, of satellites with an accepted pseudorange.
struct Dopplers {
  int considered = 0, taken = 0;
};
/// @param without excluded satellites
Dopplers take_dopplers(const FilterState& filter, const FilterEpoch& epoch, double gate_sigmas,
                       Update& update, std::span<const gnss::SatelliteId> without = {}) {
  Dopplers count;
  for (const FilterEpoch::Candidate& candidate : epoch.candidates) {
    const std::size_t i = candidate.index;
    const Measurement& measured = *epoch.satellites[i].measured;
    if (!epoch.passed[i] || !measured.doppler_hz) continue;
    if (std::find(without.begin(), without.end(), measured.id) != without.end()) continue;
    ++count.considered;
    if (update.take(doppler_row(filter, epoch.satellites[i]), gate_sigmas)) ++count.taken;
  }
  return count;
}

/// If most Dopplers contradict the predicted velocity and agree on another one, they are right: the vehicle
/// turned or braked unexpectedly.
void take_motion(const FilterState& filter, FilterEpoch& epoch, Update& update) {
  FilterState& rotated = epoch.rotated = filter;
  Update other(rotated, epoch.accepted_if_rotated, update);
  const Dopplers expected = take_dopplers(filter, epoch, kGateSigmas, update);
  if (2 * expected.taken >= expected.considered) return;
  rotated.p.block<3, 3>(kVelocity, kVelocity) += unknown_velocity(rotated.position());
  rotated.reported_covariance.block<3, 3>(kVelocity, kVelocity) += unknown_velocity(rotated.position());
  const Dopplers agreed = take_dopplers(rotated, epoch, kGateSigmas, other);
  // Any four determine a velocity and a drift.
  if (agreed.taken > 4 && 2 * agreed.taken > agreed.considered) update.adopt(other);
}

/// Root of a fix's excess_variance().
double excess_of_residuals(const FilterEpoch& epoch, const Fix& fix, const FixOptions& options) {
  if (!options.covariance_by_residuals || fix.residuals_m.size() != fix.used.size()) return 1;
  double squares = 0;
  for (const RangedSatellite& satellite : epoch.satellites)
    if (const auto m = residual_m(fix, satellite.measured->id))
      squares += std::pow(*m / satellite.sigma_m, 2);
  return std::sqrt(excess_variance(squares, static_cast<int>(fix.used.size()) - fix.unknowns));
}

/// excess_variance() of the residuals at the filter's position, of all satellites above the masks.
double excess_of_innovations(const FilterState& filter, const FilterEpoch& epoch) {
  // Farther beyond the gate it has no more information on the position, which the satellite does not move.
  const double max_sigmas = 2 * kGateSigmas;
  double squares = 0;
  int count = 0;
  std::array<bool, kConstellations.size()> clock{};
  for (RangedSatellite satellite : epoch.satellites) {
    if (!satellite.above_mask) continue;
    update_satellite_geometry(satellite, filter.position());
    const FilterRow row = pseudorange_row(filter, satellite);
    squares += std::pow(std::min(std::abs(row.innovation) / (row.sigma * row.fraction), max_sigmas), 2);
    ++count;
    clock[clock_index(satellite.measured->id.system)] = true;
  }
  const auto redundancy = count - 3 - std::count(clock.begin(), clock.end(), true);
  return excess_variance(squares, redundancy);
}

/// A filter with the information of the fix's satellites, correlations included: their measurements applied
/// at the fix's position, from (nearly) no information. Empty if they are not among the measurements.
std::optional<FilterState> begin(FilterEpoch& epoch, const Fix& fix, const FixOptions& options,
                                 const PositionFilterOptions& filter_options,
                                 const std::map<System, gnss::Klobuchar>& klobuchar) {
  look_around(epoch, fix.position_ecef, options, klobuchar);
  const Eigen::Matrix3d ecef_from_enu = geodesy::enu_from_ecef_rotation(fix.position).transpose();
  FilterState filter;
  filter.time = filter.measured = epoch.time;
  filter.x.segment<3>(kPosition) = fix.position_ecef;
  filter.p.block<3, 3>(kPosition, kPosition).diagonal().setConstant(kUnknown_m * kUnknown_m);
  if (fix.velocity_enu_mps) filter.x.segment<3>(kVelocity) = ecef_from_enu * *fix.velocity_enu_mps;
  filter.p.block<3, 3>(kVelocity, kVelocity) = unknown_velocity(fix.position_ecef);
  filter.x(kDrift) = fix.clock_drift.value_or(0) * kSpeedOfLight;
  filter.p(kDrift, kDrift) = kUnknownDrift_mps * kUnknownDrift_mps;
  for (const auto& [system, bias_s] : fix.clock_bias_s) {
    filter.known[clock_index(system)] = true;
    filter.x(clock_of(system)) = bias_s * kSpeedOfLight;
    filter.p(clock_of(system), clock_of(system)) = kUnknown_m * kUnknown_m;
  }
  filter.reported_covariance = filter.p;
  Update update(filter, epoch.taken);
  epoch.passed.assign(epoch.satellites.size(), false);
  epoch.candidates.clear();
  const double excess = excess_of_residuals(epoch, fix, options);
  int taken = 0;
  for (std::size_t i = 0; i < epoch.satellites.size(); ++i) {
    const gnss::SatelliteId id = epoch.satellites[i].measured->id;
    if (!filter.knows(id.system) || !std::binary_search(fix.used.begin(), fix.used.end(), id)) continue;
    FilterRow row = pseudorange_row(filter, epoch.satellites[i]);
    row.sigma *= excess;
    epoch.passed[i] = update.take(row, std::numeric_limits<double>::infinity());
    epoch.candidates.push_back({i, row});
    ++taken;
  }
  if (taken < 4) return std::nullopt;
  take_dopplers(filter, epoch, std::numeric_limits<double>::infinity(), update, fix.excluded);
  update.finish();
  report_accuracy(filter, epoch.taken, 1, filter_options);
  return filter;
}

/// Stores the instant since which most of `considered` fail; true if that is `limit_s` ago.
bool astray(std::optional<geodesy::GpsTime>& since, geodesy::GpsTime now, int failed, int considered,
            double limit_s) {
  if (2 * failed <= considered) {
    since.reset();
    return false;
  }
  if (!since) since = now;
  return now - *since >= limit_s;
}

/// Applies one epoch's measurements at the predicted position; returns false if the filter is wrong.
bool correct(FilterState& filter, CodeClock& own, FilterEpoch& epoch, double dt,
             const PositionFilterOptions& options, bool by_residuals) {
  update_clocks(filter, own, epoch, dt);
  using Candidate = FilterEpoch::Candidate;
  std::vector<Candidate>& candidates = epoch.candidates;
  candidates.clear();
  epoch.innovations.clear();
  for (std::size_t i = 0; i < epoch.satellites.size(); ++i) {
    if (!epoch.satellites[i].above_mask) continue;
    candidates.push_back({i, pseudorange_row(filter, epoch.satellites[i])});
    epoch.innovations.push_back(candidates.back().row.innovation);
  }
  epoch.passed.assign(epoch.satellites.size(), false);
  if (candidates.empty()) return true;
  const double middle = upper_median(epoch.innovations);
  std::sort(candidates.begin(), candidates.end(), [middle](const Candidate& a, const Candidate& b) {
    return std::pair(std::abs(a.row.innovation - middle), a.index) <
           std::pair(std::abs(b.row.innovation - middle), b.index);
  });
  Update update(filter, epoch.taken);
  std::array<int, kConstellations.size()> considered{};
  std::array<int, kConstellations.size()> failed{};
  for (const Candidate& candidate : candidates) {
    const std::size_t system = clock_index(epoch.satellites[candidate.index].measured->id.system);
    ++considered[system];
    epoch.passed[candidate.index] = update.take(candidate.row, kGateSigmas);
    if (epoch.passed[candidate.index])
      filter.measured = epoch.time;
    else
      ++failed[system];
  }
  take_motion(filter, epoch, update);
  update.finish();
  report_accuracy(filter, epoch.taken, by_residuals ? excess_of_innovations(filter, epoch) : 1, options);
  int all_considered = 0;
  int all_failed = 0;
  for (std::size_t system = 0; system < kConstellations.size(); ++system) {
    all_considered += considered[system];
    all_failed += failed[system];
    // The first satellites of a constellation can give a wrong clock: it is then estimated again. A lone
    // satellite determines nothing else.
    if (considered[system] >= 2 && astray(filter.system_astray_since[system], epoch.time, failed[system],
                                          considered[system], options.coast_s)) {
      filter.known[system] = false;
      filter.x(kClock + static_cast<int>(system)) = 0;
      filter.system_astray_since[system].reset();
    }
  }
  return !astray(filter.astray_since, epoch.time, all_failed, all_considered, options.coast_s);
}

/// excess_variance() of the Dopplers at the filter's velocity, of all satellites above the masks.
double excess_of_dopplers(const FilterState& filter, const FilterEpoch& epoch) {
  constexpr double kMaxSigmas = 8;
  double squares = 0;
  int count = 0;
  for (const RangedSatellite& satellite : epoch.satellites) {
    if (!satellite.above_mask || !satellite.measured->doppler_hz) continue;
    const FilterRow row = doppler_row(filter, satellite);
    squares += std::pow(std::min(std::abs(row.innovation) / row.sigma, kMaxSigmas), 2);
    ++count;
  }
  return excess_variance(squares, count - 4);
}

/// Returns false at an impossible position.
bool somewhere(const FilterState& filter) {
  if (!filter.x.allFinite()) return false;
  const double height = geodesy::geodetic_from_ecef(filter.position()).height_m;
  return is_near_ground(height);
}

bool accurate(const FilterState& filter, const PositionFilterOptions& options) {
  return std::sqrt(filter.reported_covariance.block<3, 3>(kPosition, kPosition).trace()) <=
         options.max_sigma_m;
}

/// Design matrix of the satellites whose `is_in` is true: east, north, up, and a clock for each constellation
/// in the order of its first satellite.
template <typename IsIn>
Design design_of(const FilterEpoch& epoch, const Eigen::Matrix3d& enu_from_ecef, const IsIn& is_in) {
  std::array<int, kConstellations.size()> column{};
  int clocks = 0;
  Eigen::Index rows = 0;
  Design design = Design::Zero(static_cast<Eigen::Index>(epoch.satellites.size()), 3 + column.size());
  for (std::size_t i = 0; i < epoch.satellites.size(); ++i) {
    if (!is_in(i)) continue;
    const RangedSatellite& satellite = epoch.satellites[i];
    int& each = column[clock_index(satellite.measured->id.system)];
    if (each == 0) each = 3 + clocks++;
    design.row(rows).head<3>() = -(enu_from_ecef * satellite.direction).transpose();
    design(rows++, each) = 1;
  }
  design.conservativeResize(rows, 3 + clocks);
  return design;
}

/// Motion of a fix of the satellites above the mask [m], ENU, if the ionosphere's delays are wrong by the
/// fraction that models leave, equally on all. 0 if they have none or the geometry is rank-deficient.
Eigen::Vector3d moved_by_ionosphere(const FilterEpoch& epoch, const Eigen::Matrix3d& enu_from_ecef) {
  Design design =
      design_of(epoch, enu_from_ecef, [&](std::size_t i) { return epoch.satellites[i].above_mask; });
  Rows delays(design.rows());
  Eigen::Index row = 0;
  for (const RangedSatellite& satellite : epoch.satellites) {
    if (!satellite.above_mask) continue;
    design.row(row) /= satellite.sigma_m;
    delays(row++) = satellite.ionosphere_m / satellite.sigma_m;
  }
  if ((delays.array() == 0).all()) return Eigen::Vector3d::Zero();
  const LeastSquares least_squares(design);
  if (least_squares.rank(kRankThreshold) < design.cols()) return Eigen::Vector3d::Zero();
  return kIonosphereLeft * least_squares.solve(delays).head<3>();
}

void add_geometry(Fix& fix, const FilterState& filter, const FilterEpoch& epoch,
                  const Eigen::Matrix3d& enu_from_ecef) {
  fix.unknowns = 4;
  if (fix.used.empty()) return;
  fix.residuals_m.reserve(fix.used.size());
  for (std::size_t i = 0; i < epoch.satellites.size(); ++i)
    if (epoch.passed[i]) fix.residuals_m.push_back(pseudorange_row(filter, epoch.satellites[i]).innovation);
  const LeastSquares least_squares(
      design_of(epoch, enu_from_ecef, [&](std::size_t i) { return epoch.passed[i]; }));
  fix.unknowns = static_cast<int>(least_squares.unknowns());
  fix.rank = static_cast<int>(least_squares.rank(kRankThreshold));
  if (fix.rank == fix.unknowns) fix.dop = dop_from_cofactor(least_squares.cofactor());
}

/// @param of least squares, of the same measurements
/// Updates the satellites' geometry for the filter's position.
Fix describe(const FilterState& filter, FilterEpoch& epoch, const Fix& of, const FixOptions& options) {
  Fix fix;
  fix.status = FixStatus::Fix;
  fix.iterations = 1;
  fix.position_ecef = filter.position();
  fix.position = geodesy::geodetic_from_ecef(fix.position_ecef);
  const Eigen::Matrix3d enu_from_ecef = geodesy::enu_from_ecef_rotation(fix.position);
  fix.covariance_enu =
      geodesy::rotated(enu_from_ecef, filter.reported_covariance.block<3, 3>(kPosition, kPosition));
  fix.velocity_enu_mps = enu_from_ecef * filter.velocity();
  fix.velocity_covariance_enu = geodesy::rotated(enu_from_ecef, filter.p.block<3, 3>(kVelocity, kVelocity));
  fix.clock_drift = filter.x(kDrift) / kSpeedOfLight;
  for (const System system : kConstellations)
    if (filter.knows(system)) fix.clock_bias_s[system] = filter.x(clock_of(system)) / kSpeedOfLight;
  fix.used.reserve(epoch.satellites.size());
  for (std::size_t i = 0; i < epoch.satellites.size(); ++i) {
    if (!epoch.satellites[i].above_mask) continue;
    ++fix.available;
    (epoch.passed[i] ? fix.used : fix.excluded).push_back(epoch.satellites[i].measured->id);
  }
  if (of.solution != FixKind::Single && !fix.used.empty()) {
    fix.solution = FixKind::Differential;
    fix.correction_age_s = of.correction_age_s;
    fix.correction_station = of.correction_station;
  }
  if (options.covariance_by_residuals) *fix.velocity_covariance_enu *= excess_of_dopplers(filter, epoch);
  for (RangedSatellite& satellite : epoch.satellites) update_satellite_geometry(satellite, fix.position_ecef);
  if (options.covariance_by_residuals) {
    const Eigen::Vector3d moved = moved_by_ionosphere(epoch, enu_from_ecef);
    fix.covariance_enu += moved * moved.transpose();
  }
  add_geometry(fix, filter, epoch, enu_from_ecef);
  return fix;
}

}  // namespace

struct PositionFilter::State {
  PositionFilterOptions options;
  FixOptions fix;
  std::optional<FilterState> filter;
  CodeClock code_clock;  ///< of the receiver: it outlives a filter
};

PositionFilter::PositionFilter(const PositionFilterOptions& options, const FixOptions& fix)
    : state_(std::make_unique<State>(State{options, fix, std::nullopt, {}})) {
  options.validate();
  fix.validate();
}
PositionFilter::~PositionFilter() = default;
PositionFilter::PositionFilter(PositionFilter&&) noexcept = default;
PositionFilter& PositionFilter::operator=(PositionFilter&&) noexcept = default;

Fix PositionFilter::update(geodesy::GpsTime receiver_time, const std::vector<Measurement>& measurements,
                           const orbit::Sky& sky, const Fix& fix,
                           const std::map<System, gnss::Klobuchar>& klobuchar) {
  std::vector<RangedSatellite> satellites;
  range_satellites(receiver_time, measurements, sky, state_->fix, satellites);
  return update(receiver_time, satellites, fix, klobuchar);
}

Fix PositionFilter::update(geodesy::GpsTime receiver_time, const std::vector<RangedSatellite>& satellites,
                           const Fix& fix, const std::map<System, gnss::Klobuchar>& klobuchar) {
  const PositionFilterOptions& options = state_->options;
  static thread_local FilterEpoch epoch;  // memory of both kept by each thread, for all receivers
  static thread_local std::optional<FilterState> filter;
  epoch.time = receiver_time;
  epoch.satellites = satellites;
  filter = state_->filter;
  bool lost = !filter;
  if (filter) {
    const double dt = receiver_time - filter->time;
    if (dt < 0) {
      throw InputError(fmt::format("the position filter cannot step back by {} s", -dt),
                       "give epochs in order of time");
    }
    if (receiver_time - filter->measured > options.coast_s) {
      filter.reset();
      lost = true;
    } else {
      predict(*filter, dt, options);
      filter->time = receiver_time;
      look_around(epoch, filter->position(), state_->fix, klobuchar);
      lost = !correct(*filter, state_->code_clock, epoch, dt, options, state_->fix.covariance_by_residuals);
      if (!somewhere(*filter)) {
        filter.reset();
        lost = true;
      }
    }
  }
  if (lost && fix.solved()) {
    FilterEpoch fresh;
    fresh.time = receiver_time;
    fresh.satellites = satellites;
    const std::optional<FilterState> restarted = begin(fresh, fix, state_->fix, options, klobuchar);
    if (restarted && accurate(*restarted, options)) {
      state_->filter = restarted;
      state_->code_clock.of.reset();
      Fix result = describe(*restarted, fresh, fix, state_->fix);
      result.excluded = fix.excluded;
      return result;
    }
  }
  std::swap(state_->filter, filter);
  if (const auto& now = state_->filter; now && accurate(*now, options))
    return describe(*now, epoch, fix, state_->fix);
  if (!state_->filter && std::isinf(options.max_sigma_m)) return fix;
  Fix none;
  none.status = fix.solved() || state_->filter ? FixStatus::WeakGeometry : fix.status;
  none.available = fix.available;
  none.unknowns = fix.unknowns;
  none.rank = fix.rank;
  return none;
}

}  // namespace canyon::positioning
