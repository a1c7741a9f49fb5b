#include "canyon/options/visitor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "canyon/base/text.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/options/node.hpp"

namespace canyon::options {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A text as YAML: plain where that cannot be read as anything else.
std::string yaml_scalar(const std::string& text) {
  const bool plain = !text.empty() && std::all_of(text.begin(), text.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ||
           c == '/' || c == '.' || c == '-' || c == '=';
  });
  if (plain && text.front() != '-' && text.front() != '=' && !parse_double(text)) return text;
  std::string result = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') {
      result += '\\';
      result += c;
    } else if (static_cast<unsigned char>(c) < 0x20) {
      result += fmt::format("\\x{:02x}", static_cast<int>(c));
    } else {
      result += c;
    }
  }
  return result + '"';
}

std::string flow(const std::vector<std::string>& items) {
  return fmt::format("[{}]", fmt::join(items, ", "));
}

constexpr const char* kOneValue = "write one value";

std::string scalar(const Node& node, const Place& place) {
  if (node.kind == Node::Kind::Empty)
    throw place.error("has no value", "write one after the colon, or remove the key");
  if (node.kind != Node::Kind::Scalar) {
    throw place.error(node.kind == Node::Kind::Mapping ? "is a mapping where one value belongs"
                                                       : "is a list where one value belongs",
                      kOneValue);
  }
  return node.text;
}

std::string read_text(const Node& node, const Place& place) {
  std::string text = scalar(node, place);
  if (trim(text).empty()) throw place.error("is empty", "write something, or remove the key");
  return text;
}

// A list of texts, or a single one.
std::vector<std::string> read_texts(const Node& node, const Place& place) {
  if (node.kind != Node::Kind::List) return {read_text(node, place)};
  std::vector<std::string> texts;
  for (const Node& item : node.items) {
    if (item.kind != Node::Kind::Scalar || trim(item.text).empty()) {
      Place at = place;
      if (item.line > 0) at.line = item.line;
      throw at.error(fmt::format("item {} is not one value", texts.size() + 1), kOneValue);
    }
    texts.push_back(item.text);
  }
  if (texts.empty()) throw place.error("the list is empty", "give at least one item, or remove the key");
  return texts;
}

std::optional<double> parse_fraction(std::string_view text) {
  const std::size_t slash = text.find('/');
  if (slash == std::string_view::npos) return std::nullopt;
  const auto above = parse_double(text.substr(0, slash));
  const auto below = parse_double(text.substr(slash + 1));
  if (!above || !below || *below == 0) return std::nullopt;
  return *above / *below;
}

double to_number(const std::string& text, const Range& range, const Place& place) {
  if (range.none && text == "none") return kInfinity;
  std::optional<double> value = parse_double(text);
  if (!value && range.fraction) value = parse_fraction(text);
  if (!value) {
    // "10 deg", "2m": a number with its unit.
    const std::size_t end = text.find_first_not_of("+-.0123456789eE");
    const bool has_unit =
        end != std::string::npos && end > 0 && parse_double(text.substr(0, end)).has_value();
    throw place.error(
        fmt::format("'{}' is not a number", text),
        has_unit ? fmt::format("give the number alone, the unit is in the {}'s name", place.document.word)
                 : fmt::format("it is {}", range.words()));
  }
  if (!range.holds(*value)) {
    throw place.error(fmt::format("{} is out of range", text), fmt::format("it is {}", range.words()));
  }
  return *value;
}

// A list of numbers, or one text with blanks between them.
std::vector<double> read_numbers(const Node& node, const Range& range, const Place& place) {
  std::vector<double> values;
  if (node.kind == Node::Kind::List) {
    for (const std::string& item : read_texts(node, place)) values.push_back(to_number(item, range, place));
    return values;
  }
  const std::string line = scalar(node, place);
  for (const std::string_view item : split_blanks(line)) {
    values.push_back(to_number(std::string(item), range, place));
  }
  if (values.empty()) throw place.error("the list is empty", "give at least one number, or remove the key");
  return values;
}

