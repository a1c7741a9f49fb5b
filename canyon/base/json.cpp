#include "canyon/base/json.hpp"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <unordered_map>

namespace canyon {

Json::Json(std::nullptr_t) noexcept {}
Json::Json(std::string text) : value_(Box<std::string>(std::move(text))) {}
Json::Json(Scalar value) noexcept {
  const double* number = std::get_if<double>(&value);
  if (number != nullptr && !std::isfinite(*number)) return;
  std::visit([this](auto each) { value_ = each; }, value);
}

Json::Json(std::initializer_list<Json> list) {
  const bool pairs = std::all_of(list.begin(), list.end(), [](const Json& each) {
    return each.is_array() && each.size() == 2 && each[0].is_string();
  });
  if (!pairs) {
    value_ = Box<Array>(list);
    return;
  }
  Object members;
  for (const Json& each : list) members.push_back({each[0].text(), each[1]});
  value_ = Box<Object>(std::move(members));
}

Json Json::array(std::initializer_list<Json> items) {
  Json json;
  json.value_ = Box<Array>(items);
  return json;
}
Json Json::object() {
  Json json;
  json.value_ = Box<Object>(Object());
  return json;
}

Json::Json(const Json& other) = default;
Json::Json(Json&& other) noexcept : value_(std::exchange(other.value_, nullptr)) {}
Json& Json::operator=(Json other) noexcept {
  std::swap(value_, other.value_);
  return *this;
}
Json::~Json() = default;

void Json::fail(const char* wanted) const {
  constexpr std::array kNames{"null", "boolean", "number", "number", "number", "string", "array", "object"};
  throw JsonError(std::string("type must be ") + wanted + ", but is " + kNames[value_.index()]);
}
template <typename T>
T& Json::held(const char* wanted) const {
  if (const auto* box = std::get_if<Box<T>>(&value_)) return **box;
  fail(wanted);
}
const std::string& Json::text() const {
  return held<std::string>("string");
}
const Json::Array& Json::items() const {
  return held<Array>("array");
}
const Json::Object& Json::members() const {
  return held<Object>("object");
}
bool Json::boolean() const {
  if (!is_boolean()) fail("boolean");
  return std::get<bool>(value_);
}
template <typename T>
T Json::number() const {
  if (const auto* number = std::get_if<double>(&value_)) return static_cast<T>(*number);
  if (const auto* number = std::get_if<std::uint64_t>(&value_)) return static_cast<T>(*number);
  if (const auto* number = std::get_if<std::int64_t>(&value_)) return static_cast<T>(*number);
  fail("number");
}
template double Json::number<double>() const;
template std::int64_t Json::number<std::int64_t>() const;

const Json* Json::find(std::string_view key) const {
  if (!is_object()) return nullptr;
  for (const Member& member : members())
    if (member.key == key) return &member.value;
  return nullptr;
}
const Json& Json::at(std::string_view key) const {
  if (const Json* found = find(key)) return *found;
  throw JsonError("key '" + std::string(key) + "' not found");
}
const Json& Json::operator[](std::string_view key) const {
  static const Json kNull;
  const Json* found = find(key);
  return found != nullptr ? *found : kNull;
}
Json& Json::operator[](std::string_view key) {
  if (is_null()) *this = object();
  Object& members = held<Object>("object");
  const auto same = [&](const Member& member) { return member.key == key; };
  const auto found = std::find_if(members.begin(), members.end(), same);
  return (found != members.end() ? *found : members.emplace_back(Member{std::string(key), {}})).value;
}
Json& Json::operator[](std::size_t index) {
  return held<Array>("array")[index];
}
Json& Json::back() {
  return held<Array>("array").back();
}
void Json::push_back(Json item) {
  if (is_null()) *this = array();
  held<Array>("array").push_back(std::move(item));
}
std::size_t Json::size() const {
  if (is_array()) return items().size();
  if (is_object()) return members().size();
  return is_null() ? 0 : 1;
}

bool operator==(const Json& a, const Json& b) {
  if (a.is_integer() && b.is_integer()) return a.number<std::int64_t>() == b.number<std::int64_t>();
  if (a.is_number() && b.is_number()) return a.number<double>() == b.number<double>();
  if (a.value_.index() != b.value_.index() || a.size() != b.size()) return false;
  if (a.is_boolean()) return a.boolean() == b.boolean();
  if (a.is_string()) return a.text() == b.text();
  if (a.is_array()) return a.items() == b.items();
  return a.is_null() || std::all_of(a.members().begin(), a.members().end(), [&](const auto& member) {
           const Json* other = b.find(member.key);
           return other != nullptr && *other == member.value;
         });
}

namespace {

/// A text with null for NaN and Infinity as Python and C write them; empty if it has none.
std::string without_nan(std::string_view text) {
  std::string plain;
  bool quoted = false, any = false;
  for (std::size_t at = 0; at < text.size(); ++at) {
    if (text[at] == '"') quoted = !quoted;
    if (quoted && text[at] == '\\' && at + 1 < text.size()) plain += text[at++];
    std::size_t length = 0;
    for (const std::string_view word : {"NaN", "Infinity", "-Infinity", "nan", "-nan", "inf", "-inf"})
      if (!quoted && text.substr(at, word.size()) == word) length = word.size();
    if (length == 0) {
      plain += text[at];
      continue;
    }
    plain += "null";
    at += length - 1;
    any = true;
  }
  return any ? plain : std::string();
}

}  // namespace

/// Callbacks of the library's parser, one for each part of a text.
class Json::Builder {
 public:
  Json root;

