#pragma once

#include <Eigen/Core>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/gps_time.hpp"
#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/receiver/rtk/correction_link.hpp"
#include "canyon/sky/gnss/signals.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::receiver {

struct ReceiverEpoch;

/// An epoch as corrections of a station; null if it measured nothing. @param antenna_position_ecef reported
/// position of its antenna [m]; empty: the station moves, and reports its own fix of the epoch; without a fix
/// it sends nothing
[[nodiscard]] std::shared_ptr<const rtk::Corrections> corrections_of(
    const ReceiverEpoch& station, const std::optional<Eigen::Vector3d>& antenna_position_ecef);

/// Corrections of pseudoranges by the latest epoch of a reference station: the range of a signal by the
/// station's position and the ephemerides, minus the measured one. They remove the errors of orbits,
/// satellite clocks and atmosphere that are common to station and receiver.
class CodeCorrections {
 public:
  struct Correction {
    double metres = 0;   ///< added to the pseudorange
    double sigma_m = 0;  ///< of the station's code
    /// Deviation without the removed errors in space, with their difference at the receiver.
    double reported_sigma_m = 0;
  };

  explicit CodeCorrections(const rtk::CorrectionOptions& options) : max_age_s_(options.max_age_s) {}

  /// Replaces the station's epoch. Removes its clock, the mean over the satellites of each constellation:
  /// corrections of a drifting clock would contradict the Doppler.
  /// @param sky the receiver's ephemerides
  /// @param fix atmosphere models of the receiver's fix. Corrections exclude them, since the fix computes
  /// them at its own position
  /// @param shared_m deviation of the errors in space in the station's codes
  /// @param apart_m deviation of their difference at the receiver
  /// Throws InputError as positioning::solve_fix() does.
  void take(const rtk::Corrections& corrections, const orbit::Sky& sky, const positioning::FixOptions& fix,
            const std::map<gnss::System, gnss::Klobuchar>& klobuchar, double shared_m = 0,
            double apart_m = 0);
  /// Age of the corrections [s], >= 0; empty if none are usable: older than
  /// rtk::CorrectionOptions::max_age_s, or more than a second ahead of `receiver_time`.
  [[nodiscard]] std::optional<double> age_s(geodesy::GpsTime receiver_time) const;
  /// Null if the station did not measure the signal.
  [[nodiscard]] const Correction* of(gnss::SatelliteId id, const gnss::Signal& signal) const;
  [[nodiscard]] int station() const { return station_; }
  /// Offset from the station's reported position to that of its own codes, mean of its last epochs (30 at
  /// most) [m]; empty if they do not determine a position (PDOP above 5). Some metres for a correct position.
  [[nodiscard]] std::optional<double> station_offset_m() const;

 private:
  /// Residual of a signal's correction, for locating the station.
  struct CorrectionResidual {
    const gnss::Signal* signal;
    Eigen::Vector3d towards;  ///< unit, from the station to the satellite
    double metres;            ///< of its correction
    double weight = 1;
  };
  void locate(std::vector<CorrectionResidual> sightings);

  double max_age_s_;
  int station_ = 0;
  std::optional<geodesy::GpsTime> time_;  // of the station's clock
  std::map<std::pair<gnss::SatelliteId, const gnss::Signal*>, Correction> corrections_;
  Eigen::Vector3d station_offset_ecef_ = Eigen::Vector3d::Zero();
  int located_ = 0;  // epochs in the mean, 30 at most
};

/// One line if station_offset_m() is more than 15 m; else empty.
[[nodiscard]] std::optional<std::string> wrong_station_warning(std::optional<double> offset_m);

}  // namespace canyon::receiver
