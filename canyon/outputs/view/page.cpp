#include "canyon/outputs/view/page.hpp"

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <limits>
#include <optional>
#include <system_error>

#include "canyon/base/gzip_file.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/base/output_file.hpp"
#include "canyon/base/payload.hpp"
#include "canyon/city/mesh_export.hpp"
#include "canyon/city/mesh_parts.hpp"
#include "canyon/outputs/encoding/view_tables.hpp"
#include "canyon/outputs/view/header.hpp"

namespace canyon::view {
namespace {

/// The marker of a page's data in viewer/index.html.
constexpr std::string_view kMark = "<!--canyon:data-->";

/// Uncompressed size of a gzip file from its trailer (RFC 1952, 2.3.1: ISIZE); empty: no trailer.
std::optional<std::uint32_t> unpacked_bytes(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::array<unsigned char, 4> end{};
  if (!in.seekg(-4, std::ios::end) || !in.read(reinterpret_cast<char*>(end.data()), end.size())) return {};
  std::uint32_t size = 0;
  for (std::size_t i = 0; i < end.size(); ++i) size |= std::uint32_t{end[i]} << (8 * i);
  return size;
}

/// JSON for a <script> element: must not contain "</script>".
std::string for_script(std::string json) {
  for (std::size_t at = json.find('<'); at != std::string::npos; at = json.find('<', at))
    json.replace(at, 1, "\\u003c");
  return json;
}

/// Parts of a map's feature have its name followed by "#2"; a city's building has its own name.
std::string feature_of(const std::string& object) {
  const std::size_t part = object.rfind('#');
  return part == std::string::npos || part == 0 ? object : object.substr(0, part);
}

SceneObject describe(const city::Mesh& mesh, const city::Object& object,
                     const std::map<std::string, std::string>& height_sources) {
  SceneObject result;
  result.id = object.name;
  result.surface = object.surface;
  result.low_m = std::numeric_limits<double>::max();
  result.high_m = std::numeric_limits<double>::lowest();
  std::array<double, 256> area{};
  for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    for (const std::uint32_t v : mesh.triangles[t]) {
      result.low_m = std::min(result.low_m, mesh.vertices[v].z());
      result.high_m = std::max(result.high_m, mesh.vertices[v].z());
    }
    area[static_cast<std::uint8_t>(mesh.materials[t])] +=
        (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]).norm();
  }
  result.material = static_cast<city::Material>(std::max_element(area.begin(), area.end()) - area.begin());
  for (const std::string& name : {object.name, feature_of(object.name)}) {
    const auto found = height_sources.find(name);
    if (found == height_sources.end()) continue;
    result.height_source = found->second;
    break;
  }
  return result;
}

/// The glTF's bytes, from a file: the writer supports files only.
std::string glb_of(const city::City& city, const std::filesystem::path& folder) {
  const Temporary own(folder / "city", Temporary::Kind::Folder);
  OutputFile file(own.temporary_path() / "city.glb");
  city::write_glb(file, city);
  file.commit();
  return read_bytes(file.path());
}

}  // namespace

bool is_served_name(std::string_view name) {
  bool any = false, dotted = false;  // since the last dot; at all
  for (const char c : name) {
    if (c == '.') {
      if (!any) return false;
      any = false;
      dotted = true;
    } else if ((c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') || (c == '-' && !dotted)) {
      any = true;
    } else {
      return false;
    }
  }
  return any && dotted;
}

std::string read_bytes(const std::filesystem::path& path) {
  check_input_file(path);
  std::ifstream in(path, std::ios::binary);
  if (!in) throw InputError(path, 0, "cannot be read", "check its name and permissions");
  return {std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
}

std::filesystem::path find_page() {
  if (const char* named = std::getenv("CANYON_VIEWER"); named != nullptr && *named != '\0') return named;
  std::error_code error;
  std::vector<std::filesystem::path> points;
  // An installed program has share/ next to bin/; for a build tree the page is in the source tree.
  const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", error);
  if (!error) points.push_back(program.parent_path().parent_path() / "share/canyon/viewer.html");
  points.emplace_back(built_page);
  for (const std::filesystem::path& position : points)
    if (std::filesystem::is_regular_file(position, error)) return position;
  throw InputError("the viewer's page is not built",
                   "run ./run view, which needs Node.js; or name a viewer.html in CANYON_VIEWER");
}

std::vector<std::string> view_files(const std::filesystem::path& folder) {
  const char* const again = "write it again: 'canyon simulate SCENARIO --out DIR --view'";
  std::vector<std::string> files;
  const auto take = [&](const std::string& name) {
    std::filesystem::path path = folder / name;
    std::error_code missing;
    const auto status = std::filesystem::symlink_status(path, missing);
    if (!std::filesystem::exists(status)) throw InputError(path, 0, "is missing from the view", again);
    if (!is_served_name(name) || !std::filesystem::is_regular_file(status))
      throw InputError(folder / kHeaderFile, 0, "has an invalid file name: " + name, again);
    files.push_back(name);
    return path;
  };
  try {
    take(kHeaderFile);
    files.clear();
    const Json json = Json::parse(read_bytes(folder / kHeaderFile));
    take(json.at("city").at("file").get<std::string>());
    for (const Json& chunk : json.at("chunks")) {
      const std::filesystem::path path = take(chunk.at("file").get<std::string>());
      if (unpacked_bytes(path) != chunk.at("bytes").get<std::uint32_t>())
        throw InputError(path, 0, "is truncated or damaged", again);
    }
  } catch (const JsonError&) {
    throw InputError(folder / kHeaderFile, 0, "is not a Canyon view, or is damaged", again);
  }
  return files;
}

std::size_t export_page(const std::filesystem::path& page, const std::filesystem::path& folder,
                        const std::filesystem::path& target) {
  const std::string html = read_bytes(page);
  const std::size_t mark = html.find(kMark);
  if (mark == std::string::npos)
    throw InputError(page, 0, "is not Canyon's viewer page", "rebuild it: ./run view");
  const std::vector<std::string> files = view_files(folder);
  const std::string header = read_bytes(folder / kHeaderFile);

  OutputFile out(target);
  std::size_t size = 0;
  const auto write = [&](std::string_view bytes) {
    out.write(bytes);
    size += bytes.size();
  };
  write(std::string_view(html).substr(0, mark));
  write("<script type=\"application/json\" id=\"canyon-view\">" + for_script(header) + "</script>\n");
  for (const std::string& file : files) {
    write(fmt::format("<script type=\"text/plain\" data-canyon-file=\"{}\">", file));
    write(base64(read_bytes(folder / file)));
    write("</script>\n");
  }
  write(std::string_view(html).substr(mark + kMark.size()));
  out.commit();
  return size;
}

SceneCity write_city(const city::City& city, const std::map<std::string, std::string>& height_sources,
                     const std::filesystem::path& folder) {
  SceneCity scene{city.name, city.frame.origin(), city.notes.lines(), {}, city.mesh.triangles.size()};
  for (const city::Object& object : city::objects_with_triangles(city.mesh))
    scene.objects.push_back(describe(city.mesh, object, height_sources));
  write_file(folder / kCityChunk, encoding::gzip(glb_of(city, folder)));
  return scene;
}

}  // namespace canyon::view
