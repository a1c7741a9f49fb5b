#include "python/src/settings.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/outputs/encoding/encoder.hpp"
#include "canyon/paths/disturbance/faults/fault.hpp"
#include "canyon/simulation/scenario/profile.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::python {
namespace {

using options::Node;
constexpr int kDeepest = 100;
constexpr std::size_t kMaxBytes = std::size_t{16} << 20;

std::string with(const std::string& path, const std::string& key) {
  return path.empty() ? key : path + "." + key;
}

InputError value_error(const std::string& path, const std::string& problem, const std::string& hint) {
  return InputError(path.empty() ? problem : fmt::format("{}: {}", path, problem), hint);
}

bool is_a(py::handle object, const char* module, const char* name) {
  return py::isinstance(object, py::module_::import(module).attr(name));
}

/// ISO 8601 with its zone; a datetime without a zone is UTC, as in scenarios.
std::string time_text(py::handle object) {
  if (is_a(object, "numpy", "datetime64"))
    return py::str(py::module_::import("numpy").attr("datetime_as_string")(object)).cast<std::string>() + "Z";
  const std::string text = py::str(object.attr("isoformat")()).cast<std::string>();
  return object.attr("tzinfo").is_none() ? text + "Z" : text;
}

Node tree(py::handle object, const std::string& path, int depth) {
  if (depth > kDeepest)
    throw value_error(path, "the settings are too deep", "check for a dict that contains itself");
  if (object.is_none()) return {};
  if (py::isinstance<py::bool_>(object)) return options::scalar_node(object.cast<bool>() ? "true" : "false");
  if (py::isinstance<py::str>(object)) return options::scalar_node(object.cast<std::string>());
  if (py::isinstance<py::int_>(object)) return options::scalar_node(py::str(object).cast<std::string>());
  if (py::isinstance<py::float_>(object)) {
    const double value = object.cast<double>();
    if (std::isnan(value)) throw value_error(path, "NaN is not a value", "give a number, or remove the key");
    return options::scalar_node(options::show(value));
  }
  if (py::isinstance<py::dict>(object)) {
    Node node;
    node.kind = Node::Kind::Mapping;
    for (const auto& [key, value] : py::reinterpret_borrow<py::dict>(object)) {
      if (!py::isinstance<py::str>(key)) {
        throw value_error(path, fmt::format("the key {} is not a string", py::repr(key).cast<std::string>()),
                          "use the names in docs/scenario.md as keys");
      }
      const std::string name = key.cast<std::string>();
      node.entries.push_back({name, 0, tree(value, with(path, name), depth + 1)});
    }
    return node;
  }
  if (py::isinstance<py::list>(object) || py::isinstance<py::tuple>(object)) {
    Node node;
    node.kind = Node::Kind::List;
    for (const py::handle item : py::reinterpret_borrow<py::sequence>(object))
      node.items.push_back(tree(item, fmt::format("{}[{}]", path, node.items.size()), depth + 1));
    return node;
  }
  if (py::isinstance<ScenarioTree>(object)) return object.cast<ScenarioTree&>().tree;
  if (is_a(object, "numpy", "datetime64") || is_a(object, "datetime", "datetime"))
    return options::scalar_node(time_text(object));
  if (py::hasattr(object, "__fspath__"))
    return options::scalar_node(object.attr("__fspath__")().cast<std::string>());
  if (py::hasattr(object, "tolist")) return tree(object.attr("tolist")(), path, depth + 1);
  throw value_error(path,
                    fmt::format("an object of type '{}' is not a setting",
                                py::type::of(object).attr("__name__").cast<std::string>()),
                    "give text, numbers, booleans, times, paths, and dicts and lists of these");
}

/// A scalar by YAML 1.2's core schema.
py::object plain(const std::string& text) {
  if (text == "true" || text == "false") return py::bool_(text == "true");
  const bool digits = !text.empty() && text.find_first_not_of("-0123456789") == std::string::npos;
  if (digits && text.size() > 1 && text[0] == '0') return py::str(text);  // a name such as 007
  if (const std::optional<double> number = parse_double(text); number && std::isfinite(*number)) {
    if (digits) return py::int_(py::str(text));
    return py::float_(*number);
  }
  return py::str(text);
}

py::list keys_of(const options::Description& description) {
  py::list keys;
  for (const options::Key& key : description.keys) {
    keys.append(py::dict("path"_a = key.path, "unit"_a = key.unit, "default"_a = key.default_value,
                         "values"_a = key.values(), "meaning"_a = key.meaning));
  }
  return keys;
}

py::list fault_list() {
  py::list kinds;
  for (const disturbance::FaultKind& kind : disturbance::fault_kinds()) {
    kinds.append(py::dict("name"_a = std::string(kind.name), "summary"_a = std::string(kind.summary),
                          "example"_a = std::string(kind.example),
                          "keys"_a = keys_of(disturbance::description(kind))));
  }
  return kinds;
}

py::dict profile_list() {
  py::dict profiles;
  for (const simulation::BuiltInProfile& profile : simulation::built_in_profiles()) {
    profiles[py::str(std::string(profile.name))] =
        simulation::parse_profile(std::string(profile.text), fmt::format("profile {}", profile.name))
            .description;
  }
  return profiles;
}

/// Whether two scenarios are equal: all keys, and the folder of relative file names.
bool same(const ScenarioTree& a, const ScenarioTree& b) {
  const auto folder = [](const ScenarioTree& s) {
    return (std::filesystem::current_path() / s.file).parent_path();
  };
  return folder(a) == folder(b) &&
         simulation::scenario_yaml(a.scenario) == simulation::scenario_yaml(b.scenario);
}

std::vector<std::string> names_in(const ScenarioTree& scenario) {
  return simulation::receiver_names(scenario.scenario.receivers);
}

ScenarioPtr parsed_scenario(const std::string& text, const std::filesystem::path& file) {
  const options::Document document = document_of(file, "scenario", simulation::scenario_description());
  return std::make_shared<ScenarioTree>(
      options::parse_yaml(text, document, "give at least city, sky and trajectory"), file);
}

ScenarioPtr loaded_scenario(const std::filesystem::path& path) {
  const TextFile file(path, kMaxBytes);
  return parsed_scenario(std::string(file.text()), path);
}

ScenarioPtr changed_scenario(const ScenarioTree& scenario, const py::object& changes,
                             const py::kwargs& keys) {
  Node tree = scenario.tree;
  if (!changes.is_none()) merge(tree, tree_of(py::dict(changes)));
  merge(tree, tree_of(keys));
  return std::make_shared<ScenarioTree>(std::move(tree), scenario.file);
}

/// A scenario from a dict, from YAML text, or only from keys.
ScenarioPtr made_scenario(const py::object& source, const py::kwargs& keys) {
  if (py::isinstance<py::str>(source)) {
    const ScenarioPtr scenario = parsed_scenario(source.cast<std::string>(), {});
    return keys.empty() ? scenario : changed_scenario(*scenario, py::none(), keys);
  }
  Node tree = tree_of(source.is_none() ? py::dict() : py::dict(source));
  merge(tree, tree_of(keys));
  return std::make_shared<ScenarioTree>(std::move(tree), std::filesystem::path());
}

}  // namespace

