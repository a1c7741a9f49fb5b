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
  std::string model;   ///< topmost model that carries it, "iris"
  std::string link;    ///< scoped without the world, "iris::gps0::link"
  std::string parent;  ///< the model right above the link, without scope: "gps0"
  std::string sensor;  ///< name of its sensor; empty for a model's plugin
  std::string plugin;  ///< name of the plugin element
};
/// The place of a receiver in messages: "plugin 'gnss' of model 'car', sensor 'gps'".
[[nodiscard]] std::string place_name(const ReceiverIdentity& identity);

/// A user's settings of a receiver's names in ROS.
struct RosSettings {
  std::string ros_namespace;  ///< empty: the model's name
  /// Each from and to, with ROS's meaning of "~/"; topics without one keep their names.
  std::vector<std::pair<std::string, std::string>> remappings;
  std::string frame_id;       ///< empty: the link's name
  bool publish_scan = false;  ///< ranges of the rays, as a laser scan
  bool changes = false;       ///< services may change the simulation
};

/// Names of a receiver's topics, absolute: "/iris/fix".
struct RosTopics {
  std::string base;  ///< the namespace that they are in where nothing renames them
  std::string own;   ///< "~" of the receiver, where its services are: base and the plugin's name
  std::string fix;
  std::string fix_velocity;
  std::string gnss_multipath;
  std::string satellites;
  std::string raw_observations;
  std::string scan;  ///< empty where none is published

  /// The names that are published.
  [[nodiscard]] std::vector<std::string> all() const;
  /// Names that no other receiver may have.
  [[nodiscard]] std::vector<std::string> claimed() const;
};

/// Whether `name` is parts of letters, digits and '_', each beginning with a letter (ROS: "Names"), with one
/// '/' in between, one before where it is absolute, and none behind.
[[nodiscard]] bool is_ros_name(std::string_view name);
/// `name` with every character that ROS does not allow in a part of a name as '_': "my car" is "my_car".
[[nodiscard]] std::string ros_name_part(std::string_view name);

/// The namespace that settings.ros_namespace asks for: absolute, without '/' at the end, "" for the root.
/// Empty settings: "/" and the model's name. Throws InputError for an invalid name.
[[nodiscard]] std::string ros_namespace(const ReceiverIdentity& identity, const RosSettings& settings);

/// Topics in `base` (see ros_namespace()), renamed by settings.remappings. "x" is in `base`, "/x" as it is,
/// "~/x" in `base` and the plugin's name. A topic goes by its name with or without "~/", and the scan by
/// "~/out" as well, as in the paper. Throws InputError for names that ROS does not allow, and where two
/// topics would have one name. Remappings of other names add a line to `notes`.
[[nodiscard]] RosTopics ros_topics(const std::string& base, const ReceiverIdentity& identity,
                                   const RosSettings& settings, std::vector<std::string>& notes);

/// ros_topics() whose claimed() no other receiver has: in ros_namespace() or, where that is the model's by
/// default and is taken, in a namespace of its link and sensor, with a note. `claim` takes names, or says
/// which is taken. Throws InputError as ros_topics(), and where a namespace that was asked for is taken.
[[nodiscard]] RosTopics claimed_ros_topics(
    const ReceiverIdentity& identity, const RosSettings& settings,
    const std::function<std::string(const std::vector<std::string>&)>& claim,
    std::vector<std::string>& notes);

/// settings.frame_id, else the link's name without scope.
[[nodiscard]] std::string ros_frame_id(const ReceiverIdentity& identity, const RosSettings& settings);

}  // namespace canyon::adapters
