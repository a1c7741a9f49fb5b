#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"

namespace canyon::options {

/// Settings as written, whatever the language: a tree of texts with lines. parse_yaml() makes one
/// of YAML; a host makes one of its own settings (SDF elements, parameters).
struct Node {
  enum class Kind { Empty, Scalar, List, Mapping };
  struct Entry;

  Kind kind = Kind::Empty;
  int line = 0;                ///< 1-based; 0: not known
  std::string text;            ///< of a Scalar
  std::vector<Node> items;     ///< of a List
  std::vector<Entry> entries;  ///< of a Mapping, as written: a key may stand twice

  /// The first entry of this key of a mapping, or null.
  [[nodiscard]] const Entry* find(std::string_view key) const;
  /// The entry of a dotted key, or null; there is no way through lists.
  [[nodiscard]] const Entry* find_path(std::string_view path) const;
};
struct Node::Entry {
  std::string key;
  int line = 0;
  Node value;
};

struct Description;
struct Place;
/// Facts that a Reader must know about the text around a tree. The functions let a host use its own terms.
struct Document {
  std::filesystem::path file;                        ///< names of files belong to its folder
  std::string kind = "scenario";                     ///< what the text is, in messages
  std::string word = "key";                          ///< what its author calls a key
  std::string page = "docs/scenario.md";             ///< that explains its keys
  std::vector<std::string> known;                    ///< paths of all keys: "receivers[].clock.bias_s"
  std::map<std::string, std::string> replaced = {};  ///< Description::replaced
  std::vector<std::pair<std::string, std::string>> other_names = {};  ///< Description::other_names
  bool digits_are_booleans = false;  ///< true, false, 1 and 0 in any case of letters, not YAML's words
  /// A fault of the key `path`, or of the section `path` where `key` is empty.
  /// Default: InputError(file, line, "KEY: problem", cure).
  std::function<InputError(const std::string& path, const std::string& key, int line,
                           std::string_view problem, std::string_view cure)>
      fault;
  /// Where the file of this name lies; throws an error of `place` where it is not. Default: in the folder of
  /// `file`.
  std::function<std::filesystem::path(const std::string& name, const Place& place)> find_file;

  [[nodiscard]] InputError error(const std::string& path, const std::string& key, int line,
                                 std::string_view problem, std::string_view cure = {}) const;
  /// Sets `known`, `replaced` and `other_names`.
  void set_keys(const Description& description);
  /// The cure for the unknown key `key` of section `path`.
  [[nodiscard]] std::string cure_of(const std::string& path, const std::string& key) const;
  /// The keys that may stand in section `path`, in the order of `known`.
  [[nodiscard]] std::vector<std::string> keys_of(const std::string& path) const;
};

/// The closest of `known` to a key that is not among them, its unit aside.
[[nodiscard]] std::optional<std::string> closest_key(const std::string& key,
                                                     const std::vector<std::string>& known);

/// A tree of a YAML text. `needs` says what an empty text lacks. Throws InputError with file and line for
/// broken syntax, an empty text, more than one document, and for trees of more than 2 million nodes or 100
/// levels (aliases count each time).
[[nodiscard]] Node parse_yaml(const std::string& text, const Document& document, std::string_view needs);

}  // namespace canyon::options
