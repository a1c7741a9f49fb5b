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

using Quaternion = std::array<double, 4>;  ///< w, x, y, z
inline constexpr double kDegE7 = 1e-7;     ///< [deg]

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
  /// Floats or bytes.
  template <typename Value, std::size_t N>
  void array(std::string_view name, std::array<Value, N>& values) {
    add({name, wire_of(values[0]), N, true, extension_, 1, std::nullopt, values.data()});
  }
  /// Counts, flags, words: on the wire as in the struct. Names and values, one after the other.
  template <typename Whole, typename... Rest>
  void whole(std::string_view name, Whole& value, Rest&&... rest) {
    add({name, wire_of(value), 1, false, extension_, 1, std::nullopt, &value});
    if constexpr (sizeof...(rest) > 0) whole(rest...);
  }
  void place(double& latitude_deg, double& longitude_deg) {
    number(Wire::I32, "lat", latitude_deg, kDegE7);
    number(Wire::I32, "lon", longitude_deg, kDegE7);
  }
  void rates(Eigen::Vector3d& rates_radps) {
    vector(Wire::F32, {"rollspeed", "pitchspeed", "yawspeed"}, rates_radps);
  }
  void quaternion(Quaternion& q) {
    static constexpr std::array<std::string_view, 4> kNames{"q1", "q2", "q3", "q4"};
    for (std::size_t i = 0; i < kNames.size(); ++i) number(Wire::F32, kNames[i], q[i]);
  }
  /// The fields behind it are extensions.
  void extensions() { extension_ = true; }

  [[nodiscard]] std::span<const Field> all() const { return fields_; }

 private:
  static Wire wire_of(double) { return Wire::F32; }
  static Wire wire_of(std::uint64_t) { return Wire::U64; }
  static Wire wire_of(std::uint32_t) { return Wire::U32; }
  static Wire wire_of(std::uint16_t) { return Wire::U16; }
  static Wire wire_of(std::uint8_t) { return Wire::U8; }
  static Wire wire_of(std::int8_t) { return Wire::I8; }
  void add(Field field) { fields_.push_back(field); }

  bool extension_ = false;
  std::vector<Field> fields_;
};

}  // namespace canyon::mavlink
