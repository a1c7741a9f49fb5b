#include "canyon/base/options/read.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <utility>

namespace canyon::options {

Reader::Reader(const Node& root, const Document& document) : document_(document) {
  if (document.other_names.empty()) {
    enter(root, "", root.line);
    return;
  }
  renamed_ = root;
  use_keys(renamed_, document);
  enter(renamed_, "", root.line);
}

void Reader::enter(const Node& node, std::string path, int line) {
  sections_.push_back({&node, std::move(path), line});
  const Section& section = here();
  const auto same = [&](const Section& each) { return each.node == &node; };
  if (std::any_of(entered_.begin(), entered_.end(), same)) return;
  entered_.push_back(section);
  if (node.kind == Node::Kind::Empty) return;
  if (node.kind != Node::Kind::Mapping) {
    throw fault({},
                fmt::format("{} is not a mapping",
                            section.path.empty() ? "the " + document_.kind : "'" + section.path + "'"),
                "write 'key: value' lines below it");
  }
  const std::vector<std::string> known = document_.keys_of(section.path);
  for (const Node::Entry& entry : node.entries) {
    if (std::find(known.begin(), known.end(), entry.key) == known.end()) {
      const std::string where = section.path.empty() ? "" : fmt::format(" in '{}'", section.path);
      throw InputError(document_.file, entry.line, fmt::format("unknown key '{}'{}", entry.key, where),
                       document_.hint_for(section.path, entry.key));
    }
    const Node::Entry* first = node.find(entry.key);
    if (first != &entry) {
      throw document_.error(section.path, "", entry.line,
                            fmt::format("'{}' comes twice, first in line {}", entry.key, first->line),
                            "remove one of them");
    }
  }
}

const Node::Entry* Reader::take(std::string_view key) {
  const Node::Entry* entry = here().node->find(key);
  if (entry != nullptr) used_.insert(entry);
  return entry;
}

std::string Reader::path_of(std::string_view key) const {
  return fmt::format("{}{}{}", here().path, here().path.empty() ? "" : ".", key);
}

bool Reader::has(std::string_view key) const {
  return here().node->find(key) != nullptr;
}

bool Reader::is_section(std::string_view key) const {
  const Node::Entry* entry = here().node->find(key);
  return entry != nullptr && entry->value.kind == Node::Kind::Mapping;
}

InputError Reader::fault(std::string_view key, std::string_view problem, std::string_view hint) const {
  const Node::Entry* entry = here().node->find(key);
  return document_.error(here().path, std::string(key), entry == nullptr ? here().line : entry->line, problem,
                         hint);
}

void Reader::one_of(std::initializer_list<std::string_view> keys, std::string_view hint) {
  std::string_view found;
  for (const std::string_view key : keys) {
    if (!has(key)) continue;
    if (!found.empty()) {
      std::string list;
      for (auto it = keys.begin(); it != keys.end(); ++it)
        list += fmt::format("{}{}", it == keys.begin() ? "" : it + 1 == keys.end() ? " or " : ", ", *it);
      throw fault(key, fmt::format("conflicts with '{}'", found), "keep one of " + list);
    }
    found = key;
  }
  if (found.empty() && !hint.empty()) {
    throw fault({}, fmt::format("{} has no content", here().path.empty() ? document_.kind : here().path),
                hint);
  }
}

void Reader::require(std::string_view key, std::string_view hint) {
  if (!has(key)) throw fault({}, fmt::format("'{}' is missing", key), hint);
}

void Reader::field(const Field& field, Value& value) {
  if (field.help.empty()) return;
  const Node::Entry* entry = take(field.name);
  if (entry == nullptr) return;
  value.read(entry->value, {document_, here().path, entry->key, entry->line});
}

bool Reader::begin(std::string_view name) {
  const Node::Entry* entry = take(name);
  if (entry == nullptr) return false;
  const Node* node = &entry->value;
  const std::string path = path_of(name);
  const std::vector<std::string> known = document_.keys_of(path);
  if (node->kind == Node::Kind::Scalar && std::find(known.begin(), known.end(), "enabled") != known.end()) {
    Node section;
    section.kind = Node::Kind::Mapping;
    section.line = entry->line;
    section.entries.push_back({"enabled", entry->line, *node});
    node = &switches_.emplace_back(std::move(section));
  }
  enter(*node, path, entry->line);
  return true;
}

std::optional<std::size_t> Reader::begin_list(std::string_view name, std::size_t /*count*/) {
  const Node::Entry* entry = take(name);
  if (entry == nullptr) return std::nullopt;
  if (entry->value.kind != Node::Kind::List) throw fault(name, "is not a list", "begin each item with '- '");
  if (entry->value.items.empty())
    throw fault(name, "the list is empty", "give at least one item, or remove the key");
  sections_.push_back({&entry->value, path_of(name) + "[]", entry->line});
  return entry->value.items.size();
}

void Reader::begin_item(std::size_t index) {
  const Section list = here();
  assert(list.node->kind == Node::Kind::List);
  const Node& item = list.node->items[index];
  enter(item, list.path, item.line > 0 ? item.line : list.line);
}

void Reader::finish() const {
  for (const Section& section : entered_) {
    for (const Node::Entry& entry : section.node->entries) {
      if (used_.count(&entry) != 0) continue;
      throw document_.error(section.path, entry.key, entry.line,
                            fmt::format("has no effect with the other {}s here", document_.word),
                            fmt::format("remove it, or see {} for the keys that it needs", document_.page));
    }
  }
}

}  // namespace canyon::options
