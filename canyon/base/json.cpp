#include "canyon/base/json.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <utility>

namespace canyon {

Json::Json() noexcept = default;
Json::Json(std::nullptr_t) noexcept {}
Json::Json(const char* text) : Json(std::string(text)) {}
Json::Json(std::string_view text) : Json(std::string(text)) {}
Json::Json(std::string text) : value_(std::make_unique<std::string>(std::move(text))) {}
Json::Json(Scalar value) noexcept {
  const double* number = std::get_if<double>(&value);
  if (number != nullptr && !std::isfinite(*number)) return;
  std::visit([this](auto each) { value_ = each; }, value);
}

Json::Json(std::initializer_list<Json> list) {
  const bool pairs = std::all_of(list.begin(), list.end(), [](const Json& each) {
    const Array* pair = each.held<Array>();
    return pair != nullptr && pair->size() == 2 && pair->front().is_string();
  });
  if (pairs) {
    auto members = std::make_unique<Object>();
    members->reserve(list.size());
    for (const Json& each : list) {
      Array& pair = *each.held<Array>();
      members->push_back({std::move(*pair.front().held<std::string>()), std::move(pair.back())});
    }
    value_ = std::move(members);
  } else {
    *this = array(list);
  }
}

Json Json::array(std::initializer_list<Json> items) {
  auto list = std::make_unique<Array>(items.size());
  std::transform(items.begin(), items.end(), list->begin(), [](const Json& each) {
    Json item;
    item.value_ = std::move(each.value_);
    return item;
  });
  Json json;
  json.value_ = std::move(list);
  return json;
}

Json Json::object() {
  Json json;
  json.value_ = std::make_unique<Object>();
  return json;
}

Json::Json(const Json& other) {
  std::visit(
      [this](const auto& value) {
        if constexpr (std::is_scalar_v<std::decay_t<decltype(value)>>) {
          value_ = value;
        } else {
          value_ = std::make_unique<std::decay_t<decltype(*value)>>(*value);
        }
      },
      other.value_);
}
Json::Json(Json&& other) noexcept : value_(std::exchange(other.value_, nullptr)) {}
Json& Json::operator=(const Json& other) {
  return *this = Json(other);
}
Json& Json::operator=(Json&& other) noexcept {
  Json taken(std::move(other));  // first: it may be a part of this
  std::swap(value_, taken.value_);
  return *this;
}

void Json::move_nested_to(Array& rest) {
  const auto take = [&rest](Json& each) {
    if (each.is_array() || each.is_object()) rest.push_back(std::move(each));
  };
  if (Array* items = held<Array>()) std::for_each(items->begin(), items->end(), take);
  if (Object* members = held<Object>()) {
    for (Member& member : *members) take(member.value);
  }
}

// One level at a time: what is nested deep must not exhaust the stack.
Json::~Json() {
  Array rest;
  move_nested_to(rest);
  while (!rest.empty()) {
    Json last = std::move(rest.back());
    rest.pop_back();
    last.move_nested_to(rest);
  }
}

const char* Json::type() const {
  constexpr std::array kNames{"null", "boolean", "number", "number", "number", "string", "array", "object"};
  return kNames[value_.index()];
}

void Json::fail(const char* wanted) const {
  throw JsonError(std::string("type must be ") + wanted + ", but is " + type());
}

bool Json::boolean() const {
  if (!is_boolean()) fail("boolean");
  return std::get<bool>(value_);
}
double Json::number() const {
  if (const auto* number = std::get_if<double>(&value_)) return *number;
  if (const auto* number = std::get_if<std::uint64_t>(&value_)) return static_cast<double>(*number);
  return static_cast<double>(integer());
}
std::int64_t Json::integer() const {
  if (const auto* number = std::get_if<std::int64_t>(&value_)) return *number;
  if (const auto* number = std::get_if<std::uint64_t>(&value_)) return static_cast<std::int64_t>(*number);
  if (const auto* number = std::get_if<double>(&value_)) return static_cast<std::int64_t>(*number);
  fail("number");
}
const std::string& Json::text() const {
  if (!is_string()) fail("string");
  return *held<std::string>();
}
const Json::Array& Json::items() const {
  if (!is_array()) fail("array");
  return *held<Array>();
}
const Json::Object& Json::members() const {
  if (!is_object()) fail("object");
  return *held<Object>();
}

const Json* Json::find(std::string_view key) const {
  if (!is_object()) return nullptr;
  for (const Member& member : members()) {
    if (member.key == key) return &member.value;
  }
  return nullptr;
}
const Json& Json::at(std::string_view key) const {
  const Json* found = find(key);
  if (found == nullptr) throw JsonError("key '" + std::string(key) + "' not found");
  return *found;
}
const Json& Json::operator[](std::string_view key) const {
  static const Json kNull;
  const Json* found = find(key);
  return found != nullptr ? *found : kNull;
}
Json& Json::operator[](std::string_view key) {
  if (is_null()) value_ = std::make_unique<Object>();
  if (const Json* found = find(key)) return const_cast<Json&>(*found);
  if (!is_object()) fail("object");
  return held<Object>()->emplace_back(Member{std::string(key), {}}).value;
}

void Json::push_back(Json item) {
  if (is_null()) value_ = std::make_unique<Array>();
  if (!is_array()) fail("array");
  held<Array>()->push_back(std::move(item));
}
std::size_t Json::size() const {
  if (is_array()) return items().size();
  if (is_object()) return members().size();
  return is_null() ? 0 : 1;
}

bool operator==(const Json& a, const Json& b) {
  if (a.is_number() && b.is_number()) {
    return a.is_integer() && b.is_integer() ? a.integer() == b.integer() : a.number() == b.number();
  }
  if (a.value_.index() != b.value_.index()) return false;
  if (a.is_boolean()) return a.boolean() == b.boolean();
  if (a.is_string()) return a.text() == b.text();
  if (a.is_array()) return a.items() == b.items();
  return a.size() == b.size() &&
         (a.is_null() || std::all_of(a.members().begin(), a.members().end(), [&](const auto& m) {
            const Json* other = b.find(m.key);
            return other != nullptr && *other == m.value;
          }));
}

/// Takes what the library's parser finds.
class Json::Builder {
 public:
  Json root;
  std::optional<JsonError> error;

