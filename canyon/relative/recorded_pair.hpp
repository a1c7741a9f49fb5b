#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "canyon/orbit/sky.hpp"
#include "canyon/positioning/fix.hpp"
#include "canyon/relative/corrections.hpp"
#include "canyon/relative/rtk_options.hpp"
#include "canyon/rinex/observation_reader.hpp"

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

/// Recording of an observation file. @param biases of its header
/// @param place of its antenna, ECEF [m]; a rover's is not used
[[nodiscard]] RecordedEpochs recorded_epochs(const std::vector<rinex::ObservationEpoch>& recorded,
                                             const GlonassBiases& biases, const orbit::Sky& sky,
                                             const Eigen::Vector3d& place = Eigen::Vector3d::Zero());

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

}  // namespace canyon::relative
