#include "adapters/ros2/receiver_topics.hpp"

#include <cmath>
#include <memory>
#include <utility>

#include "adapters/ros/gps_fix.hpp"
#include "adapters/ros/orientation.hpp"
#include "adapters/ros/sensor_conversions.hpp"

namespace canyon::adapters::ros2 {
namespace {

constexpr std::int64_t kSecond_ns = 1'000'000'000;
// A second of a fast inertial sensor, for a delayed subscriber.
constexpr std::size_t kSensorDepth = 200;

ros_messages::Head head_of(std::int64_t stamp_ns, const std::string& frame_id) {
  return {
      {static_cast<std::int32_t>(stamp_ns / kSecond_ns), static_cast<std::uint32_t>(stamp_ns % kSecond_ns)},
      frame_id};
}

template <class Publisher, class Make>
void send(const Publisher& publisher, const Make& make) {
  if (!publisher || publisher->get_subscription_count() == 0) return;
  using Message = typename Publisher::element_type::PublishedType;
  publisher->publish(std::make_unique<Message>(make()));  // passed without a copy within a process
}

}  // namespace

ReceiverTopics::ReceiverTopics(NodeParts node, const TopicNames& names, bool diagonal_covariance)
    : diagonal_covariance_(diagonal_covariance) {
  const rclcpp::QoS reliable(10);
  advertise(node, names.fix, reliable, fix_);
  advertise(node, names.fix_velocity, reliable, fix_velocity_);
#ifdef CANYON_WITH_GPS_MSGS
  advertise(node, names.gps_fix, reliable, gps_fix_);
#endif
#ifdef CANYON_WITH_AUTOWARE
  advertise(node, names.orientation, reliable, orientation_);
#endif
  advertise(node, names.imu, rclcpp::SensorDataQoS().reliable().keep_last(kSensorDepth), imu_);
  advertise(node, names.wheels, reliable, wheels_);
  advertise(node, names.magnetic_field, reliable, magnetic_field_);
  advertise(node, names.air_pressure, reliable, air_pressure_);
  advertise(node, names.gnss_multipath, reliable, gnss_multipath_);
  advertise(node, names.satellites, reliable, satellites_);
  advertise(node, names.raw_observations, reliable, raw_observations_);
  advertise(node, names.diagnostics, reliable, diagnostics_);
  advertise(node, names.scan, reliable, scan_);
  advertise(node, names.clock, reliable, clock_);
}

void ReceiverTopics::publish(const live::ReceiverReport& report, const std::string& frame_id,
                             const ros_messages::ReceiverHealth& health) {
  using namespace ros_messages;
  const std::int64_t stamp_ns = report.sim_time_ns;
  const Head head = head_of(stamp_ns, frame_id);
  const simulation::Epoch* epoch = report.step != nullptr ? &report.step->epoch : nullptr;
  const auto reported = [this](auto message) {
    if (diagonal_covariance_) make_covariance_diagonal(message);
    return message;
  };
  if (!health.finished) {
    send(fix_, [&] { return reported(fix_message<sensor_msgs::msg::NavSatFix>(head, epoch)); });
    send(fix_velocity_,
         [&] { return velocity_message<geometry_msgs::msg::TwistWithCovarianceStamped>(head, epoch); });
#ifdef CANYON_WITH_GPS_MSGS
    send(gps_fix_, [&] { return reported(gps_fix_message<gps_msgs::msg::GPSFix>(head, epoch)); });
#endif
#ifdef CANYON_WITH_AUTOWARE
    using Orientation = autoware_sensing_msgs::msg::GnssInsOrientationStamped;
    if (auto orientation = orientation_message<Orientation>(head, epoch))
      send(orientation_, [&] { return std::move(*orientation); });
#endif
    send(gnss_multipath_, [&] { return multipath_message<canyon_msgs::msg::GnssMultipath>(head, epoch); });
    send(satellites_, [&] { return satellites_message<canyon_msgs::msg::GnssSatellites>(head, epoch); });
    // Phases are tracked even without subscribers.
    auto raw = raw_.message<canyon_msgs::msg::GnssRawObservations>(head, epoch);
    send(raw_observations_, [&] { return std::move(raw); });
    if (epoch != nullptr) {
      send(scan_, [&] {
        return scan_message<sensor_msgs::msg::LaserScan>(head, report.scan_ranges_m, report.scan_max_range_m);
      });
    }
  }
  // The health is published once a second and after changes.
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

void ReceiverTopics::publish(const simulation::SensorBatch& batch, const inertial::SensorOptions& sensors,
                             geodesy::GpsTime begin, std::int64_t zero_ns, const std::string& vehicle_frame) {
  using namespace ros_messages;
  for (const simulation::InertialSample& sample : batch.imu) {
    if (!sample.sample) continue;
    const std::int64_t stamp_ns = zero_ns + std::llround(sample.sample->time_s * 1e9);
    send(imu_,
         [&] { return imu_message<sensor_msgs::msg::Imu>(head_of(stamp_ns, "imu"), sample, *sensors.imu); });
  }
  const auto stamp_of = [&](geodesy::GpsTime time) {
    return zero_ns + (time.nanoseconds() - begin.nanoseconds());
  };
  for (const simulation::WheelsAtWork& sample : batch.wheels) {
    send(wheels_, [&] {
      return wheel_message<geometry_msgs::msg::TwistWithCovarianceStamped>(
          head_of(stamp_of(sample.time), vehicle_frame), sample, *sensors.wheels);
    });
  }
  for (const simulation::MagnetometerSample& sample : batch.magnetometer) {
    send(magnetic_field_, [&] {
      return magnetic_message<sensor_msgs::msg::MagneticField>(head_of(stamp_of(sample.time), "magnetometer"),
                                                               sample, *sensors.magnetometer);
    });
  }
  for (const simulation::BarometerSample& sample : batch.barometer) {
    send(air_pressure_, [&] {
      return pressure_message<sensor_msgs::msg::FluidPressure>(head_of(stamp_of(sample.time), "barometer"),
                                                               sample, *sensors.barometer);
    });
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

FaultServices::FaultServices(rclcpp::node_interfaces::NodeBaseInterface::SharedPtr base,
                             rclcpp::node_interfaces::NodeServicesInterface::SharedPtr services,
                             live::FaultRequestHandler faults) {
  const auto answerer = std::make_shared<const live::FaultRequestHandler>(std::move(faults));
  for (const live::ControlService& service : live::kControlServices) {
    if (!service.has_faults) continue;
    services_.push_back(rclcpp::create_service<canyon_msgs::srv::FaultCommand>(
        base, services, std::string("~/") + service.name,
        // NOLINTNEXTLINE(performance-unnecessary-value-param): the argument types by which rclcpp recognises
        // a callback
        [answerer, kind = service.kind](canyon_msgs::srv::FaultCommand::Request::SharedPtr request,
                                        // NOLINTNEXTLINE(performance-unnecessary-value-param)
                                        canyon_msgs::srv::FaultCommand::Response::SharedPtr response) {
          live::ServiceReply reply = answerer->call(kind, request->fault);
          response->success = reply.success;
          response->message = std::move(reply.message);
        },
        rclcpp::ServicesQoS(), nullptr));
  }
}

}  // namespace canyon::adapters::ros2
