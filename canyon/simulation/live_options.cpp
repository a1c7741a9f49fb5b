#include "canyon/simulation/live_options.hpp"

#include <string_view>

#include "canyon/options/visitor.hpp"

namespace canyon::simulation {

void visit(options::Visitor& v, StreamOptions& o) {
  v.number({"rate_hz", "Hz", "of the epochs that are sent", "every epoch"}, o.rate_hz, {0, 1000, true});
  v.number({"latency_s", "s", "from epoch to bytes, in real time; receivers have 0.05 to 0.2"}, o.latency_s,
           {0, 10});
  v.number({"jitter_s", "s", "of the latency, standard deviation"}, o.jitter_s, {0, 1});
}

void visit(options::Visitor& v, StreamRequest& o) {
  v.text({"receiver", "", "whose epochs; needed with several receivers"}, o.receiver);
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
          "trajectory: the scenario's; file:PATH: a log; else an address to listen at, such as "
          "udp-listen://127.0.0.1:14560 or stdin:"},
         o.from);
  v.choice({"format", "", "how poses are written: json (a line each), binary or mavlink"}, o.format,
           kFormats);
  v.text({"id", "", "of the vehicle, where several speak (mavlink: number of the system)"}, o.id);
  v.texts({"receivers", "", "whose vehicle it is", "all that no other source names"}, o.receivers);
  v.texts({"messages", "", "MAVLink messages to take",
           "SIM_STATE, HIL_STATE_QUATERNION, ATT_POS_MOCAP, VISION_POSITION_ESTIMATE, ODOMETRY"},
          o.messages);
  v.choice({"axes", "", "of positions and velocities: enu or ned (mavlink knows its own)"}, o.axes, kAxes);
  v.choice({"body", "", "axes of attitudes and angular rates: flu or frd"}, o.body, kBody);
  v.number({"east_m", "m", "where the poses' origin is in the city"}, o.origin_enu_m.x(), {-1e6, 1e6});
  v.number({"north_m", "m", "likewise"}, o.origin_enu_m.y(), {-1e6, 1e6});
  v.number({"up_m", "m", "likewise"}, o.origin_enu_m.z(), {-1e5, 1e5});
  v.angle({"heading_deg", "deg", "of their first axis in ENU, from east counter-clockwise"}, o.heading_rad,
          {-360, 360});
  v.number({"scale", "", "metres in the city for one of the poses"}, o.scale, {1e-3, 1e4});
  v.number({"timeout_s", "s",
            "the vehicle goes on as it moved for so long behind its last pose, then there "
            "is no truth and no signal"},
           o.track.timeout_s, {0.01, 60});
  v.number({"smoothing_s", "s", "velocities that no pose has are differences over this time"},
           o.track.smoothing_s, {0, 1});
}

void visit(options::Visitor& v, LiveOptions& o) {
  static constexpr std::string_view kClocks[]{"wall", "stamps"};
  v.list("poses", o.poses, [&](PoseSourceOptions& source) { visit(v, source); });
  v.list("streams", o.streams, [&](StreamRequest& stream) { visit(v, stream); });
  v.choice({"clock", "", "what makes epochs due: wall (real time) or stamps (those of the poses)"}, o.clock,
           kClocks);
  v.number({"speed", "", "of the trajectory and of logs: seconds of theirs in a second of real time"},
           o.speed, {0.01, 1000});
  v.number({"wait_s", "s", "epochs wait so long for a pose of their instant before they go on from the last"},
           o.wait_s, {0, 1});
  v.boolean({"stagger", "", "epochs of the receivers lie evenly over the interval, not all at one instant"},
            o.stagger);
  v.boolean(
      {"resume", "",
       "seconds of the run, its GPS time and faults count by the poses' stamps: what is begun anew goes "
       "on in time with the vehicle"},
      o.resume);
  v.text({"control", "", "an address that takes commands, such as tcp://127.0.0.1:7878"}, o.control);
  v.boolean({"changes", "", "commands may change the simulation"}, o.changes);
}

}  // namespace canyon::simulation
