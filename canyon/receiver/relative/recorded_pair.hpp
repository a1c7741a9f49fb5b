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
#include "canyon/receiver/relative/correction_link.hpp"
#include "canyon/receiver/relative/observed_minus_computed.hpp"
#include "canyon/receiver/relative/rtk_filter.hpp"
#include "canyon/sky/gnss/satellite_id.hpp"
#include "canyon/sky/gnss/signals.hpp"
#include "canyon/sky/orbit/sky.hpp"
#include "canyon/sky/rinex/observation_reader.hpp"

namespace canyon::relative {

/// Options of solving a recorded rover beside a recorded base.
struct PairOptions {
  RtkOptions rtk;
  positioning::FixOptions fix;       ///< masks, and the fix of single epochs that begins the filter
  double max_age_s = 60;             ///< of the base's epoch
  std::vector<std::string> signals;  ///< names of gnss::signals_of(); empty: all that both have
};

struct PairEpoch {
  geodesy::GpsTime receiver_time;  ///< the rover's tag
  positioning::Fix fix;
};

/// Recording of one receiver, in order of time: an observation file, or a stream of RTCM 3
/// (rtcm::read_rtcm_corrections()).
using RecordedEpochs = std::vector<std::shared_ptr<const Corrections>>;

/// Recording of an observation file, with the place of its antenna that its header states for each epoch.
/// @param place of its antenna instead, ECEF [m]; NaN where neither says it. A rover's is not used
[[nodiscard]] RecordedEpochs recorded_epochs(const std::vector<rinex::ObservationEpoch>& recorded,
                                             const orbit::Sky& sky,
                                             const std::optional<Eigen::Vector3d>& place = {});

/// Solves each epoch of the rover with the latest base's epoch that is not behind it, in order of time:
/// fixed, float, or the fix of the epoch alone.
/// @param progress may be empty; called with epochs done and in all
/// Throws InputError for options out of range, and where base and rover share no time or no signal.
[[nodiscard]] std::vector<PairEpoch> solve_pair(
    const RecordedEpochs& rover, const RecordedEpochs& base, const orbit::Sky& sky,
    const std::map<gnss::System, gnss::Klobuchar>& klobuchar, const PairOptions& options,
    const std::function<void(std::size_t, std::size_t)>& progress = {});

/// Writes RTKLIB's format of solutions (".pos", GPST, degrees, ellipsoidal heights), which rtkplot reads: a
/// header that names `program`, a line for each solved epoch, quality 1 fixed, 2 float, 4 differential, 5
/// single (RTKLIB 2.4.2 manual, appendix B.1).
[[nodiscard]] std::string rtklib_solutions(const std::vector<PairEpoch>& epochs, const std::string& program);

/// Turns epochs of an observation file into what a rover or a base measured; remembers since when phases are
/// continuous: a phase that was missing, is of another code, or whose loss-of-lock indicator says so, begins
/// anew.
class RecordedSignals {
 public:
  /// @param sky gives the carriers of GLONASS satellites; must outlive this
  explicit RecordedSignals(const orbit::Sky& sky) : sky_(sky) {}

  /// Measurements with a pseudorange, of satellites that the sky knows. Epochs come in order of time.
  [[nodiscard]] std::vector<SignalMeasurement> next(const rinex::ObservationEpoch& epoch);

 private:
  struct Phase {
    geodesy::GpsTime since, seen;
    std::array<char, 3> code{};  // of RINEX
  };
  const orbit::Sky& sky_;
  std::optional<geodesy::GpsTime> before_;  // the epoch before
  std::map<std::pair<gnss::SatelliteId, const gnss::Signal*>, Phase> phases_;
};

/// Finds phases of one receiver that moved by something else than their Doppler since the epoch before.
class DopplerSlips {
 public:
  /// Takes the next epoch, `dt_s` after the last one. @param rover those to look at @param measured all, with
  /// phase and Doppler. More than four steps must be known: their median is the receiver's clock.
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

}  // namespace canyon::relative