// Rows of numbers: a list of lists, or all numbers in one list or text, row by row.
std::vector<std::vector<double>> read_rows(const Node& node, std::size_t columns, const Range& range,
                                           const Place& place) {
  std::vector<std::vector<double>> rows;
  if (node.kind == Node::Kind::List && !node.items.empty() && node.items[0].kind == Node::Kind::List) {
    for (const Node& row : node.items) {
      std::vector<double> values;
      for (const Node& item : row.items) {
        values.push_back(to_number(item.kind == Node::Kind::Scalar ? item.text : "?", range, place));
      }
      if (values.size() != columns) {
        Place at = place;
        if (row.line > 0) at.line = row.line;
        throw at.error(fmt::format("row {} has not {} numbers", rows.size() + 1, columns));
      }
      rows.push_back(std::move(values));
    }
    return rows;
  }
  const std::vector<double> flat = read_numbers(node, range, place);
  if (flat.size() % columns != 0) {
    throw place.error(fmt::format("{} numbers make no rows of {}", flat.size(), columns));
  }
  for (std::size_t i = 0; i < flat.size(); i += columns) {
    const auto begin = flat.begin() + static_cast<std::ptrdiff_t>(i);
    rows.emplace_back(begin, begin + static_cast<std::ptrdiff_t>(columns));
  }
  return rows;
}

bool read_boolean(const Node& node, const Place& place) {
  const std::string text = read_text(node, place);
  const std::string small = lower_case(text);
  if (place.document.digits_are_booleans) {
    if (small == "true" || small == "1") return true;
    if (small == "false" || small == "0") return false;
    throw place.error(fmt::format("'{}' is neither true nor false", text), "write true, false, 1 or 0");
  }
  // YAML 1.1's words: in small letters, in capitals, or with a capital first.
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
  throw place.error(fmt::format("'{}' is neither true nor false", text), "write true or false");
}

std::filesystem::path read_file(const std::string& text, const Place& place) {
  if (place.document.find_file) return place.document.find_file(text, place);
  const std::filesystem::path path = place.document.file.parent_path() / text;
  std::error_code ignored;
  if (!std::filesystem::exists(path, ignored)) {
    throw place.error(fmt::format("there is no file '{}'", path.string()),
                      fmt::format("paths are relative to the {}'s folder", place.document.kind));
  }
  if (std::filesystem::is_directory(path, ignored)) {
    throw place.error(fmt::format("'{}' is a folder, not a file", path.string()));
  }
  return path;
}

/// Throws InputError where `text` is none of `known`.
void require_word(const std::string& text, const std::vector<std::string>& known, const Place& place) {
  if (std::find(known.begin(), known.end(), text) != known.end()) return;
  const auto similar = closest(text, known);
  throw place.error(fmt::format("'{}' is unknown", text),
                    (similar ? fmt::format("did you mean '{}'? ", *similar) : "") +
                        fmt::format("known: {}", fmt::join(known, ", ")));
}

std::string read_word(const Node& node, const std::vector<std::string>& words, const Place& place) {
  const std::string text = read_text(node, place);
  require_word(text, words, place);
  return text;
}

class NumberValue final : public Value {
 public:
  NumberValue(double& value, const Range& range) : value_(value), range_(range) {}
  Type type() const override { return Type::Number; }
  std::string text() const override { return show(value_); }
  bool in_range() const override { return range_.holds(value_); }
  std::string bound() const override { return range_.words(); }
  std::optional<Range> range() const override { return range_; }
  void read(const Node& node, const Place& place) override {
    value_ = to_number(scalar(node, place), range_, place);
  }

 private:
  double& value_;
  const Range& range_;
};

class AngleValue final : public Value {
 public:
  AngleValue(double& value_rad, const Range& range_deg) : value_(value_rad), range_(range_deg) {}
  Type type() const override { return Type::Number; }
  std::string text() const override { return show(exact_degrees(value_)); }
  std::string exact() const override { return show(value_); }
  std::string told() const override {
    return fmt::format("{} ({:.9g} deg)", value_, geodesy::degrees(value_));
  }
  bool in_range() const override {
    Range range = range_;
    range.low = geodesy::radians(range.low);
    range.high = geodesy::radians(range.high);
    return range.holds(value_);
  }
  std::string bound() const override { return range_.words() + " deg"; }
  std::optional<Range> range() const override { return range_; }
  bool is_angle() const override { return true; }
  void read(const Node& node, const Place& place) override {
    value_ = geodesy::radians(to_number(scalar(node, place), range_, place));
  }

