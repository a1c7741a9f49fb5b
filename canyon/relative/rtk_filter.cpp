#include "canyon/relative/rtk_filter.hpp"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/frames.hpp"
#include "canyon/relative/baseline_state.hpp"
#include "canyon/relative/integer_least_squares.hpp"
#include "canyon/relative/observed_minus_computed.hpp"

namespace canyon::relative {
namespace {

using Eigen::Index;
using positioning::Fix;
using positioning::FixKind;

/// Before anything is known [m].
constexpr double kUnknownPosition_m = 30, kUnknownClock_m = 100, kUnknownAmbiguity_m = 30;
/// A position less certain than this [m] begins anew from a fix.
constexpr double kLostPosition_m = 100;
/// A phase that was not measured for so long has slipped [s]; where epochs are farther apart, one that the
/// last epoch lacked.
constexpr double kPhaseGap_s = 5, kPhaseGap_epochs = 1.5;
/// Clocks of receivers differ by milliseconds [s].
constexpr double kAhead_s = 1;
/// A moving base must have measured at the rover's epoch [s].
constexpr double kSameEpoch_s = 0.02;
/// Two carriers of a satellite part by more than this [m] only where one of them slips.
constexpr double kCarriersPart_m = 0.05;
/// A phase and the integral of its Doppler part by more than this [m] likewise.
constexpr double kDopplerParts_m = 1;
/// Phases of a direct signal are off by a quarter of a cycle at most, by echoes.
constexpr double kLeastSlip_cycles = 0.3;
/// From these lengths of the baseline on, delays are estimated [m].
constexpr double kIonosphereFrom_m = 1e3, kTroposphereFrom_m = 5e3;
/// Delays forget in so long [s].
constexpr double kIonosphereTime_s = 1200, kTroposphereTime_s = 7200;
/// The filter is sure of whole numbers that it holds [cycles], after so many fixed epochs in a row.
constexpr double kHeld_cycles = 1e-3;
constexpr int kHoldAfter = 10;
/// After so many fixed epochs in a row the same whole numbers need no more than this ratio, where so large a
/// share of them is known from before.
constexpr int kKeptAfter = 5;
constexpr double kKeptRatio = 1.5, kKeptShare = 0.75;
/// Errors of codes are the same for so long [s]: more epochs in that time know no more.
constexpr double kCodeTime_s = 1;
/// Echoes of a moving antenna last about so long [s].
constexpr double kEchoTime_s = 10;
/// The second filter begins anew after so long, and takes over when it has been fixed for so many epochs in a
/// row, so long after its beginning [s], and no more standard deviations away.
constexpr double kSecondFor_s = 10, kSecondLeast_s = 2, kSecondApart = 5;
constexpr int kSecondFixed = 3;
/// Weight of an epoch in the mean square of innovations.
constexpr double kSquaresWeight = 0.1;
/// Residuals of an epoch alone say how large errors are where no fewer are redundant.
constexpr int kFewRedundant = 5;

/// Rover minus base, of one signal.
struct Difference {
  const ObservedMinusComputed* rover = nullptr;
  double code_m = 0, phase_m = 0;
  double variance = 0;      // of the phase [m^2]; code's is that times the square of the ratio
  double age_variance = 0;  // of both [m^2]
  std::optional<geodesy::GpsTime> base_since;
  bool has_phase = false, half_cycle = false, aligned = true;
  // What the filter made of the phase.
  std::optional<std::size_t> slot;
  bool used = false;      // phase
  bool trusted = false;   // within the gate
  double residual_m = 0;  // after the epoch

  [[nodiscard]] gnss::SatelliteId id() const { return rover->id; }
  [[nodiscard]] double ionosphere_rate() const {
    const double l1_m = geodesy::kSpeedOfLight / gnss::kL1_hz;
    return std::pow(rover->wavelength_m / l1_m, 2);
  }
};

/// A satellite's signals are together; those of one signal, by their places among the differences.
using Groups = std::map<const gnss::Signal*, std::vector<std::size_t>>;

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

}  // namespace

struct RtkFilter::State {
  void take(const Corrections& corrections, const orbit::Sky& sky);
  [[nodiscard]] std::optional<Fix> update(geodesy::GpsTime receiver_time,
                                          std::span<const SignalMeasurement> rover, const orbit::Sky& sky,
                                          const Fix& alone);

  State(const RtkOptions& rtk, const positioning::FixOptions& fix, double longest_s)
      : options(rtk), masks(fix), max_age_s(longest_s) {
    options.validate();
  }

