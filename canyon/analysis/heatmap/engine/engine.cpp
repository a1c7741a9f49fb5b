#include "canyon/analysis/heatmap/engine/engine.hpp"

#include <fmt/format.h>
#include <tbb/task_arena.h>
#include <algorithm>
#include <cassert>
#include <chrono>
#include <exception>
#include <limits>
#include <mutex>
#include <set>
#include <utility>

#include "canyon/analysis/heatmap/kernels/tile_tasks.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/progress.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/work_queue.hpp"
#include "canyon/city/city.hpp"
#include "canyon/receiver/random_streams.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/ordered_blocks.hpp"
#include "canyon/simulation/receiver_surroundings.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::heatmap {

namespace {

using Clock = std::chrono::steady_clock;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();
/// Part of the key: incremented when the same request gives other values than before.
constexpr int kValuesVersion = 3;
/// This many units keep threads and ranks busy, and a killed run loses few results.
constexpr std::size_t kManyUnits = 256;

template <class Values, class Less>
bool is_ascending(const Values& values, const Less& less) {
  return std::adjacent_find(values.begin(), values.end(),
                            [&](const auto& a, const auto& b) { return !less(a, b); }) == values.end();
}

FirstSignal first_signal_of(const receiver::ReceiverOptions& options) {
  return [options](gnss::SatelliteId id, geodesy::GpsTime time) -> const gnss::Signal* {
    std::vector<const gnss::Signal*> tracked;
    receiver::signals_to_track(options, id, time, tracked);
    return tracked.empty() ? nullptr : tracked.front();
  };
}

}  // namespace

void Request::validate() const {
  options::check(*this, "map");
  if (area) area->validate();
  if (altitudes_m.empty()) throw InputError("the map has no altitude", "give at least one");
  if (!is_ascending(altitudes_m, std::less<>()))
    throw InputError("the map's altitudes are not ascending", "give each once, the lowest first");
  if (times.empty()) throw InputError("the map has no time", "give at least one");
  if (!is_ascending(times, std::less<>()))
    throw InputError("the map's times are not ascending", "give each once, the earliest first");
  limits.validate();
  if (layers.empty()) throw InputError("the map has no layer", "give at least one");
  std::set<Layer> once;
  for (const Layer layer : layers)
    if (!once.insert(layer).second)
      throw InputError(fmt::format("the layer {} is given twice", info(layer).name), "give each once");
}

void visit(options::Visitor& v, Request& o) {
  static constexpr std::string_view kAltitudeKinds[]{"terrain", "ellipsoid"};
  v.part("grid", o.grid);
  if (o.area) {
    v.list("area", o.area->rings, [&v](std::vector<Eigen::Vector2d>& ring) {
      v.list("ring", ring, [&v](Eigen::Vector2d& corner) {
        v.number({"east_m", "m", ""}, corner.x(), {});
        v.number({"north_m", "m", ""}, corner.y(), {});
      });
    });
  }
  v.numbers({"altitudes_m", "m", "of the antenna"}, o.altitudes_m, {-100e3, 100e3});
  v.choice({"altitude_kind", "", "above the terrain, or above the WGS 84 ellipsoid"}, o.altitude_kind,
           kAltitudeKinds);
  v.list("times", o.times, [&v](geodesy::GpsTime& time) {
    auto ns = static_cast<std::uint64_t>(time.nanoseconds());
    v.integer({"gps_ns", "ns", ""}, ns);
    if (v.reads()) time = geodesy::GpsTime::from_nanoseconds(static_cast<std::int64_t>(ns));
  });
  v.list("layers", o.layers, [&v](Layer& layer) {
    std::string name(info(layer).name);
    v.text({"layer", "", ""}, name);
    if (v.reads()) layer = layer_by_name(name);
  });
  v.part("draws", o.samples);
  v.part("receivers", o.receivers);
  v.part("limits", o.limits);
  visit(v, o.motion);
}

struct Heatmap::Impl {
  const simulation::Environment* environment;
  simulation::ReceiverConfig receiver;
  Request request;
  std::string input_key;
  std::optional<simulation::ReceiverConfig> base;  ///< for layers of RTK
  positioning::PositionFilterOptions filter;       ///< of a moving receiver
  TileTracer tracer;
  std::vector<std::unique_ptr<const CellSolver>> solvers;
  std::optional<std::size_t> sky_view;  ///< its index in the layers
  std::size_t tiles = 0, times_per_unit = 1, chunks = 1;

