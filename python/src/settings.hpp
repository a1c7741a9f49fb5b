#pragma once

#include "canyon/base/input_error.hpp"
#include "canyon/base/input_files.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/node.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/run/environment.hpp"
#include "canyon/run/live_receiver.hpp"
#include "canyon/run/scenario/scenario.hpp"
#include "canyon/run/simulator.hpp"
#include "python/src/binding.hpp"

namespace canyon::python {

/// A tree of settings of Python's: dict, list, tuple, array, str, bool, int, float, datetime, path, None.
/// Throws InputError with the key's path for NaN and for other objects.
[[nodiscard]] options::Node tree_of(py::handle object, const std::string& path = "");
/// Turns a tree into Python's objects: words that YAML takes for numbers and booleans become these.
/// @param words they stay words, so that tree_of() gives the same tree
[[nodiscard]] py::object object_of(const options::Node& tree, bool words = false);
/// `over` laid over `base`: mappings key by key, anything else replaced.
void merge(options::Node& base, const options::Node& over);

/// A document whose faults name file and line where a text has them, else the key's whole path.
[[nodiscard]] options::Document document_of(const std::filesystem::path& file, const std::string& kind,
                                            const options::Description& description);
/// A tree into a struct, by the struct's list of fields. @param file to whose folder names of files belong
template <typename Options>
Options read_tree(const options::Node& tree, const std::string& kind,
                  const std::filesystem::path& file = {}) {
  static const options::Description description = options::describe<Options>();
  Options result;
  options::read(tree, document_of(file, kind, description), result);
  return result;
}

/// A scenario with the tree that it was read from, which changes are laid over.
struct ScenarioTree {
  InputFiles inputs;
  options::Node tree;
  std::filesystem::path file;  ///< empty: Python's own
  simulation::Scenario scenario;

  ScenarioTree(options::Node settings, std::filesystem::path from);
};
using ScenarioPtr = std::shared_ptr<ScenarioTree>;
/// A Scenario as it is, or made of a file's name, YAML text of several lines, or a dict.
[[nodiscard]] ScenarioPtr scenario_of(const py::object& object);

/// "2026-06-01T08:00:00Z", datetime, datetime64 (UTC) or integer nanoseconds of GPS time.
[[nodiscard]] geodesy::GpsTime time_of(py::handle object);
/// The same of one or several.
[[nodiscard]] std::vector<geodesy::GpsTime> times_of(const py::object& object);
/// Nanoseconds since 1970 of UTC, as numpy.datetime64[ns] counts.
[[nodiscard]] std::int64_t unix_ns(geodesy::GpsTime t);
/// numpy.datetime64[ns] arrays of such.
[[nodiscard]] py::object datetimes(std::vector<std::int64_t>&& unix_ns);
[[nodiscard]] py::object datetime(geodesy::GpsTime t);
/// (latitude_deg, longitude_deg, height_m)
[[nodiscard]] geodesy::Geodetic place_of(const py::object& object, const char* what);

/// A sky with the satellites that it may answer for.
struct SkyHandle {
  simulation::BuiltSky built;
  std::vector<gnss::SatelliteId> satellites;
  /// What it was made of.
  options::Node settings;
  std::filesystem::path folder;
  geodesy::GpsTime begin, end;
  geodesy::Geodetic seen_from;
};
using SkyPtr = std::shared_ptr<SkyHandle>;

/// Warns of the losses and guesses of a report, once each. @param said of which the caller has been warned
void warn_of(const ReadReport& report, const ReadReport& said = {});

/// An object of the engine with the files that were read for it, which its own outputs may not replace.
template <typename T>
struct WithInputs : T {
  using T::T;
  InputFiles inputs;
};
/// Of one that was made as WithInputs.
template <typename T>
InputFiles& inputs_of(T& object) {
  return static_cast<WithInputs<T>&>(object).inputs;
}

/// The city of `load`, a WithInputs, called without the interpreter's lock. Warns of what was lost and
/// guessed.
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
