#pragma once

#include <functional>
#include <string>
#include <vector>

#include "canyon/options/visitor.hpp"
#include "canyon/simulation/scenario/live_config.hpp"

namespace canyon::live {

/// The settings of one receiver in a host, whatever the host's language is: a scenario, and what each host
/// adds to it. Simulators (HostSettings) and the node of ROS 2 (NodeSettings) add what only they know.
struct HostOptions {
  /// One receiver and, where it takes corrections of another, that as its base.
  simulation::LiveConfig live;
  bool named = false;  ///< `name` stands; where not, the receiver's name is not the user's
  double pose_timeout_s =
      0.5;  ///< age of a pose from outside, in the host's time, after which it is no truth; > 0
  std::vector<std::string> streams;  ///< each FORMAT=ADDRESS (output::parse_stream())
};

/// The fields of every host, but for those of `live`. @param frame_id of its messages; empty: the host's own
/// @param of_pose a host's own fields in the section `pose`
void visit_host(options::Visitor& v, HostOptions& o, std::string& frame_id,
                const std::function<void()>& of_pose = {});

/// A word of a host, such as a topic: a reader throws its fault for blanks in it.
void visit_word(options::Visitor& v, const options::Field& field, std::string& value);

}  // namespace canyon::live
