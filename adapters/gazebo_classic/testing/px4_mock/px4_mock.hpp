#pragma once

namespace canyon::adapters::gazebo_classic::test {

/// A mock of PX4's bridge, in a library with its own generated class for sensor_msgs.msgs.SITLGps, with which
/// it subscribes. For dlopen() and dlsym("px4_mock"), so that a test chooses when the class is loaded.
struct Px4Mock {
  void (*subscribe)(const char* topic);
  void (*unsubscribe)();
  /// Messages received as objects of the class, and other messages (which would crash PX4's bridge).
  int (*received)();
  int (*foreign)();
  /// Writes the last message as protobuf's text format; returns its length, truncated at `size` - 1.
  int (*last)(char* text, int size);
};

}  // namespace canyon::adapters::gazebo_classic::test
