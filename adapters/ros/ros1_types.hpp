#pragma once

#include <canyon_msgs/GnssMultipath.h>
#include <canyon_msgs/GnssRawObservations.h>
#include <canyon_msgs/GnssSatellite.h>
#include <canyon_msgs/GnssSatellites.h>
#include <geometry_msgs/PoseStamped.h>
#include <geometry_msgs/TwistWithCovarianceStamped.h>
#include <sensor_msgs/LaserScan.h>
#include <sensor_msgs/NavSatFix.h>

#include <memory>

namespace canyon::ros_messages::ros1 {

/// ROS 1 messages that compile as C++20: their generator (gencpp before 0.7) uses the allocator member
/// `rebind`, which std::allocator no longer has in C++20. The serialized form is the same.
template <class T>
struct Allocator : std::allocator<T> {
  Allocator() = default;
  template <class U>
  Allocator(const Allocator<U>&) noexcept {}  // NOLINT(google-explicit-constructor): allocators convert

  template <class U>
  struct rebind {  // NOLINT(readability-identifier-naming): the required name
    using other = Allocator<U>;
  };
};

using NavSatFix = sensor_msgs::NavSatFix_<Allocator<void>>;
using LaserScan = sensor_msgs::LaserScan_<Allocator<void>>;
using TwistWithCovarianceStamped = geometry_msgs::TwistWithCovarianceStamped_<Allocator<void>>;
using PoseStamped = geometry_msgs::PoseStamped_<Allocator<void>>;
using GnssMultipath = canyon_msgs::GnssMultipath_<Allocator<void>>;
using GnssRawObservations = canyon_msgs::GnssRawObservations_<Allocator<void>>;
using GnssSatellite = canyon_msgs::GnssSatellite_<Allocator<void>>;
using GnssSatellites = canyon_msgs::GnssSatellites_<Allocator<void>>;

}  // namespace canyon::ros_messages::ros1
