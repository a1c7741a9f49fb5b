#include "adapters/ros2/rtcm_topic.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/output/stream.hpp"

namespace canyon::adapters::ros2 {
namespace {

using geodesy::GpsTime;

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

/// "3.2 h", for times of any length.
std::string long_time(double seconds) {
  if (seconds < 600) return fmt::format("{:.0f} s", seconds);
  if (seconds < 48 * 3600) return fmt::format("{:.1f} h", seconds / 3600);
  return fmt::format("{:.1f} days", seconds / 86400);
}

}  // namespace

std::optional<std::string> topic_of(std::string_view address) {
  if (!address.starts_with(relative::kTopicAddress)) return std::nullopt;
  const std::string_view name = address.substr(relative::kTopicAddress.size());
  if (!is_topic_name(name)) {
    throw InputError(fmt::format("'{}' does not name a topic", address),
                     "write topic:NAME, such as topic:rtcm or topic:/ntrip_client/rtcm");
  }
  return std::string(name);
}

std::optional<std::string> topic_of_stream(std::string_view stream) {
  const output::StreamRequest request = output::parse_stream(stream);
  const auto topic = topic_of(request.address);
  if (!topic) return std::nullopt;
  if (request.format != "rtcm") {
    throw InputError(fmt::format("'{}': a topic of rtcm_msgs/Message carries only RTCM 3", stream),
                     fmt::format("write rtcm={}, or another address", request.address));
  }
  if (request.options.virtual_station) {
    throw InputError(fmt::format("'{}': no subscriber can report its place", stream),
                     "leave virtual_station out, or serve it as ntrip-caster://HOST:PORT/MOUNT");
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

RtcmTopic::RtcmTopic(const receiver::ReceiverOptions& options, std::uint64_t seed)
    : options_(options.corrections),
      seed_(seed),
      receiver_(options.name),
      topic_(topic_of(options_.from).value_or(options_.from)),
      link_(options_, seed, receiver_) {}

void RtcmTopic::begin_anew() {
  decoder_ = rtcm::CorrectionsDecoder();
  link_ = relative::CorrectionLink(options_, seed_, receiver_);
  held_back_since_.reset();
  station_.reset();
}

void RtcmTopic::receive(std::string_view bytes, GpsTime now) {
  if (bytes.empty()) {
    return warn("empty", fmt::format("a message on the topic {} has no bytes", topic_));
  }
  if (bytes.size() > kLongestMessage) {
    return warn("long", fmt::format("a message on the topic {} has {} bytes and is not read; RTCM 3 of an "
                                    "epoch has some 1,000, and at most {} are taken",
                                    topic_, bytes.size(), kLongestMessage));
  }
  const rtcm::DecoderStatus before = decoder_.status();
  for (auto& epoch : decoder_.feed(bytes, now)) {
    look_for_other_station(*epoch);
    if (!is_of_now(*epoch, now)) continue;
    const GpsTime measured = epoch->receiver_time;
    link_.send(measured, std::move(epoch), place_ecef_);
  }
  look_at(before, now);
}

void RtcmTopic::look_for_other_station(const relative::Corrections& epoch) {
  constexpr double kSamePlace_m = 1;
  const auto before = std::exchange(station_, Station{epoch.station, epoch.station_ecef});
  if (!before) return;
  const double apart_m = (epoch.station_ecef - before->place_ecef).norm();
  if (epoch.station == before->number && apart_m <= kSamePlace_m) return;
  warn("station",
       fmt::format("on the topic {} station {} follows station {}, {:.0f} m apart: the ambiguities "
                   "restart at each change; let only one base publish there",
                   topic_, epoch.station, before->number, apart_m));
}

void RtcmTopic::look_at(const rtcm::DecoderStatus& before, GpsTime now) {
  // The station's place comes every 5 to 30 s.
  constexpr double kPlaceEvery_s = 60;
  const rtcm::DecoderStatus& status = decoder_.status();
  const std::uint64_t strange = status.bytes_passed_over - before.bytes_passed_over;
  if (strange > 0) {
    warn("strange",
         fmt::format("{} bytes of a message on the topic {} are not a frame of RTCM 3, or a damaged "
                     "one, and are left out; this is the first such message",
                     strange, topic_));
  }
  if (status.epochs > before.epochs) held_back_since_.reset();
  if (status.epochs_held_back == before.epochs_held_back) return;
  if (!held_back_since_) held_back_since_ = now;
  if (now - *held_back_since_ > kPlaceEvery_s) {
    warn("place", fmt::format("the topic {} has observations, and no message 1005 or 1006 with the place of "
                              "their station: nothing is corrected",
                              topic_));
  }
}

bool RtcmTopic::is_of_now(const relative::Corrections& epoch, GpsTime now) {
  constexpr double kAhead_s = 1;  // as receiver::CodeCorrections::age_s()
  const double age_s = now - epoch.receiver_time;
  if (age_s <= options_.max_age_s && age_s >= -kAhead_s) return true;
  warn("time", fmt::format("corrections on the topic {} are of {} and the receiver's time is {}, {} {}: they "
                           "are not used; give both the same time: no `start`, or one /clock and one `start`",
                           topic_, geodesy::format_gpst(epoch.receiver_time, 0), geodesy::format_gpst(now, 0),
                           long_time(std::abs(age_s)), age_s > 0 ? "later" : "earlier"));
  return false;
}

simulation::LiveReceiver::Step RtcmTopic::observe(simulation::LiveReceiver& receiver, double seconds,
                                                  const simulation::AntennaState& antenna) {
  const GpsTime now = receiver.start() + seconds;
  if (last_ && now < *last_) begin_anew();
  last_ = now;
  if (auto came = link_.take(now)) receiver.give(std::move(came));
  simulation::LiveReceiver::Step step = receiver.observe(seconds, antenna);
  place_ecef_ = step.epoch.truth_ecef;
  return step;
}

void RtcmTopic::warn(const std::string& fault, const std::string& text) {
  if (said_.insert(fault).second) warnings_.push_back(text);
}

std::vector<std::string> RtcmTopic::take_warnings() {
  return std::exchange(warnings_, {});
}

}  // namespace canyon::adapters::ros2
