#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "canyon/analysis/heatmap/cells/cell_solver.hpp"
#include "canyon/analysis/heatmap/engine/tile_store.hpp"
#include "canyon/analysis/heatmap/kernels/grid.hpp"
#include "canyon/analysis/heatmap/kernels/layers.hpp"
#include "canyon/analysis/heatmap/kernels/tile_tracer.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/fwd.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"

namespace canyon::heatmap {

/// A map to compute, checked and complete.
struct Request {
  Grid grid;
  std::optional<Area> area;
  std::vector<double> altitudes_m{15};  ///< ascending, at least one; within 100 km
  AltitudeKind altitude_kind = AltitudeKind::AboveTerrain;
  std::vector<geodesy::GpsTime> times;           ///< ascending, at least one
  std::vector<Layer> layers = default_layers();  ///< at least one, each once
  MonteCarloOptions samples;
  CellReceiverOptions receivers;
  LimitOptions limits;
  simulation::MapOptions motion{simulation::Motion::Stationary};
  /// Throws InputError for empty, unordered, repeated or not finite values.
  void validate() const;
};
/// Visits its fields, all of which a store's key depends on.
void visit(options::Visitor& v, Request& o);

struct MapRunOptions {
  int threads = 0;                          ///< 0: as many as cores; at most that
  const std::atomic<bool>* stop = nullptr;  ///< polled between the times and altitudes of a unit
  /// Cells done (counted for each altitude and time, also those of resumed units) and their total. With
  /// several processes the total is this process's equal part, until it has done more. Called from any
  /// thread, but one call at a time, in order: at the beginning, at the end, and at most ten times a second
  /// between.
  std::function<void(std::size_t, std::size_t)> progress;
  /// Several processes may compute one store. This is their number; `next` returns the next index in their
  /// common queue of missing units (WorkQueue). All processes must have the same queue: each calls
  /// begin_queue() once before the run, and none starts before the last has built it
  /// (MpiProcesses::begin_queue()).
  int processes = 1;
  std::function<void()> begin_queue;
  std::function<std::size_t()> next;
};

struct MapRunResult {
  std::size_t units = 0;                  ///< in all
  std::size_t computed = 0, resumed = 0;  ///< by this process; found in the store, by all
  bool interrupted = false;               ///< the run ended with units of this process missing
  double wall_s = 0;
  std::size_t cells_computed = 0;  ///< in this run, for each altitude and time, of finished units
};

/// A request over a scenario's environment. Const, thread-safe.
class Heatmap {
 public:
  /// Maximum bytes of a unit's values, and of the values of one time if they are more (else InputError).
  static constexpr std::size_t kUnitBytes = std::size_t{32} << 20, kMaxBytesATime = std::size_t{256} << 20;

  /// Accepts any propagation model and receiver: cells omit what cell_method() allows, otherwise each runs a
  /// receiver::Receiver (slow). Throws InputError for options that do not validate().
  /// Motion::Auto is resolved: receivers in steady state with a position filter move, unless their position
  /// is fixed. InputError if motion is requested for another receiver.
  /// @param environment must outlive it, and has no movable instances
  /// @param input_key identifies city and sky for the store's key (files and options)
  /// @param base at a fixed position, for layers of RTK (InputError if such a layer has no base); null: none
  Heatmap(const simulation::Environment& environment, simulation::ReceiverConfig receiver, Request request,
          std::string input_key, const simulation::ReceiverConfig* base = nullptr);
  ~Heatmap();
  Heatmap(Heatmap&&) noexcept;

  /// The request with resolved motion.
  [[nodiscard]] const Request& request() const;
  /// Work units: a tile with a chunk of times, tile by tile; at least 256 if tiles times times are as many.
  [[nodiscard]] std::size_t unit_count() const;
  struct Unit {
    Tile tile;
    std::size_t first_time = 0, times = 0;
  };
  /// @param i below unit_count() (asserted)
  [[nodiscard]] Unit unit(std::size_t i) const;
  [[nodiscard]] std::size_t unit_of(std::size_t tile, std::size_t time) const;
  /// Hash of all inputs: request, receiver, propagation, `input_key`, division into units. 32 hex digits.
  [[nodiscard]] std::string key() const;

  /// Values of one unit; the same on any thread and rank, and inside any task arena.
  [[nodiscard]] TileValues compute(std::size_t unit) const;
  /// Computes the units that `store` lacks, in order; of several processes each computes its part. Ends
  /// early, with all finished units saved, when `stop` is set. Throws InputError for options out of range, a
  /// damaged unit, and a full disk.
  MapRunResult run(TileStore& store, const MapRunOptions& options = {}) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// All inputs of a map's values except the city, the sky and the program, one "name: value" a line; numbers
/// are written so that they are read back exactly. Options come from their lists of fields.
/// @param base of layers of RTK; null: none
[[nodiscard]] std::string canonical_text(const Request& request, const simulation::ReceiverConfig& receiver,
                                         const std::map<gnss::System, gnss::Klobuchar>& klobuchar,
                                         const simulation::ReceiverConfig* base = nullptr);

/// 128 bits of a text in 32 hexadecimal digits: two FNV-1a hashes, of the text and of the text after a word.
/// Not secure against deliberate collisions.
[[nodiscard]] std::string hash_text(const std::string& text);

}  // namespace canyon::heatmap
