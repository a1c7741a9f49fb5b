#include "adapters/ros2/receiver_node.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <geometry_msgs/msg/pose_stamped.hpp>
#include <lifecycle_msgs/msg/state.hpp>
#include <nav_msgs/msg/odometry.hpp>
#include <rclcpp/create_timer.hpp>
#include <rclcpp_components/register_node_macro.hpp>
#include <set>
#include <utility>
#ifdef CANYON_WITH_TF2
#include <tf2_ros/buffer.h>
#include <tf2_ros/transform_listener.h>
#endif

#include "adapters/ros2/node_parameters.hpp"
#include "adapters/ros2/node_truth.hpp"
#include "adapters/ros2/receiver_topics.hpp"
#include "adapters/ros2/rtcm_messages.hpp"
#include "adapters/ros2/rtcm_topic.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/input_files.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/epoch_schedule.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::adapters::ros2 {
namespace {

using lifecycle_msgs::msg::State;

constexpr double kDefaultRate_hz = 10;
// Time resolution: the maximum delay of epochs.
constexpr std::int64_t kTick_ns = 10'000'000;

/// Throws InputError for settings that this build does not support.
void check_build(const NodeSettings& settings) {
#ifndef CANYON_WITH_TF2
  if (settings.pose_source == PoseSource::Tf)
    throw InputError("parameter 'pose.source': this build has no tf2",
                     "build it in an environment with tf2_ros");
#endif
  if (!settings.corrections_topic().empty()) require_rtcm_msgs("parameter 'corrections.from'");
  for (const std::string& stream : settings.streams)
    if (topic_of_stream(stream)) require_rtcm_msgs("parameter 'streams'");
}

class TopicsPublisher final : public live::EpochPublisher {
 public:
  explicit TopicsPublisher(std::function<void(const live::ReceiverReport&)> publish)
      : publish_(std::move(publish)) {}
  void publish(const live::ReceiverReport& report) override { publish_(report); }

 private:
  std::function<void(const live::ReceiverReport&)> publish_;
};

/// Sensors of the scenario's own drive and the clock, in addition to the topics of every receiver.
TopicNames topics_of(const NodeSettings& settings) {
  TopicNames names;
  const inertial::SensorOptions& sensors = settings.live.sensors;
  const bool drives = !settings.is_pose_driven() && !settings.live.receiver().fixed;
  if (drives && sensors.imu) names.imu = "imu";
  if (drives && sensors.wheels) names.wheels = "wheels";
  if (drives && sensors.magnetometer) names.magnetic_field = "magnetic_field";
  if (drives && sensors.barometer) names.air_pressure = "air_pressure";
  if (settings.drive_clock) names.clock = "/clock";
  return names;
}

}  // namespace

struct ReceiverNode::Impl {
  explicit Impl(ReceiverNode& n)
      : node(n),
        parameters(n, {[this] { return configured(); }, [this](const NodeSettings& s) { change(s); }}) {}

  [[nodiscard]] bool configured() const {
    return node.get_current_state().id() != State::PRIMARY_STATE_UNCONFIGURED;
  }
  void change(const NodeSettings& changed) {
    check_build(changed);
    if (simulation) simulation = std::make_shared<simulation::Simulation>(simulated_world(changed), scene);
    if (hosted) {
      hosted->set_config(driven_config(changed, node.get_fully_qualified_name(), simulation.get()));
      if (simulation) truth.emplace(changed, scene->city, simulation);
    }
    const bool is_external = changed.corrections_topic() != settings.corrections_topic();
    settings = changed;
    if (!timer || !is_external) return;
    // A subscription declares parameters, which is not allowed while others are being set.
    corrections.reset();
    listener_starter = node.create_wall_timer(std::chrono::seconds(0), [this] {
      listener_starter.reset();
      guarded([this] { listen_to_corrections(); });
    });
  }

