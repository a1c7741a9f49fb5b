#pragma once

#include <array>
#include <atomic>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/run/environment.hpp"
#include "canyon/run/scenario/fwd.hpp"
#include "canyon/run/scenario/scenario.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/studies/heatmap/cells/cell_solver.hpp"
#include "canyon/studies/heatmap/engine/tile_store.hpp"
#include "canyon/studies/heatmap/kernels/grid.hpp"
#include "canyon/studies/heatmap/kernels/layers.hpp"
#include "canyon/studies/heatmap/kernels/tile_tracer.hpp"

namespace canyon::heatmap {

/// A map to compute, checked and complete.
struct Request {
  Grid grid;
  std::optional<Area> area;
  std::vector<double> altitudes_m{15};  ///< ascending, at least one; within 100 km
  AltitudeKind altitude_kind = AltitudeKind::AboveTerrain;
  std::vector<geodesy::GpsTime> times;           ///< ascending, at least one
  std::vector<Layer> layers = default_layers();  ///< at least one, each once
  DrawOptions draws;
  CellReceiverOptions receivers;
  LimitOptions limits;
  simulation::MapOptions motion{simulation::Motion::Standing};
  /// Throws InputError for empty, unordered, repeated or not finite values.
  void validate() const;
};
/// Visits its fields, all of which a store's key depends on.
void visit(options::Visitor& v, Request& o);

struct MapRunOptions {
  int threads = 0;                          ///< 0: as many as cores; at most that
  const std::atomic<bool>* stop = nullptr;  ///< looked at between the times and altitudes of a unit
  /// Cells (times altitudes and times) done, those of resumed units included, and in all, of this process's
  /// share (of several an equal one, until it has done more). From any thread, but one call at a time; in
  /// order; at the beginning, at the end, and at most ten times a second between.
  std::function<void(std::size_t, std::size_t)> progress;
  /// Several processes may compute one store. This is their number; `next` gives the next place in their
  /// common queue of missing units (WorkQueue). All processes call begin_queue() once before: each must have
  /// the same queue, so none may begin before the last has made it (MpiProcesses::begin_queue()).
  int processes = 1;
  std::function<void()> begin_queue;
  std::function<std::size_t()> next;
};

struct MapRunResult {
  std::size_t units = 0;                  ///< in all
  std::size_t computed = 0, resumed = 0;  ///< by this process; found there by all
  bool interrupted = false;               ///< units were left that this process should have computed
  double wall_s = 0;
  std::size_t cells_computed = 0;  ///< in this run, times altitudes and times, of finished units
};

/// A request over a scenario's environment. Const, thread-safe.
class Heatmap {
 public:
  /// A unit's values take at most so many bytes, or those of one time where these are more (kMostBytesATime
  /// at most: InputError).
  static constexpr std::size_t kUnitBytes = std::size_t{32} << 20, kMostBytesATime = std::size_t{256} << 20;

  /// Any propagation model and receiver: cells leave out what cell_method() says, and else run a
  /// receiver::Receiver each (slow). Throws InputError for what does not validate().
  /// Motion::Auto becomes one of the others: receivers in steady state with a position filter move, unless
  /// their place is fixed; InputError for another that is asked to.
  /// @param environment must outlive it, and has no movable instances
  /// @param input_key identifies city and sky for the store's key (files and options)
  /// @param base whose corrections the receiver takes in layers of RTK, at a fixed place; InputError where
  /// such a layer has none; null: none
  Heatmap(const simulation::Environment& environment, simulation::ReceiverConfig receiver, Request request,
          std::string input_key, const simulation::ReceiverConfig* base = nullptr);
  ~Heatmap();
  Heatmap(Heatmap&&) noexcept;

  /// The request with the motion chosen.
  [[nodiscard]] const Request& request() const;
  /// Work is cut into units: a tile with a chunk of times, tile by tile. There are at least 256 where tiles
  /// times times are as many.
  [[nodiscard]] std::size_t unit_count() const;
  struct Unit {
    Tile tile;
    std::size_t first_time = 0, times = 0;
  };
  /// @param i below unit_count() (asserted)
  [[nodiscard]] Unit unit(std::size_t i) const;
  /// The unit that contains a time of a tile.
  [[nodiscard]] std::size_t unit_of(std::size_t tile, std::size_t time) const;
  /// Hash of everything that values depend on: request, receiver, propagation, `input_key`, and the cut into
  /// units. 32 hexadecimal digits.
  [[nodiscard]] std::string key() const;

  /// Values of one unit; the same on any thread and rank, and inside any task arena.
  [[nodiscard]] TileValues compute(std::size_t unit) const;
  /// Computes what `store` does not have yet, in order, of several processes what this one takes. Ends
  /// early, with all finished units saved, when `stop` is set; throws InputError for options out of range, a
  /// damaged unit, and a full disk.
  MapRunResult run(TileStore& store, const MapRunOptions& options = {}) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Everything that values of a map depend on but the city, the sky and the program, one "name: value" a line;
/// numbers so that they read back the same. Options come by their lists of fields.
/// @param base of layers of RTK; null: none
[[nodiscard]] std::string canonical_text(const Request& request, const simulation::ReceiverConfig& receiver,
                                         const std::map<gnss::System, gnss::Klobuchar>& klobuchar,
                                         const simulation::ReceiverConfig* base = nullptr);

/// 128 bits of a text in 32 hexadecimal digits: two FNV-1a hashes, of the text and of the text behind a word.
/// Against accidents, not against malice.
[[nodiscard]] std::string hash_text(const std::string& text);

}  // namespace canyon::heatmap
