#include "canyon/base/options/visitor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/named.hpp"
#include "canyon/base/options/node.hpp"

namespace canyon::options {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

// A text as YAML: plain if it cannot be read as anything else.
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

using Words = std::span<const std::string_view>;

std::vector<std::string> strings(Words words) {
  return {words.begin(), words.end()};
}
bool is_one_of(Words words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

std::string flow(const std::vector<std::string>& items) {
  return fmt::format("[{}]", fmt::join(items, ", "));
}
/// A list of `text` applied to each value.
template <typename Values, typename Text>
std::string flow_of(const Values& values, const Text& text) {
  std::vector<std::string> items;
  for (const auto& value : values) items.push_back(text(value));
  return flow(items);
}
std::string numbers_text(const std::vector<double>& values) {
  return flow_of(values, show);
}
std::string file_text(const std::filesystem::path& file) {
  return yaml_scalar(std::filesystem::absolute(file).string());
}

/// A value with functions that write and read it.
class FieldValue final : public Value {
 public:
  using Text = std::function<std::string()>;
  using Read = std::function<void(const Node&, const SourceLocation&)>;
  FieldValue(Type type, bool given, Text text, Read read)
      : type_(type), given_(given), text_(std::move(text)), read_(std::move(read)) {}
  FieldValue& within(const Range& range, bool in_range) {
    range_ = range;
    in_range_ = in_range;
    return *this;
  }
  FieldValue& among(Words words, bool in_range = true) {
    words_ = words;
    in_range_ = in_range;
    return *this;
  }

  /// The same for a value that may be absent; this object reads and writes `held`.
  template <typename T>
  [[nodiscard]] FieldValue or_absent(std::optional<T>& value, const T& held) && {
    given_ = value.has_value();
    in_range_ = in_range_ || !value;
    text_ = [&value, text = std::move(text_)] { return value ? text() : std::string(); };
    read_ = [&value, &held, read = std::move(read_)](const Node& node, const SourceLocation& location) {
      read(node, location);
      value = held;
    };
    return std::move(*this);
  }

  Type type() const override { return type_; }
  bool given() const override { return given_; }
  std::string text() const override { return text_(); }
  std::string exact() const override { return exact_ ? exact_() : text_(); }
  std::string shown() const override { return shown_ ? shown_() : text_(); }
  bool in_range() const override { return in_range_; }
  std::string bound() const override {
    if (bound_) return bound_();
    return range_ ? range_->words() : fmt::format("one of {}", fmt::join(words_, ", "));
  }
  std::optional<Range> range() const override { return range_; }
  std::vector<std::string> words() const override { return strings(words_); }
  bool is_angle() const override { return is_angle_; }
  void read(const Node& node, const SourceLocation& location) override { read_(node, location); }

  // Empty: the result of text(), by range and words.
  Text exact_, shown_, bound_;
  bool is_angle_ = false;

 private:
  Type type_;
  bool given_, in_range_ = true;
  Text text_;
  Read read_;
  std::optional<Range> range_;
  Words words_;
};

/// Sets a value to the result of `read`.
template <typename T, typename Read>
FieldValue::Read into(T& value, const Read& read) {
  return [&value, read](const Node& node, const SourceLocation& location) { value = read(node, location); };
}

FieldValue number_value(double& value, const Range& range) {
  const auto read = [&range](const Node& node, const SourceLocation& location) {
    return to_number(read_scalar(node, location), range, location);
  };
  const auto text = [&value] { return show(value); };
  return FieldValue(Type::Number, true, text, into(value, read)).within(range, range.holds(value));
}

FieldValue text_value(std::string& value) {
  return {Type::Text, !value.empty(), [&value] { return yaml_scalar(value); }, into(value, read_text)};
}

template <typename Integer>
FieldValue integer_value(Integer& value, std::int64_t low, std::int64_t high) {
  const auto holds = [low, high](std::int64_t number) { return number >= low && number <= high; };
  const auto read = [=](const Node& node, const SourceLocation& location) {
    const std::string text = read_scalar(node, location);
    const auto number = parse_integer(text);
    if (!number) throw location.error(fmt::format("'{}' is not a whole number", text), "write digits alone");
    if (!holds(*number))
      throw location.error(fmt::format("{} is out of range", text),
                           fmt::format("it runs from {} to {}", low, high));
    return static_cast<Integer>(*number);
  };
  const auto text = [&value] { return fmt::format("{}", value); };
  FieldValue of(Type::Integer, true, text, into(value, read));
  of.within({static_cast<double>(low), static_cast<double>(high)}, holds(static_cast<std::int64_t>(value)));
  of.bound_ = [=] { return fmt::format("from {} to {}", low, high); };
  return of;
}

/// Words of a list, none twice.
std::vector<std::string> read_words(const Node& node, Words words, const SourceLocation& location) {
  std::vector<std::string> texts = read_texts(node, location);
  for (auto text = texts.begin(); text != texts.end(); ++text) {
    // Words of Visitor::replaced() below this key, if the key may be a list or a section.
    const auto& replaced = location.document.replaced;
    const std::string path = location.section.empty() ? location.key : location.section + "." + location.key;
    if (const auto hint = replaced.find(path + "." + *text); hint != replaced.end())
      throw location.error(fmt::format("'{}' is unknown", *text), hint->second);
    require_word(*text, strings(words), location);
    if (std::find(texts.begin(), text, *text) != text)
      throw location.error(fmt::format("'{}' is given twice", *text), "name each once");
  }
  return texts;
}

using NamedNumbers = std::map<std::string, double>;

std::string item_text(const NamedNumbers::value_type& item) {
  return fmt::format("{}={}", item.first, item.second);
}

void read_named_numbers(const Node& node, const Range& range, std::string_view form,
                        const SourceLocation& location, NamedNumbers& value) {
  NamedNumbers given;
  for (const std::string& text : read_texts(node, location)) {
    const std::size_t equals = std::min(text.find('='), text.size());
    const auto number = parse_double(std::string_view(text).substr(std::min(equals + 1, text.size())));
    if (equals == 0 || !number || !range.holds(*number)) {
      throw location.error(fmt::format("'{}' is not {}", text, form),
                           fmt::format("the number is {}", range.words()));
    }
    const std::string name = text.substr(0, equals);
    if (!given.emplace(name, *number).second)
      throw location.error(fmt::format("'{}' is given twice", name), "name each once");
    value[name] = *number;
  }
}

}  // namespace

bool Range::holds(double value) const {
  if (none && value == kInfinity) return true;
  return (low_open ? value > low : value >= low) && (high_open ? value < high : value <= high) &&
         std::isfinite(value);
}

std::string Range::words() const {
  std::string text;
  if (std::isfinite(low)) text += fmt::format("{} {}", low_open ? "above" : "at least", low);
  if (std::isfinite(high))
    text += fmt::format("{}{} {}", text.empty() ? "" : " and ", high_open ? "below" : "at most", high);
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

InputError SourceLocation::error(std::string_view problem, std::string_view hint) const {
  return document.error(section, key, line, problem, hint);
}

void Visitor::number(const Field& f, double& value, const Range& range) {
  visit_value(f, number_value(value, range));
}
void Visitor::number(const Field& f, std::optional<double>& value, const Range& range) {
  double held = value.value_or(0);
  visit_value(f, number_value(held, range).or_absent(value, held));
}
void Visitor::angle(const Field& f, double& value_rad, const Range& range_deg) {
  Range range = range_deg;
  range.low = geodesy::radians(range.low);
  range.high = geodesy::radians(range.high);
  const auto read = [&](const Node& node, const SourceLocation& location) {
    return geodesy::radians(to_number(read_scalar(node, location), range_deg, location));
  };
  const auto text = [&] { return show(exact_degrees(value_rad)); };
  FieldValue of(Type::Number, true, text, into(value_rad, read));
  of.within(range_deg, range.holds(value_rad));
  of.exact_ = [&] { return show(value_rad); };
  of.shown_ = [&] { return fmt::format("{} ({:.9g} deg)", value_rad, geodesy::degrees(value_rad)); };
  of.bound_ = [&] { return range_deg.words() + " deg"; };
  of.is_angle_ = true;
  visit_value(f, std::move(of));
}
void Visitor::integer(const Field& f, int& value, int low, int high) {
  visit_value(f, integer_value(value, low, high));
}
void Visitor::integer(const Field& f, std::uint32_t& value, std::uint32_t low, std::uint32_t high) {
  visit_value(f, integer_value(value, low, high));
}
void Visitor::integer(const Field& f, std::uint64_t& value, std::uint64_t low, std::uint64_t high) {
  visit_value(f, integer_value(value, static_cast<std::int64_t>(low), static_cast<std::int64_t>(high)));
}
void Visitor::boolean(const Field& f, bool& value) {
  const auto text = [&value] { return value ? "true" : "false"; };
  visit_value(f, FieldValue(Type::Boolean, true, text, into(value, read_boolean)));
}
void Visitor::text(const Field& f, std::string& value) {
  visit_value(f, text_value(value));
}
void Visitor::text(const Field& f, std::optional<std::string>& value) {
  std::string held = value.value_or("");
  visit_value(f, text_value(held).or_absent(value, held));
}
void Visitor::texts(const Field& f, std::vector<std::string>& value) {
  const auto text = [&value] { return flow_of(value, yaml_scalar); };
  visit_value(f, FieldValue(Type::Texts, !value.empty(), text, into(value, read_texts)));
}
void Visitor::words(const Field& f, std::vector<std::string>& value, Words words) {
  const auto read = [&](const Node& node, const SourceLocation& location) {
    if (node.kind != Node::Kind::Empty) value = read_words(node, words, location);
  };
  const auto text = [&] { return flow(value); };
  FieldValue of(Type::Texts, !value.empty(), text, read);
  visit_value(f, std::move(of.among(words)));
}
void Visitor::numbers(const Field& f, std::vector<double>& value, const Range& range) {
  const auto read = [&](const Node& node, const SourceLocation& location) {
    return read_numbers(node, range, location);
  };
  const auto text = [&] { return numbers_text(value); };
  FieldValue of(Type::Numbers, !value.empty(), text, into(value, read));
  of.within(range, std::all_of(value.begin(), value.end(), [&](double each) { return range.holds(each); }));
  visit_value(f, std::move(of));
}
void Visitor::named_numbers(const Field& f, NamedNumbers& value, const Range& range, std::string_view form) {
  const auto wrong = std::find_if(value.begin(), value.end(), [&](const auto& item) {
    return item.first.empty() || !range.holds(item.second);
  });
  const auto read = [&](const Node& node, const SourceLocation& location) {
    read_named_numbers(node, range, form, location, value);
  };
  const auto text = [&] {
    return flow_of(value, [](const auto& item) { return yaml_scalar(item_text(item)); });
  };
  FieldValue of(Type::Texts, !value.empty(), text, read);
  of.among({}, wrong == value.end());
  of.shown_ = [&] { return wrong == value.end() ? text() : item_text(*wrong); };
  of.bound_ = [&] { return range.words(); };
  visit_value(f, std::move(of));
}
void Visitor::file(const Field& f, std::optional<std::filesystem::path>& value) {
  const auto text = [&value] { return value ? file_text(*value) : ""; };
  const auto read = [](const Node& node, const SourceLocation& location) {
    return read_file(read_text(node, location), location);
  };
  visit_value(f, FieldValue(Type::File, value.has_value(), text, into(value, read)));
}
void Visitor::files(const Field& f, std::vector<std::filesystem::path>& value) {
  const auto read = [](const Node& node, const SourceLocation& location) {
    std::vector<std::filesystem::path> files;
    for (const std::string& text : read_texts(node, location)) files.push_back(read_file(text, location));
    return files;
  };
  const auto text = [&value] { return flow_of(value, file_text); };
  visit_value(f, FieldValue(Type::Files, !value.empty(), text, into(value, read)));
}
void Visitor::word(const Field& f, std::string& value, Words words) {
  const auto read = [&](const Node& node, const SourceLocation& location) {
    return read_word(node, strings(words), location);
  };
  const auto text = [&] { return value; };
  FieldValue of(Type::Choice, !value.empty(), text, into(value, read));
  visit_value(f, std::move(of.among(words, value.empty() || is_one_of(words, value))));
}
int Visitor::choose(const Field& f, int now, Words words) {
  const bool known = now >= 0 && static_cast<std::size_t>(now) < words.size();
  const auto text = [&] {
    return known ? std::string(words[static_cast<std::size_t>(now)]) : fmt::format("{}", now);
  };
  const auto read = [&](const Node& node, const SourceLocation& location) {
    const std::string word = read_word(node, strings(words), location);
    return static_cast<int>(std::find(words.begin(), words.end(), word) - words.begin());
  };
  FieldValue of(Type::Choice, true, text, into(now, read));
  visit_value(f, std::move(of.among(words, known)));
  return now;
}
void Visitor::named_rows(const Field& by_name, Words words, const Field& by_rows, std::size_t columns,
                         NamedRows& value) {
  one_of({by_name.name, by_rows.name});
  const auto read = [&](const Node& node, const SourceLocation& location) {
    value.set_name(read_word(node, strings(words), location));
  };
  const auto text = [&] { return value.name(); };
  FieldValue of(Type::Choice, is_one_of(words, value.name()), text, read);
  visit_value(by_name, std::move(of.among(words)));
  rows(by_rows, words, columns, value);
}
void Visitor::rows(const Field& f, Words words, std::size_t columns, NamedRows& value) {
  const auto read = [&](const Node& node, const SourceLocation& location) {
    const auto rows = read_rows(node, columns, {-1000, 1000}, location);
    try {
      value.set_rows(rows);
    } catch (const InputError& error) {
      throw location.error(error.problem(), error.hint());
    }
  };
  // A value with a known name is written as its name.
  const auto text = [&value] { return flow_of(value.rows(), numbers_text); };
  visit_value(f, FieldValue(Type::Rows, !is_one_of(words, value.name()), text, read));
}

InputError Visitor::fault(std::string_view key, std::string_view problem, std::string_view hint) const {
  return InputError(key.empty() ? std::string(problem) : fmt::format("{}: {}", key, problem), hint);
}

std::string show(double value) {
  return std::isinf(value) && value > 0 ? "none" : fmt::format("{}", value);
}

double exact_degrees(double radians) {
  const double degrees = geodesy::degrees(radians);
  // Numbers written by people have few digits.
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
