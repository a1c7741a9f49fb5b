#include "adapters/common/hosted_receiver.hpp"

#include <fmt/format.h>

#include <chrono>
#include <limits>
#include <map>
#include <mutex>
#include <utility>

#include "adapters/common/stream_publisher.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/secrets.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/simulation/city_scene.hpp"

namespace canyon::adapters {
namespace {

using Eigen::Vector3d;
using geodesy::GpsTime;

constexpr double kDefaultRate_hz = 10;

std::shared_ptr<simulation::CityScene> open_field(const WorldFrame& frame) {
  city::City city;
  city.name = "open field";
  city.frame = frame.enu;
  return std::make_shared<simulation::CityScene>(std::move(city));
}

}  // namespace

std::string place_name(const ReceiverIdentity& identity) {
  std::string name = fmt::format("plugin '{}' of model '{}'", identity.plugin, identity.model);
  if (!identity.sensor.empty()) name += fmt::format(", sensor '{}'", identity.sensor);
  return name;
}

WorldFrame world_frame(const std::optional<HostOrigin>& host, const HostSettings& settings,
                       std::vector<std::string>& warnings) {
  WorldFrame frame;
  if (host) frame.heading_rad = host->heading_rad;
  const geodesy::Geodetic origin = settings.origin ? *settings.origin
                                   : host          ? host->origin
                                                   : geodesy::Geodetic{};
  if (!settings.origin && origin.latitude_rad == 0 && origin.longitude_rad == 0) {
    warnings.emplace_back(
        "the world is at latitude 0, longitude 0; give it spherical_coordinates, or the receiver "
        "origin_latitude, origin_longitude and origin_altitude");
  }
  frame.enu = geodesy::LocalFrame(origin);
  return frame;
}

WorldScene::Options scene_options(const std::string& world, const HostSettings& settings,
                                  const WorldFrame& frame) {
  return {world, settings.visual_geometry, frame, settings.facades,
          settings.facades.drawn() ? settings.live.seed : 1};
}

GpsTime start_of_world(const void* world, const std::string& name, std::int64_t sim_time_ns) {
  static std::mutex mutex;
  static std::map<std::string, std::pair<const void*, GpsTime>> starts;
  const std::lock_guard lock(mutex);
  auto& [of, start] = starts[name];
  if (of != world) {
    of = world;
    const auto now = std::chrono::system_clock::now().time_since_epoch();
    start = geodesy::gps_from_unix(std::chrono::duration_cast<std::chrono::nanoseconds>(now).count()) -
            std::chrono::nanoseconds(sim_time_ns);
  }
  return start;
}

HostedReceiver::HostedReceiver(HostSettings settings, const ReceiverIdentity& identity,
                               const WorldFrame& frame, GpsTime start_of_world, double sensor_rate_hz,
                               Say say)
    : settings_(std::move(settings)),
      name_(place_name(identity)),
      frame_(frame),
      say_(std::move(say)),
      sensor_rate_hz_(sensor_rate_hz),
      schedule_(1 / rate_hz()),
      start_(settings_.live.start.value_or(start_of_world)) {
  // Receivers of one seed have noise of their own by their names.
  if (!settings_.named) {
    settings_.live.receiver().options.name =
        fmt::format("{}/{}/{}", identity.link, identity.sensor, identity.plugin);
  }
  for (const std::string& line : std::exchange(settings_.warnings, {})) this->say(Tone::Warning, line);
  try {
    start_receiver();
    open_streams(identity.model);
  } catch (const InputError& e) {  // name the receiver
    throw InputError(fmt::format("{}: {}", name_, e.what()));
  }
}

void HostedReceiver::open_streams(const std::string& model) {
  const auto descriptions = output::describe_receivers(*receiver_, schedule_.interval_s());
  if (settings_.nmea_port != 0) {
    add(make_stream_publisher("nmea_port", fmt::format("nmea=tcp://127.0.0.1:{}", settings_.nmea_port),
                              descriptions));
  }
  for (const std::string& stream : settings_.streams) {
    add(make_stream_publisher("streams", stream_of_model("streams", stream, model), descriptions, {},
                              &*receiver_));
  }
}

HostedReceiver::~HostedReceiver() = default;

void HostedReceiver::start_receiver() {
  receiver_.emplace(settings_.live, open_field(frame_), start_);
  if (tracer_) receiver_->set_tracer(tracer_);
  for (const std::string& line : receiver_->take_warnings()) say(Tone::Warning, line);
}

double HostedReceiver::rate_hz() const {
  return settings_.live.rate_hz.value_or(sensor_rate_hz_ > 0 ? sensor_rate_hz_ : kDefaultRate_hz);
}

void HostedReceiver::say(Tone tone, const std::string& line) {
  if (said_.insert(line).second) say_(tone, hide_passwords(fmt::format("{}: {}", name_, line)));
}

std::string HostedReceiver::base_elsewhere() const {
  const simulation::LiveConfig& config = settings_.live;
  return config.base() == nullptr ? config.receiver().options.corrections.from : "";
}

void HostedReceiver::add(std::unique_ptr<EpochPublisher> publisher) {
  if (publisher) publishers_.push_back(std::move(publisher));
}

void HostedReceiver::set_scene(std::shared_ptr<WorldScene> scene, std::optional<HostWorld::Id> own_model) {
  scene_ = std::move(scene);
  own_model_ = own_model;
  has_scene_ = false;
}

void HostedReceiver::set_frame(const WorldFrame& frame) {
  frame_ = frame;
  start_receiver();  // a sky given by directions is one about the world's origin
  has_scene_ = false;
}

void HostedReceiver::set_tracer(simulation::Tracer tracer, std::function<std::vector<double>()> ranges,
                                double reach_m) {
  tracer_ = std::move(tracer);
  ranges_ = std::move(ranges);
  reach_m_ = reach_m;
  receiver_->set_tracer(tracer_);
}

AdjustableReceiver HostedReceiver::adjustable(const std::string& name) {
  return {name, &*receiver_, [this] {
            settings_.live = receiver_->config();
            schedule_.set_interval(1 / rate_hz());
          }};
}

void HostedReceiver::reset() {
  receiver_->restart();
  if (on_reset_) on_reset_();
  for (const auto& publisher : publishers_) publisher->reset();
}

bool HostedReceiver::due(std::int64_t now_ns) {
  if (now_ns < last_ns_) went_back_ = true;
  last_ns_ = now_ns;
  return schedule_.step(now_ns);
}

// Callbacks of simulators must not throw.
void HostedReceiver::begin(std::int64_t now_ns, const Truth& truth) {
  if (std::exchange(went_back_, false)) reset();
  report_ = {};
  report_.sim_time_ns = now_ns;
  report_.world_yaw_from_enu_rad = -frame_.heading_rad;
  truth_.reset();
  try {
    truth_ = truth(report_.reason);
    if (truth_ && scene_) scene_->follow();
  } catch (const std::exception& e) {
    truth_.reset();
    report_.reason = e.what();
    say(Tone::Error, report_.reason);
  }
}

void HostedReceiver::finish() {
  step_.reset();
  try {
    if (truth_) observe(*truth_, report_);
  } catch (const std::exception& e) {
    report_.reason = e.what();
    say(Tone::Error, report_.reason);
  }
  report_.step = step_ ? &*step_ : nullptr;
  if (step_) {
    for (const std::string& line : receiver_->take_warnings()) say(Tone::Warning, line);
  } else {
    report_.scan_ranges_m.clear();
  }
  for (const auto& publisher : publishers_) {
    publisher->publish(report_);
    for (const std::string& note : publisher->take_notes()) say(Tone::Warning, note);
  }
}

void HostedReceiver::serve(std::int64_t now_ns) {
  for (const auto& publisher : publishers_) {
    publisher->serve(now_ns);
    for (const std::string& note : publisher->take_notes()) say(Tone::Warning, note);
  }
}

void HostedReceiver::observe(const TruePose& truth, ReceiverReport& report) {
  const Vector3d& lever_arm_m = settings_.live.receiver().lever_arm_m;
  report.antenna_world_m = truth.pose.position_m + truth.pose.attitude * lever_arm_m;
  report.link_attitude_world = truth.pose.attitude;
  const simulation::AntennaState antenna =
      simulation::antenna_of(truth, lever_arm_m, frame_.heading_rad, Vector3d::Zero());

  if (scene_) {
    scene_->show(own_model_);
    if (!has_scene_ || scene_->generation() != generation_) {
      receiver_->set_scene(scene_->scene());
      generation_ = scene_->generation();
      has_scene_ = true;
    }
    for (const std::string& line : scene_->take_notes()) say(Tone::Warning, line);
  }
  step_ = receiver_->observe(static_cast<double>(report.sim_time_ns) * 1e-9, antenna);
  if (!settings_.publish_scan) return;
  report.scan_max_range_m = ranges_ ? reach_m_ : std::numeric_limits<double>::infinity();
  report.scan_ranges_m = ranges_ ? ranges_() : scan(antenna.position_enu_m);
}

// Direct and mirror ray of each satellite through the engine's scene.
std::vector<double> HostedReceiver::scan(const Vector3d& antenna_enu) const {
  std::vector<double> ranges;
  if (!scene_) return ranges;
  const raytrace::RayScene& scene = scene_->scene()->scene;
  const double min_range = scene.surface_offset_m(antenna_enu);
  const Eigen::Matrix3d enu_from_ecef = frame_.enu.ecef_from_local_rotation().transpose();
  const auto range = [&](const Vector3d& direction, double reach_m) {
    const auto hit = scene.cast({antenna_enu, direction, reach_m}, min_range);
    return hit ? hit->range_m : std::numeric_limits<double>::infinity();
  };
  ranges.reserve(2 * step_->arrival.views.size());
  for (const propagation::SatelliteView& view : step_->arrival.views) {
    const Vector3d direction = enu_from_ecef * view.line.direction_ecef;
    ranges.push_back(range(direction, std::numeric_limits<double>::infinity()));
    ranges.push_back(
        range(propagation::mirror_direction(direction), settings_.live.receiver().propagation.max_range_m));
  }
  return ranges;
}

}  // namespace canyon::adapters
