#include <fmt/format.h>

#include <thread>

#include "canyon/analysis/heatmap/engine/map_request.hpp"
#include "canyon/analysis/heatmap/engine/map_source.hpp"
#include "canyon/analysis/heatmap/files/geotiff_writer.hpp"
#include "canyon/analysis/heatmap/files/netcdf_writer.hpp"
#include "canyon/analysis/heatmap/pictures/map_pictures.hpp"
#include "canyon/analysis/validation/comparison.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/run_plan.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/simulation/sky_builder.hpp"
#include "python/src/binding.hpp"
#include "python/src/settings.hpp"

namespace canyon::python {
namespace {

/// A map with all data needed by its writers.
class Map {
 public:
  Map(const py::object& scenario, std::shared_ptr<simulation::CityScene> city, const py::object& box,
      double spacing_m, std::vector<double> altitudes_m, const std::string& altitude_kind,
      const py::object& times, const std::vector<std::string>& layers, const std::string& model,
      const std::string& receiver, int sample_count, const std::string& receivers, double path_nodes_m,
      const py::dict& limits)
      : tree_(scenario_of(scenario)), scenario_(tree_->scenario), city_(std::move(city)) {
    inputs_.add(tree_->inputs);
    const InputFiles::Scope scope(inputs_);
    receiver_ = scenario_.receivers[simulation::find_receiver(scenario_, receiver)];
    if (!model.empty()) receiver_ = validation::models_of(receiver_, {model}).front().receiver;
    request_.altitude_kind = heatmap::altitude_kind_named(altitude_kind, "altitude_kind");
    if (altitudes_m.empty()) altitudes_m = {heatmap::usual_altitude_m(scenario_, request_.altitude_kind)};
    std::sort(altitudes_m.begin(), altitudes_m.end());
    request_.altitudes_m = std::move(altitudes_m);
    ReadReport path_report;
    const bool text = times.is_none() || py::isinstance<py::str>(times);
    request_.times = text ? heatmap::parse_times(times.is_none() ? "" : times.cast<std::string>(),
                                                 simulation::first_instant(scenario_, path_report))
                          : times_of(times);
    warn_of(path_report);
    request_.layers = heatmap::layers_named({layers.begin(), layers.end()});
    request_.samples = {sample_count, scenario_.seed};
    request_.receivers = read_tree<heatmap::CellReceiverOptions>(
        tree_of(py::dict("model"_a = receivers, "path_nodes_m"_a = path_nodes_m)), "receivers of a map");
    request_.limits = read_tree<heatmap::LimitOptions>(tree_of(limits), "limits of a map");
    request_.motion = scenario_.map;
    std::optional<heatmap::EnuBox> area;
    if (!box.is_none()) {
      const py::array_t<double> sides = py::array_t<double>::ensure(box);
      if (!sides || sides.ndim() != 1 || sides.shape(0) != 4) {
        PyErr_Clear();
        throw InputError("the box is not four numbers", "give (west_m, south_m, east_m, north_m)");
      }
      area = {{sides.at(0), sides.at(1)}, {sides.at(2), sides.at(3)}};
    }
    if (!city_) {
      // Complete, or around the box: the scenario's own trajectory may be in another area.
      simulation::CityConfig config = scenario_.city;
      if (area && config.origin) {
        const geodesy::LocalFrame frame(*config.origin);
        config = simulation::city_config(scenario_, heatmap::degrees_around(*area, frame));
      }
      city_ =
          scene_of([&] { return simulation::draw_city(simulation::load_city_source(config), scenario_); });
    }
    inputs_.add(inputs_of(*city_));
    const py::gil_scoped_release release;
    if (area)
      heatmap::check_box(*area, city_->city);
    else
      area = heatmap::built_box(city_->city);
    request_.grid =
        heatmap::Grid::covering(area->min.x(), area->min.y(), area->max.x(), area->max.y(), spacing_m);
    // Receivers that run take milliseconds per cell: Ctrl-C must not wait for 65,536 of them. Others use the
    // command's tiles, with the same results.
    if (receiver_.options.signal.enabled && request_.receivers.model == heatmap::ReceiverModel::Run)
      request_.grid.tile_size = 16;
    heatmap::check_altitudes(request_, city_->city);
    request_.validate();
    if (heatmap::value_count(request_) > kMaxValues) {
      throw InputError(
          fmt::format("the map has {:.3g} values", heatmap::value_count(request_)),
          fmt::format("use a larger spacing (at most {:.0g} values in memory), or `canyon heatmap`",
                      kMaxValues));
    }
    sky_ = simulation::build_sky(scenario_.sky, request_.times.front(), request_.times.back(),
                                 city_->city.frame.origin());
    if (receiver_.options.ionosphere || receiver_.options.fix.correct_ionosphere)
      simulation::require_ionosphere(sky_);
    simulation::require_satellites(*sky_.sky, request_.times);
    environment_ = std::make_unique<simulation::Environment>(
        simulation::make_environment(city_, sky_, scenario_.sky, scenario_.seed));
    const auto base = simulation::base_of(scenario_.receivers, receiver_);
    heatmap_ = std::make_unique<heatmap::Heatmap>(*environment_, receiver_, request_,
                                                  heatmap::input_key(*environment_, request_.times),
                                                  base ? &*base : nullptr);
    const py::gil_scoped_acquire acquired;
    warn_of(sky_.report);
  }

