#include "canyon/analysis/study/axis.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string_view>

#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/text.hpp"
#include "canyon/simulation/unknowns/unknowns.hpp"

namespace canyon::study {
namespace {

constexpr std::uint32_t kMax = 100'000'000;
constexpr double kYears100_s = 100 * 366 * 86'400.0;

void visit_count(options::Visitor& v, std::optional<std::uint32_t>& count, std::string_view help) {
  std::uint32_t number = count.value_or(0);
  if (v.wants(v.reads() ? v.has("count") : count.has_value())) {
    v.integer({"count", "", help, "none"}, number, 1, kMax);
    if (v.reads()) count = number;
  }
}

void visit_range(options::Visitor& v, Axis& o) {
  v.require("from");
  v.require("to");
  v.number({"from", "", "first number"}, o.from, {});
  v.number({"to", "", "last number, included"}, o.to, {});
  v.one_of({"step", "count"});
  v.number({"step", "", "distance between values", "none: continuous, for samples"}, o.step,
           {0, 1e300, true});
  visit_count(v, o.count, "number of values at even distances, instead of step");
  if (v.reads() && !(o.from < o.to && std::isfinite(o.to - o.from)))
    throw v.fault("to", "is not above from", "give from below to");
}

void visit_times(options::Visitor& v, Axis& o) {
  std::string text = "2026-01-01T00:00:00Z";
  if (!v.reads() && !v.describes()) text = geodesy::format_gpst(o.first, 9);
  v.require("from");
  v.text({"from", "UTC or GPST", "first start of runs"}, text);
  if (v.reads()) {
    try {
      o.first = geodesy::parse_simulated_time(text);
    } catch (const InputError& e) {
      throw v.fault("from", e.problem(), e.hint());
    }
  }
  v.require("span_s", "give it in seconds: 86400 is a day, 31557600 a year");
  v.number({"span_s", "s", "all starts are within this time after the first: 86400 is a day, 31557600 a year",
            "none"},
           o.span_s, {0, kYears100_s, true});
  v.one_of({"step_s", "count"});
  v.number({"step_s", "s", "distance between values", "none: continuous, for samples"}, o.step,
           {0, kYears100_s, true});
  visit_count(v, o.count, "number of values at even distances, instead of step");
}

/// StudyPlan rejects more, whatever max_runs is.
constexpr double kMaxValues = 1e12;

std::size_t steps(double span, double step) {
  return static_cast<std::size_t>(std::min(std::max(0.0, span / step), kMaxValues));
}

void visit_unknowns(options::Visitor& v, Axis& o) {
  std::uint32_t sample_count = o.count.value_or(0);
  v.integer(
      {"unknowns", "",
       "number of samples of what the scenario leaves open: level of installations, obstacles, facades, "
       "position of the map",
       "none"},
      sample_count, 1, kMax);
  if (v.reads()) o.kind = Axis::Kind::Unknowns, o.count = sample_count;
  v.texts({"fixed_unknowns", "", "unknowns that are not sampled: level, skyline, facades, map", "none"},
          o.known);
  v.former_name("known", "fixed_unknowns");
  try {
    for (const std::string& name : o.known) (void)unknowns::unknown_of(name);
  } catch (const InputError& e) {
    throw v.fault("fixed_unknowns", e.problem(), e.hint());
  }
}

}  // namespace

void visit(options::Visitor& v, DriveOptions& o) {
  v.require("count");
  v.integer({"count", "", "number of random drives through the streets of the run's city"}, o.count, 1, kMax);
  v.number({"length_m", "m", "length of each drive"}, o.length_m, {10, 1e6});
  v.number({"speed_mps", "m/s", "speed between waypoints"}, o.speed_mps, {0, 100, true});
  v.number({"acceleration_mps2", "m/s^2", "largest acceleration, along and across"}, o.acceleration_mps2,
           {0, 100, true});
  v.number({"height_m", "m", "height above the terrain"}, o.height_m, {0, 1000, true});
}

void visit(options::Visitor& v, Axis& o) {
  v.text({"name", "", "name of the coordinate in the results", "last word of the key"}, o.name);
  v.text(
      {"key", "",
       "key of the scenario that it sets, with dots: receivers[0].profile, receivers[].elevation_mask_deg, "
       "or a section (city, faults). Default: each value is a mapping of such keys",
       "none"},
      o.key);
  v.one_of({"values", "range", "times", "seeds", "drives", "unknowns"},
           "give one of values, range, times, seeds, drives and unknowns");
  if (v.wants(o.kind == Axis::Kind::Values || v.has("values"))) {
    v.texts({"values", "", "list of values for the key", "none"}, o.values);
    v.texts({"labels", "", "label of each value, for tables and pictures", "the values"}, o.labels);
  }
  if (v.wants(v.reads() ? v.has("range") : o.kind == Axis::Kind::Range)) {
    v.section("range", [&] { visit_range(v, o); });
    if (v.reads()) o.kind = Axis::Kind::Range;
  }
  if (v.wants(v.reads() ? v.has("times") : o.kind == Axis::Kind::Times)) {
    v.section("times", [&] { visit_times(v, o); });
    if (v.reads()) o.kind = Axis::Kind::Times;
  }
  if (v.wants(v.reads() ? v.has("seeds") : o.kind == Axis::Kind::Seeds)) {
    std::uint32_t seeds = o.count.value_or(0);
    v.integer({"seeds", "", "number of noise realizations: seed 1, 2, ...", "none"}, seeds, 1, kMax);
    if (v.reads()) o.kind = Axis::Kind::Seeds, o.count = seeds;
  }
  if (v.wants(v.reads() ? v.has("unknowns") : o.kind == Axis::Kind::Unknowns)) visit_unknowns(v, o);
  if (v.wants(v.reads() ? v.has("drives") : o.kind == Axis::Kind::Drives)) {
    v.section("drives", [&] { visit(v, o.drives); });
    if (v.reads()) o.kind = Axis::Kind::Drives;
  }
  if (v.reads()) o.realization = o.kind != Axis::Kind::Values && o.kind != Axis::Kind::Range;
  v.boolean({"realization", "",
             "its values are occasions (times, seeds, drives) over which settings are compared: each "
             "occasion has its own random numbers, shared by all settings",
             "true of times, seeds, drives and unknowns"},
            o.realization);
  v.boolean({"full_factorial", "", "in a sample: run every value at every point, instead of sampling one"},
            o.crossed);
  v.former_name("crossed", "full_factorial");
  if (!v.reads()) return;

  const bool is_bench_key = o.kind != Axis::Kind::Values && o.kind != Axis::Kind::Range;
  if (is_bench_key && !o.key.empty())
    throw v.fault("key", "times, seeds, drives and unknowns have their own key", "leave it out");
  if (o.kind == Axis::Kind::Times) o.key = "start";
  if (o.kind == Axis::Kind::Seeds) o.key = "seed";
  if (o.kind == Axis::Kind::Unknowns) o.key = Axis::kUnknowns;
  if (o.kind == Axis::Kind::Range && o.key.empty()) throw v.fault("key", "is missing", "give the key to set");
  if (!o.labels.empty() && o.labels.size() != o.values.size()) {
    throw v.fault("labels", fmt::format("{} for {} values", o.labels.size(), o.values.size()),
                  "give one for each value, or none");
  }
  for (auto label = o.labels.begin(); label != o.labels.end(); ++label) {
    if (std::find(o.labels.begin(), label, *label) == label) continue;
    throw v.fault("labels", fmt::format("'{}' names two values", *label), "give each its own label");
  }
  if (o.name.empty()) {
    o.name = o.key.substr(o.key.rfind('.') + 1);
    if (o.kind == Axis::Kind::Drives) o.name = "drive";
    if (o.name.find('[') != std::string::npos) o.name.erase(o.name.find('['));
    if (o.name.empty()) throw v.fault("name", "is missing", "name an axis whose values are several keys");
  }
  options::check_folder_name(v, "name", o.name);
  static constexpr std::array kTaken{"run", "receiver", "error_bin", "hour", "seed_of_run", "epoch"};
  if (std::find(kTaken.begin(), kTaken.end(), o.name) != kTaken.end())
    throw v.fault("name", fmt::format("the results already have the name '{}'", o.name), "give another name");
}

std::size_t Axis::size() const {
  switch (kind) {
    case Kind::Values:
      return values.size();
    case Kind::Seeds:
    case Kind::Unknowns:
      return count.value_or(1);
    case Kind::Drives:
      return drives.count;
    case Kind::Range:
      if (count) return *count;
      return step ? steps(to - from + 1e-9 * *step, *step) + 1 : 0;
    case Kind::Times:
      if (count) return *count;
      return step ? steps(span_s - 1e-9 * *step, *step) + 1 : 0;
  }
  return 0;
}

bool Axis::is_numeric() const {
  if (kind != Kind::Values) return kind != Kind::Times;
  return labels.empty() && std::all_of(values.begin(), values.end(), [](const std::string& text) {
           return parse_double(text).has_value();
         });
}

AxisValue value_at(const Axis& axis, const Level& level) {
  AxisValue value;
  const auto index = static_cast<double>(level.index);
  const auto n = static_cast<double>(axis.size());
  switch (axis.kind) {
    case Axis::Kind::Values:
      value.tree = axis.trees.at(level.index);
      value.text = axis.values.at(level.index);
      value.label = axis.labels.empty() ? value.text : axis.labels.at(level.index);
      return value;
    case Axis::Kind::Seeds:
    case Axis::Kind::Drives:
    case Axis::Kind::Unknowns:
      value.text = fmt::format("{}", level.index + 1);
      break;
    case Axis::Kind::Range: {
      double number = axis.from + level.u * (axis.to - axis.from);
      if (axis.step) number = axis.from + index * *axis.step;
      if (axis.count) number = n > 1 ? axis.from + (axis.to - axis.from) * index / (n - 1) : axis.from;
      // 12 digits are enough for a grid, and hide rounding: 0.1 + 0.2 is 0.3.
      value.text = fmt::format("{:.12g}", number);
      break;
    }
    case Axis::Kind::Times: {
      double later_s = std::floor(level.u * axis.span_s);  // whole seconds have shorter names
      if (axis.step) later_s = index * *axis.step;
      if (axis.count) later_s = axis.span_s * index / n;
      value.text = geodesy::format_gpst(axis.first + later_s, 9);
      value.label = geodesy::format_gpst(axis.first + later_s, 0);
      break;
    }
  }
  if (value.label.empty()) value.label = value.text;
  value.tree = options::scalar_node(value.text, axis.line);
  return value;
}

std::vector<std::pair<std::string, const options::Node*>> settings_of(const Axis& axis,
                                                                      const AxisValue& value) {
  std::vector<std::pair<std::string, const options::Node*>> settings;
  if (axis.kind == Axis::Kind::Drives || axis.kind == Axis::Kind::Unknowns) return settings;
  if (!axis.key.empty())
    settings.emplace_back(axis.key, &value.tree);
  else
    for (const options::Node::Entry& entry : value.tree.entries)
      settings.emplace_back(entry.key, &entry.value);
  return settings;
}

namespace {

using options::Node;

/// A line number that no file has: marks the settings of the earlier axis.
constexpr int kMark = -1;

void mark(Node& tree) {
  tree.line = kMark;
  for (Node& item : tree.items) mark(item);
  for (Node::Entry& entry : tree.entries) mark(entry.value);
}

/// Marked values, without lists and sections.
std::size_t marks(const Node& tree) {
  const bool value = tree.kind == Node::Kind::Scalar || tree.kind == Node::Kind::Empty;
  std::size_t count = value && tree.line == kMark ? 1 : 0;
  for (const Node& item : tree.items) count += marks(item);
  for (const Node::Entry& entry : tree.entries) count += marks(entry.value);
  return count;
}

/// Keys that are set together, with their values.
using Settings = std::vector<std::pair<std::string, Node>>;

/// The settings of each value, as values may set different keys.
std::vector<Settings> settings_of_all(const Axis& axis) {
  if (axis.kind == Axis::Kind::Drives) return {{{"trajectory", {}}}};
  std::vector<Settings> all(axis.kind == Axis::Kind::Values ? axis.trees.size() : 1);
  for (std::size_t k = 0; k < all.size(); ++k) {
    const AxisValue value = value_at(axis, {k, 0});
    for (const auto& [key, tree] : settings_of(axis, value)) all[k].emplace_back(key, *tree);
  }
  return all;
}

/// set_at() if possible; errors are reported when scenarios are made.
void try_set(Node& root, const std::string& key, const Node& value) {
  try {
    options::set_at(root, key, value);
  } catch (const InputError&) {
  }
}

/// The first of the later keys that replaces a setting of the value `which`.
std::optional<std::string> replacing(const Node& base, Settings earlier, std::size_t which,
                                     const std::map<std::string, Node>& later) {
  Node root = base;
  mark(earlier[which].second);
  for (const auto& [key, value] : earlier) try_set(root, key, value);
  const std::size_t before = marks(root);
  for (const auto& [key, value] : later) {
    try_set(root, key, value);
    if (marks(root) < before) return key;
  }
  return std::nullopt;
}

}  // namespace

void check_keys(const std::vector<Axis>& axes, const Node& base, const std::filesystem::path& file) {
  constexpr std::string_view kAttitude = "trajectory.attitude";  // of a drive it is the scenario's
  for (std::size_t j = 1; j < axes.size(); ++j) {
    for (std::size_t i = 0; i < j; ++i) {
      const bool drive = axes[i].kind == Axis::Kind::Drives || axes[j].kind == Axis::Kind::Drives;
      std::map<std::string, Node> later;
      for (const Settings& settings : settings_of_all(axes[j]))
        later.insert(settings.begin(), settings.end());
      if (drive) later.erase(std::string(kAttitude));
      for (const Settings& earlier : settings_of_all(axes[i])) {
        for (std::size_t which = 0; which < earlier.size(); ++which) {
          const std::string& key = earlier[which].first;
          if (drive && key == kAttitude) continue;
          const auto other = replacing(base, earlier, which, later);
          if (!other) continue;
          const auto depth = [](const std::string& of) { return std::count(of.begin(), of.end(), '.'); };
          throw InputError(
              file, axes[j].line,
              fmt::format("axes '{}' and '{}' both set '{}'", axes[i].name, axes[j].name,
                          depth(key) > depth(*other) ? key : *other),
              "only the later one would count: remove one of them, or make one axis whose values are "
              "mappings of keys");
        }
      }
    }
  }
}

}  // namespace canyon::study
