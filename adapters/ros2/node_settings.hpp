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
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::adapters::ros2 {

/// The source of a receiver's truth.
enum class PoseSource : std::uint8_t { Trajectory, Pose, Odometry, Tf, Fixed };

/// The settings of all hosts, with the scenario from a file overridden by parameters, and those of a ROS 2
/// node. With external poses the trajectory may be absent.
struct NodeSettings : live::HostOptions {
  std::optional<std::filesystem::path> scenario;
  std::string receiver;  ///< name of one of the scenario's; empty: the first
  std::string frame_id = "gnss";
  bool diagonal_covariance = false;  ///< of fixes: variances only
  bool autostart = false;
  bool drive_clock = false;
  double speed = 1;  ///< speed of the driven clock, times real time

  PoseSource pose_source = PoseSource::Trajectory;
  std::string pose_frame = "map";                               ///< frame of poses
  std::string child_frame = "base_link";                        ///< the vehicle's frame, with Tf
  Eigen::Vector3d pose_origin_enu_m = Eigen::Vector3d::Zero();  ///< origin of pose_frame, in the city's frame
  /// Autoware's map_projector_info.yaml, which defines pose_frame instead of the origin and heading.
  std::optional<std::filesystem::path> map_projector;
  double pose_heading_rad = 0;  ///< direction of its x axis, from east counter-clockwise

  /// Time and poses are the host's, not those of the scenario's own drive.
  [[nodiscard]] bool is_pose_driven() const { return pose_source != PoseSource::Trajectory; }
  /// Topic of the receiver's corrections; empty: not from a topic.
  [[nodiscard]] std::string corrections_topic() const;
};

void visit(options::Visitor& v, NodeSettings& settings);

/// A parameter's value, of one of ROS's types; std::monostate: not set.
using ParameterValue = std::variant<std::monostate, bool, std::int64_t, double, std::string,
                                    std::vector<double>, std::vector<std::string>>;
using Parameters = std::map<std::string, ParameterValue>;

/// One parameter per key, in the order of visit(): the scenario's keys, those of its receiver without
/// `receivers[].`. Lists of mappings, tables and `outputs` are only in the file.
[[nodiscard]] const std::vector<options::Key>& parameter_keys();
/// The node's own keys, which are not in scenarios.
[[nodiscard]] std::vector<options::Key> node_keys();
/// Null for an unknown name.
[[nodiscard]] const options::Key* find_parameter(const std::string& name);
/// A hint with the known name closest to an unknown one: "did you mean 'elevation_mask_deg'?".
[[nodiscard]] std::string meant_parameter(const std::string& name);
/// Whether it is one of the receiver's own keys, independent of city, sky, time and motion.
[[nodiscard]] bool is_receivers(const std::string& name);

/// Reads the file named by `given["scenario"]`, if any, overridden by `given`. Relative file names in
/// parameters are relative to the working folder, those in the scenario to the scenario's folder. Empty
/// texts, empty lists and unset parameters count as not given. Throws InputError, which names the parameter
/// or the file and line.
[[nodiscard]] NodeSettings read_settings(const Parameters& given);

/// The settings as parameters; those without a value are left out.
[[nodiscard]] Parameters parameters_of(const NodeSettings& settings);

/// The scenario for Simulation, which reads no topic.
[[nodiscard]] simulation::Scenario simulated_world(const NodeSettings& settings);

/// The options of the node's receiver: in the scenario's own drive (`drive`) those of `canyon simulate`. Else
/// `receiver_name` is the default name, and its noise is independent.
[[nodiscard]] simulation::RunnerConfig driven_config(const NodeSettings& settings,
                                                     const std::string& receiver_name,
                                                     const simulation::Simulation* drive = nullptr);

}  // namespace canyon::adapters::ros2