  Impl(const simulation::Environment& e, simulation::ReceiverConfig r,
       std::optional<simulation::ReceiverConfig> b, Request q, std::string k,
       const positioning::PositionFilterOptions& f)
      : environment(&e),
        receiver(std::move(r)),
        request(std::move(q)),
        input_key(std::move(k)),
        base(std::move(b)),
        filter(f),
        tracer(e, receiver.propagation, receiver.options.fix.elevation_mask_rad,
               first_signal_of(receiver.options)) {
    std::optional<Movement> movement;
    if (request.motion.moves()) movement = {request.motion, filter};
    solvers = cell_solvers(
        e, tracer,
        {receiver, base ? &*base : nullptr, request.samples, request.receivers, request.limits, movement},
        request.layers);
    const auto found = std::find(request.layers.begin(), request.layers.end(), Layer::SkyView);
    if (found != request.layers.end()) sky_view = static_cast<std::size_t>(found - request.layers.begin());
    cut();
  }

  void cut() {
    tiles = request.grid.tile_count();
    const std::size_t cells = std::size_t{std::min(request.grid.tile_size, request.grid.columns)} *
                              std::min(request.grid.tile_size, request.grid.rows);
    const std::size_t bytes = request.layers.size() * request.altitudes_m.size() * cells * sizeof(float);
    if (bytes > kMaxBytesATime) {
      throw InputError(fmt::format("{} layers at {} altitudes are too many for tiles of {} cells",
                                   request.layers.size(), request.altitudes_m.size(), cells),
                       "give fewer altitudes, or compute them in several maps");
    }
    const std::size_t count = request.times.size();
    const std::size_t by_memory = std::max<std::size_t>(1, kUnitBytes / bytes);
    const std::size_t by_number = std::max<std::size_t>(1, tiles * count / kManyUnits);
    times_per_unit = std::min({by_memory, by_number, count});
    chunks = (count + times_per_unit - 1) / times_per_unit;
  }

  [[nodiscard]] Heatmap::Unit unit(std::size_t i) const {
    assert(i < tiles * chunks);
    Unit unit;
    unit.tile = request.grid.tile(i / chunks);
    unit.first_time = i % chunks * times_per_unit;
    unit.times = std::min(times_per_unit, request.times.size() - unit.first_time);
    return unit;
  }

  [[nodiscard]] std::size_t slices(const Unit& unit) const {
    return unit.tile.cells() * request.altitudes_m.size() * unit.times;
  }
  struct Missing {
    std::vector<std::size_t> units;
    std::size_t cells = 0, cells_stored = 0;
  };

  /// Units missing in a store, in order; number of cells of these and of the others.
  [[nodiscard]] Missing missing_in(const TileStore& store) const {
    Missing missing;
    for (std::size_t i = 0; i < tiles * chunks; ++i) {
      const bool stored = store.has(i);
      (stored ? missing.cells_stored : missing.cells) += slices(unit(i));
      if (!stored) missing.units.push_back(i);
    }
    return missing;
  }

  [[nodiscard]] std::optional<TileValues> compute(const Unit& unit, const std::atomic<bool>* stop,
                                                  const std::atomic<bool>* failed, Progress* progress) const {
    const std::size_t count = unit.tile.cells(), altitudes = request.altitudes_m.size();
    TileValues result;
    result.first_time = unit.first_time;
    result.times = unit.times;
    result.values.assign(request.layers.size() * unit.times * altitudes * count, kNan);
    result.state.resize(altitudes * count);
    std::size_t slices_done = 0;
    const auto stopped = [&] {
      return (stop != nullptr && stop->load()) || (failed != nullptr && failed->load());
    };
    const auto go_on = [&] {
      ++slices_done;
      if (progress != nullptr) progress->add(count);
      return !stopped();
    };
    for (std::size_t a = 0; a < altitudes; ++a) {
      const TileCells cells = tracer.cells(request.grid, unit.tile, request.area ? &*request.area : nullptr,
                                           request.altitudes_m[a], request.altitude_kind);
      std::copy(cells.state.begin(), cells.state.end(),
                result.state.begin() + static_cast<std::ptrdiff_t>(a * count));
      compute_altitude(unit, a, cells, stopped, go_on, result);
      if (slices_done < (a + 1) * unit.times) return std::nullopt;
    }
    return result;
  }

