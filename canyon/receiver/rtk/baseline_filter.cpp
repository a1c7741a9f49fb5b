#include "canyon/receiver/rtk/baseline_filter.hpp"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/statistics.hpp"
#include "canyon/receiver/positioning/least_squares.hpp"

namespace canyon::rtk {

namespace {

using Eigen::Index;
using positioning::Fix;
using positioning::FixKind;

/// A priori deviation [m].
constexpr double kUnknownPosition_m = 30;
constexpr double kUnknownClock_m = 100, kUnknownAmbiguity_m = 30;
/// Echoes shift phases of a direct signal by at most a quarter of a cycle.
constexpr double kMinSlip_cycles = 0.3;
/// Weight of an epoch in the mean square of innovations.
constexpr double kSquaresWeight = 0.1;
/// Errors of codes are constant for this time [s]: more epochs in it add no information.
constexpr double kCodeTime_s = 1;

/// A position with a larger deviation [m] restarts from a fix.
constexpr double kLostPosition_m = 100;
/// A phase not measured for this time has slipped [s]; at longer epochs, one missing at the last epoch.
constexpr double kPhaseGap_s = 5, kPhaseGap_epochs = 1.5;
/// Clocks of receivers differ by milliseconds [s].
constexpr double kAhead_s = 1;
/// A moving base must have measured at the rover's epoch [s].
constexpr double kSameEpoch_s = 0.02;
/// Two carriers of a satellite diverge by more than this [m] only if one of them slips.
constexpr double kCarriersPart_m = 0.05;
/// Delays are estimated over baselines from these lengths on [m].
constexpr double kIonosphereFrom_m = 1e3, kTroposphereFrom_m = 5e3;
/// Time constants of the delays [s].
constexpr double kIonosphereTime_s = 1200, kTroposphereTime_s = 7200;
/// Correlation time of echoes at a moving antenna [s].
constexpr double kEchoTime_s = 10;
/// Spectral densities of the filter's white accelerations [m/s^2/sqrt(Hz)].
constexpr double kAccelerationHorizontal = 3.16, kAccelerationVertical = 1;
/// Deviation of a phase [m]: sigma^2 = a^2 (1 + 1 / sin(elevation)^2 + 10^((45 - C/N0) / 10)): RTKLIB's
/// stats-errphase and stats-errphaseel.
constexpr double kPhaseSigma_m = 0.003;
/// Weight of an epoch in means of squared residuals at fixed integers.
constexpr double kFixedWeight = 0.1;
/// The mean square of an epoch's residuals is divided by at least this number.
constexpr int kFewRedundant = 5;
/// Deviation of a code over that of its phase: RTKLIB's stats-eratio1.
constexpr double kCodeRatio = 100;
/// Innovations beyond this many standard deviations: a code is rejected, a phase has slipped.
constexpr double kGateSigmas = 4;

/// The base's observation of the same signal. If it is missing or has no phase, that of another component on
/// that carrier, whose phase files and RTCM align (RINEX 3.04, 5.2.16), unless the rover has that component
/// as well. Null if there is none.
const ObservedMinusComputed* partner(const ObservedMinusComputed& r,
                                     std::span<const ObservedMinusComputed> rover,
                                     std::span<const ObservedMinusComputed> base) {
  const auto at = std::lower_bound(base.begin(), base.end(), r, before);
  const ObservedMinusComputed* const same = at != base.end() && !before(r, *at) ? &*at : nullptr;
  if (same != nullptr && (same->phase_m || !r.phase_m)) return same;
  const auto is_same_carrier = [&](const ObservedMinusComputed& o) {
    return o.id == r.id && o.signal->carrier_hz == r.signal->carrier_hz && o.phase_m;
  };
  // A carrier's phase counts once.
  const bool several = std::count_if(rover.begin(), rover.end(), is_same_carrier) > 1;
  const auto other = std::find_if(base.begin(), base.end(), is_same_carrier);
  return several || other == base.end() ? same : &*other;
}

/// Differences of all signals measured by both receivers; they refer to `rover`. `base` is in the order of
/// before().
/// @param age_s of the base's epoch
std::vector<Difference> differences_of(std::span<const ObservedMinusComputed> rover,
                                       std::span<const ObservedMinusComputed> base, double age_s) {
  std::vector<Difference> differences;
  for (const ObservedMinusComputed& r : rover) {
    const ObservedMinusComputed* const b = partner(r, rover, base);
    if (b == nullptr) continue;
    Difference d;
    d.rover = &r;
    d.code_m = r.code_m - b->code_m;
    d.has_phase = r.phase_m && b->phase_m;
    if (d.has_phase) d.phase_m = *r.phase_m - *b->phase_m;
    d.variance = kPhaseSigma_m * kPhaseSigma_m * (r.variance + b->variance);
    d.age_variance = std::pow(kAgeing_mps * age_s, 2);
    d.base_since = b->phase_since;
    d.half_cycle = r.half_cycle || b->half_cycle;
    d.aligned = r.aligned && b->aligned;
    differences.push_back(d);
  }
  return differences;
}

/// Without signals of only one satellite, which determine nothing but their clock.
Groups groups_of(const std::vector<Difference>& differences) {
  Groups groups;
  for (std::size_t i = 0; i < differences.size(); ++i) groups[differences[i].rover->signal].push_back(i);
  for (auto group = groups.begin(); group != groups.end();)
    group = group->second.size() < 2 ? groups.erase(group) : std::next(group);
  return groups;
}

}  // namespace

BaselineFilter::BaselineFilter(const RtkOptions& options, const positioning::FixOptions& masks,
                               double max_age_s)
    : options_(options), masks_(masks), max_age_s_(max_age_s) {
  options::check(options_, "rtk");
  masks_.correct_troposphere = true;
  masks_.correct_ionosphere = false;  // it is equal at both, or a state
}

bool BaselineFilter::go_to(geodesy::GpsTime to, const Fix& alone) {
  if (started_ && !(to > time_)) started_ = false;
  if (started_) {
    dt_s_ = to - time_;
    const Eigen::Matrix3d enu = geodesy::enu_from_ecef_rotation(geodesy::geodetic_from_ecef(position_));
    const double h = std::pow(kAccelerationHorizontal, 2);
    const double v = std::pow(kAccelerationVertical, 2);
    state_.move(dt_s_, geodesy::rotated(enu.transpose(), Eigen::Vector3d(h, h, v).asDiagonal()));
    for (std::size_t i = 0; i < state_.slots.size(); ++i) {
      const Index at = BaselineState::index(i);
      if (state_.slots[i].signal != nullptr)
        state_.p(at, at) += 1e-8 * dt_s_;  // phase wind-up, delays of the hardware [cycles^2]
      else
        decay(at, kIonosphereTime_s, state_.slots[i].id);
    }
    if (state_.p(BaselineState::kZenith, BaselineState::kZenith) > 0)
      decay(BaselineState::kZenith, kTroposphereTime_s, std::nullopt);
    apply_position_error();
    if (astray_) started_ = false;
  }
  time_ = to;
  const bool lost = started_ && state_.p.topLeftCorner<3, 3>().trace() > kLostPosition_m * kLostPosition_m;
  begins_ = !started_ || lost;
  if (!begins_) return true;
  if (!alone.solved() && !moving_) return false;
  if (!started_) {
    state_ = BaselineState();
    started_ = true;
    astray_ = false;
    dt_s_ = 0;
    // The sizes of echoes are kept.
    fixed_in_a_row_ = 0;
  }
  // If epochs are half a minute apart the position is new each time, and the ambiguities remain.
  position_ = moving_ ? base_position_ : alone.position_ecef;
  for (Index i = 0; i < 3; ++i) {
    state_.reset(BaselineState::kPosition + i, 0, kUnknownPosition_m * kUnknownPosition_m);
    state_.reset(BaselineState::kVelocity + i, 0, kUnknownPosition_m * kUnknownPosition_m);
  }
  return true;
}

void BaselineFilter::decay(Index at, double time_s, std::optional<gnss::SatelliteId> of) {
  const double keeps = std::exp(-dt_s_ / time_s);
  const double sigma = of ? ionosphere_sigma_m_ : troposphere_sigma_m_;
  state_.x(at) *= keeps;
  state_.p.row(at) *= keeps;
  state_.p.col(at) *= keeps;
  state_.p(at, at) += sigma * sigma * (1 - keeps * keeps);
}

void BaselineFilter::remove_slipped() {
  for (std::size_t i = state_.slots.size(); i-- > 0;) {
    const BaselineSlot& slot = state_.slots[i];
    const bool ambiguity = slot.signal != nullptr;
    const bool forgotten = ambiguity && options_.integers == Integers::Instantaneous;
    const double longest_s = ambiguity ? std::max(kPhaseGap_s, kPhaseGap_epochs * dt_s_) : kIonosphereTime_s;
    if (forgotten || time_ - slot.seen > longest_s) state_.remove(i);
  }
  // Slips are detected by the channels, by half cycles and by Doppler.
  for (Difference& d : differences_) {
    if (!d.has_phase) continue;
    const auto slot = state_.find(d.id(), d.rover->signal);
    if (!slot) continue;
    const BaselineSlot& s = state_.slots[*slot];
    const bool slips = s.rover_since != d.rover->phase_since || s.base_since != d.base_since ||
                       s.half_cycle != d.half_cycle || doppler_slips_.contains(d.id(), d.rover->signal);
    if (slips) state_.remove(*slot);
  }
}

void BaselineFilter::compare_carriers() {
  for (std::size_t i = 0; i < differences_.size(); ++i) {
    const Difference& a = differences_[i];
    for (std::size_t j = i + 1; j < differences_.size() && differences_[j].id() == a.id(); ++j) {
      const Difference& b = differences_[j];
      if (!a.has_phase || !b.has_phase) continue;
      const auto first = state_.find(a.id(), a.rover->signal), second = state_.find(b.id(), b.rover->signal);
      if (!first || !second) continue;
      const double before_m = state_.slots[*first].phase_m - state_.slots[*second].phase_m;
      if (std::abs(a.phase_m - b.phase_m - before_m) < kCarriersPart_m) continue;
      state_.remove(std::max(*first, *second));
      state_.remove(std::min(*first, *second));
    }
  }
}

void BaselineFilter::update_delays() {
  const double baseline_m = (position_ - base_position_).norm();
  ionosphere_sigma_m_ =
      baseline_m < kIonosphereFrom_m ? 0 : std::max(1e-3, options_.ionosphere_gradient * baseline_m);
  const double height_m = std::abs(geodesy::geodetic_from_ecef(position_).height_m -
                                   geodesy::geodetic_from_ecef(base_position_).height_m);
  troposphere_sigma_m_ = baseline_m < kTroposphereFrom_m && height_m < 200
                             ? 0
                             : options_.troposphere_gradient * baseline_m + 1e-5 * height_m;
  if (options_.ionosphere_gradient == 0) ionosphere_sigma_m_ = 0;
  constexpr Index zenith = BaselineState::kZenith;
  if (troposphere_sigma_m_ > 0 && state_.p(zenith, zenith) == 0)
    state_.reset(zenith, 0, troposphere_sigma_m_ * troposphere_sigma_m_);
  if (ionosphere_sigma_m_ == 0) return;
  for (const Difference& d : differences_) {
    const auto slot = state_.find(d.id(), nullptr);
    if (slot) {
      state_.slots[*slot].seen = time_;
      continue;
    }
    // The obliquity factor of a thin layer at a height of 350 km.
    const double s = 6371.0 / (6371.0 + 350.0) * std::cos(d.rover->elevation_rad);
    const double sigma = ionosphere_sigma_m_ * (1 / std::sqrt(1 - s * s));
    state_.add({d.id(), nullptr, time_, time_, {}, {}, false, 0, 0}, 0, sigma * sigma);
  }
}

double BaselineFilter::factor_of(const AmbiguitySolution& fixed) {
  fixed_squares_ += kFixedWeight * (fixed.squares - fixed_squares_);
  fixed_redundant_ += kFixedWeight * (std::max(0, fixed.redundant) - fixed_redundant_);
  if (!moving_ || ionosphere_sigma_m_ > 0) return std::max(1.0, squares_);
  const double lately = (1 + fixed_squares_ / kFixedWeight) / (1 + fixed_redundant_ / kFixedWeight);
  return std::max(lately, fixed.squares / std::max(kFewRedundant, fixed.redundant));
}

Eigen::Matrix3d BaselineFilter::covariance_of_echoes() const {
  std::vector<double> ages_s;
  for (const Difference& d : differences_)
    if (d.used) ages_s.push_back(time_ - state_.slots[*d.slot].started);
  const double age_s = ages_s.empty() ? 0 : upper_median(ages_s);
  return code_squares_ * kEchoTime_s / (kEchoTime_s + age_s) * code_covariance_;
}

std::optional<positioning::Dop> BaselineFilter::dop_of(const std::vector<gnss::SatelliteId>& used,
                                                       const Eigen::Matrix3d& enu) const {
  std::vector<Eigen::Vector3d> directions;
  for (std::size_t i = 0; i < differences_.size(); ++i) {
    const bool first = i == 0 || differences_[i - 1].id() != differences_[i].id();
    if (first && std::binary_search(used.begin(), used.end(), differences_[i].id()))
      directions.emplace_back(enu * differences_[i].rover->direction);
  }
  return positioning::dop_of_directions(directions);
}

void BaselineFilter::take(const Corrections& corrections,
                          std::vector<ObservedMinusComputed> base_measurements) {
  base_ = std::move(base_measurements);
  // With a moving base the filter tracks the baseline: the position moves with the base's.
  if (started_ && corrections.moving) position_ += corrections.station_ecef - base_position_;
  if (corrections.moving != moving_ || (station_ && *station_ != corrections.station)) started_ = false;
  moving_ = corrections.moving;
  base_position_ = corrections.station_ecef;
  station_ = corrections.station;
  base_time_ = corrections.receiver_time;
}

void BaselineFilter::state_answer(const std::optional<AmbiguitySolution>& fixed, double age_s, Fix& fix) {
  const bool is_fixed = fixed && fixed->accepted;
  fix.status = positioning::FixStatus::Fix;
  fix.solution = is_fixed ? FixKind::Fixed : FixKind::Float;
  fix.correction_age_s = age_s;
  fix.correction_station = station_;
  const Eigen::Vector3d error =
      is_fixed ? fixed->position_error : state_.x.segment<3>(BaselineState::kPosition);
  const Eigen::Matrix3d covariance = is_fixed ? fixed->covariance : state_.p.topLeftCorner<3, 3>();
  fix.position_ecef = position_ + error;
  fix.position = geodesy::geodetic_from_ecef(fix.position_ecef);
  const Eigen::Matrix3d enu = geodesy::enu_from_ecef_rotation(fix.position);
  fix.covariance_enu = geodesy::rotated(enu, is_fixed ? covariance : covariance + covariance_of_echoes());
  fix.covariance_enu *= is_fixed ? factor_of(*fixed) : std::max(1.0, squares_);
  positioning::Baseline& baseline = fix.baseline.emplace();
  baseline.kind = fix.solution;
  baseline.moving_base = moving_;
  baseline.base_ecef = base_position_;
  baseline.vector_enu = enu * (fix.position_ecef - base_position_);
  baseline.covariance_enu = fix.covariance_enu;
  if (fixed && fixed->ratio > 0) baseline.ratio = fixed->ratio;
  baseline.used = fix.used;
  if (!moving_) {
    fix.velocity_enu_mps = enu * state_.x.segment<3>(BaselineState::kVelocity);
    fix.velocity_covariance_enu =
        geodesy::rotated(enu, state_.p.block<3, 3>(BaselineState::kVelocity, BaselineState::kVelocity));
  }
  fix.dop = dop_of(fix.used, enu);
  fix.consistent.reset();
}

std::optional<Fix> BaselineFilter::update(geodesy::GpsTime receiver_time,
                                          std::span<const SignalMeasurement> rover, const orbit::Sky& sky,
                                          const Fix& alone) {
  if (base_.empty()) return std::nullopt;
  const double age_s = receiver_time - base_time_;
  if (age_s > (moving_ ? kSameEpoch_s : max_age_s_) || age_s < -kAhead_s) return std::nullopt;
  if (!go_to(receiver_time, alone)) return std::nullopt;
  if (begins_) {
    // A fix without phases has a height error, so its troposphere is wrong: repeats from the result.
    BaselineFilter first = *this;
    if (const auto near = first.solve(receiver_time, rover, sky, alone)) position_ = near->position_ecef;
  }
  return solve(receiver_time, rover, sky, alone);
}

std::optional<Fix> BaselineFilter::solve(geodesy::GpsTime receiver_time,
                                         std::span<const SignalMeasurement> rover, const orbit::Sky& sky,
                                         const Fix& alone) {
  const double age_s = receiver_time - base_time_;
  const auto computed = observed_minus_computed(receiver_time, rover, sky, masks_, position_);
  differences_ = differences_of(computed, base_, std::max(age_s, 0.0));
  groups_ = groups_of(differences_);
  doppler_slips_.update(dt_s_, computed, rover);
  remove_slipped();
  compare_carriers();
  update_delays();
  if (!moving_) take_velocity(alone);
  take_codes();
  take_phases();

  Fix fix = alone;
  fix.used.clear();
  fix.residuals_m.clear();
  // Keeps only satellites whose Doppler was excluded.
  std::erase_if(fix.excluded, [&alone](gnss::SatelliteId id) {
    return !std::binary_search(alone.used.begin(), alone.used.end(), id);
  });
  for (const Difference& d : differences_) {
    if (!d.used || (!fix.used.empty() && fix.used.back() == d.id())) continue;
    fix.used.push_back(d.id());
    fix.residuals_m.push_back(d.residual_m);
  }
  if (fix.used.size() < 4) {
    fixed_in_a_row_ = 0;
    return std::nullopt;
  }
  // Additional covariance of the position by echoes, beyond the noise of codes.
  const Eigen::Matrix3d echoes = (1 - 1 / code_squares_) * covariance_of_echoes();
  const auto fixed =
      AmbiguitySearch(options_, state_, differences_, echoes, has_ionosphere(), fixed_in_a_row_).find();
  fixed_in_a_row_ = fixed && fixed->accepted ? fixed_in_a_row_ + 1 : 0;
  state_answer(fixed, std::max(age_s, 0.0), fix);
  apply_position_error();
  return fix;
}

std::vector<std::size_t> BaselineFilter::ordered(const std::vector<std::size_t>& group, bool phase) {
  state_.reset(BaselineState::kClock, 0, 0);
  std::vector<std::pair<double, std::size_t>> innovations;
  std::vector<double> values;
  for (const std::size_t i : group) {
    const Difference& d = differences_[i];
    if (phase && !d.slot) continue;
    const double value = phase ? d.phase_m : d.code_m;
    innovations.emplace_back(state_.innovation(state_.row_of(d, phase, has_ionosphere()), value, 0).value, i);
    values.push_back(innovations.back().first);
  }
  if (innovations.size() < 2) return {};
  const double middle = upper_median(values);
  for (auto& [innovation, i] : innovations) innovation = std::abs(innovation - middle);
  std::sort(innovations.begin(), innovations.end());
  state_.reset(BaselineState::kClock, middle, kUnknownClock_m * kUnknownClock_m);
  std::vector<std::size_t> order;
  order.reserve(innovations.size());
  for (const auto& [innovation, i] : innovations) order.push_back(i);
  return order;
}

void BaselineFilter::take_codes() {
  int considered = 0, failed = 0;
  double sum = 0;
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  const double repeats = dt_s_ > 0 ? std::max(1.0, kCodeTime_s / dt_s_) : 1;
  for (const auto& [signal, group] : groups_) {
    Eigen::Matrix3d squares_of = Eigen::Matrix3d::Zero();
    Eigen::Vector3d sum_of = Eigen::Vector3d::Zero();
    double weights = 0;
    for (const std::size_t i : ordered(group, false)) {
      const Difference& d = differences_[i];
      const SparseRow row = state_.row_of(d, false, has_ionosphere());
      const double noise = d.variance * kCodeRatio * kCodeRatio + d.age_variance;
      const double normalised = std::abs(state_.innovation(row, d.code_m, noise).normalised());
      ++considered;
      sum += std::min(normalised * normalised, 25.0);
      if (normalised > kGateSigmas) {
        ++failed;
        continue;
      }
      state_.take(row, d.code_m, repeats * noise);
      const Eigen::Vector3d& e = d.rover->direction;
      weights += 1 / noise;
      sum_of += e / noise;
      squares_of += e * e.transpose() / noise;
    }
    if (weights > 0) information += squares_of - sum_of * sum_of.transpose() / weights;
  }
  state_.mirror();
  code_covariance_.setZero();
  if (information.determinant() > 1e-9) code_covariance_ = information.inverse();
  const auto redundant = considered - static_cast<int>(groups_.size()) - 3;
  if (redundant > 3) code_squares_ += kSquaresWeight * (std::max(1.0, sum / redundant) - code_squares_);
  if (2 * failed > considered && considered > 4) {
    if (!astray_since_) astray_since_ = time_;
    astray_ = time_ - *astray_since_ > 3;
  } else {
    astray_since_.reset();
    astray_ = false;
  }
}

double BaselineFilter::code_jump_m(const std::vector<std::size_t>& group) const {
  std::vector<double> jumps;
  for (const std::size_t i : group) {
    const Difference& d = differences_[i];
    if (!d.has_phase) continue;
    if (const auto slot = state_.find(d.id(), d.rover->signal))
      jumps.push_back(d.phase_m - d.code_m - d.rover->wavelength_m * state_.x(BaselineState::index(*slot)));
  }
  const double jump_m = jumps.empty() ? 0 : upper_median(jumps);
  return std::abs(jump_m) > kUnknownAmbiguity_m ? jump_m : 0;
}

void BaselineFilter::start_ambiguities(const std::vector<std::size_t>& group, double jump_m) {
  for (const std::size_t i : group) {
    Difference& d = differences_[i];
    if (!d.has_phase) continue;
    d.slot = state_.find(d.id(), d.rover->signal);
    if (d.slot) continue;
    const double cycles = (d.phase_m - d.code_m - jump_m) / d.rover->wavelength_m;
    d.slot = state_.add({d.id(), d.rover->signal, time_, time_, d.rover->phase_since, d.base_since,
                         d.half_cycle, 0, d.phase_m},
                        cycles, std::pow(kUnknownAmbiguity_m / d.rover->wavelength_m, 2));
  }
}

void BaselineFilter::take_phases() {
  double sum = 0;
  int count = 0;
  for (auto& [signal, group] : groups_) {
    const double jump_m = code_jump_m(group);
    start_ambiguities(group, jump_m);
    bool first = true;
    for (const std::size_t i : ordered(group, true)) {
      Difference& d = differences_[i];
      const SparseRow row = state_.row_of(d, true, has_ionosphere());
      double variance = d.variance + d.age_variance;
      const auto innovation = state_.innovation(row, d.phase_m, variance);
      const double normalised = std::abs(innovation.normalised());
      BaselineSlot& slot = state_.slots[*d.slot];
      const bool beyond = normalised > kGateSigmas;
      if (beyond && std::abs(innovation.value) > kMinSlip_cycles * d.rover->wavelength_m) {
        // A slip: its ambiguity restarts from this epoch's observations.
        state_.reset(BaselineState::index(*d.slot), (d.phase_m - d.code_m - jump_m) / d.rover->wavelength_m,
                     std::pow(kUnknownAmbiguity_m / d.rover->wavelength_m, 2));
        slot.started = time_;
        slot.epochs = 0;
        slot.whole.reset();
      } else if (beyond) {
        // An echo: reduces its weight by its misfit.
        variance += std::pow(innovation.value / kGateSigmas, 2);
      }
      d.trusted = !beyond;
      if (!first && slot.epochs > 0) {
        sum += std::min(normalised * normalised, 100.0);
        ++count;
      }
      first = false;
      state_.take(row, d.phase_m, variance);
      d.used = true;
      slot.seen = time_;
      slot.phase_m = d.phase_m;
      slot.rover_since = d.rover->phase_since;
      slot.base_since = d.base_since;
      ++slot.epochs;
    }
    for (const std::size_t i : group) {
      Difference& d = differences_[i];
      if (!d.used) continue;
      d.residual_m = state_.innovation(state_.row_of(d, true, has_ionosphere()), d.phase_m, 0).value;
    }
  }
  state_.mirror();
  if (count > 4) squares_ += kSquaresWeight * (sum / count - squares_);
}

void BaselineFilter::take_velocity(const Fix& alone) {
  if (!alone.velocity_enu_mps || !alone.velocity_covariance_enu) return;
  // At the filter's position: that fix need not have one.
  const Eigen::Matrix3d enu = geodesy::enu_from_ecef_rotation(geodesy::geodetic_from_ecef(position_));
  for (Index i = 0; i < 3; ++i) {
    SparseRow row;
    for (Index j = 0; j < 3; ++j) row.add(BaselineState::kVelocity + j, enu(i, j));
    const double variance = std::max((*alone.velocity_covariance_enu)(i, i), 1e-4);
    const double value = (*alone.velocity_enu_mps)(i);
    if (std::abs(state_.innovation(row, value, variance).normalised()) > kGateSigmas) continue;
    state_.take(row, value, variance);
  }
  state_.mirror();
}

}  // namespace canyon::rtk
