#pragma once

#include <memory>

#include "adapters/common/ros_names.hpp"
#include "canyon/outputs/live/controls.hpp"
#include "canyon/outputs/live/epoch_publisher.hpp"

namespace canyon::adapters::ros2 {

/// The topics of a simulator's receiver (ReceiverTopics), from its own node in the simulator's process;
/// initializes ROS 2 there unless already done (as by gazebo_ros). Topics are those of claimed_ros_topics(),
/// raw_observations, and /diagnostics. Its services are those of FaultServices. Remarks about names are in
/// the first take_notes(). Throws InputError as claimed_ros_topics().
[[nodiscard]] std::unique_ptr<live::EpochPublisher> make_host_publisher(const ReceiverIdentity& identity,
                                                                        const RosSettings& settings,
                                                                        live::FaultRequestHandler faults);

}  // namespace canyon::adapters::ros2