  /// Computes all times of a unit at one altitude. Ends early if `go_on`, called after each finished time,
  /// returns false, and within a time if `stopped` returns true.
  void compute_altitude(const Unit& unit, std::size_t altitude, const TileCells& cells,
                        const std::function<bool()>& stopped, const std::function<bool()>& go_on,
                        TileValues& result) const {
    const std::size_t count = unit.tile.cells(), altitudes = request.altitudes_m.size();
    const auto slice = [&](std::size_t layer, std::size_t time) {
      const std::size_t first = ((layer * unit.times + time) * altitudes + altitude) * count;
      return std::span(result.values).subspan(first, count);
    };
    if (sky_view) {
      const std::span<float> first = slice(*sky_view, 0);
      tracer.sky_view(cells, first);
      for (std::size_t t = 1; t < unit.times; ++t)
        std::copy(first.begin(), first.end(), slice(*sky_view, t).begin());
    }
    std::vector<std::span<float>> layers(request.layers.size());
    for (std::size_t t = 0; t < unit.times; ++t) {
      const geodesy::GpsTime time = request.times[unit.first_time + t];
      for (std::size_t k = 0; k < layers.size(); ++k) layers[k] = slice(k, t);
      for (const std::unique_ptr<const CellSolver>& solver : solvers)
        if (!solver->solve(cells, time, request.layers, layers, stopped)) return;
      if (!go_on()) return;
    }
  }
};

namespace {

/// The request is checked before it is used.
Request checked(Request request, const simulation::ReceiverConfig& receiver) {
  request.validate();
  receiver.options.validate();
  receiver.propagation.validate();
  return request;
}

/// If the lowest altitude above the terrain is below this, a receiver drives [m].
constexpr double kDriven_m = 5;

/// Resolves Motion::Auto. @param receiver stationary in a cell @param filtered whether it has a filter
void choose_motion(Request& request, const simulation::ReceiverConfig& receiver, bool filtered) {
  simulation::Motion& motion = request.motion.motion;
  const bool can_move = filtered && request.receivers.model == ReceiverModel::SteadyState &&
                        cell_method(receiver) == CellMethod::Steady;
  if (request.motion.moves() && !can_move) {
    throw InputError(fmt::format("the receiver '{}' of the map cannot move: {}", receiver.options.name,
                                 filtered ? "it is run in each cell" : "it has no position filter"),
                     "give --motion standing, or a receiver with position_filter: {enabled: true} whose "
                     "steady state is computed");
  }
  if (motion != simulation::Motion::Auto) return;
  const bool low =
      request.altitude_kind == AltitudeKind::AboveTerrain && request.altitudes_m.front() < kDriven_m;
  motion = !can_move || receiver.fixed ? simulation::Motion::Stationary
           : low                       ? simulation::Motion::Driving
                                       : simulation::Motion::Flying;
}

}  // namespace

Heatmap::Heatmap(const simulation::Environment& environment, simulation::ReceiverConfig receiver,
                 Request request, std::string input_key, const simulation::ReceiverConfig* base_of_receiver) {
  std::optional<simulation::ReceiverConfig> base;
  if (base_of_receiver != nullptr) base = *base_of_receiver;
  request = checked(std::move(request), receiver);
  const auto base_measurements = std::find_if(request.layers.begin(), request.layers.end(), is_rtk_layer);
  if (base_measurements == request.layers.end()) {
    base.reset();
  } else if (!base || !base->fixed || !receiver.options.rtk.enabled || !receiver.options.signal.enabled) {
    throw InputError(
        fmt::format("the layer {} needs a receiver with RTK and its base", info(*base_measurements).name),
        "give the receiver rtk: true and corrections: {from: NAME}, NAME a receiver with a fixed position, "
        "as in examples/rtk.yaml");
  }
  if (receiver.models) {
    throw InputError("a heat map does not support a program's own weights and positions",
                     "run the receiver at positions of interest instead");
  }
  receiver.options = simulation::with_surroundings(receiver, environment.scene(), environment.city(), {});
  simulation::decide_options(receiver.options, environment.errors().get(), &environment.sky());
  // Each cell is computed without a previous epoch; MovingFixes joins them.
  const positioning::PositionFilterOptions filter = std::exchange(receiver.options.filter, {});
  positioning::Weighting& weighting = receiver.options.fix.weights.weighting;
  if (weighting == positioning::Weighting::Cn0 && !receiver.options.signal.enabled)
    weighting = positioning::Weighting::Equal;  // signals without C/N0 have equal weights
  choose_motion(request, receiver, filter.enabled);
  if (base) {
    base->fixed->resolve(environment.city().frame);
    base->options = simulation::with_surroundings(*base, environment.scene(), environment.city(), {});
    simulation::decide_options(base->options, environment.errors().get(), &environment.sky());
  }
  impl_ = std::make_unique<Impl>(environment, std::move(receiver), std::move(base), std::move(request),
                                 std::move(input_key), filter);
}
Heatmap::~Heatmap() = default;
Heatmap::Heatmap(Heatmap&&) noexcept = default;

