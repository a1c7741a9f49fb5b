#include "canyon/base/options/node.hpp"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <initializer_list>
#include <limits>
#include <sstream>
#include <system_error>

#include "canyon/base/file_kind.hpp"
#include "canyon/base/named.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/base/text.hpp"

namespace canyon::options {
namespace {

int line_of(const YAML::Node& node, int fallback) {
  const YAML::Mark mark = node.Mark();
  return mark.line >= 0 ? mark.line + 1 : fallback;
}

/// Throws with the detected kind of a text that is no document. Texts named YAML or JSON get their own error.
void refuse_other_kind(const std::string& text, const Document& document) {
  const std::string ending = document.file.extension().string();
  if (ending == ".yaml" || ending == ".yml" || ending == ".json") return;
  constexpr std::size_t kHead = std::size_t{1} << 14;
  const auto other = wrong_kind_error(std::string_view(text).substr(0, kHead), document.file,
                                      "a " + document.kind + " (YAML)");
  if (other) throw InputError(*other);
}

// Finds the beginnings of documents, and rejects too many nodes.
class EventCounter final : public YAML::EventHandler {
 public:
  explicit EventCounter(const Document& document) : document_(document) {}
  int started_at = 0;

  void OnDocumentStart(const YAML::Mark& mark) override { started_at = mark.line + 1; }
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t) override { count(mark); }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override { count(mark); }
  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t, const std::string&) override {
    count(mark);
  }
  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                       YAML::EmitterStyle::value) override {
    count(mark);
  }
  void OnSequenceEnd() override {}
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t,
                  YAML::EmitterStyle::value) override {
    count(mark);
  }
  void OnMapEnd() override {}

 private:
  void count(const YAML::Mark& mark) {
    if (++count_ > 2'000'000) {
      throw InputError(document_.file, mark.line + 1, "the YAML is too large",
                       "it has over 2 million values");
    }
  }

  const Document& document_;
  int count_ = 0;
};

// "max_range" of "max_range_m": the key without its unit suffix.
std::string without_unit(const std::string& key) {
  static const std::vector<std::string> units{"_deg", "_rad", "_m",   "_km",      "_cm",  "_mm",  "_ft",
                                              "_s",   "_ms",  "_min", "_h",       "_hz",  "_khz", "_mps",
                                              "_kmh", "_kph", "_ns",  "_degrees", "_mhz", "_us"};
  for (const std::string& unit : units)
    if (key.size() > unit.size() && key.compare(key.size() - unit.size(), unit.size(), unit) == 0)
      return key.substr(0, key.size() - unit.size());
  return key;
}

// In yaml-cpp's tree aliases share their node; in Node they are copied. A few lines of aliases could
// otherwise exceed any memory, or recurse without end.
class Converter {
 public:
  explicit Converter(const Document& document) : document_(document) {}

  Node convert(const YAML::Node& from, int line, int depth) {
    Node node;
    node.line = line_of(from, line);
    if (++count_ > 2'000'000 || depth > 100) {
      throw InputError(document_.file, node.line, "the YAML is too large or too deep",
                       "look for aliases ('*name') that refer to themselves");
    }
    if (from.IsScalar()) {
      node.kind = Node::Kind::Scalar;
      node.text = from.Scalar();
    } else if (from.IsSequence()) {
      node.kind = Node::Kind::List;
      for (const YAML::Node& item : from) node.items.push_back(convert(item, node.line, depth + 1));
    } else if (from.IsMap()) {
      node.kind = Node::Kind::Mapping;
      for (const auto& pair : from) {
        const int key_line = line_of(pair.first, node.line);
        if (!pair.first.IsScalar()) throw InputError(document_.file, key_line, "a key is not a plain word");
        Node value = convert(pair.second, key_line, depth + 1);
        node.entries.push_back({pair.first.Scalar(), key_line, std::move(value)});
      }
    }
    return node;
  }

 private:
  const Document& document_;
  int count_ = 0;
};

constexpr const char* kOneValue = "write one value";

std::optional<double> parse_fraction(std::string_view text) {
  const std::size_t slash = text.find('/');
  if (slash == std::string_view::npos) return std::nullopt;
  const auto above = parse_double(text.substr(0, slash));
  const auto below = parse_double(text.substr(slash + 1));
  if (!above || !below || *below == 0) return std::nullopt;
  return *above / *below;
}

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
  if (step.name.empty() || (step.item && text.back() != ']'))
    throw InputError(fmt::format("'{}' is not a key", key), "write section.key, list[0].key or list[].key");
  return step;
}

