#pragma once

#include <Eigen/Core>
#include <chrono>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/outputs/view/server.hpp"
#include "canyon/run/run_checks.hpp"
#include "canyon/run/simulator.hpp"

namespace canyon::view {

/// Positions from elsewhere, such as an estimator's; shown as a receiver beside the first one's truth.
struct OtherTrack {
  std::string name;
  /// Where it is at a time [m, ECEF]; empty: nowhere.
  std::function<std::optional<Eigen::Vector3d>(geodesy::GpsTime)> place_ecef;
};

struct ViewOptions {
  /// At most so many paths are kept for each satellite: the first (the direct one where there is one) and the
  /// strongest, without strength the shortest. [1, 1000]
  std::size_t paths_per_satellite = 12;
  /// Epochs of a receiver that share a file. [1, 100,000]
  std::size_t epochs_per_block = 64;
  /// A skyline is shown until the antenna has moved by more than this [m]; >= 0.
  double skyline_step_m = 3;
  /// The header is written at once as that of a live view, for pages that RunRelay shows the run to while it
  /// is computed; at the end the whole one takes its place.
  bool watched = false;
  std::vector<OtherTrack> tracks;
};

/// Writes a run as "canyon view 1" into `folder`, which is made where needed (docs/view-format.md): the city
/// at once, blocks as they fill, the rest at the end. Only the epochs' own rows are held in memory, 250 bytes
/// each. `simulation` must outlive it. Throws InputError where the folder does not take the files.
[[nodiscard]] std::unique_ptr<simulation::EpochSink> make_view(const simulation::Simulation& simulation,
                                                               const std::filesystem::path& folder,
                                                               ViewOptions options = {});

/// Throws InputError, saying what differs, where the view in `folder` cannot be of a run of `simulation`:
/// other walls, receivers, times or satellites.
void check_run(const std::filesystem::path& folder, const simulation::Simulation& simulation);

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
