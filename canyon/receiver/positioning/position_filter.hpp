#pragma once

#include <map>
#include <memory>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::positioning {

/// One receiver's filter; deterministic. Epochs in order of time. An epoch's pseudoranges are processed one
/// by one, nearest to their median innovation first, each against the gate of the current state; then the
/// Dopplers of the accepted ones. A common innovation of more than 1 km is a step of the receiver's clock: a
/// whole number of milliseconds is added to the clocks, any other step makes them unknown. Satellites below
/// the masks are left out; RAIM and max_pdop apply to the fix only.
///
/// The covariance is that of white measurement errors and the options' dynamics; correlated errors (multipath
/// at rest, correlated noise) average out more slowly.
class PositionFilter {
 public:
  /// @param fix weights and masks of pseudoranges. Throws InputError for options out of range.
  PositionFilter(const PositionFilterOptions& options, const FixOptions& fix);
  ~PositionFilter();
  PositionFilter(PositionFilter&&) noexcept;
  PositionFilter& operator=(PositionFilter&&) noexcept;

  /// @param receiver_time, @param measurements, @param sky, @param klobuchar as solve_fix()
  /// @param fix the least-squares result of the same measurements: a solved one starts the filter, from its
  /// used satellites, and restarts it after coast_s. Before the start, the fix is returned. If its solution
  /// is not Single, the measurements were corrected: the result is Differential, with the fix's
  /// correction_age_s and correction_station, while it uses satellites.
  ///
  /// Returns the filter's position with its covariance. Fix::used are the satellites whose pseudorange passed
  /// the gate; residuals and DOP are theirs at the filter's position (DOP empty if they do not determine a
  /// fix), Fix::excluded failed it, Fix::clock_bias_s has all clocks of the filter, Fix::consistent is empty,
  /// iterations 1. With fewer satellites than a fix needs the status is still Fix, the prediction corrected
  /// by the available ones; without any for coast_s at most. Throws InputError if solve_fix() does and for
  /// time running backwards; the filter is then unchanged.
  [[nodiscard]] Fix update(geodesy::GpsTime receiver_time, const std::vector<Measurement>& measurements,
                           const orbit::Sky& sky, const Fix& fix,
                           const std::map<gnss::System, gnss::Klobuchar>& klobuchar = {});

  /// The same from the result of range_satellites() with the fix's options.
  [[nodiscard]] Fix update(geodesy::GpsTime receiver_time, const std::vector<RangedSatellite>& satellites,
                           const Fix& fix, const std::map<gnss::System, gnss::Klobuchar>& klobuchar);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace canyon::positioning
