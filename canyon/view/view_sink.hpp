#pragma once

#include <filesystem>
#include <map>
#include <memory>
#include <string>

#include "canyon/simulation/simulator.hpp"

namespace canyon::view {

struct ViewOptions {
  /// At most so many paths are kept for each satellite: the first (the direct one where there is one) and the
  /// strongest, without strength the shortest. [1, 1000]
  std::size_t paths_per_satellite = 12;
  /// Epochs of a receiver that share a file. [1, 100,000]
  std::size_t epochs_per_block = 64;
  /// A skyline is shown until the antenna has moved by more than this [m]; >= 0.
  double skyline_step_m = 3;
  /// Sources of buildings' heights, by objects' names.
  std::map<std::string, std::string> height_sources;
  /// The header is written at once as that of a live view, for pages that RunRelay shows the run to while it
  /// is computed; at the end the whole one takes its place.
  bool watched = false;
  /// Throws InputError naming the field and its bound.
  void validate() const;
};

/// Writes a run as "canyon view 1" into `folder`, which is made where needed (docs/view-format.md): the city
/// at once, blocks as they fill, the rest at the end. Only the epochs' own rows are held in memory, 250 bytes
/// each. `simulation` must outlive it. Throws InputError for options that do not validate(), and where the
/// folder does not take the files.
[[nodiscard]] std::unique_ptr<simulation::EpochSink> make_view(const simulation::Simulation& simulation,
                                                               const std::filesystem::path& folder,
                                                               ViewOptions options = {});

/// Throws InputError, saying what differs, where the view in `folder` cannot be of a run of `simulation`:
/// other walls, receivers, times or satellites.
void check_run(const std::filesystem::path& folder, const simulation::Simulation& simulation);

}  // namespace canyon::view
