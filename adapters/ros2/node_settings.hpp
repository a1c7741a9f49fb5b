#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "canyon/base/options/describe.hpp"
#include "canyon/outputs/live/hosted_receiver.hpp"
#include "canyon/run/live_receiver.hpp"
#include "canyon/run/scenario/scenario.hpp"

namespace canyon::adapters::ros2 {

/// The source of a receiver's truth.
enum class PoseSource : std::uint8_t { Trajectory, Pose, Odometry, Tf, Fixed };

/// The settings of every host, whose scenario comes from a file and parameters over it, and what a node of
/// ROS 2 adds. With poses from outside the trajectory may be absent.
struct NodeSettings : live::HostOptions {
  std::optional<std::filesystem::path> scenario;
  std::string receiver;  ///< name of one of the scenario's; empty: the first
  std::string frame_id = "gnss";
  bool diagonal_covariance = false;  ///< of fixes: variances alone
  bool autostart = false;
  bool drive_clock = false;
  double speed = 1;  ///< speed of the driven clock, times real time

  PoseSource pose_source = PoseSource::Trajectory;
  std::string pose_frame = "map";                               ///< that poses are in
  std::string child_frame = "base_link";                        ///< the vehicle's frame, with Tf
  Eigen::Vector3d pose_origin_enu_m = Eigen::Vector3d::Zero();  ///< origin of pose_frame, in the city's frame
  /// Autoware's map_projector_info.yaml, which places pose_frame instead of the origin and heading.
  std::optional<std::filesystem::path> map_projector;
  double pose_heading_rad = 0;  ///< direction of its x axis, from east counter-clockwise

  /// Time and place are the host's, not those of the scenario's own drive.
  [[nodiscard]] bool by_poses() const { return pose_source != PoseSource::Trajectory; }
  /// Topic that the receiver's corrections come by; empty: they do not come by one.
  [[nodiscard]] std::string corrections_topic() const;
};

void visit(options::Visitor& v, NodeSettings& settings);

/// A parameter's value, of one of ROS's types; std::monostate: not set.
using ParameterValue = std::variant<std::monostate, bool, std::int64_t, double, std::string,
                                    std::vector<double>, std::vector<std::string>>;
using Parameters = std::map<std::string, ParameterValue>;

/// One key a parameter, in the order of visit(): the scenario's keys, those of its receiver without
/// `receivers[].`. Lists of mappings, tables and `outputs` are the file's alone.
[[nodiscard]] const std::vector<options::Key>& parameter_keys();
/// The node's own keys, which no scenario has.
[[nodiscard]] std::vector<options::Key> node_keys();
/// Null for an unknown name.
[[nodiscard]] const options::Key* find_parameter(const std::string& name);
/// The known name that is closest to an unknown one, for people: "did you mean 'elevation_mask_deg'?".
[[nodiscard]] std::string meant_parameter(const std::string& name);
/// Whether it is one of the receiver's own keys, which say nothing of city, sky, time and motion.
[[nodiscard]] bool is_receivers(const std::string& name);

/// Reads the file that `given["scenario"]` names, if any, and `given` over it. Names of files among the
/// parameters belong to the working folder, those of the scenario to its own. Empty texts and lists, and what
/// is not set, are not given. Throws InputError, which names the parameter or the file and line.
[[nodiscard]] NodeSettings read_settings(const Parameters& given);

/// The settings as parameters; those without a value are left out.
[[nodiscard]] Parameters parameters_of(const NodeSettings& settings);

/// The scenario as Simulation takes it, which reads no topic.
[[nodiscard]] simulation::Scenario simulated_world(const NodeSettings& settings);

/// The options of the node's receiver: in a drive of the scenario's own (`drive`) those of `canyon simulate`.
/// Without one, `own_name` names it where nothing else does, and its noise is its own.
[[nodiscard]] simulation::LiveConfig driven_config(const NodeSettings& settings, const std::string& own_name,
                                                   const simulation::Simulation* drive = nullptr);

}  // namespace canyon::adapters::ros2
