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

/// One list of fields for each struct of options, visited by all that must know them: the check of ranges,
/// the readers of YAML and of hosts' settings, the tables in docs/ and --help, the scenario written back, the
/// schema, and the key of a heat map's store. The list of a struct `O` is
///     void visit(options::Visitor& v, O& o);
/// in O's namespace, one line a field: its name as users write it, its unit, its range and one line of help.
/// The default is the struct's own initialiser. docs/extending.md adds an option.
namespace canyon::options {

/// A bounded interval of numbers, ends included unless said.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool low_open = false;   ///< `low` itself is out
  bool high_open = false;  ///< `high` itself is out
  bool none = false;       ///< infinity is in: no limit, written "none"
  bool fraction = false;   ///< may be written as one: 1/60

  /// NaN is outside.
  [[nodiscard]] bool holds(double value) const;
  /// "at least 0 and below 90".
  [[nodiscard]] std::string words() const;
  /// "[0, 90)".
  [[nodiscard]] std::string interval() const;
};
/// The range, and infinity as "none".
[[nodiscard]] constexpr Range or_none(Range range) {
  range.none = true;
  return range;
}

struct Field {
  std::string_view name;  ///< as users write it: "elevation_mask_deg"
  std::string_view unit;
  /// One line. Without any, the field is for C++ alone: no reader and no table has it.
  std::string_view help;
  std::string_view absent = {};  ///< what stands for the default where that is not a value: "all"
};

enum class Type { Number, Integer, Boolean, Text, Choice, Texts, Numbers, Rows, File, Files };

struct Document;
struct Node;
/// A key of a text that is read: names it where something is wrong with its value.
struct Place {
  const Document& document;
  const std::string& section;  ///< path
  std::string key;
  int line = 0;

  [[nodiscard]] InputError error(std::string_view problem, std::string_view cure = {}) const;
};

/// The value of one field. Parts that a visitor does not need cost nothing.
class Value {
 public:
  [[nodiscard]] virtual Type type() const = 0;
  /// False: an optional that is empty.
  [[nodiscard]] virtual bool given() const { return true; }
  /// The value as YAML on one line; read() takes the same value from it, to the bit.
  [[nodiscard]] virtual std::string text() const = 0;
  /// The stored number itself where text() is of another unit.
  [[nodiscard]] virtual std::string exact() const { return text(); }
  /// The value in messages to users: text(), with both units for angles.
  [[nodiscard]] virtual std::string shown() const { return text(); }
  [[nodiscard]] virtual bool in_range() const { return true; }
  /// The condition on the value, in words that follow "it is" or "it must be"; empty: there is none.
  [[nodiscard]] virtual std::string bound() const { return {}; }
  [[nodiscard]] virtual std::optional<Range> range() const { return std::nullopt; }
  [[nodiscard]] virtual std::vector<std::string> words() const { return {}; }
  /// The field is in radians, its name in degrees.
  [[nodiscard]] virtual bool is_angle() const { return false; }
  /// Throws InputError where the node is no such value or out of range.
  virtual void read(const Node& node, const Place& place) = 0;

 protected:
  Value() = default;
  ~Value() = default;
  Value(const Value&) = default;
  Value& operator=(const Value&) = default;
};

/// A value that has a name or rows of numbers of its own: an antenna's pattern.
class NamedRows {
 public:
  [[nodiscard]] virtual std::string name() const = 0;
  [[nodiscard]] virtual std::vector<std::vector<double>> rows() const = 0;
  virtual void set_name(const std::string& name) = 0;
  /// Throws InputError for rows that do not make a value.
  virtual void set_rows(const std::vector<std::vector<double>>& rows) = 0;

 protected:
  NamedRows() = default;
  ~NamedRows() = default;
  NamedRows(const NamedRows&) = default;
  NamedRows& operator=(const NamedRows&) = default;
};

/// The purpose of a visitor. Fields with a choice of kinds ("one of file, waypoints, position") ask for it.
enum class Purpose {
  Values,    ///< looks at the fields that hold something
  Describe,  ///< looks at all fields there could be
  Read,      ///< fills them
};

/// Walks over the fields of structs. Only those of Purpose::Read change what they visit.
class Visitor {
 public:
  virtual ~Visitor() = default;
  [[nodiscard]] virtual Purpose purpose() const { return Purpose::Values; }
  [[nodiscard]] bool reads() const { return purpose() == Purpose::Read; }
  /// A writer of texts to be read again: a Switch that nobody set stays so.
  [[nodiscard]] virtual bool leaves_out_defaults() const { return false; }
  [[nodiscard]] bool describes() const { return purpose() == Purpose::Describe; }

