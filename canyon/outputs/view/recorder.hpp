#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/outputs/encoding/epoch_rows.hpp"
#include "canyon/outputs/encoding/view_tables.hpp"
#include "canyon/outputs/view/header.hpp"
#include "canyon/outputs/view/view_sink.hpp"

namespace canyon::view {

/// A row of the table "skylines" at a point in the city's frame [m, east north up]: encoding::kSkylineSectors
/// bytes from north clockwise, half degrees of the highest hidden elevation.
[[nodiscard]] std::string skyline_bytes(const raytrace::RayScene& scene, const Eigen::Vector3d& antenna_enu);

/// The skyline of an antenna that moves.
class MovingSkyline {
 public:
  /// @param step_m minimum movement of the antenna for a new skyline [m]; >= 0
  explicit MovingSkyline(double step_m = 3) : step_m_(step_m) {}

  /// Moves to a point of the city's frame; true if the skyline is a new one.
  bool move(const raytrace::RayScene& scene, const Eigen::Vector3d& antenna_enu);
  /// As skyline_bytes(); empty before the first move().
  [[nodiscard]] const std::string& bytes() const { return bytes_; }

 private:
  double step_m_;
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero();
  std::string bytes_;
};

/// The files of one receiver of a view: blocks of its satellites and paths when full, and all of its epochs
/// at the end. `scene` must outlive it.
class Recorder {
 public:
  /// @param words that receivers of a view share
  Recorder(std::filesystem::path folder, std::size_t receiver, const ViewOptions& options,
           const tracking::SignalOptions& signal, const raytrace::RayScene& scene,
           std::shared_ptr<encoding::ViewWords> words)
      : folder_(std::move(folder)),
        receiver_(receiver),
        epochs_per_block_(options.epochs_per_block),
        scene_(scene),
        rows_(signal, options.paths_per_satellite, std::move(words)),
        skyline_(options.skyline_step_m) {}

  /// Takes the rows of the next epoch. end_epoch() follows.
  [[nodiscard]] encoding::EpochRows& rows() { return rows_; }
  /// The next epoch's number.
  [[nodiscard]] std::size_t epoch() const { return epochs_; }
  /// The row of its skyline: the last one, or a new one after enough movement. @param antenna in the city's
  /// frame [m]
  [[nodiscard]] int skyline(const Eigen::Vector3d& antenna) {
    if (skyline_.move(scene_, antenna)) skylines_.add_bytes(skyline_.bytes());
    return static_cast<int>(skylines_.size()) - 1;
  }
  /// @param faults active, @param time_s since the view's beginning
  void end_epoch(const std::vector<std::string>& faults, double time_s);
  /// Writes the remaining rows to files, and adds its receiver and all chunks to the header.
  void finish(ViewHeader& header);

 private:
  void finish_block();
  void put(const std::vector<const encoding::ViewRows*>& tables, ChunkEntry entry);

  std::filesystem::path folder_;
  std::size_t receiver_, epochs_per_block_;
  const raytrace::RayScene& scene_;
  encoding::EpochRows rows_;
  MovingSkyline skyline_;
  encoding::ViewRows skylines_{encoding::kViewSkylines};
  std::vector<FaultStretch> faults_;
  std::vector<ChunkEntry> chunks_;
  std::size_t epochs_ = 0, block_begin_ = 0;
  std::optional<double> last_time_s_;
};

}  // namespace canyon::view
