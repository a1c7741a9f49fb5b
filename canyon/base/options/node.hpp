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

/// Settings as written, independent of the language: a tree of texts with line numbers. parse_yaml() creates
/// one from YAML; a host creates one from its own settings (SDF elements, parameters).
struct Node {
  enum class Kind { Empty, Scalar, List, Mapping };
  struct Entry;

  Kind kind = Kind::Empty;
  int line = 0;                ///< 1-based; 0: not known
  std::string text;            ///< of a Scalar
  std::vector<Node> items;     ///< of a List
  std::vector<Entry> entries;  ///< of a Mapping, as written: a key may occur twice

  /// The first entry of this key of a mapping, or null.
  [[nodiscard]] const Entry* find(std::string_view key) const;
  /// The entry of a dotted key, or null; lists cannot be traversed.
  [[nodiscard]] const Entry* find_path(std::string_view path) const;
};
struct Node::Entry {
  std::string key;
  int line = 0;
  Node value;
};

struct Description;
struct SourceLocation;
/// Properties of the text around a tree for a Reader. The functions let a host use its own terms.
struct Document {
  std::filesystem::path file;                        ///< file names are relative to its folder
  std::string kind = "scenario";                     ///< the kind of text, in messages
  std::string word = "key";                          ///< the term for a key in this kind of text
  std::string page = "docs/scenario.md";             ///< page that explains the keys
  std::vector<std::string> known;                    ///< paths of all keys: "receivers[].clock.bias_s"
  std::map<std::string, std::string> replaced = {};  ///< Description::replaced
  std::vector<std::pair<std::string, std::string>> other_names = {};  ///< Description::other_names
  bool digits_are_booleans = false;  ///< true, false, 1 and 0, letters in any case, instead of YAML's words
  /// An error of the key `path`, or of the section `path` if `key` is empty. Default: InputError(file, line,
  /// "KEY: problem", hint).
  std::function<InputError(const std::string& path, const std::string& key, int line,
                           std::string_view problem, std::string_view hint)>
      fault;
  /// The path of the file of this name; throws an error of `position` if it does not exist. Default: in the
  /// folder of `file`.
  std::function<std::filesystem::path(const std::string& name, const SourceLocation& position)> find_file;

  [[nodiscard]] InputError error(const std::string& path, const std::string& key, int line,
                                 std::string_view problem, std::string_view hint = {}) const;
  /// Sets `known`, `replaced` and `other_names`.
  void set_keys(const Description& description);
  /// The hint for the unknown key `key` of section `path`.
  [[nodiscard]] std::string hint_for(const std::string& path, const std::string& key) const;
  /// The keys that are allowed in section `path`, in the order of `known`.
  [[nodiscard]] std::vector<std::string> keys_of(const std::string& path) const;
};

/// The closest of `known` to an unknown key, compared without units.
[[nodiscard]] std::optional<std::string> closest_key(const std::string& key,
                                                     const std::vector<std::string>& known);

/// The tree of a YAML text. `needs` completes the message for an empty text. Throws InputError with file and
/// line for syntax errors, an empty text, more than one document, and trees of more than 2 million nodes or
/// 100 levels (each alias counts).
[[nodiscard]] Node parse_yaml(const std::string& text, const Document& document, std::string_view needs);

// Values of a tree's nodes. If a node has no such value, each function throws InputError with its location.
/// The text of a single value.
[[nodiscard]] std::string read_scalar(const Node& node, const SourceLocation& location);
/// A text that is not blank.
[[nodiscard]] std::string read_text(const Node& node, const SourceLocation& location);
/// A list of texts, or a single one.
[[nodiscard]] std::vector<std::string> read_texts(const Node& node, const SourceLocation& location);
/// A number in the range; a fraction, or "none" for infinity, if the range allows them.
[[nodiscard]] double to_number(const std::string& text, const Range& range, const SourceLocation& location);
/// A list of numbers, or one text with blanks between them.
[[nodiscard]] std::vector<double> read_numbers(const Node& node, const Range& range,
                                               const SourceLocation& location);
/// Rows of numbers: a list of lists, or all numbers in one list or text, row by row.
[[nodiscard]] std::vector<std::vector<double>> read_rows(const Node& node, std::size_t columns,
                                                         const Range& range, const SourceLocation& location);
/// A Boolean in the words of YAML 1.1; if the document allows digits, also 1 and 0.
[[nodiscard]] bool read_boolean(const Node& node, const SourceLocation& location);
/// An existing file, relative to the document's folder. A name that ends in / may be a folder; the caller
/// decides whether it accepts one.
[[nodiscard]] std::filesystem::path read_file(const std::string& text, const SourceLocation& location);
/// Throws InputError with the closest of `known` if a text is none of these.
void require_word(const std::string& text, const std::vector<std::string>& known,
                  const SourceLocation& location);
/// One of `words`.
[[nodiscard]] std::string read_word(const Node& node, const std::vector<std::string>& words,
                                    const SourceLocation& location);

// Trees of settings: changes at a key, and output on one line.
/// Sets `value` at a dotted key of `root` and replaces the old value: "city.synthetic.seed",
/// "receivers[0].profile" (the first), "receivers[car].profile" (the one whose name is car),
/// "receivers[].elevation_mask_deg" (each). Missing sections are created, with the line of `value`, and so is
/// the first item of a missing list. Throws InputError, without a file, for a missing item and for a path
/// through a value that is not a section.
void set_at(Node& root, std::string_view key, const Node& value);

/// The tree with dotted keys expanded to sections: "clock.bias_s: 1" is "clock: {bias_s: 1}". Keys of one
/// section at several locations are merged. Throws InputError if a key occurs twice or is section and value.
[[nodiscard]] Node without_dots(const Node& root, const Document& document);

/// Moves values of Document::other_names to the corresponding keys. Throws InputError if a key is given under
/// both names.
void use_keys(Node& root, const Document& document);

/// The key in the form of options::Key::path: items of lists as "[]".
[[nodiscard]] std::string plain_key(std::string_view key);

/// YAML in flow style on one line: {profile: ublox-m8t, name: car}. Equal only for equal trees.
[[nodiscard]] std::string flow_text(const Node& node);

[[nodiscard]] Node scalar_node(std::string text, int line = 0);

}  // namespace canyon::options