 private:
  double& value_;
  const Range& range_;
};

template <typename Integer>
class IntegerValue final : public Value {
 public:
  IntegerValue(Integer& value, std::int64_t low, std::int64_t high) : value_(value), low_(low), high_(high) {}
  Type type() const override { return Type::Integer; }
  std::string text() const override { return fmt::format("{}", value_); }
  bool in_range() const override {
    const auto value = static_cast<std::int64_t>(value_);
    return value >= low_ && value <= high_;
  }
  std::string bound() const override { return fmt::format("from {} to {}", low_, high_); }
  std::optional<Range> range() const override {
    return Range{static_cast<double>(low_), static_cast<double>(high_)};
  }
  void read(const Node& node, const Place& place) override {
    const std::string text = scalar(node, place);
    const auto value = parse_integer(text);
    if (!value) throw place.error(fmt::format("'{}' is not a whole number", text), "write digits alone");
    if (*value < low_ || *value > high_) {
      throw place.error(fmt::format("{} is out of range", text),
                        fmt::format("it runs from {} to {}", low_, high_));
    }
    value_ = static_cast<Integer>(*value);
  }

 private:
  Integer& value_;
  std::int64_t low_, high_;
};

class BooleanValue final : public Value {
 public:
  explicit BooleanValue(bool& value) : value_(value) {}
  Type type() const override { return Type::Boolean; }
  std::string text() const override { return value_ ? "true" : "false"; }
  void read(const Node& node, const Place& place) override { value_ = read_boolean(node, place); }

 private:
  bool& value_;
};

class TextValue final : public Value {
 public:
  explicit TextValue(std::string& value) : value_(value) {}
  Type type() const override { return Type::Text; }
  bool given() const override { return !value_.empty(); }
  std::string text() const override { return yaml_scalar(value_); }
  void read(const Node& node, const Place& place) override { value_ = read_text(node, place); }

 private:
  std::string& value_;
};

class WordValue final : public Value {
 public:
  WordValue(std::string& value, std::span<const std::string_view> words) : value_(value), words_(words) {}
  Type type() const override { return Type::Choice; }
  bool given() const override { return !value_.empty(); }
  std::string text() const override { return value_; }
  bool in_range() const override {
    return value_.empty() || std::find(words_.begin(), words_.end(), value_) != words_.end();
  }
  std::string bound() const override { return fmt::format("one of {}", fmt::join(words_, ", ")); }
  std::vector<std::string> words() const override { return {words_.begin(), words_.end()}; }
  void read(const Node& node, const Place& place) override { value_ = read_word(node, words(), place); }

 private:
  std::string& value_;
  std::span<const std::string_view> words_;
};

class ChoiceValue final : public Value {
 public:
  ChoiceValue(int& index, std::span<const std::string_view> words) : index_(index), words_(words) {}
  Type type() const override { return Type::Choice; }
  std::string text() const override {
    return in_range() ? std::string(words_[static_cast<std::size_t>(index_)]) : fmt::format("{}", index_);
  }
  bool in_range() const override { return index_ >= 0 && static_cast<std::size_t>(index_) < words_.size(); }
  std::string bound() const override { return fmt::format("one of {}", fmt::join(words_, ", ")); }
  std::vector<std::string> words() const override { return {words_.begin(), words_.end()}; }
  void read(const Node& node, const Place& place) override {
    const std::string word = read_word(node, words(), place);
    index_ = static_cast<int>(std::find(words_.begin(), words_.end(), word) - words_.begin());
  }

 private:
  int& index_;
  std::span<const std::string_view> words_;
};

/// Text and numbers that may be absent.
template <typename Inner, typename Of, Type kType>
class OptionalValue final : public Value {
 public:
  OptionalValue(std::optional<Of>& value, std::optional<Range> range)
      : value_(value), range_(std::move(range)) {}
  Type type() const override { return kType; }
  bool given() const override { return value_.has_value(); }
  std::string text() const override { return value_ ? with(*value_, &Value::text) : ""; }
  bool in_range() const override {
    Of copy = value_.value_or(Of());
    return !value_ || make(copy).in_range();
  }
  std::string bound() const override { return range_ ? range_->words() : ""; }
  std::optional<Range> range() const override { return range_; }
  void read(const Node& node, const Place& place) override {
    Of value = value_.value_or(Of());
    make(value).read(node, place);
    value_ = std::move(value);
  }

