#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/transport/link.hpp"
#include "canyon/base/transport/transport.hpp"
#include "canyon/run/motion/pose_motion.hpp"
#include "canyon/run/scenario/live_options.hpp"

namespace canyon::live {

/// A received pose, turned to ENU axes of its local frame and FLU axes of the body.
struct PoseReport {
  std::string id;                                   ///< the vehicle's; empty: not given
  std::optional<double> stamp_s;                    ///< on the sender's clock
  std::optional<Eigen::Vector3d> position_m;        ///< in a local frame; or
  std::optional<geodesy::Geodetic> place;           ///< on the Earth, heights as sent
  std::optional<Eigen::Quaterniond> attitude;       ///< local from body
  std::optional<Eigen::Vector3d> velocity_mps;      ///< local axes
  std::optional<Eigen::Vector3d> rates_body_radps;  ///< about the body's axes
};

/// Counts messages that are not poses, by reason.
class Complaints {
 public:
  /// Reasons that are told in their words; messages of others are counted.
  static constexpr std::size_t kMost = 8;

  void add(std::string why);
  /// "3 messages were not poses: 2 a wrong checksum; 1 an attitude without direction", in the order in which
  /// the reasons came up; empty: none since the last call.
  [[nodiscard]] std::string take();

 private:
  std::vector<std::pair<std::string, std::size_t>> reasons_;
  std::size_t count_ = 0;
};

/// Finds poses in bytes that may be cut anywhere, mixed with anything, or hostile. Keeps a bounded part of
/// them, of a datagram nothing: what is no pose in it is complained of.
class PoseDecoder {
 public:
  virtual ~PoseDecoder() = default;
  virtual void receive(const transport::Received& received,
                       const std::function<void(const PoseReport&)>& each) = 0;
  /// A request for poses to a silent sender; empty: none.
  [[nodiscard]] virtual std::string request() { return {}; }
  /// Complaints::take() of the messages since the last call.
  [[nodiscard]] std::string take_complaint() { return complaints_.take(); }
  /// Parts of poses that are not used, each of which is told once; empty: none since the last call.
  [[nodiscard]] virtual std::string take_unused() { return {}; }

 protected:
  Complaints complaints_;
};

/// The decoder of these options. Throws InputError for messages that Canyon does not know.
[[nodiscard]] std::unique_ptr<PoseDecoder> make_decoder(const simulation::PoseSourceOptions& options);

/// One pose in the binary form: kBinarySize bytes, little-endian (docs/live.md has the table).
///   0 char[4] "CNY1"   4 u16 flags (1 velocity, 2 rates, 4 latitude, longitude [deg] and height instead of
///   x, y, z, 8 no stamp, 16 no attitude)   6 u16 0   8 u32 id   12 f64 stamp [s]   20 f64[3] position [m]
///   44 f32[4] attitude w, x, y, z   60 f32[3] velocity [m/s]   72 f32[3] rates [rad/s]   84 u32 CRC-32 (that
///   of zlib) of the bytes before
inline constexpr std::size_t kBinarySize = 88;
/// Longest JSON line; longer ones are passed over.
inline constexpr std::size_t kLongestLine = 4096;

[[nodiscard]] bool is_on_earth(double latitude_deg, double longitude_deg);

/// Rotates vectors given in `axes` to local ENU, or to FLU.
[[nodiscard]] Eigen::Matrix3d enu_from(simulation::WorldAxes axes);
[[nodiscard]] Eigen::Matrix3d flu_from(simulation::BodyAxes axes);

/// Poses in MAVLink messages, which say their own frames. PoseReport::id is the system's number.
/// @param messages names of those to take; empty: SIM_STATE, HIL_STATE_QUATERNION, ATT_POS_MOCAP,
/// VISION_POSITION_ESTIMATE and ODOMETRY, which carry the truth of a simulator or of motion capture. Others
/// carry an autopilot's estimate: LOCAL_POSITION_NED, GLOBAL_POSITION_INT. Throws InputError for unknown
/// ones.
[[nodiscard]] std::unique_ptr<PoseDecoder> make_mavlink_poses(const std::vector<std::string>& messages);

/// Nanoseconds as seconds.
[[nodiscard]] constexpr double seconds(std::int64_t ns) {
  return static_cast<double>(ns) * 1e-9;
}

/// Poses of one vehicle from outside: decoded, turned, scaled and moved into the city, and kept as a track.
class PoseSource {
 public:
  /// @param frame of the city
  /// @param geoid_undulation_m of the city: MAVLink's altitudes are above mean sea level
  /// Throws InputError where make_decoder() does.
  PoseSource(const simulation::PoseSourceOptions& options, const geodesy::LocalFrame& frame,
             double geoid_undulation_m = 0);

  /// Bytes that come at `now_ns` of the host's time; `taken` is called behind each pose that is.
  void receive(const transport::Received& received, std::int64_t now_ns,
               const std::function<void()>& taken = {});
  /// As receive(), with poses at the host's time of their stamps, less the first one unless `since_zero`. A
  /// stamp that lies more than the time-out before the last one, or more than kLongestGap_s behind it, is of
  /// another clock. Then `anew` is called: the poses are forgotten and stamps count from this one on; where
  /// it returns false the pose is dropped instead.
  void receive_log(const transport::Received& received, bool since_zero,
                   const std::function<void(std::int64_t now_ns)>& taken, const std::function<bool()>& anew);
  static constexpr double kLongestGap_s = 86400;

  [[nodiscard]] const simulation::PoseSourceOptions& options() const { return options_; }
  [[nodiscard]] simulation::PoseTrack& track() { return track_; }
  /// Poses that were taken so far.
  [[nodiscard]] std::uint64_t count() const { return count_; }
  /// The stamp of the latest pose that was taken; empty: it had none.
  [[nodiscard]] std::optional<double> last_stamp_s() const { return last_stamp_s_; }
  [[nodiscard]] std::string request() { return decoder_->request(); }
  /// Poses that receive_log() has dropped because their stamps are of another clock.
  [[nodiscard]] std::uint64_t of_another_clock() const { return of_another_clock_; }
  /// Notes since the last call, one line each: poses that were dropped, or lie far away.
  [[nodiscard]] std::vector<std::string> take_notes();

 private:
  /// In the city; empty: of another vehicle. Its place is not finite where no antenna can be there.
  [[nodiscard]] std::optional<simulation::ReportedPose> in_city(const PoseReport& report, double now_s);
  /// Whether the pose is a new one of this vehicle.
  bool take(const PoseReport& report, std::int64_t now_ns);
  void count(const PoseReport& report, const simulation::ReportedPose& sent);
  /// Whether stamps go by as seconds do.
  void watch_pace(double stamp_s, double now_s);

  simulation::PoseSourceOptions options_;
  const geodesy::LocalFrame& frame_;
  double sent_zero_m_;  // ellipsoidal height of the senders' height 0
  std::unique_ptr<PoseDecoder> decoder_;
  simulation::PoseTrack track_;
  Eigen::Quaterniond attitude_ = Eigen::Quaterniond::Identity();  // of the last motion
  std::optional<std::pair<double, Eigen::Vector3d>> before_;      // time and place of the last pose
  std::optional<double> first_stamp_s_, last_stamp_s_;
  std::optional<std::pair<double, double>> pace_from_;  // stamp and time that the pace is counted from
  std::string pace_note_;
  bool said_pace_ = false;
  double far_m_ = 0;  // of the first of those since the vehicle was near
  bool said_far_ = false;
  std::uint64_t count_ = 0, impossible_ = 0, old_ = 0, of_another_clock_ = 0;
};

}  // namespace canyon::live