  void configure() {
    settings = parameters.settings();
    check_build(settings);
    ReadReport report;
    report.add_line(ReadReport::Level::Guess, settings.live.warnings);
    scene = std::make_shared<simulation::CityScene>(simulation::load_city(settings.live));
    interval_s = 1 / settings.live.rate_hz.value_or(kDefaultRate_hz);
    if (!settings.is_pose_driven()) {
      simulation = std::make_shared<simulation::Simulation>(simulated_world(settings), scene);
      report.append(simulation->report());
      interval_s = simulation->interval_s();
    }
    topics =
        std::make_unique<ReceiverTopics>(NodeParts(node), topics_of(settings), settings.diagonal_covariance);
    const bool changes = settings.live.live && settings.live.live->changes;
    services = std::make_unique<FaultServices>(
        node, live::FaultRequestHandler{
                  [this](const live::OptionsRequest& request) { return answer_faults(request); }, changes,
                  "set the parameter live.changes before the node is configured"});
    health = {};
    health.name = node.get_name();
    health.receiver = settings.live.receivers.front().options.name;
    parameters.show(settings);
    report.append(scene->city.notes);
    for (const std::string& line : report.warnings()) warn(line);
    RCLCPP_INFO(node.get_logger(), "city '%s' with %zu triangles, %g epochs per second",
                scene->city.name.c_str(), scene->city.mesh.triangles.size(), 1 / interval_s);
  }

  void activate() {
    zero_ns.reset();
    elapsed_ns = -1;
    health.finished = false;
    tick_ns = std::min(simulation::EpochSchedule(interval_s).interval_ns(), kTick_ns);
    if (simulation)
      begin_receiver(simulation->begin());
    else
      listen();
    listen_to_corrections();
    if (settings.drive_clock) {
      period = std::chrono::nanoseconds(
          std::max<std::int64_t>(1, std::llround(static_cast<double>(tick_ns) / settings.speed)));
      next_tick = std::chrono::steady_clock::now() + period;
      timer = node.create_wall_timer(period, [this] { guarded([this] { tick_clock(); }); });
    } else {
      timer =
          rclcpp::create_timer(&node, node.get_clock(), rclcpp::Duration(std::chrono::nanoseconds(tick_ns)),
                               [this] { guarded([this] { tick(); }); });
    }
  }

  void deactivate() {
    timer.reset();
    listener_starter.reset();
    subscription.reset();
    corrections.reset();
#ifdef CANYON_WITH_TF2
    listener.reset();
    transforms.reset();
#endif
    hosted.reset();  // completes files
    sensors.reset();
    truth.reset();
    if (topics) topics->reset();
  }

  void cleanup() {
    deactivate();
    services.reset();
    topics.reset();
    simulation.reset();
    scene.reset();
    logged.clear();
  }

  void autostart() {
    starter.reset();
    failed = node.configure().id() != State::PRIMARY_STATE_INACTIVE ||
             node.activate().id() != State::PRIMARY_STATE_ACTIVE;
    if (failed) rclcpp::shutdown(node.get_node_base_interface()->get_context(), "autostart failed");
  }

  // An error of the receiver ends the drive: guarded() catches it.
  void begin_receiver(geodesy::GpsTime start) {
    truth.emplace(settings, scene->city, simulation);
    const auto log = [this](live::Severity tone, const std::string& line) {
      if (tone == live::Severity::Error) throw InputError(line);
      warn(line);
    };
    live::HostSetup setup =
        setup_of(settings, scene, start, node.get_fully_qualified_name(), log, simulation);
    for (const std::string& stream : settings.streams)
      setup.streams.emplace_back("parameter 'streams'", stream);
    setup.open_link = [this](const encoding::StreamRequest& request) -> std::shared_ptr<transport::Link> {
      const auto topic = topic_of(request.address);
      if (!topic) return nullptr;
      return open_rtcm_topic(NodeParts(node), *topic, settings.frame_id, [this] { return stamp_ns; });
    };
    if (setup.sensors) sensors.emplace(setup.sensors());
    hosted = std::make_unique<live::HostedReceiver>(std::move(setup));
    hosted->add(std::make_unique<TopicsPublisher>([this](const auto& report) { publish(report); }), "");
  }

