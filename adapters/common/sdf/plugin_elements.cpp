#include "adapters/common/sdf/plugin_elements.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "canyon/base/options/node.hpp"
#include "canyon/base/text.hpp"

namespace canyon::adapters {
namespace {

using options::Document;
using options::Key;
using options::Node;
using options::Type;

// Converts "noise.enabled" to "<noise><enabled>".
std::string tag_of(std::string_view path) {
  std::string tag;
  for (const std::string_view name : split(path, '.')) tag += fmt::format("<{}>", name);
  return tag;
}

std::string text_of(const sdf::ElementPtr& element) {
  const sdf::ParamPtr value = element->GetValue();
  return value ? std::string(trim(value->GetAsString())) : "";
}

}  // namespace

PluginElements::PluginElements(const sdf::ElementPtr& plugin, std::string plugin_name,
                               const options::Description& known)
    : plugin_name_(std::move(plugin_name)), known_(known.keys) {
  document_.set_keys(known);
  document_.word = "element";
  document_.page = "docs/sdf.md";
  document_.digits_are_booleans = true;
  root_.kind = Node::Kind::Mapping;
  if (!plugin) return;
  warn_attributes(plugin, "");
  convert(plugin, "", "", root_);
  warn_replaced();
}

InputError PluginElements::error(const std::string& tag, std::string_view problem,
                                 std::string_view hint) const {
  std::string text;
  for (const std::string& part : {plugin_name_, tag})
    if (!part.empty()) text += part + ": ";
  return InputError(text.append(problem), hint);
}

void PluginElements::convert(const sdf::ElementPtr& parent, const std::string& path, const std::string& tags,
                             Node& to) {
  for (sdf::ElementPtr child = parent->GetFirstElement(); child; child = child->GetNextElement()) {
    const std::string& name = child->GetName();
    const std::string child_path = path + name;
    const std::string tag = fmt::format("{}<{}>", tags, name);
    const std::string text = text_of(child);
    const bool has_children = child->GetFirstElement() != nullptr;
    warn_attributes(child, tag);
    const auto key =
        std::find_if(known_.begin(), known_.end(), [&](const Key& each) { return each.path == child_path; });
    const bool leaf = key != known_.end();
    const std::vector<std::string> inside = document_.keys_of(child_path);
    if (!leaf && inside.empty()) {
      warn_unknown(name, path, tags);
      continue;
    }
    const bool section = !inside.empty() && (has_children || (!leaf && text.empty()));
    if (section && !text.empty())
      throw error(tag, fmt::format("the text '{}' is next to elements", text), "remove it");
    // A word instead of a section switches it: options::Reader.
    const bool has_switch = std::find(inside.begin(), inside.end(), "enabled") != inside.end();
    if (!section && !leaf && !has_switch) {
      throw error(tag, fmt::format("has the text '{}' instead of elements", text),
                  fmt::format("put one of these inside: <{}>", fmt::join(inside, ">, <")));
    }
    if (!section && has_children) throw error(tag, "has elements instead of a value", "write only the value");
    if (!section && text.empty()) {
      // Models of PX4 and ROS use empty elements for the default.
      if (child_path == "robotNamespace" || child_path == "ros.namespace") continue;
      throw error(tag, "has no value", "write one between its tags, or remove it");
    }
    const bool list = !section && leaf && (key->type == Type::Texts || key->type == Type::Files);
    const auto earlier = std::find_if(to.entries.begin(), to.entries.end(),
                                      [&](const Node::Entry& entry) { return entry.key == name; });
    if (earlier != to.entries.end()) {
      if (!list) throw error(tag, "is given twice", section ? "merge the two" : "keep one");
      earlier->value.items.push_back(options::scalar_node(text));
      continue;
    }
    tags_.push_back(tag);
    to.entries.push_back({name, static_cast<int>(tags_.size()), options::scalar_node(text)});
    Node& value = to.entries.back().value;
    if (list) {
      value.kind = Node::Kind::List;
      value.items.push_back(options::scalar_node(text));
    } else if (section) {
      value.kind = Node::Kind::Mapping;
      convert(child, child_path + ".", tag, value);
    }
  }
}

void PluginElements::warn_attributes(const sdf::ElementPtr& element, const std::string& tags) {
  for (std::size_t i = 0; i < element->GetAttributeCount(); ++i) {
    const sdf::ParamPtr attribute = element->GetAttribute(static_cast<unsigned int>(i));
    const std::string& key = attribute->GetKey();
    const bool is_plugin_attribute = element->GetName() == "plugin" && (key == "name" || key == "filename");
    if (is_plugin_attribute || !attribute->GetSet() || key.find(':') != std::string::npos) continue;
    warnings_.push_back(
        fmt::format("the attribute {0}=\"{1}\" of <{2}> has no effect; write {3}<{0}>{1}</{0}>", key,
                    attribute->GetAsString(), element->GetName(),
                    tags.empty() ? fmt::format("<{}>", element->GetName()) : tags));
  }
}

void PluginElements::warn_unknown(const std::string& name, const std::string& path, const std::string& tags) {
  if (document_.replaced.contains(path + name)) {
    replaced_.emplace_back(path + name, fmt::format("{}<{}>", tags, name));
    return;
  }
  std::string meant;
  for (const Key& key : known_) {  // the right name in the wrong section
    const std::string_view last = std::string_view(key.path).substr(key.path.find_last_of('.') + 1);
    if (meant.empty() && last == name) meant = tag_of(key.path);
  }
  if (meant.empty()) {
    const std::string section = path.substr(0, path.empty() ? 0 : path.size() - 1);
    if (const auto similar = options::closest_key(name, document_.keys_of(section)))
      meant = fmt::format("{}<{}>", tags, *similar);
  }
  warnings_.push_back(fmt::format("{}<{}> is unknown and has no effect{}", tags, name,
                                  meant.empty() ? "" : fmt::format("; did you mean {}?", meant)));
}

void PluginElements::warn_replaced() {
  std::vector<std::pair<std::string, std::string>> lines;  // tags and their hint
  for (const auto& [path, tag] : replaced_) {
    const std::string& hint = document_.replaced.at(path);
    const auto same =
        std::find_if(lines.begin(), lines.end(), [&](const auto& line) { return line.second == hint; });
    if (same == lines.end())
      lines.emplace_back(tag, hint);
    else
      same->first += ", " + tag;
  }
  for (const auto& [tags, hint] : lines)
    warnings_.push_back(fmt::format("{} without effect: {}", tags, hint));
}

bool PluginElements::has_replaced(std::string_view path) const {
  return std::any_of(replaced_.begin(), replaced_.end(),
                     [&](const auto& each) { return each.first == path; });
}

std::optional<std::string> PluginElements::take(const std::string& name) {
  const Node::Entry* entry = root_.find(name);
  if (entry == nullptr) return std::nullopt;
  std::string text = entry->value.text;
  root_.entries.erase(root_.entries.begin() + (entry - root_.entries.data()));
  return text;
}

void PluginElements::put(std::string_view path, const std::string& text, const std::string& tag) {
  tags_.push_back(tag);
  options::set_at(root_, path, options::scalar_node(text, static_cast<int>(tags_.size())));
}

void PluginElements::put_default(std::string_view path, const std::string& text, const std::string& tag) {
  const Node::Entry* section = root_.find_path(path.substr(0, path.rfind('.')));
  if (!has(path) && (section == nullptr || section->value.kind == Node::Kind::Mapping)) put(path, text, tag);
}

Document PluginElements::document(const std::vector<std::filesystem::path>& folders,
                                  const ResourcePaths& resources) const {
  Document document = document_;
  document.fault = [this](const std::string& /*path*/, const std::string& /*key*/, int line,
                          std::string_view problem, std::string_view hint) {
    return error(line > 0 ? tags_[static_cast<std::size_t>(line) - 1] : "", problem, hint);
  };
  document.find_file = [folders, resources](const std::string& name,
                                            const options::SourceLocation& location) {
    std::vector<std::filesystem::path> looked;
    if (const auto file = find_resource(name, folders, resources, looked)) return *file;
    std::string positions;
    for (const auto& candidate : looked) positions += (positions.empty() ? "" : ", ") + candidate.string();
    throw location.error(
        fmt::format("there is no file '{}'; searched: {}", name, positions.empty() ? "nowhere" : positions),
        fmt::format("give a path relative to the folder of the file with the plugin, an absolute path, or "
                    "add its folder to {} (package://: ROS_PACKAGE_PATH)",
                    resources.variables));
  };
  return document;
}

}  // namespace canyon::adapters
