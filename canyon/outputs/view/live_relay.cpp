#include "canyon/outputs/view/live_relay.hpp"

#include <fmt/format.h>

#include <poll.h>
#include <algorithm>
#include <map>
#include <set>
#include <string_view>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/transport/link.hpp"
#include "canyon/base/transport/transport.hpp"
#include "canyon/outputs/encoding/view_messages.hpp"
#include "canyon/outputs/view/recorder.hpp"

namespace canyon::view {
namespace {

constexpr std::size_t kMaxLine = std::size_t{4} << 20;
constexpr int kWait_ms = 20;

/// Connects to a host's listening address.
std::string reader_of(const std::string& address) {
  constexpr std::string_view kServer = "tcp://";
  if (std::string_view(address).substr(0, kServer.size()) != kServer) return address;
  return "tcp-connect://" + address.substr(kServer.size());
}

/// Throws JsonError for a number that is not within bounds.
double bounded(const Json& json, const char* key, double low, double high) {
  const auto value = json.at(key).get<double>();
  if (!(value >= low && value <= high)) throw JsonError(fmt::format("'{}' is {}", key, value));
  return value;
}

Eigen::Vector3d position_of(const Json& message) {
  constexpr double kFarthest_m = 1e7;
  const Json& position = message.at("place");
  const auto axis = [&](const char* key) {
    return position.at(key).is_null() ? std::nan("") : bounded(position, key, -kFarthest_m, kFarthest_m);
  };
  return {axis("east_m"), axis("north_m"), axis("up_m")};
}

/// The address of a running receiver.
struct Host {
  std::string address;
  std::unique_ptr<transport::Transport> transport;
  transport::LineCutter lines{kMaxLine};
  Json hello;                                ///< its last "hello"; null: none yet
  geodesy::GpsTime begin;                    ///< sent by this host
  std::map<std::string, std::string> names;  ///< of its receivers on the page
  std::string complaint;
};

}  // namespace

struct LiveRelay::Impl {
  Impl(std::span<const std::string> addresses, ViewHeader about, std::filesystem::path at,
       const raytrace::RayScene& rays)
      : header(std::move(about)), folder(std::move(at)), scene(rays) {
    for (const std::string& address : addresses) {
      if (std::count(addresses.begin(), addresses.end(), address) > 1) {
        throw InputError(fmt::format("{} is given twice", address),
                         "give the stream of each receiver its own address");
      }
      Host& host = hosts.emplace_back();
      host.address = address;
      host.transport = transport::open_transport(reader_of(address));
    }
    header.live = true;
    write_header(header, folder);
  }

  void receive(Server& server, Host& host, std::string_view line) {
    try {
      Json message = Json::parse(line);
      if (message.at("version") != encoding::kViewMessages)
        return complain(host, "the host uses another version of the viewer's messages");
      if (message.at("type") == "hello")
        take_hello(server, host, std::move(message));
      else if (message.at("type") == "epoch" && !host.hello.is_null())
        take_epoch(server, host, message);
    } catch (const JsonError&) {
      complain(host, "the data are not the stream 'view'");
    }
  }

