#include "canyon/outputs/live/hosted_receiver.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <limits>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/input_files.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/text.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/outputs/encoding/stream.hpp"
#include "canyon/paths/propagation/propagator.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/receiver/rtk/correction_link.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::live {
namespace {

std::shared_ptr<simulation::CityScene> open_field(const WorldFrame& frame) {
  city::City city;
  city.name = "open field";
  city.frame = frame.enu;
  return std::make_shared<simulation::CityScene>(std::move(city));
}

/// The reader throws an error for an unknown format.
void visit_streams(options::Visitor& v, const options::Field& field, std::vector<std::string>& streams) {
  v.texts(field, streams);
  if (!v.reads()) return;
  try {
    for (const std::string& text : streams) (void)encoding::format_named(encoding::parse_stream(text).format);
  } catch (const InputError& e) {
    throw v.fault(field.name, e.problem(), e.hint());
  }
}

}  // namespace

HostedReceiver::HostedReceiver(HostSetup setup)
    : options_(std::move(setup.options)),
      frame_(setup.frame),
      default_rate_hz_(setup.rate_hz),
      scans_(setup.scan),
      make_sensors_(std::move(setup.sensors)),
      schedule_(1 / rate_hz(), setup.epochs),
      start_(options_.live.start.value_or(setup.start)),
      city_(std::move(setup.city)),
      name_(std::move(setup.name)),
      log_(std::move(setup.log)),
      sky_warnings_(setup.sky_warnings ? std::move(setup.sky_warnings) : std::make_shared<SkyWarnings>()) {
  InputFiles::begin_run();
  for (const std::string& line : setup.warnings) log(Severity::Warning, line);
  try {
    start_receiver();
    std::vector<encoding::ReceiverDescription> descriptions;
    for (std::size_t r = 0; r < run_->size(); ++r)
      descriptions.push_back(encoding::describe_receivers((*run_)[r], schedule_.interval_s()).front());
    for (const auto& [setting, stream] : setup.streams) {
      add(make_stream_publisher(setting, stream_of_model(setting, stream, setup.model), descriptions,
                                setup.open_link, &receiver()),
          setting);
    }
  } catch (const InputError& e) {  // name the receiver
    if (name().empty()) throw;
    throw InputError(fmt::format("{}: {}", name(), e.what()));
  } catch (const OutputError& e) {
    if (name().empty()) throw;
    throw OutputError(fmt::format("{}: {}", name(), e.what()));
  }
}

HostedReceiver::~HostedReceiver() = default;

void HostedReceiver::start_receiver() {
  auto& fixed = options_.live.receiver().fixed;
  if (fixed) fixed->resolve(frame_.enu);
  simulation::RunnerConfig config = options_.live;
  if (config.base() != nullptr) config.receivers[1].options.corrections = {};  // it uses none here
  run_.emplace(std::move(config), city_ ? city_ : open_field(frame_), start_);
  if (tracer_) receiver().set_tracer(tracer_);
  log_warnings();
  make_rtcm();
  begin_sensors();
}

void HostedReceiver::begin_sensors() {
  sensors_.reset();
  if (make_sensors_) sensors_.emplace(make_sensors_());
}

void HostedReceiver::log_warnings() {
  for (std::size_t r = 0; r < run_->size(); ++r) {
    sky_warnings_->take((*run_)[r], [&](const std::string& line, bool is_sky_warning) {
      log(Severity::Warning, r == 0 ? line : fmt::format("{}: {}", options_.live.base()->options.name, line),
          is_sky_warning);
    });
  }
}

void HostedReceiver::log(Severity tone, const std::string& line, bool requested) {
  if (!logged_.insert(line).second) return;
  log_(tone, hide_passwords(requested || name_.empty() ? line : fmt::format("{}: {}", name_, line)));
}

void HostedReceiver::add(std::unique_ptr<EpochPublisher> publisher, std::string failure) {
  if (publisher) publishers_.emplace_back(std::move(publisher), std::move(failure));
}

void HostedReceiver::publish(const std::function<void(EpochPublisher&)>& work) {
  for (auto& [publisher, failure] : publishers_) {
    if (!publisher) continue;
    try {
      work(*publisher);
      for (const std::string& note : publisher->take_notes()) log(Severity::Warning, note);
    } catch (const std::exception& e) {
      if (failure.empty()) throw;
      log(Severity::Warning, fmt::format("{}: {}", failure, e.what()));
      publisher.reset();
    }
  }
}