  // --- bookkeeping of an epoch

  /// Moves the filter to `time`, or begins it; false where it cannot begin.
  bool go_to(geodesy::GpsTime to, const Fix& alone) {
    if (begun && !(to > time)) begun = false;
    if (begun) {
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
      settle_position();
      if (astray) begun = false;
    }
    time = to;
    const bool lost = begun && state.p.topLeftCorner<3, 3>().trace() > kLostPosition_m * kLostPosition_m;
    if (begun && !lost) return true;
    if (!alone.solved() && !moving) return false;
    if (!begun) {
      state = BaselineState();
      begun = true;
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

  /// A first-order process: towards 0, its variance towards what it was before anything was known.
  void decay(Index at, double time_s, std::optional<gnss::SatelliteId> of) {
    const double keeps = std::exp(-dt_s / time_s);
    const double sigma = of ? ionosphere_sigma_m : troposphere_sigma_m;
    state.x(at) *= keeps;
    state.p.row(at) *= keeps;
    state.p.col(at) *= keeps;
    state.p(at, at) += sigma * sigma * (1 - keeps * keeps);
  }

  /// The position's error into the position.
  void settle_position() {
    position += state.x.segment<3>(BaselineState::kPosition);
    state.x.segment<3>(BaselineState::kPosition).setZero();
  }

  void pair(std::span<const ObservedMinusComputed> rover, double age_s) {
    differences.clear();
    groups.clear();
    for (const ObservedMinusComputed& r : rover) {
      const ObservedMinusComputed* const b = partner(r, rover);
      if (b == nullptr) continue;
      Difference d;
      d.rover = &r;
      d.code_m = r.code_m - b->code_m;
      d.has_phase = r.phase_m && b->phase_m;
      if (d.has_phase) d.phase_m = *r.phase_m - *b->phase_m;
      d.variance = options.phase_sigma_m * options.phase_sigma_m * (r.variance + b->variance);
      d.age_variance = std::pow(kAgeing_mps * age_s, 2);
      d.base_since = b->phase_since;
      d.half_cycle = r.half_cycle || b->half_cycle;
      d.aligned = r.aligned && b->aligned;
      differences.push_back(d);
    }
    for (std::size_t i = 0; i < differences.size(); ++i) groups[differences[i].rover->signal].push_back(i);
    // A signal of one satellite says nothing but its clock.
    for (auto group = groups.begin(); group != groups.end();) {
      group = group->second.size() < 2 ? groups.erase(group) : std::next(group);
    }
  }

  /// The base's observation of the same signal; where that is missing or has no phase, of another component
  /// on that carrier, whose phase files and RTCM align (RINEX 3.04, 5.2.16), unless the rover has that one as
  /// well. Null without.
  [[nodiscard]] const ObservedMinusComputed* partner(const ObservedMinusComputed& r,
                                                     std::span<const ObservedMinusComputed> rover) const {
    const auto at = std::lower_bound(base.begin(), base.end(), r, before);
    const ObservedMinusComputed* const same = at != base.end() && !before(r, *at) ? &*at : nullptr;
    if (same != nullptr && (same->phase_m || !r.phase_m)) return same;
    const auto of_carrier = [&](const ObservedMinusComputed& o) {
      return o.id == r.id && o.signal->carrier_hz == r.signal->carrier_hz && o.phase_m;
    };
    // A carrier's phase counts once.
    const bool several = std::count_if(rover.begin(), rover.end(), of_carrier) > 1;
    const auto other = std::find_if(base.begin(), base.end(), of_carrier);
    return several || other == base.end() ? same : &*other;
  }

  /// The rover's phases that do not follow from those of the epoch before and their Doppler.
  void compare_with_doppler(std::span<const ObservedMinusComputed> rover,
                            std::span<const SignalMeasurement> measured) {
    std::map<std::pair<gnss::SatelliteId, const gnss::Signal*>, Step> steps;
    std::vector<double> apart;
    for (const SignalMeasurement& seen : measured) {
      const positioning::Measurement& m = seen.measurement;
      if (!m.carrier_phase_cycles || !m.doppler_hz) continue;
      const double wavelength_m = geodesy::kSpeedOfLight / m.carrier_frequency_hz;
      Step step{*m.carrier_phase_cycles * wavelength_m, -*m.doppler_hz * wavelength_m, 0};
      const auto last = last_steps.find({m.id, seen.signal});
      if (last != last_steps.end() && dt_s > 0 && dt_s < 2) {
        step.apart_m =
            step.phase_m - last->second.phase_m - dt_s * (step.doppler_mps + last->second.doppler_mps) / 2;
        apart.push_back(step.apart_m);
      }
      steps[{m.id, seen.signal}] = step;
    }
    slipped.clear();
    if (apart.size() > 4) {
      const double clock_m = median(apart);
      for (const ObservedMinusComputed& o : rover) {
        const auto step = steps.find({o.id, o.signal});
        if (step == steps.end() || step->second.apart_m == 0) continue;
        if (std::abs(step->second.apart_m - clock_m) > kDopplerParts_m) slipped.push_back({o.id, o.signal});
      }
    }
    last_steps = std::move(steps);
  }

  /// Finds each phase its ambiguity, and ends those whose phase has slipped.
  void mind_slips() {
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
      const bool slips =
          s.rover_since != d.rover->phase_since || s.base_since != d.base_since ||
          s.half_cycle != d.half_cycle ||
          std::find(slipped.begin(), slipped.end(), std::pair(d.id(), d.rover->signal)) != slipped.end();
      if (slips) state.remove(*slot);
    }
    // By two carriers that part.
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

  /// Slots of delays, as the baseline needs them.
  void mind_delays() {
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

  /// Of a thin layer 350 km up.
  static double obliquity(double elevation_rad) {
    const double s = 6371.0 / (6371.0 + 350.0) * std::cos(elevation_rad);
    return 1 / std::sqrt(1 - s * s);
  }

  // --- observations

  [[nodiscard]] SparseRow row_of(const BaselineState& of, const Difference& d, bool phase) const {
    SparseRow row;
    for (Index i = 0; i < 3; ++i) row.add(BaselineState::kPosition + i, -d.rover->direction(i));
    row.add(BaselineState::kClock, 1);
    if (of.p(BaselineState::kZenith, BaselineState::kZenith) > 0) {
      row.add(BaselineState::kZenith, 1 / std::max(0.05, std::sin(d.rover->elevation_rad)));
    }
    if (ionosphere_sigma_m > 0) {
      if (const auto slot = of.find(d.id(), nullptr)) {
        row.add(BaselineState::index(*slot), (phase ? -1 : 1) * d.ionosphere_rate());
      }
    }
    if (phase && d.slot) row.add(BaselineState::index(*d.slot), d.rover->wavelength_m);
    return row;
  }

  /// Innovations of a group around their median, which becomes the clock: nearest first.
  template <typename Value>
  std::vector<std::size_t> ordered(BaselineState& of, const std::vector<std::size_t>& group, bool phase,
                                   Value value) {
    of.reset(BaselineState::kClock, 0, 0);
    std::vector<std::pair<double, std::size_t>> innovations;
    std::vector<double> values;
    for (const std::size_t i : group) {
      const Difference& d = differences[i];
      if (phase && !d.slot) continue;
      innovations.emplace_back(of.innovation(row_of(of, d, phase), value(d), 0).value, i);
      values.push_back(innovations.back().first);
    }
    if (innovations.size() < 2) return {};
    const double middle = median(values);
    for (auto& [innovation, i] : innovations) innovation = std::abs(innovation - middle);
    std::sort(innovations.begin(), innovations.end());
    of.reset(BaselineState::kClock, middle, kUnknownClock_m * kUnknownClock_m);
    std::vector<std::size_t> order;
    order.reserve(innovations.size());
    for (const auto& [innovation, i] : innovations) order.push_back(i);
    return order;
  }

  void take_codes() {
    int considered = 0, failed = 0;
    double sum = 0;
    BaselineState part = state.without_ambiguities();
    Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
    const double repeats = dt_s > 0 ? std::max(1.0, kCodeTime_s / dt_s) : 1;
    for (const auto& [signal, group] : groups) {
      Eigen::Matrix3d squares_of = Eigen::Matrix3d::Zero();
      Eigen::Vector3d sum_of = Eigen::Vector3d::Zero();
      double weights = 0;
      for (const std::size_t i : ordered(part, group, false, [](const Difference& d) { return d.code_m; })) {
        const Difference& d = differences[i];
        const SparseRow row = row_of(part, d, false);
        const double noise = d.variance * options.code_ratio * options.code_ratio + d.age_variance;
        const double normalised = std::abs(part.innovation(row, d.code_m, noise).normalised());
        ++considered;
        sum += std::min(normalised * normalised, 25.0);
        if (normalised > options.gate_sigmas) {
          ++failed;
          continue;
        }
        part.take(row, d.code_m, repeats * noise);
        const Eigen::Vector3d& e = d.rover->direction;
        weights += 1 / noise;
        sum_of += e / noise;
        squares_of += e * e.transpose() / noise;
      }
      if (weights > 0) information += squares_of - sum_of * sum_of.transpose() / weights;
    }
    part.mirror();
    state.learn(part);
    code_covariance.setZero();
    if (information.determinant() > 1e-9) code_covariance = information.inverse();
    const auto redundant = considered - static_cast<int>(groups.size()) - 3;
    if (redundant > 3) {
      code_squares += kSquaresWeight * (std::max(1.0, sum / redundant) - code_squares);
    }
    if (2 * failed > considered && considered > 4) {
      if (!astray_since) astray_since = time;
      astray = time - *astray_since > 3;
    } else {
      astray_since.reset();
      astray = false;
    }
  }

  /// How far phases less codes have moved from ambiguities since these began [m]: codes of some receivers
  /// jump by a millisecond and their phases do not. 0 where it is no more than what is not known of an
  /// ambiguity.
  [[nodiscard]] double code_jump_m(const std::vector<std::size_t>& group) const {
    std::vector<double> jumps;
    for (const std::size_t i : group) {
      const Difference& d = differences[i];
      if (!d.has_phase) continue;
      if (const auto slot = state.find(d.id(), d.rover->signal)) {
        jumps.push_back(d.phase_m - d.code_m - d.rover->wavelength_m * state.x(BaselineState::index(*slot)));
      }
    }
    const double jump_m = jumps.empty() ? 0 : median(jumps);
    return std::abs(jump_m) > kUnknownAmbiguity_m ? jump_m : 0;
  }

  void begin_ambiguities(const std::vector<std::size_t>& group, double jump_m) {
    for (const std::size_t i : group) {
      Difference& d = differences[i];
      if (!d.has_phase) continue;
      d.slot = state.find(d.id(), d.rover->signal);
      if (d.slot) continue;
      const double cycles = (d.phase_m - d.code_m - jump_m) / d.rover->wavelength_m;
      d.slot = state.add({d.id(), d.rover->signal, time, time, d.rover->phase_since, d.base_since,
                          d.half_cycle, 0, d.phase_m},
                         cycles, std::pow(kUnknownAmbiguity_m / d.rover->wavelength_m, 2));
    }
  }

  void take_phases() {
    double sum = 0;
    int count = 0;
    for (auto& [signal, group] : groups) {
      const double jump_m = code_jump_m(group);
      begin_ambiguities(group, jump_m);
      bool first = true;
      for (const std::size_t i : ordered(state, group, true, [](const Difference& d) { return d.phase_m; })) {
        Difference& d = differences[i];
        const SparseRow row = row_of(state, d, true);
        double variance = d.variance + d.age_variance;
        const auto innovation = state.innovation(row, d.phase_m, variance);
        const double normalised = std::abs(innovation.normalised());
        Slot& slot = state.slots[*d.slot];
        const bool beyond = normalised > options.gate_sigmas;
        if (beyond && std::abs(innovation.value) > kLeastSlip_cycles * d.rover->wavelength_m) {
          // It slipped: its ambiguity begins anew, from this epoch's observations.
          state.reset(BaselineState::index(*d.slot), (d.phase_m - d.code_m - jump_m) / d.rover->wavelength_m,
                      std::pow(kUnknownAmbiguity_m / d.rover->wavelength_m, 2));
          slot.begun = time;
          slot.epochs = 0;
          slot.whole.reset();
        } else if (beyond) {
          // An echo: it counts as little as it fits.
          variance += std::pow(innovation.value / options.gate_sigmas, 2);
        }
        d.trusted = !beyond;
        if (!first && slot.epochs > 0) {
          sum += std::min(normalised * normalised, 100.0);
          ++count;
        }
        first = false;
        state.take(row, d.phase_m, variance);
        d.used = true;
        slot.seen = time;
        slot.phase_m = d.phase_m;
        slot.rover_since = d.rover->phase_since;
        slot.base_since = d.base_since;
        ++slot.epochs;
      }
      for (const std::size_t i : group) {
        Difference& d = differences[i];
        if (!d.used) continue;
        d.residual_m = state.innovation(row_of(state, d, true), d.phase_m, 0).value;
      }
    }
    state.mirror();
    if (count > 4) squares += kSquaresWeight * (sum / count - squares);
  }

  void take_velocity(const Fix& alone) {
    if (!alone.velocity_enu_mps || !alone.velocity_covariance_enu) return;
    const Eigen::Matrix3d enu = geodesy::enu_from_ecef_rotation(alone.position);
    for (Index i = 0; i < 3; ++i) {
      SparseRow row;
      for (Index j = 0; j < 3; ++j) row.add(BaselineState::kVelocity + j, enu(i, j));
      const double variance = std::max((*alone.velocity_covariance_enu)(i, i), 1e-4);
      const double value = (*alone.velocity_enu_mps)(i);
      if (std::abs(state.innovation(row, value, variance).normalised()) > options.gate_sigmas) continue;
      state.take(row, value, variance);
    }
    state.mirror();
  }

  // --- whole numbers

  struct Fixed {
    Eigen::Vector3d position_error = Eigen::Vector3d::Zero();
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    double ratio = 0;
    bool accepted = false;
    double squares = 0;  // of residuals over their deviations, a sum
    int redundant = 0;   // so many of them
  };

  /// Sum of squares of phases' residuals at a state, each signal's clock estimated, over their variances.
  [[nodiscard]] double squares_of_residuals(const std::vector<std::size_t>& among,
                                            const Eigen::VectorXd& x) const {
    struct Sums {
      double weights = 0, values = 0, squares = 0;
    };
    std::map<const gnss::Signal*, Sums> of_signals;
    for (const std::size_t i : among) {
      const Difference& d = differences[i];
      const SparseRow row = row_of(state, d, true);
      double residual_m = d.phase_m;
      for (std::size_t k = 0; k < row.count; ++k) residual_m -= row.terms[k].second * x(row.terms[k].first);
      const double weight = 1 / (d.variance + d.age_variance);
      Sums& sums = of_signals[d.rover->signal];
      sums.weights += weight;
      sums.values += weight * residual_m;
      sums.squares += weight * residual_m * residual_m;
    }
    double result = 0;
    for (const auto& [signal, sums] : of_signals) {
      result += sums.squares - sums.values * sums.values / sums.weights;
    }
    return result;
  }

  /// What the covariance of a fixed position is to be multiplied by. Of two antennas of a vehicle, which
  /// share all errors but those of loops and echoes: the mean square of residuals at the whole numbers, of
  /// the last epochs or of this one.
  double factor_of(const Fixed& fixed) {
    fixed_squares += kSquaresWeight * (fixed.squares - fixed_squares);
    fixed_redundant += kSquaresWeight * (std::max(0, fixed.redundant) - fixed_redundant);
    if (!moving || ionosphere_sigma_m > 0) return std::max(1.0, squares);
    const double lately = (1 + fixed_squares / kSquaresWeight) / (1 + fixed_redundant / kSquaresWeight);
    return std::max(lately, fixed.squares / std::max(kFewRedundant, fixed.redundant));
  }

  /// Candidates by certainty of their phase, best first.
  [[nodiscard]] std::vector<std::size_t> candidates() const {
    std::vector<std::size_t> result;
    for (std::size_t i = 0; i < differences.size(); ++i) {
      const Difference& d = differences[i];
      const bool integer = d.aligned || options.fix_glonass;
      if (d.used && d.trusted && integer && !d.half_cycle &&
          d.rover->elevation_rad >= options.fix_elevation_rad) {
        result.push_back(i);
      }
    }
    std::stable_sort(result.begin(), result.end(), [this](std::size_t a, std::size_t b) {
      return differences[a].variance < differences[b].variance;
    });
    return result;
  }

  /// Whether whole numbers are those of the last fixed position, as far as that had them, and that is most.
  [[nodiscard]] static bool are_kept(const std::vector<std::pair<Slot*, Slot*>>& slots,
                                     const Eigen::VectorXd& whole) {
    std::size_t known = 0;
    for (std::size_t i = 0; i < slots.size(); ++i) {
      const auto& [slot, reference] = slots[i];
      if (!slot->whole || !reference->whole) continue;
      if (*slot->whole - *reference->whole != whole(static_cast<Index>(i))) return false;
      ++known;
    }
    return known >= kKeptShare * static_cast<double>(slots.size());
  }

  void keep(const std::vector<std::pair<Slot*, Slot*>>& slots, const Eigen::VectorXd& whole) {
    if (!are_kept(slots, whole)) {
      for (Slot& slot : state.slots) slot.whole.reset();
    }
    for (std::size_t i = 0; i < slots.size(); ++i) {
      const auto& [slot, reference] = slots[i];
      if (!reference->whole && slot->whole) reference->whole = *slot->whole - whole(static_cast<Index>(i));
    }
    for (std::size_t i = 0; i < slots.size(); ++i) {
      const auto& [slot, reference] = slots[i];
      if (!reference->whole) reference->whole = 0;
      slot->whole = *reference->whole + whole(static_cast<Index>(i));
    }
  }

  /// One search among these differences; empty where there are too few.
  std::optional<Fixed> search(const std::vector<std::size_t>& among) {
    std::map<const gnss::Signal*, std::size_t> reference;
    std::vector<std::pair<Index, Index>> pairs;  // of states: an ambiguity and its signal's reference
    std::vector<std::pair<Slot*, Slot*>> slots;  // the same
    std::vector<gnss::SatelliteId> satellites;
    for (const std::size_t i : among) {
      const Difference& d = differences[i];
      satellites.push_back(d.id());
      const auto [at, is_new] = reference.emplace(d.rover->signal, i);
      if (is_new) continue;
      const std::size_t other = *differences[at->second].slot;
      pairs.emplace_back(BaselineState::index(*d.slot), BaselineState::index(other));
      slots.emplace_back(&state.slots[*d.slot], &state.slots[other]);
    }
    std::sort(satellites.begin(), satellites.end());
    satellites.erase(std::unique(satellites.begin(), satellites.end()), satellites.end());
    if (static_cast<int>(satellites.size()) < options.min_satellites || pairs.size() < 4) return std::nullopt;
    const auto n = static_cast<Index>(pairs.size());
    Eigen::VectorXd real(n);
    Eigen::MatrixXd q(n, n), with_position(3, n);
    for (Index i = 0; i < n; ++i) {
      const auto& [a, r] = pairs[static_cast<std::size_t>(i)];
      real(i) = state.x(a) - state.x(r);
      with_position.col(i) = state.p.col(a).head<3>() - state.p.col(r).head<3>();
      for (Index j = 0; j <= i; ++j) {
        const auto& [b, s] = pairs[static_cast<std::size_t>(j)];
        q(i, j) = q(j, i) = state.p(a, b) - state.p(a, s) - state.p(r, b) + state.p(r, s);
      }
    }
    const auto found = integer_least_squares(real, q);
    if (!found) return Fixed{};
    Fixed fixed;
    fixed.ratio = found->ratio();
    const bool proven = fixed.ratio >= options.ratio && found->success >= options.min_success;
    fixed.accepted =
        proven || (fixed_in_a_row >= kKeptAfter && fixed.ratio >= kKeptRatio && are_kept(slots, found->best));
    if (!fixed.accepted) return fixed;
    keep(slots, found->best);
    const Eigen::LDLT<Eigen::MatrixXd> factors(q);
    const Eigen::VectorXd weights = factors.solve(real - found->best);
    Eigen::VectorXd x = state.x;
    for (Index i = 0; i < n; ++i) {
      const auto& [a, r] = pairs[static_cast<std::size_t>(i)];
      x -= weights(i) * (state.p.col(a) - state.p.col(r));
    }
    fixed.position_error = x.segment<3>(BaselineState::kPosition);
    fixed.redundant = static_cast<int>(pairs.size()) - 3;
    fixed.squares = squares_of_residuals(among, x);
    fixed.covariance =
        state.p.topLeftCorner<3, 3>() - with_position * factors.solve(with_position.transpose());
    if (options.integers == Integers::Hold && fixed_in_a_row + 1 >= kHoldAfter) {
      for (Index i = 0; i < n; ++i) {
        SparseRow row;
        row.add(pairs[static_cast<std::size_t>(i)].first, 1);
        row.add(pairs[static_cast<std::size_t>(i)].second, -1);
        state.take(row, found->best(i), kHeld_cycles * kHeld_cycles);
      }
      state.mirror();
    }
    return fixed;
  }

  /// Of all; where that fails without GLONASS, as biases that are stated wrongly spoil it.
  std::optional<Fixed> find_integers() {
    std::vector<std::size_t> among = candidates();
    std::optional<Fixed> result = find_among(among);
    if (result && result->accepted) return result;
    const auto glonass = std::remove_if(among.begin(), among.end(), [&](std::size_t i) {
      return differences[i].id().system == gnss::System::GLONASS;
    });
    if (glonass == among.end()) return result;
    among.erase(glonass, among.end());
    const std::optional<Fixed> without = find_among(among);
    return without && (!result || without->accepted) ? without : result;
  }

  /// Of these, or of the more certain.
  std::optional<Fixed> find_among(std::vector<std::size_t> among) {
    std::optional<Fixed> result;
    for (const std::size_t fewer : {0, 1, 1, 1, 2, 3}) {
      for (std::size_t k = 0; k < fewer && !among.empty(); ++k) {
        const gnss::SatelliteId worst = differences[among.back()].id();
        among.erase(std::remove_if(among.begin(), among.end(),
                                   [&](std::size_t i) { return differences[i].id() == worst; }),
                    among.end());
      }
      std::optional<Fixed> next = search(among);
      if (!next) break;
      if (!result || next->accepted) result = next;
      if (next->accepted || !options.partial) break;
    }
    return result;
  }

  // --- the answer

  /// What the filter's covariance lacks while its position follows from codes: their echoes last, and average
  /// out as slowly as the ambiguities grow old.
  [[nodiscard]] Eigen::Matrix3d covariance_of_echoes() const {
    std::vector<double> ages_s;
    for (const Difference& d : differences) {
      if (d.used) ages_s.push_back(time - state.slots[*d.slot].begun);
    }
    const double age_s = ages_s.empty() ? 0 : median(ages_s);
    return code_squares * kEchoTime_s / (kEchoTime_s + age_s) * code_covariance;
  }

  [[nodiscard]] std::optional<positioning::Dop> dop_of(const std::vector<gnss::SatelliteId>& used,
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

  RtkOptions options;
  positioning::FixOptions masks;
  double max_age_s;
  bool begun = false, astray = false;
  std::optional<geodesy::GpsTime> astray_since;
  geodesy::GpsTime time;
  double dt_s = 0;
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  BaselineState state;
  double squares = 1;                             // mean of normalised innovations' squares, of phases
  double code_squares = 1;                        // and of codes, 1 or more
  double fixed_squares = 0, fixed_redundant = 0;  // means of Fixed's
  Eigen::Matrix3d code_covariance = Eigen::Matrix3d::Zero();  // of the codes of the epoch alone
  int fixed_in_a_row = 0;
  double ionosphere_sigma_m = 0, troposphere_sigma_m = 0;

  struct Step {
    double phase_m = 0, doppler_mps = 0, apart_m = 0;
  };
  std::map<std::pair<gnss::SatelliteId, const gnss::Signal*>, Step> last_steps;
  std::vector<std::pair<gnss::SatelliteId, const gnss::Signal*>> slipped;

  Eigen::Vector3d base_place = Eigen::Vector3d::Zero();
  bool moving = false;
  geodesy::GpsTime base_time;  // by its clock
  std::optional<int> station;
  std::vector<ObservedMinusComputed> base;

  // Of the epoch in hand.
  std::vector<Difference> differences;
  Groups groups;
};

RtkFilter::RtkFilter(const RtkOptions& options, const positioning::FixOptions& fix, double max_age_s)
    : state_(std::make_unique<State>(options, fix, max_age_s)) {}
RtkFilter::~RtkFilter() = default;
RtkFilter::RtkFilter(RtkFilter&&) noexcept = default;
RtkFilter& RtkFilter::operator=(RtkFilter&&) noexcept = default;

void RtkFilter::State::take(const Corrections& corrections, const orbit::Sky& sky) {
  State& s = *this;
  positioning::FixOptions all = s.masks;
  all.elevation_mask_rad = 0;  // the rover's mask counts
  s.base = observed_minus_computed(corrections.receiver_time, corrections.observations, sky, all,
                                   corrections.station_ecef);
  // Beside a moving base the filter follows the baseline: the place goes along with the base's.
  if (s.begun && corrections.moving) s.position += corrections.station_ecef - s.base_place;
  if (corrections.moving != s.moving || (s.station && *s.station != corrections.station)) s.begun = false;
  s.moving = corrections.moving;
  s.base_place = corrections.station_ecef;
  s.station = corrections.station;
  s.base_time = corrections.receiver_time;
}

std::optional<Fix> RtkFilter::State::update(geodesy::GpsTime receiver_time,
                                            std::span<const SignalMeasurement> rover, const orbit::Sky& sky,
                                            const Fix& alone) {
  State& s = *this;
  if (s.base.empty()) return std::nullopt;
  const double age_s = receiver_time - s.base_time;
  if (age_s > (s.moving ? kSameEpoch_s : s.max_age_s) || age_s < -kAhead_s) return std::nullopt;
  if (!s.go_to(receiver_time, alone)) return std::nullopt;
  const auto computed = observed_minus_computed(receiver_time, rover, sky, s.masks, s.position);
  s.pair(computed, std::max(age_s, 0.0));
  s.compare_with_doppler(computed, rover);
  s.mind_slips();
  s.mind_delays();
  if (!s.moving) s.take_velocity(alone);
  s.take_codes();
  s.take_phases();

  Fix fix = alone;
  fix.used.clear();
  fix.residuals_m.clear();
  fix.excluded.clear();
  for (const Difference& d : s.differences) {
    if (!d.used || (!fix.used.empty() && fix.used.back() == d.id())) continue;
    fix.used.push_back(d.id());
    fix.residuals_m.push_back(d.residual_m);
  }
  if (fix.used.size() < 4) {
    s.fixed_in_a_row = 0;
    return std::nullopt;
  }
  const auto fixed = s.find_integers();
  const bool is_fixed = fixed && fixed->accepted;
  s.fixed_in_a_row = is_fixed ? s.fixed_in_a_row + 1 : 0;
  fix.status = positioning::FixStatus::Fix;
  fix.solution = is_fixed ? FixKind::Fixed : FixKind::Float;
  fix.correction_age_s = std::max(age_s, 0.0);
  fix.correction_station = s.station;
  const Eigen::Vector3d error =
      is_fixed ? fixed->position_error : s.state.x.segment<3>(BaselineState::kPosition);
  const Eigen::Matrix3d covariance = is_fixed ? fixed->covariance : s.state.p.topLeftCorner<3, 3>();
  fix.position_ecef = s.position + error;
  fix.position = geodesy::geodetic_from_ecef(fix.position_ecef);
  const Eigen::Matrix3d enu = geodesy::enu_from_ecef_rotation(fix.position);
  fix.covariance_enu =
      enu * (is_fixed ? covariance : covariance + s.covariance_of_echoes()) * enu.transpose();
  fix.covariance_enu *= is_fixed ? s.factor_of(*fixed) : std::max(1.0, s.squares);
  positioning::Baseline& baseline = fix.baseline.emplace();
  baseline.kind = fix.solution;
  baseline.moving_base = s.moving;
  baseline.base_ecef = s.base_place;
  baseline.vector_enu = enu * (fix.position_ecef - s.base_place);
  baseline.covariance_enu = fix.covariance_enu;
  if (fixed && fixed->ratio > 0) baseline.ratio = fixed->ratio;
  baseline.used = fix.used;
  if (!s.moving) {
    fix.velocity_enu_mps = enu * s.state.x.segment<3>(BaselineState::kVelocity);
    fix.velocity_covariance_enu =
        enu * s.state.p.block<3, 3>(BaselineState::kVelocity, BaselineState::kVelocity) * enu.transpose();
  }
  fix.dop = s.dop_of(fix.used, enu);
  fix.consistent.reset();
  s.settle_position();
  return fix;
}

void RtkFilter::take(const Corrections& base, const orbit::Sky& sky) {
  state_->take(base, sky);
  if (second_) second_->take(base, sky);
}

std::optional<Fix> RtkFilter::update(geodesy::GpsTime receiver_time, std::span<const SignalMeasurement> rover,
                                     const orbit::Sky& sky, const Fix& alone) {
  std::optional<Fix> fix = state_->update(receiver_time, rover, sky, alone);
  if (!fix || fix->kind() == FixKind::Fixed || state_->options.integers == Integers::Instantaneous) {
    second_.reset();
    return fix;
  }
  // While it is float, echoes of the past may hold it: one that knows nothing of them tries beside it.
  if (!second_ || receiver_time - second_began_ > kSecondFor_s) {
    second_ = std::make_unique<State>(*state_);
    second_->begun = false;
    second_began_ = receiver_time;
  }
  std::optional<Fix> other = second_->update(receiver_time, rover, sky, alone);
  const bool sure = other && other->kind() == FixKind::Fixed && second_->fixed_in_a_row >= kSecondFixed &&
                    receiver_time - second_began_ >= kSecondLeast_s;
  if (!sure) return fix;
  const Eigen::Vector3d apart_enu =
      geodesy::enu_from_ecef_rotation(fix->position) * (other->position_ecef - fix->position_ecef);
  const bool agrees =
      apart_enu.dot(fix->covariance_enu.ldlt().solve(apart_enu)) < kSecondApart * kSecondApart;
  if (!agrees) return fix;
  state_ = std::move(second_);
  return other;
}

}  // namespace canyon::relative