void warn_of(const ReadReport& report, const ReadReport& logged) {
  const std::vector<std::string> known = logged.warnings();
  // The warning names the line of the user's call, not a line of the module.
  Py_ssize_t level = 1;
  py::object frame = py::module_::import("sys").attr("_getframe")();
  while (
      !frame.is_none() &&
      py::str(frame.attr("f_globals").attr("get")("__name__", "")).cast<std::string>().rfind("canyon", 0) ==
          0) {
    frame = frame.attr("f_back");
    ++level;
  }
  for (const std::string& line : report.warnings()) {
    if (std::find(known.begin(), known.end(), line) != known.end()) continue;
    if (PyErr_WarnEx(PyExc_UserWarning, hide_passwords(line).c_str(), level) != 0)
      throw py::error_already_set();
  }
}

options::Node tree_of(py::handle object, const std::string& path) {
  return tree(object, path, 0);
}

py::object object_of(const options::Node& node, bool words) {
  switch (node.kind) {
    case Node::Kind::Empty:
      return py::none();
    case Node::Kind::Scalar:
      return words ? py::object(py::str(node.text)) : plain(node.text);
    case Node::Kind::List: {
      py::list list;
      for (const Node& item : node.items) list.append(object_of(item, words));
      return list;
    }
    case Node::Kind::Mapping:
      break;
  }
  py::dict dict;
  for (const Node::Entry& entry : node.entries) dict[py::str(entry.key)] = object_of(entry.value, words);
  return dict;
}

