#include "canyon/outputs/live/hosted_receiver.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <iterator>
#include <limits>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/input_files.hpp"
#include "canyon/base/text.hpp"
#include "canyon/outputs/output/encoder.hpp"
#include "canyon/outputs/output/stream.hpp"
#include "canyon/receiver/relative/correction_link.hpp"
#include "canyon/run/environment.hpp"

namespace canyon::live {
namespace {

using simulation::TruePose;

std::shared_ptr<simulation::CityScene> open_field(const WorldFrame& frame) {
  city::City city;
  city.name = "open field";
  city.frame = frame.enu;
  return std::make_shared<simulation::CityScene>(std::move(city));
}

/// A reader throws its fault for a format that is not known.
void visit_streams(options::Visitor& v, const options::Field& field, std::vector<std::string>& streams) {
  v.texts(field, streams);
  if (!v.reads()) return;
  try {
    for (const std::string& text : streams) (void)output::format_named(output::parse_stream(text).format);
  } catch (const InputError& e) {
    throw v.fault(field.name, e.problem(), e.cure());
  }
}

// Places of a rover and its base in the links of the two.
constexpr std::size_t kRover = 0, kBase = 1;

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
      say_(std::move(setup.say)),
      sky_warnings_(setup.sky_warnings ? std::move(setup.sky_warnings) : std::make_shared<SkyWarnings>()) {
  InputFiles::begin_run();
  for (const std::string& line : setup.warnings) say(Tone::Warning, line);
  try {
    start_receiver();
    const auto descriptions = output::describe_receivers(*receiver_, schedule_.interval_s());
    for (const auto& [setting, stream] : setup.streams) {
      add(make_stream_publisher(setting, stream_of_model(setting, stream, setup.model), descriptions,
                                setup.open_link, &*receiver_),
          setting);
    }
  } catch (const InputError& e) {  // name the receiver
    if (name().empty()) throw;
    throw InputError(fmt::format("{}: {}", name(), e.what()));
  }
}

HostedReceiver::~HostedReceiver() = default;

void HostedReceiver::start_receiver() {
  auto& fixed = options_.live.receiver().fixed;
  if (fixed) fixed->settle(frame_.enu);
  receiver_.emplace(options_.live, city_ ? city_ : open_field(frame_), start_);
  if (tracer_) receiver_->set_tracer(tracer_);
  say_warnings();
  make_rtcm();
  begin_sensors();
}

void HostedReceiver::begin_sensors() {
  sensors_.reset();
  if (make_sensors_) sensors_.emplace(make_sensors_());
}

void HostedReceiver::say_warnings() {
  sky_warnings_->take(*receiver_,
                      [this](const std::string& line, bool of_sky) { say(Tone::Warning, line, of_sky); });
}

void HostedReceiver::say(Tone tone, const std::string& line, bool of_all) {
  if (!said_.insert(line).second) return;
  say_(tone, hide_passwords(of_all || name_.empty() ? line : fmt::format("{}: {}", name_, line)));
}

void HostedReceiver::add(std::unique_ptr<EpochPublisher> publisher, std::string failure) {
  if (publisher) publishers_.emplace_back(std::move(publisher), std::move(failure));
}

void HostedReceiver::publish(const std::function<void(EpochPublisher&)>& work) {
  for (auto& [publisher, failure] : publishers_) {
    if (!publisher) continue;
    try {
      work(*publisher);
      for (const std::string& note : publisher->take_notes()) say(Tone::Warning, note);
    } catch (const std::exception& e) {
      if (failure.empty()) throw;
      say(Tone::Warning, fmt::format("{}: {}", failure, e.what()));
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
  if (relative::is_stream(options.corrections.from)) rtcm_.emplace(options, options_.live.seed);
}

std::string HostedReceiver::base_elsewhere() const {
  const simulation::LiveConfig& config = options_.live;
  return config.base() == nullptr ? config.receiver().options.corrections.from : "";
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

void HostedReceiver::set_config(simulation::LiveConfig config) {
  if (auto& fixed = config.receiver().fixed) fixed->settle(frame_.enu);
  receiver_->set_config(std::move(config));
  options_.live = receiver_->config();
  make_rtcm();
}

AdjustableReceiver HostedReceiver::adjustable(const std::string& name) {
  return {name, &*receiver_, [this] {
            options_.live = receiver_->config();
            schedule_.set_interval(1 / rate_hz());
          }};
}

geodesy::GpsTime HostedReceiver::time_of(std::int64_t now_ns) const {
  return start_ + static_cast<double>(now_ns) * 1e-9;
}

void HostedReceiver::take_rtcm(std::string_view bytes, std::int64_t now_ns) {
  if (rtcm_) rtcm_->receive(bytes, time_of(now_ns));
}

void HostedReceiver::reset() {
  begin_anew();
  schedule_.go_to(0);
}

void HostedReceiver::begin_anew() {
  receiver_->restart();
  begin_sensors();
  if (rtcm_) rtcm_->begin_anew();
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
  if (std::exchange(went_back_, false)) begin_anew();
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
    say(Tone::Error, report_.reason);
  }
}

void HostedReceiver::finish() {
  step_.reset();
  const auto begin = std::chrono::steady_clock::now();
  try {
    if (motion_) compute(*motion_);
  } catch (const std::exception& e) {
    report_.reason = e.what();
    say(Tone::Error, report_.reason);
  }
  report_.compute_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  report_.step = step_ ? &*step_ : nullptr;
  if (step_) {
    say_warnings();
  } else {
    report_.scan_ranges_m.clear();
  }
  if (rtcm_) {
    for (const std::string& line : rtcm_->take_warnings()) say(Tone::Warning, line);
  }
  publish([this](EpochPublisher& publisher) { publisher.publish(report_); });
}

void HostedReceiver::compute(const Motion& motion) {
  Antennas antennas;
  if (const auto* body = std::get_if<TruePose>(&motion)) {
    const auto antenna_of = [&](const simulation::ReceiverConfig& receiver) {
      return simulation::antenna_of(*body, receiver.lever_arm_m, frame_.heading_rad, frame_.origin_enu_m);
    };
    const simulation::ReceiverConfig& own = options_.live.receiver();
    report_.antenna_world_m = body->pose.position_m + body->pose.attitude * own.lever_arm_m;
    report_.link_attitude_world = body->pose.attitude;
    antennas.receiver = antenna_of(own);
    if (const simulation::ReceiverConfig* base = options_.live.base()) antennas.base = antenna_of(*base);
  } else {
    antennas = std::get<Antennas>(motion);
  }
  follow_scene();
  const double seconds = static_cast<double>(report_.sim_time_ns) * 1e-9;
  if (rtcm_) {
    if (auto came = rtcm_->take(time_of(report_.sim_time_ns))) receiver_->give(std::move(came));
  }
  const simulation::SensorBatch* samples =
      sensors_ ? &sensors_->until(time_of(report_.sim_time_ns)) : nullptr;
  step_ = receiver_->observe(seconds, antennas.receiver, samples, antennas.base ? &*antennas.base : nullptr);
  if (rtcm_) rtcm_->set_place(step_->epoch.truth_ecef);
  if (!scans_) return;
  report_.scan_max_range_m = ranges_ ? reach_m_ : std::numeric_limits<double>::infinity();
  report_.scan_ranges_m = ranges_ ? ranges_() : scan(antennas.receiver.position_enu_m);
}

void HostedReceiver::follow_scene() {
  if (!scene_) return;
  scene_->show(own_model_);
  if (!has_scene_ || scene_->generation() != generation_) {
    receiver_->set_scene(scene_->scene());
    generation_ = scene_->generation();
    has_scene_ = true;
  }
  for (const std::string& line : scene_->take_notes()) say(Tone::Warning, line);
}

// Direct and mirror ray of each satellite through the engine's scene.
std::vector<double> HostedReceiver::scan(const Eigen::Vector3d& antenna_enu) const {
  std::vector<double> ranges;
  if (!scene_) return ranges;
  const raytrace::RayScene& scene = scene_->scene()->scene;
  const double min_range = scene.surface_offset_m(antenna_enu);
  const Eigen::Matrix3d enu_from_ecef = frame_.enu.ecef_from_local_rotation().transpose();
  const auto range = [&](const Eigen::Vector3d& direction, double reach_m) {
    const auto hit = scene.cast({antenna_enu, direction, reach_m}, min_range);
    return hit ? hit->range_m : std::numeric_limits<double>::infinity();
  };
  ranges.reserve(2 * step_->arrival.views.size());
  for (const propagation::SatelliteView& view : step_->arrival.views) {
    const Eigen::Vector3d direction = enu_from_ecef * view.line.direction_ecef;
    ranges.push_back(range(direction, std::numeric_limits<double>::infinity()));
    ranges.push_back(
        range(propagation::mirror_direction(direction), options_.live.receiver().propagation.max_range_m));
  }
  return ranges;
}

void visit_word(options::Visitor& v, const options::Field& field, std::string& value) {
  v.text(field, value);
  if (v.reads() && split_blanks(value).size() > 1) {
    throw v.fault(field.name, fmt::format("'{}' has blanks in it", value), "write one word");
  }
}

void visit_host(options::Visitor& v, HostOptions& o, std::string& frame_id,
                const std::function<void()>& of_pose) {
  visit_word(v,
             {"frame_id", "", "of all messages of ROS: the antenna's frame",
              frame_id.empty() ? "the link's name" : ""},
             frame_id);
  visit_streams(
      v,
      {"streams", "",
       "FORMAT=ADDRESS, one or several, as of canyon simulate --stream: nmea=tcp://127.0.0.1:10110; "
       "of a node of ROS 2 rtcm=topic:NAME publishes rtcm_msgs/Message"},
      o.streams);
  v.section("pose", [&] {
    if (of_pose) of_pose();
    v.number({"timeout_s", "s",
              "of the host's time since the last pose from outside came; without truth there is no epoch"},
             o.pose_timeout_s, {1e-3, 1e6});
  });
}

void HostBases::add(HostedReceiver& receiver, std::uint64_t vehicle) {
  members_.push_back({&receiver, vehicle, nullptr, {}, 0});
}

void HostBases::remove(const HostedReceiver& receiver) {
  std::erase_if(members_, [&](const Member& member) { return member.receiver == &receiver; });
  for (Member& member : members_) {
    if (member.base != &receiver) continue;
    member.base = nullptr;
    member.links.reset();
  }
}

HostBases::Member* HostBases::member_of(const HostedReceiver* receiver) {
  const auto at = std::find_if(members_.begin(), members_.end(),
                               [&](const Member& member) { return member.receiver == receiver; });
  return at == members_.end() ? nullptr : &*at;
}

void HostBases::finish(std::vector<HostedReceiver*> begun) {
  for (Member& member : members_) {
    if (member.receiver->begun_ns() < member.last_ns) {  // the world was reset
      member.base = nullptr;
      member.links.reset();
    }
    member.last_ns = member.receiver->begun_ns();
    find_base(member);
  }
  while (!begun.empty()) {
    auto next = std::find_if(begun.begin(), begun.end(), [&](const HostedReceiver* receiver) {
      const Member* member = member_of(receiver);
      return member == nullptr || std::find(begun.begin(), begun.end(), member->base) == begun.end();
    });
    if (next == begun.end()) next = begun.begin();  // they are each other's bases
    finish_one(**next);
    begun.erase(next);
  }
}

void HostBases::find_base(Member& member) {
  HostedReceiver& rover = *member.receiver;
  const std::string from = rover.base_elsewhere();
  if (from.empty() || member.base != nullptr) return;
  const Member* base = nullptr;
  std::vector<std::string> names;
  for (const Member& other : members_) {
    names.push_back(other.receiver->receiver().config().receiver().options.name);
    if (base == nullptr && other.receiver != &rover && names.back() == from) base = &other;
  }
  if (base == nullptr) {
    return rover.say(Tone::Warning,
                     fmt::format("there is no receiver '{}' in this world yet, whose corrections it takes; "
                                 "receivers: {}; give one <name>{}</name>",
                                 from, fmt::join(names, ", "), from));
  }
  const simulation::LiveConfig& own = rover.receiver().config();
  const simulation::LiveConfig& others = base->receiver->receiver().config();
  if (own.seed != others.seed || rover.receiver().start() != base->receiver->receiver().start()) {
    rover.say(Tone::Warning,
              fmt::format("its base '{}' has another seed or start: errors of the sky do not cancel; give "
                          "both the same <seed> and <start>",
                          from));
  }
  std::vector<simulation::ReceiverConfig> receivers{own.receiver(), others.receiver()};
  receivers[kBase].options.corrections = {};
  if (base->vehicle != member.vehicle) receivers[kBase].fixed.emplace();
  try {
    member.links.emplace(receivers, own.seed);
    member.base = base->receiver;
  } catch (const InputError& e) {
    rover.say(Tone::Error, e.what());
  }
}

void HostBases::finish_one(HostedReceiver& receiver) {
  Member* member = member_of(&receiver);
  if (member == nullptr) return receiver.finish();
  if (member->links) {
    const geodesy::GpsTime now = receiver.receiver().start() + std::chrono::nanoseconds(receiver.begun_ns());
    if (auto came = member->links->take(kRover, now)) receiver.receiver().give(std::move(came));
  }
  receiver.finish();
  const simulation::LiveReceiver::Step* step = receiver.step();
  if (step == nullptr) return;
  const auto send = [step](simulation::CorrectionLinks& links, std::size_t as) {
    simulation::Epoch epoch = step->epoch;
    epoch.receiver = as;
    links.send(epoch);
  };
  if (member->links) send(*member->links, kRover);
  for (Member& other : members_) {
    if (other.base == &receiver && other.links) send(*other.links, kBase);
  }
}

}  // namespace canyon::live