Node& entry_of(Node& mapping, const std::string& name, std::string_view key, int line) {
  if (mapping.kind == Node::Kind::Empty) mapping.kind = Node::Kind::Mapping;
  if (mapping.kind != Node::Kind::Mapping)
    throw InputError(fmt::format("'{}': the value before '{}' is not a section", key, name));
  for (Node::Entry& entry : mapping.entries)
    if (entry.key == name) return entry.value;
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
        (!index && name != nullptr && name->value.text == step.which))
      chosen.push_back(&list.items[i]);
  }
  if (chosen.empty() && !step.which.empty()) {
    throw InputError(fmt::format("'{}': {} has no item {}", key, step.name, step.which),
                     fmt::format("it has {}; count from 0, or give a name", list.items.size()));
  }
  return chosen;
}

void set_from(Node& node, const std::vector<std::string_view>& steps, std::size_t i, std::string_view key,
              const Node& value) {
  const Step step = parse_step(steps[i], key);
  Node& below = entry_of(node, step.name, key, value.line);
  std::vector<Node*> targets{&below};
  if (step.item) targets = items_of(below, step, key);
  for (Node* target : targets)
    if (i + 1 == steps.size())
      *target = value;
    else
      set_from(*target, steps, i + 1, key, value);
}

/// set_at(), with errors reported for the document.
void set_key(Node& root, const std::string& path, const Node& value, const Document& document) {
  try {
    set_at(root, path, value);
  } catch (const InputError& e) {
    throw document.error("", path, value.line, e.problem(), e.hint());
  }
}

void put_without_dots(Node& root, const std::string& path, const Node::Entry& from,
                      const Document& document) {
  const Node::Entry* there = root.find_path(path);
  const bool section = from.value.kind == Node::Kind::Mapping;
  if (there != nullptr && (there->value.kind == Node::Kind::Mapping) != section)
    throw document.error("", path, from.line, "is both a value and a section", "keep one of them");
  if (there != nullptr && !section) {
    throw document.error("", path, from.line, fmt::format("comes twice, first in line {}", there->line),
                         "remove one of them");
  }
  for (const Node::Entry& entry : from.value.entries)
    put_without_dots(root, fmt::format("{}.{}", path, entry.key), entry, document);
  Node value = from.value;
  value.line = from.line;
  if (!section || (there == nullptr && value.entries.empty())) set_key(root, path, value, document);
}

/// Removes the value of a dotted key from a mapping, and empty sections. The value has its key's line.
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

/// Plain if YAML reads it as the same text in any context.
std::string scalar_text(const std::string& text) {
  const auto plain = [](unsigned char c) {
    return c >= 0x80 || (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') ||
           c == '_' || c == '.' || c == '/' || c == '+' || c == '-' || c == ' ';
  };
  if (!text.empty() && text.front() != ' ' && text.back() != ' ' && text != "-" &&
      text.compare(0, 2, "- ") != 0 && std::all_of(text.begin(), text.end(), plain))
    return text;
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    if (c == '\n')
      quoted += "\\n";
    else if (c == '\t')
      quoted += "\\t";
    else
      quoted += c;
  }
  return quoted + '"';
}

}  // namespace

const Node::Entry* Node::find(std::string_view key) const {
  const auto it =
      std::find_if(entries.begin(), entries.end(), [key](const Entry& entry) { return entry.key == key; });
  return it == entries.end() ? nullptr : &*it;
}

const Node::Entry* Node::find_path(std::string_view path) const {
  const std::size_t dot = path.find('.');
  const Entry* entry = find(path.substr(0, dot));
  return entry == nullptr || dot == std::string_view::npos ? entry
                                                           : entry->value.find_path(path.substr(dot + 1));
}

InputError Document::error(const std::string& path, const std::string& key, int line,
                           std::string_view problem, std::string_view hint) const {
  if (fault) return fault(path, key, line, problem, hint);
  return {file, line, key.empty() ? std::string(problem) : fmt::format("{}: {}", key, problem), hint};
}

std::vector<std::string> Document::keys_of(const std::string& path) const {
  const std::string prefix = path.empty() ? "" : path + ".";
  std::vector<std::string> keys;
  for (const std::string& each : known) {
    if (each.compare(0, prefix.size(), prefix) != 0) continue;
    const std::size_t end = each.find_first_of(".[", prefix.size());
    std::string key = each.substr(prefix.size(), end == std::string::npos ? end : end - prefix.size());
    if (std::find(keys.begin(), keys.end(), key) == keys.end()) keys.push_back(std::move(key));
  }
  return keys;
}

std::optional<std::string> closest_key(const std::string& key, const std::vector<std::string>& known) {
  for (const std::string& candidate : known)
    if (without_unit(candidate) == without_unit(key)) return candidate;
  return closest(key, known);
}

void Document::set_keys(const Description& description) {
  known = description.paths();
  replaced = description.replaced;
  other_names = description.other_names;
  other_names.insert(other_names.end(), description.former_names.begin(), description.former_names.end());
}

