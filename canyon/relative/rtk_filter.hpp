#pragma once

#include <memory>
#include <optional>
#include <span>

#include "canyon/geodesy/gps_time.hpp"
#include "canyon/orbit/sky.hpp"
#include "canyon/positioning/fix.hpp"
#include "canyon/relative/correction_link.hpp"
#include "canyon/relative/rtk_options.hpp"

namespace canyon::relative {

class BaselineFilter;

/// One rover's filter: position relative to a base from differences of code and phase, and whole numbers of
/// cycles among these. Same inputs, same answers. Epochs in order of time.
///
/// Observations are those of all signals that base and rover both measure, rover minus base, each less range,
/// satellite clock and Saastamoinen's troposphere at its own instant:
///   code_s  = -e.dx + c_s + I_s + m dZ           phase_s = -e.dx + b_s - I_s + m dZ + lambda N_s
/// with dx the position's correction, c_s and b_s a clock for each signal of each system, unknown at each
/// epoch (which is the same as double differences with their correlations), I_s the ionosphere's difference
/// at that carrier, m dZ the troposphere's, and N_s the ambiguity. Differences of N_s within a signal are
/// whole.
///
/// An extended Kalman filter has position, velocity, N and, over longer baselines, I and dZ. Observations are
/// taken one by one, nearest to the median innovation of their signal first. A phase slips where its channel
/// says so (phase_since), where two carriers of a satellite part, where it contradicts the Doppler, and where
/// its innovation fails the gate: its N begins anew.
///
/// While the filter is float, a second one that has begun in the last ten seconds runs beside it, and takes
/// over once it is fixed: what echoes have done to ambiguities does not outlast them.
class RtkFilter {
 public:
  /// @param fix the elevation mask and C/N0 mask @param max_age_s of a base's epoch that is used [s]. Throws
  /// InputError for options out of range.
  RtkFilter(const RtkOptions& options, const positioning::FixOptions& fix, double max_age_s);
  ~RtkFilter();
  RtkFilter(RtkFilter&&) noexcept;
  RtkFilter& operator=(RtkFilter&&) noexcept;

  /// The base's epoch, in the place of the one before. @param sky the rover's ephemerides
  void take(const Corrections& base, const orbit::Sky& sky);

  /// @param receiver_time the rover's own clock reading at reception
  /// @param rover what it measured, those of a satellite together
  /// @param alone the fix without phases (single or differential): its place begins the filter, its velocity
  /// is an observation, and clocks and the count of satellites are its
  ///
  /// A Float or Fixed fix with status Fix, its covariance that of the filter times max(1, s^2), s^2 the mean
  /// square of normalised innovations of the last epochs, or while fixed beside a moving base the mean square
  /// of normalised residuals; and its Fix::baseline. Beside a moving base, whose epoch must be the rover's
  /// own, the position is that of the base's fix and the baseline. `used` are satellites with a phase in it,
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

}  // namespace canyon::relative
