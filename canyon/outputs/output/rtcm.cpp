#include "canyon/outputs/output/rtcm.hpp"

#include <set>

#include "canyon/outputs/output/encoder.hpp"
#include "canyon/outputs/output/epoch_values.hpp"

namespace canyon::output {

using broadcast::Bits;

namespace {

constexpr double kStationEvery_s = 10;

class Rtcm final : public Encoder {
 public:
  explicit Rtcm(const ReceiverDescription& receiver)
      : station_(rtcm::station_messages(receiver)), observations_(receiver.glonass_channels) {
    if (receiver.ephemerides) ephemerides_.emplace();
  }

  std::string encode(const simulation::Epoch& epoch) override {
    std::string bytes;
    const geodesy::GpsTime now = epoch.observed.time;
    if (!station_sent_ || now - *station_sent_ >= kStationEvery_s) {
      station_sent_ = now;
      for (const Bits& message : station_) bytes += rtcm::frame(message);
    }
    if (ephemerides_) {
      for (const Bits& message : ephemerides_->due(epoch)) bytes += rtcm::frame(message);
    }
    for (const Bits& message : observations_.messages(epoch.observed)) bytes += rtcm::frame(message);
    return bytes;
  }

 private:
  std::vector<Bits> station_;
  std::optional<geodesy::GpsTime> station_sent_;
  std::optional<rtcm::Ephemerides> ephemerides_;
  rtcm::Observations observations_;
};

}  // namespace

namespace rtcm {

Bits station(const Eigen::Vector3d& antenna_ecef, bool computed) {
  Bits bits;
  // DF003 station 0; DF021 year of the frame, not given; DF022 to DF024 it serves GPS, GLONASS, Galileo;
  // DF141 whether it is a computed one.
  bits.put(1005, 12).put(0, 12).put(0, 6).put(0b111, 3).put(computed ? 1 : 0, 1);
  const auto coordinate = [&](double metres) { bits.number(metres, 1e-4, 38); };
  coordinate(antenna_ecef.x());
  bits.put(0b10, 2);  // DF142: all signals of one instant; reserved
  coordinate(antenna_ecef.y());
  bits.put(0, 2);  // DF364: quarter cycles not given
  coordinate(antenna_ecef.z());
  return bits;
}

Bits descriptors() {
  Bits bits;
  bits.put(1033, 12).put(0, 12);
  const auto text = [&](std::string_view word) {
    bits.put(word.size(), 8);
    for (const char c : word) bits.put(static_cast<unsigned char>(c), 8);
  };
  text("ADVNULLANTENNA");
  bits.put(0, 8);  // DF031: the antenna's usual set-up
  text("");        // its serial number
  text("Canyon");
  text("");  // firmware
  text("");  // serial number
  return bits;
}

Bits glonass_biases(const std::vector<std::string_view>& rinex_codes) {
  // DF422: L1 C/A, L1 P, L2 C/A, L2 P.
  const std::set<std::string_view> codes(rinex_codes.begin(), rinex_codes.end());
  Bits bits;
  bits.put(1230, 12).put(0, 12).put(1, 1).put(0, 3);  // DF421: aligned
  for (const char* code : {"1C", "1P", "2C", "2P"}) bits.put(codes.count(code), 1);
  for (const char* code : {"1C", "1P", "2C", "2P"}) {
    if (codes.count(code) > 0) bits.put(0, 16);
  }
  return bits;
}

std::vector<Bits> station_messages(const ReceiverDescription& receiver) {
  std::vector<Bits> messages;
  if (receiver.station_ecef) messages.push_back(station(*receiver.station_ecef, receiver.virtual_station));
  messages.push_back(descriptors());
  if (!receiver.signal.enabled || receiver.systems.count(gnss::System::GLONASS) == 0) return messages;
  std::vector<std::string_view> codes;
  for (const gnss::Signal* signal : receiver::tracked_signals(receiver.tracks, gnss::System::GLONASS)) {
    codes.push_back(signal->code);
  }
  if (!codes.empty()) messages.push_back(glonass_biases(codes));
  return messages;
}

}  // namespace rtcm

std::unique_ptr<Encoder> encode_rtcm(const ReceiverDescription& receiver) {
  return std::make_unique<Rtcm>(receiver);
}

}  // namespace canyon::output
