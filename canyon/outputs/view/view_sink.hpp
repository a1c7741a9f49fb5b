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
#include "canyon/simulation/run_checks.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::view {

/// External positions, such as an estimator's; shown as a receiver with the first receiver's truth.
struct OtherTrack {
  std::string name;
  /// Position at a time [m, ECEF]; empty: none.
  std::function<std::optional<Eigen::Vector3d>(geodesy::GpsTime)> antenna_position_ecef;
};

struct ViewOptions {
  /// Maximum paths stored for each satellite: the first (the direct one if it exists) and the strongest,
  /// without strength the shortest. [1, 1000]
  std::size_t paths_per_satellite = 12;
  /// Epochs of a receiver in one file. [1, 100,000]
  std::size_t epochs_per_block = 64;
  /// A skyline is shown until the antenna has moved by more than this [m]; >= 0.
  double skyline_step_m = 3;
  /// Writes a header of a live view at the start, for pages that show the run by RunRelay while it is
  /// computed; the complete header replaces it at the end.
  bool watched = false;
  std::vector<OtherTrack> tracks;
};

/// Writes a run as "canyon view 1" into `folder`, created if missing (docs/view-format.md): the city at once,
/// blocks when full, the rest at the end. Holds only the rows of epochs in memory, 250 bytes each.
/// `simulation` must outlive it. Throws InputError if the files cannot be written to the folder.
[[nodiscard]] std::unique_ptr<simulation::EpochSink> make_view(const simulation::Simulation& simulation,
                                                               const std::filesystem::path& folder,
                                                               ViewOptions options = {});

/// Throws InputError, naming the difference, if the view in `folder` cannot be of a run of `simulation`:
/// other walls, receivers, times or satellites.
void check_run(const std::filesystem::path& folder, const simulation::Simulation& simulation);

/// Shows a run while it is computed: sends its epochs as a live view's messages. Pages have loaded a header
/// written with ViewOptions::watched. The run never waits for pages; they load missing epochs after its end.
class RunRelay final : public simulation::EpochSink {
 public:
  /// @param paths_per_satellite as ViewOptions has it
  /// @param step minimum real time between two sent instants; >= 0 Both must outlive it.
  RunRelay(const simulation::Simulation& simulation, Server& server, std::size_t paths_per_satellite,
           std::chrono::milliseconds step = std::chrono::milliseconds(20));
  ~RunRelay() override;

  /// Sends the epoch if its instant is due and a page is connected.
  void write(const simulation::Epoch& epoch) override;
  void finish() override {}
  /// For RunOptions::progress.
  void progress(std::size_t done, std::size_t planned);
  /// Call it when the server's folder has the complete view: pages load it.
  void finished();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::view
