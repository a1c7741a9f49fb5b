#pragma once

#include <gazebo/transport/TransportTypes.hh>
#include <memory>

#include "adapters/common/host_settings.hpp"
#include "canyon/outputs/live/controls.hpp"
#include "canyon/outputs/live/epoch_publisher.hpp"

// The publishers of the plugin. Each is made once per receiver; InputError on failure.

namespace canyon::adapters::gazebo_classic {

/// canyon.msgs.GnssReceiver (adapters/common/msgs) on ~/MODEL/gnss, or ~/MODEL/SENSOR/gnss with a sensor.
[[nodiscard]] std::unique_ptr<live::EpochPublisher> make_gazebo_publisher(
    const gazebo::transport::NodePtr& node, const ReceiverIdentity& identity);

/// sensor_msgs.msgs.SITLGps on ~/MODEL/link/TOPIC, as expected by PX4's bridge. Nothing is sent without a
/// fix, since PX4 treats every message as a 3D fix.
[[nodiscard]] std::unique_ptr<live::EpochPublisher> make_px4_publisher(const gazebo::transport::NodePtr& node,
                                                                       const ReceiverIdentity& identity,
                                                                       const HostSettings& settings);

/// Rays and bubble in the world's scene.
[[nodiscard]] std::unique_ptr<live::EpochPublisher> make_visuals(const gazebo::transport::NodePtr& node,
                                                                 const ReceiverIdentity& identity,
                                                                 const VisualSettings& settings);

/// ROS 1 topics, and the services of faults (live::kControlServices) below RosTopics::own, with the first
/// master that responds; never blocks. Only in builds with ROS 1.
[[nodiscard]] std::unique_ptr<live::EpochPublisher> make_ros_publisher(const ReceiverIdentity& identity,
                                                                       const HostSettings& settings,
                                                                       live::FaultRequestHandler faults);

}  // namespace canyon::adapters::gazebo_classic
