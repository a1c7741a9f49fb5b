// Declared in canyon/output/formats.hpp.
#include <utility>

#include "canyon/output/formats.hpp"
#include "canyon/output/number.hpp"
#include "canyon/output/raw_observations.hpp"
#include "canyon/output/received_messages.hpp"
#include "canyon/output/sbf/blocks.hpp"
#include "canyon/output/sbf/commands.hpp"
#include "canyon/rtcm/rtcm_decoder.hpp"

namespace canyon::output {
namespace {

using geodesy::GpsTime;

/// A Septentrio receiver at the other end of a line: its answers, and the blocks of each epoch.
class SbfDevice final : public Encoder {
 public:
  explicit SbfDevice(const ReceiverDescription& receiver)
      : channels_(receiver.glonass_channels),
        decoder_([this](gnss::SatelliteId id) -> std::optional<int> {
          const auto found = channels_.find(id);
          return found == channels_.end() ? std::nullopt : std::optional(found->second);
        }),
        begin_(receiver.begin) {}

  std::string encode(const simulation::Epoch& epoch) override {
    const receiver::ReceiverEpoch& seen = epoch.observed;
    last_ = seen.receiver_time;
    if (seen.events.restart && seen.events.restart->at != begin_) {
      begin_ = seen.events.restart->at;
      time_known_ = false;
    }
    time_known_ = time_known_ || seen.fix.measured();
    const RawEpoch raw = observations_.next(seen);
    std::vector<sbf::Observable> observables;
    for (const RawObservation& o : raw.observations) {
      observables.push_back(
          {o.id, o.signal, o.measurement, o.pseudorange_m, o.carrier_phase_cycles, o.doppler_hz, o.locked_s});
    }
    constexpr std::int64_t kMillisecond = 1'000'000;
    const GpsTime stated = round_to(seen.stated_time(), kMillisecond);
    const std::int64_t ms = stated.nanoseconds() / kMillisecond;
    const sbf::Epoch of_blocks{seen,
                               time_known_ ? std::optional(stated) : std::nullopt,
                               raw.tag,
                               observables,
                               channels_,
                               seen.time - begin_,
                               epoch.geoid_undulation_m};
    std::string bytes;
    for (const broadcast::SentMessage& message : messages_.received(epoch)) {
      if (commands_.sends(sbf::message_number(message.id.system)))
        bytes += sbf::message_block(message, stated, channels_);
    }
    for (const std::uint16_t number : sbf::epoch_blocks()) {
      if (commands_.is_due(number, ms)) bytes += sbf::epoch_block(number, of_blocks);
    }
    return bytes;
  }

  std::string receive(std::uint64_t reader, std::string_view bytes) override {
    for (auto& epoch : decoder_.feed(bytes, last_.value_or(begin_))) corrections_.push_back(std::move(epoch));
    return commands_.receive(reader, bytes);
  }
  std::vector<std::shared_ptr<const relative::Corrections>> take_corrections() override {
    return std::exchange(corrections_, {});
  }
  std::optional<int> take_baud() override { return commands_.take_baud(); }
  std::optional<disturbance::RestartKind> take_restart() override { return commands_.take_restart(); }

 private:
  std::map<gnss::SatelliteId, int> channels_;
  canyon::rtcm::CorrectionsDecoder decoder_;
  std::vector<std::shared_ptr<const relative::Corrections>> corrections_;
  GpsTime begin_;
  std::optional<GpsTime> last_;  ///< receiver's time of the last epoch
  sbf::Commands commands_;
  ReceivedMessages messages_;
  RawObservations observations_{Tags::WholeMilliseconds};
  bool time_known_ = false;
};

}  // namespace

std::unique_ptr<Encoder> encode_sbf(const ReceiverDescription& receiver) {
  return std::make_unique<SbfDevice>(receiver);
}

}  // namespace canyon::output
