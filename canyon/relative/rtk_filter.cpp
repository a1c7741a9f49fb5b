#include "canyon/relative/rtk_filter.hpp"

#include <algorithm>
#include <cmath>
#include <utility>
#include <vector>

#include "canyon/geodesy/frames.hpp"
#include "canyon/positioning/filter_track.hpp"
#include "canyon/relative/rtk_filter_state.hpp"

namespace canyon::relative {
namespace {

using Eigen::Index;
using positioning::Fix;
using positioning::FixKind;

/// Before anything is known [m].
constexpr double kUnknownPosition_m = 30;
/// A position less certain than this [m] starts again from a fix.
constexpr double kLostPosition_m = 100;
/// A phase that was not measured for so long has slipped [s]; where epochs are farther apart, one that the
/// last epoch lacked.
constexpr double kPhaseGap_s = 5, kPhaseGap_epochs = 1.5;
/// Clocks of receivers differ by milliseconds [s].
constexpr double kAhead_s = 1;
/// A moving base must have measured at the rover's epoch [s].
constexpr double kSameEpoch_s = 0.02;
/// Two carriers of a satellite move apart by more than this [m] only where one of them slips.
constexpr double kCarriersPart_m = 0.05;
/// From these lengths of the baseline on, delays are estimated [m].
constexpr double kIonosphereFrom_m = 1e3, kTroposphereFrom_m = 5e3;
/// Time constants of the delays [s].
constexpr double kIonosphereTime_s = 1200, kTroposphereTime_s = 7200;
/// Echoes of a moving antenna last about so long [s].
constexpr double kEchoTime_s = 10;
/// The second filter starts again after so long, and replaces the first when it has been fixed for so many
/// epochs in a row, so long after its start [s], and no more standard deviations away.
constexpr double kSecondFor_s = 10, kSecondLeast_s = 2, kSecondApart = 5;
constexpr int kSecondFixed = 3;

/// Of a thin layer 350 km up.
double obliquity(double elevation_rad) {
  const double s = 6371.0 / (6371.0 + 350.0) * std::cos(elevation_rad);
  return 1 / std::sqrt(1 - s * s);
}

}  // namespace

bool RtkFilter::State::go_to(geodesy::GpsTime to, const Fix& alone) {
  if (started && !(to > time)) started = false;
  if (started) {
    dt_s = to - time;
    const Eigen::Matrix3d enu = geodesy::enu_from_ecef_rotation(geodesy::geodetic_from_ecef(position));
    const double h = std::pow(options.acceleration_horizontal, 2);
    const double v = std::pow(options.acceleration_vertical, 2);
    state.move(dt_s, enu.transpose() * Eigen::Vector3d(h, h, v).asDiagonal() * enu);
    for (std::size_t i = 0; i < state.slots.size(); ++i) {
      const Index at = BaselineState::index(i);
      if (state.slots[i].signal != nullptr) {
        state.p(at, at) += 1e-8 * dt_s;  // phase wind-up, delays of the hardware [cycles^2]
      } else {
        decay(at, kIonosphereTime_s, state.slots[i].id);
      }
    }
    if (state.p(BaselineState::kZenith, BaselineState::kZenith) > 0) {
      decay(BaselineState::kZenith, kTroposphereTime_s, std::nullopt);
    }
    apply_position_error();
    if (astray) started = false;
  }
  time = to;
  const bool lost = started && state.p.topLeftCorner<3, 3>().trace() > kLostPosition_m * kLostPosition_m;
  if (started && !lost) return true;
  if (!alone.solved() && !moving) return false;
  if (!started) {
    state = BaselineState();
    started = true;
    astray = false;
    dt_s = 0;
    // How large echoes are here is not forgotten.
    fixed_in_a_row = 0;
  }
  // Of epochs half a minute apart the position is new each time, and the ambiguities remain.
  position = moving ? base_place : alone.position_ecef;
  for (Index i = 0; i < 3; ++i) {
    state.reset(BaselineState::kPosition + i, 0, kUnknownPosition_m * kUnknownPosition_m);
    state.reset(BaselineState::kVelocity + i, 0, kUnknownPosition_m * kUnknownPosition_m);
  }
  return true;
}

void RtkFilter::State::decay(Index at, double time_s, std::optional<gnss::SatelliteId> of) {
  const double keeps = std::exp(-dt_s / time_s);
  const double sigma = of ? ionosphere_sigma_m : troposphere_sigma_m;
  state.x(at) *= keeps;
  state.p.row(at) *= keeps;
  state.p.col(at) *= keeps;
  state.p(at, at) += sigma * sigma * (1 - keeps * keeps);
}

void RtkFilter::State::remove_slipped() {
  for (std::size_t i = state.slots.size(); i-- > 0;) {
    const Slot& slot = state.slots[i];
    const bool ambiguity = slot.signal != nullptr;
    const bool forgotten = ambiguity && options.integers == Integers::Instantaneous;
    const double longest_s = ambiguity ? std::max(kPhaseGap_s, kPhaseGap_epochs * dt_s) : kIonosphereTime_s;
    if (forgotten || time - slot.seen > longest_s) state.remove(i);
  }
  // By the channels themselves, half cycles, and Doppler.
  for (Difference& d : differences) {
    if (!d.has_phase) continue;
    const auto slot = state.find(d.id(), d.rover->signal);
    if (!slot) continue;
    const Slot& s = state.slots[*slot];
    const bool slips = s.rover_since != d.rover->phase_since || s.base_since != d.base_since ||
                       s.half_cycle != d.half_cycle || doppler_slips.contains(d.id(), d.rover->signal);
    if (slips) state.remove(*slot);
  }
}

void RtkFilter::State::compare_carriers() {
  for (std::size_t i = 0; i < differences.size(); ++i) {
    const Difference& a = differences[i];
    for (std::size_t j = i + 1; j < differences.size() && differences[j].id() == a.id(); ++j) {
      const Difference& b = differences[j];
      if (!a.has_phase || !b.has_phase) continue;
      const auto first = state.find(a.id(), a.rover->signal), second = state.find(b.id(), b.rover->signal);
      if (!first || !second) continue;
      const double before_m = state.slots[*first].phase_m - state.slots[*second].phase_m;
      if (std::abs(a.phase_m - b.phase_m - before_m) < kCarriersPart_m) continue;
      state.remove(std::max(*first, *second));
      state.remove(std::min(*first, *second));
    }
  }
}

void RtkFilter::State::update_delays() {
  const double baseline_m = (position - base_place).norm();
  ionosphere_sigma_m =
      baseline_m < kIonosphereFrom_m ? 0 : std::max(1e-3, options.ionosphere_gradient * baseline_m);
  const double height_m = std::abs(geodesy::geodetic_from_ecef(position).height_m -
                                   geodesy::geodetic_from_ecef(base_place).height_m);
  troposphere_sigma_m = baseline_m < kTroposphereFrom_m && height_m < 200
                            ? 0
                            : options.troposphere_gradient * baseline_m + 1e-5 * height_m;
  if (options.ionosphere_gradient == 0) ionosphere_sigma_m = 0;
  constexpr Index zenith = BaselineState::kZenith;
  if (troposphere_sigma_m > 0 && state.p(zenith, zenith) == 0) {
    state.reset(zenith, 0, troposphere_sigma_m * troposphere_sigma_m);
  }
  if (ionosphere_sigma_m == 0) return;
  for (const Difference& d : differences) {
    const auto slot = state.find(d.id(), nullptr);
    if (slot) {
      state.slots[*slot].seen = time;
      continue;
    }
    const double sigma = ionosphere_sigma_m * obliquity(d.rover->elevation_rad);
    state.add({d.id(), nullptr, time, time, {}, {}, false, 0, 0}, 0, sigma * sigma);
  }
}

Eigen::Matrix3d RtkFilter::State::covariance_of_echoes() const {
  std::vector<double> ages_s;
  for (const Difference& d : differences) {
    if (d.used) ages_s.push_back(time - state.slots[*d.slot].begun);
  }
  const double age_s = ages_s.empty() ? 0 : positioning::median(ages_s);
  return code_squares * kEchoTime_s / (kEchoTime_s + age_s) * code_covariance;
}

std::optional<positioning::Dop> RtkFilter::State::dop_of(const std::vector<gnss::SatelliteId>& used,
                                                         const Eigen::Matrix3d& enu) const {
  std::vector<Eigen::Vector3d> directions;
  for (std::size_t i = 0; i < differences.size(); ++i) {
    const bool first = i == 0 || differences[i - 1].id() != differences[i].id();
    if (first && std::binary_search(used.begin(), used.end(), differences[i].id())) {
      directions.emplace_back(enu * differences[i].rover->direction);
    }
  }
  return positioning::dop_of_directions(directions);
}

void RtkFilter::State::take(const Corrections& corrections, std::vector<ObservedMinusComputed> of_base) {
  base = std::move(of_base);
  // Beside a moving base the filter follows the baseline: the place goes along with the base's.
  if (started && corrections.moving) position += corrections.station_ecef - base_place;
  if (corrections.moving != moving || (station && *station != corrections.station)) started = false;
  moving = corrections.moving;
  base_place = corrections.station_ecef;
  station = corrections.station;
  base_time = corrections.receiver_time;
}

void RtkFilter::State::state_answer(const std::optional<Fixed>& fixed, double age_s, Fix& fix) {
  const bool is_fixed = fixed && fixed->accepted;
  fix.status = positioning::FixStatus::Fix;
  fix.solution = is_fixed ? FixKind::Fixed : FixKind::Float;
  fix.correction_age_s = age_s;
  fix.correction_station = station;
  const Eigen::Vector3d error =
      is_fixed ? fixed->position_error : state.x.segment<3>(BaselineState::kPosition);
  const Eigen::Matrix3d covariance = is_fixed ? fixed->covariance : state.p.topLeftCorner<3, 3>();
  fix.position_ecef = position + error;
  fix.position = geodesy::geodetic_from_ecef(fix.position_ecef);
  const Eigen::Matrix3d enu = geodesy::enu_from_ecef_rotation(fix.position);
  fix.covariance_enu = enu * (is_fixed ? covariance : covariance + covariance_of_echoes()) * enu.transpose();
  fix.covariance_enu *= is_fixed ? factor_of(*fixed) : std::max(1.0, squares);
  positioning::Baseline& baseline = fix.baseline.emplace();
  baseline.kind = fix.solution;
  baseline.moving_base = moving;
  baseline.base_ecef = base_place;
  baseline.vector_enu = enu * (fix.position_ecef - base_place);
  baseline.covariance_enu = fix.covariance_enu;
  if (fixed && fixed->ratio > 0) baseline.ratio = fixed->ratio;
  baseline.used = fix.used;
  if (!moving) {
    fix.velocity_enu_mps = enu * state.x.segment<3>(BaselineState::kVelocity);
    fix.velocity_covariance_enu =
        enu * state.p.block<3, 3>(BaselineState::kVelocity, BaselineState::kVelocity) * enu.transpose();
  }
  fix.dop = dop_of(fix.used, enu);
  fix.consistent.reset();
}

std::optional<Fix> RtkFilter::State::update(geodesy::GpsTime receiver_time,
                                            std::span<const SignalMeasurement> rover, const orbit::Sky& sky,
                                            const Fix& alone) {
  if (base.empty()) return std::nullopt;
  const double age_s = receiver_time - base_time;
  if (age_s > (moving ? kSameEpoch_s : max_age_s) || age_s < -kAhead_s) return std::nullopt;
  if (!go_to(receiver_time, alone)) return std::nullopt;
  const auto computed = observed_minus_computed(receiver_time, rover, sky, masks, position);
  differences = differences_of(computed, base, options.phase_sigma_m, std::max(age_s, 0.0));
  groups = groups_of(differences);
  doppler_slips.update(dt_s, computed, rover);
  remove_slipped();
  compare_carriers();
  update_delays();
  if (!moving) take_velocity(alone);
  take_codes();
  take_phases();

  Fix fix = alone;
  fix.used.clear();
  fix.residuals_m.clear();
  fix.excluded.clear();
  for (const Difference& d : differences) {
    if (!d.used || (!fix.used.empty() && fix.used.back() == d.id())) continue;
    fix.used.push_back(d.id());
    fix.residuals_m.push_back(d.residual_m);
  }
  if (fix.used.size() < 4) {
    fixed_in_a_row = 0;
    return std::nullopt;
  }
  const auto fixed = find_integers();
  fixed_in_a_row = fixed && fixed->accepted ? fixed_in_a_row + 1 : 0;
  state_answer(fixed, std::max(age_s, 0.0), fix);
  apply_position_error();
  return fix;
}

RtkFilter::RtkFilter(const RtkOptions& options, const positioning::FixOptions& fix, double max_age_s)
    : state_(std::make_unique<State>(options, fix, max_age_s)) {}
RtkFilter::~RtkFilter() = default;
RtkFilter::RtkFilter(RtkFilter&&) noexcept = default;
RtkFilter& RtkFilter::operator=(RtkFilter&&) noexcept = default;

void RtkFilter::take(const Corrections& base, const orbit::Sky& sky) {
  positioning::FixOptions masks = state_->masks;
  masks.elevation_mask_rad = 0;  // the rover's mask counts
  auto of_base =
      observed_minus_computed(base.receiver_time, base.observations, sky, masks, base.station_ecef);
  if (second_) second_->take(base, of_base);
  state_->take(base, std::move(of_base));
}

std::optional<Fix> RtkFilter::update(geodesy::GpsTime receiver_time, std::span<const SignalMeasurement> rover,
                                     const orbit::Sky& sky, const Fix& alone) {
  std::optional<Fix> fix = state_->update(receiver_time, rover, sky, alone);
  if (!fix || fix->kind() == FixKind::Fixed || state_->options.integers == Integers::Instantaneous) {
    second_.reset();
    return fix;
  }
  // While it is float, echoes of the past may hold it: a second filter without them runs beside it.
  if (!second_ || receiver_time - second_began_ > kSecondFor_s) {
    second_ = std::make_unique<State>(*state_);
    second_->started = false;
    second_began_ = receiver_time;
  }
  std::optional<Fix> other = second_->update(receiver_time, rover, sky, alone);
  const bool proven = other && other->kind() == FixKind::Fixed && second_->fixed_in_a_row >= kSecondFixed &&
                      receiver_time - second_began_ >= kSecondLeast_s;
  if (!proven) return fix;
  const Eigen::Vector3d apart_enu =
      geodesy::enu_from_ecef_rotation(fix->position) * (other->position_ecef - fix->position_ecef);
  const bool agrees =
      apart_enu.dot(fix->covariance_enu.ldlt().solve(apart_enu)) < kSecondApart * kSecondApart;
  if (!agrees) return fix;
  state_ = std::move(second_);
  return other;
}

}  // namespace canyon::relative
