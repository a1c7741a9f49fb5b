#pragma once

#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/heatmap/cell_solver.hpp"
#include "canyon/heatmap/grid.hpp"
#include "canyon/heatmap/layers.hpp"
#include "canyon/heatmap/signals.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario.hpp"

namespace canyon::heatmap {

/// A map to compute, checked and complete.
struct Request {
  Grid grid;
  std::optional<Area> area;
  std::vector<double> altitudes_m{15};
  AltitudeKind altitude_kind = AltitudeKind::AboveTerrain;
  std::vector<geodesy::GpsTime> times;  ///< ascending, at least one
  std::vector<Layer> layers = default_layers();
  DrawOptions draws;
  /// Throws InputError for empty, unordered or not finite values.
  void validate() const;
};

/// Values of one tile: all times (of a chunk) and altitudes. Layout [layer][time][altitude][cell].
struct TileValues {
  std::size_t first_time = 0, times = 0;
  std::vector<float> values;
  std::vector<CellState> state;  ///< [altitude][cell]
};

/// Finished tiles in a folder, each a file written whole, with a checksum. A key (hash of everything that
/// values depend on) stands in the folder's manifest: a foreign or damaged store is refused with an
/// InputError that says how to get rid of it.
class TileStore {
 public:
  /// Opens or makes `folder`. @param key of the request; @param description for people, kept beside it
  TileStore(std::filesystem::path folder, const std::string& key, const std::string& description);
  ~TileStore();

  /// Of a unit of work (tile and chunk of times).
  [[nodiscard]] bool has(
      std::size_t unit) const;  ///< whole and undamaged header; checksums are read by load()
  void save(std::size_t unit, const TileValues& values);
  /// Empty where it is not there; a damaged file is an InputError that names it.
  [[nodiscard]] std::optional<TileValues> load(std::size_t unit) const;
  /// Removes the store with all it holds.
  void remove();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

struct RunOptions {
  int threads = 0;
  const std::atomic<bool>* stop = nullptr;
  /// Cells (times altitudes and times) done, those of resumed units included, and in all. From any thread.
  std::function<void(std::size_t, std::size_t)> progress;
  int rank = 0, ranks = 1;  ///< units of work i with i % ranks == rank are this process's
};

struct RunResult {
  std::size_t units = 0, computed = 0, resumed = 0;
  bool interrupted = false;
  double wall_s = 0;
  std::size_t cells_computed = 0;  ///< in this run
};

/// A request over a scenario's environment.
class Heatmap {
 public:
  /// Any propagation model and receiver: a receiver that CellSolver fits is solved by it, another by a
  /// receiver::Receiver of its own for each cell and draw (slow).
  /// @param sky_key identifies city and sky for the store's key (files and options)
  Heatmap(const simulation::Environment& environment, simulation::ReceiverConfig receiver, Request request,
          std::string input_key);
  ~Heatmap();

  [[nodiscard]] const Request& request() const;
  /// Work is cut into units: a tile with a chunk of times such that a unit's values are at most 32 MiB.
  [[nodiscard]] std::size_t unit_count() const;
  struct Unit {
    Tile tile;
    std::size_t first_time = 0, times = 0;
  };
  [[nodiscard]] Unit unit(std::size_t i) const;
  /// What the store's key is made of.
  [[nodiscard]] std::string key() const;

  /// Values of one unit; thread-safe, the same on any thread and rank.
  [[nodiscard]] TileValues compute(std::size_t unit) const;
  /// Computes what `store` does not have yet.
  RunResult run(TileStore& store, const RunOptions& options = {}) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::heatmap