void merge(options::Node& base, const options::Node& over) {
  if (base.kind != Node::Kind::Mapping || over.kind != Node::Kind::Mapping) {
    base = over;
    return;
  }
  for (const Node::Entry& entry : over.entries) {
    const auto found = std::find_if(base.entries.begin(), base.entries.end(),
                                    [&](const Node::Entry& each) { return each.key == entry.key; });
    if (found == base.entries.end()) {
      base.entries.push_back(entry);
    } else {
      found->line = entry.line;
      merge(found->value, entry.value);
    }
  }
}

options::Document document_of(const std::filesystem::path& file, const std::string& kind,
                              const options::Description& description) {
  options::Document document;
  document.file = file;
  document.kind = kind;
  document.set_keys(description);
  document.fault = [file](const std::string& path, const std::string& key, int line, std::string_view problem,
                          std::string_view hint) {
    const std::string name = line > 0 || key.empty() ? key : with(path, key);
    return InputError(file, line, name.empty() ? std::string(problem) : fmt::format("{}: {}", name, problem),
                      hint);
  };
  return document;
}

ScenarioTree::ScenarioTree(options::Node settings, std::filesystem::path from)
    : tree(std::move(settings)), file(std::move(from)) {
  scenario.file = file;
  if (!file.empty()) inputs.add(file);
  const InputFiles::Scope scope(inputs);
  const options::Document document = document_of(file, "scenario", simulation::scenario_description());
  simulation::ScenarioOfAnyTrajectory any{scenario};
  options::read(tree, document, any);
}

std::int64_t unix_ns(geodesy::GpsTime t) {
  return t.nanoseconds() +
         (geodesy::kGpsEpochUnix_s - geodesy::leap_seconds(t)) * geodesy::GpsTime::kNanosecondsPerSecond;
}

geodesy::GpsTime time_of(py::handle object) {
  if (py::isinstance<py::str>(object)) return geodesy::parse_simulated_time(object.cast<std::string>());
  if (py::isinstance<py::int_>(object))
    return geodesy::GpsTime::from_nanoseconds(object.cast<std::int64_t>());
  if (is_a(object, "numpy", "datetime64") || is_a(object, "datetime", "datetime"))
    return geodesy::parse_simulated_time(time_text(object));
  throw InputError(fmt::format("{} is not a time", py::repr(object).cast<std::string>()),
                   "give text like '2026-06-01T08:00:00Z', a datetime or a numpy.datetime64");
}

std::vector<geodesy::GpsTime> times_of(const py::object& object) {
  if (py::isinstance<py::array>(object) || py::isinstance<py::list>(object) ||
      py::isinstance<py::tuple>(object)) {
    std::vector<geodesy::GpsTime> times;
    for (const py::handle each : object) times.push_back(time_of(each));
    if (times.empty()) throw InputError("no time is given", "give at least one");
    return times;
  }
  return {time_of(object)};
}

py::object datetimes(std::vector<std::int64_t>&& unix_ns) {
  return owning_array(std::move(unix_ns)).attr("view")("datetime64[ns]");
}

py::object datetime(geodesy::GpsTime t) {
  return py::module_::import("numpy").attr("datetime64")(unix_ns(t), "ns");
}

geodesy::Geodetic position_of(const py::object& object, const char* what) {
  const Eigen::Vector3d v = vector3(object, what);
  const geodesy::Geodetic position = geodesy::Geodetic::from_degrees(v.x(), v.y(), v.z());
  geodesy::check_geodetic(position, what);
  return position;
}

ScenarioPtr scenario_of(const py::object& object) {
  if (py::isinstance<ScenarioTree>(object)) return object.cast<ScenarioPtr>();
  const bool is_text = py::isinstance<py::str>(object);
  if (py::hasattr(object, "keys") || (is_text && object.cast<std::string>().find('\n') != std::string::npos))
    return made_scenario(object, {});
  return loaded_scenario(object.cast<std::filesystem::path>());
}