  /// Merges all receivers of all hosts into one "hello"; times count from the beginning of the first host's.
  void take_hello(Server& server, Host& from, Json message) {
    const auto begin = geodesy::GpsTime::from_week(static_cast<int>(bounded(message, "gps_week", 0, 9999)),
                                                   bounded(message, "gps_tow", 0, 604800));
    ViewHeader merged = header;
    merged.begin.reset();
    merged.receivers.clear();
    Json all;
    std::set<std::string> taken;
    std::vector<std::map<std::string, std::string>> names;
    for (const Host& host : hosts) {
      const Json& logged = &host == &from ? message : host.hello;
      names.emplace_back();
      if (logged.is_null()) continue;
      if (!merged.begin) {
        merged.begin = &host == &from ? begin : host.begin;
        merged.interval_s = bounded(logged, "interval_s", 1e-4, 86400);
        all = logged;
        all["receivers"] = Json::array();
      }
      for (const Json& receiver : logged.at("receivers")) {
        ReceiverHeader& one = merged.receivers.emplace_back();
        const auto name = receiver.at("name").get<std::string>();
        one.name =
            taken.insert(name).second ? name : fmt::format("{} ({})", name, hide_passwords(host.address));
        one.strength = receiver.at("strength").get<bool>();
        one.elevation_mask_deg = bounded(receiver, "elevation_mask_deg", -90, 90);
        names.back()[name] = one.name;
        all["receivers"].push_back(receiver);
        all["receivers"].back()["name"] = one.name;
      }
    }
    header = std::move(merged);
    write_header(header, folder);
    header_changed = true;
    for (std::size_t i = 0; i < hosts.size(); ++i) hosts[i].names = std::move(names[i]);
    from.begin = begin;
    from.hello = std::move(message);
    for (const auto& [name, shown] : from.names) skylines.erase(shown);
    newest.clear();
    hello = all.dump();
    server.greet({hello});
    server.send(hello);
  }

  void take_epoch(Server& server, const Host& host, Json& message) {
    const auto name = host.names.find(message.at("receiver").get<std::string>());
    if (name == host.names.end()) return;
    const Eigen::Vector3d point = position_of(message);
    message["receiver"] = name->second;
    message["time_s"] = bounded(message, "time_s", -1e9, 1e9) + (host.begin - *header.begin);
    if (point.allFinite()) {
      MovingSkyline& skyline = skylines[name->second];
      skyline.move(scene, point);
      message["skyline"] = std::vector<unsigned char>(skyline.bytes().begin(), skyline.bytes().end());
    }
    newest[name->second] = message.dump();
    std::vector<std::string> greeting{hello};
    for (const auto& [receiver, epoch] : newest) greeting.push_back(epoch);
    server.greet(std::move(greeting));
    server.send(newest[name->second]);
  }

  void complain(Host& host, const char* what) {
    if (host.complaint != what) notes.push_back(hide_passwords(fmt::format("{}: {}", host.address, what)));
    host.complaint = what;
  }

  ViewHeader header;
  std::filesystem::path folder;
  const raytrace::RayScene& scene;
  std::vector<Host> hosts;
  std::string hello;  ///< of all; empty: none yet
  bool header_changed = false;
  /// By the receivers' names on the page.
  std::map<std::string, std::string> newest;
  std::map<std::string, MovingSkyline> skylines;
  std::vector<std::string> notes;
};

LiveRelay::LiveRelay(std::span<const std::string> addresses, ViewHeader header, std::filesystem::path folder,
                     const raytrace::RayScene& scene)
    : impl_(std::make_unique<Impl>(addresses, std::move(header), std::move(folder), scene)) {}
LiveRelay::~LiveRelay() = default;

void LiveRelay::serve(Server& server) {
  Impl& impl = *impl_;
  bool any = false;
  for (Host& host : impl.hosts) {
    host.transport->serve();
    for (const transport::Received& received : host.transport->take_received()) {
      any = true;
      host.lines.receive(received.bytes, [&](const std::optional<std::string_view>& line) {
        if (line) impl.receive(server, host, *line);
      });
    }
  }
  if (any) return;
  std::vector<int> handles;
  for (const Host& host : impl.hosts) host.transport->add_handles(handles);
  std::vector<pollfd> polled;
  polled.reserve(handles.size());
  for (const int handle : handles) polled.push_back({handle, POLLIN, 0});
  poll(polled.data(), polled.size(), kWait_ms);
}

std::optional<ViewHeader> LiveRelay::take_header() {
  if (!std::exchange(impl_->header_changed, false)) return std::nullopt;
  return impl_->header;
}

std::vector<std::string> LiveRelay::take_notes() {
  for (const Host& host : impl_->hosts)
    for (const std::string& note : host.transport->take_notes())
      impl_->notes.push_back(hide_passwords(fmt::format("{}: {}", host.address, note)));
  return std::exchange(impl_->notes, {});
}

}  // namespace canyon::view
