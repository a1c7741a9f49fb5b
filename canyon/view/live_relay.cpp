#include "canyon/view/live_relay.hpp"

#include <fmt/format.h>
#include <poll.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <string_view>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/output/view_messages.hpp"
#include "canyon/transport/readers.hpp"
#include "canyon/transport/transport.hpp"
#include "canyon/view/skyline.hpp"

namespace canyon::view {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::size_t kLongestLine = std::size_t{4} << 20;
constexpr int kWait_ms = 20;
/// Where the antenna has moved by less since the last skyline, that one holds [m]; as ViewOptions has it.
constexpr double kSkylineStep_m = 3;

/// Where a host listens, this one connects.
std::string reader_of(const std::string& address) {
  constexpr std::string_view kServer = "tcp://";
  if (std::string_view(address).substr(0, kServer.size()) != kServer) return address;
  return "tcp-connect://" + address.substr(kServer.size());
}

Eigen::Vector3d place_of(const Json& message) {
  const Json& place = message.at("place");
  const auto axis = [&](const char* key) {
    const Json& value = place.at(key);
    return value.is_null() ? std::nan("") : value.get<double>();
  };
  return {axis("east_m"), axis("north_m"), axis("up_m")};
}

}  // namespace

struct LiveRelay::Impl {
  Impl(const std::string& address, Header about, std::filesystem::path at, const raytrace::RayScene& rays)
      : header(std::move(about)),
        folder(std::move(at)),
        scene(rays),
        transport(transport::open_transport(reader_of(address))) {
    header.live = true;
    write_header(header, folder);
  }

  void hear(Server& server, std::string_view line) {
    try {
      Json message = Json::parse(line);
      if (message.at("version") != output::kViewMessages) {
        return complain("the host speaks another version of the viewer's messages");
      }
      if (message.at("type") == "hello") {
        take_hello(server, message, std::string(line));
      } else if (message.at("type") == "epoch" && !hello.empty()) {
        take_epoch(server, message);
      }
    } catch (const Json::exception&) {
      complain("what comes there is not the stream 'view'");
    }
  }

  void take_hello(Server& server, const Json& message, std::string line) {
    Header told = header;
    told.begin =
        geodesy::GpsTime::from_week(message.at("gps_week").get<int>(), message.at("gps_tow").get<double>());
    told.interval_s = message.at("interval_s").get<double>();
    told.receivers.clear();
    for (const Json& receiver : message.at("receivers")) {
      ReceiverHeader& one = told.receivers.emplace_back();
      one.name = receiver.at("name").get<std::string>();
      one.strength = receiver.at("strength").get<bool>();
      one.elevation_mask_deg = receiver.at("elevation_mask_deg").get<double>();
    }
    header = std::move(told);
    write_header(header, folder);
    skyline_place.reset();
    hello = std::move(line);
    server.greet({hello});
    server.send(hello);
  }

  void take_epoch(Server& server, Json& message) {
    const Eigen::Vector3d place = place_of(message);
    if (place.allFinite()) {
      if (!skyline_place || !((place - *skyline_place).norm() < kSkylineStep_m)) {
        skyline_place = place;
        skyline = Json::array();
        for (const char half_degrees : skyline_bytes(scene, place)) {
          skyline.push_back(static_cast<unsigned char>(half_degrees));
        }
      }
      message["skyline"] = skyline;
    }
    const std::string text = message.dump(-1, ' ', false, Json::error_handler_t::replace);
    server.greet({hello, text});
    server.send(text);
  }

  void complain(const char* what) {
    if (complaint != what) notes.emplace_back(what);
    complaint = what;
  }

  Header header;
  std::filesystem::path folder;
  const raytrace::RayScene& scene;
  std::unique_ptr<transport::Transport> transport;
  transport::LineCutter lines{kLongestLine};
  std::string hello;
  std::optional<Eigen::Vector3d> skyline_place;
  Json skyline;
  std::string complaint;
  std::vector<std::string> notes;
};

LiveRelay::LiveRelay(const std::string& address, Header header, std::filesystem::path folder,
                     const raytrace::RayScene& scene)
    : impl_(std::make_unique<Impl>(address, std::move(header), std::move(folder), scene)) {}
LiveRelay::~LiveRelay() = default;

void LiveRelay::serve(Server& server) {
  Impl& impl = *impl_;
  impl.transport->serve();
  bool any = false;
  for (const transport::Heard& heard : impl.transport->take_heard()) {
    any = true;
    impl.lines.hear(heard.bytes, [&](const std::optional<std::string_view>& line) {
      if (line) impl.hear(server, *line);
    });
  }
  if (any) return;
  std::vector<int> handles;
  impl.transport->add_handles(handles);
  std::vector<pollfd> polled;
  polled.reserve(handles.size());
  for (const int handle : handles) polled.push_back({handle, POLLIN, 0});
  poll(polled.data(), polled.size(), kWait_ms);
}

std::vector<std::string> LiveRelay::take_notes() {
  for (std::string& note : impl_->transport->take_notes()) impl_->notes.push_back(std::move(note));
  return std::exchange(impl_->notes, {});
}

}  // namespace canyon::view
