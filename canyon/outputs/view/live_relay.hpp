#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/outputs/view/header.hpp"
#include "canyon/outputs/view/server.hpp"

namespace canyon::view {

/// Relays the format "view" of running hosts (`canyon live`, a simulator's plugins, ROS nodes) to pages: each
/// stream is of one receiver, and a page shows all of them. A host sends only to the relay and never waits
/// for a page; a lost host is tried again every second.
class LiveRelay {
 public:
  /// @param addresses of the hosts' listening streams, "tcp://127.0.0.1:PORT", or any other that
  /// transport::open_transport() receives from. Receivers are in this order; repeated names have their
  /// address appended, and all times count from the beginning sent by the first host
  /// @param header of the city; time and receivers come from the hosts. It is written to `folder` at once
  /// @param scene of the city, for skylines; must outlive it Throws InputError for an invalid or repeated
  /// address, and if the header cannot be written to the folder.
  LiveRelay(std::span<const std::string> addresses, ViewHeader header, std::filesystem::path folder,
            const raytrace::RayScene& scene);
  ~LiveRelay();

  /// Forwards received messages; waits at most 20 ms if there are none.
  void serve(Server& server);
  /// The header of all hosts, if one has started since the last call.
  [[nodiscard]] std::optional<ViewHeader> take_header();
  /// Messages since the last call, one line each, each after its address.
  [[nodiscard]] std::vector<std::string> take_notes();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::view
