#pragma once

#include <yaml-cpp/yaml.h>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/input_error.hpp"

namespace canyon::simulation {

/// A bounded interval of numbers, ends included unless said.
struct Range {
  double low = 0;
  double high = 0;
  bool low_open = false;   ///< `low` itself is out
  bool high_open = false;  ///< `high` itself is out
};

/// What all sections of one document share.
struct YamlDocument {
  std::filesystem::path file;
  std::vector<std::string> known;  ///< key paths, "receivers[].clock.bias_s"
  std::string kind;                ///< what the file is, for messages: "scenario"
};

/// One mapping of a YAML document, read key by key. Knows which keys may stand in it (from the document's
/// table of key paths), refuses others and repeated ones on construction, and those that nothing asked for in
/// finish(). Getters return nothing where the key is absent, and throw InputError with file and line where
/// its value has the wrong type or lies out of range.
class YamlSection {
 public:
  /// The whole document. Throws InputError for broken syntax, more than one document, or anything but a
  /// mapping. `known` lists every key path; `kind` says in messages what the file is, `needs` what an empty
  /// one lacks.
  [[nodiscard]] static YamlSection parse(
      const std::string& text, const std::filesystem::path& file, std::vector<std::string> known,
      std::string_view kind = "scenario",
      std::string_view needs = "it needs at least city, sky and trajectory");

  /// 1-based line of a key, or of the section itself.
  [[nodiscard]] int line(std::string_view key) const;
  [[nodiscard]] int line() const { return line_; }
  [[nodiscard]] bool has(std::string_view key) const;
  [[nodiscard]] bool empty() const { return entries_.empty(); }
  /// The key is a mapping (not a scalar or a list).
  [[nodiscard]] bool is_section(std::string_view key) const;
  [[nodiscard]] bool is_list(std::string_view key) const;

  [[nodiscard]] std::optional<double> number(std::string_view key, const Range& range);
  /// A number, or the word "none" for infinity: no limit.
  [[nodiscard]] std::optional<double> number_or_none(std::string_view key, const Range& range);
  [[nodiscard]] std::optional<std::int64_t> integer(std::string_view key, std::int64_t low,
                                                    std::int64_t high);
  [[nodiscard]] std::optional<bool> boolean(std::string_view key);
  [[nodiscard]] std::optional<std::string> text(std::string_view key);
  /// One of `choices`, as written there.
  [[nodiscard]] std::optional<std::string> choice(std::string_view key,
                                                  const std::vector<std::string>& choices);
  /// A list of texts, or a single one.
  [[nodiscard]] std::optional<std::vector<std::string>> texts(std::string_view key);
  /// A list of numbers, or one text with blanks between them.
  [[nodiscard]] std::optional<std::vector<double>> numbers(std::string_view key, const Range& range);
  /// Rows of `columns` numbers: a list of lists, or all numbers in one list or text, row by row.
  [[nodiscard]] std::optional<std::vector<std::vector<double>>> rows(std::string_view key,
                                                                     std::size_t columns, const Range& range);
  /// An existing file; relative names belong to the document's folder.
  [[nodiscard]] std::optional<std::filesystem::path> existing_file(std::string_view key);
  [[nodiscard]] std::optional<std::vector<std::filesystem::path>> existing_files(std::string_view key);
  /// A mapping; a key without a value is an empty one.
  [[nodiscard]] std::optional<YamlSection> section(std::string_view key);
  [[nodiscard]] std::optional<std::vector<YamlSection>> sections(std::string_view key);

  /// Throws for keys that are known but were not asked for: they have no effect beside the others.
  void finish() const;

  [[nodiscard]] InputError error(std::string_view key, std::string_view problem,
                                 std::string_view cure = {}) const;
  [[nodiscard]] InputError section_error(std::string_view problem, std::string_view cure = {}) const;

 private:
  struct Entry {
    std::string key;
    YAML::Node value;
    int line = 0;
    bool consumed = false;
  };

  YamlSection(std::shared_ptr<const YamlDocument> document, std::string path, const YAML::Node& node,
              int line);
  [[nodiscard]] const Entry* find(std::string_view key) const;
  /// The entry, marked as read, or nothing.
  [[nodiscard]] Entry* take(std::string_view key);
  [[nodiscard]] std::vector<std::string> known_keys() const;
  [[nodiscard]] std::string scalar(const Entry& entry) const;
  [[nodiscard]] double to_number(const Entry& entry, const std::string& text, const Range& range) const;
  [[nodiscard]] std::filesystem::path to_file(const Entry& entry, const std::string& text) const;

  std::shared_ptr<const YamlDocument> document_;
  std::string path_;  // "" for the root, "receivers[]" below
  int line_ = 0;
  std::vector<Entry> entries_;
};

}  // namespace canyon::simulation