 private:
  Inner make(Of& value) const {
    if constexpr (std::is_constructible_v<Inner, Of&, const Range&>) {
      return Inner(value, *range_);
    } else {
      return Inner(value);
    }
  }
  std::string with(const Of& value, std::string (Value::*member)() const) const {
    Of copy = value;
    const Inner inner = make(copy);
    return (inner.*member)();
  }

  std::optional<Of>& value_;
  std::optional<Range> range_;
};

class TextsValue final : public Value {
 public:
  explicit TextsValue(std::vector<std::string>& value) : value_(value) {}
  Type type() const override { return Type::Texts; }
  bool given() const override { return !value_.empty(); }
  std::string text() const override {
    std::vector<std::string> items;
    for (const std::string& item : value_) items.push_back(yaml_scalar(item));
    return flow(items);
  }
  void read(const Node& node, const Place& place) override { value_ = read_texts(node, place); }

 private:
  std::vector<std::string>& value_;
};

class WordsValue final : public Value {
 public:
  WordsValue(std::vector<std::string>& value, std::span<const std::string_view> words)
      : value_(value), words_(words) {}
  Type type() const override { return Type::Texts; }
  bool given() const override { return !value_.empty(); }
  std::string text() const override { return flow(value_); }
  std::vector<std::string> words() const override { return {words_.begin(), words_.end()}; }
  void read(const Node& node, const Place& place) override {
    if (node.kind == Node::Kind::Empty) return;
    const std::vector<std::string> texts = read_texts(node, place);
    for (auto text = texts.begin(); text != texts.end(); ++text) {
      require_word(*text, words(), place);
      if (std::find(texts.begin(), text, *text) != text) {
        throw place.error(fmt::format("'{}' stands twice", *text), "name each once");
      }
    }
    value_ = texts;
  }

 private:
  std::vector<std::string>& value_;
  std::span<const std::string_view> words_;
};

std::string numbers_text(const std::vector<double>& values) {
  std::vector<std::string> items;
  for (const double value : values) items.push_back(show(value));
  return flow(items);
}

class NumbersValue final : public Value {
 public:
  NumbersValue(std::vector<double>& value, const Range& range) : value_(value), range_(range) {}
  Type type() const override { return Type::Numbers; }
  bool given() const override { return !value_.empty(); }
  std::string text() const override { return numbers_text(value_); }
  bool in_range() const override {
    return std::all_of(value_.begin(), value_.end(), [this](double each) { return range_.holds(each); });
  }
  std::string bound() const override { return range_.words(); }
  std::optional<Range> range() const override { return range_; }
  void read(const Node& node, const Place& place) override { value_ = read_numbers(node, range_, place); }

 private:
  std::vector<double>& value_;
  const Range& range_;
};

class NamedNumbersValue final : public Value {
 public:
  NamedNumbersValue(std::map<std::string, double>& value, const Range& range, std::string_view form)
      : value_(value), range_(range), form_(form) {}
  Type type() const override { return Type::Texts; }
  bool given() const override { return !value_.empty(); }
  std::string text() const override {
    std::vector<std::string> items;
    for (const auto& item : value_) items.push_back(yaml_scalar(show_item(item)));
    return flow(items);
  }
  bool in_range() const override { return wrong() == value_.end(); }
  std::string told() const override { return in_range() ? text() : show_item(*wrong()); }
  std::string bound() const override { return range_.words(); }
  void read(const Node& node, const Place& place) override {
    for (const std::string& text : read_texts(node, place)) {
      const std::size_t equals = std::min(text.find('='), text.size());
      const auto number = parse_double(std::string_view(text).substr(std::min(equals + 1, text.size())));
      if (equals == 0 || !number || !range_.holds(*number)) {
        throw place.error(fmt::format("'{}' is not {}", text, form_),
                          fmt::format("the number is {}", range_.words()));
      }
      value_[text.substr(0, equals)] = *number;
    }
  }

