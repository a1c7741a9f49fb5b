#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/receiver/receiver.hpp"
#include "canyon/receiver/rtcm/rtcm_decoder.hpp"
#include "canyon/receiver/rtk/correction_link.hpp"

namespace canyon::live {

/// Corrections of one receiver, received as RTCM 3 from a stream or a topic: decoded, then delayed and
/// thinned by its CorrectionOptions. Does not throw and uses bounded memory for any bytes. Not thread-safe.
class RtcmInput {
 public:
  /// Maximum bytes of one message; longer ones are not read.
  static constexpr std::size_t kMaxMessage = std::size_t{64} * 1024;

  RtcmInput(const receiver::ReceiverOptions& options, std::uint64_t seed);

  /// One message: frames, or parts of frames that continue in the next message.
  /// @param now GPS time of the receiver
  void receive(std::string_view bytes, geodesy::GpsTime now);
  /// The newest corrections received by then and not yet returned; null: none.
  [[nodiscard]] std::shared_ptr<const rtk::Corrections> take(geodesy::GpsTime now) { return link_.take(now); }
  /// Sets the receiver's position, for corrections.range_m [m].
  void set_position(const Eigen::Vector3d& antenna_position_ecef) {
    antenna_position_ecef_ = antenna_position_ecef;
  }
  /// Call it if time went back.
  void reset_state();
  /// Errors in the messages since the last call, one line each. Each error is reported once.
  [[nodiscard]] std::vector<std::string> take_warnings();

 private:
  struct Station {
    int number;
    Eigen::Vector3d antenna_position_ecef;
  };
  void look_for_other_station(const rtk::Corrections& epoch);
  void look_at(const rtcm::DecoderStatus& before, geodesy::GpsTime now);
  /// Whether an epoch fits the receiver's time: at most 1 s ahead and at most corrections.max_age_s old.
  [[nodiscard]] bool is_of_now(const rtk::Corrections& epoch, geodesy::GpsTime now);
  void warn(const std::string& fault, const std::string& text);

  rtk::CorrectionOptions options_;
  std::uint64_t seed_;
  std::string receiver_, source_;
  rtcm::CorrectionsDecoder decoder_;
  rtk::CorrectionLink link_;
  std::optional<geodesy::GpsTime> held_back_since_;
  std::optional<Station> station_;
  std::optional<Eigen::Vector3d> antenna_position_ecef_;
  std::set<std::string> logged_;
  std::vector<std::string> warnings_;
};

}  // namespace canyon::live