void HostedReceiver::serve(std::int64_t now_ns) {
  publish([now_ns](EpochPublisher& publisher) { publisher.serve(now_ns); });
}

void HostedReceiver::make_rtcm() {
  rtcm_.reset();
  const receiver::ReceiverOptions& options = options_.live.receiver().options;
  if (rtk::is_stream(options.corrections.from)) rtcm_.emplace(options, options_.live.seed);
}

std::string HostedReceiver::base_receiver_name() const {
  const simulation::RunnerConfig& config = options_.live;
  return config.base() == nullptr ? config.receiver().options.corrections.from : "";
}

void HostedReceiver::set_scene(std::shared_ptr<WorldScene> scene,
                               std::optional<HostWorld::Id> vehicle_model) {
  scene_ = std::move(scene);
  vehicle_model_ = vehicle_model;
  has_scene_ = false;
}

void HostedReceiver::set_frame(const WorldFrame& frame) {
  frame_ = frame;
  start_receiver();  // a sky given by directions is relative to the world's origin
  has_scene_ = false;
}

void HostedReceiver::set_tracer(simulation::Tracer tracer, std::function<std::vector<double>()> ranges,
                                double reach_m) {
  tracer_ = std::move(tracer);
  ranges_ = std::move(ranges);
  reach_m_ = reach_m;
  receiver().set_tracer(tracer_);
}

void HostedReceiver::set_config(simulation::RunnerConfig config) {
  if (auto& fixed = config.receiver().fixed) fixed->resolve(frame_.enu);
  receiver().set_config(std::move(config));
  take_config();
  make_rtcm();
}

void HostedReceiver::take_config() {
  options_.live.receiver() = receiver().config().receiver();
  options_.live.rate_hz = receiver().config().rate_hz;
}

ReceiverHandle HostedReceiver::receiver_handle(const std::string& name) {
  const auto changed = [this] {
    take_config();
    schedule_.set_interval(1 / rate_hz());
  };
  return {name, &receiver(), changed, run_->size() > 1 ? &(*run_)[1] : nullptr};
}

geodesy::GpsTime HostedReceiver::time_of(std::int64_t now_ns) const {
  return start_ + static_cast<double>(now_ns) * 1e-9;
}

void HostedReceiver::take_rtcm(std::string_view bytes, std::int64_t now_ns) {
  if (rtcm_) rtcm_->receive(bytes, time_of(now_ns));
}

void HostedReceiver::reset() {
  reset_state();
  schedule_.go_to(0);
}

void HostedReceiver::reset_state() {
  run_->restart();
  begin_sensors();
  if (rtcm_) rtcm_->reset_state();
  if (on_reset_) on_reset_();
  publish([](EpochPublisher& publisher) { publisher.reset(); });
}

bool HostedReceiver::due(std::int64_t now_ns) {
  if (now_ns < last_ns_) went_back_ = true;
  last_ns_ = now_ns;
  return schedule_.step(now_ns);
}

void HostedReceiver::follow(
    std::int64_t now_ns,
    const std::function<std::optional<Motion>(std::int64_t at_ns, std::string& reason)>& truth) {
  while (!over() && next_ns() <= now_ns) {
    const std::int64_t at_ns = schedule_.take();
    begin(at_ns, [&](std::string& reason) { return truth(at_ns, reason); });
    finish();
  }
}

// Callbacks of simulators must not throw.
void HostedReceiver::begin(std::int64_t now_ns, const Truth& truth) {
  if (std::exchange(went_back_, false)) reset_state();
  report_ = {};
  report_.sim_time_ns = now_ns;
  report_.world_yaw_from_enu_rad = -frame_.heading_rad;
  motion_.reset();
  try {
    motion_ = truth(report_.reason);
    if (motion_ && scene_) scene_->follow();
  } catch (const std::exception& e) {
    motion_.reset();
    report_.reason = e.what();
    log(Severity::Error, report_.reason);
  }
}

void HostedReceiver::finish() {
  steps_.clear();
  report_.step = report_.base = nullptr;
  const auto begin = std::chrono::steady_clock::now();
  try {
    if (motion_) compute(*motion_);
  } catch (const std::exception& e) {
    report_.reason = e.what();
    log(Severity::Error, report_.reason);
  }
  report_.compute_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  if (!steps_.empty()) {
    report_.step = &steps_.back();  // the base comes first
    if (steps_.size() > 1) report_.base = &steps_.front();
    log_warnings();
  } else {
    report_.scan_ranges_m.clear();
  }
  if (rtcm_)
    for (const std::string& line : rtcm_->take_warnings()) log(Severity::Warning, line);
  publish([this](EpochPublisher& publisher) { publisher.publish(report_); });
}

