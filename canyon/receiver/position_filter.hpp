#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "canyon/geodesy/gps_time.hpp"
#include "canyon/orbit/navigation_data.hpp"
#include "canyon/orbit/sky.hpp"
#include "canyon/receiver/fix.hpp"

namespace canyon::receiver {

/// Extended Kalman filter over pseudoranges and Doppler, as receivers for vehicles run: position and velocity
/// with white acceleration, clock bias and drift, one bias per further system.
struct PositionFilterOptions {
  bool enabled = false;
  /// Spectral densities of the white accelerations, horizontal and vertical [m/s^2/sqrt(Hz)], (0, 100].
  double acceleration_horizontal = 2;
  double acceleration_vertical = 0.5;
  /// Clock: white frequency and random-walk frequency [s^2/s], [1/s^2 s]: h0 / 2 and 2 pi^2 h-2 of a TCXO
  /// (Brown & Hwang, 4th ed., table 9.1).
  double clock_frequency_density = 1e-19;
  double clock_drift_density = 4e-20;
  /// Innovations beyond so many standard deviations are left out [1], > 0; infinite: none.
  double gate_sigmas = 4;
  /// After so long without a measurement the filter begins anew [s], > 0.
  double coast_s = 5;
  /// Throws InputError naming the field that is out of range.
  void validate() const;
};

/// One receiver's filter. Same inputs, same answers. Epochs in order of time.
class PositionFilter {
 public:
  /// @param weights and masks of pseudoranges as in the fix. Throws InputError for options out of range.
  PositionFilter(const PositionFilterOptions& options, const FixOptions& fix);
  ~PositionFilter();
  PositionFilter(PositionFilter&&) noexcept;
  PositionFilter& operator=(PositionFilter&&) noexcept;

  /// The filter's position with its covariance; DOP and residuals are those of the satellites that passed the
  /// gate, at the filter's position. `fix` is the least-squares answer of the same measurements: it starts
  /// the filter (needs a solved one) and starts it anew after coast_s. Between, an epoch with fewer
  /// satellites than a fix needs still has an answer, the prediction corrected by what there is; Fix::used
  /// says which, and status Fix. An epoch without any measurement coasts for coast_s at most.
  [[nodiscard]] Fix update(geodesy::GpsTime receiver_time, const std::vector<Measurement>& measurements,
                           const orbit::Sky& sky, const Fix& fix,
                           const std::map<orbit::System, orbit::Klobuchar>& klobuchar = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace canyon::receiver
