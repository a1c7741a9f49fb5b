#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/input_error.hpp"

/// Each struct of options has one list of its fields. All users of the fields visit this list: the range
/// check, the readers of YAML and of hosts' settings, the tables in docs/ and --help, the scenario writer,
/// the schema, and the key of a heat map's store. The list of a struct `O` is
///     void visit(options::Visitor& v, O& o);
/// in O's namespace, one line per field: its name for users, its unit, its range and one line of help. The
/// default is the struct's own initialiser. docs/extending.md explains how to add an option.
namespace canyon::options {

/// An interval of numbers; ends are included unless marked open.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false;   ///< `low` itself is excluded
  bool high_open = false;  ///< `high` itself is excluded
  bool none = false;       ///< infinity is allowed: no limit, written "none"
  bool fraction = false;   ///< may be written as a fraction: 1/60

  /// NaN is outside.
  [[nodiscard]] bool holds(double value) const;
  /// "at least 0 and below 90".
  [[nodiscard]] std::string words() const;
  /// "[0, 90)".
  [[nodiscard]] std::string interval() const;
};
/// The range, with infinity allowed as "none".
[[nodiscard]] constexpr Range or_none(Range range) {
  range.none = true;
  return range;
}

struct Field {
  std::string_view name;  ///< as users write it: "elevation_mask_deg"
  std::string_view unit;
  /// One line. Empty: the field is for C++ only, and readers and tables skip it.
  std::string_view help;
  std::string_view absent = {};  ///< shown instead of a default that is no value: "all"
};

enum class Type { Number, Integer, Boolean, Text, Choice, Texts, Numbers, Rows, File, Files };

struct Document;
struct Node;
/// A key of a text that is read; names it in messages about its value.
struct SourceLocation {
  const Document& document;
  const std::string& section;  ///< path
  std::string key;
  int line = 0;

  [[nodiscard]] InputError error(std::string_view problem, std::string_view hint = {}) const;
};

/// The value of one field. Parts that a visitor does not use have no cost.
class Value {
 public:
  [[nodiscard]] virtual Type type() const = 0;
  /// False: an empty optional.
  [[nodiscard]] virtual bool given() const { return true; }
  /// The value as YAML on one line; read() restores it exactly.
  [[nodiscard]] virtual std::string text() const = 0;
  /// The stored number itself if text() is in another unit.
  [[nodiscard]] virtual std::string exact() const { return text(); }
  /// The value in messages to users: text(), with both units for angles.
  [[nodiscard]] virtual std::string shown() const { return text(); }
  [[nodiscard]] virtual bool in_range() const { return true; }
  /// The condition on the value, in words that follow "it is" or "it must be"; empty: no condition.
  [[nodiscard]] virtual std::string bound() const { return {}; }
  [[nodiscard]] virtual std::optional<Range> range() const { return std::nullopt; }
  [[nodiscard]] virtual std::vector<std::string> words() const { return {}; }
  /// The field is in radians, its name in degrees.
  [[nodiscard]] virtual bool is_angle() const { return false; }
  /// Throws InputError if the node has no such value or it is out of range.
  virtual void read(const Node& node, const SourceLocation& location) = 0;

 protected:
  Value() = default;
  ~Value() = default;
  Value(const Value&) = default;
  Value& operator=(const Value&) = default;
};

/// A value that is given by a name or by rows of numbers: an antenna's pattern.
class NamedRows {
 public:
  [[nodiscard]] virtual std::string name() const = 0;
  [[nodiscard]] virtual std::vector<std::vector<double>> rows() const = 0;
  virtual void set_name(const std::string& name) = 0;
  /// Throws InputError if the rows are not valid.
  virtual void set_rows(const std::vector<std::vector<double>>& rows) = 0;

 protected:
  NamedRows() = default;
  ~NamedRows() = default;
  NamedRows(const NamedRows&) = default;
  NamedRows& operator=(const NamedRows&) = default;
};

/// The purpose of a visitor, for fields with a choice of kinds ("one of file, waypoints, position").
enum class Purpose {
  Values,    ///< reads the fields that have a value
  Describe,  ///< lists all possible fields
  Read,      ///< fills the fields
};

/// Visits the fields of structs. Only visitors of Purpose::Read change the values.
class Visitor {
 public:
  virtual ~Visitor() = default;
  [[nodiscard]] virtual Purpose purpose() const { return Purpose::Values; }
  [[nodiscard]] bool reads() const { return purpose() == Purpose::Read; }
  /// For writers of texts that are read again: a Switch that is not set stays unset.
  [[nodiscard]] virtual bool leaves_out_defaults() const { return false; }
  [[nodiscard]] bool describes() const { return purpose() == Purpose::Describe; }

