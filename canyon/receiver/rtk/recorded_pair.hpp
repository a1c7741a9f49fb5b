#pragma once

#include <array>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "canyon/receiver/positioning/fix.hpp"
#include "canyon/receiver/rtk/correction_link.hpp"
#include "canyon/receiver/rtk/observed_minus_computed.hpp"
#include "canyon/receiver/rtk/rtk_filter.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"
#include "canyon/sky/gnss/signals.hpp"
#include "canyon/sky/orbit/sky.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"

namespace canyon::rtk {

/// Options of solving a recorded rover relative to a recorded base.
struct PairOptions {
  RtkOptions rtk;
  positioning::FixOptions fix;       ///< masks, and the single-epoch fix that starts the filter
  double max_age_s = 60;             ///< of the base's epoch
  std::vector<std::string> signals;  ///< names of gnss::signals_of(); empty: all common ones
};

struct PairEpoch {
  geodesy::GpsTime receiver_time;  ///< the rover's time tag
  positioning::Fix fix;
};

/// Recording of one receiver, in order of time: an observation file, or a stream of RTCM 3
/// (rtcm::read_rtcm_corrections()).
using RecordedEpochs = std::vector<std::shared_ptr<const Corrections>>;

/// Recording of an observation file, with the antenna position of its header in each epoch.
/// @param point replaces that position, ECEF [m]; NaN if both are unknown. Not used for a rover
[[nodiscard]] RecordedEpochs recorded_epochs(const std::vector<rinex::ObservationEpoch>& recorded,
                                             const orbit::Sky& sky,
                                             const std::optional<Eigen::Vector3d>& point = {});

/// Solves each epoch of the rover with the latest epoch of the base that is not later, in order of time:
/// fixed, float, or the single-epoch fix.
/// @param progress may be empty; called with the number of finished epochs and the total
/// Throws InputError for options out of range, and if base and rover have no common time or signal.
[[nodiscard]] std::vector<PairEpoch> solve_pair(
    const RecordedEpochs& rover, const RecordedEpochs& base, const orbit::Sky& sky,
    const std::map<gnss::System, gnss::Klobuchar>& klobuchar, const PairOptions& options,
    const std::function<void(std::size_t, std::size_t)>& progress = {});

/// Converts epochs of an observation file into measurements of a rover or a base. Stores the start of each
/// phase's continuity: a phase restarts after a gap, a change of code, or by its loss-of-lock indicator.
class RecordedSignals {
 public:
  /// @param sky gives the carriers of GLONASS satellites; must outlive this
  explicit RecordedSignals(const orbit::Sky& sky) : sky_(sky) {}

  /// Measurements with a pseudorange, of satellites of the sky. Epochs come in order of time.
  [[nodiscard]] std::vector<SignalMeasurement> next(const rinex::ObservationEpoch& epoch);

 private:
  struct Phase {
    geodesy::GpsTime since, seen;
    std::array<char, 3> code{};  // of RINEX
  };
  const orbit::Sky& sky_;
  std::optional<geodesy::GpsTime> before_;  // the previous epoch
  std::map<std::pair<gnss::SatelliteId, const gnss::Signal*>, Phase> phases_;
};

/// Finds phases of one receiver that moved differently from their Doppler since the previous epoch.
class DopplerSlips {
 public:
  /// Processes the next epoch, `dt_s` after the last one. @param rover phases to check @param measured all,
  /// with phase and Doppler. Needs more than four known steps: their median is the receiver's clock.
  void update(double dt_s, std::span<const ObservedMinusComputed> rover,
              std::span<const SignalMeasurement> measured);
  /// Whether this phase slipped in the last epoch.
  [[nodiscard]] bool contains(gnss::SatelliteId id, const gnss::Signal* signal) const;

 private:
  struct Step {
    double phase_m = 0, doppler_mps = 0, apart_m = 0;
  };
  std::map<std::pair<gnss::SatelliteId, const gnss::Signal*>, Step> last_steps_;
  std::vector<std::pair<gnss::SatelliteId, const gnss::Signal*>> slipped_;
};

}  // namespace canyon::rtk
