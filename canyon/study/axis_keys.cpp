#include "canyon/study/axis_keys.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

namespace canyon::study {
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
