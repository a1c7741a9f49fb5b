#include <fmt/format.h>

#include <algorithm>
#include <complex>
#include <functional>

#include "canyon/base/input_error.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/outputs/drawing/views/pictures.hpp"
#include "canyon/outputs/encoding/sensor_arrays.hpp"
#include "canyon/outputs/encoding/sinks.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/samples/correlation_record.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/sensor_run.hpp"
#include "canyon/simulation/simulator.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "canyon/sky/rinex/navigation_writer.hpp"
#include "python/src/binding.hpp"
#include "python/src/epochs.hpp"
#include "python/src/models.hpp"
#include "python/src/settings.hpp"
#include "python/src/stream.hpp"

namespace canyon::python {
namespace {

using simulation::Simulation;
using SimulationPtr = std::shared_ptr<Simulation>;

/// Calls a function at each epoch.
class EachEpoch final : public simulation::EpochSink {
 public:
  explicit EachEpoch(std::function<void(const simulation::Epoch&)> take) : take_(std::move(take)) {}
  void write(const simulation::Epoch& epoch) override { take_(epoch); }
  void finish() override {}

 private:
  std::function<void(const simulation::Epoch&)> take_;
};

/// Lets Python's signal handlers run between epochs.
EachEpoch watch_of(Signals& signals) {
  return EachEpoch([&signals](const simulation::Epoch&) { (void)signals.interrupted(); });
}

py::dict summary_of(const encoding::RunSummary& summary) {
  py::dict metrics("receiver"_a = summary.receiver);
  for (const encoding::SummaryMetric& metric : encoding::summary_metrics()) {
    const double value = metric.value(summary);
    metrics[metric.name] = metric.is_count() ? py::object(py::int_(static_cast<std::int64_t>(value)))
                                             : py::object(py::float_(value));
  }
  return metrics;
}

std::vector<std::string> names_of(const Simulation& simulation) {
  return simulation::receiver_names(simulation.scenario().receivers);
}

/// A whole run: (epochs by receiver, result). Ctrl-C ends it early, with the finished epochs.
py::dict run(const SimulationPtr& simulation, int threads, bool with_paths,
             const std::optional<std::filesystem::path>& folder) {
  std::vector<EpochPtr> kept;
  EachEpoch keeper([&](const simulation::Epoch& epoch) {
    kept.push_back(KeptEpoch::copy(epoch, with_paths, simulation));
  });
  encoding::SummarySink metrics(names_of(*simulation));
  Signals signals;
  EachEpoch watch = watch_of(signals);
  std::vector<simulation::EpochSink*> sinks{&keeper, &metrics, &watch};
  std::optional<ResultFiles> results;
  std::vector<std::unique_ptr<simulation::EpochSink>> files;
  simulation::RunResult result;
  {
    const py::gil_scoped_release release;
    const InputFiles::Scope scope(inputs_of(*simulation));
    if (folder) {
      results.emplace(*folder, "simulate");
      ResultFiles::refuse(*folder / "report.txt");
      files = encoding::make_file_sinks(*simulation, *folder);
      for (std::size_t i = 0;
           i < simulation->scenario().receivers.size() && simulation->scenario().outputs.has("pictures");
           ++i) {
        files.push_back(drawing::make_pictures(
            *simulation, encoding::receiver_folder(*simulation, *folder, i), i, signals.stop()));
      }
    }
    for (const auto& file : files) sinks.push_back(file.get());
    simulation::RunOptions options;
    options.threads = threads;
    options.stop = signals.stop();
    result = simulation->run(sinks, options);
  }
  std::vector<std::vector<EpochPtr>> epochs(simulation->scenario().receivers.size());
  for (EpochPtr& epoch : kept) epochs[epoch->epoch.receiver].push_back(std::move(epoch));
  std::vector<py::dict> summaries;
  for (const encoding::RunSummary& each : metrics.summaries()) summaries.push_back(summary_of(each));
  ReadReport report = simulation->report();
  report.add_line(ReadReport::Level::Guess, result.warnings);
  warn_of(report, simulation->report());
  if (results) {
    report.write(*folder);
    (void)results->finish();
  }
  return py::dict("epochs"_a = epochs, "summaries"_a = summaries, "warnings"_a = report.warnings(),
                  "interrupted"_a = signals.take_interrupt(), "wall_s"_a = result.wall_s);
}

std::unique_ptr<Stream<EpochPtr>> stream(const SimulationPtr& simulation, int threads, bool with_paths) {
  simulation::RunOptions options;
  options.threads = threads;
  options.block = 64;  // the first epoch must not wait for many others
  constexpr std::size_t kMaxWaiting = 256;
  return std::make_unique<Stream<EpochPtr>>(
      simulation, options, kMaxWaiting, [&](Stream<EpochPtr>::Push push) {
        return std::make_unique<EachEpoch>(
            [simulation, with_paths, push = std::move(push)](const simulation::Epoch& epoch) {
              push(KeptEpoch::copy(epoch, with_paths, simulation));
            });
      });
}

/// A run without stored epochs: {"time_s": [time], "delay_m": [delay], "values": [time, delay],
/// "measured_m": [time]}.
py::dict correlation(const SimulationPtr& simulation, const std::string& satellite, const std::string& signal,
                     std::size_t receiver, const std::vector<double>& delays_m,
                     const std::optional<double>& bandwidth_hz, int threads) {
  const auto id = gnss::parse_satellite(satellite);
  if (!id) {
    throw InputError(fmt::format("'{}' is not a satellite", satellite), "use a name such as G05, E11, C23");
  }
  samples::CorrelationRecord::Options what;
  what.receiver = receiver;
  what.satellite = *id;
  what.signal = signal;
  what.delays_m = delays_m;
  if (bandwidth_hz) what.bandwidth_hz = *bandwidth_hz;
  samples::CorrelationRecord record(*simulation, what);
  (void)interruptible([&](Signals& signals) {
    EachEpoch watch = watch_of(signals);
    simulation::RunOptions options;
    options.threads = threads;
    options.stop = signals.stop();
    return simulation->run({&record, &watch}, options);
  });
  const samples::CorrelationSeries& series = record.series();
  std::vector<double> times_s, measured_m;
  std::vector<std::complex<double>> values;
  for (const auto& instant : series.instants) {
    times_s.push_back(instant.time_s);
    measured_m.push_back(instant.measured_m);
    values.insert(values.end(), instant.values.begin(), instant.values.end());
  }
  const auto rows = static_cast<py::ssize_t>(times_s.size());
  const auto columns = static_cast<py::ssize_t>(series.delays_m.size());
  return py::dict("time_s"_a = owning_array(std::move(times_s)),
                  "delay_m"_a = owning_array(std::vector<double>(series.delays_m)),
                  "values"_a = owning_array(std::move(values), {rows, columns}),
                  "measured_m"_a = owning_array(std::move(measured_m)));
}

/// The arrays of one of the scenario's sensors over the run.
py::dict sensor_arrays(const SimulationPtr& simulation, const std::string& sensor) {
  encoding::SensorArrays samples(simulation->scenario().sensors, simulation->begin());
  const auto is_sensor_array = [&](const encoding::SensorArray& array) { return array.sensor == sensor; };
  if (std::none_of(samples.arrays().begin(), samples.arrays().end(), is_sensor_array)) {
    throw InputError(fmt::format("the scenario has no sensors.{}", sensor),
                     fmt::format("add sensors: {{{}: {{}}}}", sensor));
  }
  (void)interruptible([&](Signals& signals) {
    simulation::SensorRun run = simulation->sensors();
    for (std::size_t k = 0; k < simulation->epoch_count(); ++k) {
      signals.compute_look_angles();
      samples.add(run.until(simulation->begin() + static_cast<double>(k) * simulation->interval_s()));
    }
    return true;
  });
  py::dict result;
  for (encoding::SensorArray& array : samples.arrays()) {
    if (!is_sensor_array(array)) continue;
    const auto rows = static_cast<py::ssize_t>(array.values.size() / array.columns);
    const auto columns = static_cast<py::ssize_t>(array.columns);
    result[array.name.c_str()] = columns == 1 ? py::object(owning_array(std::move(array.values)))
                                              : owning_array(std::move(array.values), {rows, columns});
  }
  return result;
}

void write(const SimulationPtr& simulation, std::size_t receiver, const std::vector<EpochPtr>& epochs,
           const std::filesystem::path& path, const std::string& format) {
  const py::gil_scoped_release release;
  const InputFiles::Scope scope(inputs_of(*simulation));
  if (format == "navigation" || (format.empty() && path.extension() == ".nav")) {
    rinex::write_rinex_navigation(path, simulation->navigation());
    return;
  }
  write_epochs(path, format, encoding::describe_receiver(*simulation, receiver), epochs);
}

}  // namespace

void bind_simulation(py::module_& m) {
  py::class_<Simulation, SimulationPtr>(
      m, "Simulation",
      "The engine's part of :class:`canyon.Simulation`: methods with an underscore serve its functions.")
      .def(py::init([](const ScenarioTree& tree, const std::shared_ptr<simulation::CityScene>& city,
                       const py::object& models) {
             if (!tree.scenario.trajectory.file && tree.scenario.trajectory.waypoints.empty())
               throw InputError(tree.file, 0, "'trajectory' is missing",
                                "add trajectory: {file: ...}, waypoints or position");
             simulation::Scenario scenario = tree.scenario;
             put_models(models, scenario.receivers);
             InputFiles read;
             read.add(tree.inputs);
             if (city) read.add(inputs_of(*city));
             SimulationPtr made;
             {
               const InputFiles::Scope scope(read);
               const py::gil_scoped_release release;
               auto scene = city;
               if (!scene)
                 scene = std::make_shared<WithInputs<simulation::CityScene>>(simulation::load_city(scenario));
               made = std::make_shared<WithInputs<Simulation>>(std::move(scenario), std::move(scene));
               inputs_of(*made).add(read);
             }
             warn_of(made->report(), city ? city->city.notes : ReadReport());
             return made;
           }),
           "scenario"_a, "city"_a = nullptr, "models"_a = py::none())
      .def("__len__", &Simulation::epoch_count)
      .def_property_readonly("interval_s", &Simulation::interval_s, "float: Interval of epochs [s].")
      .def_property_readonly(
          "begin", [](const Simulation& self) { return datetime(self.begin()); },
          "numpy.datetime64: The first epoch, UTC.")
      .def_property_readonly("warnings", &Simulation::warnings, "list of str: Warnings before the run.")
      .def_property_readonly("receivers", &names_of, "list of str: Names.")
      .def(
          "antenna",
          [](const Simulation& self, const py::object& times, std::size_t receiver) {
            std::vector<double> points;
            for (const geodesy::GpsTime t : times_of(times)) {
              const Eigen::Vector3d p = self.environment().city().frame.local_from_geodetic(
                  self.antenna_pose(receiver, t).position);
              points.insert(points.end(), {p.x(), p.y(), p.z()});
            }
            const auto rows = static_cast<py::ssize_t>(points.size() / 3);
            return owning_array(std::move(points), {rows, 3});
          },
          "times"_a, "receiver"_a = 0,
          "Positions of a receiver's antenna at times: east, north, up [m], (n, 3).")
      .def("_run", &run, "threads"_a, "paths"_a, "folder"_a)
      .def("_correlation", &correlation, "satellite"_a, "signal"_a, "receiver"_a, "delays_m"_a,
           "bandwidth_hz"_a, "threads"_a)
      .def("_sensor", &sensor_arrays, "sensor"_a)
      .def("_write", &write, "receiver"_a, "epochs"_a, "path"_a, "format"_a)
      .def(
          "encoder",
          [](const SimulationPtr& self, const std::string& format, std::size_t receiver) {
            return std::make_unique<EpochEncoder>(format, encoding::describe_receiver(*self, receiver));
          },
          "format"_a, "receiver"_a = 0,
          "Encodes epochs to bytes: `begin()`, `encode(epoch)` of each, `end()`. See :func:`canyon.formats`.")
      .def("stream", &stream, "threads"_a = 0, "paths"_a = false,
           R"(Epochs of all receivers, one by one, by time and then by receiver, while the engine works ahead.

Leaving the loop ends the run. Every call begins anew.)")
      .def("__iter__", [](const SimulationPtr& self) { return stream(self, 0, false); });
  using EpochStream = Stream<EpochPtr>;
  py::class_<EpochStream>(m, "Stream", "Epochs of a run, one by one.")
      .def(
          "__iter__", [](EpochStream& self) -> EpochStream& { return self; },
          py::return_value_policy::reference_internal)
      .def("__next__", &EpochStream::next)
      .def("close", &EpochStream::close, "Ends the run.");
  m.def("table", &table_of, "epochs"_a, "name"_a);
}

}  // namespace canyon::python
