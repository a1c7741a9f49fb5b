#include "canyon/base/options/node.hpp"

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <sstream>
#include <utility>

#include "canyon/base/file_kind.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/base/text.hpp"

namespace canyon::options {
namespace {

int line_of(const YAML::Node& node, int fallback) {
  const YAML::Mark mark = node.Mark();
  return mark.line >= 0 ? mark.line + 1 : fallback;
}

/// Names the kind of a text that is no document. One whose name says YAML or JSON has a fault of its own.
void refuse_other_kind(const std::string& text, const Document& document) {
  const std::string ending = document.file.extension().string();
  if (ending == ".yaml" || ending == ".yml" || ending == ".json") return;
  constexpr std::size_t kHead = std::size_t{1} << 14;
  const auto other =
      of_other_kind(std::string_view(text).substr(0, kHead), document.file, "a " + document.kind + " (YAML)");
  if (other) throw InputError(*other);
}

// Finds where documents begin, and refuses too many nodes.
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

// Aliases share what they stand for in yaml-cpp's tree and are copied in ours: a few lines of them could grow
// beyond any memory, or never end.
class Converter {
 public:
  explicit Converter(const Document& document) : document_(document) {}

  Node convert(const YAML::Node& from, int line, int depth) {
    Node node;
    node.line = line_of(from, line);
    if (++count_ > 2'000'000 || depth > 100) {
      throw InputError(document_.file, node.line, "the YAML is too large or too deep",
                       "look for aliases ('*name') that repeat themselves");
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
                           std::string_view problem, std::string_view cure) const {
  if (fault) return fault(path, key, line, problem, cure);
  return {file, line, key.empty() ? std::string(problem) : fmt::format("{}: {}", key, problem), cure};
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
  for (const std::string& candidate : known) {
    if (without_unit(candidate) == without_unit(key)) return candidate;
  }
  return closest(key, known);
}

void Document::set_keys(const Description& description) {
  known = description.paths();
  replaced = description.replaced;
  other_names = description.other_names;
}

std::string Document::cure_of(const std::string& path, const std::string& key) const {
  const auto other = replaced.find(path.empty() ? key : fmt::format("{}.{}", path, key));
  if (other != replaced.end()) return other->second;
  const std::vector<std::string> here = keys_of(path);
  const auto similar = closest_key(key, here);
  return similar ? fmt::format("did you mean '{}'?", *similar)
                 : fmt::format("known here: {}", fmt::join(here, ", "));
}

Node parse_yaml(const std::string& text, const Document& document, std::string_view needs) {
  // YAML has no control characters (YAML 1.2, 5.1), and yaml-cpp does not end at some of them.
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
    // A look at the events first: of hostile bytes the parser makes documents or nodes without end.
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

}  // namespace canyon::options
