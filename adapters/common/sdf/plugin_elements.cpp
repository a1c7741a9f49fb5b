#include "adapters/common/sdf/plugin_elements.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "canyon/base/text.hpp"

namespace canyon::adapters {
namespace {

// These stand as often as one likes.
bool is_list(std::string_view path) {
  return path == "sky.navigation" || path == "sky.systems" || path == "ros.remapping" ||
         path == "publishers.stream";
}

// Models of PX4 and ROS carry them empty, for "the default".
bool may_be_empty(std::string_view path) {
  return path == "robotNamespace" || path == "ros.namespace";
}

std::string join(const std::vector<std::string>& words) {
  return fmt::format("{}", fmt::join(words, ", "));
}

std::string_view last_name(std::string_view path) {
  return path.substr(path.find_last_of('.') + 1);  // npos + 1 is 0
}

std::string text_of(const sdf::ElementPtr& element) {
  const sdf::ParamPtr value = element->GetValue();
  return value ? std::string(trim(value->GetAsString())) : "";
}

// A YAML text in double quotes, on one line whatever is in it.
std::string yaml_text(std::string_view text) {
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      result += '\\';
      result += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      result += fmt::format("\\x{:02x}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    } else {
      result += c;
    }
  }
  return result + '"';
}

// A scenario's text with one line per key, and which element each line came from.
class ScenarioText {
 public:
  ScenarioText() : root_{"", "", {}, false, {}} {}

  void add(const PluginElements::Element& element, bool list) {
    Node* node = &root_;
    std::string path;
    std::string tags;
    const std::vector<std::string_view> names = split(element.path, '.');
    for (std::size_t i = 0; i < names.size(); ++i) {
      path += (path.empty() ? "" : ".") + std::string(names[i]);
      tags += fmt::format("<{}>", names[i]);
      // A section that came by another name is named by the first element that brought it.
      node = &node->child(std::string(names[i]), element.tag.starts_with(tags) ? tags : element.tag);
    }
    node->values = element.values;
    node->list = list;
  }

  [[nodiscard]] std::string write() {
    text_.clear();
    lines_.clear();
    write(root_, 0);
    return text_;
  }

  // Key and tag of a 1-based line; null for none.
  [[nodiscard]] const std::pair<std::string, std::string>* at(int line) const {
    const auto i = static_cast<std::size_t>(line) - 1;
    return line >= 1 && i < lines_.size() ? &lines_[i] : nullptr;
  }
  [[nodiscard]] bool is_section(int line) const { return sections_.count(line) > 0; }

 private:
  struct Node {
    std::string key;
    std::string tag;
    std::vector<std::string> values;
    bool list = false;
    std::vector<Node> children;

    Node& child(const std::string& name, const std::string& child_tag) {
      for (Node& node : children) {
        if (node.key == name) return node;
      }
      children.push_back({name, child_tag, {}, false, {}});
      return children.back();
    }
  };

  void write(const Node& parent, std::size_t depth) {
    for (const Node& node : parent.children) {
      lines_.emplace_back(node.key, node.tag);
      text_ += fmt::format("{:{}}{}:", "", 2 * depth, node.key);
      if (!node.children.empty()) {
        sections_.insert(static_cast<int>(lines_.size()));
        text_ += '\n';
        write(node, depth + 1);
      } else if (node.list) {
        std::vector<std::string> items;
        for (const std::string& value : node.values) items.push_back(yaml_text(value));
        text_ += fmt::format(" [{}]\n", join(items));
      } else {
        text_ += fmt::format(" {}\n", yaml_text(node.values.front()));
      }
    }
  }

  Node root_;
  std::string text_;
  std::vector<std::pair<std::string, std::string>> lines_;
  std::set<int> sections_;
};

// What the scenario's reader says of YAML, for someone who writes SDF.
std::string in_words_of_sdf(std::string text) {
  static const std::vector<std::pair<std::string, std::string>> kWords{
      {"docs/scenario.md", "docs/gazebo.md"},
      {"beside the other keys here", "beside the other elements here"},
      {"the unit is in the key's name", "the unit is in the element's name"},
      {"{week: 2051, tow: 46701}", "<start><week>2051</week><tow>46701</tow></start>"},
      {"write start: ", "write "},
      {"nominal: true", "<nominal>true</nominal>"},
  };
  for (const auto& [yaml, sdf] : kWords) {
    const std::size_t at = text.find(yaml);
    if (at != std::string::npos) text.replace(at, yaml.size(), sdf);
  }
  return text;
}

}  // namespace

std::string tag_of(std::string_view path) {
  std::string tag;
  for (const std::string_view name : split(path, '.')) tag += fmt::format("<{}>", name);
  return tag;
}

