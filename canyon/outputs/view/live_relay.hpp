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

/// Takes the format "view" of hosts that run (`canyon live`, a simulator's plugins, ROS nodes) to pages: each
/// stream is of one receiver, and a page shows them all. A host sends to this alone and waits for nobody;
/// where it is gone it is tried again every second.
class LiveRelay {
 public:
  /// @param addresses that the hosts' streams listen at, "tcp://127.0.0.1:PORT", or any other that
  /// transport::open_transport() receives from. Receivers stand in their order; of equal names the later ones
  /// have their address behind them, and all times count from the begin that the first host tells
  /// @param header of the city; time and receivers are the hosts' to tell. It is written to `folder` at once
  /// @param scene of the city, for skylines; must outlive it
  /// Throws InputError for a text that is not an address, one given twice, and where the folder does not take
  /// the header.
  LiveRelay(std::span<const std::string> addresses, ViewHeader header, std::filesystem::path folder,
            const raytrace::RayScene& scene);
  ~LiveRelay();

  /// Forwards what has arrived; waits 20 ms at most where nothing has.
  void serve(Server& server);
  /// The header of all hosts, where one has begun since the last call.
  [[nodiscard]] std::optional<ViewHeader> take_header();
  /// Messages since the last call, one line each, the address in front.
  [[nodiscard]] std::vector<std::string> take_notes();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::view
