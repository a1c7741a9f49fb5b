#include "canyon/receiver/corrections.hpp"

#include <fmt/format.h>

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/receiver/positioning/pseudorange_model.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/sky/space_errors.hpp"

namespace canyon::receiver {

using geodesy::kSpeedOfLight;
using positioning::Measurement;
using relative::Corrections;

std::shared_ptr<const Corrections> corrections_of(const ReceiverEpoch& station,
                                                  const std::optional<Eigen::Vector3d>& place_ecef) {
  if (!place_ecef && !station.fix.solved()) return nullptr;
  Corrections corrections;
  corrections.moving = !place_ecef;
  corrections.station_ecef = place_ecef.value_or(station.fix.position_ecef);
  corrections.receiver_time = station.receiver_time;
  const auto add = [&](const SignalObservation& seen) {
    if (seen.measurement) corrections.observations.push_back({seen.signal, *seen.measurement});
  };
  for (const SatelliteObservation& satellite : station.satellites) {
    satellite.for_each_signal(add);
  }
  if (corrections.observations.empty()) return nullptr;
  return std::make_shared<const Corrections>(std::move(corrections));
}

void CodeCorrections::take(const Corrections& corrections, const orbit::Sky& sky,
                           const positioning::FixOptions& fix,
                           const std::map<gnss::System, gnss::Klobuchar>& klobuchar, double shared_m,
                           double apart_m) {
  // Deviation of a code that states none, as in RTCM, and the best of a survey receiver.
  constexpr double kLeastCode_m = 0.3;
  station_ = corrections.station;
  time_ = corrections.receiver_time;
  corrections_.clear();
  const Eigen::Vector3d& place = corrections.station_ecef;
  const geodesy::Geodetic geodetic = geodesy::geodetic_from_ecef(place);
  const Eigen::Matrix3d enu_from_ecef = geodesy::enu_from_ecef_rotation(geodetic);

  // Signals of a satellite leave it within nanoseconds: one state serves them.
  std::vector<Measurement> firsts;
  for (const relative::SignalMeasurement& seen : corrections.observations) {
    if (firsts.empty() || firsts.back().id != seen.measurement.id) firsts.push_back(seen.measurement);
  }
  std::vector<positioning::RangedSatellite> satellites =
      ranged_satellites(corrections.receiver_time, firsts, sky, {});
  std::map<gnss::SatelliteId, const positioning::RangedSatellite*> satellite_of;
  for (positioning::RangedSatellite& satellite : satellites) {
    for (int i = 0; i < 3; ++i) place_satellite(satellite, place);
    satellite_of[satellite.measured->id] = &satellite;
  }

  struct Mean {
    double sum = 0;
    int count = 0;
  };
  std::array<Mean, gnss::kSystemCount> clocks;
  // Errors of the atmosphere below 15 deg would pass for an error of the place. Satellites far below the
  // horizon are not received there at all: the place is another, and all of them say where.
  const auto below = std::count_if(satellites.begin(), satellites.end(), [&](const auto& satellite) {
    return (enu_from_ecef * satellite.direction).z() < std::sin(geodesy::radians(-5));
  });
  const double lowest_sine =
      4 * static_cast<std::size_t>(below) > satellites.size() ? -1 : std::sin(geodesy::radians(15));
  std::map<std::pair<gnss::SatelliteId, const gnss::Signal*>, Eigen::Vector3d> towards;
  const auto clock_of = [&](gnss::SatelliteId id) -> Mean& {
    return clocks[static_cast<std::size_t>(gnss::clock_system(id.system))];
  };
  for (const relative::SignalMeasurement& seen : corrections.observations) {
    const Measurement& m = seen.measurement;
    const auto found = satellite_of.find(m.id);
    if (found == satellite_of.end()) continue;
    const positioning::RangedSatellite& satellite = *found->second;
    const double atmosphere_m =
        errors::atmosphere_m(fix.correct_ionosphere, fix.correct_troposphere, klobuchar, m.id.system,
                             m.carrier_frequency_hz, corrections.receiver_time, geodetic,
                             geodesy::azimuth_elevation_from_enu(enu_from_ecef * satellite.direction));
    const double clock_s = satellite.state.clock_bias_s - satellite.state.group_delay_of(*seen.signal);
    const double metres = satellite.range_m + atmosphere_m - kSpeedOfLight * clock_s - m.pseudorange_m;
    const double code_m =
        std::sqrt(std::max(m.sigma_m * m.sigma_m - shared_m * shared_m, kLeastCode_m * kLeastCode_m));
    corrections_[{m.id, seen.signal}] = {metres, m.sigma_m, std::hypot(code_m, apart_m)};
    if ((enu_from_ecef * satellite.direction).z() > lowest_sine) {
      towards[{m.id, seen.signal}] = satellite.direction;
    }
    Mean& clock = clock_of(m.id);
    clock.sum += metres;
    ++clock.count;
  }
  for (auto& [key, correction] : corrections_) {
    const Mean& clock = clock_of(key.first);
    correction.metres -= clock.sum / clock.count;
  }
  locate(towards);
}

// A station that states a place which is off by d corrects by -towards . d and a delay of each signal in the
// station's receiver. Echoes in its codes are outliers of that: least squares with Huber's weights.
void CodeCorrections::locate(
    const std::map<std::pair<gnss::SatelliteId, const gnss::Signal*>, Eigen::Vector3d>& towards) {
  constexpr int kRounds = 20;
  constexpr double kOutlier_m = 3, kMostPdop = 5;
  struct Mean {
    Eigen::Vector3d towards = Eigen::Vector3d::Zero();
    double metres = 0, weight = 0;
  };
  std::map<std::pair<gnss::SatelliteId, const gnss::Signal*>, double> weights;
  for (const auto& [key, direction] : towards) weights[key] = 1;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  for (int round = 0; round < kRounds; ++round) {
    std::map<const gnss::Signal*, Mean> means;
    for (const auto& [key, direction] : towards) {
      Mean& mean = means[key.second];
      mean.towards += weights.at(key) * direction;
      mean.metres += weights.at(key) * corrections_.at(key).metres;
      mean.weight += weights.at(key);
    }
    const auto row = [&](const auto& key, const Eigen::Vector3d& direction) {
      const Mean& mean = means.at(key.second);
      return std::pair<Eigen::Vector3d, double>(mean.towards / mean.weight - direction,
                                                corrections_.at(key).metres - mean.metres / mean.weight);
    };
    Eigen::Matrix3d normal = Eigen::Matrix3d::Zero();
    Eigen::Vector3d right = Eigen::Vector3d::Zero();
    for (const auto& [key, direction] : towards) {
      const auto [h, metres] = row(key, direction);
      normal += weights.at(key) * h * h.transpose();
      right += weights.at(key) * h * metres;
    }
    const Eigen::Matrix3d inverse = normal.inverse();
    // The weights of later rounds are those of outliers, and all are where the place is far off.
    if (round == 0 && !(inverse.trace() < kMostPdop * kMostPdop)) return;  // true of NaN
    if (!inverse.allFinite()) break;
    offset = inverse * right;
    for (const auto& [key, direction] : towards) {
      const auto [h, metres] = row(key, direction);
      weights[key] = std::min(1.0, kOutlier_m / std::abs(metres - h.dot(offset)));
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
      "the codes of its base put the base {} from the place that it states: an error of that place is an "
      "error "
      "of the rover; check signs and datum of the place, and the time system of the base's file",
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
