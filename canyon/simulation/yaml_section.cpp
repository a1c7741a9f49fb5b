#include "canyon/simulation/yaml_section.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <stdexcept>
#include <utility>

#include "canyon/base/text.hpp"

namespace canyon::simulation {
namespace {

int line_of(const YAML::Node& node, int fallback) {
  const YAML::Mark mark = node.Mark();
  return mark.line >= 0 ? mark.line + 1 : fallback;
}

// "max_range" of "max_range_m": the key without the unit that its name ends with.
std::string without_unit(const std::string& key) {
  static const std::vector<std::string> units{"_deg", "_rad", "_m",   "_km",      "_cm",  "_mm",  "_ft",
                                              "_s",   "_ms",  "_min", "_h",       "_hz",  "_khz", "_mps",
                                              "_kmh", "_kph", "_ns",  "_degrees", "_mhz", "_us"};
  for (const std::string& unit : units) {
    if (key.size() > unit.size() && key.compare(key.size() - unit.size(), unit.size(), unit) == 0) {
      return key.substr(0, key.size() - unit.size());
    }
  }
  return key;
}

std::optional<std::string> suggestion(const std::string& key, const std::vector<std::string>& known) {
  // A word for the same thing that no spelling leads from.
  static const std::vector<std::pair<std::string, std::string>> kMeant{{"preset", "profile"}};
  for (const auto& [word, meant] : kMeant) {
    if (key == word && std::find(known.begin(), known.end(), meant) != known.end()) return meant;
  }
  for (const std::string& candidate : known) {
    if (without_unit(candidate) == without_unit(key)) return candidate;
  }
  return closest(key, known);
}

std::string join(const std::vector<std::string>& words) {
  std::string joined;
  for (const std::string& word : words) joined += (joined.empty() ? "" : ", ") + word;
  return joined;
}

}  // namespace

YamlSection YamlSection::parse(const std::string& text, const std::filesystem::path& file,
                               std::vector<std::string> known, std::string_view kind,
                               std::string_view needs) {
  auto document = std::make_shared<YamlDocument>();
  document->file = file;
  document->kind = kind;
  document->known = std::move(known);
  std::vector<YAML::Node> documents;
  try {
    documents = YAML::LoadAll(text);
  } catch (const YAML::Exception& e) {
    throw InputError(file, e.mark.line >= 0 ? e.mark.line + 1 : 0, fmt::format("not YAML: {}", e.msg),
                     "check indentation, quotes and brackets there");
  }
  if (documents.empty() || documents.front().IsNull()) {
    throw InputError(file, 0, "the file is empty", needs);
  }
  if (documents.size() > 1) {
    throw InputError(file, line_of(documents[1], 0), "a second YAML document begins here",
                     fmt::format("keep one {} per file", kind));
  }
  return {std::move(document), "", documents.front(), line_of(documents.front(), 1)};
}

YamlSection::YamlSection(std::shared_ptr<const YamlDocument> document, std::string path,
                         const YAML::Node& node, int line)
    : document_(std::move(document)), path_(std::move(path)), line_(line) {
  if (node.IsNull()) return;
  if (!node.IsMap()) {
    throw section_error(
        fmt::format("{} is not a mapping", path_.empty() ? "the " + document_->kind : "'" + path_ + "'"),
        "write 'key: value' lines below it");
  }
  const std::vector<std::string> known = known_keys();
  for (const auto& pair : node) {
    Entry entry;
    entry.line = line_of(pair.first, line_);
    if (!pair.first.IsScalar()) {
      throw InputError(document_->file, entry.line, "a key is not a plain word");
    }
    entry.key = pair.first.Scalar();
    entry.value = pair.second;
    if (std::find(known.begin(), known.end(), entry.key) == known.end()) {
      const std::string where = path_.empty() ? "" : fmt::format(" in '{}'", path_);
      const auto similar = suggestion(entry.key, known);
      throw InputError(
          document_->file, entry.line, fmt::format("unknown key '{}'{}", entry.key, where),
          similar ? fmt::format("did you mean '{}'?", *similar) : fmt::format("known here: {}", join(known)));
    }
    if (const Entry* earlier = find(entry.key)) {
      throw InputError(document_->file, entry.line,
                       fmt::format("'{}' comes twice, first in line {}", entry.key, earlier->line),
                       "remove one of them");
    }
    entries_.push_back(std::move(entry));
  }
}

std::vector<std::string> YamlSection::known_keys() const {
  const std::string prefix = path_.empty() ? "" : path_ + ".";
  std::vector<std::string> keys;
  for (const std::string& path : document_->known) {
    if (path.compare(0, prefix.size(), prefix) != 0) continue;
    const std::size_t end = path.find_first_of(".[", prefix.size());
    std::string key = path.substr(prefix.size(), end == std::string::npos ? end : end - prefix.size());
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) keys.push_back(std::move(key));
  }
  return keys;
}

