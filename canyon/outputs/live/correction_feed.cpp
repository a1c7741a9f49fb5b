#include "canyon/outputs/live/correction_feed.hpp"

#include <fmt/format.h>

#include "canyon/base/input_error.hpp"
#include "canyon/outputs/encoding/nmea.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::live {

CorrectionFeed::CorrectionFeed(const simulation::Scenario& scenario, transport::Links& links,
                               const SessionClock& clock)
    : inputs_(scenario.receivers.size()) {
  for (std::size_t r = 0; r < inputs_.size(); ++r) {
    const receiver::ReceiverOptions& options = scenario.receivers[r].options;
    const std::string& address = options.corrections.from;
    if (!rtk::is_stream(address)) continue;
    if (address.starts_with(rtk::kTopicAddress)) {
      throw InputError(
          scenario.file, 0,
          fmt::format("receiver '{}' uses corrections from '{}', a ROS 2 topic", options.name, address),
          "run it as a ROS 2 node (docs/ros2.md), or use a caster, ntrip://USER:PASSWORD@HOST:PORT/MOUNT");
    }
    Input& input = inputs_[r].emplace(Input{RtcmInput(options, scenario.seed)});
    const auto link = transport::link_of(links, address);
    if (address.starts_with("ntrip://")) input.caster = link;
    (void)link->listen([&input, &clock](const transport::Received& received) {
      input.input.receive(received.bytes, clock.now());
    });
  }
}

std::shared_ptr<const rtk::Corrections> CorrectionFeed::take(std::size_t receiver, geodesy::GpsTime time) {
  return inputs_[receiver] ? inputs_[receiver]->input.take(time) : nullptr;
}

void CorrectionFeed::report_position(const simulation::Epoch& epoch) {
  constexpr double kReportEvery_s = 10;
  auto& input = inputs_[epoch.receiver];
  if (!input) return;
  input->input.set_position(epoch.truth_ecef);
  if (!input->caster || !epoch.observed.fix.solved()) return;
  if (input->reported && epoch.observed.time - *input->reported < kReportEvery_s) return;
  input->reported = epoch.observed.time;
  input->caster->transport().send(encoding::nmea_gga(epoch));
}

void CorrectionFeed::reset_state() {
  for (auto& input : inputs_) {
    if (!input) continue;
    input->reported.reset();
    input->input.reset_state();
  }
}

std::vector<std::string> CorrectionFeed::take_warnings(std::size_t receiver) {
  return inputs_[receiver] ? inputs_[receiver]->input.take_warnings() : std::vector<std::string>{};
}

}  // namespace canyon::live
