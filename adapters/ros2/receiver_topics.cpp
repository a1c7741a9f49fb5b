#include "adapters/ros2/receiver_topics.hpp"

#include <memory>
#include <utility>

#include "adapters/ros2/advertise.hpp"

namespace canyon::adapters::ros2 {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;

template <class Publisher, class Make>
void send(const Publisher& publisher, const Make& make) {
  if (!publisher || publisher->get_subscription_count() == 0) return;
  using Message = typename Publisher::element_type::PublishedType;
  publisher->publish(std::make_unique<Message>(make()));  // handed over as it is within a process
}

}  // namespace

ReceiverTopics::ReceiverTopics(NodeParts node, const TopicNames& names) {
  const rclcpp::SensorDataQoS sensor;
  const rclcpp::QoS reliable(10);
  advertise(node, names.fix, sensor, fix_);
  advertise(node, names.fix_velocity, sensor, fix_velocity_);
  advertise(node, names.gnss_multipath, sensor, gnss_multipath_);
  advertise(node, names.satellites, sensor, satellites_);
  advertise(node, names.raw_observations, sensor, raw_observations_);
  advertise(node, names.diagnostics, reliable, diagnostics_);
  advertise(node, names.scan, sensor, scan_);
  advertise(node, names.clock, reliable, clock_);
}

void ReceiverTopics::publish(const ReceiverReport& report, const std::string& frame_id,
                             const ros_messages::ReceiverHealth& health) {
  using namespace ros_messages;
  const std::int64_t stamp_ns = report.sim_time_ns;
  const Head head{
      {static_cast<std::int32_t>(stamp_ns / kSecond_ns), static_cast<std::uint32_t>(stamp_ns % kSecond_ns)},
      frame_id};
  const simulation::Epoch* epoch = report.step != nullptr ? &report.step->epoch : nullptr;
  if (!health.finished) {
    send(fix_, [&] { return fix_message<sensor_msgs::msg::NavSatFix>(head, epoch); });
    send(fix_velocity_,
         [&] { return velocity_message<geometry_msgs::msg::TwistWithCovarianceStamped>(head, epoch); });
    send(gnss_multipath_, [&] { return multipath_message<canyon_msgs::msg::GnssMultipath>(head, epoch); });
    send(satellites_, [&] { return satellites_message<canyon_msgs::msg::GnssSatellites>(head, epoch); });
    // Phases are followed whether somebody listens or not.
    auto raw = raw_.message<canyon_msgs::msg::GnssRawObservations>(head, epoch);
    send(raw_observations_, [&] { return std::move(raw); });
    if (epoch != nullptr) {
      send(scan_, [&] {
        return scan_message<sensor_msgs::msg::LaserScan>(head, report.scan_ranges_m, report.scan_max_range_m);
      });
    }
  }
  // The health goes out once a second, and where something has changed.
  const int state = health.finished    ? 3
                    : epoch == nullptr ? 2
                                       : 4 + static_cast<int>(epoch->observed.fix.kind());
  if (state != diagnosed_state_ || stamp_ns < diagnosed_ns_ || stamp_ns - diagnosed_ns_ >= kSecond_ns) {
    diagnosed_state_ = state;
    diagnosed_ns_ = stamp_ns;
    send(diagnostics_,
         [&] { return diagnostics_message<diagnostic_msgs::msg::DiagnosticArray>(head, health, epoch); });
  }
}

void ReceiverTopics::publish_clock(std::int64_t now_ns) {
  rosgraph_msgs::msg::Clock message;
  message.clock = rclcpp::Time(now_ns);
  clock_->publish(message);
}

void ReceiverTopics::reset() {
  raw_.reset();
  diagnosed_ns_ = -1;
  diagnosed_state_ = -1;
}

}  // namespace canyon::adapters::ros2
