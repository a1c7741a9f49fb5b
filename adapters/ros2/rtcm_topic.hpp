#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

// RTCM 3 over ROS 2 topics: the part without ROS 2 dependencies.

namespace canyon::adapters::ros2 {

/// The topic of an address "topic:NAME"; empty: another address. NAME is absolute ("/base/rtcm"), in the
/// node's namespace ("rtcm") or in the node's name ("~/rtcm"). Throws InputError for an invalid name.
[[nodiscard]] std::optional<std::string> topic_of(std::string_view address);
/// The topic of a stream "FORMAT=ADDRESS" (encoding::parse_stream()); empty: another address. Throws
/// InputError like topic_of(), and for other formats than rtcm and virtual stations.
[[nodiscard]] std::optional<std::string> topic_of_stream(std::string_view stream);

/// The RTCM 3 frames one by one, as in rtcm_msgs/Message. Precondition: `bytes` are complete frames, as from
/// an encoder.
[[nodiscard]] std::vector<std::string_view> split_frames(std::string_view bytes);

}  // namespace canyon::adapters::ros2
