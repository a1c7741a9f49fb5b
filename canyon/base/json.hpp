#pragma once

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <initializer_list>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

namespace canyon {

/// A text is not JSON, or a value has another type than requested.
class JsonError : public std::runtime_error {
 public:
  explicit JsonError(const std::string& problem, std::size_t byte = 0)
      : std::runtime_error(problem), byte_(byte) {}
  /// Position of the syntax error in the text, counted from 1; 0: no syntax error.
  [[nodiscard]] std::size_t byte() const { return byte_; }

 private:
  std::size_t byte_;
};

/// A value of JSON (RFC 8259). An object keeps its members in the order of insertion; find() and operator[]
/// search linearly. A number is an integer of 64 bits or a double; non-finite numbers become null, because
/// JSON has none.
///
/// A list in braces is an object if each of its elements is a pair whose first item is a text, else an array:
///   Json{{"name", "rover"}, {"enu_m", {1, 2, 3}}}
class Json {
 public:
  struct Member;
  using Array = std::vector<Json>;
  using Object = std::vector<Member>;
  enum class Order { AsAdded, ByKey };

  Json(std::nullptr_t = nullptr) noexcept;
  Json(std::string text);
  Json(std::string_view text) : Json(std::string(text)) {}
  Json(const char* text) : Json(std::string(text)) {}
  Json(std::initializer_list<Json> list);
  template <typename T, typename = std::enable_if_t<std::is_arithmetic_v<T>>>
  Json(T value) : Json(Scalar(static_cast<Stored<T>>(value))) {}
  template <typename T>
  Json(const std::vector<T>& values) : Json(array()) {
    for (const T& value : values) push_back(value);
  }
  /// Null if it is empty.
  template <typename T>
  Json(const std::optional<T>& value) : Json(value ? Json(*value) : Json()) {}
  Json(const Json& other);
  Json(Json&& other) noexcept;
  Json& operator=(Json other) noexcept;
  ~Json();

  static Json array(std::initializer_list<Json> items = {});
  static Json object();

  /// Of several members with the same key, the last one is used. Throws JsonError: "parse error at line 1,
  /// column 5: ...", also for values nested deeper than 1,000 levels. NaN and Infinity, as written by Python
  /// and C, are null.
  static Json parse(std::string_view text);
  /// Empty if parse() throws.
  static std::optional<Json> try_parse(std::string_view text);
  /// Text in UTF-8, on one line, or with `indent` spaces per level. Bytes that are not UTF-8 become U+FFFD.
  /// Doubles have the fewest digits that read back exactly.
  [[nodiscard]] std::string dump(int indent = -1, Order order = Order::AsAdded) const;

  [[nodiscard]] bool is_null() const { return holds<std::nullptr_t>(); }
  [[nodiscard]] bool is_boolean() const { return holds<bool>(); }
  [[nodiscard]] bool is_integer() const { return holds<std::int64_t>() || holds<std::uint64_t>(); }
  [[nodiscard]] bool is_number() const { return is_integer() || holds<double>(); }
  [[nodiscard]] bool is_string() const { return holds<Box<std::string>>(); }
  [[nodiscard]] bool is_array() const { return holds<Box<Array>>(); }
  [[nodiscard]] bool is_object() const { return holds<Box<Object>>(); }

  /// The value as a bool, a number (doubles are cut to integers), a std::string or a std::vector of these.
  /// Throws JsonError if it is of another type.
  template <typename T>
  [[nodiscard]] T get() const {
    if constexpr (std::is_same_v<T, bool>) {
      return boolean();
    } else if constexpr (std::is_floating_point_v<T>) {
      return static_cast<T>(number<double>());
    } else if constexpr (std::is_integral_v<T>) {
      return static_cast<T>(number<std::int64_t>());
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

  /// Null pointer if this is not an object or has no such member.
  [[nodiscard]] const Json* find(std::string_view key) const;
  [[nodiscard]] bool contains(std::string_view key) const { return find(key) != nullptr; }
  /// Throws JsonError if there is no such member.
  [[nodiscard]] const Json& at(std::string_view key) const;
  /// Null if there is no such member.
  const Json& operator[](std::string_view key) const;
  /// Adds a missing key; null becomes an object first. Throws JsonError on anything but an object.
  Json& operator[](std::string_view key);

  /// An item of an array; index < size().
  const Json& operator[](std::size_t index) const { return items()[index]; }
  Json& operator[](std::size_t index);
  [[nodiscard]] Json& back();
  /// Null becomes an array first. Throws JsonError on anything but an array.
  void push_back(Json item);
  /// The number of items or members; 0 for null, 1 for other values.
  [[nodiscard]] std::size_t size() const;
  [[nodiscard]] bool empty() const { return size() == 0; }
  /// The items of an array; null has none. Throws JsonError on anything else.
  [[nodiscard]] auto begin() const { return is_null() ? Array::const_iterator() : items().begin(); }
  [[nodiscard]] auto end() const { return is_null() ? Array::const_iterator() : items().end(); }

  /// Numbers are equal by value; objects are equal in any order of their members.
  friend bool operator==(const Json& a, const Json& b);

 private:
  class Builder;
  struct Converter;
  /// A text or list on the heap, copied with its owner. A Json takes 16 bytes, because files have millions.
  template <typename T>
  struct Box : std::unique_ptr<T> {
    Box(T value) : std::unique_ptr<T>(std::make_unique<T>(std::move(value))) {}
    Box(const Box& other) : std::unique_ptr<T>(std::make_unique<T>(*other)) {}
    Box(Box&& other) noexcept = default;
    Box& operator=(Box&& other) noexcept = default;
  };
  using Scalar = std::variant<bool, std::int64_t, std::uint64_t, double>;
  template <typename T,
            typename Integer = std::conditional_t<std::is_signed_v<T>, std::int64_t, std::uint64_t>>
  using Stored = std::conditional_t<std::is_same_v<T, bool>, bool,
                                    std::conditional_t<std::is_floating_point_v<T>, double, Integer>>;
  explicit Json(Scalar value) noexcept;
  [[nodiscard]] bool boolean() const;
  template <typename T>
  [[nodiscard]] T number() const;
  template <typename T>
  [[nodiscard]] T& held(const char* wanted) const;
  [[noreturn]] void fail(const char* wanted) const;
  template <typename T>
  [[nodiscard]] bool holds() const {
    return std::holds_alternative<T>(value_);
  }

  std::variant<std::nullptr_t, bool, std::int64_t, std::uint64_t, double, Box<std::string>, Box<Array>,
               Box<Object>>
      value_;
};

struct Json::Member {
  std::string key;
  Json value;
};

/// The shortest number within half a unit of the last of `decimals` digits, and never -0. Infinity and NaN
/// are returned unchanged; JSON writes them as null.
inline double rounded(double value, int decimals) {
  const double scale = std::pow(10.0, decimals);
  const double result = std::round(value * scale) / scale;
  return result == 0 ? 0.0 : result;
}

}  // namespace canyon
