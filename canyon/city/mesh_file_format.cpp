#include "canyon/city/mesh_file_format.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <fstream>
#include <iterator>
#include <optional>
#include <string>
#include <string_view>

#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/text.hpp"

namespace canyon::city {
namespace {

constexpr std::string_view kCutShort = "export or copy it again: it is cut short";

std::string read_head(const std::filesystem::path& path, std::size_t bytes) {
  std::ifstream in(path, std::ios::binary);
  std::string head(bytes, '\0');
  in.read(head.data(), static_cast<std::streamsize>(bytes));
  head.resize(static_cast<std::size_t>(in.gcount()));
  return head;
}

}  // namespace

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

void check_stl_complete(const std::filesystem::path& path) {
  constexpr std::uintmax_t kBinaryHeader = 84;
  constexpr std::uintmax_t kBinaryTriangle = 50;
  const std::string head = read_head(path, kBinaryHeader);
  if (head.size() < 5 || head.compare(0, 5, "solid") != 0) return;
  std::error_code error;
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  if (error) return;
  if (head.size() == kBinaryHeader) {  // binary files may begin with "solid" as well
    std::uintmax_t triangles = 0;
    for (std::size_t byte = 4; byte-- > 0;) {
      triangles = (triangles << 8) | static_cast<unsigned char>(head[80 + byte]);
    }
    if (size == kBinaryHeader + triangles * kBinaryTriangle) return;
  }
  std::ifstream in(path, std::ios::binary);
  const std::uintmax_t tail = std::min<std::uintmax_t>(size, 4096);
  in.seekg(static_cast<std::streamoff>(size - tail));
  std::string text(static_cast<std::size_t>(tail), '\0');
  in.read(text.data(), static_cast<std::streamsize>(tail));
  if (text.find("endsolid") == std::string::npos) throw InputError(path, 0, "has no endsolid", kCutShort);
}

void check_gltf_extensions(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string text(std::istreambuf_iterator<char>(in), {});
  constexpr std::size_t kHeader = 20;  // of GLB: 12 bytes, then length and type of the JSON chunk
  if (text.size() > kHeader && text.compare(0, 4, "glTF") == 0) {
    const auto byte = [&text](std::size_t at) { return std::size_t{static_cast<unsigned char>(text[at])}; };
    const std::size_t length = byte(12) | byte(13) << 8U | byte(14) << 16U | byte(15) << 24U;
    text = text.substr(kHeader, length);
  }
  const std::optional<Json> root = Json::try_parse(text);
  if (!root || !root->is_object() || !(*root)["extensionsRequired"].is_array())
    return;  // Assimp says the rest
  for (const Json& item : (*root)["extensionsRequired"].items()) {
    const std::string name = item.is_string() ? item.text() : "";
    const auto only_looks = [&name](std::string_view kind) { return name.substr(4).starts_with(kind); };
    if (name.size() > 4 &&
        (only_looks("materials_") || only_looks("texture_") || only_looks("lights_") || only_looks("xmp"))) {
      continue;
    }
    throw InputError(path, 0, fmt::format("requires the extension {}, which is not read here", name),
                     "export the mesh without compression and quantization");
  }
}

}  // namespace canyon::city
