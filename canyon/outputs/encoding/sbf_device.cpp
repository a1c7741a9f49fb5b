#include "canyon/outputs/encoding/device.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/outputs/encoding/observations/raw_observations.hpp"
#include "canyon/outputs/encoding/sbf/block.hpp"
#include "canyon/outputs/encoding/sbf/commands.hpp"

namespace canyon::encoding {
namespace {

/// A Septentrio receiver at the other end of a line: its responses and the blocks of each epoch.
class SbfDevice final : public Encoder, public Device {
 public:
  explicit SbfDevice(const ReceiverDescription& receiver)
      : epochs_(receiver.glonass_channels, receiver.begin, Tags::WholeMilliseconds) {}

  std::string encode(const simulation::Epoch& epoch) override {
    described_.emplace(epochs_.next(epoch));
    now_ms_ = described_->reported_time.nanoseconds() / 1'000'000;
    messages_ = epochs_.received_messages(epoch);
    return blocks(all_);
  }
  Device* device() override { return this; }
  std::optional<std::string> encode_for_reader(std::uint64_t reader) override {
    sbf::SbfCommands* const own = own_.find(reader);
    if (own == nullptr || own->first().empty()) return std::nullopt;
    return blocks(*own);
  }

  std::string receive(std::uint64_t reader, std::string_view bytes) override {
    epochs_.receive(reader, bytes);
    sbf::SbfCommands& commands = reader == 0 ? all_ : own_.of(reader);
    const bool new_one = commands.first().empty();
    std::string answers = commands.receive(bytes, now_ms_);
    note(commands, new_one);
    return answers;
  }
  std::vector<std::shared_ptr<const rtk::Corrections>> take_corrections() override {
    return epochs_.take_corrections();
  }

 private:
  std::string blocks(sbf::SbfCommands& commands) {
    std::string bytes;
    for (const broadcast::SentMessage& message : messages_)
      if (commands.sends(sbf::message_number(message.id.system)))
        bytes += sbf::message_block(message, described_->reported_time, described_->glonass_channels);
    for (const std::uint16_t number : sbf::epoch_blocks())
      if (commands.is_due(number, now_ms_)) bytes += sbf::epoch_block(number, *described_);
    return bytes;
  }

  DeviceEpochs epochs_;
  sbf::SbfCommands all_;
  transport::Readers<sbf::SbfCommands> own_;  ///< of each connection
  std::optional<DeviceEpoch> described_;      ///< of the epoch of encode(), valid as long as the epoch
  std::vector<broadcast::SentMessage> messages_;
  std::int64_t now_ms_ = 0;
};

}  // namespace

std::unique_ptr<Encoder> encode_sbf(const ReceiverDescription& receiver) {
  return std::make_unique<SbfDevice>(receiver);
}

}  // namespace canyon::encoding