 private:
  using Items = std::map<std::string, double>;
  static std::string show_item(const Items::value_type& item) {
    return fmt::format("{}={}", item.first, item.second);
  }
  Items::const_iterator wrong() const {
    return std::find_if(value_.begin(), value_.end(), [this](const auto& item) {
      return item.first.empty() || !range_.holds(item.second);
    });
  }

  Items& value_;
  const Range& range_;
  std::string_view form_;
};

class FileValue final : public Value {
 public:
  explicit FileValue(std::optional<std::filesystem::path>& value) : value_(value) {}
  Type type() const override { return Type::File; }
  bool given() const override { return value_.has_value(); }
  std::string text() const override {
    return value_ ? yaml_scalar(std::filesystem::absolute(*value_).string()) : "";
  }
  void read(const Node& node, const Place& place) override {
    value_ = read_file(read_text(node, place), place);
  }

 private:
  std::optional<std::filesystem::path>& value_;
};

class FilesValue final : public Value {
 public:
  explicit FilesValue(std::vector<std::filesystem::path>& value) : value_(value) {}
  Type type() const override { return Type::Files; }
  bool given() const override { return !value_.empty(); }
  std::string text() const override {
    std::vector<std::string> items;
    for (const auto& item : value_) items.push_back(yaml_scalar(std::filesystem::absolute(item).string()));
    return flow(items);
  }
  void read(const Node& node, const Place& place) override {
    std::vector<std::filesystem::path> files;
    for (const std::string& text : read_texts(node, place)) files.push_back(read_file(text, place));
    value_ = std::move(files);
  }

 private:
  std::vector<std::filesystem::path>& value_;
};

class NameValue final : public Value {
 public:
  NameValue(NamedRows& value, std::span<const std::string_view> words) : value_(value), words_(words) {}
  Type type() const override { return Type::Choice; }
  bool given() const override {
    return std::find(words_.begin(), words_.end(), value_.name()) != words_.end();
  }
  std::string text() const override { return value_.name(); }
  std::vector<std::string> words() const override { return {words_.begin(), words_.end()}; }
  void read(const Node& node, const Place& place) override {
    value_.set_name(read_word(node, words(), place));
  }

 private:
  NamedRows& value_;
  std::span<const std::string_view> words_;
};

class RowsValue final : public Value {
 public:
  RowsValue(NamedRows& value, std::span<const std::string_view> words, std::size_t columns)
      : value_(value), words_(words), columns_(columns) {}
  Type type() const override { return Type::Rows; }
  // A value of a known name is written by its name.
  bool given() const override {
    return std::find(words_.begin(), words_.end(), value_.name()) == words_.end();
  }
  std::string text() const override {
    std::vector<std::string> rows;
    for (const std::vector<double>& row : value_.rows()) rows.push_back(numbers_text(row));
    return flow(rows);
  }
  void read(const Node& node, const Place& place) override {
    const auto rows = read_rows(node, columns_, {-1000, 1000}, place);
    try {
      value_.set_rows(rows);
    } catch (const InputError& error) {
      throw place.error(error.problem(), error.cure());
    }
  }

 private:
  NamedRows& value_;
  std::span<const std::string_view> words_;
  std::size_t columns_;
};

}  // namespace

bool Range::holds(double value) const {
  if (none && value == kInfinity) return true;
  return (low_open ? value > low : value >= low) && (high_open ? value < high : value <= high) &&
         std::isfinite(value);
}

std::string Range::words() const {
  std::string text;
  if (std::isfinite(low)) text += fmt::format("{} {}", low_open ? "above" : "at least", low);
  if (std::isfinite(high)) {
    text += fmt::format("{}{} {}", text.empty() ? "" : " and ", high_open ? "below" : "at most", high);
  }
  if (text.empty()) text = "any number";
  return none ? text + ", or none" : text;
}

std::string Range::interval() const {
  if (!std::isfinite(low)) return "";
  std::string text = high < 1e18
                         ? fmt::format("{}{}, {}{}", low_open ? '(' : '[', low, high, high_open ? ')' : ']')
                         : fmt::format("{}{}", low_open ? "above " : "from ", low);
  return none ? text + ", or none" : text;
}

InputError Place::error(std::string_view problem, std::string_view cure) const {
  return document.error(section, key, line, problem, cure);
}

