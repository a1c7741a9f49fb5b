// read_obj(). Format: Wavefront, "Object Files (.obj)", appendix B1 of Advanced Visualizer.
// read_stl(). Format: 3D Systems, "StereoLithography Interface Specification", 1989.
#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/city/meshes/json_values.hpp"
#include "canyon/city/meshes/mesh_scene.hpp"

namespace canyon::meshes {
namespace {

class ObjReader {
 public:
  explicit ObjReader(const std::filesystem::path& path) : file_(path, kMaxMesh) {}

  MeshScene read() {
    while (next_line()) {
      // A comment may follow the data; names may contain its sign.
      const std::string_view line = line_;
      const bool named = line.starts_with("o ") || line.starts_with("g ") || line.starts_with("usemtl");
      const auto words = split_blanks(named ? line : line.substr(0, line.find('#')));
      if (words.empty()) continue;
      if (words[0] == "v") {
        add_vertex(words);
      } else if (words[0] == "f") {
        add_corners(words);
      } else if (words[0] == "o" || words[0] == "g") {
        name_ = std::string(trim(std::string_view(line_).substr(1)));
        builder_ = nullptr;
      } else if (words[0] == "usemtl") {
        material_ = std::string(trim(std::string_view(line_).substr(6)));
      } else if (!has_no_faces(words[0]) && passed_over_++ == 0) {
        first_passed_over_ = fmt::format("line {}: '{}'", file_.line(), line_.substr(0, 40));
      }
    }
    MeshScene scene;
    std::size_t crossed = 0;
    for (NodeBuilder& builder : builders_) {
      crossed += builder.crossed;
      scene.nodes.push_back(std::move(builder.node));
    }
    note_crossed(crossed, scene.notes);
    if (passed_over_ > 0) {
      scene.notes.add_line(ReadReport::Level::Loss, fmt::format("{} lines are of an unsupported kind ({})",
                                                                passed_over_, first_passed_over_));
    }
    return scene;
  }

 private:
  /// A line, with its continuation lines after a backslash.
  bool next_line() {
    line_.clear();
    while (const auto piece = file_.next_line()) {
      line_ += trim(*piece);
      if (line_.empty() || line_.back() != '\\') return true;
      line_.back() = ' ';
    }
    return !line_.empty();
  }

  /// Lines that other parts read or that are skipped: looks, points and lines.
  static bool has_no_faces(std::string_view word) {
    constexpr std::array kWords{"vt",     "vn",       "vp",       "s",          "l",
                                "p",      "mtllib",   "mg",       "lod",        "bevel",
                                "usemap", "c_interp", "d_interp", "shadow_obj", "trace_obj"};
    return std::find(kWords.begin(), kWords.end(), word) != kWords.end();
  }

  /// x y z; a weight, used only for curves, or a colour may follow.
  void add_vertex(const std::vector<std::string_view>& words) {
    if (words.size() < 4)
      throw file_.error(fmt::format("has a vertex of {} numbers", words.size() - 1), kDamagedMesh);
    Eigen::Vector3d vertex;
    for (std::size_t i = 0; i < 3; ++i) {
      const std::optional<double> value = parse_double(words[i + 1]);
      if (!value) throw file_.error(fmt::format("'{}' is not a coordinate", words[i + 1]), kDamagedMesh);
      vertex[static_cast<Eigen::Index>(i)] = *value;
    }
    vertices_.push_back(vertex);
  }

  /// Corners are "7", "7/1", "7//3" or "7/1/3"; negative numbers count back from the last vertex.
  void add_corners(const std::vector<std::string_view>& words) {
    corners_.clear();
    const auto count = static_cast<long long>(vertices_.size());
    for (std::size_t i = 1; i < words.size(); ++i) {
      const std::optional<long long> number = parse_integer(words[i].substr(0, words[i].find('/')));
      if (!number || *number == 0 || *number < -count)
        throw file_.error(fmt::format("'{}' is not a corner of a face", words[i]), kDamagedMesh);
      if (*number > count)
        throw file_.error(fmt::format("uses vertex {} of {}", *number, count), kDamagedMesh);
      corners_.push_back(static_cast<std::uint32_t>(*number < 0 ? count + *number : *number - 1));
    }
    if (corners_.size() < 3) return;
    if (builder_ == nullptr) {
      const auto [found, fresh] = builder_of_.try_emplace(name_, builders_.size());
      if (fresh) {
        builders_.emplace_back().node.name = name_;
        builders_.back().use(vertices_, Eigen::Affine3d::Identity());
      }
      builder_ = &builders_[found->second];
    }
    builder_->use_material(material_);
    builder_->add(corners_);
  }

  TextFile file_;
  std::string line_, material_;
  std::string name_ = "defaultobject";  ///< of faces before any o or g; facades are sampled by names
  std::vector<Eigen::Vector3d> vertices_;
  std::vector<std::uint32_t> corners_;
  std::vector<NodeBuilder> builders_;
  std::map<std::string, std::size_t> builder_of_;  ///< by name: a group may continue later
  NodeBuilder* builder_ = nullptr;
  std::size_t passed_over_ = 0;
  std::string first_passed_over_;
};

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

/// The words of an ASCII file in sequence: a facet has three corners of three numbers.
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
      if (!value) throw file_.error(fmt::format("'{}' instead of a number", word), kDamagedMesh);
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

MeshScene read_obj(const std::filesystem::path& path) {
  return ObjReader(path).read();
}

MeshScene read_stl(const std::filesystem::path& path) {
  std::string bytes = mesh_bytes(path);
  if (bytes.size() >= kStlHeader) {  // binary files may begin with "solid" as well
    const std::uint64_t triangles = little<std::uint32_t>(bytes, kStlHeader - 4);
    if (bytes.size() == kStlHeader + triangles * kStlTriangle) return read_binary_stl(bytes);
  }
  if (!lower_case(bytes.substr(0, 5)).starts_with("solid") || bytes.find('\0') != std::string::npos) {
    throw InputError(path, 0, "is a binary STL file whose size does not match its number of triangles",
                     kDamagedMesh);
  }
  return StlText(TextFile::from_string(std::move(bytes), path)).read();
}

}  // namespace canyon::meshes
