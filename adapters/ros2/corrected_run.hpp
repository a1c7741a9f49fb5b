#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "adapters/ros2/node_settings.hpp"
#include "adapters/ros2/rtcm_topic.hpp"
#include "adapters/ros2/scenario_run.hpp"

namespace canyon::adapters::ros2 {

/// A scenario's own drive of a receiver that takes its corrections from a topic. Each epoch is made when it
/// is taken, from the corrections that have come by then. Not thread-safe.
class CorrectedRun final : public Drive {
 public:
  /// @param simulation of the same settings, by simulated_world()
  CorrectedRun(const NodeSettings& settings, std::shared_ptr<const simulation::Simulation> simulation,
               std::shared_ptr<simulation::CityScene> scene);

  [[nodiscard]] bool ready() override { return true; }
  [[nodiscard]] std::optional<simulation::LiveReceiver::Step> take() override;
  void receive_rtcm(std::string_view bytes, std::int64_t now_ns) override;
  [[nodiscard]] std::vector<std::string> take_warnings() override;

 private:
  RtcmTopic topic_;
  simulation::LiveReceiver receiver_;
};

}  // namespace canyon::adapters::ros2
