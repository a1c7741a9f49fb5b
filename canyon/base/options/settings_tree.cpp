// Declared in canyon/base/options/node.hpp.
#include "canyon/base/options/node.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

namespace canyon::options {
namespace {

/// One step of a key: "receivers[0]" is {"receivers", true, "0"}.
struct Step {
  std::string name;
  bool item = false;
  std::string which;
};

Step parse_step(std::string_view text, std::string_view key) {
  const std::size_t open = text.find('[');
  Step step{std::string(text.substr(0, open)), open != std::string_view::npos, {}};
  if (step.item && text.back() == ']') step.which = text.substr(open + 1, text.size() - open - 2);
  if (step.name.empty() || (step.item && text.back() != ']')) {
    throw InputError(fmt::format("'{}' is not a key", key), "write section.key, list[0].key or list[].key");
  }
  return step;
}

Node& entry_of(Node& mapping, const std::string& name, std::string_view key, int line) {
  if (mapping.kind == Node::Kind::Empty) mapping.kind = Node::Kind::Mapping;
  if (mapping.kind != Node::Kind::Mapping) {
    throw InputError(fmt::format("'{}': the value before '{}' is not a section", key, name));
  }
  for (Node::Entry& entry : mapping.entries) {
    if (entry.key == name) return entry.value;
  }
  mapping.entries.push_back({name, line > 0 ? line : mapping.line, {}});
  return mapping.entries.back().value;
}

std::vector<Node*> items_of(Node& list, const Step& step, std::string_view key) {
  if (list.kind == Node::Kind::Empty) {
    list.kind = Node::Kind::List;
    list.items.emplace_back().kind = Node::Kind::Mapping;
  }
  if (list.kind != Node::Kind::List) throw InputError(fmt::format("'{}': {} is not a list", key, step.name));
  std::vector<Node*> chosen;
  const auto index = parse_integer(step.which);
  for (std::size_t i = 0; i < list.items.size(); ++i) {
    const Node::Entry* name = list.items[i].find("name");
    if (step.which.empty() || (index && *index == static_cast<long long>(i)) ||
        (!index && name != nullptr && name->value.text == step.which)) {
      chosen.push_back(&list.items[i]);
    }
  }
  if (chosen.empty() && !step.which.empty()) {
    throw InputError(fmt::format("'{}': {} has no item {}", key, step.name, step.which),
                     fmt::format("it has {}, the first is 0; or name one", list.items.size()));
  }
  return chosen;
}

void set_from(Node& node, const std::vector<std::string_view>& steps, std::size_t i, std::string_view key,
              const Node& value) {
  const Step step = parse_step(steps[i], key);
  Node& below = entry_of(node, step.name, key, value.line);
  std::vector<Node*> targets{&below};
  if (step.item) targets = items_of(below, step, key);
  for (Node* target : targets) {
    if (i + 1 == steps.size()) {
      *target = value;
    } else {
      set_from(*target, steps, i + 1, key, value);
    }
  }
}

/// set_at(), whose error is one of the document.
void set_key(Node& root, const std::string& path, const Node& value, const Document& document) {
  try {
    set_at(root, path, value);
  } catch (const InputError& e) {
    throw document.error("", path, value.line, e.problem(), e.cure());
  }
}

void put_without_dots(Node& root, const std::string& path, const Node::Entry& from,
                      const Document& document) {
  const Node::Entry* there = root.find_path(path);
  const bool section = from.value.kind == Node::Kind::Mapping;
  if (there != nullptr && (there->value.kind == Node::Kind::Mapping) != section) {
    throw document.error("", path, from.line, "is both a value and a section", "keep one of them");
  }
  if (there != nullptr && !section) {
    throw document.error("", path, from.line, fmt::format("comes twice, first in line {}", there->line),
                         "remove one of them");
  }
  for (const Node::Entry& entry : from.value.entries) {
    put_without_dots(root, fmt::format("{}.{}", path, entry.key), entry, document);
  }
  Node value = from.value;
  value.line = from.line;
  if (!section || (there == nullptr && value.entries.empty())) set_key(root, path, value, document);
}

/// Takes the value of a dotted key out of a mapping, and sections that it leaves empty. The value has the
/// line of its key.
std::optional<Node> take_path(Node& mapping, std::string_view path) {
  const std::size_t dot = path.find('.');
  const auto at = std::find_if(mapping.entries.begin(), mapping.entries.end(),
                               [&](const Node::Entry& entry) { return entry.key == path.substr(0, dot); });
  if (at == mapping.entries.end()) return std::nullopt;
  std::optional<Node> taken;
  if (dot == std::string_view::npos) {
    taken = std::move(at->value);
    taken->line = at->line;
  } else {
    taken = take_path(at->value, path.substr(dot + 1));
    if (!taken || !at->value.entries.empty()) return taken;
  }
  mapping.entries.erase(at);
  return taken;
}

/// Plain where YAML takes it for the same text whatever stands around it.
std::string scalar_text(const std::string& text) {
  const auto plain = [](unsigned char c) {
    return c >= 0x80 || (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
           c == '_' || c == '.' || c == '/' || c == '+' || c == '-' || c == ' ';
  };
  if (!text.empty() && text.front() != ' ' && text.back() != ' ' && text != "-" &&
      text.compare(0, 2, "- ") != 0 && std::all_of(text.begin(), text.end(), plain)) {
    return text;
  }
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    if (c == '\n') {
      quoted += "\\n";
    } else if (c == '\t') {
      quoted += "\\t";
    } else {
      quoted += c;
    }
  }
  return quoted + '"';
}

}  // namespace

void set_at(Node& root, std::string_view key, const Node& value) {
  set_from(root, split(key, '.'), 0, key, value);
}

Node without_dots(const Node& root, const Document& document) {
  if (root.kind != Node::Kind::Mapping) return root;
  Node result;
  result.kind = Node::Kind::Mapping;
  result.line = root.line;
  for (const Node::Entry& entry : root.entries) put_without_dots(result, entry.key, entry, document);
  return result;
}

void use_keys(Node& root, const Document& document) {
  for (const auto& [name, path] : document.other_names) {
    const bool both = root.find_path(path) != nullptr;
    const std::optional<Node> value = take_path(root, name);
    if (!value) continue;
    if (both)
      throw document.error("", name, value->line, fmt::format("conflicts with '{}'", path), "keep one");
    set_key(root, path, *value, document);
  }
}

std::string plain_key(std::string_view key) {
  std::string plain;
  bool inside = false;
  for (const char c : key) {
    if (c == ']') inside = false;
    if (!inside) plain += c;
    if (c == '[') inside = true;
  }
  return plain;
}

std::string flow_text(const Node& node) {
  std::vector<std::string> parts;
  switch (node.kind) {
    case Node::Kind::Empty:
      return "null";
    case Node::Kind::Scalar:
      return scalar_text(node.text);
    case Node::Kind::List:
      for (const Node& item : node.items) parts.push_back(flow_text(item));
      return fmt::format("[{}]", fmt::join(parts, ", "));
    case Node::Kind::Mapping:
      for (const Node::Entry& entry : node.entries) {
        parts.push_back(fmt::format("{}: {}", scalar_text(entry.key), flow_text(entry.value)));
      }
      return fmt::format("{{{}}}", fmt::join(parts, ", "));
  }
  return {};
}

Node scalar_node(std::string text, int line) {
  Node node;
  node.kind = Node::Kind::Scalar;
  node.line = line;
  node.text = std::move(text);
  return node;
}

}  // namespace canyon::options
