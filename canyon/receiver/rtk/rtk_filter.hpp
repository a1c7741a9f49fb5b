#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/options/fwd.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/receiver/rtk/correction_link.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::rtk {

/// Divergence of satellite clocks and ionosphere over the base's age [m/s]: RTKLIB stats-clkstab, 5e-12 s/s.
inline constexpr double kAgeing_mps = 1.5e-3;

/// Use of fixed integer ambiguities.
enum class Integers : std::uint8_t {
  Continuous,     ///< searched at each epoch; the filter continues with real values
  Instantaneous,  ///< likewise, and the filter resets all phases at each epoch
  Hold,           ///< fixed integers constrain the filter's real values from then on ("fix and hold")
};

/// Real-time kinematic positioning relative to a base (docs/rtk.md).
struct RtkOptions {
  bool enabled = false;
  Integers integers = Integers::Continuous;
  /// Minimum ratio of the distances of the second best and the best integers from the real values [1], [1.1,
  /// 10]. Default: RTKLIB's pos2-arthres.
  double ratio = 3;
  /// Minimum probability that the search finds the right integers, by the filter's covariance
  /// (bootstrapped_success()), [0, 1).
  double min_success = 0.95;
  /// Fixes GLONASS integers also if the biases of phases against codes are unknown at base and rover
  /// (SignalMeasurement::aligned); valid if both are of one make, with equal biases.
  bool fix_glonass = false;
  /// Difference of the ionosphere's vertical delays at 1575.42 MHz over the distance of base and rover [1],
  /// [0, 1e-3]: from 1 km on the filter estimates a delay for each satellite, with this a priori deviation.
  /// 0: none.
  double ionosphere_gradient = 2e-6;
  /// Likewise of the troposphere's zenith delay, from 5 km on: one delay [1], [0, 1e-3].
  double troposphere_gradient = 1e-6;
};
void visit(options::Visitor& v, RtkOptions& o);

class BaselineFilter;

/// One rover's filter: position relative to a base from differences of code and phase, with their integer
/// ambiguities. Deterministic. Epochs in order of time.
///
/// Observations are those of all signals measured by both receivers, rover minus base, each minus range,
/// satellite clock and Saastamoinen's troposphere at its own instant:
///   code_s  = -e.dx + c_s + I_s + m dZ           phase_s = -e.dx + b_s - I_s + m dZ + lambda N_s
/// with dx the position's correction, c_s and b_s a clock for each signal of each system, unknown at each
/// epoch (equivalent to double differences with their correlations), I_s the ionosphere's difference at that
/// carrier, m dZ the troposphere's, and N_s the ambiguity. Differences of N_s within a signal are integers.
///
/// An extended Kalman filter has position, velocity, N and, over longer baselines, I and dZ. Observations are
/// processed one by one, nearest to the median innovation of their signal first. A slip is detected by
/// phase_since, by two diverging carriers of a satellite, by a contradiction to the Doppler, or by an
/// innovation that fails the gate: N is then reset.
///
/// While the filter is float, a second one that started in the last ten seconds runs in parallel, and
/// replaces it once fixed: this limits the effect of echoes on ambiguities.
class RtkFilter {
 public:
  /// @param fix the elevation mask and C/N0 mask @param max_age_s largest age of the base's epoch [s]. Throws
  /// InputError for options out of range.
  RtkFilter(const RtkOptions& options, const positioning::FixOptions& fix, double max_age_s);
  ~RtkFilter();
  RtkFilter(RtkFilter&&) noexcept;
  RtkFilter& operator=(RtkFilter&&) noexcept;

  /// Replaces the base's epoch. @param sky the rover's ephemerides
  void take(const Corrections& base, const orbit::Sky& sky);

  /// @param receiver_time the rover's own clock reading at reception
  /// @param rover its measurements, those of a satellite adjacent
  /// @param alone the fix without phases (single or differential): its position starts the filter and its
  /// velocity is an observation; the result has its clocks and count of satellites
  ///
  /// A Float or Fixed fix with status Fix and its Fix::baseline. Its covariance is that of the filter times
  /// max(1, s^2), s^2 the mean square of normalised innovations of the last epochs, or of normalised
  /// residuals while fixed relative to a moving base. A moving base must have the rover's epoch; the position
  /// is then that of the base's fix plus the baseline. `used` are satellites with a phase in it,
  /// `residuals_m` those of their first phase. Empty with fewer than four such satellites, without a base's
  /// epoch of max_age_s or less, and before there was a solved fix. Throws InputError for time that runs
  /// backwards and for measurements that are not numbers.
  [[nodiscard]] std::optional<positioning::Fix> update(geodesy::GpsTime receiver_time,
                                                       std::span<const SignalMeasurement> rover,
                                                       const orbit::Sky& sky, const positioning::Fix& alone);

 private:
  std::unique_ptr<BaselineFilter> filter_;
  std::unique_ptr<BaselineFilter> second_;  // while the first is float
  geodesy::GpsTime second_began_;
};

}  // namespace canyon::rtk