PluginElements::PluginElements(const sdf::ElementPtr& plugin, std::string plugin_name,
                               const std::vector<std::string>& known)
    : plugin_name_(std::move(plugin_name)), known_(known) {
  if (plugin) read(plugin, "", "");
}

InputError PluginElements::error(const Element& element, std::string_view problem,
                                 std::string_view cure) const {
  std::string text;
  for (const std::string& part : {plugin_name_, element.tag}) {
    if (!part.empty()) text += part + ": ";
  }
  return InputError(text.append(problem), cure);
}

bool PluginElements::is_section(std::string_view path) const {
  return std::any_of(known_.begin(), known_.end(), [path](const std::string& key) {
    return key.size() > path.size() && key[path.size()] == '.' && key.starts_with(path);
  });
}

void PluginElements::read(const sdf::ElementPtr& parent, const std::string& path, const std::string& tags) {
  for (sdf::ElementPtr child = parent->GetFirstElement(); child; child = child->GetNextElement()) {
    const std::string& name = child->GetName();
    const std::string child_path = path + name;
    const Element element{child_path, fmt::format("{}<{}>", tags, name), {text_of(child)}};
    const std::string& text = element.values.front();
    const bool leaf = std::find(known_.begin(), known_.end(), child_path) != known_.end();
    const bool section = is_section(child_path);
    const bool has_children = child->GetFirstElement() != nullptr;
    if (!leaf && !section) {
      warn_unknown(name, path, tags);
      continue;
    }
    if (sections_.count(child_path) > 0) throw error(element, "stands twice", "put what is in both into one");
    if (section && (has_children || (!leaf && text.empty()))) {
      if (!text.empty())
        throw error(element, fmt::format("the text '{}' stands beside elements", text), "remove it");
      if (has(child_path)) throw error(element, "stands twice", "keep one");
      sections_.insert(child_path);
      read(child, child_path + ".", element.tag);
      continue;
    }
    if (!leaf) {
      std::vector<std::string> inside;
      for (const std::string& key : known_) {
        if (!key.starts_with(child_path + ".")) continue;
        const std::string rest = key.substr(child_path.size() + 1);
        const std::string first = fmt::format("<{}>", rest.substr(0, rest.find('.')));
        if (std::find(inside.begin(), inside.end(), first) == inside.end()) inside.push_back(first);
      }
      throw error(element, fmt::format("the text '{}' stands where elements belong", text),
                  "put one of these inside: " + join(inside));
    }
    if (has_children)
      throw error(element, "has elements inside where one value belongs", "write the value alone");
    if (text.empty() && !may_be_empty(child_path)) {
      throw error(element, "has no value", "write one between its tags, or remove it");
    }
    const auto earlier = std::find_if(elements_.begin(), elements_.end(),
                                      [&](const Element& other) { return other.path == child_path; });
    if (earlier == elements_.end()) {
      elements_.push_back(element);
    } else if (is_list(child_path)) {
      earlier->values.push_back(text);
    } else {
      throw error(element, "stands twice", "keep one");
    }
  }
}

void PluginElements::warn_unknown(const std::string& name, const std::string& path, const std::string& tags) {
  std::vector<std::string> siblings;
  std::optional<std::string> meant;
  for (const std::string& key : known_) {
    if (!key.starts_with(path)) continue;
    std::string sibling = key.substr(path.size(), key.find('.', path.size()) - path.size());
    // A name without its unit, "max_range" for "max_range_m", is closer than any distance of letters tells.
    if (!meant && sibling.starts_with(name + "_")) meant = tags + tag_of(sibling);
    siblings.push_back(std::move(sibling));
  }
  for (const std::string& key : known_) {
    if (!meant && last_name(key) == name) meant = tag_of(key);  // right name in the wrong place
  }
  if (!meant) {
    if (const auto similar = closest(name, siblings)) meant = tags + tag_of(*similar);
  }
  warnings_.push_back(fmt::format("{}<{}> is unknown and has no effect{}", tags, name,
                                  meant ? fmt::format("; did you mean {}?", *meant) : ""));
}

bool PluginElements::has(std::string_view path) const {
  return std::any_of(elements_.begin(), elements_.end(),
                     [path](const Element& element) { return element.path == path; });
}

void PluginElements::put(Element element) {
  const auto earlier = std::find_if(elements_.begin(), elements_.end(),
                                    [&](const Element& other) { return other.path == element.path; });
  if (earlier != elements_.end()) {
    if (!earlier->values.front().empty()) {
      throw error(element, fmt::format("stands beside {}, which says the same", earlier->tag), "keep one");
    }
    elements_.erase(earlier);
  }
  elements_.push_back(std::move(element));
}

std::optional<PluginElements::Element> PluginElements::take(std::string_view path) {
  const auto at = std::find_if(elements_.begin(), elements_.end(),
                               [path](const Element& element) { return element.path == path; });
  if (at == elements_.end()) return std::nullopt;
  Element element = std::move(*at);
  elements_.erase(at);
  return element;
}

