#pragma once

#include <functional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace canyon::adapters {

/// Names of a receiver in its world; fixed once its plugin is loaded.
struct ReceiverIdentity {
  std::string world;   ///< its name
  std::string model;   ///< its topmost model, "iris"
  std::string link;    ///< scoped without the world, "iris::gps0::link"
  std::string parent;  ///< the link's parent model, without scope: "gps0"
  std::string sensor;  ///< name of its sensor; empty for a model's plugin
  std::string plugin;  ///< name of the plugin element
};
/// The name of a receiver in messages: "plugin 'gnss' of model 'car', sensor 'gps'".
[[nodiscard]] std::string receiver_label(const ReceiverIdentity& identity);

/// A user's settings of a receiver's names in ROS.
struct RosSettings {
  std::string ros_namespace;  ///< empty: the model's name
  /// Each from and to, with ROS's meaning of "~/"; other topics keep their names.
  std::vector<std::pair<std::string, std::string>> remappings;
  std::string frame_id;       ///< empty: the link's name
  bool publish_scan = false;  ///< ranges of the rays, as a laser scan
  bool changes = false;       ///< services may change the simulation
};

/// Names of a receiver's topics, absolute: "/iris/fix".
struct RosTopics {
  std::string base;  ///< the namespace of topics without remapping
  std::string own;   ///< "~" of the receiver, the namespace of its services: base and the plugin's name
  std::string fix;
  std::string fix_velocity;
  std::string gnss_multipath;
  std::string satellites;
  std::string raw_observations;
  std::string scan;  ///< empty if none is published

  /// The published names.
  [[nodiscard]] std::vector<std::string> all() const;
  /// Names that must be unique among receivers.
  [[nodiscard]] std::vector<std::string> claimed() const;
};

/// Whether `name` consists of parts of letters, digits and '_', each beginning with a letter (ROS: "Names"),
/// separated by one '/', with a leading one if absolute and no trailing one.
[[nodiscard]] bool is_ros_name(std::string_view name);
/// `name` with each character that is not allowed in ROS names replaced by '_': "my car" is "my_car".
[[nodiscard]] std::string ros_name_part(std::string_view name);

/// The namespace of settings.ros_namespace: absolute, without '/' at the end, "" for the root.
/// Empty settings: "/" and the model's name. Throws InputError for an invalid name.
[[nodiscard]] std::string ros_namespace(const ReceiverIdentity& identity, const RosSettings& settings);

/// Topics in `base` (see ros_namespace()), renamed by settings.remappings. "x" is in `base`, "/x" unchanged,
/// "~/x" in `base` and the plugin's name. Remappings name a topic with or without "~/", and the scan also as
/// "~/out", as in the paper. Throws InputError for invalid ROS names, and if two topics would have the same
/// name. Remappings of other names add a line to `notes`.
[[nodiscard]] RosTopics ros_topics(const std::string& base, const ReceiverIdentity& identity,
                                   const RosSettings& settings, std::vector<std::string>& notes);

/// ros_topics() with claimed() names that no other receiver has: in ros_namespace() or, if that is the
/// model's default and in use, in a namespace of its link and sensor, with a note. `claim` reserves names, or
/// returns one that is in use. Throws InputError like ros_topics(), and if a configured namespace is in use.
[[nodiscard]] RosTopics claimed_ros_topics(
    const ReceiverIdentity& identity, const RosSettings& settings,
    const std::function<std::string(const std::vector<std::string>&)>& claim,
    std::vector<std::string>& notes);

/// settings.frame_id, else the link's name without scope.
[[nodiscard]] std::string ros_frame_id(const ReceiverIdentity& identity, const RosSettings& settings);

}  // namespace canyon::adapters
