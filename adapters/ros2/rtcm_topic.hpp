#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

// RTCM 3 by topics of ROS 2, as far as it does not need ROS 2.

namespace canyon::adapters::ros2 {

/// The topic of an address "topic:NAME"; empty: it is another address. NAME is absolute ("/base/rtcm"), of
/// the node's namespace ("rtcm") or of the node ("~/rtcm"). Throws InputError for an invalid name.
[[nodiscard]] std::optional<std::string> topic_of(std::string_view address);
/// The topic of a stream "FORMAT=ADDRESS" (output::parse_stream()); empty: it goes elsewhere. Throws
/// InputError as topic_of(), and for other formats than rtcm and virtual stations.
[[nodiscard]] std::optional<std::string> topic_of_stream(std::string_view stream);

/// The frames of RTCM 3 one by one, as rtcm_msgs/Message has them. Precondition: `bytes` are whole frames,
/// such as an encoder makes.
[[nodiscard]] std::vector<std::string_view> split_frames(std::string_view bytes);

}  // namespace canyon::adapters::ros2