std::optional<std::string> PluginElements::text(std::string_view path) {
  const auto element = take(path);
  return element ? std::optional(element->values.front()) : std::nullopt;
}

std::optional<std::string> PluginElements::word(std::string_view path) {
  const auto element = take(path);
  if (!element) return std::nullopt;
  const std::string& text = element->values.front();
  if (split_blanks(text).size() > 1)
    throw error(*element, fmt::format("'{}' has blanks in it", text), "write one word");
  return text;
}

std::optional<std::string> PluginElements::choice(std::string_view path,
                                                  const std::vector<std::string>& choices) {
  const auto element = take(path);
  if (!element) return std::nullopt;
  const std::string& text = element->values.front();
  if (std::find(choices.begin(), choices.end(), text) == choices.end()) {
    const auto similar = closest(text, choices);
    throw error(*element, fmt::format("'{}' is unknown", text),
                (similar ? fmt::format("did you mean '{}'? ", *similar) : "") + "known: " + join(choices));
  }
  return text;
}

bool PluginElements::to_boolean(const Element& element) const {
  const std::string text = lower_case(element.values.front());
  if (text == "1" || text == "true") return true;
  if (text == "0" || text == "false") return false;
  throw error(element, fmt::format("'{}' is neither true nor false", element.values.front()),
              "write true, false, 1 or 0");
}

std::optional<bool> PluginElements::boolean(std::string_view path) {
  const auto element = take(path);
  return element ? std::optional(to_boolean(*element)) : std::nullopt;
}

std::optional<double> PluginElements::number(std::string_view path, double low, double high) {
  const auto element = take(path);
  if (!element) return std::nullopt;
  const std::string& text = element->values.front();
  const std::optional<double> value = parse_double(text);
  if (!value)
    throw error(*element, fmt::format("'{}' is not a number", text), "give one number, without its unit");
  if (!(*value >= low && *value <= high)) {
    throw error(*element, fmt::format("{} is out of range", text),
                fmt::format("it runs from {} to {}", low, high));
  }
  return value;
}

std::optional<int> PluginElements::integer(std::string_view path, int low, int high) {
  const auto element = take(path);
  if (!element) return std::nullopt;
  const std::string& text = element->values.front();
  const auto value = parse_integer(text);
  if (!value) throw error(*element, fmt::format("'{}' is not a whole number", text), "write digits alone");
  if (!(*value >= low && *value <= high)) {
    throw error(*element, fmt::format("{} is out of range", text),
                fmt::format("it runs from {} to {}", low, high));
  }
  return static_cast<int>(*value);
}

bool PluginElements::is_boolean(std::string_view path) const {
  const std::vector<simulation::ScenarioKey>& keys = simulation::live_keys();
  return std::any_of(keys.begin(), keys.end(), [path](const simulation::ScenarioKey& key) {
    return key.path == path &&
           (key.default_value.starts_with("true") || key.default_value.starts_with("false"));
  });
}

simulation::LiveConfig PluginElements::take_live_config() {
  ScenarioText text;
  // Always there, and first: faults of the whole are told at the first line, and no fault of the whole is a
  // fault of `seed`.
  const auto seed = take("seed");
  text.add(seed ? *seed : Element{"seed", "<seed>", {fmt::format("{}", simulation::LiveConfig().seed)}},
           false);
  for (Element& element : std::exchange(elements_, {})) {
    if (is_boolean(element.path)) element.values = {to_boolean(element) ? "true" : "false"};
    if (element.path == "sky.systems") {
      std::vector<std::string> names;
      for (std::string& value : element.values) {
        std::replace(value.begin(), value.end(), ',', ' ');
        for (const std::string_view name : split_blanks(value)) names.emplace_back(name);
      }
      if (names.empty()) throw error(element, "names no system", "write GPS, GLONASS, Galileo, BeiDou, QZSS");
      element.values = std::move(names);
    }
    text.add(element, is_list(element.path));
  }
  const std::string yaml = text.write();
  constexpr const char* kName = "plugin";
  try {
    return simulation::parse_live_config(yaml, kName);
  } catch (const InputError& e) {
    // A fault of a file that an element names has that file's lines.
    if (!e.file().empty() && e.file() != kName) throw;
    std::string problem = e.problem();
    std::string tag;
    if (const auto* line = text.at(e.line())) {
      const std::string key = line->first + ": ";
      const bool about_key = problem.starts_with(key);
      if (about_key) problem.erase(0, key.size());
      if (about_key || text.is_section(e.line())) tag = line->second;
    }
    const std::string cure = in_words_of_sdf(e.cure());
    problem = in_words_of_sdf(problem);
    throw error({{}, tag, {}}, problem, cure);
  }
}

}  // namespace canyon::adapters
