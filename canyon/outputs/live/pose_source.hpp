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
#include "canyon/base/transport/transport.hpp"
#include "canyon/outputs/live/pose_decoder.hpp"
#include "canyon/simulation/motion/pose_motion.hpp"
#include "canyon/simulation/scenario/live_options.hpp"

namespace canyon::live {

/// Nanoseconds as seconds.
[[nodiscard]] constexpr double seconds(std::int64_t ns) {
  return static_cast<double>(ns) * 1e-9;
}

/// Poses of one vehicle from an external source: decoded, transformed into the city, kept as a track.
class PoseSource {
 public:
  /// @param frame of the city
  /// @param geoid_undulation_m of the city: MAVLink's altitudes are above mean sea level
  /// Throws InputError if make_decoder() does.
  PoseSource(const simulation::PoseSourceOptions& options, const geodesy::LocalFrame& frame,
             double geoid_undulation_m = 0);

  /// Takes bytes received at `now_ns` of the host's time; calls `taken` after each accepted pose.
  void receive(const transport::Received& received, std::int64_t now_ns,
               const std::function<void()>& taken = {});
  /// As receive(), but the time of a pose is its stamp, minus the first stamp unless `since_zero`. A stamp
  /// more than the time-out before the last one, or more than kMaxGap_s after it, is from another clock.
  /// Then `restarted` is called: stored poses are deleted and stamps count from this one; if it returns
  /// false, the pose is dropped.
  void receive_log(const transport::Received& received, bool since_zero,
                   const std::function<void(std::int64_t now_ns)>& taken,
                   const std::function<bool()>& restarted);
  static constexpr double kMaxGap_s = 86400;

  [[nodiscard]] const simulation::PoseSourceOptions& options() const { return options_; }
  [[nodiscard]] simulation::PoseTrack& track() { return track_; }
  /// Number of poses accepted so far.
  [[nodiscard]] std::uint64_t count() const { return count_; }
  /// The stamp of the latest accepted pose; empty: it had none.
  [[nodiscard]] std::optional<double> last_stamp_s() const { return last_stamp_s_; }
  [[nodiscard]] std::string request() { return decoder_->request(); }
  /// Number of poses that receive_log() dropped because their stamps are from another clock.
  [[nodiscard]] std::uint64_t foreign_clock_count() const { return foreign_clock_count_; }
  /// Notes since the last call, one line each: poses that were dropped or are far away.
  [[nodiscard]] std::vector<std::string> take_notes();

 private:
  /// The pose in the city; empty: of another vehicle. The position is not finite if no antenna can be there.
  [[nodiscard]] std::optional<simulation::ReportedPose> in_city(const PoseReport& report, double now_s);
  /// Whether it is a new pose of this vehicle.
  bool take(const PoseReport& report, std::int64_t now_ns);
  void count(const PoseReport& report, const simulation::ReportedPose& sent);
  /// Checks that stamps advance in seconds.
  void watch_pace(double stamp_s, double now_s);

  simulation::PoseSourceOptions options_;
  const geodesy::LocalFrame& frame_;
  double sent_zero_m_;  // ellipsoidal height of the senders' height 0
  std::unique_ptr<PoseDecoder> decoder_;
  simulation::PoseTrack track_;
  Eigen::Quaterniond attitude_ = Eigen::Quaterniond::Identity();  // of the last motion
  std::optional<std::pair<double, Eigen::Vector3d>> before_;      // time and position of the last pose
  std::optional<double> first_stamp_s_, last_stamp_s_;
  std::optional<std::pair<double, double>> pace_from_;  // stamp and time from which the pace is measured
  std::string pace_note_;
  bool warned_pace_ = false;
  double far_m_ = 0;  // distance of the first far pose since the vehicle was near
  bool warned_far_ = false;
  std::uint64_t count_ = 0, impossible_ = 0, old_ = 0, foreign_clock_count_ = 0;
};

}  // namespace canyon::live