  void number(const Field& field, double& value, const Range& range);
  /// @param range_deg in degrees; the value is stored in radians
  void angle(const Field& field, double& value_rad, const Range& range_deg);
  void integer(const Field& field, int& value, int low, int high);
  void integer(const Field& field, std::uint32_t& value, std::uint32_t low, std::uint32_t high);
  /// @param high below 2^63
  void integer(const Field& field, std::uint64_t& value, std::uint64_t low = 0,
               std::uint64_t high = std::numeric_limits<std::int64_t>::max());
  void boolean(const Field& field, bool& value);
  void text(const Field& field, std::string& value);
  void number(const Field& field, std::optional<double>& value, const Range& range);
  void text(const Field& field, std::optional<std::string>& value);
  void texts(const Field& field, std::vector<std::string>& value);
  /// The same for members of `words`, none twice. A reader keeps `value` if the key has no value.
  void words(const Field& field, std::vector<std::string>& value, std::span<const std::string_view> words);
  void numbers(const Field& field, std::vector<double>& value, const Range& range);
  /// "house=7", one or a list. A reader sets the given names and leaves the others unchanged.
  /// @param form for messages: "TYPE=METRES"
  void named_numbers(const Field& field, std::map<std::string, double>& value, const Range& range,
                     std::string_view form);
  /// An existing file.
  void file(const Field& field, std::optional<std::filesystem::path>& value);
  void files(const Field& field, std::vector<std::filesystem::path>& value);
  /// One of `words`; empty: none (absent in the text as well).
  void word(const Field& field, std::string& value, std::span<const std::string_view> words);
  /// Values of `Enum` count from 0 in the order of `words`.
  template <typename Enum>
  void choice(const Field& field, Enum& value, std::span<const std::string_view> words) {
    const int before = static_cast<int>(value);
    const int after = choose(field, before, words);
    if (after != before) value = static_cast<Enum>(after);
  }
  /// Two keys that exclude each other: a name out of `words`, or rows of `columns` numbers.
  void named_rows(const Field& by_name, std::span<const std::string_view> words, const Field& by_rows,
                  std::size_t columns, NamedRows& value);
  /// Rows of `columns` numbers; not written if their name is one of `words`.
  void rows(const Field& field, std::span<const std::string_view> words, std::size_t columns,
            NamedRows& value);

  /// Fields below a key of their own.
  template <typename Fields>
  void section(std::string_view name, const Fields& fields) {
    if (!begin(name)) return;
    fields();
    end();
  }
  /// The fields of a struct below a key; a reader calls its validate() for conditions beyond ranges.
  template <typename Options>
  void part(std::string_view name, Options& options) {
    section(name, [&] {
      visit(*this, options);
      validate(options);
    });
  }
  /// Calls options.validate() if a section was read, and reports its error at the section.
  template <typename Options>
  void validate(const Options& options) {
    if constexpr (requires { options.validate(); }) {
      if (!reads()) return;
      try {
        options.validate();
      } catch (const InputError& error) {
        throw fault({}, error.problem(), error.hint());
      }
    }
  }
  /// A list of mappings below a key. A reader creates as many items as the list has; `fields` visits one.
  template <typename Item, typename Fields>
  void list(std::string_view name, std::vector<Item>& items, const Fields& fields) {
    const std::optional<std::size_t> count = begin_list(name, items.size());
    if (!count) return;
    if (reads()) items.resize(*count);
    for (std::size_t i = 0; i < *count; ++i) {
      begin_item(i);
      if (describes()) {
        Item item{};
        fields(item);
      } else {
        fields(items[i]);
      }
      end();
    }
    end();
  }

  /// Whether the fields of a kind are visited: Purpose::Describe visits all kinds, others the one in use.
  [[nodiscard]] bool wants(bool holds) const { return holds || describes(); }
  /// Declares that at most one of these keys may be given here; with `hint` exactly one is required.
  virtual void one_of(std::initializer_list<std::string_view> /*keys*/, std::string_view /*hint*/ = {}) {}
  /// Declares that this key is required here.
  virtual void require(std::string_view /*key*/, std::string_view /*hint*/ = {}) {}
  /// A removed key of this section, or a wrong word for another key: its use is an error with hint `hint`.
  virtual void replaced(std::string_view /*key*/, std::string_view /*hint*/) {}
  /// Another name (a path from this section) of the key `path`: readers treat it as that key.
  virtual void other_name(std::string_view /*name*/, std::string_view /*path*/) {}
  /// A former name (a path from this section) of the key `path`: readers accept it, and tables omit it.
  virtual void former_name(std::string_view /*name*/, std::string_view /*path*/) {}
  /// Whether the key is given in the section that is read.
  [[nodiscard]] virtual bool has(std::string_view /*key*/) const { return false; }
  [[nodiscard]] virtual bool is_section(std::string_view /*key*/) const { return false; }
  /// The error for a wrong key of this section, or for the section itself (empty key).
  [[nodiscard]] virtual InputError fault(std::string_view key, std::string_view problem,
                                         std::string_view hint = {}) const;

 protected:
  virtual void field(const Field& field, Value& value) = 0;
  /// False: the section is skipped, without a call of end().
  [[nodiscard]] virtual bool begin(std::string_view name) = 0;
  /// The number of items; empty: the list is skipped, without a call of end().
  [[nodiscard]] virtual std::optional<std::size_t> begin_list(std::string_view name, std::size_t count) = 0;
  virtual void begin_item(std::size_t index) = 0;
  virtual void end() = 0;

 private:
  void visit_value(const Field& of, Value&& value) { field(of, value); }
  [[nodiscard]] int choose(const Field& field, int now, std::span<const std::string_view> words);
};

/// A number as text: the fewest digits that read back exactly; infinity is "none".
[[nodiscard]] std::string show(double value);
/// Degrees that radians() converts to exactly this angle if possible, else the nearest, in the fewest digits.
[[nodiscard]] double exact_degrees(double radians);

}  // namespace canyon::options
