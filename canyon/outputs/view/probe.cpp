#include "canyon/outputs/view/probe.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/outputs/encoding/view_messages.hpp"
#include "canyon/outputs/view/recorder.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::view {
namespace {

/// Maximum distance of an antenna outside the city [m], as for a trajectory (Simulation).
constexpr double kReach_m = 10'000;

std::optional<std::int64_t> id_of(const Json& json) {
  if (!json["id"].is_integer()) return std::nullopt;
  return json["id"].get<std::int64_t>();
}

double number(const Json& json, const char* key, double low, double high) {
  if (!json[key].is_number())
    throw InputError(fmt::format("'{}' is not a number", key), "see docs/view-format.md, Messages");
  const auto value = json[key].get<double>();
  if (!(value >= low && value <= high))
    throw InputError(fmt::format("'{}' is {}", key, value),
                     fmt::format("give a value from {} to {}", low, high));
  return value;
}

}  // namespace

Probe::Probe(const simulation::Simulation& simulation, std::shared_ptr<simulation::CityScene> scene,
             std::size_t paths_per_satellite)
    : Probe(simulation.scenario(), simulation.begin(), simulation.interval_s(), std::move(scene),
            paths_per_satellite,
            static_cast<double>(std::max<std::size_t>(1, simulation.epoch_count()) - 1) *
                simulation.interval_s()) {}

Probe::Probe(const simulation::Scenario& scenario, geodesy::GpsTime begin, double interval_s,
             std::shared_ptr<simulation::CityScene> scene, std::size_t paths_per_satellite, double last_s)
    : scene_(std::move(scene)),
      paths_per_satellite_(paths_per_satellite),
      receivers_(simulation::live_config(scenario, begin, interval_s), scene_, begin),
      last_s_(last_s) {
  for (const Eigen::Vector3d& vertex : scene_->city.mesh.vertices) {
    low_ = low_.cwiseMin(vertex);
    high_ = high_.cwiseMax(vertex);
  }
}

Probe::ProbeRequest Probe::read(const Json& json) const {
  if (json["type"] != "probe")
    throw InputError("the server has no such message type", "send \"type\": \"probe\"");
  if (json["version"] != encoding::kViewMessages) {
    throw InputError(fmt::format("the message is not of version {}", encoding::kViewMessages),
                     "reload the page; another version of canyon made it");
  }
  ProbeRequest question;
  const double receiver = number(json, "receiver", 0, static_cast<double>(receivers_.size()) - 1);
  if (receiver != std::floor(receiver))
    throw InputError(fmt::format("'receiver' is {}", receiver), "give a whole number");
  question.receiver = static_cast<std::size_t>(receiver);
  question.time_s = number(json, "time_s", 0, last_s_);
  const Json& position = json["place"];
  if (!position.is_object())
    throw InputError("'place' is missing", "give east_m, north_m and up_m in the city's frame");
  const auto axis = [&](const char* key, int i) {
    return number(position, key, std::floor(low_[i] - kReach_m), std::ceil(high_[i] + kReach_m));
  };
  question.position = {axis("east_m", 0), axis("north_m", 1), axis("up_m", 2)};
  return question;
}

std::string Probe::trace(const ProbeRequest& question, std::optional<std::int64_t> id) {
  simulation::ReceiverRunner& receiver = receivers_[question.receiver];
  receiver.restart();
  // It is upright at its own position.
  simulation::ReceiverRunner::Step step = receiver.observe(
      {receiver.at(question.time_s), scene_->city.frame.geodetic_from_local(question.position)});
  step.epoch.arrival = &step.arrival;

  const receiver::ReceiverOptions& options = receiver.config().receiver().options;
  encoding::EpochMessage message;
  message.receiver = options.name;
  message.id = id;
  message.time_s = question.time_s;
  message.skyline = skyline_bytes(scene_->scene, question.position);
  encoding::EpochRows rows(options.signal, paths_per_satellite_);
  return encoding::epoch_message(
      std::move(message), step.epoch,
      [this](const Eigen::Vector3d& ecef) { return scene_->city.frame.local_from_ecef(ecef); }, rows);
}

std::string Probe::handle_request(const std::string& message) {
  const std::optional<Json> json = Json::try_parse(message);
  const auto id = json ? id_of(*json) : std::nullopt;
  try {
    if (!json) throw InputError("this is not JSON", "numbers must be finite: JSON has no NaN");
    return trace(read(*json), id);
  } catch (const InputError& error) {
    return encoding::error_message(id, error.what());
  }
}

std::string no_probe(const std::string& message, std::string_view why) {
  return encoding::error_message(id_of(Json::try_parse(message).value_or(Json())), why);
}

}  // namespace canyon::view