  /// Computes into a store in `folder`, from which a later call continues. False: interrupted.
  bool run(const std::string& folder, int threads) {
    store_ = std::make_unique<heatmap::TileStore>(folder, heatmap_->key(), "a map of Python's");
    const FolderLock lock(folder);
    // Progress is reported from any thread, Python's handlers run in this one, which waits during the work.
    Signals signals;
    std::atomic<bool> done{false};
    std::exception_ptr failure;
    heatmap::MapRunOptions options;
    options.threads = threads;
    options.stop = signals.stop();
    std::thread worker([&] {
      try {
        result_ = heatmap_->run(*store_, options);
      } catch (...) {
        failure = std::current_exception();
      }
      done = true;
    });
    {
      const py::gil_scoped_release release;
      while (!done) {
        (void)signals.interrupted();
        std::this_thread::sleep_for(std::chrono::milliseconds(2));
      }
      worker.join();
    }
    if (failure) std::rethrow_exception(failure);
    return !signals.take_interrupt();
  }

  /// (layers by name: (time, altitude, row, column), state: (altitude, row, column))
  [[nodiscard]] py::dict values() const {
    const heatmap::Grid& grid = request_.grid;
    const std::size_t times = request_.times.size(), altitudes = request_.altitudes_m.size(),
                      cells = grid.cells();
    std::vector<std::vector<float>> layers(request_.layers.size(),
                                           std::vector<float>(times * altitudes * cells, std::nanf("")));
    std::vector<std::uint8_t> state(altitudes * cells, 255);
    for (std::size_t u = 0; u < heatmap_->unit_count(); ++u) {
      const auto found = store_->load(u);
      if (!found) continue;
      const heatmap::Tile tile = heatmap_->unit(u).tile;
      const std::size_t n = tile.cells();
      for (std::size_t a = 0; a < altitudes; ++a) {
        for (std::size_t c = 0; c < n; ++c) {
          const std::size_t cell =
              (tile.first_row + c / tile.columns) * grid.columns + tile.first_column + c % tile.columns;
          state[a * cells + cell] = static_cast<std::uint8_t>(found->state[a * n + c]);
          for (std::size_t l = 0; l < layers.size(); ++l) {
            for (std::size_t t = 0; t < found->times; ++t) {
              layers[l][((found->first_time + t) * altitudes + a) * cells + cell] =
                  found->values[((l * found->times + t) * altitudes + a) * n + c];
            }
          }
        }
      }
    }
    const auto rows = static_cast<py::ssize_t>(grid.rows), columns = static_cast<py::ssize_t>(grid.columns);
    const auto size = [](std::size_t n) { return static_cast<py::ssize_t>(n); };
    py::dict named, units;
    for (std::size_t l = 0; l < layers.size(); ++l) {
      const heatmap::LayerInfo& info = heatmap::info(request_.layers[l]);
      named[py::str(std::string(info.name))] =
          owning_array(std::move(layers[l]), {size(times), size(altitudes), rows, columns});
      units[py::str(std::string(info.name))] =
          py::make_tuple(std::string(info.unit), std::string(info.long_name));
    }
    std::vector<double> east, north;
    for (std::uint32_t i = 0; i < grid.columns; ++i) east.push_back(grid.centre(i, 0).x());
    for (std::uint32_t i = 0; i < grid.rows; ++i) north.push_back(grid.centre(0, i).y());
    std::vector<std::int64_t> instants;
    for (const geodesy::GpsTime t : request_.times) instants.push_back(unix_ns(t));
    return py::dict("layers"_a = named, "about"_a = units,
                    "state"_a = owning_array(std::move(state), {size(altitudes), rows, columns}),
                    "east_m"_a = owning_array(std::move(east)), "north_m"_a = owning_array(std::move(north)),
                    "time"_a = datetimes(std::move(instants)), "altitude_m"_a = request_.altitudes_m,
                    "cells_computed"_a = result_.cells_computed, "wall_s"_a = result_.wall_s);
  }

