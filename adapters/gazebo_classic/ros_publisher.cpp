#include <ros/publisher.h>

#include <exception>
#include <gazebo/common/Console.hh>
#include <mutex>
#include <optional>
#include <utility>

#include "adapters/common/ros_names.hpp"
#include "adapters/gazebo_classic/publishers.hpp"
#include "adapters/gazebo_classic/ros_link.hpp"
#include "adapters/gazebo_classic/ros_services.hpp"
#include "adapters/ros/raw_conversions.hpp"
#include "adapters/ros/ros1_types.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

namespace ros1 = ros_messages::ros1;

constexpr std::uint32_t kQueue = 10;  // a second of a 10 Hz receiver, for a slow subscriber

/// The topics of one receiver. The link's thread makes and ends them, the simulation's publishes.
class ReceiverTopics final : public RosClient {
 public:
  ReceiverTopics(RosTopics names, std::string frame_id)
      : names_(std::move(names)), frame_id_(std::move(frame_id)) {}

  bool connect(ros::NodeHandle& node) override {
    Publishers made;
    made.fix = node.advertise<ros1::NavSatFix>(names_.fix, kQueue);
    made.fix_velocity = node.advertise<ros1::TwistWithCovarianceStamped>(names_.fix_velocity, kQueue);
    made.gnss_multipath = node.advertise<ros1::GnssMultipath>(names_.gnss_multipath, kQueue);
    made.satellites = node.advertise<ros1::GnssSatellites>(names_.satellites, kQueue);
    made.raw_observations = node.advertise<ros1::GnssRawObservations>(names_.raw_observations, kQueue);
    if (!names_.scan.empty()) made.scan = node.advertise<ros1::LaserScan>(names_.scan, kQueue);
    if (!made.fix || !made.fix_velocity || !made.gnss_multipath || !made.satellites ||
        !made.raw_observations || (!names_.scan.empty() && !made.scan))
      return false;  // the master was lost; topics end with `made`
    const std::lock_guard lock(mutex_);
    publishers_ = std::move(made);
    return true;
  }

  [[nodiscard]] std::vector<std::pair<std::string, std::string>> advertised() const override {
    namespace traits = ros::message_traits;
    // Their names in ROS, possibly remapped on gzserver's command line.
    const std::lock_guard lock(mutex_);
    if (!publishers_) return {};
    std::vector<std::pair<std::string, std::string>> topics{
        {publishers_->fix.getTopic(), traits::DataType<ros1::NavSatFix>::value()},
        {publishers_->fix_velocity.getTopic(), traits::DataType<ros1::TwistWithCovarianceStamped>::value()},
        {publishers_->gnss_multipath.getTopic(), traits::DataType<ros1::GnssMultipath>::value()},
        {publishers_->satellites.getTopic(), traits::DataType<ros1::GnssSatellites>::value()},
        {publishers_->raw_observations.getTopic(), traits::DataType<ros1::GnssRawObservations>::value()}};
    if (publishers_->scan)
      topics.emplace_back(publishers_->scan.getTopic(), traits::DataType<ros1::LaserScan>::value());
    return topics;
  }

  void disconnect() override {
    std::optional<Publishers> ended;  // unadvertised outside of the lock: that may wait for the master
    const std::lock_guard lock(mutex_);
    ended.swap(publishers_);
  }

