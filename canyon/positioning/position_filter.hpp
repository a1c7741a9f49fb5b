#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "canyon/geodesy/gps_time.hpp"
#include "canyon/gnss/navigation_data.hpp"
#include "canyon/orbit/sky.hpp"
#include "canyon/positioning/fix.hpp"

namespace canyon::positioning {

/// Extended Kalman filter over pseudoranges and Doppler, as receivers for vehicles run: position and velocity
/// with white acceleration, one oscillator's drift, and a clock for each constellation that all follow the
/// oscillator (the same as one clock and an inter-system bias for each further constellation).
struct PositionFilterOptions {
  bool enabled = false;
  /// Roots of the spectral densities of the white accelerations, horizontal and vertical [m/s^2/sqrt(Hz)],
  /// (0, 100]: over dt the velocity gains N(0, density^2 dt). Horizontal: sqrt(10 m^2/s^3), of a car (Groves,
  /// Principles of GNSS, Inertial, and Multisensor Integrated Navigation Systems, 2nd ed., accel_PSD of the
  /// software's car drive GNSS_Demo_4). Vertical: that times 15/100, u-blox's limits of vertical and
  /// horizontal speed in the dynamic model "automotive" (MAX-M10M integration manual, table 8).
  double acceleration_horizontal = 3.16;
  double acceleration_vertical = 0.5;
  /// Oscillator: spectral density of white frequency, h0 / 2 [s^2/s], and of random-walk frequency, 2 pi^2
  /// h-2 [(s/s)^2/s], each (0, 1e-6]. Defaults: TCXO of low quality, h0 = 2e-19 s, h-2 = 2e-20 1/s (Brown &
  /// Hwang, Introduction to Random Signals and Applied Kalman Filtering, 4th ed., 9.3, p. 327).
  double clock_frequency_density = 1e-19;
  double clock_drift_density = 4e-19;
  /// Innovations beyond so many of their standard deviations are left out [1], > 0; infinite: none.
  double gate_sigmas = 4;
  /// After so long without a measurement that passed the gate, or with most satellites failing it, the filter
  /// begins anew [s], (0, 3600].
  double coast_s = 5;
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};

/// One receiver's filter. Same inputs, same answers. Epochs in order of time.
///
/// An epoch's pseudoranges are taken one by one, nearest to their median innovation first, each against the
/// gate of what the filter knows by then; then the Doppler of those that passed. A common innovation of more
/// than 1 km is a step of the receiver's clock: a whole number of milliseconds is added to the clocks, any
/// other step makes them unknown. Satellites below the masks are left out; RAIM and max_pdop are the fix's
/// alone.
///
/// The covariance is that of white measurement errors and the options' dynamics; errors that last (multipath
/// at rest, correlated noise) average out slower than it says.
class PositionFilter {
 public:
  /// @param weights and masks of pseudoranges as in the fix. Throws InputError for options out of range.
  PositionFilter(const PositionFilterOptions& options, const FixOptions& fix);
  ~PositionFilter();
  PositionFilter(PositionFilter&&) noexcept;
  PositionFilter& operator=(PositionFilter&&) noexcept;

  /// @param receiver_time, @param measurements, @param sky, @param klobuchar as solve_fix()
  /// @param fix the least-squares answer of the same measurements: a solved one starts the filter, from its
  /// used satellites, and starts it anew after coast_s; else it is only returned, where the filter has not
  /// begun
  ///
  /// Returns the filter's position with its covariance. Fix::used are the satellites whose pseudorange passed
  /// the gate; residuals and DOP are theirs at the filter's position (DOP empty where they do not determine a
  /// fix), Fix::excluded failed it, Fix::clock_bias_s has all clocks that the filter knows, Fix::consistent
  /// is empty, iterations 1. With fewer satellites than a fix needs there still is an answer with status Fix,
  /// the prediction corrected by what there is; without any for coast_s at most. Throws InputError where
  /// solve_fix() does and for time running backwards; the filter then is as before.
  [[nodiscard]] Fix update(geodesy::GpsTime receiver_time, const std::vector<Measurement>& measurements,
                           const orbit::Sky& sky, const Fix& fix,
                           const std::map<gnss::System, gnss::Klobuchar>& klobuchar = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace canyon::positioning
