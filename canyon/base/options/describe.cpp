#include "canyon/base/options/describe.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cassert>
#include <cmath>

#include "canyon/base/json.hpp"

namespace canyon::options {
namespace {

std::string join_path(const std::string& section, std::string_view key) {
  return fmt::format("{}{}{}", section, section.empty() ? "" : ".", key);
}

Json number_schema(const Range& range, const char* type) {
  Json schema{{"type", type}};
  if (std::isfinite(range.low)) schema[range.low_open ? "exclusiveMinimum" : "minimum"] = range.low;
  if (std::isfinite(range.high)) schema[range.high_open ? "exclusiveMaximum" : "maximum"] = range.high;
  return schema;
}

Json list_of(const Json& item) {
  return {{"type", "array"}, {"items", item}, {"minItems", 1}};
}

Json value_schema(const Key& key) {
  const Json text{{"type", "string"}, {"minLength", 1}};
  const Json several = {{"anyOf", {text, list_of(text)}}};
  const Json number = number_schema(key.range.value_or(Range{}), "number");
  switch (key.type) {
    case Type::Number: {
      Json any = Json::array({number});
      if (key.range && key.range->none) any.push_back({{"const", "none"}});
      if (key.range && key.range->fraction)
        any.push_back({{"type", "string"}, {"pattern", "^ *[0-9.]+ */ *[0-9.]+ *$"}});
      return any.size() == 1 ? number : Json{{"anyOf", any}};
    }
    case Type::Integer:
      return number_schema(key.range.value_or(Range{}), "integer");
    case Type::Boolean:
      return {{"type", "boolean"}};
    case Type::Text:
      return {{"type", Json::array({"string", "number"})}};
    case Type::Choice:
      return {{"enum", key.words}};
    case Type::Texts:
      if (!key.words.empty()) {
        const Json word{{"enum", key.words}};
        return {{"anyOf", {word, list_of(word)}}};
      }
      return several;
    case Type::Files:
      return several;
    case Type::File:
      return text;
    case Type::Numbers:
      return {{"anyOf", {number, text, list_of(number)}}};
    case Type::Rows:
      return {{"anyOf", {text, list_of(number), list_of(list_of(number))}}};
  }
  return Json::object();
}

Json section_schema() {
  return {{"type", Json::array({"object", "null"})},
          {"properties", Json::object()},
          {"additionalProperties", false}};
}

/// The schema of section `path`, made if it is not there yet.
Json& section_at(Json& root, const std::string& path) {
  Json* section = &root;
  for (std::size_t begin = 0; begin < path.size();) {
    const std::size_t end = std::min(path.find('.', begin), path.size());
    std::string name = path.substr(begin, end - begin);
    const bool list = name.size() > 2 && name.compare(name.size() - 2, 2, "[]") == 0;
    if (list) name.resize(name.size() - 2);
    Json& property = (*section)["properties"][name];
    // A key may be a value or a section: `start`, `outputs`.
    Json* whole = &property;
    if (property.contains("anyOf")) {
      if (!list && !property["anyOf"].back().contains("properties"))
        property["anyOf"].push_back(section_schema());
      whole = &property["anyOf"].back();
    } else if (!property.is_null() && !property.contains("properties") && !property.contains("items")) {
      const Json value = property;
      property = {{"anyOf", {value, section_schema()}}};
      whole = &property["anyOf"].back();
    } else if (property.is_null()) {
      property = list ? list_of(section_schema()) : section_schema();
    }
    section = list ? &(*whole)["items"] : whole;
    begin = end + 1;
  }
  return *section;
}

}  // namespace

std::string Key::values() const {
  if (type == Type::Boolean) return "true, false";
  if (!words.empty()) return fmt::format("{}", fmt::join(words, ", "));
  return range ? range->interval() : "";
}

void Description::add_other_name(const std::string& name, const std::string& path, std::string_view effect) {
  const auto known = std::find_if(keys.begin(), keys.end(), [&](const Key& key) { return key.path == path; });
  assert(known != keys.end());
  Key key = *known;
  key.path = name;
  key.default_value.clear();
  key.meaning = fmt::format("the same as {}{}", path, effect);
  keys.push_back(std::move(key));
  other_names.emplace_back(name, path);
}

std::string Description::current(const std::string& path) const {
  const auto at = std::find_if(former_names.begin(), former_names.end(),
                               [&](const auto& each) { return each.first == path; });
  return at == former_names.end() ? path : at->second;
}

std::vector<std::string> Description::paths() const {
  std::vector<std::string> result;
  for (const Key& key : keys) result.push_back(key.path);
  return result;
}

void Describer::one_of(std::initializer_list<std::string_view> keys, std::string_view hint) {
  description_.alternatives.push_back({path_, {keys.begin(), keys.end()}, !hint.empty()});
}

void Describer::require(std::string_view key, std::string_view /*hint*/) {
  description_.required_sections[path_].emplace_back(key);
}

void Describer::replaced(std::string_view key, std::string_view hint) {
  description_.replaced.emplace(join_path(path_, key), hint);
}

void Describer::other_name(std::string_view name, std::string_view path) {
  other_names_.emplace_back(join_path(path_, name), join_path(path_, path));
}

void Describer::former_name(std::string_view name, std::string_view path) {
  description_.former_names.emplace_back(join_path(path_, name), join_path(path_, path));
}

void Describer::field(const Field& field, Value& value) {
  if (field.help.empty()) return;
  Key key;
  key.path = join_path(path_, field.name);
  key.unit = field.unit;
  const std::vector<std::string>& required = description_.required_sections[path_];
  key.required = std::find(required.begin(), required.end(), field.name) != required.end();
  if (!field.absent.empty())
    key.default_value = field.absent;
  else if (value.given() && !key.required)
    key.default_value = value.text();
  key.meaning = field.help;
  key.type = value.type();
  key.range = value.range();
  key.words = value.words();
  if (value.given()) key.value = value.exact();
  const auto same = [&](const Key& each) { return each.path == key.path; };
  if (std::none_of(description_.keys.begin(), description_.keys.end(), same))
    description_.keys.push_back(std::move(key));
}

bool Describer::begin(std::string_view name) {
  parents_.push_back(path_);
  path_ = join_path(path_, name);
  return true;
}

std::optional<std::size_t> Describer::begin_list(std::string_view name, std::size_t /*count*/) {
  parents_.push_back(path_);
  path_ = join_path(path_, name) + "[]";
  return 1;
}

void Describer::end() {
  path_ = std::move(parents_.back());
  parents_.pop_back();
}

Description Describer::take() && {
  for (const auto& [name, path] : other_names_) description_.add_other_name(name, path);
  return std::move(description_);
}

std::string markdown(const std::vector<Key>& keys) {
  std::string text = "| key | unit | default | values | meaning |\n|---|---|---|---|---|\n";
  for (const Key& key : keys) {
    text += fmt::format("| `{}` | {} | {} | {} | {} |\n", key.path, key.unit, key.default_value, key.values(),
                        key.meaning);
  }
  return text;
}

std::string plain_text(const std::vector<Key>& keys) {
  std::size_t width = 0;
  for (const Key& key : keys) width = std::max(width, key.path.size());
  std::string text;
  std::string group;
  for (const Key& key : keys) {
    const std::string section = key.path.substr(0, key.path.find_first_of(".["));
    if (section != group && !text.empty() && key.path.size() > section.size()) text += '\n';
    group = section;
    std::string facts = key.unit;
    if (!key.default_value.empty())
      facts += fmt::format("{}default {}", facts.empty() ? "" : ", ", key.default_value);
    text += fmt::format("  {:<{}}  {}{}\n", key.path, width, key.meaning,
                        facts.empty() ? "" : " [" + facts + "]");
  }
  return text;
}

std::string json_schema(const Description& description, std::string_view title) {
  Json root{{"$schema", "http://json-schema.org/draft-07/schema#"}, {"title", title}};
  const Json whole = section_schema();
  for (const auto& [key, value] : whole.members()) root[key] = value;
  root["type"] = "object";
  for (const Key& key : description.keys) {
    const std::size_t dot = key.path.rfind('.');
    Json& section = section_at(root, dot == std::string::npos ? "" : key.path.substr(0, dot));
    Json schema = value_schema(key);
    std::string about = key.meaning;
    if (!key.unit.empty()) about += " [" + key.unit + "]";
    if (!key.default_value.empty()) about += "; default: " + key.default_value;
    schema["description"] = about;
    const std::string name = key.path.substr(dot == std::string::npos ? 0 : dot + 1);
    section["properties"][name] = schema;
    // Reader accepts a word instead of the section.
    if (name == "enabled") section["type"] = Json::array({"object", "boolean", "null"});
  }
  for (const auto& [section, keys] : description.required_sections)
    if (!keys.empty()) section_at(root, section)["required"] = keys;
  for (const Description::Alternatives& each : description.alternatives) {
    Json& section = section_at(root, each.section);
    Json choices = Json::array();
    for (const std::string& key : each.keys) choices.push_back({{"required", Json::array({key})}});
    if (!each.one_needed) choices.push_back({{"not", {{"anyOf", choices}}}});
    const Json empty{{"type", "null"}};
    section["allOf"].push_back({{"anyOf", Json::array({empty, Json{{"oneOf", choices}}})}});
  }
  return root.dump(2) + "\n";
}

}  // namespace canyon::options
