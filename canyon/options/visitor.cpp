#include "canyon/options/visitor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "canyon/base/named.hpp"
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

/// A value that is stored in a `T`.
template <typename T, Type kType>
class StoredValue : public Value {
 public:
  explicit StoredValue(T& value) : value_(value) {}
  Type type() const override { return kType; }
  bool given() const override {
    if constexpr (requires { value_.empty(); }) {
      return !value_.empty();
    } else if constexpr (requires { value_.has_value(); }) {
      return value_.has_value();
    } else {
      return true;
    }
  }

 protected:
  ~StoredValue() = default;

  T& value_;
};

/// One or more numbers of a range.
template <typename T, Type kType>
class RangedValue : public StoredValue<T, kType> {
 public:
  RangedValue(T& value, const Range& range) : StoredValue<T, kType>(value), range_(range) {}
  std::string bound() const override { return range_.words(); }
  std::optional<Range> range() const override { return range_; }

 protected:
  ~RangedValue() = default;

  const Range& range_;
};

/// One or more of a list of words.
template <typename T, Type kType>
class ListedValue : public StoredValue<T, kType> {
 public:
  ListedValue(T& value, std::span<const std::string_view> words)
      : StoredValue<T, kType>(value), words_(words) {}
  std::vector<std::string> words() const override { return {words_.begin(), words_.end()}; }

 protected:
  ~ListedValue() = default;
  bool is_listed(const std::string& word) const {
    return std::find(words_.begin(), words_.end(), word) != words_.end();
  }
  std::string one_of_words() const { return fmt::format("one of {}", fmt::join(words_, ", ")); }

  std::span<const std::string_view> words_;
};

class NumberValue final : public RangedValue<double, Type::Number> {
 public:
  using RangedValue::RangedValue;
  std::string text() const override { return show(value_); }
  bool in_range() const override { return range_.holds(value_); }
  void read(const Node& node, const Place& place) override {
    value_ = to_number(read_scalar(node, place), range_, place);
  }
};

class AngleValue final : public RangedValue<double, Type::Number> {
 public:
  using RangedValue::RangedValue;
  std::string text() const override { return show(exact_degrees(value_)); }
  std::string exact() const override { return show(value_); }
  std::string shown() const override {
    return fmt::format("{} ({:.9g} deg)", value_, geodesy::degrees(value_));
  }
  bool in_range() const override {
    Range range = range_;
    range.low = geodesy::radians(range.low);
    range.high = geodesy::radians(range.high);
    return range.holds(value_);
  }
  std::string bound() const override { return range_.words() + " deg"; }
  bool is_angle() const override { return true; }
  void read(const Node& node, const Place& place) override {
    value_ = geodesy::radians(to_number(read_scalar(node, place), range_, place));
  }
};

template <typename Integer>
class IntegerValue final : public StoredValue<Integer, Type::Integer> {
 public:
  IntegerValue(Integer& value, std::int64_t low, std::int64_t high)
      : StoredValue<Integer, Type::Integer>(value), low_(low), high_(high) {}
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
    const std::string text = read_scalar(node, place);
    const auto value = parse_integer(text);
    if (!value) throw place.error(fmt::format("'{}' is not a whole number", text), "write digits alone");
    if (*value < low_ || *value > high_) {
      throw place.error(fmt::format("{} is out of range", text),
                        fmt::format("it runs from {} to {}", low_, high_));
    }
    value_ = static_cast<Integer>(*value);
  }

 private:
  using StoredValue<Integer, Type::Integer>::value_;
  std::int64_t low_, high_;
};

class BooleanValue final : public StoredValue<bool, Type::Boolean> {
 public:
  using StoredValue::StoredValue;
  std::string text() const override { return value_ ? "true" : "false"; }
  void read(const Node& node, const Place& place) override { value_ = read_boolean(node, place); }
};

class TextValue final : public StoredValue<std::string, Type::Text> {
 public:
  using StoredValue::StoredValue;
  std::string text() const override { return yaml_scalar(value_); }
  void read(const Node& node, const Place& place) override { value_ = read_text(node, place); }
};

class WordValue final : public ListedValue<std::string, Type::Choice> {
 public:
  using ListedValue::ListedValue;
  std::string text() const override { return value_; }
  bool in_range() const override { return value_.empty() || is_listed(value_); }
  std::string bound() const override { return one_of_words(); }
  void read(const Node& node, const Place& place) override { value_ = read_word(node, words(), place); }
};