const YamlSection::Entry* YamlSection::find(std::string_view key) const {
  const auto it =
      std::find_if(entries_.begin(), entries_.end(), [key](const Entry& entry) { return entry.key == key; });
  return it == entries_.end() ? nullptr : &*it;
}

YamlSection::Entry* YamlSection::take(std::string_view key) {
  const std::vector<std::string> known = known_keys();
  if (std::find(known.begin(), known.end(), key) == known.end()) {
    // The table is what people are told: a key beside it would be a secret.
    throw std::logic_error(fmt::format("scenario key {}.{} is not in the table", path_, key));
  }
  auto* entry = const_cast<Entry*>(find(key));
  if (entry != nullptr) entry->consumed = true;
  return entry;
}

int YamlSection::line(std::string_view key) const {
  const Entry* entry = find(key);
  return entry == nullptr ? line_ : entry->line;
}

bool YamlSection::has(std::string_view key) const {
  return find(key) != nullptr;
}

bool YamlSection::is_section(std::string_view key) const {
  const Entry* entry = find(key);
  return entry != nullptr && entry->value.IsMap();
}

bool YamlSection::is_list(std::string_view key) const {
  const Entry* entry = find(key);
  return entry != nullptr && entry->value.IsSequence();
}

InputError YamlSection::error(std::string_view key, std::string_view problem, std::string_view cure) const {
  return {document_->file, line(key), fmt::format("{}: {}", key, problem), cure};
}

InputError YamlSection::section_error(std::string_view problem, std::string_view cure) const {
  return {document_->file, line_, problem, cure};
}

std::string YamlSection::scalar(const Entry& entry) const {
  if (entry.value.IsNull())
    throw error(entry.key, "has no value", "write one after the colon, or remove the key");
  if (!entry.value.IsScalar()) {
    throw error(entry.key, entry.value.IsMap() ? "is a mapping where one value belongs"
                                               : "is a list where one value belongs");
  }
  return entry.value.Scalar();
}

double YamlSection::to_number(const Entry& entry, const std::string& text, const Range& range) const {
  const std::optional<double> value = parse_double(text);
  if (!value) {
    // "10 deg", "2m": a number with its unit.
    const std::size_t end = text.find_first_not_of("+-.0123456789eE");
    const bool has_unit =
        end != std::string::npos && end > 0 && parse_double(text.substr(0, end)).has_value();
    throw error(entry.key, fmt::format("'{}' is not a number", text),
                has_unit ? "give the number alone, the unit is in the key's name" : "");
  }
  const bool inside = (range.low_open ? *value > range.low : *value >= range.low) &&
                      (range.high_open ? *value < range.high : *value <= range.high);
  if (!inside) {
    throw error(entry.key, fmt::format("{} is out of range", text),
                fmt::format("it is {} {} and {} {}", range.low_open ? "above" : "at least", range.low,
                            range.high_open ? "below" : "at most", range.high));
  }
  return *value;
}

std::optional<double> YamlSection::number(std::string_view key, const Range& range) {
  const Entry* entry = take(key);
  if (entry == nullptr) return std::nullopt;
  return to_number(*entry, scalar(*entry), range);
}

std::optional<double> YamlSection::number_or_none(std::string_view key, const Range& range) {
  const Entry* entry = take(key);
  if (entry == nullptr) return std::nullopt;
  const std::string text = scalar(*entry);
  if (text == "none") return std::numeric_limits<double>::infinity();
  return to_number(*entry, text, range);
}

std::optional<std::int64_t> YamlSection::integer(std::string_view key, std::int64_t low, std::int64_t high) {
  const Entry* entry = take(key);
  if (entry == nullptr) return std::nullopt;
  const std::string text = scalar(*entry);
  const auto value = parse_integer(text);
  if (!value) throw error(key, fmt::format("'{}' is not a whole number", text));
  if (*value < low || *value > high) {
    throw error(key, fmt::format("{} is out of range", text),
                fmt::format("it runs from {} to {}", low, high));
  }
  return *value;
}

std::optional<bool> YamlSection::boolean(std::string_view key) {
  const Entry* entry = take(key);
  if (entry == nullptr) return std::nullopt;
  const std::string text = scalar(*entry);
  bool value = false;
  if (!YAML::convert<bool>::decode(entry->value, value)) {
    throw error(key, fmt::format("'{}' is neither true nor false", text));
  }
  return value;
}

std::optional<std::string> YamlSection::text(std::string_view key) {
  const Entry* entry = take(key);
  if (entry == nullptr) return std::nullopt;
  std::string text = scalar(*entry);
  if (trim(text).empty()) throw error(key, "is empty");
  return text;
}

std::optional<std::string> YamlSection::choice(std::string_view key,
                                               const std::vector<std::string>& choices) {
  const std::optional<std::string> word = text(key);
  if (!word || std::find(choices.begin(), choices.end(), *word) != choices.end()) return word;
  const auto similar = closest(*word, choices);
  throw error(key, fmt::format("'{}' is unknown", *word),
              (similar ? fmt::format("did you mean '{}'? ", *similar) : "") +
                  fmt::format("known: {}", join(choices)));
}