const Request& Heatmap::request() const {
  return impl_->request;
}
std::size_t Heatmap::unit_count() const {
  return impl_->tiles * impl_->chunks;
}
Heatmap::Unit Heatmap::unit(std::size_t i) const {
  return impl_->unit(i);
}
std::size_t Heatmap::unit_of(std::size_t tile, std::size_t time) const {
  assert(tile < impl_->tiles && time < impl_->request.times.size());
  return tile * impl_->chunks + time / impl_->times_per_unit;
}

std::string Heatmap::key() const {
  return hash_text(
      fmt::format("values: {}\ntimes per unit: {}\ninput: {}\n", kValuesVersion, impl_->times_per_unit,
                  impl_->input_key) +
      canonical_text(impl_->request, impl_->receiver, impl_->environment->klobuchar(),
                     impl_->base ? &*impl_->base : nullptr) +
      (impl_->environment->errors() ? options::exact_text(impl_->environment->errors()->options()) : "") +
      (impl_->request.motion.moves() ? options::exact_text(impl_->filter) : ""));
}

TileValues Heatmap::compute(std::size_t unit) const {
  return impl_->compute(impl_->unit(unit), nullptr, nullptr, nullptr).value();
}

MapRunResult Heatmap::run(TileStore& store, const MapRunOptions& options) const {
  const Impl& impl = *impl_;
  const Clock::time_point started = Clock::now();
  simulation::check_threads(options.threads);
  assert(options.processes >= 1 && (options.processes == 1 || options.next));

  const Impl::Missing missing = impl.missing_in(store);
  MapRunResult result;
  result.units = unit_count();
  result.resumed = result.units - missing.units.size();
  if (options.begin_queue) options.begin_queue();
  const auto processes = static_cast<std::size_t>(options.processes);
  Progress progress(options.progress, (missing.cells + missing.cells_stored) / processes);  // of this process
  progress.add(missing.cells_stored / processes);
  progress.report();

  WorkQueue queue(options.next);
  std::atomic<std::size_t> computed{0}, cells_computed{0};
  std::atomic<bool> failed{false}, cut_short{false};
  std::mutex failing;
  std::exception_ptr failure;
  // Units are started in order, by whichever task is first. There are as many tasks as units: one of several
  // processes may compute them all.
  const auto one = [&] {
    if (failed.load() || (options.stop != nullptr && options.stop->load())) {
      cut_short = true;
      return;
    }
    try {
      const std::size_t k = queue.take();
      if (k >= missing.units.size()) return;
      const Unit unit = impl.unit(missing.units[k]);
      const auto values = impl.compute(unit, options.stop, &failed, &progress);
      if (!values) {
        cut_short = true;
        return;
      }
      store.save(missing.units[k], *values);
      computed.fetch_add(1);
      cells_computed.fetch_add(impl.slices(unit));
    } catch (...) {
      const std::lock_guard lock(failing);
      if (!failure) failure = std::current_exception();
      failed.store(true);
    }
  };
  tbb::task_arena arena(options.threads == 0 ? static_cast<int>(tbb::task_arena::automatic)
                                             : options.threads);
  arena.execute([&] { spread(missing.units.size(), [&](std::size_t) { one(); }); });
  if (failure) std::rethrow_exception(failure);

  progress.report();
  result.computed = computed.load();
  result.cells_computed = cells_computed.load();
  result.interrupted = cut_short.load();
  result.wall_s = std::chrono::duration<double>(Clock::now() - started).count();
  return result;
}

std::string canonical_text(const Request& request, const simulation::ReceiverConfig& receiver,
                           const std::map<gnss::System, gnss::Klobuchar>& klobuchar,
                           const simulation::ReceiverConfig* base) {
  std::string text = options::exact_text(request) + fmt::format("receiver: {}\n", receiver.options.name);
  if (receiver.streets.enabled) text += "streets: " + options::exact_text(receiver.streets);
  for (const disturbance::DisturbanceSource& source : receiver.disturbances)
    text += fmt::format("disturbance: {}\n", source.name);
  for (const auto& [system, coefficients] : klobuchar) {
    text += fmt::format("klobuchar of {}: {}, {}\n", gnss::name(system), fmt::join(coefficients.alpha, " "),
                        fmt::join(coefficients.beta, " "));
  }
  text += options::exact_text(receiver.propagation) + options::exact_text(receiver.options);
  if (base != nullptr) {
    const geodesy::Geodetic& position = base->fixed->position;
    text +=
        fmt::format("base at {} {} {}\n", position.latitude_rad, position.longitude_rad, position.height_m) +
        options::exact_text(base->propagation) + options::exact_text(base->options);
  }
  return text;
}

std::string hash_text(const std::string& text) {
  return fmt::format("{:016x}{:016x}", fnv1a(text), fnv1a("heat map\n" + text));
}

}  // namespace canyon::heatmap
