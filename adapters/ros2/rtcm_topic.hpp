#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/receiver/receiver.hpp"
#include "canyon/relative/correction_link.hpp"
#include "canyon/rtcm/rtcm_decoder.hpp"
#include "canyon/simulation/live_receiver.hpp"

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

/// Corrections of one receiver that come as RTCM 3 by a topic: decoded, then delayed and thinned as its
/// CorrectionOptions say. Whatever the bytes are, it throws nothing and its memory is bounded. Not
/// thread-safe.
class RtcmTopic {
 public:
  /// Bytes of one message; longer ones are not read.
  static constexpr std::size_t kLongestMessage = std::size_t{64} * 1024;

  RtcmTopic(const receiver::ReceiverOptions& options, std::uint64_t seed);

  /// One message: frames, or pieces of frames that go on in the next message.
  /// @param now GPS time of the receiver
  void receive(std::string_view bytes, geodesy::GpsTime now);
  /// LiveReceiver::observe() with the corrections that have come by then. Restarts where time goes back.
  [[nodiscard]] simulation::LiveReceiver::Step observe(simulation::LiveReceiver& receiver, double seconds,
                                                       const simulation::AntennaState& antenna);
  /// Faults of the messages since the last call, one line each. Each fault is reported once.
  [[nodiscard]] std::vector<std::string> take_warnings();

 private:
  struct Station {
    int number;
    Eigen::Vector3d place_ecef;
  };
  void begin_anew();
  void look_for_other_station(const relative::Corrections& epoch);
  void look_at(const rtcm::DecoderStatus& before, geodesy::GpsTime now);
  /// Whether an epoch is one of the receiver's time, from a second ahead to corrections.max_age_s old.
  [[nodiscard]] bool is_of_now(const relative::Corrections& epoch, geodesy::GpsTime now);
  void warn(const std::string& fault, const std::string& text);

  relative::CorrectionOptions options_;
  std::uint64_t seed_;
  std::string receiver_, topic_;
  rtcm::CorrectionsDecoder decoder_;
  relative::CorrectionLink link_;
  std::optional<geodesy::GpsTime> last_, held_back_since_;
  std::optional<Station> station_;
  std::optional<Eigen::Vector3d> place_ecef_;  // of the receiver, for corrections.range_m [m]
  std::set<std::string> said_;
  std::vector<std::string> warnings_;
};

}  // namespace canyon::adapters::ros2