std::optional<std::vector<std::string>> YamlSection::texts(std::string_view key) {
  const Entry* entry = take(key);
  if (entry == nullptr) return std::nullopt;
  if (!entry->value.IsSequence()) return std::vector<std::string>{*text(key)};
  std::vector<std::string> list;
  for (const YAML::Node& node : entry->value) {
    if (!node.IsScalar() || trim(node.Scalar()).empty()) {
      throw InputError(document_->file, line_of(node, entry->line),
                       fmt::format("{}: item {} is not one value", key, list.size() + 1));
    }
    list.push_back(node.Scalar());
  }
  if (list.empty()) throw error(key, "the list is empty", "give at least one item, or remove the key");
  return list;
}

std::optional<std::vector<double>> YamlSection::numbers(std::string_view key, const Range& range) {
  const Entry* entry = take(key);
  if (entry == nullptr) return std::nullopt;
  std::vector<double> values;
  if (entry->value.IsSequence()) {
    const auto items = texts(key);
    for (const std::string& item : *items) values.push_back(to_number(*entry, item, range));
    return values;
  }
  const std::string line = scalar(*entry);
  for (const std::string_view item : split_blanks(line)) {
    values.push_back(to_number(*entry, std::string(item), range));
  }
  if (values.empty()) throw error(key, "the list is empty");
  return values;
}

std::optional<std::vector<std::vector<double>>> YamlSection::rows(std::string_view key, std::size_t columns,
                                                                  const Range& range) {
  const Entry* entry = take(key);
  if (entry == nullptr) return std::nullopt;
  std::vector<std::vector<double>> rows;
  if (entry->value.IsSequence() && entry->value.size() > 0 && entry->value[0].IsSequence()) {
    for (const YAML::Node& row : entry->value) {
      std::vector<double> values;
      for (std::size_t i = 0; row.IsSequence() && i < row.size(); ++i) {
        values.push_back(to_number(*entry, row[i].IsScalar() ? row[i].Scalar() : "?", range));
      }
      if (values.size() != columns) {
        throw InputError(document_->file, line_of(row, entry->line),
                         fmt::format("{}: row {} has not {} numbers", key, rows.size() + 1, columns));
      }
      rows.push_back(std::move(values));
    }
    return rows;
  }
  const auto flat = numbers(key, range);
  if (flat->size() % columns != 0) {
    throw error(key, fmt::format("{} numbers make no rows of {}", flat->size(), columns));
  }
  for (std::size_t i = 0; i < flat->size(); i += columns) {
    const auto begin = flat->begin() + static_cast<std::ptrdiff_t>(i);
    rows.emplace_back(begin, begin + static_cast<std::ptrdiff_t>(columns));
  }
  return rows;
}

std::filesystem::path YamlSection::to_file(const Entry& entry, const std::string& text) const {
  const std::filesystem::path path = document_->file.parent_path() / text;
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) {
    throw error(entry.key, fmt::format("there is no file '{}'", path.string()),
                fmt::format("paths are relative to the {}'s folder", document_->kind));
  }
  if (std::filesystem::is_directory(path, ignored)) {
    throw error(entry.key, fmt::format("'{}' is a folder, not a file", path.string()));
  }
  return path;
}

std::optional<std::filesystem::path> YamlSection::existing_file(std::string_view key) {
  const std::optional<std::string> name = text(key);
  if (!name) return std::nullopt;
  return to_file(*find(key), *name);
}

std::optional<std::vector<std::filesystem::path>> YamlSection::existing_files(std::string_view key) {
  const auto names = texts(key);
  if (!names) return std::nullopt;
  std::vector<std::filesystem::path> paths;
  for (const std::string& name : *names) paths.push_back(to_file(*find(key), name));
  return paths;
}

std::optional<YamlSection> YamlSection::section(std::string_view key) {
  const Entry* entry = take(key);
  if (entry == nullptr) return std::nullopt;
  return YamlSection(document_, (path_.empty() ? "" : path_ + ".") + entry->key, entry->value, entry->line);
}

std::optional<std::vector<YamlSection>> YamlSection::sections(std::string_view key) {
  const Entry* entry = take(key);
  if (entry == nullptr) return std::nullopt;
  if (!entry->value.IsSequence()) {
    throw error(key, "is not a list", "begin each item with '- '");
  }
  std::vector<YamlSection> list;
  const std::string path = fmt::format("{}{}{}[]", path_, path_.empty() ? "" : ".", key);
  for (const YAML::Node& node : entry->value) {
    list.push_back(YamlSection(document_, path, node, line_of(node, entry->line)));
  }
  if (list.empty()) throw error(key, "the list is empty", "give at least one item, or remove the key");
  return list;
}

void YamlSection::finish() const {
  for (const Entry& entry : entries_) {
    if (!entry.consumed) {
      throw error(entry.key, "has no effect beside the other keys here",
                  "remove it, or see docs/scenario.md for what it belongs to");
    }
  }
}

}  // namespace canyon::simulation
