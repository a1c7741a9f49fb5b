#include "canyon/study/axis.hpp"

#include <fmt/format.h>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/geodesy/time_text.hpp"
#include "canyon/options/folder_name.hpp"
#include "canyon/options/settings_tree.hpp"
#include "canyon/unknowns/unknowns.hpp"

namespace canyon::study {

namespace {

constexpr std::uint32_t kMost = 100'000'000;
constexpr double kYears100_s = 100 * 366 * 86'400.0;

void visit_count(options::Visitor& v, std::optional<std::uint32_t>& count, std::string_view help) {
  std::uint32_t number = count.value_or(0);
  if (v.wants(v.reads() ? v.has("count") : count.has_value())) {
    v.integer({"count", "", help, "none"}, number, 1, kMost);
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
      throw v.fault("from", e.problem(), e.cure());
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

/// StudyPlan refuses more, whatever max_runs is.
constexpr double kMostValues = 1e12;

std::size_t steps(double span, double step) {
  return static_cast<std::size_t>(std::min(std::max(0.0, span / step), kMostValues));
}

void visit_unknowns(options::Visitor& v, Axis& o) {
  std::uint32_t draws = o.count.value_or(0);
  v.integer({"unknowns", "",
             "number of draws of what the scenario leaves open: level of installations, obstacles, facades, "
             "place of the map",
             "none"},
            draws, 1, kMost);
  if (v.reads()) o.kind = Axis::Kind::Unknowns, o.count = draws;
  v.texts({"known", "", "unknowns that are not drawn: level, skyline, facades, map", "none"}, o.known);
  try {
    for (const std::string& name : o.known) (void)unknowns::unknown_of(name);
  } catch (const InputError& e) {
    throw v.fault("known", e.problem(), e.cure());
  }
}

std::string number_text(double value) {
  // 12 digits are enough for a grid, and hide that 0.1 + 0.2 is not 0.3.
  return fmt::format("{:.12g}", value);
}

}  // namespace

void visit(options::Visitor& v, DriveOptions& o) {
  v.require("count");
  v.integer({"count", "", "number of random drives through the streets of the run's city"}, o.count, 1,
            kMost);
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
       "or a section (city, faults). Left out: each value is a mapping of such keys",
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
    v.integer({"seeds", "", "number of noise realizations: seed 1, 2, ...", "none"}, seeds, 1, kMost);
    if (v.reads()) o.kind = Axis::Kind::Seeds, o.count = seeds;
  }
  if (v.wants(v.reads() ? v.has("unknowns") : o.kind == Axis::Kind::Unknowns)) {
    visit_unknowns(v, o);
  }
  if (v.wants(v.reads() ? v.has("drives") : o.kind == Axis::Kind::Drives)) {
    v.section("drives", [&] { visit(v, o.drives); });
    if (v.reads()) o.kind = Axis::Kind::Drives;
  }
  if (v.reads()) o.realization = o.kind != Axis::Kind::Values && o.kind != Axis::Kind::Range;
  // `luck` was its name before. It is still read, and keys of studies' folders keep it.
  const bool as_before = v.purpose() == options::Purpose::Values || v.has("luck");
  if (v.reads()) v.one_of({"realization", "luck"});
  v.boolean({as_before ? "luck" : "realization", "",
             "its values are occasions (times, seeds, drives) over which settings are compared: each "
             "occasion has its own random numbers, shared by all settings",
             "true of times, seeds, drives and unknowns"},
            o.realization);
  v.boolean({"crossed", "", "in a sample: run every value at every point, instead of drawing one"},
            o.crossed);
  if (!v.reads()) return;

  const bool own_key = o.kind != Axis::Kind::Values && o.kind != Axis::Kind::Range;
  if (own_key && !o.key.empty()) {
    throw v.fault("key", "times, seeds, drives and unknowns have their own", "leave it out");
  }
  if (o.kind == Axis::Kind::Times) o.key = "start";
  if (o.kind == Axis::Kind::Seeds) o.key = "seed";
  if (o.kind == Axis::Kind::Unknowns) o.key = Axis::kUnknowns;
  if (o.kind == Axis::Kind::Range && o.key.empty()) throw v.fault("key", "is missing", "name what it sets");
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
  if (std::find(kTaken.begin(), kTaken.end(), o.name) != kTaken.end()) {
    throw v.fault("name", fmt::format("the results already have the name '{}'", o.name), "give another name");
  }
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
      value.text = number_text(number);
      break;
    }
    case Axis::Kind::Times: {
      double later_s = std::floor(level.u * axis.span_s);  // whole seconds are easier to name
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
  if (!axis.key.empty()) {
    settings.emplace_back(axis.key, &value.tree);
  } else {
    for (const options::Node::Entry& entry : value.tree.entries)
      settings.emplace_back(entry.key, &entry.value);
  }
  return settings;
}

namespace {

using options::Node;

/// The items of a list that a key chooses by number or name; all of them where both are empty.
struct Chosen {
  std::string name;
  std::optional<std::size_t> number;

