#include "canyon/city/mesh_file_format.hpp"

#include <fmt/format.h>

#include <string>
#include <string_view>
#include <system_error>

#include "canyon/base/input_file.hpp"
#include "canyon/base/text.hpp"

namespace canyon::city {
bool check_companion(const std::filesystem::path& path) {
  std::error_code code;
  if (!std::filesystem::exists(path, code)) return false;
  check_input_file(path, kLargestMesh);
  return true;
}

std::optional<double> mesh_number(std::string_view word) {
  return word.find_first_of("dD") == std::string_view::npos ? parse_double(word) : std::nullopt;
}

std::string_view mesh_number_cure(std::string_view word) {
  return parse_double(word) ? "write its exponent with E: 1E1 instead of 1D1"
                            : "export or copy it again: it is damaged";
}

std::string unit_note(std::string_view comment) {
  const std::string lower = lower_case(comment);
  if (lower.find("unit") == std::string::npos) return {};
  for (const std::string_view other : {"milli", "centi", "kilo", "inch", "feet", "foot", " mm", " cm", "=mm",
                                       "=cm", ":mm", ":cm", "in mm", "yard"}) {
    if (lower.find(other) == std::string::npos) continue;
    return fmt::format("a comment says '{}', which is not used: 1 unit is 1 m; scale corrects it",
                       trim(comment).substr(0, 60));
  }
  return {};
}

Eigen::Matrix3d z_up_from(UpAxis up) {
  Eigen::Matrix3d r = Eigen::Matrix3d::Identity();
  if (up == UpAxis::Y) r << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  if (up == UpAxis::X) r << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  return r;
}

}  // namespace canyon::city