  void number(const Field& field, double& value, const Range& range);
  /// @param range of degrees; radians are what is stored
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
  /// The same of `words` alone, none twice. A reader leaves `value` as it is where the key has no value.
  void words(const Field& field, std::vector<std::string>& value, std::span<const std::string_view> words);
  void numbers(const Field& field, std::vector<double>& value, const Range& range);
  /// "house=7", one or a list. A reader sets the names that are there and leaves the others as they are.
  /// @param form for messages: "TYPE=METRES"
  void named_numbers(const Field& field, std::map<std::string, double>& value, const Range& range,
                     std::string_view form);
  /// An existing file.
  void file(const Field& field, std::optional<std::filesystem::path>& value);
  void files(const Field& field, std::vector<std::filesystem::path>& value);
  /// One of `words`; empty: none (absent in the text as well).
  void word(const Field& field, std::string& value, std::span<const std::string_view> words);
  /// Values of `Enum` count from 0 as `words` do.
  template <typename Enum>
  void choice(const Field& field, Enum& value, std::span<const std::string_view> words) {
    const int before = static_cast<int>(value);
    const int after = choose(field, before, words);
    if (after != before) value = static_cast<Enum>(after);
  }
  /// Two keys, one of which may stand: a name of `words`, or rows of `columns` numbers.
  void named_rows(const Field& by_name, std::span<const std::string_view> words, const Field& by_rows,
                  std::size_t columns, NamedRows& value);
  /// Rows of `columns` numbers; not written back while its name is one of `words`.
  void rows(const Field& field, std::span<const std::string_view> words, std::size_t columns,
            NamedRows& value);

  /// Fields below a key of their own.
  template <typename Fields>
  void section(std::string_view name, const Fields& fields) {
    if (!begin(name)) return;
    fields();
    end();
  }
  /// The fields of a struct below a key; a reader calls its validate() for what ranges cannot check.
  template <typename Options>
  void part(std::string_view name, Options& options) {
    section(name, [&] {
      visit(*this, options);
      validate(options);
    });
  }
  /// Calls options.validate() where a section was read, and reports its error at the section.
  template <typename Options>
  void validate(const Options& options) {
    if constexpr (requires { options.validate(); }) {
      if (!reads()) return;
      try {
        options.validate();
      } catch (const InputError& error) {
        throw fault({}, error.problem(), error.cure());
      }
    }
  }
  /// A list of mappings below a key. A reader makes as many items as there are; `fields` visits one.
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

  /// Whether the fields of a kind are visited: Purpose::Describe visits all kinds, others the one that holds.
  [[nodiscard]] bool wants(bool holds) const { return holds || describes(); }
  /// Declares that at most one of these keys may stand here; with `cure` one must.
  virtual void one_of(std::initializer_list<std::string_view> /*keys*/, std::string_view /*cure*/ = {}) {}
  /// Declares that this key must stand here.
  virtual void require(std::string_view /*key*/, std::string_view /*cure*/ = {}) {}
  /// A key of this section that is no more, or a wrong word for another: who writes it is told `cure`.
  virtual void replaced(std::string_view /*key*/, std::string_view /*cure*/) {}
  /// Another name, a path from this section, of the key `path`: readers take it as that key.
  virtual void other_name(std::string_view /*name*/, std::string_view /*path*/) {}
  /// The key stands in the section that is read.
  [[nodiscard]] virtual bool has(std::string_view /*key*/) const { return false; }
  [[nodiscard]] virtual bool is_section(std::string_view /*key*/) const { return false; }
  /// The error for a wrong key of this section, or for the section itself (empty key).
  [[nodiscard]] virtual InputError fault(std::string_view key, std::string_view problem,
                                         std::string_view cure = {}) const;

 protected:
  virtual void field(const Field& field, Value& value) = 0;
  /// False: nothing is to be visited there, and there is no end().
  [[nodiscard]] virtual bool begin(std::string_view name) = 0;
  /// How many items there are; empty: nothing is to be visited, and there is no end().
  [[nodiscard]] virtual std::optional<std::size_t> begin_list(std::string_view name, std::size_t count) = 0;
  virtual void begin_item(std::size_t index) = 0;
  virtual void end() = 0;

 private:
  void visit_value(const Field& of, Value&& value) { field(of, value); }
  [[nodiscard]] int choose(const Field& field, int now, std::span<const std::string_view> words);
};

/// A number as text: the fewest digits that give it back; infinity is "none".
[[nodiscard]] std::string show(double value);
/// Degrees that radians() turns into the very same angle where there are any, else the nearest, in the fewest
/// digits.
[[nodiscard]] double exact_degrees(double radians);

}  // namespace canyon::options
