#pragma once

#include <gazebo/transport/TransportTypes.hh>
#include <memory>

#include "adapters/common/host_settings.hpp"
#include "canyon/outputs/live/controls.hpp"
#include "canyon/outputs/live/epoch_publisher.hpp"

// The ways out of the plugin. Each is made once per receiver; InputError where it cannot be.

namespace canyon::adapters::gazebo_classic {

/// canyon.msgs.GnssReceiver (adapters/common/msgs) on ~/MODEL/gnss, or ~/MODEL/SENSOR/gnss with a
/// sensor.
[[nodiscard]] std::unique_ptr<live::EpochPublisher> make_gazebo_publisher(
    const gazebo::transport::NodePtr& node, const ReceiverIdentity& identity);

/// sensor_msgs.msgs.SITLGps on ~/MODEL/link/TOPIC, as PX4's bridge expects. Without a fix nothing is sent, as
/// PX4 takes every message for a 3D fix.
[[nodiscard]] std::unique_ptr<live::EpochPublisher> make_px4_publisher(const gazebo::transport::NodePtr& node,
                                                                       const ReceiverIdentity& identity,
                                                                       const HostSettings& settings);

/// Rays and bubble in the world's scene.
[[nodiscard]] std::unique_ptr<live::EpochPublisher> make_visuals(const gazebo::transport::NodePtr& node,
                                                                 const ReceiverIdentity& identity,
                                                                 const VisualSettings& settings);

/// ROS 1 topics, and the services of faults (live::kControlServices) below RosTopics::own, with the first
/// master that answers; never blocks. Only in builds with ROS 1.
[[nodiscard]] std::unique_ptr<live::EpochPublisher> make_ros_publisher(const ReceiverIdentity& identity,
                                                                       const HostSettings& settings,
                                                                       live::FaultAnswerer faults);

}  // namespace canyon::adapters::gazebo_classic
