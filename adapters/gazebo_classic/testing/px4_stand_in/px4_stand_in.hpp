#pragma once

namespace canyon::adapters::gazebo_classic::test {

/// Stands in for PX4's bridge, in a library with an own generated class for sensor_msgs.msgs.SITLGps: it
/// subscribes by that class. For dlopen() and dlsym("px4_stand_in"), so that the class comes into the process
/// when a test wants it.
struct Px4StandIn {
  void (*subscribe)(const char* topic);
  void (*unsubscribe)();
  /// Messages that came as objects of the class, and those that did not (PX4's bridge would have crashed).
  int (*received)();
  int (*foreign)();
  /// Writes the last message as protobuf's text format; returns its length, cut at `size` - 1.
  int (*last)(char* text, int size);
};

}  // namespace canyon::adapters::gazebo_classic::test
