#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string_view>
#include <vector>

#include "canyon/broadcast/schedule.hpp"
#include "canyon/output/observations/raw_observations.hpp"
#include "canyon/rtcm/rtcm_decoder.hpp"
#include "canyon/simulation/epoch.hpp"

namespace canyon::output {

/// The navigation messages that a receiver has received whole, epoch by epoch.
class ReceivedMessages {
 public:
  /// Messages that ended since the epoch before, of satellites tracked all along.
  std::vector<broadcast::SentMessage> received(const simulation::Epoch& epoch);

 private:
  struct Tracked {
    geodesy::GpsTime since, last;  ///< times of transmission
  };
  std::map<gnss::SatelliteId, Tracked> tracked_;
  broadcast::Schedule schedule_;
};

/// An epoch as a receiver on a line tells of it, whatever its protocol. Refers to the epoch and to the
/// DeviceEpochs that made it.
struct DeviceEpoch {
  const receiver::ReceiverEpoch& seen;
  geodesy::GpsTime stated;  ///< time that the receiver states, the nearest millisecond
  bool time_known = false;  ///< there has been a fix since the start
  double first_fix_s = 0;   ///< from the start to the first fix; 0 until there was one
  double uptime_s = 0;      ///< since the start
  const RawEpoch& raw;
  const std::map<gnss::SatelliteId, int>& glonass_channels;
  double geoid_undulation_m = 0;  ///< of the place of the fix
};

/// Memory that every receiver on a line has, whatever its protocol: its start, its first fix, arcs of its
/// carrier phases, navigation messages that it receives, and corrections that come in.
class DeviceEpochs {
 public:
  /// @param begin of the run, when the receiver starts
  DeviceEpochs(std::map<gnss::SatelliteId, int> glonass_channels, geodesy::GpsTime begin, Tags tags);
  DeviceEpochs(const DeviceEpochs&) = delete;
  DeviceEpochs& operator=(const DeviceEpochs&) = delete;

  /// @param epoch in order of time; must live as long as the result, which the next call ends
  [[nodiscard]] DeviceEpoch next(const simulation::Epoch& epoch);
  /// Navigation messages that ended since the epoch before.
  [[nodiscard]] std::vector<broadcast::SentMessage> received_messages(const simulation::Epoch& epoch) {
    return messages_.received(epoch);
  }

  /// Bytes of RTCM 3 among others, cut anywhere.
  void receive(std::string_view bytes);
  /// Epochs of a base that these bytes had since the last call.
  [[nodiscard]] std::vector<std::shared_ptr<const relative::Corrections>> take_corrections();
  [[nodiscard]] const canyon::rtcm::DecoderStatus& corrections_status() const { return decoder_.status(); }

  [[nodiscard]] const std::map<gnss::SatelliteId, int>& glonass_channels() const { return channels_; }
  /// The start of the run, or of the latest restart.
  [[nodiscard]] geodesy::GpsTime start() const { return start_; }

 private:
  std::map<gnss::SatelliteId, int> channels_;
  canyon::rtcm::CorrectionsDecoder decoder_;
  std::vector<std::shared_ptr<const relative::Corrections>> corrections_;
  geodesy::GpsTime start_;
  geodesy::GpsTime clock_;  ///< of the latest epoch, by the receiver's clock
  std::optional<geodesy::GpsTime> first_fix_;
  ReceivedMessages messages_;
  RawObservations observations_;
  RawEpoch raw_;  ///< of the latest epoch
};

/// Standard deviation of a fix's clock [m]. Clocks have no covariance of their own: it is their dilution, at
/// the error that the position has for its own dilution. Empty without a dilution.
[[nodiscard]] std::optional<double> clock_sigma_m(const positioning::Fix& fix);

}  // namespace canyon::output
