#pragma once

#include <memory>
#include <string>

#include "adapters/common/ray_visuals.hpp"
#include "adapters/common/ros_names.hpp"
#include "canyon/outputs/live/epoch_publisher.hpp"

// The publishers of the system for Gazebo Sim. Each is made once per receiver, holds its own transport node,
// and unadvertises its topics when destroyed; InputError on failure.

namespace canyon::adapters::gz_sim {

/// gz.msgs.NavSat on the sensor's own topic, if it has subscribers and there is a fix with a velocity
/// (fill_navsat()); else nothing is sent.
/// @param topic as in gz-sim: "/world/city/model/iris/link/base_link/sensor/gps/navsat"
[[nodiscard]] std::unique_ptr<live::EpochPublisher> make_navsat_publisher(const std::string& topic,
                                                                          const std::string& frame_id);

/// The topic of canyon.msgs.GnssReceiver for a NavSat topic: ".../sensor/gps/gnss" for
/// ".../sensor/gps/navsat"; for a topic chosen by the user, "/rover/fix", the same with "/gnss" appended.
[[nodiscard]] std::string gnss_topic_for(const std::string& navsat_topic, bool chosen_by_user);

/// canyon.msgs.GnssReceiver (adapters/common/msgs) at every epoch, also without a fix, if it has subscribers.
[[nodiscard]] std::unique_ptr<live::EpochPublisher> make_gnss_publisher(const ReceiverIdentity& identity,
                                                                        const std::string& topic);

/// Markers in the scene of the graphical client, which offers the service /marker_array: sent at most ten
/// times per second of wall time without waiting for a response, removed with the publisher.
[[nodiscard]] std::unique_ptr<live::EpochPublisher> make_markers(const ReceiverIdentity& identity,
                                                                 const VisualSettings& settings);

}  // namespace canyon::adapters::gz_sim
