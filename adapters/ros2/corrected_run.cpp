#include "adapters/ros2/corrected_run.hpp"

#include <iterator>
#include <utility>

#include "canyon/simulation/city_scene.hpp"

namespace canyon::adapters::ros2 {

CorrectedRun::CorrectedRun(const NodeSettings& settings,
                           std::shared_ptr<const simulation::Simulation> simulation,
                           std::shared_ptr<simulation::CityScene> scene)
    : Drive(std::move(simulation)),
      topic_(settings.live.receivers.front().options, settings.live.seed),
      receiver_(simulation::live_config(settings.live, 0, this->simulation().begin(),
                                        this->simulation().interval_s()),
                std::move(scene), this->simulation().begin()) {}

std::optional<simulation::LiveReceiver::Step> CorrectedRun::take() {
  if (finished()) return std::nullopt;
  const double seconds = static_cast<double>(next_ns()) * 1e-9;
  const geodesy::GpsTime now = simulation().begin() + seconds;
  const simulation::AntennaState antenna =
      simulation::antenna_state(simulation().antenna_pose(0, now), receiver_.environment().city().frame);
  simulation::LiveReceiver::Step step = topic_.observe(receiver_, seconds, antenna);
  count_taken();
  return step;
}

void CorrectedRun::receive_rtcm(std::string_view bytes, std::int64_t now_ns) {
  topic_.receive(bytes, simulation().begin() + static_cast<double>(now_ns) * 1e-9);
}

std::vector<std::string> CorrectedRun::take_warnings() {
  std::vector<std::string> lines = receiver_.take_warnings();
  std::vector<std::string> more = topic_.take_warnings();
  std::move(more.begin(), more.end(), std::back_inserter(lines));
  return lines;
}

}  // namespace canyon::adapters::ros2