class ChoiceValue final : public ListedValue<int, Type::Choice> {
 public:
  using ListedValue::ListedValue;
  std::string text() const override {
    return in_range() ? std::string(words_[static_cast<std::size_t>(value_)]) : fmt::format("{}", value_);
  }
  bool in_range() const override { return value_ >= 0 && static_cast<std::size_t>(value_) < words_.size(); }
  std::string bound() const override { return one_of_words(); }
  void read(const Node& node, const Place& place) override {
    const std::string word = read_word(node, words(), place);
    value_ = static_cast<int>(std::find(words_.begin(), words_.end(), word) - words_.begin());
  }
};

/// Text and numbers that may be absent. @param range of Inner, if it has one
template <typename Inner, typename Of, Type kType, typename... Limits>
class OptionalValue final : public StoredValue<std::optional<Of>, kType> {
 public:
  explicit OptionalValue(std::optional<Of>& value, const Limits&... range)
      : StoredValue<std::optional<Of>, kType>(value), inner_(held_, range...) {
    held_ = value.value_or(Of());
  }
  std::string text() const override { return value_ ? inner_.text() : ""; }
  bool in_range() const override { return !value_ || inner_.in_range(); }
  std::string bound() const override { return inner_.bound(); }
  std::optional<Range> range() const override { return inner_.range(); }
  void read(const Node& node, const Place& place) override {
    inner_.read(node, place);
    value_ = held_;
  }

 private:
  using StoredValue<std::optional<Of>, kType>::value_;
  Of held_{};
  Inner inner_;
};

class TextsValue final : public StoredValue<std::vector<std::string>, Type::Texts> {
 public:
  using StoredValue::StoredValue;
  std::string text() const override {
    std::vector<std::string> items;
    for (const std::string& item : value_) items.push_back(yaml_scalar(item));
    return flow(items);
  }
  void read(const Node& node, const Place& place) override { value_ = read_texts(node, place); }
};

class WordsValue final : public ListedValue<std::vector<std::string>, Type::Texts> {
 public:
  using ListedValue::ListedValue;
  std::string text() const override { return flow(value_); }
  void read(const Node& node, const Place& place) override {
    if (node.kind == Node::Kind::Empty) return;
    const std::vector<std::string> texts = read_texts(node, place);
    for (auto text = texts.begin(); text != texts.end(); ++text) {
      // Words of Visitor::replaced() below this key, where it may be a list or a section.
      const auto& replaced = place.document.replaced;
      const std::string path = place.section.empty() ? place.key : place.section + "." + place.key;
      if (const auto cure = replaced.find(path + "." + *text); cure != replaced.end())
        throw place.error(fmt::format("'{}' is unknown", *text), cure->second);
      require_word(*text, words(), place);
      if (std::find(texts.begin(), text, *text) != text) {
        throw place.error(fmt::format("'{}' is given twice", *text), "name each once");
      }
    }
    value_ = texts;
  }
};

std::string numbers_text(const std::vector<double>& values) {
  std::vector<std::string> items;
  for (const double value : values) items.push_back(show(value));
  return flow(items);
}

class NumbersValue final : public RangedValue<std::vector<double>, Type::Numbers> {
 public:
  using RangedValue::RangedValue;
  std::string text() const override { return numbers_text(value_); }
  bool in_range() const override {
    return std::all_of(value_.begin(), value_.end(), [this](double each) { return range_.holds(each); });
  }
  void read(const Node& node, const Place& place) override { value_ = read_numbers(node, range_, place); }
};