std::string Document::hint_for(const std::string& path, const std::string& key) const {
  const auto other = replaced.find(path.empty() ? key : fmt::format("{}.{}", path, key));
  if (other != replaced.end()) return other->second;
  const std::vector<std::string> here = keys_of(path);
  return did_you_mean(closest_key(key, here), fmt::format("known here: {}", fmt::join(here, ", ")));
}

Node parse_yaml(const std::string& text, const Document& document, std::string_view needs) {
  // YAML forbids control characters (YAML 1.2, 5.1), and yaml-cpp does not terminate for some of them.
  int line = 1;
  for (const char c : text) {
    line += c == '\n';
    if ((c >= 0 && c < ' ' && c != '\t' && c != '\n' && c != '\r') || c == 0x7F) {
      refuse_other_kind(text, document);
      throw InputError(document.file, line, fmt::format("the byte 0x{:02x} is not text", static_cast<int>(c)),
                       "save the file as plain text in UTF-8");
    }
  }
  YAML::Node root;
  try {
    // Checks the events first: for hostile bytes the parser creates documents or nodes without end.
    std::istringstream stream(text);
    YAML::Parser parser(stream);
    EventCounter events(document);
    for (int documents = 0; parser.HandleNextDocument(events); ++documents) {
      if (documents == 0) continue;
      throw InputError(document.file, events.started_at, "a second YAML document begins here",
                       fmt::format("keep one {} per file", document.kind));
    }
    root = YAML::Load(text);
  } catch (const YAML::Exception& e) {
    refuse_other_kind(text, document);
    throw InputError(document.file, e.mark.line >= 0 ? e.mark.line + 1 : 0,
                     fmt::format("not YAML: {}", e.msg), "check indentation, quotes and brackets there");
  }
  if (root.IsNull()) throw InputError(document.file, 0, "the file is empty", needs);
  if (root.IsScalar()) refuse_other_kind(text, document);
  return Converter(document).convert(root, 1, 0);
}

std::string read_scalar(const Node& node, const SourceLocation& location) {
  if (node.kind == Node::Kind::Empty)
    throw location.error("has no value", "write one after the colon, or remove the key");
  if (node.kind != Node::Kind::Scalar) {
    throw location.error(node.kind == Node::Kind::Mapping ? "is a mapping instead of one value"
                                                          : "is a list instead of one value",
                         kOneValue);
  }
  return node.text;
}

std::string read_text(const Node& node, const SourceLocation& location) {
  std::string text = read_scalar(node, location);
  if (trim(text).empty()) throw location.error("is empty", "write something, or remove the key");
  return text;
}

std::vector<std::string> read_texts(const Node& node, const SourceLocation& location) {
  if (node.kind != Node::Kind::List) return {read_text(node, location)};
  std::vector<std::string> texts;
  for (const Node& item : node.items) {
    if (item.kind != Node::Kind::Scalar || trim(item.text).empty()) {
      SourceLocation at = location;
      if (item.line > 0) at.line = item.line;
      throw at.error(fmt::format("item {} is not one value", texts.size() + 1), kOneValue);
    }
    texts.push_back(item.text);
  }
  if (texts.empty()) throw location.error("the list is empty", "give at least one item, or remove the key");
  return texts;
}

double to_number(const std::string& text, const Range& range, const SourceLocation& location) {
  if (range.none && text == "none") return std::numeric_limits<double>::infinity();
  std::optional<double> value = parse_double(text);
  if (!value && range.fraction) value = parse_fraction(text);
  if (!value) {
    // "10 deg", "2m": a number with a unit.
    const std::size_t end = text.find_first_not_of("+-.0123456789eE");
    const bool has_unit =
        end != std::string::npos && end > 0 && parse_double(text.substr(0, end)).has_value();
    throw location.error(
        fmt::format("'{}' is not a number", text),
        has_unit ? fmt::format("give the number alone, the unit is in the {}'s name", location.document.word)
                 : fmt::format("it is {}", range.words()));
  }
  if (!range.holds(*value))
    throw location.error(fmt::format("{} is out of range", text), fmt::format("it is {}", range.words()));
  return *value;
}

std::vector<double> read_numbers(const Node& node, const Range& range, const SourceLocation& location) {
  std::vector<double> values;
  if (node.kind == Node::Kind::List) {
    for (const std::string& item : read_texts(node, location))
      values.push_back(to_number(item, range, location));
    return values;
  }
  const std::string line = read_scalar(node, location);
  for (const std::string_view item : split_blanks(line))
    values.push_back(to_number(std::string(item), range, location));
  if (values.empty())
    throw location.error("the list is empty", "give at least one number, or remove the key");
  return values;
}

