#pragma once

#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/options/visitor.hpp"

namespace canyon::options {

/// One key of the options, for tables, help and schema.
struct Key {
  std::string path;  ///< "receivers[].elevation_mask_deg"
  std::string unit;
  std::string default_value;  ///< as readers accept it, or a word about it
  std::string meaning;
  Type type = Type::Text;
  std::optional<Range> range = {};
  std::vector<std::string> words = {};  ///< of a choice
  bool required = false;                ///< if its section is present
  std::string value = {};               ///< Value::exact(); empty if there is none

  /// "[0, 90)", "true or false", "sigma, equal, elevation, cn0"; empty if anything goes.
  [[nodiscard]] std::string values() const;
};

/// All keys of a struct, in the order of its list, and the keys that exclude each other.
struct Description {
  struct Alternatives {
    std::string section;  ///< path
    std::vector<std::string> keys;
    bool one_needed = false;
  };
  std::vector<Key> keys;
  std::vector<Alternatives> alternatives;
  std::map<std::string, std::vector<std::string>> required_sections;  ///< by their parent section
  std::map<std::string, std::string> replaced;  ///< hints, by the paths of Visitor::replaced()
  /// Names and paths of Visitor::other_name(). `keys` lists them at its end.
  std::vector<std::pair<std::string, std::string>> other_names;
  /// Names and paths of Visitor::former_name(); not in `keys`.
  std::vector<std::pair<std::string, std::string>> former_names;

  /// Adds another name of the key `path`. @param effect additional effect, for tables
  void add_other_name(const std::string& name, const std::string& path, std::string_view effect = {});

  [[nodiscard]] std::vector<std::string> paths() const;
  /// The current path of a former name; another path as it is.
  [[nodiscard]] std::string current(const std::string& path) const;
};

class Describer final : public Visitor {
 public:
  [[nodiscard]] Purpose purpose() const override { return Purpose::Describe; }
  void one_of(std::initializer_list<std::string_view> keys, std::string_view hint) override;
  void require(std::string_view key, std::string_view hint) override;
  void replaced(std::string_view key, std::string_view hint) override;
  void other_name(std::string_view name, std::string_view path) override;
  void former_name(std::string_view name, std::string_view path) override;
  [[nodiscard]] Description take() &&;

 protected:
  void field(const Field& field, Value& value) override;
  [[nodiscard]] bool begin(std::string_view name) override;
  [[nodiscard]] std::optional<std::size_t> begin_list(std::string_view name, std::size_t count) override;
  void begin_item(std::size_t /*index*/) override { parents_.push_back(path_); }
  void end() override;

 private:
  Description description_;
  std::string path_;
  std::vector<std::string> parents_;
  std::vector<std::pair<std::string, std::string>> other_names_;
};

/// The description of a struct, with the defaults in `options`.
template <typename Options>
[[nodiscard]] Description describe(Options options = {}) {
  Describer describer;
  visit(describer, options);
  return std::move(describer).take();
}

/// The description of a struct with its own defaults, made once.
template <typename Options>
[[nodiscard]] const Description& description_of() {
  static const Description description = describe<Options>();
  return description;
}

/// Rows of a Markdown table: key, unit, default, values, meaning.
[[nodiscard]] std::string markdown(const std::vector<Key>& keys);
/// The same for a terminal, one line per key.
[[nodiscard]] std::string plain_text(const std::vector<Key>& keys);
/// JSON Schema, draft 7, of the texts that a reader of these keys accepts. It does not cover conditions on
/// other keys or on files.
[[nodiscard]] std::string json_schema(const Description& description, std::string_view title);

}  // namespace canyon::options
