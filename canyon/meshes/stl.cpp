// Declared in canyon/meshes/formats.hpp.
// read_stl(). Format: 3D Systems, "StereoLithography Interface Specification", 1989.
#include <fmt/format.h>

#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/meshes/formats.hpp"
#include "canyon/meshes/json_values.hpp"

namespace canyon::meshes {
namespace {

constexpr std::size_t kStlHeader = 84, kStlTriangle = 50;

void add_triangle(SceneNode& node) {
  const auto last = static_cast<std::uint32_t>(node.vertices.size());
  node.faces.back().triangles.push_back({last - 3, last - 2, last - 1});
}

MeshScene read_binary_stl(std::string_view bytes) {
  MeshScene scene;
  SceneNode& node = scene.nodes.emplace_back();
  node.faces.emplace_back();
  for (std::size_t at = kStlHeader; at < bytes.size(); at += kStlTriangle) {
    for (std::size_t corner = 0; corner < 3; ++corner) {
      Eigen::Vector3d vertex;
      for (std::size_t k = 0; k < 3; ++k)
        vertex[static_cast<Eigen::Index>(k)] = little<float>(bytes, at + 12 * (corner + 1) + 4 * k);
      node.vertices.push_back(vertex);
    }
    add_triangle(node);
  }
  return scene;
}

/// The words of an ASCII file one by one: a facet has three corners of three numbers.
class StlText {
 public:
  explicit StlText(TextFile file) : file_(std::move(file)) {}

  MeshScene read() {
    while (const auto line = file_.next_line()) {
      const std::string lower = lower_case(*line);
      const auto words = split_blanks(*line), keys = split_blanks(lower);
      for (std::size_t i = 0; i < words.size(); ++i) {
        if (keys[i] == "solid")
          scene_.nodes.push_back({i + 1 < words.size() ? std::string(words[i + 1]) : "", {}, {}, {{}}});
        ended_ = keys[i] == "endsolid";
        if (keys[i] == "solid" || ended_) break;  // a name follows
        take(keys[i]);
      }
    }
    if (facet_ || numbers_ > 0) throw file_.error("ends within a facet", kDamagedMesh);
    if (!ended_) throw file_.error("has no endsolid", "export or copy it again: it is cut short");
    return std::move(scene_);
  }

 private:
  void take(std::string_view word) {
    if (numbers_ > 0) {
      const std::optional<double> value = parse_double(word);
      if (!value) throw file_.error(fmt::format("'{}' where a number is needed", word), kDamagedMesh);
      --numbers_;
      if (corners_ > 0) node().vertices.back()[2 - numbers_] = *value;
    } else if (word == "facet") {
      if (facet_) throw file_.error("begins a facet within another", kDamagedMesh);
      facet_ = true;
      corners_ = 0;
    } else if (word == "normal" && facet_ && corners_ == 0) {
      numbers_ = 3;
    } else if (word == "vertex" && facet_) {
      ++corners_;
      numbers_ = 3;
      node().vertices.emplace_back();
    } else if (word == "endfacet") {
      if (!facet_ || corners_ != 3)
        throw file_.error(fmt::format("ends a facet of {} corners", corners_), kDamagedMesh);
      facet_ = false;
      add_triangle(node());
    } else if (word != "outer" && word != "loop" && word != "endloop") {
      throw file_.error(fmt::format("'{}' is not a word of STL here", word), kDamagedMesh);
    }
  }

  SceneNode& node() { return scene_.nodes.back(); }

  TextFile file_;
  MeshScene scene_;
  int numbers_ = 0, corners_ = 0;
  bool facet_ = false, ended_ = false;
};

}  // namespace

MeshScene read_stl(const std::filesystem::path& path) {
  std::string bytes = mesh_bytes(path);
  if (bytes.size() >= kStlHeader) {  // binary files may begin with "solid" as well
    const std::uint64_t triangles = little<std::uint32_t>(bytes, kStlHeader - 4);
    if (bytes.size() == kStlHeader + triangles * kStlTriangle) return read_binary_stl(bytes);
  }
  if (!lower_case(bytes.substr(0, 5)).starts_with("solid") || bytes.find('\0') != std::string::npos) {
    throw InputError(path, 0, "is a binary STL file whose size is not that of the triangles that it says",
                     kDamagedMesh);
  }
  return StlText(TextFile::from_string(std::move(bytes), path)).read();
}

}  // namespace canyon::meshes