  void listen() {
    const auto qos = rclcpp::SensorDataQoS();  // also receives from reliable publishers
    if (settings.pose_source == PoseSource::Pose) {
      using Pose = geometry_msgs::msg::PoseStamped;
      subscription = node.create_subscription<Pose>(
          "pose", qos, [this](const Pose& m) { guarded([&] { on_pose(m.header, m.pose); }); });
    } else if (settings.pose_source == PoseSource::Odometry) {
      using Odometry = nav_msgs::msg::Odometry;
      subscription = node.create_subscription<Odometry>(
          "odom", qos, [this](const Odometry& m) { guarded([&] { on_pose(m.header, m.pose.pose); }); });
    }
#ifdef CANYON_WITH_TF2
    if (settings.pose_source == PoseSource::Tf) {
      transforms = std::make_unique<tf2_ros::Buffer>(node.get_clock());
      listener = std::make_unique<tf2_ros::TransformListener>(*transforms, &node, false);
      last_transform_ns = 0;
    }
#endif
  }

  void listen_to_corrections() {
    corrections.reset();
    const std::string topic = settings.corrections_topic();
    if (topic.empty()) return;
    corrections = subscribe_to_rtcm(
        NodeParts(node), topic, [this](std::string_view bytes) { guarded([&] { on_corrections(bytes); }); });
  }

  void on_corrections(std::string_view bytes) {
    if (!simulation) {
      if (now_ns() == 0) return;  // simulated time has not begun
      begin_poses();
      elapsed_ns = now_ns() - *zero_ns;
    }
    hosted->take_rtcm(bytes, std::max<std::int64_t>(0, elapsed_ns));
  }

  void on_pose(const std_msgs::msg::Header& header, const geometry_msgs::msg::Pose& pose) {
    if (now_ns() == 0) return;  // simulated time has not begun
    begin_poses();
    if (!header.frame_id.empty() && header.frame_id != settings.pose_frame) {
      warn("poses are in the frame '" + header.frame_id + "' but treated as in '" + settings.pose_frame +
           "'; set pose.frame to it, or take them from tf (pose.source)");
    }
    const auto& p = pose.position;
    const auto& q = pose.orientation;
    const std::string complaint = truth->take({{p.x, p.y, p.z}, {q.w, q.x, q.y, q.z}},
                                              rclcpp::Time(header.stamp).seconds(), now_ns() - *zero_ns);
    if (!complaint.empty()) warn(complaint);
  }

  void look_up() {
#ifdef CANYON_WITH_TF2
    if (!transforms) return;
    try {
      const auto found =
          transforms->lookupTransform(settings.pose_frame, settings.child_frame, tf2::TimePointZero);
      const std::int64_t at_ns = rclcpp::Time(found.header.stamp).nanoseconds();
      if (at_ns == last_transform_ns) return;
      last_transform_ns = at_ns;
      geometry_msgs::msg::Pose pose;
      pose.position.x = found.transform.translation.x;
      pose.position.y = found.transform.translation.y;
      pose.position.z = found.transform.translation.z;
      pose.orientation = found.transform.rotation;
      on_pose(found.header, pose);
    } catch (const tf2::TransformException&) {  // not yet; the epoch reports that no pose was received
    }
#endif
  }

  // Simulated time begins at 0, as in Gazebo; the machine's time at the first pose or tick.
  void begin_poses() {
    if (hosted) return;
    const bool simulated = node.get_parameter("use_sim_time").as_bool();
    zero_ns = simulated ? 0 : now_ns();
    const auto machine = std::chrono::system_clock::now().time_since_epoch();
    const auto unix_ns =
        simulated ? std::chrono::duration_cast<std::chrono::nanoseconds>(machine).count() : *zero_ns;
    begin_receiver(geodesy::gps_from_unix(unix_ns));
  }

