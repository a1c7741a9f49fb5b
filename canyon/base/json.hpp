#pragma once

#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <variant>
#include <vector>

namespace canyon {

/// A text is no JSON, or a value is not of the type that is asked for.
class JsonError : public std::runtime_error {
 public:
  explicit JsonError(const std::string& problem, std::size_t byte = 0)
      : std::runtime_error(problem), byte_(byte) {}
  /// Where a text ceases to be JSON, counted from 1; 0: the error is none of syntax.
  [[nodiscard]] std::size_t byte() const { return byte_; }

 private:
  std::size_t byte_;
};

/// A value of JSON (RFC 8259). An object keeps its members in the order in which they were added; find() and
/// operator[] look at one after the other. A number is an integer of 64 bits or a double; one that is not
/// finite becomes null, because JSON has none.
///
/// A list in braces is an object where each of its elements is a pair whose first is a text, else an array:
///   Json{{"name", "rover"}, {"enu_m", {1, 2, 3}}}
class Json {
 public:
  struct Member;
  using Array = std::vector<Json>;
  using Object = std::vector<Member>;
  enum class Order { AsAdded, ByKey };

  Json() noexcept;
  Json(std::nullptr_t) noexcept;
  Json(const char* text);
  Json(std::string text);
  Json(std::string_view text);
  Json(std::initializer_list<Json> list);
  template <typename T, typename = std::enable_if_t<std::is_arithmetic_v<T>>>
  Json(T value) : Json(Scalar(stored(value))) {}
  template <typename T>
  Json(const std::vector<T>& values) : Json(array()) {
    for (const T& value : values) push_back(value);
  }
  /// Null where it is empty.
  template <typename T>
  Json(const std::optional<T>& value) : Json(value ? Json(*value) : Json()) {}
  Json(const Json& other);
  Json(Json&& other) noexcept;
  Json& operator=(const Json& other);
  Json& operator=(Json&& other) noexcept;
  ~Json();

  static Json array(std::initializer_list<Json> items = {});
  static Json object();

  /// Of members with the same key the last one counts. Throws JsonError: "parse error at line 1, column 5:
  /// ...".
  static Json parse(std::string_view text);
  /// Empty where the text is no JSON.
  static std::optional<Json> try_parse(std::string_view text);
  /// Text in UTF-8, on one line, or with each level indented by so many spaces. Bytes that are no UTF-8
  /// become U+FFFD. Doubles have the fewest digits that read back as the same.
  [[nodiscard]] std::string dump(int indent = -1, Order order = Order::AsAdded) const;

  [[nodiscard]] bool is_null() const { return holds<std::nullptr_t>(); }
  [[nodiscard]] bool is_boolean() const { return holds<bool>(); }
  [[nodiscard]] bool is_integer() const { return holds<std::int64_t>() || holds<std::uint64_t>(); }
  [[nodiscard]] bool is_number() const { return is_integer() || holds<double>(); }
  [[nodiscard]] bool is_string() const { return holds<std::unique_ptr<std::string>>(); }
  [[nodiscard]] bool is_array() const { return holds<std::unique_ptr<Array>>(); }
  [[nodiscard]] bool is_object() const { return holds<std::unique_ptr<Object>>(); }

  /// The value as a bool, a number (doubles are cut to integers), a std::string or a std::vector of these.
  /// Throws JsonError where it is of another type.
  template <typename T>
  [[nodiscard]] T get() const {
    if constexpr (std::is_same_v<T, bool>) {
      return boolean();
    } else if constexpr (std::is_floating_point_v<T>) {
      return static_cast<T>(number());
    } else if constexpr (std::is_integral_v<T>) {
      return static_cast<T>(integer());
    } else if constexpr (std::is_same_v<T, std::string>) {
      return text();
    } else {
      T values;
      for (const Json& item : items()) values.push_back(item.get<typename T::value_type>());
      return values;
    }
  }
  [[nodiscard]] const std::string& text() const;
  [[nodiscard]] const Array& items() const;
  [[nodiscard]] const Object& members() const;

  /// Null pointer where this is no object or has no such member.
  [[nodiscard]] const Json* find(std::string_view key) const;
  [[nodiscard]] bool contains(std::string_view key) const { return find(key) != nullptr; }
  /// Throws JsonError where it is not there.
  [[nodiscard]] const Json& at(std::string_view key) const;
  /// Null where it is not there.
  const Json& operator[](std::string_view key) const;
  /// Added where it is not there; null becomes an object first. Throws JsonError on anything but an object.
  Json& operator[](std::string_view key);

  /// Of an array; index < size().
  const Json& operator[](std::size_t index) const { return items()[index]; }
  Json& operator[](std::size_t index) { return const_cast<Json&>(items()[index]); }
  [[nodiscard]] Json& back() { return const_cast<Json&>(items().back()); }
  /// Null becomes an array first. Throws JsonError on anything but an array.
  void push_back(Json item);
  /// Items or members; of null none, of other values one.
  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] bool empty() const { return size() == 0; }
  /// The items of an array; none of null. Throws JsonError on anything else.
  [[nodiscard]] auto begin() const { return is_null() ? Array::const_iterator() : items().begin(); }
  [[nodiscard]] auto end() const { return is_null() ? Array::const_iterator() : items().end(); }

  /// Numbers are equal by value, objects in any order of their members.
  friend bool operator==(const Json& a, const Json& b);

 private:
  class Builder;
  class Writer;
  using Scalar = std::variant<bool, std::int64_t, std::uint64_t, double>;
  explicit Json(Scalar value) noexcept;
  template <typename T>
  static auto stored(T value) {
    if constexpr (std::is_same_v<T, bool>) {
      return value;
    } else if constexpr (std::is_floating_point_v<T>) {
      return static_cast<double>(value);
    } else if constexpr (std::is_signed_v<T>) {
      return static_cast<std::int64_t>(value);
    } else {
      return static_cast<std::uint64_t>(value);
    }
  }
  [[nodiscard]] bool boolean() const;
  [[nodiscard]] double number() const;
  [[nodiscard]] std::int64_t integer() const;
  [[nodiscard]] const char* type() const;
  [[noreturn]] void fail(const char* wanted) const;
  template <typename T>
  [[nodiscard]] bool holds() const {
    return std::holds_alternative<T>(value_);
  }
  template <typename T>
  [[nodiscard]] T* held() const {
    const auto* at = std::get_if<std::unique_ptr<T>>(&value_);
    return at != nullptr ? at->get() : nullptr;
  }
  void move_nested_to(Array& rest);

  /// Mutable: a list in braces is const, and what it holds is moved out of it.
  mutable std::variant<std::nullptr_t, bool, std::int64_t, std::uint64_t, double,
                       std::unique_ptr<std::string>, std::unique_ptr<Array>, std::unique_ptr<Object>>
      value_;
};

struct Json::Member {
  std::string key;
  Json value;
};

}  // namespace canyon
