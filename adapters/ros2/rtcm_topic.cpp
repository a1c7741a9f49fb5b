#include "adapters/ros2/rtcm_topic.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/outputs/encoding/stream.hpp"
#include "canyon/receiver/rtk/correction_link.hpp"

namespace canyon::adapters::ros2 {
namespace {

/// The rules of ROS 2 (rmw_validate_full_topic_name(), rcl_validate_topic_name()).
bool is_topic_name(std::string_view name) {
  if (name.starts_with("~/")) name.remove_prefix(2);
  if (name.starts_with('/')) name.remove_prefix(1);
  const auto token = [](std::string_view part) {
    const auto letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
    return !part.empty() && letter(part.front()) && part.find("__") == std::string_view::npos &&
           std::all_of(part.begin(), part.end(), [&](char c) { return letter(c) || (c >= '0' && c <= '9'); });
  };
  const auto parts = split(name, '/');
  return std::all_of(parts.begin(), parts.end(), token);
}

}  // namespace

std::optional<std::string> topic_of(std::string_view address) {
  if (!address.starts_with(rtk::kTopicAddress)) return std::nullopt;
  const std::string_view name = address.substr(rtk::kTopicAddress.size());
  if (!is_topic_name(name)) {
    throw InputError(fmt::format("'{}' does not name a topic", address),
                     "write topic:NAME, such as topic:rtcm or topic:/ntrip_client/rtcm");
  }
  return std::string(name);
}

std::optional<std::string> topic_of_stream(std::string_view stream) {
  const encoding::StreamRequest request = encoding::parse_stream(stream);
  const auto topic = topic_of(request.address);
  if (!topic) return std::nullopt;
  if (request.format != "rtcm") {
    throw InputError(fmt::format("'{}': a topic of rtcm_msgs/Message carries only RTCM 3", stream),
                     fmt::format("write rtcm={}, or another address", request.address));
  }
  if (request.options.virtual_station) {
    throw InputError(fmt::format("'{}': no subscriber can report its position", stream),
                     "remove virtual_station, or serve it as ntrip-caster://HOST:PORT/MOUNT");
  }
  return topic;
}

std::vector<std::string_view> split_frames(std::string_view bytes) {
  constexpr std::size_t kHeader = 3, kChecksum = 3;
  std::vector<std::string_view> frames;
  while (bytes.size() >= kHeader) {
    const auto byte = [&](std::size_t i) { return static_cast<unsigned char>(bytes[i]); };
    const std::size_t length = (byte(1) & 3U) << 8 | byte(2);
    const std::size_t size = std::min(bytes.size(), kHeader + length + kChecksum);
    frames.push_back(bytes.substr(0, size));
    bytes.remove_prefix(size);
  }
  return frames;
}

}  // namespace canyon::adapters::ros2
