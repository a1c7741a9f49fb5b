#include <algorithm>
#include <memory>

#include "canyon/output/formats.hpp"
#include "canyon/output/view_messages.hpp"

namespace canyon::output {
namespace {

/// So many paths of a satellite at most go to the page: what it draws.
constexpr std::size_t kPaths = 12;

/// Messages of the viewer, a line each: "hello" first, then an "epoch" each. They know nothing of the city.
class ViewStream final : public Encoder {
 public:
  explicit ViewStream(const ReceiverDescription& receiver)
      : receiver_(receiver), rows_(receiver.signal, kPaths) {}

  std::string begin() override { return hello_message(receiver_) + "\n"; }

  std::string encode(const simulation::Epoch& epoch) override {
    if (epoch.arrival == nullptr) return {};
    const propagation::Arrival& arrival = *epoch.arrival;
    const EpochRows::ToLocal local = [&](const Eigen::Vector3d& ecef) -> Eigen::Vector3d {
      return arrival.antenna_enu + arrival.ecef_from_enu.transpose() * (ecef - epoch.truth_ecef);
    };
    EpochMessage message;
    message.receiver = receiver_.name;
    message.place = local(epoch.truth_ecef);
    message.time_s = epoch.observed.time - receiver_.begin;
    message.faults = epoch.faults;
    for (const auto& satellite : epoch.observed.satellites) message.satellites.push_back(satellite.id);
    rows_.clear();
    rows_.add(epoch, 0, message.time_s, -1, local, message.satellites);
    return epoch_message(message, rows_) + "\n";
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
