// Declared in canyon/output/formats.hpp.
#include <fmt/format.h>

#include <cmath>

#include "canyon/geodesy/constants.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/output/formats.hpp"
#include "canyon/output/number.hpp"

// True poses in the columns of UrbanNav's ground truth (UrbanNav_TST_GT.txt of 2021), an export of NovAtel's
// Inertial Explorer: UNIX time, GPS week, time of week, latitude and longitude as degrees, minutes, seconds,
// height above the ellipsoid, velocity and acceleration to the right, ahead and up [m/s, m/s^2], roll (right
// side down), pitch (nose up), heading (clockwise from north, -180 to 180) [deg], quality (1: the best).

namespace canyon::output {
namespace {

/// "114 10 44.60559": whole degrees with the sign, minutes and seconds without.
std::string sexagesimal(double degrees) {
  constexpr std::int64_t kStepsOfSecond = 100'000;
  const std::int64_t steps = std::llround(std::abs(degrees) * 3600 * static_cast<double>(kStepsOfSecond));
  const std::int64_t seconds = steps / kStepsOfSecond;
  return fmt::format("{}{} {:02d} {:02d}.{:05d}", degrees < 0 ? "-" : "", seconds / 3600, seconds / 60 % 60,
                     seconds % 60, steps % kStepsOfSecond);
}

class UrbanNavTruth final : public Encoder {
 public:
  std::string encode(const simulation::Epoch& epoch) override {
    const simulation::Pose& truth = epoch.truth;
    if (!std::isfinite(truth.position.height_m)) return {};
    const Eigen::Vector3d ahead = truth.forward_enu(), up = truth.up_enu(), right = ahead.cross(up);
    const auto body = [&](const Eigen::Vector3d& enu) {
      return fmt::format(" {:>7} {:>7} {:>7}", fixed(enu.dot(right), 3), fixed(enu.dot(ahead), 3),
                         fixed(enu.dot(up), 3));
    };
    const auto unix_ns = geodesy::unix_from_gps(truth.time);
    const double heading_deg =
        std::remainder(90 - geodesy::degrees(truth.yaw_rad), 360);  // from north, clockwise
    return fmt::format("{} {:>13.5f} {:>12}   {}  {} {:>12}{}{} {:>14} {:>14} {:>14} 1\n",
                       fixed(static_cast<double>(unix_ns) * 1e-9, 2), static_cast<double>(truth.time.week()),
                       seconds_of_week(truth.time, 5),
                       sexagesimal(geodesy::degrees(truth.position.latitude_rad)),
                       sexagesimal(geodesy::degrees(truth.position.longitude_rad)),
                       fixed(truth.position.height_m, 3), body(truth.velocity_enu_mps),
                       body(truth.acceleration_enu_mps2), fixed(geodesy::degrees(truth.roll_rad), 10),
                       fixed(geodesy::degrees(truth.pitch_rad), 10), fixed(heading_deg, 9));
  }
};

}  // namespace

std::unique_ptr<Encoder> encode_urbannav_gt(const ReceiverDescription& /*receiver*/) {
  return std::make_unique<UrbanNavTruth>();
}

}  // namespace canyon::output