  bool null() { return put({}) != nullptr; }
  bool boolean(bool value) { return put(value) != nullptr; }
  bool number_integer(std::int64_t value) { return put(value) != nullptr; }
  bool number_unsigned(std::uint64_t value) { return put(value) != nullptr; }
  bool number_float(double value, const std::string& /*text*/) { return put(value) != nullptr; }
  bool string(std::string& value) { return put(std::move(value)) != nullptr; }
  bool binary(nlohmann::json::binary_t& /*value*/) { return false; }  // not of text
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
    merge_repeated(*open_.back()->held<Object>());
    return end_array();
  }
  bool parse_error(std::size_t byte, const std::string& /*token*/, const nlohmann::json::exception& problem) {
    // "[json.exception.parse_error.101] parse error at line 1, column 5: ...": without the library's number.
    const std::string what = problem.what();
    const std::size_t start = what.find("] ");
    const bool syntax = dynamic_cast<const nlohmann::json::parse_error*>(&problem) != nullptr;
    error.emplace(start == std::string::npos ? what : what.substr(start + 2), syntax ? byte : 0);
    return false;
  }

 private:
  Json* put(Json value) {
    if (open_.empty()) return &(root = std::move(value));
    if (Array* items = open_.back()->held<Array>()) return &items->emplace_back(std::move(value));
    return &open_.back()->held<Object>()->emplace_back(Member{std::move(key_), std::move(value)}).value;
  }
  bool open(Json value) {
    open_.push_back(put(std::move(value)));
    return true;
  }