  bool null() { return put({}) != nullptr; }
  bool boolean(bool value) { return put(value) != nullptr; }
  bool number_integer(std::int64_t value) { return put(value) != nullptr; }
  bool number_unsigned(std::uint64_t value) { return put(value) != nullptr; }
  bool number_float(double value, const std::string& /*text*/) { return put(value) != nullptr; }
  bool string(std::string& value) { return put(std::move(value)) != nullptr; }
  bool binary(nlohmann::json::binary_t& /*value*/) { return false; }  // does not occur in texts
  bool start_array(std::size_t /*unknown*/) { return open(array()); }
  bool start_object(std::size_t /*unknown*/) { return open(object()); }
  bool key(std::string& key) {
    key_ = std::move(key);
    return true;
  }
  bool end_array() {
    open_.pop_back();
    return true;
  }
  bool end_object() {
    merge_repeated(open_.back()->held<Object>("object"));
    return end_array();
  }
  [[noreturn]] bool parse_error(std::size_t byte, const std::string& /*token*/,
                                const nlohmann::json::exception& problem) {
    // "[json.exception.parse_error.101] parse error at line 1, column 5: ...": removes the library's number.
    const std::string what = problem.what();
    const std::size_t number = what.find("] ");
    const bool syntax = dynamic_cast<const nlohmann::json::parse_error*>(&problem) != nullptr;
    throw JsonError(number == std::string::npos ? what : what.substr(number + 2), syntax ? byte : 0);
  }

 private:
  static constexpr std::size_t kMaxLevels = 1000;  ///< so that no text overflows the stack

  Json* put(Json value) {
    if (open_.empty()) return &(root = std::move(value));
    const Json& list = *open_.back();
    if (list.is_array()) return &list.held<Array>("array").emplace_back(std::move(value));
    return &list.held<Object>("object").emplace_back(Member{std::move(key_), std::move(value)}).value;
  }
  bool open(Json value) {
    if (open_.size() == kMaxLevels) throw JsonError("values are nested deeper than 1000 levels");
    open_.push_back(put(std::move(value)));
    return true;
  }
  /// Keeps one of several members with the same key: at the first one's position, with the last one's value.
  static void merge_repeated(Object& members) {
    std::unordered_map<std::string_view, Json*> first;
    std::vector<bool> repeated;
    for (Member& member : members) {
      const auto [at, fresh] = first.try_emplace(member.key, &member.value);
      if (!fresh) *at->second = std::move(member.value);
      repeated.push_back(!fresh);
    }
    std::size_t i = 0;
    if (first.size() < members.size()) std::erase_if(members, [&](const Member&) { return repeated[i++]; });
  }

  std::vector<Json*> open_;
  std::string key_;
};

Json Json::parse(std::string_view text) try {
  Builder builder;
  (void)nlohmann::json::sax_parse(text.begin(), text.end(), &builder);
  return std::move(builder.root);
} catch (const JsonError& fault) {
  const std::string plain = fault.byte() > 0 ? without_nan(text) : std::string();
  if (plain.empty()) throw;
  try {
    Builder builder;
    (void)nlohmann::json::sax_parse(plain.begin(), plain.end(), &builder);
    return std::move(builder.root);
  } catch (const JsonError&) {
    throw JsonError(fault);
  }
}

std::optional<Json> Json::try_parse(std::string_view text) try {
  return parse(text);
} catch (const JsonError&) {
  return std::nullopt;
}

struct Json::Converter {
  Order order;

  [[nodiscard]] nlohmann::ordered_json converted(const Json& json) const {
    return std::visit([this](const auto& value) { return converted(value); }, json.value_);
  }
  [[nodiscard]] nlohmann::ordered_json converted(const Box<std::string>& text) const { return *text; }
  [[nodiscard]] nlohmann::ordered_json converted(const Box<Array>& items) const {
    auto list = nlohmann::ordered_json::array();
    for (const Json& item : *items) list.push_back(converted(item));
    return list;
  }
  [[nodiscard]] nlohmann::ordered_json converted(const Box<Object>& members) const {
    std::vector<const Member*> sorted;
    for (const Member& member : *members) sorted.push_back(&member);
    if (order == Order::ByKey)
      std::sort(sorted.begin(), sorted.end(), [](auto* a, auto* b) { return a->key < b->key; });
    auto object = nlohmann::ordered_json::object();
    for (const Member* member : sorted) object[member->key] = converted(member->value);
    return object;
  }
  template <typename Scalar>
  [[nodiscard]] nlohmann::ordered_json converted(const Scalar& value) const {
    return value;
  }
};

std::string Json::dump(int indent, Order order) const {
  return Converter{order}.converted(*this).dump(indent, ' ', false,
                                                nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace canyon
