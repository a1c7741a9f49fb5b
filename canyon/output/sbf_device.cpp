// Declared in canyon/output/encoder.hpp.
#include "canyon/output/encoder.hpp"
#include "canyon/output/observations/raw_observations.hpp"
#include "canyon/output/sbf/block.hpp"
#include "canyon/output/sbf/commands.hpp"

namespace canyon::output {
namespace {

/// A Septentrio receiver at the other end of a line: its answers, and the blocks of each epoch.
class SbfDevice final : public Encoder {
 public:
  explicit SbfDevice(const ReceiverDescription& receiver)
      : epochs_(receiver.glonass_channels, receiver.begin, Tags::WholeMilliseconds) {}

  std::string encode(const simulation::Epoch& epoch) override {
    const DeviceEpoch told = epochs_.next(epoch);
    const std::int64_t ms = told.stated.nanoseconds() / 1'000'000;
    std::string bytes;
    for (const broadcast::SentMessage& message : epochs_.received_messages(epoch)) {
      if (commands_.sends(sbf::message_number(message.id.system)))
        bytes += sbf::message_block(message, told.stated, told.glonass_channels);
    }
    for (const std::uint16_t number : sbf::epoch_blocks()) {
      if (commands_.is_due(number, ms)) bytes += sbf::epoch_block(number, told);
    }
    return bytes;
  }

  std::string receive(std::uint64_t reader, std::string_view bytes) override {
    epochs_.receive(bytes);
    return commands_.receive(reader, bytes);
  }
  std::vector<std::shared_ptr<const relative::Corrections>> take_corrections() override {
    return epochs_.take_corrections();
  }
  std::optional<int> take_baud() override { return commands_.take_baud(); }
  std::optional<disturbance::RestartKind> take_restart() override { return commands_.take_restart(); }

 private:
  DeviceEpochs epochs_;
  sbf::Commands commands_;
};

}  // namespace

std::unique_ptr<Encoder> encode_sbf(const ReceiverDescription& receiver) {
  return std::make_unique<SbfDevice>(receiver);
}

}  // namespace canyon::output
