#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

namespace canyon::mavlink {

/// Types of fields on the wire, with the names that CRC_EXTRA depends on.
enum class Wire : std::uint8_t { U8, I8, U16, I16, U32, I32, U64, F32 };
[[nodiscard]] std::size_t size_of(Wire type);
[[nodiscard]] std::string_view name_of(Wire type);

/// A field of a message: as its definition has it, and the member of a struct that holds it.
struct Field {
  std::string_view name;
  Wire type = Wire::U8;
  std::size_t count = 1;   ///< elements
  bool array = false;      ///< also where `count` is 1
  bool extension = false;  ///< MAVLink 2 alone, behind the others
  double unit = 1;         ///< SI value of one count
  /// Count that stands for "not known", NaN in the struct.
  std::optional<double> unknown;
  /// The first of `count` neighbours.
  std::variant<double*, std::uint64_t*, std::uint32_t*, std::uint16_t*, std::uint8_t*, std::int8_t*> member;
};

/// Gathers the fields of a message in the order of its definition: what a message's visit() is given.
class Fields {
 public:
  /// A value with a unit. NaN is written as `unknown`, or without one as NaN (floats) or 0; values
  /// beyond the type as its nearest that is not `unknown`.
  void number(Wire type, std::string_view name, double& value, double unit = 1,
              std::optional<double> unknown = std::nullopt) {
    add({name, type, 1, false, extension_, unit, unknown, &value});
  }
  void vector(Wire type, const std::array<std::string_view, 3>& names, Eigen::Vector3d& value,
              double unit = 1) {
    for (int i = 0; i < 3; ++i) number(type, names[static_cast<std::size_t>(i)], value[i], unit);
  }
  /// Floats.
  template <std::size_t N>
  void array(std::string_view name, std::array<double, N>& values) {
    add({name, Wire::F32, N, true, extension_, 1, std::nullopt, values.data()});
  }
  template <std::size_t N>
  void array(std::string_view name, std::array<std::uint8_t, N>& values) {
    add({name, Wire::U8, N, true, extension_, 1, std::nullopt, values.data()});
  }
  /// Counts, flags, words: on the wire as in the struct.
  void whole(std::string_view name, std::uint64_t& value) { add(plain(name, Wire::U64, &value)); }
  void whole(std::string_view name, std::uint32_t& value) { add(plain(name, Wire::U32, &value)); }
  void whole(std::string_view name, std::uint16_t& value) { add(plain(name, Wire::U16, &value)); }
  void whole(std::string_view name, std::uint8_t& value) { add(plain(name, Wire::U8, &value)); }
  void whole(std::string_view name, std::int8_t& value) { add(plain(name, Wire::I8, &value)); }
  /// The fields behind it are extensions.
  void extensions() { extension_ = true; }

  [[nodiscard]] std::span<const Field> all() const { return fields_; }

 private:
  template <typename T>
  [[nodiscard]] Field plain(std::string_view name, Wire type, T* member) const {
    return {name, type, 1, false, extension_, 1, std::nullopt, member};
  }
  void add(Field field) { fields_.push_back(field); }

  bool extension_ = false;
  std::vector<Field> fields_;
};

}  // namespace canyon::mavlink