void HostedReceiver::compute(const Motion& motion) {
  const std::int64_t now_ns = report_.sim_time_ns;
  const geodesy::GpsTime now = receiver().at(static_cast<double>(now_ns) * 1e-9);
  Antennas antennas;
  if (const auto* body = std::get_if<simulation::RigidPose>(&motion)) {
    const auto antenna_of = [&](const simulation::ReceiverConfig& mounted) {
      return simulation::pose_of(*body, frame_, now, mounted.lever_arm_m);
    };
    const simulation::ReceiverConfig& own = options_.live.receiver();
    report_.antenna_world_m = body->position_m + body->attitude * own.lever_arm_m;
    report_.link_attitude_world = body->attitude;
    antennas.receiver = antenna_of(own);
    if (const simulation::ReceiverConfig* base = options_.live.base()) antennas.base = antenna_of(*base);
  } else {
    antennas = std::get<Antennas>(motion);
  }
  follow_scene();
  std::vector<simulation::ReceiverGroup::Due> due;
  for (const std::size_t r : run_->order()) {
    const std::optional<simulation::Pose> fixed = run_->fixed_pose(r, now);
    if (r != 0 && !fixed && !antennas.base)
      throw InputError("the base has no position", "give it fixed: {east_m: ..., ...}");
    due.push_back({r, now, r == 0 ? antennas.receiver : fixed ? fixed : antennas.base});
    if (due.back().antenna) due.back().antenna->time = now;
    due.back().inputs.continuous = std::holds_alternative<Antennas>(motion);
    if (r != 0) continue;
    if (rtcm_) due.back().corrections = rtcm_->take(now);
    if (sensors_) due.back().inputs.sensors = &sensors_->until(now);
  }
  steps_ = run_->make(due, false);
  if (rtcm_) rtcm_->set_position(steps_.back().epoch.truth_ecef);
  if (!scans_) return;
  report_.scan_max_range_m = ranges_ ? reach_m_ : std::numeric_limits<double>::infinity();
  report_.scan_ranges_m = ranges_ ? ranges_() : scan(steps_.back().arrival);
}

void HostedReceiver::follow_scene() {
  if (!scene_) return;
  scene_->show(vehicle_model_);
  if (!has_scene_ || scene_->generation() != generation_) {
    for (std::size_t r = 0; r < run_->size(); ++r) (*run_)[r].set_scene(scene_->scene());
    generation_ = scene_->generation();
    has_scene_ = true;
  }
  for (const std::string& line : scene_->take_notes()) log(Severity::Warning, line);
}

// Direct and mirror ray of each satellite through the engine's scene.
std::vector<double> HostedReceiver::scan(const propagation::Arrival& arrival) const {
  std::vector<double> ranges;
  if (!scene_) return ranges;
  const Eigen::Vector3d& antenna_enu = arrival.antenna_enu;
  const raytrace::RayScene& scene = scene_->scene()->scene;
  const double min_range = scene.surface_offset_m(antenna_enu);
  const Eigen::Matrix3d enu_from_ecef = frame_.enu.ecef_from_local_rotation().transpose();
  const auto range = [&](const Eigen::Vector3d& direction, double reach_m) {
    const auto hit = scene.cast({antenna_enu, direction, reach_m}, min_range);
    return hit ? hit->range_m : std::numeric_limits<double>::infinity();
  };
  ranges.reserve(2 * arrival.views.size());
  for (const propagation::SatelliteView& view : arrival.views) {
    const Eigen::Vector3d direction = enu_from_ecef * view.line.direction_ecef;
    ranges.push_back(range(direction, std::numeric_limits<double>::infinity()));
    ranges.push_back(
        range(propagation::mirror_direction(direction), options_.live.receiver().propagation.max_range_m));
  }
  return ranges;
}

void visit_word(options::Visitor& v, const options::Field& field, std::string& value) {
  v.text(field, value);
  if (v.reads() && split_blanks(value).size() > 1)
    throw v.fault(field.name, fmt::format("'{}' contains blanks", value), "write one word");
}