  void write(const std::string& path, const std::string& format) const {
    const InputFiles::Scope scope(inputs_);
    std::optional<ResultFiles> files;
    if (format != "netcdf") files.emplace(path, "heatmap");
    heatmap::MapSource source = heatmap::map_source(*heatmap_, *store_, *environment_, receiver_, scenario_);
    source.history = "import canyon";
    source.source = "Canyon " CANYON_VERSION;
    if (format == "netcdf")
      heatmap::write_netcdf(path, source);
    else if (format == "geotiff")
      (void)heatmap::write_geotiffs(path, source);
    else if (format == "png")
      (void)heatmap::write_map_pictures(path, source, city_->city);
    else
      throw InputError(fmt::format("the format '{}' is not known", format), "give netcdf, geotiff or png");
  }

 private:
  static constexpr double kMaxValues = 5e8;
  mutable InputFiles inputs_;
  ScenarioPtr tree_;
  simulation::Scenario scenario_;
  std::shared_ptr<simulation::CityScene> city_;
  simulation::ReceiverConfig receiver_;
  heatmap::Request request_;
  simulation::BuiltSky sky_;
  std::unique_ptr<simulation::Environment> environment_;
  std::unique_ptr<heatmap::Heatmap> heatmap_;
  std::unique_ptr<heatmap::TileStore> store_;
  heatmap::MapRunResult result_;
};

}  // namespace

void bind_heatmap(py::module_& m) {
  py::class_<Map>(m, "Map", "A heat map in Python, and its writers.")
      .def(py::init<const py::object&, std::shared_ptr<simulation::CityScene>, const py::object&, double,
                    std::vector<double>, const std::string&, const py::object&,
                    const std::vector<std::string>&, const std::string&, const std::string&, int,
                    const std::string&, double, const py::dict&>(),
           "scenario"_a, "city"_a, "box"_a, "spacing_m"_a, "altitudes_m"_a, "altitude_kind"_a, "times"_a,
           "layers"_a, "model"_a, "receiver"_a, "draws"_a, "receivers"_a, "path_nodes_m"_a, "limits"_a)
      .def("run", &Map::run, "folder"_a, "threads"_a = 0)
      .def("values", &Map::values)
      .def("write", &Map::write, "path"_a, "format"_a);
  m.def(
      "map_layers",
      [] {
        py::dict layers;
        for (const heatmap::LayerInfo& info : heatmap::all_layers()) {
          layers[py::str(std::string(info.name))] =
              py::make_tuple(std::string(info.unit), std::string(info.long_name));
        }
        return layers;
      },
      "Available layers of maps: name to (unit, meaning).");
}

}  // namespace canyon::python
