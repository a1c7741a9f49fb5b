#include "canyon/options/dotted.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace canyon::options {
namespace {

void put(Node& section, const std::string& key, const std::string& path, const Node::Entry& from,
         const Document& document) {
  const std::size_t dot = key.find('.');
  const std::string name = key.substr(0, dot);
  const std::string here = path.empty() ? name : path + "." + name;
  const bool mapping = from.value.kind == Node::Kind::Mapping;
  if (dot == std::string::npos && !mapping) {
    section.entries.push_back({name, from.line, from.value});  // a reader finds what comes twice
    return;
  }
  const auto at = std::find_if(section.entries.begin(), section.entries.end(),
                               [&](const Node::Entry& entry) { return entry.key == name; });
  if (at != section.entries.end() && at->value.kind != Node::Kind::Mapping) {
    throw document.error(path, name, from.line, "is both a value and a section", "keep one of them");
  }
  Node* below = nullptr;
  if (at == section.entries.end()) {
    Node empty;
    empty.kind = Node::Kind::Mapping;
    empty.line = from.line;
    section.entries.push_back({name, from.line, std::move(empty)});
    below = &section.entries.back().value;
  } else {
    below = &at->value;
  }
  if (dot != std::string::npos) return put(*below, key.substr(dot + 1), here, from, document);
  for (const Node::Entry& entry : from.value.entries) put(*below, entry.key, here, entry, document);
}

}  // namespace

Node without_dots(const Node& root, const Document& document) {
  if (root.kind != Node::Kind::Mapping) return root;
  Node result;
  result.kind = Node::Kind::Mapping;
  result.line = root.line;
  for (const Node::Entry& entry : root.entries) put(result, entry.key, "", entry, document);
  return result;
}

void DottedWriter::field(const Field& field, Value& value) {
  if (!value.given() || field.help.empty()) return;
  text_ += fmt::format("{}{}: {}\n", path_, field.name, value.text());
}

bool DottedWriter::begin(std::string_view name) {
  path_ += fmt::format("{}.", name);
  return true;
}

// Items have no names.
std::optional<std::size_t> DottedWriter::begin_list(std::string_view /*name*/, std::size_t /*count*/) {
  return std::nullopt;
}

void DottedWriter::end() {
  path_.pop_back();
  path_.resize(path_.rfind('.') + 1);  // npos + 1 is 0
}

}  // namespace canyon::options
