#include "canyon/outputs/live/mavlink_poses.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <string_view>
#include <variant>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/mavlink/frames.hpp"
#include "canyon/base/transport/link.hpp"
#include "canyon/simulation/motion/recorded_path.hpp"

namespace canyon::live {
namespace {

using Eigen::Matrix3d;
using Eigen::Quaterniond;
using Eigen::Vector3d;
using simulation::BodyAxes;
using simulation::WorldAxes;

const Matrix3d& enu_from_ned() {
  static const Matrix3d rotation = enu_from(WorldAxes::NED);
  return rotation;
}
const Matrix3d& flu_from_frd() {
  static const Matrix3d rotation = flu_from(BodyAxes::FRD);
  return rotation;
}

std::optional<Quaterniond> attitude(const mavlink::Quaternion& q, const Matrix3d& enu_from_world,
                                    const Matrix3d& flu_from_body) {
  const Quaterniond world_from_body(q[0], q[1], q[2], q[3]);
  if (!(world_from_body.norm() > 1e-6)) return std::nullopt;
  return Quaterniond(enu_from_world * world_from_body.normalized().toRotationMatrix() *
                     flu_from_body.transpose());
}
std::optional<Quaterniond> attitude(const mavlink::Quaternion& ned_from_frd) {
  return attitude(ned_from_frd, enu_from_ned(), flu_from_frd());
}
std::optional<Quaterniond> attitude(const Vector3d& roll_pitch_yaw) {
  const Quaterniond q = Eigen::AngleAxisd(roll_pitch_yaw.z(), Vector3d::UnitZ()) *
                        Eigen::AngleAxisd(roll_pitch_yaw.y(), Vector3d::UnitY()) *
                        Eigen::AngleAxisd(roll_pitch_yaw.x(), Vector3d::UnitX());
  return attitude(mavlink::Quaternion{q.w(), q.x(), q.y(), q.z()});
}

/// MAV_FRAME of Odometry: the axes of the frames that Canyon supports.
struct MavFrame {
  int number;
  bool ned;  ///< NED, else ENU; for bodies FRD, else FLU
};
constexpr std::array<MavFrame, 5> kLocalFrames{
    {{1, true}, {4, false}, {7, true}, {20, true}, {21, false}}};  // LOCAL_NED, LOCAL_ENU, LOCAL_OFFSET_NED,
                                                                   // LOCAL_FRD, LOCAL_FLU
constexpr std::array<MavFrame, 3> kBodyFrames{{{8, true}, {12, true}, {13, false}}};  // BODY_NED, _FRD, _FLU

template <std::size_t N>
std::optional<bool> is_ned(const std::array<MavFrame, N>& frames, int number) {
  for (const MavFrame& frame : frames)
    if (frame.number == number) return frame.ned;
  return std::nullopt;
}

/// A time of 0 means unknown, as in PX4's HIL_STATE_QUATERNION.
constexpr std::optional<double> us(std::uint64_t time_us) {
  if (time_us == 0) return std::nullopt;
  return static_cast<double>(time_us) * 1e-6;
}

class MavlinkPoses final : public PoseDecoder {
 public:
  explicit MavlinkPoses(const std::vector<std::string>& messages) : taken_(messages) {
    static const std::vector<std::string> kTrue{"SIM_STATE", "HIL_STATE_QUATERNION", "ATT_POS_MOCAP",
                                                "VISION_POSITION_ESTIMATE", "ODOMETRY"};
    if (taken_.empty()) taken_ = kTrue;
    std::vector<std::string> known = kTrue;
    known.insert(known.end(), {"LOCAL_POSITION_NED", "GLOBAL_POSITION_INT"});
    for (const std::string& name : taken_) {
      if (std::find(known.begin(), known.end(), name) != known.end()) continue;
      throw InputError(fmt::format("MAVLink message '{}' has no pose", name),
                       fmt::format("it is one of {}", fmt::join(known, ", ")));
    }
  }

