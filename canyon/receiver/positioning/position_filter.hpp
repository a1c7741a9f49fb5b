#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::positioning {

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
  /// begun. Where its solution is not Single, the measurements were corrected: the answer is Differential,
  /// with the fix's correction_age_s and correction_station, as long as it uses satellites.
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

  /// The same of range_satellites() with the fix's options.
  [[nodiscard]] Fix update(geodesy::GpsTime receiver_time, const std::vector<RangedSatellite>& satellites,
                           const Fix& fix, const std::map<gnss::System, gnss::Klobuchar>& klobuchar);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace canyon::positioning
