#include "canyon/view/probe.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/city/city.hpp"
#include "canyon/output/view_messages.hpp"
#include "canyon/simulation/city_scene.hpp"
#include "canyon/simulation/live_receiver.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/view/recorder.hpp"

namespace canyon::view {
namespace {

/// An antenna may stand so far outside the city [m]: as far as a trajectory may (Simulation).
constexpr double kReach_m = 10'000;
/// Length of a run without a known end: three years.
constexpr double kLongest_s = 1e8;

std::optional<std::int64_t> id_of(const Json& json) {
  if (!json["id"].is_integer()) return std::nullopt;
  return json["id"].get<std::int64_t>();
}

struct Question {
  std::size_t receiver = 0;
  double time_s = 0;
  Eigen::Vector3d place;
};

double number(const Json& json, const char* key, double low, double high) {
  if (!json[key].is_number()) {
    throw InputError(fmt::format("'{}' is not a number", key), "see docs/view-format.md, Messages");
  }
  const auto value = json[key].get<double>();
  if (!(value >= low && value <= high)) {
    throw InputError(fmt::format("'{}' is {}", key, value), fmt::format("it runs from {} to {}", low, high));
  }
  return value;
}

}  // namespace

struct Probe::Impl {
  Impl(const simulation::Scenario& scenario, geodesy::GpsTime begin, double interval_s,
       std::shared_ptr<simulation::CityScene> given, std::size_t paths, double last)
      : scene(std::move(given)), paths_per_satellite(paths), last_s(last) {
    std::shared_ptr<const simulation::BuiltSky> sky;
    for (std::size_t r = 0; r < scenario.receivers.size(); ++r) {
      receivers.emplace_back(simulation::live_config(scenario, r, begin, interval_s), scene, begin, sky);
      sky = receivers.back().shared_sky();
    }
    for (const Eigen::Vector3d& vertex : scene->city.mesh.vertices) {
      low = low.cwiseMin(vertex);
      high = high.cwiseMax(vertex);
    }
  }

  [[nodiscard]] Question read(const Json& json) const {
    if (json["type"] != "probe") {
      throw InputError("the server does not know this message", "it answers \"type\": \"probe\"");
    }
    if (json["version"] != output::kViewMessages) {
      throw InputError(fmt::format("the message is not of version {}", output::kViewMessages),
                       "load the page anew: it is not this program's");
    }
    Question question;
    const double receiver = number(json, "receiver", 0, static_cast<double>(receivers.size()) - 1);
    if (receiver != std::floor(receiver)) {
      throw InputError(fmt::format("'receiver' is {}", receiver), "it is a whole number");
    }
    question.receiver = static_cast<std::size_t>(receiver);
    question.time_s = number(json, "time_s", 0, last_s);
    const Json& place = json["place"];
    if (!place.is_object()) {
      throw InputError("'place' is missing", "give east_m, north_m and up_m in the city's frame");
    }
    const auto axis = [&](const char* key, int i) {
      return number(place, key, std::floor(low[i] - kReach_m), std::ceil(high[i] + kReach_m));
    };
    question.place = {axis("east_m", 0), axis("north_m", 1), axis("up_m", 2)};
    return question;
  }

  [[nodiscard]] std::string trace(const Question& question, std::optional<std::int64_t> id) {
    simulation::LiveReceiver& receiver = receivers[question.receiver];
    receiver.restart();
    simulation::AntennaState antenna;
    antenna.position_enu_m = question.place;
    simulation::LiveReceiver::Step step = receiver.observe(question.time_s, antenna);
    step.epoch.arrival = &step.arrival;

    const receiver::ReceiverOptions& options = receiver.config().receiver().options;
    output::EpochMessage message;
    message.receiver = options.name;
    message.id = id;
    message.time_s = question.time_s;
    message.skyline = skyline_bytes(scene->scene, question.place);
    output::EpochRows rows(options.signal, paths_per_satellite);
    return output::epoch_message(
        std::move(message), step.epoch,
        [this](const Eigen::Vector3d& ecef) { return scene->city.frame.local_from_ecef(ecef); }, rows);
  }

  std::shared_ptr<simulation::CityScene> scene;
  std::size_t paths_per_satellite;
  std::vector<simulation::LiveReceiver> receivers;
  double last_s;
  /// By the city and its origin.
  Eigen::Vector3d low = Eigen::Vector3d::Zero(), high = Eigen::Vector3d::Zero();
};

Probe::Probe(const simulation::Simulation& simulation, std::shared_ptr<simulation::CityScene> scene,
             std::size_t paths_per_satellite)
    : impl_(
          std::make_unique<Impl>(simulation.scenario(), simulation.begin(), simulation.interval_s(),
                                 std::move(scene), paths_per_satellite,
                                 static_cast<double>(std::max<std::size_t>(1, simulation.epoch_count()) - 1) *
                                     simulation.interval_s())) {}
Probe::Probe(const simulation::Scenario& scenario, geodesy::GpsTime begin, double interval_s,
             std::shared_ptr<simulation::CityScene> scene, std::size_t paths_per_satellite)
    : impl_(std::make_unique<Impl>(scenario, begin, interval_s, std::move(scene), paths_per_satellite,
                                   kLongest_s)) {}
Probe::~Probe() = default;

std::string Probe::answer(const std::string& message) {
  const std::optional<Json> json = Json::try_parse(message);
  const auto id = json ? id_of(*json) : std::nullopt;
  try {
    if (!json) throw InputError("this is not JSON", "numbers must be finite: JSON has no NaN");
    return impl_->trace(impl_->read(*json), id);
  } catch (const InputError& error) {
    return output::error_message(id, error.what());
  }
}

std::string no_probe(const std::string& message, std::string_view why) {
  return output::error_message(id_of(Json::try_parse(message).value_or(Json())), why);
}

}  // namespace canyon::view
