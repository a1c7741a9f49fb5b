#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "canyon/raytrace/ray_scene.hpp"
#include "canyon/view/header.hpp"
#include "canyon/view/server.hpp"

namespace canyon::view {

/// Takes the format "view" of a host that runs (`canyon live`, a simulator's plugin, a ROS node) to pages.
/// The host sends to this alone and waits for nobody; where it is gone it is tried again every second.
class LiveRelay {
 public:
  /// @param address that the host's stream listens at, "tcp://127.0.0.1:PORT", or any other that
  /// transport::open_transport() hears from
  /// @param header of the city; time and receivers are the host's to tell. It is written to `folder` at once
  /// @param scene of the city, for skylines; must outlive it
  /// Throws InputError for what is no address, and where the folder does not take the header.
  LiveRelay(const std::string& address, Header header, std::filesystem::path folder,
            const raytrace::RayScene& scene);
  ~LiveRelay();

  /// Hands on what has come; waits 20 ms at most where nothing has.
  void serve(Server& server);
  /// What there is to say since the last call, one line each.
  [[nodiscard]] std::vector<std::string> take_notes();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::view
