#pragma once

#include "canyon/base/input_error.hpp"
#include "canyon/base/input_files.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/node.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/receiver_runner.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "python/src/binding.hpp"

namespace canyon::python {

/// A tree of settings from Python: dict, list, tuple, array, str, bool, int, float, datetime, path, None.
/// Throws InputError with the key's path for NaN and for other objects.
[[nodiscard]] options::Node tree_of(py::handle object, const std::string& path = "");
/// Converts a tree to Python objects: words that are numbers or booleans in YAML are converted. @param words
/// keeps words, so that tree_of() returns the same tree
[[nodiscard]] py::object object_of(const options::Node& tree, bool words = false);
/// `base` overridden by `over`: mappings key by key, anything else replaced.
void merge(options::Node& base, const options::Node& over);

/// A document whose errors name file and line if a text has them, else the key's full path.
[[nodiscard]] options::Document document_of(const std::filesystem::path& file, const std::string& kind,
                                            const options::Description& description);
/// Reads a tree into a struct, by the struct's list of fields. @param file relative file names are in its
/// folder
template <typename Options>
Options read_tree(const options::Node& tree, const std::string& kind,
                  const std::filesystem::path& file = {}) {
  static const options::Description description = options::describe<Options>();
  Options result;
  options::read(tree, document_of(file, kind, description), result);
  return result;
}

/// A scenario with its source tree, to which changes are applied.
struct ScenarioTree {
  InputFiles inputs;
  options::Node tree;
  std::filesystem::path file;  ///< empty: made in Python
  simulation::Scenario scenario;

  ScenarioTree(options::Node settings, std::filesystem::path from);
};
using ScenarioPtr = std::shared_ptr<ScenarioTree>;
/// A Scenario unchanged, or made from a file's name, YAML text of several lines, or a dict.
[[nodiscard]] ScenarioPtr scenario_of(const py::object& object);

/// "2026-06-01T08:00:00Z", datetime, datetime64 (UTC) or integer nanoseconds of GPS time.
[[nodiscard]] geodesy::GpsTime time_of(py::handle object);
/// The same for one or several.
[[nodiscard]] std::vector<geodesy::GpsTime> times_of(const py::object& object);
/// Nanoseconds of UTC since 1970, as in numpy.datetime64[ns].
[[nodiscard]] std::int64_t unix_ns(geodesy::GpsTime t);
/// numpy.datetime64[ns] arrays of such times.
[[nodiscard]] py::object datetimes(std::vector<std::int64_t>&& unix_ns);
[[nodiscard]] py::object datetime(geodesy::GpsTime t);
/// (latitude_deg, longitude_deg, height_m)
[[nodiscard]] geodesy::Geodetic position_of(const py::object& object, const char* what);

/// A sky with the satellites that it may have.
struct SkyHandle {
  simulation::BuiltSky built;
  std::vector<gnss::SatelliteId> satellites;
  /// Its source.
  options::Node settings;
  std::filesystem::path folder;
  geodesy::GpsTime begin, end;
  geodesy::Geodetic seen_from;
};
using SkyPtr = std::shared_ptr<SkyHandle>;

/// Warns of the losses and guesses in a report, once each. @param said warnings that the caller already got
void warn_of(const ReadReport& report, const ReadReport& logged = {});

/// An object of the engine with the files read for it, which its own outputs must not replace.
template <typename T>
struct WithInputs : T {
  using T::T;
  InputFiles inputs;
};
/// The files of an object made as WithInputs.
template <typename T>
InputFiles& inputs_of(T& object) {
  return static_cast<WithInputs<T>&>(object).inputs;
}

/// The city of `load`, a WithInputs, called without the interpreter's lock. Warns of losses and guesses.
template <typename Load>
std::shared_ptr<simulation::CityScene> scene_of(const Load& load) {
  std::shared_ptr<simulation::CityScene> scene;
  {
    const py::gil_scoped_release release;
    InputFiles read;
    const InputFiles::Scope scope(read);
    scene = std::make_shared<WithInputs<simulation::CityScene>>(load());
    inputs_of(*scene).add(read);
  }
  warn_of(scene->city.notes);
  return scene;
}

}  // namespace canyon::python
