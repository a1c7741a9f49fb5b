#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/base/transport/link.hpp"
#include "canyon/outputs/live/rtcm_input.hpp"
#include "canyon/outputs/live/session_clock.hpp"
#include "canyon/simulation/epoch.hpp"

namespace canyon::live {

/// Corrections of a session's receivers from RTCM 3 streams (CorrectionOptions::from).
class CorrectionFeed {
 public:
  /// Opens the streams. Throws InputError for an address that cannot be opened, and for a ROS 2 topic.
  /// @param clock used when bytes are received; must outlive this
  CorrectionFeed(const simulation::Scenario& scenario, transport::Links& links, const SessionClock& clock);

  /// As RtcmInput::take(); null for receivers without a stream.
  [[nodiscard]] std::shared_ptr<const rtk::Corrections> take(std::size_t receiver, geodesy::GpsTime time);
  /// Takes the position of an epoch's receiver, and sends it to its NTRIP caster as a GGA sentence each 10 s.
  void report_position(const simulation::Epoch& epoch);
  /// Call it if time went back.
  void reset_state();
  /// As RtcmInput::take_warnings().
  [[nodiscard]] std::vector<std::string> take_warnings(std::size_t receiver);

 private:
  struct Input {
    RtcmInput input;
    std::shared_ptr<transport::Link> caster = {};  ///< to which the receiver reports its position; null: none
    std::optional<geodesy::GpsTime> reported = {};
  };
  std::vector<std::optional<Input>> inputs_;  // by receiver
};

}  // namespace canyon::live