void Visitor::number(const Field& f, double& value, const Range& range) {
  NumberValue of(value, range);
  field(f, of);
}
void Visitor::angle(const Field& f, double& value_rad, const Range& range_deg) {
  AngleValue of(value_rad, range_deg);
  field(f, of);
}
void Visitor::integer(const Field& f, int& value, int low, int high) {
  IntegerValue<int> of(value, low, high);
  field(f, of);
}
void Visitor::integer(const Field& f, std::uint32_t& value, std::uint32_t low, std::uint32_t high) {
  IntegerValue<std::uint32_t> of(value, low, high);
  field(f, of);
}
void Visitor::integer(const Field& f, std::uint64_t& value, std::uint64_t low, std::uint64_t high) {
  IntegerValue<std::uint64_t> of(value, static_cast<std::int64_t>(low), static_cast<std::int64_t>(high));
  field(f, of);
}
void Visitor::boolean(const Field& f, bool& value) {
  BooleanValue of(value);
  field(f, of);
}
void Visitor::text(const Field& f, std::string& value) {
  TextValue of(value);
  field(f, of);
}
void Visitor::number(const Field& f, std::optional<double>& value, const Range& range) {
  OptionalValue<NumberValue, double, Type::Number> of(value, range);
  field(f, of);
}
void Visitor::text(const Field& f, std::optional<std::string>& value) {
  OptionalValue<TextValue, std::string, Type::Text> of(value, std::nullopt);
  field(f, of);
}
void Visitor::texts(const Field& f, std::vector<std::string>& value) {
  TextsValue of(value);
  field(f, of);
}
void Visitor::words(const Field& f, std::vector<std::string>& value,
                    std::span<const std::string_view> words) {
  WordsValue of(value, words);
  field(f, of);
}
void Visitor::numbers(const Field& f, std::vector<double>& value, const Range& range) {
  NumbersValue of(value, range);
  field(f, of);
}
void Visitor::named_numbers(const Field& f, std::map<std::string, double>& value, const Range& range,
                            std::string_view form) {
  NamedNumbersValue of(value, range, form);
  field(f, of);
}
void Visitor::file(const Field& f, std::optional<std::filesystem::path>& value) {
  FileValue of(value);
  field(f, of);
}
void Visitor::files(const Field& f, std::vector<std::filesystem::path>& value) {
  FilesValue of(value);
  field(f, of);
}
void Visitor::word(const Field& f, std::string& value, std::span<const std::string_view> words) {
  WordValue of(value, words);
  field(f, of);
}
int Visitor::choose(const Field& f, int now, std::span<const std::string_view> words) {
  ChoiceValue of(now, words);
  field(f, of);
  return now;
}
void Visitor::named_rows(const Field& by_name, std::span<const std::string_view> words, const Field& by_rows,
                         std::size_t columns, NamedRows& value) {
  one_of({by_name.name, by_rows.name});
  NameValue name(value, words);
  field(by_name, name);
  rows(by_rows, words, columns, value);
}
void Visitor::rows(const Field& f, std::span<const std::string_view> words, std::size_t columns,
                   NamedRows& value) {
  RowsValue of(value, words, columns);
  field(f, of);
}

InputError Visitor::fault(std::string_view key, std::string_view problem, std::string_view cure) const {
  return InputError(key.empty() ? std::string(problem) : fmt::format("{}: {}", key, problem), cure);
}

std::string show(double value) {
  return std::isinf(value) && value > 0 ? "none" : fmt::format("{}", value);
}

double exact_degrees(double radians) {
  const double degrees = geodesy::degrees(radians);
  // What people wrote has few digits.
  for (const int digits : {6, 9, 12}) {
    const auto rounded = parse_double(fmt::format("{:.{}g}", degrees, digits));
    if (rounded && geodesy::radians(*rounded) == radians) return *rounded;
  }
  double up = degrees;
  double down = degrees;
  for (int step = 0; step < 8; ++step) {
    if (geodesy::radians(up) == radians) return up;
    if (geodesy::radians(down) == radians) return down;
    up = std::nextafter(up, kInfinity);
    down = std::nextafter(down, -kInfinity);
  }
  return degrees;
}

}  // namespace canyon::options
