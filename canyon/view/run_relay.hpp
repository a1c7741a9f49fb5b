#pragma once

#include <chrono>
#include <cstddef>
#include <memory>

#include "canyon/simulation/simulator.hpp"
#include "canyon/view/server.hpp"

namespace canyon::view {

/// Shows a run while it is computed: its epochs go out as a live view's messages. Pages have loaded a header
/// that ViewOptions::watched wrote. The run waits for nobody; what pages lack they load when it has ended.
class RunRelay final : public simulation::EpochSink {
 public:
  /// @param paths_per_satellite as ViewOptions has it
  /// @param step of real time between two instants that are sent; >= 0
  /// Both must outlive it.
  RunRelay(const simulation::Simulation& simulation, Server& server, std::size_t paths_per_satellite,
           std::chrono::milliseconds step = std::chrono::milliseconds(20));
  ~RunRelay() override;

  /// Sends the epoch where its instant is due and a page is connected.
  void write(const simulation::Epoch& epoch) override;
  void finish() override {}
  /// Takes RunOptions::progress.
  void progress(std::size_t done, std::size_t planned);
  /// The server's folder holds the whole view: pages load it.
  void finished();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::view