  // Called by the executor, between two ticks.
  [[nodiscard]] std::string answer_faults(const live::OptionsRequest& request) {
    if (!hosted) return "refused: no receiver runs yet; activate the node";
    return live::handle_request(
        request, {hosted->receiver_handle(hosted->receiver().config().receiver().options.name)});
  }

  // The ticks of the clock driven by this node. Ticks delayed by an epoch follow at once; on a machine slower
  // than the clock they are late.
  void tick_clock() {
    using Clock = std::chrono::steady_clock;
    constexpr auto kLatest = std::chrono::milliseconds(500);
    constexpr int kMax = 100;  // at a time, to serve others too
    const auto now = Clock::now();
    next_tick = std::max(next_tick, now - kLatest);
    for (int i = 0; i < kMax && timer && next_tick <= now; ++i, next_tick += period) {
      zero_ns = 0;
      const std::int64_t epoch_ns = hosted->next_ns();
      const std::int64_t next_ns = elapsed_ns < 0 ? 0 : elapsed_ns + tick_ns;
      elapsed_ns = elapsed_ns < epoch_ns ? std::min(next_ns, epoch_ns) : next_ns;
      topics->publish_clock(elapsed_ns);
      drive();
    }
  }

  void tick() {
    const std::int64_t now = now_ns();
    if (now == 0) return;  // simulated time has not begun
    if (simulation) {
      if (zero_ns && now < *zero_ns) {  // time went back
        hosted->reset();
        if (sensors) sensors.emplace(simulation->sensors());
      }
      if (!zero_ns || now < *zero_ns) zero_ns = now;
      elapsed_ns = now - *zero_ns;
      return drive();
    }
    begin_poses();
    look_up();
    elapsed_ns = now - *zero_ns;
    stamp_ns = now;
    hosted->update(elapsed_ns, [&](std::string& reason) { return truth->at(elapsed_ns, reason); });
  }

  // Due samples of sensors and epochs of a scenario's own drive.
  void drive() {
    if (sensors) {
      const simulation::EpochSchedule schedule(interval_s);
      const std::int64_t end_ns = schedule.at_ns(static_cast<std::int64_t>(simulation->epoch_count()) - 1);
      const auto until = simulation->begin() + std::chrono::nanoseconds(std::min(elapsed_ns, end_ns));
      topics->publish(sensors->until(until), settings.live.sensors, simulation->begin(), *zero_ns,
                      settings.child_frame);
    }
    hosted->follow(elapsed_ns, [&](std::int64_t at_ns, std::string& reason) {
      stamp_ns = *zero_ns + at_ns;
      health.lateness_s = static_cast<double>(elapsed_ns - at_ns) * 1e-9;
      return truth->at(at_ns, reason);
    });
    if (!hosted->over() || elapsed_ns < hosted->next_ns()) return;
    health.finished = true;
    live::ReceiverReport report;
    report.sim_time_ns = elapsed_ns;
    publish(report);
    RCLCPP_INFO(node.get_logger(), "the drive has ended");
    node.deactivate();
  }

  // Stamps are in the node's clock.
  void publish(const live::ReceiverReport& report) {
    live::ReceiverReport stamped = report;
    stamped.sim_time_ns = *zero_ns + report.sim_time_ns;
    health.reason = report.reason;
    health.compute_s = report.compute_s;
    topics->publish(stamped, settings.frame_id, health);
  }

  [[nodiscard]] std::int64_t now_ns() const {
    return node.get_clock()->now().nanoseconds();
  }
  void warn(const std::string& message) {
    if (logged.insert(message).second) RCLCPP_WARN(node.get_logger(), "%s", hide_passwords(message).c_str());
  }
  /// An error in a callback ends the drive, not the container.
  template <class Work>
  void guarded(const Work& work) {
    try {
      work();
    } catch (const std::exception& e) {
      RCLCPP_ERROR(node.get_logger(), "%s", e.what());
      node.deactivate();
    }
  }