void visit_host(options::Visitor& v, HostOptions& o, std::string& frame_id,
                const std::function<void()>& pose_context) {
  visit_word(
      v,
      {"frame_id", "", "the antenna's frame in all ROS messages", frame_id.empty() ? "the link's name" : ""},
      frame_id);
  visit_streams(
      v,
      {"streams", "",
       "FORMAT=ADDRESS, one or several, as for canyon simulate --stream: nmea=tcp://127.0.0.1:10110; "
       "in a ROS 2 node rtcm=topic:NAME publishes rtcm_msgs/Message"},
      o.streams);
  v.section("pose", [&] {
    if (pose_context) pose_context();
    v.number({"timeout_s", "s",
              "of the host's time since the last external pose; without truth there is no epoch"},
             o.pose_timeout_s, {1e-3, 1e6});
  });
}

void HostBases::add(HostedReceiver& receiver, std::uint64_t vehicle) {
  auto position = std::find_if(members_.begin(), members_.end(),
                               [](const Member& member) { return member.receiver == nullptr; });
  if (position == members_.end()) position = members_.emplace(position);
  *position = {&receiver, vehicle};
}

void HostBases::remove(const HostedReceiver& receiver) {
  for (std::size_t m = 0; m < members_.size(); ++m) {
    if (members_[m].receiver != &receiver) continue;
    members_[m] = {};
    links_.disconnect(m);
    for (std::size_t rover = 0; rover < members_.size(); ++rover)
      if (links_.base_of(rover) == m) links_.disconnect(rover);
  }
}

void HostBases::finish(const std::vector<HostedReceiver*>& started_receivers) {
  std::vector<std::size_t> numbers;
  for (std::size_t m = 0; m < members_.size(); ++m) {
    Member& member = members_[m];
    if (member.receiver == nullptr) continue;
    if (member.receiver->epoch_start_ns() < member.last_ns) links_.disconnect(m);  // the world was reset
    member.last_ns = member.receiver->epoch_start_ns();
    find_base(m);
    if (std::find(started_receivers.begin(), started_receivers.end(), member.receiver) !=
        started_receivers.end())
      numbers.push_back(m);
  }
  for (HostedReceiver* const each : started_receivers) {
    const auto is_each = [each](const Member& member) { return member.receiver == each; };
    if (std::none_of(members_.begin(), members_.end(), is_each)) each->finish();
  }
  std::vector<simulation::DueEpoch> due;
  for (const std::size_t m : links_.order(std::move(numbers))) {
    const HostedReceiver& receiver = *members_[m].receiver;
    due.push_back({m, receiver.receiver().start() + std::chrono::nanoseconds(receiver.epoch_start_ns())});
  }
  links_.make_epochs(due, false, [&](std::size_t i, auto came) -> const simulation::Epoch* {
    HostedReceiver& receiver = *members_[due[i].receiver].receiver;
    if (came) receiver.receiver().set_corrections(std::move(came));
    receiver.finish();
    return receiver.step() != nullptr ? &receiver.step()->epoch : nullptr;
  });
}

void HostBases::find_base(std::size_t number) {
  const Member& member = members_[number];
  HostedReceiver& rover = *member.receiver;
  const std::string from = rover.base_receiver_name();
  if (from.empty() || links_.base_of(number)) return;
  std::optional<std::size_t> base;
  std::vector<std::string> names;
  for (std::size_t m = 0; m < members_.size(); ++m) {
    if (members_[m].receiver == nullptr) continue;
    names.push_back(members_[m].receiver->receiver().config().receiver().options.name);
    if (!base && m != number && names.back() == from) base = m;
  }
  if (!base) {
    return rover.log(Severity::Warning,
                     fmt::format("it uses corrections of receiver '{}', which is not in this world yet; "
                                 "receivers: {}; give one <name>{}</name>",
                                 from, fmt::join(names, ", "), from));
  }
  const HostedReceiver& station = *members_[*base].receiver;
  const simulation::RunnerConfig& own = rover.receiver().config();
  const simulation::RunnerConfig& others = station.receiver().config();
  if (own.seed != others.seed || rover.receiver().start() != station.receiver().start()) {
    rover.log(Severity::Warning,
              fmt::format("its base '{}' has another seed or start: errors of the sky do not cancel; give "
                          "both the same <seed> and <start>",
                          from));
  }
  const bool is_external = members_[*base].vehicle != member.vehicle;
  std::vector<simulation::ReceiverConfig> both{own.receiver(), others.receiver()};
  both[1].options.corrections = {};
  if (is_external) both[1].fixed.emplace();
  try {
    simulation::check_corrections(both, 0);
    links_.connect(number, *base, both[1].fixed.has_value(), both[0].options, own.seed);
  } catch (const InputError& e) {
    rover.log(Severity::Error, e.what());
  }
}

}  // namespace canyon::live
