#include <fmt/format.h>

#include <cmath>

#include "canyon/analysis/calibration/calibrate.hpp"
#include "canyon/analysis/validation/alignment.hpp"
#include "canyon/analysis/validation/comparison.hpp"
#include "canyon/analysis/validation/metrics.hpp"
#include "canyon/analysis/validation/metrics_text.hpp"
#include "canyon/analysis/validation/recorded_scene.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/profile.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "python/src/binding.hpp"
#include "python/src/settings.hpp"

namespace canyon::python {
namespace {

constexpr std::size_t kMinEpochs = 20;

py::object from_json(const std::string& text) {
  return py::module_::import("json").attr("loads")(text);
}

/// A recording with its scenario: city, sky, truth.
class Recorded {
 public:
  Recorded(const py::object& scenario, const std::filesystem::path& obs,
           const std::optional<std::filesystem::path>& truth, const std::string& truth_format,
           bool atmosphere)
      : scenario_(scenario_of(scenario)->scenario) {
    validation::ListedRecording files;
    files.obs = obs;
    files.truth = truth;
    files.truth_format = truth_format;
    validation::resolve_truth(scenario_, files, "truth");
    {
      const py::gil_scoped_release release;
      scene_ = validation::read_recorded_scene(scenario_, files, atmosphere);
    }
    report_ = scene_.environment->city().notes;
    report_.append(scene_.sky.report);
    for (const auto* more : {&scenario_.warnings, &scene_.recording.warnings})
      report_.add_line(ReadReport::Level::Guess, *more);
    warn_of(report_);
  }

  [[nodiscard]] std::size_t epochs() const { return scene_.recording.residuals.epochs.size(); }
  [[nodiscard]] const ReadReport& report() const { return report_; }
  [[nodiscard]] std::vector<std::string> warnings() const { return report_.warnings(); }

  py::object align(double fraction, bool heading, int threads) {
    const std::size_t count = part(0, fraction).second;
    validation::AlignOptions options;
    options.heading = heading;
    options.threads = threads;
    options.seed = scenario_.seed;
    const std::string text = interruptible([&](Signals& signals) {
      options.progress = [&](std::size_t, std::size_t) { signals.compute_look_angles(); };
      const validation::CityAlignment found =
          validation::align(scene_.recording, *scene_.environment,
                            scenario_.receivers.front().options.fix.elevation_mask_rad, 0, count, options);
      registration_ = found.registration;
      return validation::to_json(found);
    });
    return from_json(text);
  }

  /// Metrics of each model on [from, to) of the epochs, as in `canyon validate --json`.
  [[nodiscard]] py::object validate(const std::pair<double, double>& fractions,
                                    const std::vector<std::string>& keys, int threads) const {
    const auto [first, count] = part(fractions.first, fractions.second);
    std::vector<validation::Model> models;
    const simulation::ReceiverConfig& receiver = scenario_.receivers.front();
    models.push_back({"", fmt::format("{} (the scenario's)", receiver.options.name), receiver});
    for (validation::Model& more : validation::models_of(receiver, keys)) models.push_back(std::move(more));
    const std::string text = interruptible([&, first = first, count = count](Signals& signals) {
      std::vector<validation::ModelMetrics> metrics;
      std::vector<validation::NeverTracked> never;
      validation::CompareOptions options;
      options.threads = threads;
      options.progress = [&](std::size_t, std::size_t) { signals.compute_look_angles(); };
      for (const validation::Model& model : models) {
        options.name = model.name;
        const auto compare = [&] {
          return validation::compare(scene_.recording, model.receiver, *scene_.environment, registration_,
                                     scenario_.seed, options);
        };
        validation::Comparison comparison = compare();
        if (metrics.empty()) {
          never = validation::never_tracked(comparison);
          for (const validation::NeverTracked& s : never) options.leave_out.insert(s.id);
          if (!never.empty()) comparison = compare();
        }
        metrics.push_back(validation::metrics(comparison, first, count,
                                              validation::describe_part(comparison, first, count, "part")));
        metrics.back().never_tracked = never;
        metrics.back().left_out = true;
      }
      return validation::to_json(metrics, std::nullopt);
    });
    return from_json(text);
  }

  /// It must outlive the returned object.
  [[nodiscard]] calibration::Drive drive(double from, double to) {
    const auto [first, count] = part(from, to);
    calibration::Drive d;
    d.name = "recording";
    d.environment = scene_.environment.get();
    d.recording = calibration::part_of(scene_.recording, first, count);
    d.registration = registration_;
    d.receiver = scenario_.receivers.front();
    d.systems = scenario_.sky.systems;
    d.seed = scenario_.seed;
    d.facades = calibration::open_facades(scenario_, [this](const simulation::Scenario& sampled) {
      return redrawn_.draw(scene_.sky, sampled);
    });
    return d;
  }

