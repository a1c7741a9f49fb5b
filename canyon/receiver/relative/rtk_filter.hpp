#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/base/options/fwd.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/receiver/relative/correction_link.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::relative {

/// Satellite clocks and ionosphere move apart by so much over the age of the base's epoch [m/s]: RTKLIB's
/// stats-clkstab, 5e-12 s/s.
inline constexpr double kAgeing_mps = 1.5e-3;

/// Use of whole numbers that were found.
enum class Integers : std::uint8_t {
  Continuous,     ///< they are searched for at each epoch; the filter goes on with real ones
  Instantaneous,  ///< likewise, and the filter forgets all phases from one epoch to the next
  Hold,           ///< numbers that were found hold the filter's real ones from then on ("fix and hold")
};

/// Real-time kinematic positioning relative to a base (docs/rtk.md).
struct RtkOptions {
  bool enabled = false;
  Integers integers = Integers::Continuous;
  /// The second best whole numbers must be so many times farther from the real ones than the best [1],
  /// [1.1, 10]. Default: RTKLIB's pos2-arthres.
  double ratio = 3;
  /// Probability that the search finds the right numbers, by the filter's covariance
  /// (bootstrapped_success()), [0, 1): numbers below it are refused.
  double min_success = 0.95;
  /// Whole numbers of GLONASS also where the biases of phases against codes are not known at base and rover
  /// (SignalMeasurement::aligned); right where both are of one make, whose biases are the same.
  bool fix_glonass = false;
  /// Difference of the ionosphere's vertical delays at 1575.42 MHz over the distance of base and rover [1],
  /// [0, 1e-3]: from 1 km on the filter estimates a delay for each satellite, known to so much before. 0:
  /// none.
  double ionosphere_gradient = 2e-6;
  /// Likewise of the troposphere's zenith delay, from 5 km on: one delay [1], [0, 1e-3].
  double troposphere_gradient = 1e-6;
};
void visit(options::Visitor& v, RtkOptions& o);

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
