#include "canyon/study/settings_tree.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

namespace canyon::study {
namespace {

using options::Node;

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

Node& entry_of(Node& mapping, const std::string& name, std::string_view key) {
  if (mapping.kind == Node::Kind::Empty) mapping.kind = Node::Kind::Mapping;
  if (mapping.kind != Node::Kind::Mapping) {
    throw InputError(fmt::format("'{}': the value before '{}' is not a section", key, name));
  }
  for (Node::Entry& entry : mapping.entries) {
    if (entry.key == name) return entry.value;
  }
  mapping.entries.push_back({name, mapping.line, {}});
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
  Node& below = entry_of(node, step.name, key);
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

}  // namespace canyon::study