std::vector<std::vector<double>> read_rows(const Node& node, std::size_t columns, const Range& range,
                                           const SourceLocation& location) {
  std::vector<std::vector<double>> rows;
  if (node.kind == Node::Kind::List && !node.items.empty() && node.items[0].kind == Node::Kind::List) {
    for (const Node& row : node.items) {
      std::vector<double> values;
      for (const Node& item : row.items)
        values.push_back(to_number(item.kind == Node::Kind::Scalar ? item.text : "?", range, location));
      if (values.size() != columns) {
        SourceLocation at = location;
        if (row.line > 0) at.line = row.line;
        throw at.error(fmt::format("row {} does not have {} numbers", rows.size() + 1, columns));
      }
      rows.push_back(std::move(values));
    }
    return rows;
  }
  const std::vector<double> flat = read_numbers(node, range, location);
  if (flat.size() % columns != 0)
    throw location.error(fmt::format("{} numbers do not make rows of {}", flat.size(), columns));
  for (std::size_t i = 0; i < flat.size(); i += columns) {
    const auto begin = flat.begin() + static_cast<std::ptrdiff_t>(i);
    rows.emplace_back(begin, begin + static_cast<std::ptrdiff_t>(columns));
  }
  return rows;
}

bool read_boolean(const Node& node, const SourceLocation& location) {
  const std::string text = read_text(node, location);
  const std::string small = lower_case(text);
  if (location.document.digits_are_booleans) {
    if (small == "true" || small == "1") return true;
    if (small == "false" || small == "0") return false;
    throw location.error(fmt::format("'{}' is neither true nor false", text), "write true, false, 1 or 0");
  }
  // YAML 1.1's words: in lower case, in upper case, or capitalised.
  const bool one_case = text.substr(1) == small.substr(1) || text == [&] {
    std::string large = small;
    for (char& c : large) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
    return large;
  }();
  const auto is = [&](std::initializer_list<std::string_view> words) {
    return one_case && std::find(words.begin(), words.end(), small) != words.end();
  };
  if (is({"true", "yes", "on", "y"})) return true;
  if (is({"false", "no", "off", "n"})) return false;
  throw location.error(fmt::format("'{}' is neither true nor false", text), "write true or false");
}

std::filesystem::path read_file(const std::string& text, const SourceLocation& location) {
  if (location.document.find_file) return location.document.find_file(text, location);
  std::filesystem::path path = location.document.file.parent_path() / text;
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) {
    throw location.error(
        fmt::format("there is no file '{}'", path.string()),
        text.find("://") != std::string::npos
            ? std::string(
                  "it is an address: fetch the file first; of 3D Tiles, write city: {tiles: {url: ...}}")
            : fmt::format("paths are relative to the {}'s folder", location.document.kind));
  }
  const bool meant = !text.empty() && text.back() == '/';
  if (std::filesystem::is_directory(path, ignored) && !meant) {
    throw location.error(fmt::format("'{}' is a folder, not a file", path.string()),
                         "if you mean a folder, end its name with /");
  }
  return path;
}

void require_word(const std::string& text, const std::vector<std::string>& known,
                  const SourceLocation& location) {
  if (std::find(known.begin(), known.end(), text) != known.end()) return;
  throw location.error(fmt::format("'{}' is unknown", text), known_names(text, known));
}

std::string read_word(const Node& node, const std::vector<std::string>& words,
                      const SourceLocation& location) {
  std::string text = read_text(node, location);
  require_word(text, words, location);
  return text;
}

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

namespace {

/// Moves the value of `name` to `path`; "list[].key" names the key of each item of a list.
void use_key(Node& node, std::string_view name, std::string_view path, const Document& document) {
  constexpr std::string_view kItems = "[].";
  if (const std::size_t end = name.find(kItems); end != std::string_view::npos) {
    Node* list = &node;
    for (const std::string_view key : split(name.substr(0, end), '.')) {
      const auto entry = std::find_if(list->entries.begin(), list->entries.end(),
                                      [&](const Node::Entry& each) { return each.key == key; });
      if (entry == list->entries.end()) return;
      list = &entry->value;
    }
    for (Node& item : list->items)
      use_key(item, name.substr(end + kItems.size()), path.substr(end + kItems.size()), document);
    return;
  }
  const bool both = node.find_path(path) != nullptr;
  const std::optional<Node> value = take_path(node, name);
  if (!value) return;
  if (both)
    throw document.error("", std::string(name), value->line, fmt::format("conflicts with '{}'", path),
                         "keep one");
  set_key(node, std::string(path), *value, document);
}

}  // namespace

void use_keys(Node& root, const Document& document) {
  for (const auto& [name, path] : document.other_names) use_key(root, name, path, document);
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
      for (const Node::Entry& entry : node.entries)
        parts.push_back(fmt::format("{}: {}", scalar_text(entry.key), flow_text(entry.value)));
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
