#pragma once

#include <canyon_msgs/msg/gnss_multipath.hpp>
#include <canyon_msgs/msg/gnss_raw_observations.hpp>
#include <canyon_msgs/msg/gnss_satellites.hpp>
#include <canyon_msgs/srv/fault_command.hpp>
#include <diagnostic_msgs/msg/diagnostic_array.hpp>
#include <geometry_msgs/msg/twist_with_covariance_stamped.hpp>
#include <rclcpp/create_publisher.hpp>
#include <rclcpp/create_service.hpp>
#include <rclcpp/node_interfaces/node_parameters_interface.hpp>
#include <rclcpp/node_interfaces/node_topics_interface.hpp>
#include <rclcpp/publisher.hpp>
#include <rosgraph_msgs/msg/clock.hpp>
#include <sensor_msgs/msg/fluid_pressure.hpp>
#include <sensor_msgs/msg/imu.hpp>
#include <sensor_msgs/msg/laser_scan.hpp>
#include <sensor_msgs/msg/magnetic_field.hpp>
#include <sensor_msgs/msg/nav_sat_fix.hpp>
#include <string>
#include <vector>
#ifdef CANYON_WITH_AUTOWARE
#include <autoware_sensing_msgs/msg/gnss_ins_orientation_stamped.hpp>
#endif
#ifdef CANYON_WITH_GPS_MSGS
#include <gps_msgs/msg/gps_fix.hpp>
#endif

#include "adapters/ros/raw_conversions.hpp"
#include "canyon/outputs/live/controls.hpp"
#include "canyon/outputs/live/epoch_publisher.hpp"
#include "canyon/simulation/inertial/sensor_options.hpp"
#include "canyon/simulation/sensor_run.hpp"

namespace canyon::adapters::ros2 {

/// Names of a receiver's topics; empty names are not published.
struct TopicNames {
  std::string fix = "fix";
  std::string fix_velocity = "fix_velocity";
  std::string gps_fix = "gpsfix";  ///< gps_msgs/GPSFix, in builds with it
  std::string orientation =
      "autoware_orientation";  ///< of receivers with an attitude, in builds with its message
  std::string gnss_multipath = "gnss_multipath";
  std::string satellites = "satellites";
  std::string raw_observations = "raw_observations";
  std::string diagnostics = "/diagnostics";
  std::string scan = {};
  std::string imu = {};
  std::string wheels = {};
  std::string magnetic_field = {};
  std::string air_pressure = {};
  std::string clock = {};
};

/// The parts of a node used by topics: of an rclcpp::Node, a managed node, or one of gazebo_ros.
struct NodeParts {
  template <class Node>
  explicit NodeParts(Node& node)
      : parameters(node.get_node_parameters_interface()),
        topics(node.get_node_topics_interface()),
        logger(node.get_logger()) {}

  rclcpp::node_interfaces::NodeParametersInterface::SharedPtr parameters;
  rclcpp::node_interfaces::NodeTopicsInterface::SharedPtr topics;
  rclcpp::Logger logger;
};

/// Makes a publisher whose quality of service can be overridden by parameters. Logs a subscriber that
/// requests more than is offered. An empty name is not published.
template <class Publisher>
void advertise(NodeParts& node, const std::string& name, const rclcpp::QoS& qos, Publisher& publisher) {
  using Message = typename Publisher::element_type::PublishedType;
  if (name.empty()) return;
  rclcpp::PublisherOptions options;
  options.qos_overriding_options = rclcpp::QosOverridingOptions::with_default_policies();
  const std::string resolved = node.topics->resolve_topic_name(name);
  options.event_callbacks.incompatible_qos_callback = [logger = node.logger, resolved](
                                                          rclcpp::QOSOfferedIncompatibleQoSInfo& info) {
    RCLCPP_WARN(
        logger,
        "a subscriber of %s requests a quality of service that is not offered (%s) and gets nothing; use "
        "sensor data QoS in the subscriber, or set qos_overrides.%s.publisher.*",
        resolved.c_str(), rclcpp::qos_policy_name_from_kind(info.last_policy_kind).c_str(), resolved.c_str());
  };
  publisher = rclcpp::create_publisher<Message>(node.parameters, node.topics, name, qos, options);
}

/// A receiver's topics, reliable with a depth of ten, as in receivers' drivers; compatible with sensor data
/// subscribers. Logs a subscriber that requests more than is offered. Unsubscribed messages are not made.
class ReceiverTopics {
 public:
  /// @param diagonal_covariance of fixes: make_covariance_diagonal()
  ReceiverTopics(NodeParts node, const TopicNames& names, bool diagonal_covariance = false);

  /// Publishes one epoch or, with health.reason, none. @param report its time is the stamp
  void publish(const live::ReceiverReport& report, const std::string& frame_id,
               const ros_messages::ReceiverHealth& health);
  /// Publishes samples of the vehicle's sensors, without lost ones.
  /// @param begin of the run, at `zero_ns` of the clock
  void publish(const simulation::SensorBatch& batch, const inertial::SensorOptions& sensors,
               geodesy::GpsTime begin, std::int64_t zero_ns, const std::string& vehicle_frame);
  void publish_clock(std::int64_t now_ns);
  /// The drive restarts.
  void reset();

 private:
  template <class Message>
  using Topic = typename rclcpp::Publisher<Message>::SharedPtr;

  Topic<sensor_msgs::msg::NavSatFix> fix_;
  Topic<geometry_msgs::msg::TwistWithCovarianceStamped> fix_velocity_, wheels_;
#ifdef CANYON_WITH_AUTOWARE
  Topic<autoware_sensing_msgs::msg::GnssInsOrientationStamped> orientation_;
#endif
#ifdef CANYON_WITH_GPS_MSGS
  Topic<gps_msgs::msg::GPSFix> gps_fix_;
#endif
  Topic<sensor_msgs::msg::Imu> imu_;
  Topic<sensor_msgs::msg::MagneticField> magnetic_field_;
  Topic<sensor_msgs::msg::FluidPressure> air_pressure_;
  Topic<canyon_msgs::msg::GnssMultipath> gnss_multipath_;
  Topic<canyon_msgs::msg::GnssSatellites> satellites_;
  Topic<canyon_msgs::msg::GnssRawObservations> raw_observations_;
  Topic<diagnostic_msgs::msg::DiagnosticArray> diagnostics_;
  Topic<sensor_msgs::msg::LaserScan> scan_;
  Topic<rosgraph_msgs::msg::Clock> clock_;
  ros_messages::RawObservations raw_;
  bool diagonal_covariance_;
  std::int64_t diagnosed_ns_ = -1;
  int diagnosed_state_ = -1;
};

/// The services ~/get_faults, ~/add_fault and ~/end_fault of a node, canyon_msgs/FaultCommand, during its
/// lifetime. A call in progress may outlive it.
class FaultServices {
 public:
  /// @param node an rclcpp::Node or a managed one
  template <class Node>
  FaultServices(Node& node, live::FaultRequestHandler faults)
      : FaultServices(node.get_node_base_interface(), node.get_node_services_interface(), std::move(faults)) {
  }

 private:
  FaultServices(rclcpp::node_interfaces::NodeBaseInterface::SharedPtr base,
                rclcpp::node_interfaces::NodeServicesInterface::SharedPtr services,
                live::FaultRequestHandler faults);

  std::vector<rclcpp::Service<canyon_msgs::srv::FaultCommand>::SharedPtr> services_;
};

}  // namespace canyon::adapters::ros2
