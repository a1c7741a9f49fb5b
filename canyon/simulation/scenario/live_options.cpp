#include "canyon/simulation/scenario/live_options.hpp"

#include <string_view>

#include "canyon/options/visitor.hpp"

namespace canyon::simulation {

void visit(options::Visitor& v, StreamOptions& o) {
  v.number({"rate_hz", "Hz", "rate of the epochs that are sent", "every epoch"}, o.rate_hz, {0, 1000, true});
  v.number({"latency_s", "s", "delay from epoch to bytes, in real time; receivers have 0.05 to 0.2"},
           o.latency_s, {0, 10});
  v.number({"jitter_s", "s", "standard deviation of the latency"}, o.jitter_s, {0, 1});
  v.number(
      {"link_baud", "baud",
       "speed of a slow link on the way, ten bits a byte: an epoch's messages arrive one after the other",
       "at once"},
      o.link_baud, {300, 1e9});
  v.boolean(
      {"ephemerides", "",
       "rtcm and gps_rtcm_data: with the satellites' ephemerides (messages 1019, 1020, 1042, 1044 to 1046); "
       "false: for radio links, where the rover reads them from the satellites"},
      o.ephemerides);
  v.boolean({"virtual_station", "",
             "rtcm: a network's virtual reference station: each client gets corrections for the place of its "
             "own GGA sentences, and nothing before the first one"},
            o.virtual_station);
  visit_generation(v, o.generation);
}

void visit(options::Visitor& v, StreamRequest& o) {
  v.text({"receiver", "", "name of the receiver; required with several receivers"}, o.receiver);
  v.text({"format", "", "nmea, ubx and others: 'canyon simulate --help' lists them"}, o.format);
  v.text({"to", "", "an address: docs/outputs.md lists them"}, o.address);
  visit(v, o.options);
  if (!v.reads()) return;
  v.require("format");
  v.require("to");
}

void visit(options::Visitor& v, PoseSourceOptions& o) {
  static constexpr std::string_view kFormats[]{"json", "binary", "mavlink"};
  static constexpr std::string_view kAxes[]{"enu", "ned"};
  static constexpr std::string_view kBody[]{"flu", "frd"};
  v.text({"from", "",
          "source of poses: trajectory (the scenario's), file:PATH (a log), or an address to listen at, such "
          "as udp-listen://127.0.0.1:14560 or stdin:"},
         o.from);
  v.choice({"format", "", "format of poses: json (a line each), binary or mavlink"}, o.format, kFormats);
  v.text({"id", "", "id of the vehicle if several send to this address (mavlink: number of the system)"},
         o.id);
  v.texts({"receivers", "", "receivers on this vehicle", "all that no other source names"}, o.receivers);
  v.texts({"messages", "", "MAVLink messages to take",
           "SIM_STATE, HIL_STATE_QUATERNION, ATT_POS_MOCAP, VISION_POSITION_ESTIMATE, ODOMETRY"},
          o.messages);
  v.choice({"axes", "", "axes of positions and velocities: enu or ned (mavlink: given by the message)"},
           o.axes, kAxes);
  v.choice({"body", "", "axes of attitudes and angular rates: flu or frd"}, o.body, kBody);
  v.number({"east_m", "m", "origin of the poses in the city, east"}, o.origin_enu_m.x(), {-1e6, 1e6});
  v.number({"north_m", "m", "origin of the poses in the city, north"}, o.origin_enu_m.y(), {-1e6, 1e6});
  v.number({"up_m", "m", "origin of the poses in the city, up"}, o.origin_enu_m.z(), {-1e5, 1e5});
  v.angle({"heading_deg", "deg", "direction of their first axis in ENU, from east counter-clockwise"},
          o.heading_rad, {-360, 360});
  v.number({"scale", "", "metres in the city for one unit of the poses"}, o.scale, {1e-3, 1e4});
  v.number({"timeout_s", "s",
            "the last motion is continued for this time after the last pose; then there is no truth and no "
            "signal"},
           o.track.timeout_s, {0.01, 60});
  v.number({"smoothing_s", "s",
            "if poses have no velocities: time over which positions are differenced; steps, of at least 0.04 "
            "s, of the motion that sensors feel"},
           o.track.smoothing_s, {0, 1});
}

void visit(options::Visitor& v, LiveOptions& o) {
  static constexpr std::string_view kClocks[]{"wall", "stamps"};
  v.list("poses", o.poses, [&](PoseSourceOptions& source) { visit(v, source); });
  v.list("streams", o.streams, [&](StreamRequest& stream) { visit(v, stream); });
  v.choice({"clock", "", "clock of the run: wall (real time) or stamps (those of the poses)"}, o.clock,
           kClocks);
  v.number({"speed", "", "speed of the trajectory and of logs: their seconds in a second of real time"},
           o.speed, {0.01, 1000});
  v.number({"wait_s", "s",
            "time for which an epoch waits for a pose of its instant; then the last pose is extrapolated"},
           o.wait_s, {0, 1});
  v.boolean({"stagger", "", "distribute the receivers' epochs evenly over the interval"}, o.stagger);
  v.boolean({"resume", "",
             "take the run's time from the poses' stamps, so that a restarted program continues at the "
             "vehicle's time"},
            o.resume);
  v.text({"control", "", "address that takes commands, such as tcp://127.0.0.1:7878"}, o.control);
  v.boolean({"changes", "", "commands may change the simulation"}, o.changes);
}

}  // namespace canyon::simulation