  void receive(const transport::Received& received,
               const std::function<void(const PoseReport&)>& each) override {
    parsers_.of(received.reader).receive(received.bytes, [&](const mavlink::Frame& frame) {
      std::visit(
          [&](const auto& message) {
            const std::optional<PoseReport> report = report_of(frame.sender, message);
            if (report && (report->position_m || report->position)) each(*report);
          },
          frame.message);
    });
  }

  [[nodiscard]] std::string request() override {
    // A heartbeat of a companion computer: autopilots send only to ports with a live partner.
    mavlink::Heartbeat heartbeat;
    heartbeat.type = 18;  // MAV_TYPE_ONBOARD_CONTROLLER
    const mavlink::Sender self{1, 191};
    std::string bytes = mavlink::encode(heartbeat, sequence_++, self);
    for (const mavlink::FrameLayout& layout : mavlink::layouts()) {
      if (!takes(layout.name)) continue;
      mavlink::CommandLong command;
      command.command = 511;  // MAV_CMD_SET_MESSAGE_INTERVAL
      command.parameters = {static_cast<double>(layout.id), 10'000};
      bytes += mavlink::encode(command, sequence_++, self);
    }
    return bytes;
  }

 private:
  [[nodiscard]] bool takes(std::string_view name) const {
    return std::find(taken_.begin(), taken_.end(), name) != taken_.end();
  }
  static PoseReport begin(mavlink::Sender sender, std::optional<double> stamp_s) {
    PoseReport report;
    report.id = std::to_string(sender.system);
    report.stamp_s = stamp_s;
    return report;
  }
  void set_position(PoseReport& report, std::string_view name, double latitude_deg, double longitude_deg,
                    double height_m) {
    // Autopilots without a fix send 0, 0 or the maximum integers.
    if (simulation::is_null_island(latitude_deg, longitude_deg))
      decode_errors_.add(fmt::format("{} at latitude 0, longitude 0, as before a fix", name));
    else if (is_on_earth(latitude_deg, longitude_deg) && std::isfinite(height_m))
      report.position = geodesy::Geodetic::from_degrees(latitude_deg, longitude_deg, height_m);
    else
      decode_errors_.add(fmt::format("{} with a latitude, longitude or height out of range", name));
  }

  /// Empty for unused messages and for messages without a pose.
  template <typename Message>
  [[nodiscard]] std::optional<PoseReport> report_of([[maybe_unused]] mavlink::Sender sender,
                                                    const Message& m) {
    if constexpr (requires { remember(sender, m); }) {
      remember(sender, m);
    } else if constexpr (requires { pose_of(sender, m); }) {
      if (takes(Message::kName)) return pose_of(sender, m);
    }
    return std::nullopt;
  }

  std::optional<PoseReport> pose_of(mavlink::Sender sender, const mavlink::SimState& m) {
    PoseReport report = begin(sender, std::nullopt);
    set_position(report, m.kName, m.latitude_deg(), m.longitude_deg(), m.altitude_m);
    report.attitude = attitude(m.ned_from_frd);
    // Simulators without a quaternion send angles.
    if (!report.attitude) report.attitude = attitude(m.roll_pitch_yaw_rad);
    report.velocity_mps = enu_from_ned() * m.velocity_ned_mps;
    report.rates_body_radps = flu_from_frd() * m.rates_frd_radps;
    return report;
  }
  std::optional<PoseReport> pose_of(mavlink::Sender sender, const mavlink::HilStateQuaternion& m) {
    PoseReport report = begin(sender, us(m.time_us));
    set_position(report, m.kName, m.latitude_deg, m.longitude_deg, m.altitude_m);
    report.attitude = attitude(m.ned_from_frd);
    report.velocity_mps = enu_from_ned() * m.velocity_ned_mps;
    report.rates_body_radps = flu_from_frd() * m.rates_frd_radps;
    return report;
  }
  std::optional<PoseReport> pose_of(mavlink::Sender sender, const mavlink::AttPosMocap& m) {
    PoseReport report = begin(sender, us(m.time_us));
    report.position_m = enu_from_ned() * m.position_ned_m;
    report.attitude = attitude(m.ned_from_frd);
    return report;
  }
  std::optional<PoseReport> pose_of(mavlink::Sender sender, const mavlink::VisionPositionEstimate& m) {
    PoseReport report = begin(sender, us(m.time_us));
    report.position_m = enu_from_ned() * m.position_ned_m;
    report.attitude = attitude(m.roll_pitch_yaw_rad);
    return report;
  }
  std::optional<PoseReport> pose_of(mavlink::Sender sender, const mavlink::Odometry& m) {
    const auto world_ned = is_ned(kLocalFrames, m.frame), body_frd = is_ned(kBodyFrames, m.child_frame),
               child_ned = is_ned(kLocalFrames, m.child_frame);
    if (!world_ned || (!body_frd && !child_ned)) {
      decode_errors_.add(
          fmt::format("ODOMETRY with a pose in MAV_FRAME {} and velocities in {}: unsupported frames",
                      m.frame, m.child_frame));
      return std::nullopt;
    }
    PoseReport report = begin(sender, us(m.time_us));
    const Matrix3d world = enu_from(*world_ned ? WorldAxes::NED : WorldAxes::ENU);
    const Matrix3d body = flu_from(body_frd.value_or(*world_ned) ? BodyAxes::FRD : BodyAxes::FLU);
    report.position_m = world * m.position_m;
    report.attitude = attitude(m.frame_from_body, world, body);
    if (!m.velocity_mps.allFinite()) {
      // The message has no velocity.
    } else if (!body_frd) {
      report.velocity_mps = enu_from(*child_ned ? WorldAxes::NED : WorldAxes::ENU) * m.velocity_mps;
    } else if (report.attitude) {
      report.velocity_mps = *report.attitude * (body * m.velocity_mps);
    }
    if (m.rates_radps.allFinite()) report.rates_body_radps = body * m.rates_radps;
    return report;
  }
  // An attitude in a separate message belongs to the next position.
  void remember(mavlink::Sender sender, const mavlink::AttitudeEuler& m) {
    attitudes_[sender.system] = {attitude(m.roll_pitch_yaw_rad), flu_from_frd() * m.rates_frd_radps};
  }
  void remember(mavlink::Sender sender, const mavlink::AttitudeQuaternion& m) {
    attitudes_[sender.system] = {attitude(m.ned_from_frd), flu_from_frd() * m.rates_frd_radps};
  }
  std::optional<PoseReport> pose_of(mavlink::Sender sender, const mavlink::LocalPositionNed& m) {
    PoseReport report = begin(sender, m.boot_s);
    report.position_m = enu_from_ned() * m.position_ned_m;
    report.velocity_mps = enu_from_ned() * m.velocity_ned_mps;
    add_attitude(sender, report);
    return report;
  }
  std::optional<PoseReport> pose_of(mavlink::Sender sender, const mavlink::GlobalPositionInt& m) {
    PoseReport report = begin(sender, m.boot_s);
    set_position(report, m.kName, m.latitude_deg, m.longitude_deg, m.altitude_m);
    report.velocity_mps = enu_from_ned() * m.velocity_ned_mps;
    add_attitude(sender, report);
    if (!report.attitude && std::isfinite(m.heading_deg))
      report.attitude = attitude(Vector3d(0, 0, geodesy::radians(m.heading_deg)));
    return report;
  }
  void add_attitude(mavlink::Sender sender, PoseReport& report) const {
    const auto found = attitudes_.find(sender.system);
    if (found == attitudes_.end()) return;
    report.attitude = found->second.attitude;
    report.rates_body_radps = found->second.rates;
  }

  struct RotatedPose {
    std::optional<Quaterniond> attitude;
    Vector3d rates = Vector3d::Zero();
  };
  std::vector<std::string> taken_;
  transport::Readers<mavlink::MavlinkParser> parsers_;
  std::map<std::uint8_t, RotatedPose> attitudes_;
  std::uint8_t sequence_ = 0;
};

}  // namespace

std::unique_ptr<PoseDecoder> make_mavlink_poses(const std::vector<std::string>& messages) {
  return std::make_unique<MavlinkPoses>(messages);
}

}  // namespace canyon::live