 private:
  /// First epoch and count of the fractions [from, to) of the recording.
  [[nodiscard]] std::pair<std::size_t, std::size_t> part(double from, double to) const {
    if (!(from >= 0 && from < to && to <= 1)) {
      throw InputError(fmt::format("the part from {} to {} is not a valid part", from, to),
                       "give fractions of the recording, 0 to 1");
    }
    const auto at = [&](double fraction) {
      return static_cast<std::size_t>(std::lround(fraction * static_cast<double>(epochs())));
    };
    const std::size_t count = at(to) - at(from);
    if (count < kMinEpochs) {
      throw InputError(fmt::format("the part has {} epochs of {}", count, epochs()),
                       fmt::format("give at least {}", kMinEpochs));
    }
    return {at(from), count};
  }

  simulation::Scenario scenario_;
  validation::RecordedScene scene_;
  validation::ResampledCity redrawn_;
  validation::Registration registration_;
  ReadReport report_;
};

py::dict calibrate(const std::vector<Recorded*>& recordings, double from, double to, int seeds, int threads) {
  if (recordings.empty()) throw InputError("there is no recording for the calibration", "give at least one");
  std::vector<calibration::Drive> drives;
  drives.reserve(recordings.size());
  for (Recorded* each : recordings) drives.push_back(each->drive(from, to));
  calibration::CalibrateOptions options;
  options.seeds = seeds;
  options.threads = threads;
  const calibration::Calibration result = interruptible([&](Signals& signals) {
    options.progress = [&](const std::string&, std::size_t, std::size_t) { signals.compute_look_angles(); };
    return calibration::calibrate(drives, options);
  });
  simulation::ReceiverConfig receiver = drives.front().receiver;
  receiver.options.name = simulation::ReceiverConfig().options.name;
  calibration::set_values(result.values, receiver);
  calibration::ProfileHead head;
  head.base = "the scenario";
  head.description = "calibrated in Python";
  head.notes = {"Written by canyon " CANYON_VERSION " (Python); docs/methods.md describes it."};
  py::dict city;
  if (const auto fraction = calibration::fitted_glass(result))
    city["facades"] = py::dict("shares"_a = calibration::facade_fractions(*fraction));
  std::vector<calibration::Estimate> city_epoch;
  if (result.coated_glass) city_epoch.push_back(*result.coated_glass);
  return py::dict("estimates"_a = from_json(calibration::to_json(result.estimates)),
                  "city_estimates"_a = from_json(calibration::to_json(city_epoch)), "city"_a = city,
                  "values"_a = result.values, "notes"_a = result.notes,
                  "profile"_a = calibration::profile_text(receiver, result.estimates, head));
}

}  // namespace

void bind_validation(py::module_& m) {
  py::class_<Recorded>(m, "Recording",
                       R"(A recorded drive with its scenario: city, sky, true positions (docs/methods.md).

Parameters
----------
scenario : Scenario, dict or path
obs : path
    Observations: RINEX, or a log of Android's GnssLogger.
truth : path, optional
    True positions; else the scenario's trajectory file.
truth_format : {"csv", "urbannav", "rtklib", "nmea", "gpx", "kml", "gnsslogger"}, optional
    Told by the file's content where it is left out.
atmosphere : bool
    Whether the pseudoranges hold the atmosphere's delays, as those of real receivers do.)")
      .def(py::init<const py::object&, const std::filesystem::path&,
                    const std::optional<std::filesystem::path>&, const std::string&, bool>(),
           "scenario"_a, "obs"_a, "truth"_a = py::none(), "truth_format"_a = "", py::kw_only(),
           "atmosphere"_a = true)
      .def("__len__", &Recorded::epochs)
      .def_property_readonly("warnings", &Recorded::warnings, "list of str: Warnings about the files.")
      .def("align", &Recorded::align, "share"_a = 0.5, "heading"_a = false, "threads"_a = 0,
           R"(Moves the city to where the first `share` of the recording fits it best; later calls use that.

Returns
-------
dict
    Offsets, their standard deviations and scores, as `canyon validate --align --json` has them.)")
      .def("validate", &Recorded::validate, "part"_a = std::pair(0.0, 1.0),
           "models"_a = std::vector<std::string>(), "threads"_a = 0,
           R"(Simulates the receiver at the recorded epochs and compares.

Parameters
----------
part : (float, float)
    Shares of the recording that figures are of.
models : sequence of str
    Further steps of the ladder: "mirror", "specular", ...

Returns
-------
dict
    As `canyon validate --json` writes it.)");
  m.def("calibrate", &calibrate, "recordings"_a, "begin"_a, "end"_a, "seeds"_a, "threads"_a = 0);
}

}  // namespace canyon::python
