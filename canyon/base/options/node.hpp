#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/options/visitor.hpp"

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

// Values of a tree's nodes. Each throws InputError that names the place where a node has no such value.
/// The text of a single value.
[[nodiscard]] std::string read_scalar(const Node& node, const Place& place);
/// A text that is not blank.
[[nodiscard]] std::string read_text(const Node& node, const Place& place);
/// A list of texts, or a single one.
[[nodiscard]] std::vector<std::string> read_texts(const Node& node, const Place& place);
/// A number in the range; a fraction, or "none" for infinity, where the range allows them.
[[nodiscard]] double to_number(const std::string& text, const Range& range, const Place& place);
/// A list of numbers, or one text with blanks between them.
[[nodiscard]] std::vector<double> read_numbers(const Node& node, const Range& range, const Place& place);
/// Rows of numbers: a list of lists, or all numbers in one list or text, row by row.
[[nodiscard]] std::vector<std::vector<double>> read_rows(const Node& node, std::size_t columns,
                                                         const Range& range, const Place& place);
/// A Boolean in the words of YAML 1.1, or 1 and 0 where the document has these.
[[nodiscard]] bool read_boolean(const Node& node, const Place& place);
/// An existing file, relative to the document's folder. A name that ends in / may be a folder: who reads it
/// knows whether that will do.
[[nodiscard]] std::filesystem::path read_file(const std::string& text, const Place& place);
/// Refuses a text that is none of `known`, with the closest of these.
void require_word(const std::string& text, const std::vector<std::string>& known, const Place& place);
/// One of `words`.
[[nodiscard]] std::string read_word(const Node& node, const std::vector<std::string>& words,
                                    const Place& place);

// Trees of settings, changed at a place and written on one line.
/// Puts `value` at a dotted key of `root`, in place of what stands there: "city.synthetic.seed",
/// "receivers[0].profile" (the first), "receivers[car].profile" (the one whose name is car),
/// "receivers[].elevation_mask_deg" (each). Sections that are missing are made, in the line of `value`; so is
/// the first item of a list that is missing. Throws InputError, without a file, for an item that is not there
/// and for a way through a value that is not a section.
void set_at(Node& root, std::string_view key, const Node& value);

/// The tree with keys that have dots in them as sections: "clock.bias_s: 1" is "clock: {bias_s: 1}". Keys of
/// one section at several places are gathered in it. Throws InputError where a key comes twice, or is a
/// section and a value as well.
[[nodiscard]] Node without_dots(const Node& root, const Document& document);

/// Moves values of Document::other_names to the keys that they are other names of. Throws InputError where a
/// key stands by both.
void use_keys(Node& root, const Document& document);

/// The key as options::Key::path has it: items of lists as "[]".
[[nodiscard]] std::string plain_key(std::string_view key);

/// YAML in flow style on one line: {profile: ublox-m8t, name: car}. Equal for equal trees and for no others.
[[nodiscard]] std::string flow_text(const Node& node);

[[nodiscard]] Node scalar_node(std::string text, int line = 0);

}  // namespace canyon::options
