#include "canyon/city/mesh_file_format.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>

#include "canyon/base/input_error.hpp"
#include "canyon/base/input_file.hpp"
#include "canyon/base/text.hpp"

namespace canyon::city {
bool check_companion(const std::filesystem::path& path) {
  std::error_code code;
  if (!std::filesystem::exists(path, code)) return false;
  check_input_file(path, kLargestMesh);
  return true;
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

FileFrame collada_frame(const std::filesystem::path& path) {
  FileFrame frame{1, UpAxis::Y};
  const std::string head = read_head(path, std::size_t{1} << 20);
  const std::size_t begin = head.find("<asset");
  const std::size_t end = head.find("</asset>");
  if (begin == std::string::npos || end == std::string::npos || end < begin) return frame;
  const std::string_view asset = std::string_view(head).substr(begin, end - begin);
  const auto line_of = [&](std::size_t at) {
    return 1 + static_cast<int>(std::count(head.begin(), head.begin() + static_cast<long>(begin + at), '\n'));
  };

  if (const std::size_t unit = asset.find("<unit"); unit != std::string_view::npos) {
    const std::string_view tag = asset.substr(unit, asset.find('>', unit) - unit);
    if (const std::size_t at = tag.find("meter="); at != std::string_view::npos && at + 7 < tag.size()) {
      const std::size_t from = at + 7;
      const std::string_view value = tag.substr(from, tag.find(tag[at + 6], from) - from);
      const std::optional<double> metres = parse_double(value);
      if (!metres || !(*metres > 0)) {
        throw InputError(path, line_of(unit), fmt::format("unit of '{}' metres", value),
                         "give the unit's length in metres, like meter=\"0.01\"");
      }
      frame.metres_per_unit = *metres;
    } else if (const std::string note = unit_note(tag.substr(1)); !note.empty()) {
      throw InputError(path, line_of(unit), fmt::format("states a unit without its length: '{}>'", tag),
                       "give the unit's length in metres, like meter=\"0.01\"");
    }
  }
  if (const std::size_t axis = asset.find("<up_axis>"); axis != std::string_view::npos) {
    const std::size_t from = axis + 9;
    const std::string_view value = trim(asset.substr(from, asset.find('<', from) - from));
    if (value == "X_UP") {
      frame.up = UpAxis::X;
    } else if (value == "Y_UP") {
      frame.up = UpAxis::Y;
    } else if (value == "Z_UP") {
      frame.up = UpAxis::Z;
    } else {
      throw InputError(path, line_of(axis), fmt::format("up axis '{}'", value), "use X_UP, Y_UP or Z_UP");
    }
  }
  return frame;
}

Eigen::Matrix3d z_up_from(UpAxis up) {
  Eigen::Matrix3d r = Eigen::Matrix3d::Identity();
  if (up == UpAxis::Y) r << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  if (up == UpAxis::X) r << 0, -1, 0, 0, 0, -1, 1, 0, 0;
  return r;
}

}  // namespace canyon::city