  void publish(const live::ReceiverReport& report) {
    constexpr std::int64_t kSecond_ns = 1'000'000'000;
    const ros_messages::Head head{{static_cast<std::int32_t>(report.sim_time_ns / kSecond_ns),
                                   static_cast<std::uint32_t>(report.sim_time_ns % kSecond_ns)},
                                  frame_id_};
    const simulation::Epoch* epoch = report.step != nullptr ? &report.step->epoch : nullptr;
    // Phases are tracked even without subscribers; other messages are not made without subscribers.
    const auto raw = raw_.message<ros1::GnssRawObservations>(head, epoch);
    const std::lock_guard lock(mutex_);
    if (!publishers_) return;
    if (publishers_->raw_observations.getNumSubscribers() > 0) publishers_->raw_observations.publish(raw);
    if (publishers_->fix.getNumSubscribers() > 0)
      publishers_->fix.publish(ros_messages::fix_message<ros1::NavSatFix>(head, epoch));
    if (publishers_->fix_velocity.getNumSubscribers() > 0) {
      publishers_->fix_velocity.publish(
          ros_messages::velocity_message<ros1::TwistWithCovarianceStamped>(head, epoch));
    }
    if (publishers_->gnss_multipath.getNumSubscribers() > 0)
      publishers_->gnss_multipath.publish(ros_messages::multipath_message<ros1::GnssMultipath>(head, epoch));
    if (publishers_->satellites.getNumSubscribers() > 0)
      publishers_->satellites.publish(ros_messages::satellites_message<ros1::GnssSatellites>(head, epoch));
    if (publishers_->scan && epoch != nullptr && publishers_->scan.getNumSubscribers() > 0) {
      publishers_->scan.publish(
          ros_messages::scan_message<ros1::LaserScan>(head, report.scan_ranges_m, report.scan_max_range_m));
    }
  }

  /// Time restarts.
  void reset() { raw_.reset(); }

 private:
  struct Publishers {
    ros::Publisher fix, fix_velocity, gnss_multipath, satellites, raw_observations, scan;
  };
  const RosTopics names_;
  const std::string frame_id_;
  ros_messages::RawObservations raw_;  // of the simulation's thread
  mutable std::mutex mutex_;
  std::optional<Publishers> publishers_;
};

std::vector<RosService> services_of(const RosTopics& names, live::FaultRequestHandler faults) {
  const auto answerer = std::make_shared<const live::FaultRequestHandler>(std::move(faults));
  std::vector<RosService> services;
  for (const live::ControlService& service : live::kControlServices) {
    if (!service.has_faults) continue;
    services.push_back({names.own + '/' + service.name, [answerer, kind = service.kind](const auto& text) {
                          live::ServiceReply reply = answerer->call(kind, text);
                          return std::pair(reply.success, std::move(reply.message));
                        }});
  }
  return services;
}

class RosPublisher final : public live::EpochPublisher {
 public:
  RosPublisher(std::shared_ptr<RosLink> link, const RosTopics& names, std::string frame_id,
               live::FaultRequestHandler faults)
      : link_(std::move(link)),
        names_(names.claimed()),
        topics_(std::make_shared<ReceiverTopics>(names, std::move(frame_id))),
        services_(make_ros_services(services_of(names, std::move(faults)))) {
    link_->add(topics_);
    link_->add(services_);
  }
  ~RosPublisher() override {
    link_->remove(topics_);
    link_->remove(services_);
    link_->release(names_);
  }
  RosPublisher(const RosPublisher&) = delete;
  RosPublisher& operator=(const RosPublisher&) = delete;

  void reset() override { topics_->reset(); }
  void publish(const live::ReceiverReport& report) override {
    try {
      topics_->publish(report);
    } catch (const std::exception& e) {
      if (!std::exchange(logged_, true)) gzerr << "[canyon] cannot publish on ROS: " << e.what() << std::endl;
    }
  }

 private:
  std::shared_ptr<RosLink> link_;
  std::vector<std::string> names_;
  std::shared_ptr<ReceiverTopics> topics_;
  std::shared_ptr<RosClient> services_;
  bool logged_ = false;
};

}  // namespace

std::unique_ptr<live::EpochPublisher> make_ros_publisher(const ReceiverIdentity& identity,
                                                         const HostSettings& settings,
                                                         live::FaultRequestHandler faults) {
  std::vector<std::string> notes;
  const std::shared_ptr<RosLink> link = RosLink::get();
  const RosTopics topics = claimed_ros_topics(
      identity, settings, [&](const std::vector<std::string>& names) { return link->claim(names); }, notes);
  for (const std::string& note : notes) {
    gzwarn << "[canyon] plugin '" << identity.plugin << "' of model '" << identity.model << "': " << note
           << std::endl;
  }
  return std::make_unique<RosPublisher>(link, topics, ros_frame_id(identity, settings), std::move(faults));
}

}  // namespace canyon::adapters::gazebo_classic