  [[nodiscard]] bool shares_with(const Chosen& other) const {
    const bool all = name.empty() && !number, others_all = other.name.empty() && !other.number;
    if (all || others_all) return true;
    if (number && other.number) return *number == *other.number;
    return !name.empty() && name == other.name;
  }
};

/// A word of a key: "receivers[0]" is receivers and the item 0.
struct Word {
  std::string name;
  std::optional<Chosen> item;
};

/// An item of a list of the scenario has both a number and, where it is given one, a name.
Chosen chosen(const Node::Entry* list, const std::string& which) {
  Chosen item;
  if (const auto number = parse_integer(which)) {
    item.number = static_cast<std::size_t>(*number);
  } else {
    item.name = which;
  }
  if (list == nullptr) return item;
  for (std::size_t i = 0; i < list->value.items.size(); ++i) {
    const Node::Entry* name = list->value.items[i].find("name");
    if (name == nullptr) continue;
    if (item.number == i) item.name = name->value.text;
    if (!item.number && !item.name.empty() && item.name == name->value.text) item.number = i;
  }
  return item;
}

using Words = std::vector<Word>;

Words words_of(const std::string& key, const Node& base) {
  Words words;
  for (const std::string_view part : split(key, '.')) {
    const std::size_t open = part.find('[');
    Word word{std::string(part.substr(0, open)), {}};
    if (open != std::string_view::npos) {
      word.item = chosen(words.empty() ? base.find(word.name) : nullptr,
                         std::string(part.substr(open + 1, part.find(']') - open - 1)));
    }
    words.push_back(std::move(word));
  }
  return words;
}

Words behind(const Words& words, std::size_t count) {
  return {words.begin() + static_cast<std::ptrdiff_t>(count), words.end()};
}

/// Whether the shorter key leads to the longer one.
bool agree(const Words& a, const Words& b) {
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i) {
    if (a[i].name != b[i].name) return false;
    if (a[i].item && b[i].item && !a[i].item->shares_with(*b[i].item)) return false;
  }
  return true;
}

/// Whether a value, or the items that are chosen of a list, have something at the key.
bool has(const Node& value, const std::optional<Chosen>& chosen_items, const Words& key) {
  if (chosen_items) {
    for (std::size_t i = 0; i < value.items.size(); ++i) {
      const Node::Entry* name = value.items[i].find("name");
      const Chosen item{name == nullptr ? "" : name->value.text, i};
      if (item.shares_with(*chosen_items) && has(value.items[i], {}, key)) return true;
    }
    return false;
  }
  if (key.empty()) return true;
  for (const Node::Entry& entry : value.entries) {
    const Words own = words_of(entry.key, {});  // a key within a value may have dots
    if (!agree(own, key)) continue;
    if (own.size() >= key.size()) return true;
    if (has(entry.value, key[own.size() - 1].item, behind(key, own.size()))) return true;
  }
  return false;
}

/// A key that an axis sets, with the trees that it sets there.
using Settings = std::map<std::string, std::vector<Node>>;

Settings settings_of_all(const Axis& axis) {
  Settings settings;
  // Of a drive, the attitude is the scenario's.
  if (axis.kind == Axis::Kind::Drives) return {{"trajectory", {}}};
  if (axis.kind != Axis::Kind::Values) {
    if (axis.kind != Axis::Kind::Unknowns) settings[axis.key];
    return settings;
  }
  for (const Node& tree : axis.trees) {
    const AxisValue of_tree{tree, {}, {}};
    for (const auto& [key, value] : settings_of(axis, of_tree)) settings[key].push_back(*value);
  }
  return settings;
}

/// Whether a key, set after another one, replaces a part of what that one has set.
bool replaces(const Words& later, const Words& earlier, const std::vector<Node>& trees) {
  if (!agree(later, earlier)) return false;
  if (later.size() <= earlier.size()) return true;
  const auto items = earlier.back().item ? std::nullopt : later[earlier.size() - 1].item;
  return std::any_of(trees.begin(), trees.end(),
                     [&](const Node& tree) { return has(tree, items, behind(later, earlier.size())); });
}

}  // namespace

void check_keys(const std::vector<Axis>& axes, const Node& base, const std::filesystem::path& file) {
  std::vector<Settings> settings;
  for (const Axis& axis : axes) {
    for (const auto& [later, of_later] : settings.emplace_back(settings_of_all(axis))) {
      const Words words = words_of(later, base);
      for (std::size_t i = 0; i + 1 < settings.size(); ++i) {
        for (const auto& [earlier, trees] : settings[i]) {
          const bool drive = axis.kind == Axis::Kind::Drives || axes[i].kind == Axis::Kind::Drives;
          if (drive && (later == "trajectory.attitude" || earlier == "trajectory.attitude")) continue;
          const Words before = words_of(earlier, base);
          if (!replaces(words, before, trees) && !(drive && agree(words, before))) continue;
          throw InputError(
              file, axis.line,
              fmt::format("axes '{}' and '{}' both set '{}'", axes[i].name, axis.name,
                          before.size() > words.size() ? earlier : later),
              "only the later one would count: remove one of them, or make one axis whose values are "
              "mappings of keys");
        }
      }
    }
  }
}

}  // namespace canyon::study