  ReceiverNode& node;
  NodeParameters parameters;
  NodeSettings settings;
  std::shared_ptr<simulation::CityScene> scene;
  std::shared_ptr<const simulation::Simulation> simulation;  // of a scenario's own drive
  std::unique_ptr<ReceiverTopics> topics;
  std::unique_ptr<FaultServices> services;
  std::optional<NodeTruth> truth;
  std::unique_ptr<live::HostedReceiver> hosted;
  std::optional<simulation::SensorRun> sensors;  // of a scenario's own drive, for the topics
  double interval_s = 1 / kDefaultRate_hz;
  rclcpp::SubscriptionBase::SharedPtr subscription, corrections;
#ifdef CANYON_WITH_TF2
  std::unique_ptr<tf2_ros::Buffer> transforms;
  std::unique_ptr<tf2_ros::TransformListener> listener;
  std::int64_t last_transform_ns = 0;
#endif
  rclcpp::TimerBase::SharedPtr timer, starter, listener_starter;
  std::optional<std::int64_t> zero_ns;  // of the node's clock, when the drive began
  std::int64_t elapsed_ns = 0;          // since then
  std::int64_t tick_ns = kTick_ns;
  std::chrono::nanoseconds period{};                // of the ticks of the driven clock, in real time
  std::chrono::steady_clock::time_point next_tick;  // of the driven clock
  std::int64_t stamp_ns = 0;                        // of the last epoch, on the node's clock
  ros_messages::ReceiverHealth health;
  std::set<std::string> logged;
  bool failed = false;
};

ReceiverNode::ReceiverNode(const rclcpp::NodeOptions& options)
    : LifecycleNode("receiver", options), impl_(std::make_unique<Impl>(*this)) {
  InputFiles::begin_run();
  if (!impl_->parameters.autostart()) return;
  impl_->starter = create_wall_timer(std::chrono::seconds(0), [this] { impl_->autostart(); });
}
ReceiverNode::~ReceiverNode() = default;

bool ReceiverNode::failed() const {
  return impl_->failed;
}

ReceiverNode::CallbackReturn ReceiverNode::on_configure(const rclcpp_lifecycle::State&) {
  try {
    impl_->configure();
    return CallbackReturn::SUCCESS;
  } catch (const std::exception& e) {
    RCLCPP_ERROR(get_logger(), "%s", e.what());
    impl_->cleanup();
    return CallbackReturn::FAILURE;
  }
}

ReceiverNode::CallbackReturn ReceiverNode::on_activate(const rclcpp_lifecycle::State& state) {
  try {
    LifecycleNode::on_activate(state);
    impl_->activate();
    return CallbackReturn::SUCCESS;
  } catch (const std::exception& e) {
    RCLCPP_ERROR(get_logger(), "%s", e.what());
    impl_->deactivate();
    LifecycleNode::on_deactivate(state);
    return CallbackReturn::FAILURE;
  }
}

ReceiverNode::CallbackReturn ReceiverNode::on_deactivate(const rclcpp_lifecycle::State& state) {
  impl_->deactivate();
  return LifecycleNode::on_deactivate(state);
}

ReceiverNode::CallbackReturn ReceiverNode::on_cleanup(const rclcpp_lifecycle::State&) {
  impl_->cleanup();
  return CallbackReturn::SUCCESS;
}

ReceiverNode::CallbackReturn ReceiverNode::on_shutdown(const rclcpp_lifecycle::State&) {
  impl_->cleanup();
  return CallbackReturn::SUCCESS;
}

ReceiverNode::CallbackReturn ReceiverNode::on_error(const rclcpp_lifecycle::State&) {
  impl_->cleanup();
  return CallbackReturn::SUCCESS;
}

}  // namespace canyon::adapters::ros2

RCLCPP_COMPONENTS_REGISTER_NODE(canyon::adapters::ros2::ReceiverNode)
