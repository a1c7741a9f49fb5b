#pragma once

#include <memory>
#include <string>

#include "adapters/common/ray_visuals.hpp"
#include "adapters/common/ros_names.hpp"
#include "canyon/outputs/live/epoch_publisher.hpp"

// The ways out of the system for Gazebo Sim. Each is made once per receiver, holds a transport node of its
// own, and takes its topics back when it is destroyed; InputError where it cannot be made.

namespace canyon::adapters::gz_sim {

/// gz.msgs.NavSat on the sensor's own topic, where somebody listens and there is a fix with a velocity
/// (fill_navsat()); nothing is sent otherwise.
/// @param topic as gz-sim gives it: "/world/city/model/iris/link/base_link/sensor/gps/navsat"
[[nodiscard]] std::unique_ptr<live::EpochPublisher> make_navsat_publisher(const std::string& topic,
                                                                          const std::string& frame_id);

/// The topic of canyon.msgs.GnssReceiver beside a NavSat topic: ".../sensor/gps/gnss" for
/// ".../sensor/gps/navsat", and for a topic that the user chose himself, "/rover/fix", the same with "/gnss"
/// behind it.
[[nodiscard]] std::string gnss_topic_beside(const std::string& navsat_topic, bool chosen_by_user);

/// canyon.msgs.GnssReceiver (adapters/common/msgs) at every epoch, fix or not, where somebody listens.
[[nodiscard]] std::unique_ptr<live::EpochPublisher> make_gnss_publisher(const ReceiverIdentity& identity,
                                                                        const std::string& topic);

/// Markers in the scene of whoever offers the service /marker_array, the graphical client: at most ten times
/// a second of wall time, never waiting for an answer, gone when the publisher goes.
[[nodiscard]] std::unique_ptr<live::EpochPublisher> make_markers(const ReceiverIdentity& identity,
                                                                 const VisualSettings& settings);

}  // namespace canyon::adapters::gz_sim
