#pragma once

#include <memory>
#include <string>
#include <vector>

#include "adapters/common/ros_names.hpp"
#include "canyon/outputs/live/controls.hpp"
#include "canyon/outputs/live/epoch_publisher.hpp"

namespace canyon::adapters::ros2 {

/// The topics of a simulator's receiver (ReceiverTopics), by a node of its own in the simulator's process;
/// ROS 2 is begun there where nobody has yet (gazebo_ros does). They are in claimed_ros_topics(), beside them
/// raw_observations, and /diagnostics. Its services are those of FaultServices. Remarks about names are in
/// the first take_notes(). Throws InputError as claimed_ros_topics().
[[nodiscard]] std::unique_ptr<live::EpochPublisher> make_host_publisher(const ReceiverIdentity& identity,
                                                                        const RosSettings& settings,
                                                                        live::FaultAnswerer faults);

}  // namespace canyon::adapters::ros2
