// Declared in canyon/output/formats.hpp.
#include <memory>
#include <utility>

#include "canyon/output/formats.hpp"
#include "canyon/output/view_messages.hpp"

namespace canyon::output {
namespace {

/// The most paths of a satellite that go to the page, which draws no more.
constexpr std::size_t kPaths = 12;

/// Messages of the viewer, a line each: "hello" first, then an "epoch" each. They know nothing of the city.
class ViewStream final : public Encoder {
 public:
  explicit ViewStream(const ReceiverDescription& receiver)
      : receiver_(receiver), rows_(receiver.signal, kPaths) {}

  std::string begin() override { return hello_message({&receiver_, 1}) + "\n"; }

  std::string encode(const simulation::Epoch& epoch) override {
    if (epoch.arrival == nullptr) return {};
    const propagation::Arrival& arrival = *epoch.arrival;
    const EpochRows::ToLocal local = [&](const Eigen::Vector3d& ecef) -> Eigen::Vector3d {
      return arrival.antenna_enu + arrival.ecef_from_enu.transpose() * (ecef - epoch.truth_ecef);
    };
    EpochMessage message;
    message.receiver = receiver_.name;
    message.time_s = epoch.observed.time - receiver_.begin;
    return epoch_message(std::move(message), epoch, local, rows_) + "\n";
  }

 private:
  ReceiverDescription receiver_;
  EpochRows rows_;
};

}  // namespace

std::unique_ptr<Encoder> encode_view(const ReceiverDescription& receiver) {
  return std::make_unique<ViewStream>(receiver);
}

}  // namespace canyon::output
