#include "canyon/outputs/live/pose_source.hpp"

#include <fmt/format.h>

#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/simulation/motion/trajectory.hpp"

namespace canyon::live {

using Eigen::Quaterniond;
using Eigen::Vector3d;

PoseSource::PoseSource(const simulation::PoseSourceOptions& options, const geodesy::LocalFrame& frame,
                       double geoid_undulation_m)
    : options_(options),
      frame_(frame),
      sent_zero_m_(options.format == simulation::PoseFormat::MAVLink ? geoid_undulation_m : 0),
      decoder_(make_decoder(options)),
      track_(options.from, options.track) {}

std::optional<simulation::ReportedPose> PoseSource::in_city(const PoseReport& report, double now_s) {
  if (!options_.id.empty() && report.id != options_.id) return std::nullopt;
  simulation::ReportedPose sent;
  sent.stamp_s = report.stamp_s.value_or(now_s);
  Eigen::Matrix3d rotation;
  double scale = 1;
  if (report.position) {
    // An autopilot without a fix sends latitude 0, longitude 0.
    constexpr double kFarFromZero_m = 100e3;
    const bool zero = report.position->latitude_rad == 0 && report.position->longitude_rad == 0 &&
                      frame_.local_from_geodetic({0, 0, 0}).norm() > kFarFromZero_m;
    if (zero || !std::isfinite(report.position->height_m)) {
      sent.pose.position_m.setConstant(std::nan(""));
      return sent;
    }
    geodesy::Geodetic position = *report.position;
    position.height_m += sent_zero_m_;
    sent.pose.position_m = frame_.local_from_geodetic(position);
    rotation = frame_.ecef_from_local_rotation().transpose() *
               geodesy::enu_from_ecef_rotation(*report.position).transpose();
  } else {
    rotation = Eigen::AngleAxisd(options_.heading_rad, Vector3d::UnitZ()).toRotationMatrix();
    scale = options_.scale;
    sent.pose.position_m = options_.origin_enu_m + rotation * (scale * *report.position_m);
  }
  if (report.velocity_mps) sent.linear_velocity = rotation * (scale * *report.velocity_mps);
  const simulation::RigidPose body{sent.pose.position_m, Quaterniond::Identity(),
                                   sent.linear_velocity.value_or(Vector3d::Zero())};
  if (!simulation::is_possible(simulation::pose_of(body, {frame_}, {}), frame_)) {
    sent.pose.position_m.setConstant(std::nan(""));
    return sent;
  }
  if (report.attitude) {
    sent.pose.attitude = Quaterniond(rotation) * *report.attitude;
    if (report.rates_body_radps) sent.angular_velocity = sent.pose.attitude * *report.rates_body_radps;
    return sent;
  }
  // Without an attitude the heading is the direction of motion.
  Vector3d velocity = sent.linear_velocity.value_or(Vector3d::Zero());
  if (!sent.linear_velocity && before_ && sent.stamp_s > before_->first)
    velocity = (sent.pose.position_m - before_->second) / (sent.stamp_s - before_->first);
  before_ = {sent.stamp_s, sent.pose.position_m};
  if (velocity.head<2>().norm() >= simulation::Trajectory::kStandstill_mps)
    attitude_ = Eigen::AngleAxisd(std::atan2(velocity.y(), velocity.x()), Vector3d::UnitZ());
  sent.pose.attitude = attitude_;
  sent.angular_velocity = Vector3d::Zero();
  return sent;
}

void PoseSource::count(const PoseReport& report, const simulation::ReportedPose& sent) {
  // Beyond the city's streets; its axes differ from local ENU at the vehicle by 1 deg.
  constexpr double kFar_m = 100e3;
  ++count_;
  last_stamp_s_ = report.stamp_s;
  const double distance_m = sent.pose.position_m.norm();
  if (distance_m <= kFar_m)
    warned_far_ = false;
  else if (!std::exchange(warned_far_, true))
    far_m_ = distance_m;
}

void PoseSource::watch_pace(double stamp_s, double now_s) {
  constexpr double kAfter_s = 2, kFastest = 20;
  if (!pace_from_) pace_from_ = {stamp_s, now_s};
  const double passed_s = now_s - pace_from_->second;
  if (passed_s < kAfter_s) return;
  const double pace = (stamp_s - pace_from_->first) / passed_s;
  if (pace > kFastest && !std::exchange(warned_pace_, true)) {
    pace_note_ = fmt::format(
        "warning: timestamps advance {:.0f} s per second, so the vehicle appears stationary; check that they "
        "are in "
        "seconds",
        pace);
  }
  pace_from_ = {stamp_s, now_s};
}

void PoseSource::receive(const transport::Received& received, std::int64_t now_ns,
                         const std::function<void()>& taken) {
  decoder_->receive(received, [&](const PoseReport& report) {
    if (!take(report, now_ns)) return;
    if (report.stamp_s) watch_pace(*report.stamp_s, seconds(now_ns));
    if (taken) taken();
  });
}

void PoseSource::receive_log(const transport::Received& received, bool since_zero,
                             const std::function<void(std::int64_t)>& taken,
                             const std::function<bool()>& restarted) {
  decoder_->receive(received, [&](const PoseReport& report) {
    if (!options_.id.empty() && report.id != options_.id) return;
    constexpr double kMax_s = 1e9;
    const double stamp_s = report.stamp_s.value_or(std::nan(""));
    const double step_s = stamp_s - last_stamp_s_.value_or(stamp_s);
    if (step_s < -options_.track.timeout_s || step_s > kMaxGap_s) {
      if (!restarted()) {
        ++foreign_clock_count_;
        return;
      }
      track_.reset();
      first_stamp_s_.reset();
      last_stamp_s_.reset();
      before_.reset();
    }
    const double now_s = stamp_s - (since_zero ? 0 : first_stamp_s_.value_or(stamp_s));
    if (!(std::abs(now_s) < kMax_s)) {
      ++impossible_;
      return;
    }
    if (!first_stamp_s_) first_stamp_s_ = stamp_s;
    const auto now_ns = static_cast<std::int64_t>(std::llround(now_s * 1e9));
    if (take(report, now_ns)) taken(now_ns);
  });
}

bool PoseSource::take(const PoseReport& report, std::int64_t now_ns) {
  const auto sent = in_city(report, seconds(now_ns));
  if (!sent) return false;
  switch (track_.add(*sent, now_ns)) {
    case simulation::PoseTrack::PoseResult::Yes:
      count(report, *sent);
      return true;
    case simulation::PoseTrack::PoseResult::NoPose:
      ++impossible_;
      break;
    case simulation::PoseTrack::PoseResult::Old:
      // Two poses of a stationary vehicle without stamps are equal if they are read together.
      if (report.stamp_s) ++old_;
      break;
  }
  return false;
}

std::vector<std::string> PoseSource::take_notes() {
  std::vector<std::string> notes;
  if (std::string complaint = decoder_->take_decode_errors(); !complaint.empty()) notes.push_back(complaint);
  if (std::string unused = decoder_->take_unused(); !unused.empty()) notes.push_back(unused);
  if (!pace_note_.empty()) notes.push_back(std::exchange(pace_note_, {}));
  if (const double far_m = std::exchange(far_m_, 0); far_m > 0) {
    notes.push_back(fmt::format(
        "warning: the vehicle is {:.0f} km from the city's origin ({:.4f}, {:.4f}), outside the "
        "city: check the poses' latitude and longitude, or the source's east_m, north_m and scale",
        far_m / 1e3, geodesy::degrees(frame_.origin().latitude_rad),
        geodesy::degrees(frame_.origin().longitude_rad)));
  }
  if (const auto n = std::exchange(impossible_, 0); n > 0) {
    notes.push_back(
        fmt::format("{} {} dropped: not finite, without a stamp, more than 10000 km from the city's origin, "
                    "or faster than 1000 km/s",
                    n, n == 1 ? "pose was" : "poses were"));
  }
  if (const auto n = std::exchange(old_, 0); n > 0)
    notes.push_back(fmt::format("{} {} received twice or too late: dropped", n, n == 1 ? "pose" : "poses"));
  return notes;
}

}  // namespace canyon::live