class NamedNumbersValue final : public StoredValue<std::map<std::string, double>, Type::Texts> {
 public:
  NamedNumbersValue(std::map<std::string, double>& value, const Range& range, std::string_view form)
      : StoredValue(value), range_(range), form_(form) {}
  std::string text() const override {
    std::vector<std::string> items;
    for (const auto& item : value_) items.push_back(yaml_scalar(show_item(item)));
    return flow(items);
  }
  bool in_range() const override { return wrong() == value_.end(); }
  std::string shown() const override { return in_range() ? text() : show_item(*wrong()); }
  std::string bound() const override { return range_.words(); }
  void read(const Node& node, const Place& place) override {
    Items given;
    for (const std::string& text : read_texts(node, place)) {
      const std::size_t equals = std::min(text.find('='), text.size());
      const auto number = parse_double(std::string_view(text).substr(std::min(equals + 1, text.size())));
      if (equals == 0 || !number || !range_.holds(*number)) {
        throw place.error(fmt::format("'{}' is not {}", text, form_),
                          fmt::format("the number is {}", range_.words()));
      }
      const std::string name = text.substr(0, equals);
      if (!given.emplace(name, *number).second) {
        throw place.error(fmt::format("'{}' is given twice", name), "name each once");
      }
      value_[name] = *number;
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

  const Range& range_;
  std::string_view form_;
};

class FileValue final : public StoredValue<std::optional<std::filesystem::path>, Type::File> {
 public:
  using StoredValue::StoredValue;
  std::string text() const override {
    return value_ ? yaml_scalar(std::filesystem::absolute(*value_).string()) : "";
  }
  void read(const Node& node, const Place& place) override {
    value_ = read_file(read_text(node, place), place);
  }
};

class FilesValue final : public StoredValue<std::vector<std::filesystem::path>, Type::Files> {
 public:
  using StoredValue::StoredValue;
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
};

class NameValue final : public ListedValue<NamedRows, Type::Choice> {
 public:
  using ListedValue::ListedValue;
  bool given() const override { return is_listed(value_.name()); }
  std::string text() const override { return value_.name(); }
  void read(const Node& node, const Place& place) override {
    value_.set_name(read_word(node, words(), place));
  }
};

class RowsValue final : public StoredValue<NamedRows, Type::Rows> {
 public:
  RowsValue(NamedRows& value, std::span<const std::string_view> names, std::size_t columns)
      : StoredValue(value), names_(names), columns_(columns) {}
  // A value of a known name is written by its name.
  bool given() const override {
    return std::find(names_.begin(), names_.end(), value_.name()) == names_.end();
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
  std::span<const std::string_view> names_;
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
  visit_value(f, NumberValue(value, range));
}
void Visitor::angle(const Field& f, double& value_rad, const Range& range_deg) {
  visit_value(f, AngleValue(value_rad, range_deg));
}
void Visitor::integer(const Field& f, int& value, int low, int high) {
  visit_value(f, IntegerValue<int>(value, low, high));
}
void Visitor::integer(const Field& f, std::uint32_t& value, std::uint32_t low, std::uint32_t high) {
  visit_value(f, IntegerValue<std::uint32_t>(value, low, high));
}
void Visitor::integer(const Field& f, std::uint64_t& value, std::uint64_t low, std::uint64_t high) {
  visit_value(
      f, IntegerValue<std::uint64_t>(value, static_cast<std::int64_t>(low), static_cast<std::int64_t>(high)));
}
void Visitor::boolean(const Field& f, bool& value) {
  visit_value(f, BooleanValue(value));
}
void Visitor::text(const Field& f, std::string& value) {
  visit_value(f, TextValue(value));
}
void Visitor::number(const Field& f, std::optional<double>& value, const Range& range) {
  visit_value(f, OptionalValue<NumberValue, double, Type::Number, Range>(value, range));
}
void Visitor::text(const Field& f, std::optional<std::string>& value) {
  visit_value(f, OptionalValue<TextValue, std::string, Type::Text>(value));
}
void Visitor::texts(const Field& f, std::vector<std::string>& value) {
  visit_value(f, TextsValue(value));
}
void Visitor::words(const Field& f, std::vector<std::string>& value,
                    std::span<const std::string_view> words) {
  visit_value(f, WordsValue(value, words));
}
void Visitor::numbers(const Field& f, std::vector<double>& value, const Range& range) {
  visit_value(f, NumbersValue(value, range));
}
void Visitor::named_numbers(const Field& f, std::map<std::string, double>& value, const Range& range,
                            std::string_view form) {
  visit_value(f, NamedNumbersValue(value, range, form));
}
void Visitor::file(const Field& f, std::optional<std::filesystem::path>& value) {
  visit_value(f, FileValue(value));
}
void Visitor::files(const Field& f, std::vector<std::filesystem::path>& value) {
  visit_value(f, FilesValue(value));
}
void Visitor::word(const Field& f, std::string& value, std::span<const std::string_view> words) {
  visit_value(f, WordValue(value, words));
}
int Visitor::choose(const Field& f, int now, std::span<const std::string_view> words) {
  visit_value(f, ChoiceValue(now, words));
  return now;
}
void Visitor::named_rows(const Field& by_name, std::span<const std::string_view> words, const Field& by_rows,
                         std::size_t columns, NamedRows& value) {
  one_of({by_name.name, by_rows.name});
  visit_value(by_name, NameValue(value, words));
  rows(by_rows, words, columns, value);
}
void Visitor::rows(const Field& f, std::span<const std::string_view> words, std::size_t columns,
                   NamedRows& value) {
  visit_value(f, RowsValue(value, words, columns));
}

InputError Visitor::fault(std::string_view key, std::string_view problem, std::string_view cure) const {
  return InputError(key.empty() ? std::string(problem) : fmt::format("{}: {}", key, problem), cure);
}

std::string show(double value) {
  return std::isinf(value) && value > 0 ? "none" : fmt::format("{}", value);
}

double exact_degrees(double radians) {
  const double degrees = geodesy::degrees(radians);
  // Numbers that people write have few digits.
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
