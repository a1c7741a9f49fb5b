#include "canyon/live/host_options.hpp"

#include <fmt/format.h>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/output/encoder.hpp"
#include "canyon/output/stream.hpp"

namespace canyon::live {
namespace {

/// A reader throws its fault for a format that is not known.
void visit_streams(options::Visitor& v, const options::Field& field, std::vector<std::string>& streams) {
  v.texts(field, streams);
  if (!v.reads()) return;
  try {
    for (const std::string& text : streams) (void)output::format_named(output::parse_stream(text).format);
  } catch (const InputError& e) {
    throw v.fault(field.name, e.problem(), e.cure());
  }
}

}  // namespace

void visit_word(options::Visitor& v, const options::Field& field, std::string& value) {
  v.text(field, value);
  if (v.reads() && split_blanks(value).size() > 1) {
    throw v.fault(field.name, fmt::format("'{}' has blanks in it", value), "write one word");
  }
}

void visit_host(options::Visitor& v, HostOptions& o, std::string& frame_id,
                const std::function<void()>& of_pose) {
  visit_word(v,
             {"frame_id", "", "of all messages of ROS: the antenna's frame",
              frame_id.empty() ? "the link's name" : ""},
             frame_id);
  visit_streams(
      v,
      {"streams", "",
       "FORMAT=ADDRESS, one or several, as of canyon simulate --stream: nmea=tcp://127.0.0.1:10110; "
       "of a node of ROS 2 rtcm=topic:NAME publishes rtcm_msgs/Message"},
      o.streams);
  v.section("pose", [&] {
    if (of_pose) of_pose();
    v.number({"timeout_s", "s",
              "of the host's time since the last pose from outside came; without truth there is no epoch"},
             o.pose_timeout_s, {1e-3, 1e6});
  });
}

}  // namespace canyon::live