  /// Of members with the same key the first place and the last value stay.
  static void merge_repeated(Object& members) {
    if (members.size() < 2) return;
    std::vector<std::size_t> order(members.size());
    std::iota(order.begin(), order.end(), std::size_t{0});
    const auto key = [&](std::size_t i) -> const std::string& { return members[i].key; };
    std::stable_sort(order.begin(), order.end(), [&](auto i, auto j) { return key(i) < key(j); });
    std::vector<bool> repeated(members.size());
    bool any = false;
    for (std::size_t i = 1, first = 0; i < order.size(); ++i) {
      if (key(order[i]) != key(order[first])) {
        first = i;
        continue;
      }
      members[order[first]].value = std::move(members[order[i]].value);
      repeated[order[i]] = any = true;
    }
    if (!any) return;
    std::size_t i = 0;
    members.erase(
        std::remove_if(members.begin(), members.end(), [&](const Member&) { return repeated[i++]; }),
        members.end());
  }

  std::vector<Json*> open_;
  std::string key_;
};

Json Json::parse(std::string_view text) {
  Builder builder;
  if (!nlohmann::json::sax_parse(text.begin(), text.end(), &builder)) throw builder.error.value();
  return std::move(builder.root);
}

std::optional<Json> Json::try_parse(std::string_view text) {
  Builder builder;
  if (!nlohmann::json::sax_parse(text.begin(), text.end(), &builder)) return std::nullopt;
  return std::move(builder.root);
}

class Json::Writer {
 public:
  Writer(std::string& out, int indent, Order order) : out_(out), indent_(indent), order_(order) {}

  void write(const Json& json, std::size_t level) {
    std::visit([&](const auto& value) { write_value(value, level); }, json.value_);
  }

 private:
  void write_value(std::nullptr_t, std::size_t) { out_ += "null"; }
  void write_value(bool value, std::size_t) { out_ += value ? "true" : "false"; }
  void write_value(double value, std::size_t) {
    std::array<char, 64> digits;
    out_.append(digits.data(),
                nlohmann::detail::to_chars(digits.data(), digits.data() + digits.size(), value));
  }
  template <typename Integer, typename = std::enable_if_t<std::is_integral_v<Integer>>>
  void write_value(Integer value, std::size_t) {
    std::array<char, 24> digits;
    out_.append(digits.data(), std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr);
  }
  void write_value(const std::unique_ptr<std::string>& text, std::size_t) { write_text(*text); }
  void write_value(const std::unique_ptr<Array>& items, std::size_t level) {
    const auto each = [&](const Json& item) { write(item, level + 1); };
    write_list('[', *items, each, ']', level);
  }
  void write_value(const std::unique_ptr<Object>& members, std::size_t level) {
    const auto each = [&](const Member& member) {
      write_text(member.key);
      out_ += indent_ < 0 ? ":" : ": ";
      write(member.value, level + 1);
    };
    if (order_ == Order::AsAdded) return write_list('{', *members, each, '}', level);
    std::vector<const Member*> sorted;
    for (const Member& member : *members) sorted.push_back(&member);
    std::sort(sorted.begin(), sorted.end(), [](const auto* a, const auto* b) { return a->key < b->key; });
    write_list(
        '{', sorted, [&](const Member* member) { each(*member); }, '}', level);
  }

  template <typename List, typename Each>
  void write_list(char begin, const List& list, const Each& each, char end, std::size_t level) {
    out_ += begin;
    bool first = true;
    for (const auto& item : list) {
      if (!std::exchange(first, false)) out_ += ',';
      new_line(level + 1);
      each(item);
    }
    if (!first) new_line(level);
    out_ += end;
  }
  void new_line(std::size_t level) {
    if (indent_ < 0) return;
    out_ += '\n';
    out_.append(level * static_cast<std::size_t>(indent_), ' ');
  }
  void write_text(const std::string& text) {
    const bool plain = std::all_of(text.begin(), text.end(),
                                   [](char c) { return c >= ' ' && c < 0x7f && c != '"' && c != '\\'; });
    if (plain) {
      out_ += '"';
      out_ += text;
      out_ += '"';
    } else {
      out_ += nlohmann::json(text).dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
    }
  }

  std::string& out_;
  int indent_;
  Order order_;
};

std::string Json::dump(int indent, Order order) const {
  std::string text;
  Writer(text, indent, order).write(*this, 0);
  return text;
}

}  // namespace canyon
