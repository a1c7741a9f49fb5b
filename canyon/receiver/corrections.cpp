#include "canyon/receiver/corrections.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/receiver/rtk/observed_minus_computed.hpp"

namespace canyon::receiver {

using rtk::Corrections;

std::shared_ptr<const Corrections> corrections_of(
    const ReceiverEpoch& station, const std::optional<Eigen::Vector3d>& antenna_position_ecef) {
  if (!antenna_position_ecef && !station.fix.solved()) return nullptr;
  Corrections corrections;
  corrections.moving = !antenna_position_ecef;
  corrections.station_ecef = antenna_position_ecef.value_or(station.fix.position_ecef);
  corrections.receiver_time = station.receiver_time;
  const auto add = [&](const SignalObservation& seen) {
    if (seen.measurement) corrections.observations.push_back({seen.signal, *seen.measurement});
  };
  for (const SatelliteObservation& satellite : station.satellites) satellite.for_each_signal(add);
  if (corrections.observations.empty()) return nullptr;
  return std::make_shared<const Corrections>(std::move(corrections));
}

void CodeCorrections::take(const Corrections& corrections, const orbit::Sky& sky,
                           const positioning::FixOptions& fix,
                           const std::map<gnss::System, gnss::Klobuchar>& klobuchar, double shared_m,
                           double apart_m) {
  // Deviation of a code without one, as in RTCM, and the smallest one of a survey receiver.
  constexpr double kMinCode_m = 0.3;
  station_ = corrections.station;
  time_ = corrections.receiver_time;
  corrections_.clear();
  positioning::FixOptions all = fix;
  all.elevation_mask_rad = -geodesy::kPi / 2;
  all.cn0_mask_dbhz = 0;
  const auto computed = observed_minus_computed(corrections.receiver_time, corrections.observations, sky, all,
                                                corrections.station_ecef, klobuchar);

  struct Mean {
    double sum = 0;
    int count = 0;
  };
  std::array<Mean, gnss::kSystemCount> clocks;
  const auto clock_of = [&](gnss::SatelliteId id) -> Mean& {
    return clocks[static_cast<std::size_t>(gnss::clock_system(id.system))];
  };
  // Errors of the atmosphere below 15 deg would look like an error of the position. Satellites far below the
  // horizon cannot be received: the reported position is wrong, and these satellites locate the true one.
  std::map<gnss::SatelliteId, bool> is_below;
  for (const auto& seen : computed) is_below[seen.id] = seen.elevation_rad < geodesy::radians(-5);
  const auto below =
      std::count_if(is_below.begin(), is_below.end(), [](const auto& each) { return each.second; });
  const double lowest_rad =
      4 * static_cast<std::size_t>(below) > is_below.size() ? -geodesy::kPi : geodesy::radians(15);
  for (const rtk::ObservedMinusComputed& seen : computed) {
    const double code_m =
        std::sqrt(std::max(seen.sigma_m * seen.sigma_m - shared_m * shared_m, kMinCode_m * kMinCode_m));
    corrections_[{seen.id, seen.signal}] = {-seen.code_m, seen.sigma_m, std::hypot(code_m, apart_m)};
    Mean& clock = clock_of(seen.id);
    clock.sum -= seen.code_m;
    ++clock.count;
  }
  std::vector<CorrectionResidual> sightings;
  for (const rtk::ObservedMinusComputed& seen : computed) {
    const Mean& clock = clock_of(seen.id);
    double& metres = corrections_.at({seen.id, seen.signal}).metres;
    metres -= clock.sum / clock.count;
    if (seen.elevation_rad > lowest_rad) sightings.push_back({seen.signal, seen.direction, metres});
  }
  locate(std::move(sightings));
}

// A station whose reported position is off by d gives corrections of -towards . d plus a delay of each signal
// in the station's receiver. Echoes in its codes are outliers: least squares with Huber's weights.
void CodeCorrections::locate(std::vector<CorrectionResidual> sightings) {
  constexpr int kRounds = 20;
  constexpr double kOutlier_m = 3, kMaxPdop = 5;
  struct Mean {
    Eigen::Vector3d towards = Eigen::Vector3d::Zero();
    double metres = 0, weight = 0;
  };
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  for (int round = 0; round < kRounds; ++round) {
    std::map<const gnss::Signal*, Mean> means;
    for (const CorrectionResidual& seen : sightings) {
      Mean& mean = means[seen.signal];
      mean.towards += seen.weight * seen.towards;
      mean.metres += seen.weight * seen.metres;
      mean.weight += seen.weight;
    }
    const auto row = [&](const CorrectionResidual& seen) {
      const Mean& mean = means.at(seen.signal);
      return std::pair<Eigen::Vector3d, double>(mean.towards / mean.weight - seen.towards,
                                                seen.metres - mean.metres / mean.weight);
    };
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const CorrectionResidual& seen : sightings) {
      const auto [h, metres] = row(seen);
      normal += seen.weight * h * h.transpose();
      right += seen.weight * h * metres;
    }
    const Eigen::Matrix3d inverse = normal.inverse();
    // The weights of later rounds are those of outliers; all weights are small if the position is far off.
    if (round == 0 && !(inverse.trace() < kMaxPdop * kMaxPdop)) return;  // true for NaN
    if (!inverse.allFinite()) break;
    offset = inverse * right;
    for (CorrectionResidual& seen : sightings) {
      const auto [h, metres] = row(seen);
      seen.weight = std::min(1.0, kOutlier_m / std::abs(metres - h.dot(offset)));
    }
  }
  located_ = std::min(located_ + 1, 30);
  station_offset_ecef_ += (offset - station_offset_ecef_) / located_;
}

std::optional<double> CodeCorrections::station_offset_m() const {
  return located_ > 0 ? std::optional(station_offset_ecef_.norm()) : std::nullopt;
}

std::optional<std::string> wrong_station_warning(std::optional<double> offset_m) {
  constexpr double kWrong_m = 15;
  if (!(offset_m > kWrong_m)) return std::nullopt;
  const std::string far =
      *offset_m < 1e5 ? fmt::format("{:.0f} m", *offset_m) : fmt::format("some {:.0f} km", *offset_m / 1e3);
  return fmt::format(
      "the base's pseudoranges put it {} from its reported position; this error shifts the rover; check "
      "signs and datum of the position, and the time system of the base's file",
      far);
}

std::optional<double> CodeCorrections::age_s(geodesy::GpsTime receiver_time) const {
  constexpr double kAhead_s = 1;  // clocks of receivers differ by milliseconds
  if (!time_) return std::nullopt;
  const double age_s = receiver_time - *time_;
  if (age_s > max_age_s_ || age_s < -kAhead_s) return std::nullopt;
  return std::max(age_s, 0.0);
}

const CodeCorrections::Correction* CodeCorrections::of(gnss::SatelliteId id,
                                                       const gnss::Signal& signal) const {
  const auto found = corrections_.find({id, &signal});
  return found == corrections_.end() ? nullptr : &found->second;
}

}  // namespace canyon::receiver
