#include "adapters/ros2/host_publisher.hpp"

#include <atomic>
#include <chrono>
#include <mutex>
#include <rclcpp/rclcpp.hpp>
#include <set>
#include <thread>
#include <utility>

#include "adapters/ros2/receiver_topics.hpp"

namespace canyon::adapters::ros2 {
namespace {

/// ROS 2 in this process, for all receivers: a thread for the nodes, and the names of topics in use.
class Process {
 public:
  static std::shared_ptr<Process> get() {
    static std::mutex mutex;
    static std::weak_ptr<Process> one;
    const std::lock_guard lock(mutex);
    std::shared_ptr<Process> process = one.lock();
    if (!process) one = process = std::make_shared<Process>();
    return process;
  }
  Process() {
    // Signals are the simulator's.
    if (!rclcpp::ok()) rclcpp::init(0, nullptr, rclcpp::InitOptions(), rclcpp::SignalHandlerOptions::None);
    executor_ = std::make_unique<rclcpp::executors::SingleThreadedExecutor>();
    thread_ = std::thread([this] {
      while (!stop_ && rclcpp::ok()) executor_->spin_once(std::chrono::milliseconds(100));
    });
  }
  ~Process() {
    stop_ = true;
    thread_.join();
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  std::string claim(const std::vector<std::string>& names) {
    const std::lock_guard lock(mutex_);
    for (const std::string& name : names)
      if (claimed_.contains(name)) return name;
    claimed_.insert(names.begin(), names.end());
    return {};
  }
  void release(const std::vector<std::string>& names) {
    const std::lock_guard lock(mutex_);
    for (const std::string& name : names) claimed_.erase(name);
  }
  void add(const rclcpp::Node::SharedPtr& node) { executor_->add_node(node); }
  void remove(const rclcpp::Node::SharedPtr& node) { executor_->remove_node(node, false); }

 private:
  std::mutex mutex_;
  std::set<std::string> claimed_;
  std::unique_ptr<rclcpp::executors::SingleThreadedExecutor> executor_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

class HostPublisher final : public live::EpochPublisher {
 public:
  HostPublisher(const ReceiverIdentity& identity, const RosSettings& settings,
                live::FaultRequestHandler faults)
      : process_(Process::get()),
        names_(claimed_ros_topics(
            identity, settings,
            [this](const std::vector<std::string>& names) { return process_->claim(names); }, notes_)),
        frame_id_(ros_frame_id(identity, settings)) {
    try {
      node_ = std::make_shared<rclcpp::Node>(ros_name_part(identity.plugin),
                                             names_.base.empty() ? "/" : names_.base);
      TopicNames names;  // names not set here are in the node's namespace
      names.fix = names_.fix;
      names.fix_velocity = names_.fix_velocity;
      names.gnss_multipath = names_.gnss_multipath;
      names.satellites = names_.satellites;
      names.raw_observations = names_.raw_observations;
      names.scan = names_.scan;
      topics_ = std::make_unique<ReceiverTopics>(NodeParts(*node_), names);
      services_ = std::make_unique<FaultServices>(*node_, std::move(faults));
      process_->add(node_);
    } catch (...) {
      process_->release(names_.claimed());
      throw;
    }
    health_.name = node_->get_fully_qualified_name();
    health_.receiver = identity.sensor.empty() ? identity.plugin : identity.sensor;
  }
  ~HostPublisher() override {
    process_->remove(node_);
    process_->release(names_.claimed());
  }
  HostPublisher(const HostPublisher&) = delete;
  HostPublisher& operator=(const HostPublisher&) = delete;

  void publish(const live::ReceiverReport& report) override {
    health_.reason = report.reason;
    topics_->publish(report, frame_id_, health_);
  }
  void reset() override { topics_->reset(); }
  std::vector<std::string> take_notes() override { return std::exchange(notes_, {}); }

 private:
  std::vector<std::string> notes_;
  std::shared_ptr<Process> process_;
  RosTopics names_;
  std::string frame_id_;
  rclcpp::Node::SharedPtr node_;
  std::unique_ptr<ReceiverTopics> topics_;
  std::unique_ptr<FaultServices> services_;
  ros_messages::ReceiverHealth health_;
};

}  // namespace

std::unique_ptr<live::EpochPublisher> make_host_publisher(const ReceiverIdentity& identity,
                                                          const RosSettings& settings,
                                                          live::FaultRequestHandler faults) {
  return std::make_unique<HostPublisher>(identity, settings, std::move(faults));
}

}  // namespace canyon::adapters::ros2