void bind_settings(py::module_& m) {
  py::class_<ScenarioTree, ScenarioPtr>(m, "Scenario",
                                        R"(A checked scenario: city, sky, trajectory, receivers.

Parameters
----------
source : dict or str, optional
    The keys of docs/scenario.md as a dict, or as YAML text. Values may be NumPy scalars and arrays,
    ``datetime`` and paths. Names of files belong to the working folder.
**keys
    Further keys, laid over `source`: mappings key by key, anything else replaced.

Raises
------
InputError
    For unknown keys (with the closest known one), wrong types, values out of range, and missing files.

Examples
--------
>>> import canyon
>>> scenario = canyon.Scenario(
...     city={"open": True, "origin": {"latitude_deg": 48.1, "longitude_deg": 11.6, "height_m": 520}},
...     start="2026-06-01T08:00:00Z",
...     duration_s=10,
...     trajectory={"position": {"east_m": 0, "north_m": 0, "up_m": 1.5}},
...     receivers=[{"name": "base", "profile": "survey"}],
... )
>>> scenario.receivers
['base']
>>> scenario.changed(seed=7).seed
7)")
      .def(py::init(&made_scenario), "source"_a = py::none(), py::pos_only())
      .def_static(
          "load",
          [](const std::filesystem::path& path, const py::kwargs& changes) {
            const ScenarioPtr scenario = loaded_scenario(path);
            return changes.empty() ? scenario : changed_scenario(*scenario, py::none(), changes);
          },
          "path"_a, R"(Reads a scenario file.

Parameters
----------
path : path
    A YAML file; names of files in it belong to its folder.
**changes
    Keys laid over the file's, as in :meth:`changed`.)")
      .def("changed", &changed_scenario, "changes"_a = py::none(), py::pos_only(),
           "The scenario with other keys: mappings are merged key by key, anything else is replaced.")
      .def_property_readonly(
          "settings", [](const ScenarioTree& self) { return py::dict(object_of(self.tree)); },
          "dict: A copy of the given keys, without defaults; :meth:`changed` changes them.")
      .def_property_readonly(
          "yaml", [](const ScenarioTree& self) { return simulation::scenario_yaml(self.scenario); },
          "str: The effective scenario: profiles resolved, every default written out.")
      .def_property_readonly("receivers", &names_in, "list of str: Names of the receivers.")
      .def_property_readonly(
          "seed", [](const ScenarioTree& self) { return self.scenario.seed; }, "int: Seed of all noise.")
      .def_property_readonly(
          "warnings", [](const ScenarioTree& self) { return self.scenario.warnings; },
          "list of str: Warnings about ambiguous keys.")
      .def(py::pickle(
          [](const ScenarioTree& self) {
            const py::object file = self.file.empty() ? py::object(py::none()) : py::cast(self.file);
            return py::make_tuple(object_of(self.tree, true), file, std::filesystem::current_path());
          },
          [](const py::tuple& state) {
            // File names stay relative to their original folder.
            std::filesystem::path file;
            if (!state[1].is_none()) file = state[1].cast<std::filesystem::path>();
            const auto folder = state[2].cast<std::filesystem::path>();
            if (folder != std::filesystem::current_path()) file = folder / file;
            return std::make_shared<ScenarioTree>(tree_of(state[0]), file);
          }))
      .def(
          "__eq__", [](const ScenarioTree& self, const ScenarioTree& other) { return same(self, other); },
          py::is_operator())
      .def("__hash__",
           [](const ScenarioTree& self) {
             return std::hash<std::string>()(simulation::scenario_yaml(self.scenario));
           })
      .def("__repr__", [](const ScenarioTree& self) {
        return fmt::format("<canyon.Scenario of {}: {}>", self.file.empty() ? "settings" : self.file.string(),
                           fmt::join(names_in(self), ", "));
      });
  m.def("as_scenario", &scenario_of, "scenario"_a,
        "A scenario from a scenario, a file's name, YAML text of several lines, or a dict.");
  m.def(
      "scenario_keys", [] { return keys_of(simulation::scenario_description()); },
      R"(All keys of scenarios: path, unit, default, values and meaning of each.

Examples
--------
>>> import canyon
>>> next(key for key in canyon.scenario_keys() if key["path"] == "duration_s")["unit"]
's')");
  m.def("fault_kinds", &fault_list,
        R"(Kinds of faults (docs/faults.md): name, summary, example and keys of each.

Examples
--------
>>> import canyon
>>> "outage" in [kind["name"] for kind in canyon.fault_kinds()]
True)");
  m.def("profiles", &profile_list,
        R"(The receivers that come with Canyon: name to description (docs/profiles.md).

Examples
--------
>>> import canyon
>>> "ublox-m10" in canyon.profiles()
True)");
  m.def(
      "formats",
      [] {
        py::dict formats;
        for (const encoding::Format& format : encoding::formats()) {
          if (format.help.empty()) continue;  // for streams only
          formats[py::str(std::string(format.name))] = std::string(format.file);
        }
        return formats;
      },
      R"(Formats of results: name to the name of the file in a folder of results (docs/outputs.md).

Examples
--------
>>> import canyon
>>> canyon.formats()["nmea"]
'receiver.nmea')");
}

}  // namespace canyon::python
