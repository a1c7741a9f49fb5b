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
#include "canyon/receiver/relative/correction_link.hpp"
#include "canyon/sky/gnss/signals.hpp"
#include "canyon/sky/orbit/sky.hpp"

namespace canyon::receiver {

struct ReceiverEpoch;

/// An epoch as a station gives it; null where it measured nothing. @param place_ecef of its antenna as it
/// states it [m]; empty: it moves, and states its own fix of the epoch, without one nothing
[[nodiscard]] std::shared_ptr<const relative::Corrections> corrections_of(
    const ReceiverEpoch& station, const std::optional<Eigen::Vector3d>& place_ecef);

/// Corrections of pseudoranges by the latest epoch of a reference station: the range of a signal by its place
/// and the ephemerides, less the measured one. They remove the errors of orbits, satellite clocks and
/// atmosphere that station and receiver share.
class CodeCorrections {
 public:
  struct Correction {
    double metres = 0;   ///< to be added to the pseudorange
    double sigma_m = 0;  ///< of the station's code
    /// The same without the errors from space that the correction takes away, and with what they differ by at
    /// the receiver.
    double stated_sigma_m = 0;
  };

  explicit CodeCorrections(const relative::CorrectionOptions& options) : max_age_s_(options.max_age_s) {}

  /// The station's epoch in the place of the one before. Its clock, as the mean over the satellites of each
  /// constellation, is taken off: corrections of a drifting clock would contradict the Doppler.
  /// @param sky the receiver's ephemerides
  /// @param fix the models of the atmosphere that the receiver's fix applies are taken off here, so that they
  /// bridge the places
  /// @param shared_m deviation of the errors from space in the station's codes
  /// @param apart_m deviation of what they differ by at the receiver
  /// Throws InputError as positioning::solve_fix() does.
  void take(const relative::Corrections& corrections, const orbit::Sky& sky,
            const positioning::FixOptions& fix, const std::map<gnss::System, gnss::Klobuchar>& klobuchar,
            double shared_m = 0, double apart_m = 0);
  /// How old the corrections are [s], >= 0; empty where there are none that may be used: older than
  /// relative::CorrectionOptions::max_age_s, or more than a second ahead of `receiver_time`.
  [[nodiscard]] std::optional<double> age_s(geodesy::GpsTime receiver_time) const;
  /// Null where the station did not measure the signal.
  [[nodiscard]] const Correction* of(gnss::SatelliteId id, const gnss::Signal& signal) const;
  [[nodiscard]] int station() const { return station_; }
  /// From the place that the station states to that which its own codes have, mean of its last epochs (30 at
  /// most) [m]; empty where they do not determine one (PDOP above 5). Some metres where the statement is
  /// right.
  [[nodiscard]] std::optional<double> station_offset_m() const;

 private:
  /// A signal whose correction says where the station is.
  struct Sighting {
    const gnss::Signal* signal;
    Eigen::Vector3d towards;  ///< unit, from the station to the satellite
    double metres;            ///< of its correction
    double weight = 1;
  };
  void locate(std::vector<Sighting> sightings);

  double max_age_s_;
  int station_ = 0;
  std::optional<geodesy::GpsTime> time_;  // of the station's clock
  std::map<std::pair<gnss::SatelliteId, const gnss::Signal*>, Correction> corrections_;
  Eigen::Vector3d station_offset_ecef_ = Eigen::Vector3d::Zero();
  int located_ = 0;  // epochs in the mean, 30 at most
};

/// One line where station_offset_m() is more than 15 m; else empty.
[[nodiscard]] std::optional<std::string> wrong_station_warning(std::optional<double> offset_m);

}  // namespace canyon::receiver
