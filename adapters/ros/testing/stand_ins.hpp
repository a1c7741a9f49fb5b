#pragma once

#include <Eigen/Geometry>
#include <cstdint>
#include <string>

namespace canyon::test::messages {

/// Parts of messages as generated for ROS 2. Numbers are 7 until they are set.
struct Header {
  struct {
    std::int32_t sec = 7;
    std::uint32_t nanosec = 7;
  } stamp;
  std::string frame_id = "unset";
};
struct Vector3 {
  double x = 7, y = 7, z = 7;
};
struct Quaternion {
  double x = 7, y = 7, z = 7, w = 7;
};

}  // namespace canyon::test::messages
