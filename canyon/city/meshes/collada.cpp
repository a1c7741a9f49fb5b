// read_collada(). Format: Khronos, COLLADA 1.4.1 and 1.5.0 specifications.
#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <unordered_map>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/meshes/mesh_scene.hpp"
#include "canyon/city/meshes/xml_file.hpp"

namespace canyon::meshes {
namespace {

using XmlElement = tinyxml2::XMLElement;

constexpr int kDeepestColladaNode = 100;
/// Limit of characters read, a geometry's once per instance; elements and nodes count as some characters.
constexpr std::size_t kMaxColladaWork = kMaxMesh, kElementWork = 20, kNodeWork = 2000;

/// Visits the children of an element, or those of one kind.
template <typename Visit>
void for_each_child(const XmlElement& parent, const char* kind, const Visit& visit) {
  for (const XmlElement* e = parent.FirstChildElement(kind); e != nullptr; e = e->NextSiblingElement(kind))
    visit(*e);
}

std::string attribute_of(const XmlElement& element, const char* name) {
  const char* value = element.Attribute(name);
  return value == nullptr ? "" : value;
}

/// All text of an element: comments and CDATA may divide it.
std::string text_of(const XmlElement& element) {
  std::string text;
  for (const tinyxml2::XMLNode* n = element.FirstChild(); n != nullptr; n = n->NextSibling())
    if (n->ToText() != nullptr) text += n->Value();
  return text;
}

/// The vertices of one <vertices>, which its faces reference as VERTEX.
struct Positions {
  std::string id;
  std::vector<Eigen::Vector3d> points;
};

class ColladaReader {
 public:
  ColladaReader(const std::filesystem::path& path, bool object_names)
      : path_(path), object_names_(object_names) {}

  MeshScene read() {
    read_xml(path_, document_);
    const XmlElement& root = *document_.RootElement();
    if (std::string_view(root.Name()) != "COLLADA") throw fault(root, "is not <COLLADA>");
    read_asset(root);
    index(root);
    const XmlElement* scene = root.FirstChildElement("scene");
    const XmlElement* shown = scene == nullptr ? nullptr : scene->FirstChildElement("instance_visual_scene");
    if (shown == nullptr) throw fault(root, "has no <scene> with an <instance_visual_scene>");
    for_each_child(named(*shown, "url", "visual_scene"), "node", [&](const XmlElement& node) {
      read_node(node, Eigen::Affine3d::Identity(), nullptr, {}, kDeepestColladaNode);
    });
    note_crossed(crossed_, scene_.notes);
    note(external_, "references to other files left out");
    note(with_holes_, "faces with holes (<ph>) left out");
    note(no_mesh_, "geometries that are no <mesh> left out");
    const auto unused = std::count_if(by_id_.begin(), by_id_.end(), [this](const auto& entry) {
      return std::string_view(entry.second->Name()) == "geometry" && positions_.count(entry.second) == 0;
    });
    note(static_cast<std::size_t>(unused), "geometries are in no node and left out");
    return std::move(scene_);
  }

 private:
  [[nodiscard]] InputError fault(const XmlElement& at, std::string_view what) const {
    return {path_, at.GetLineNum(), fmt::format("<{}> {}", at.Name(), what), kDamagedMesh};
  }

  void note(std::size_t count, std::string_view what) {
    if (count > 0) scene_.notes.add_counted(ReadReport::Level::Loss, fmt::format("{{}} {}", what), {}, count);
  }

  void read_asset(const XmlElement& root) {
    scene_.up = 'Y';
    const XmlElement* asset = root.FirstChildElement("asset");
    if (asset == nullptr) return;
    const XmlElement* unit = asset->FirstChildElement("unit");
    const bool reported =
        unit != nullptr && (unit->Attribute("meter") != nullptr || attribute_of(*unit, "name") != "meter");
    if (reported && unit->FirstAttribute() != nullptr) {
      const std::string text = attribute_of(*unit, "meter");
      scene_.metres_per_unit = parse_double(text).value_or(0);
      if (!(scene_.metres_per_unit > 0)) {
        throw InputError(path_, unit->GetLineNum(), fmt::format("unit of '{}' metres", text),
                         "give the unit's length in metres, like meter=\"0.01\"");
      }
    }
    if (const XmlElement* axis = asset->FirstChildElement("up_axis")) {
      const std::string text = text_of(*axis);
      const std::string_view value = trim(text);
      if (value != "X_UP" && value != "Y_UP" && value != "Z_UP") {
        throw InputError(path_, axis->GetLineNum(), fmt::format("up axis '{}'", value),
                         "use X_UP, Y_UP or Z_UP");
      }
      scene_.up = value[0];
    }
  }

  void index(const XmlElement& element) {
    const char* id = element.Attribute("id");
    if (id != nullptr) by_id_.try_emplace(id, &element);
    for_each_child(element, nullptr, [this](const XmlElement& child) { index(child); });
  }

  /// The element for "#id" in an attribute; null if it is in another file.
  const XmlElement* referred(const XmlElement& from, const char* attribute, std::string_view kind,
                             std::string_view or_kind = {}) {
    const std::string url = attribute_of(from, attribute);
    if (!url.empty() && url[0] != '#') {
      ++external_;
      return nullptr;
    }
    const auto found = by_id_.find(url.empty() ? url : url.substr(1));
    if (found == by_id_.end() || (kind != found->second->Name() && or_kind != found->second->Name()))
      throw fault(from, fmt::format("names the {} '{}', which does not exist", kind, url));
    return found->second;
  }
  const XmlElement& named(const XmlElement& from, const char* attribute, std::string_view kind) {
    const XmlElement* found = referred(from, attribute, kind);
    if (found == nullptr) throw fault(from, "names another file");
    return *found;
  }

  [[nodiscard]] std::size_t count_of(const XmlElement& element, const char* name,
                                     std::size_t otherwise) const {
    const char* text = element.Attribute(name);
    if (text == nullptr) return otherwise;
    const std::optional<long long> value = parse_integer(text);
    if (!value || *value < 0 || *value > 0xFFFFFFFF)
      throw fault(element, fmt::format("has {}=\"{}\"", name, text));
    return static_cast<std::size_t>(*value);
  }

  void spend(const XmlElement& at, std::size_t characters) {
    if ((work_ += characters) > kMaxColladaWork) throw fault(at, "is instanced too often");
  }

  [[nodiscard]] std::vector<double> numbers_of(const XmlElement& element) {
    const std::string text = text_of(element);
    spend(element, text.size());
    std::vector<double> numbers;
    for (const std::string_view word : split_blanks(text)) {
      const std::optional<double> value = parse_double(word);
      if (!value) throw fault(element, fmt::format("has '{}' instead of a number", word));
      numbers.push_back(*value);
    }
    return numbers;
  }

  [[nodiscard]] std::vector<std::uint32_t> indices_of(const XmlElement& element) {
    const std::string text = text_of(element);
    spend(element, text.size());
    std::vector<std::uint32_t> indices;
    for (const std::string_view word : split_blanks(text)) {
      const std::optional<long long> value = parse_integer(word);
      if (!value || *value < 0 || *value > 0xFFFFFFFF)
        throw fault(element, fmt::format("has '{}' instead of a number", word));
      indices.push_back(static_cast<std::uint32_t>(*value));
    }
    return indices;
  }

  /// @param unread an unsupported transform of this node or of a parent: cameras may have one
  void read_node(const XmlElement& node, Eigen::Affine3d transform, const XmlElement* unread,
                 const std::string& above, int levels_left) {
    spend(node, kNodeWork);
    if (levels_left == 0) throw fault(node, "is nested too deeply, or contains itself by <instance_node>");
    for_each_child(node, nullptr, [&](const XmlElement& child) {
      const std::string_view kind = child.Name();
      if (kind == "skew" || kind == "lookat") unread = &child;
      add_transform(child, transform);
    });
    NodeBuilder builder;
    const char* own = node.Attribute("name");
    builder.node.name = object_names_ && own != nullptr ? own : attribute_of(node, "id");
    if (builder.node.name.empty()) builder.node.name = attribute_of(node, "sid");
    builder.node.name.resize(std::min(builder.node.name.size(), kMaxName));
    std::string geometry_id;
    for_each_child(node, nullptr, [&](const XmlElement& child) {
      const std::string_view kind = child.Name();
      const XmlElement* geometry = nullptr;
      if (kind == "instance_geometry") geometry = referred(child, "url", "geometry");
      if (kind == "instance_controller") geometry = skinned(child);
      if (geometry == nullptr) return;
      if (unread != nullptr)
        throw InputError(path_, unread->GetLineNum(), fmt::format("<{}> is not read", unread->Name()),
                         "export the node with a <matrix>, or with its transform applied");
      geometry_id = attribute_of(*geometry, "id");
      read_geometry(*geometry, materials_of(child), transform, builder);
    });
    const std::string below = (above + '/' + builder.node.name).substr(0, kMaxName);
    builder.node.above = above;
    if (builder.node.name.empty()) builder.node.name = geometry_id;
    crossed_ += builder.crossed;
    if (!builder.node.faces.empty()) scene_.nodes.push_back(std::move(builder.node));
    for_each_child(node, "node", [&](const XmlElement& child) {
      read_node(child, transform, unread, below, levels_left - 1);
    });
    for_each_child(node, "instance_node", [&](const XmlElement& instance) {
      const XmlElement* child = referred(instance, "url", "node");
      if (child != nullptr) read_node(*child, transform, unread, below, levels_left - 1);
    });
  }

  /// Transforms apply in the order of the node's elements.
  void add_transform(const XmlElement& element, Eigen::Affine3d& transform) {
    spend(element, kElementWork);
    const std::string_view kind = element.Name();
    const std::size_t size = kind == "matrix"                         ? 16
                             : kind == "rotate"                       ? 4
                             : kind == "translate" || kind == "scale" ? 3
                                                                      : 0;
    if (size == 0) return;
    const std::vector<double> n = numbers_of(element);
    if (n.size() != size) throw fault(element, fmt::format("has {} of {} numbers", n.size(), size));
    const Eigen::Vector3d three(n[0], n[1], n[2]);
    if (kind == "translate") transform.translate(three);
    if (kind == "scale") transform.scale(three);
    if (kind == "rotate" && three.norm() > 0)
      transform.rotate(Eigen::AngleAxisd(n[3] * EIGEN_PI / 180, three.normalized()));
    if (kind != "matrix") return;
    if (n[12] != 0 || n[13] != 0 || n[14] != 0 || n[15] != 1)
      throw fault(element, "has a last row that is not 0 0 0 1");
    Eigen::Affine3d matrix;
    matrix.matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(n.data());
    transform = transform * matrix;
  }

  /// The geometry that a controller, or a controller of controllers, skins or morphs.
  const XmlElement* skinned(const XmlElement& instance) {
    const XmlElement* source = referred(instance, "url", "controller");
    for (int steps = 0; source != nullptr && std::string_view(source->Name()) == "controller"; ++steps) {
      const XmlElement* skin = source->FirstChildElement("skin");
      if (skin == nullptr) skin = source->FirstChildElement("morph");
      if (skin == nullptr || steps > 2) throw fault(*source, "has no <skin> of a geometry");
      source = referred(*skin, "source", "geometry", "controller");
    }
    return source;
  }

  /// Names of the materials that an instance binds, by symbol.
  std::map<std::string, std::string> materials_of(const XmlElement& instance) const {
    std::map<std::string, std::string> names;
    const XmlElement* bind = instance.FirstChildElement("bind_material");
    const XmlElement* common = bind == nullptr ? nullptr : bind->FirstChildElement("technique_common");
    if (common == nullptr) return names;
    for_each_child(*common, "instance_material", [&](const XmlElement& material) {
      std::string& name = names[attribute_of(material, "symbol")];
      name = attribute_of(material, "target");
      if (!name.empty() && name[0] == '#') name.erase(0, 1);
      const auto found = by_id_.find(name);
      const char* reported = found == by_id_.end() ? nullptr : found->second->Attribute("name");
      if (reported != nullptr && *reported != '\0') name = reported;
    });
    return names;
  }

  void read_geometry(const XmlElement& geometry, const std::map<std::string, std::string>& materials,
                     const Eigen::Affine3d& transform, NodeBuilder& builder) {
    const XmlElement* mesh = geometry.FirstChildElement("mesh");
    const auto [found, fresh] = positions_.try_emplace(&geometry);
    Positions& positions = found->second;
    if (fresh && mesh == nullptr) ++no_mesh_;
    if (mesh == nullptr) return;
    if (fresh) positions = read_positions(*mesh);
    builder.use(positions.points, transform);
    for_each_child(*mesh, nullptr, [&](const XmlElement& faces) {
      spend(faces, kElementWork);
      const std::string_view kind = faces.Name();
      const bool strips = kind == "tristrips" || kind == "trifans";
      if (!strips && kind != "triangles" && kind != "polylist" && kind != "polygons") return;
      const std::string symbol = attribute_of(faces, "material");
      const auto bound = materials.find(symbol);
      builder.use_material(bound == materials.end() ? symbol : bound->second);
      read_faces(faces, kind, positions, builder);
      if (builder.node.faces.back().triangles.empty()) builder.node.faces.pop_back();
      triangles_ += std::exchange(builder.triangles, 0);
      if (triangles_ > kMaxTriangles)
        throw InputError(path_, 0, fmt::format("has more than {} triangles", kMaxTriangles));
    });
  }

  Positions read_positions(const XmlElement& mesh) {
    Positions out;
    const XmlElement* vertices = mesh.FirstChildElement("vertices");
    if (vertices == nullptr) return out;
    out.id = attribute_of(*vertices, "id");
    const XmlElement* input = vertices->FirstChildElement("input");
    while (input != nullptr && attribute_of(*input, "semantic") != "POSITION")
      input = input->NextSiblingElement("input");
    if (input == nullptr) throw fault(*vertices, "has no input of POSITION");
    const XmlElement& source = named(*input, "source", "source");
    const XmlElement* technique = source.FirstChildElement("technique_common");
    const XmlElement* accessor = technique == nullptr ? nullptr : technique->FirstChildElement("accessor");
    if (accessor == nullptr) throw fault(source, "has no accessor");
    const XmlElement& array = named(*accessor, "source", "float_array");
    const std::vector<double> numbers = numbers_of(array);
    if (const std::size_t reported = count_of(array, "count", numbers.size()); reported != numbers.size())
      throw fault(array, fmt::format("has {} of {} numbers", numbers.size(), reported));
    // Params without a name are skipped.
    std::array<std::size_t, 3> axis{0, 1, 2};
    std::size_t param_number = 0;
    for_each_child(*accessor, "param", [&](const XmlElement& param) {
      const std::string name = attribute_of(param, "name");
      if (name.size() == 1 && name[0] >= 'X' && name[0] <= 'Z')
        axis[static_cast<std::size_t>(name[0] - 'X')] = param_number;
      ++param_number;
    });
    const std::size_t count = count_of(*accessor, "count", 0), stride = count_of(*accessor, "stride", 1);
    const std::size_t offset = count_of(*accessor, "offset", 0),
                      last = *std::max_element(axis.begin(), axis.end());
    if (last >= stride || offset > numbers.size() || count > (numbers.size() - offset) / stride)
      throw fault(*accessor, fmt::format("needs {} x {} of {} numbers", count, stride, numbers.size()));
    for (std::size_t i = 0; i < count; ++i) {
      const double* at = &numbers[offset + i * stride];
      out.points.emplace_back(at[axis[0]], at[axis[1]], at[axis[2]]);
    }
    return out;
  }

  void read_faces(const XmlElement& faces, std::string_view kind, const Positions& positions,
                  NodeBuilder& builder) {
    std::size_t stride = 0;
    std::optional<std::size_t> vertex;
    for_each_child(faces, "input", [&](const XmlElement& input) {
      const std::size_t offset = count_of(input, "offset", 0);
      if (offset > 1000) throw fault(input, fmt::format("has offset=\"{}\"", offset));
      stride = std::max(stride, offset + 1);
      if (attribute_of(input, "semantic") != "VERTEX") return;
      if (attribute_of(input, "source") != '#' + positions.id)
        throw fault(input, fmt::format("names '{}', which does not exist", attribute_of(input, "source")));
      vertex = offset;
    });
    const std::size_t count = count_of(faces, "count", 0);
    if (count > 0 && !vertex) throw fault(faces, "has no input of VERTEX");
    std::vector<std::uint32_t> sizes;
    if (const XmlElement* vcount = faces.FirstChildElement("vcount")) sizes = indices_of(*vcount);
    if (kind == "polylist" && sizes.size() != count)
      throw fault(faces, fmt::format("has {} of {} counts", sizes.size(), count));
    const bool listed = kind == "triangles" || kind == "polylist";
    std::size_t wanted = kind == "triangles" ? 3 * count : 0;
    for (const std::uint32_t size : sizes) wanted += size;
    std::size_t pieces = 0, holes = 0;
    for_each_child(faces, "ph", [&](const XmlElement& /*face*/) { ++holes; });
    with_holes_ += holes;
    for_each_child(faces, "p", [&](const XmlElement& p) {
      ++pieces;
      std::vector<std::uint32_t> corners;
      const std::vector<std::uint32_t> numbers = indices_of(p);
      if (stride == 0 || numbers.size() % stride != 0 || (listed && numbers.size() != wanted * stride))
        throw fault(p, fmt::format("has {} numbers for {} corners of {}", numbers.size(), wanted, stride));
      for (std::size_t i = vertex.value_or(0); i < numbers.size(); i += stride) {
        if (numbers[i] >= positions.points.size())
          throw fault(p, fmt::format("uses element {} of {}", numbers[i], positions.points.size()));
        corners.push_back(numbers[i]);
      }
      add_faces(kind, corners, sizes, builder);
    });
    if (count > 0 && pieces + holes != (listed ? 1 : count))
      throw fault(faces, fmt::format("has {} <p> for {} of them", pieces, count));
  }

  static void add_faces(std::string_view kind, const std::vector<std::uint32_t>& corners,
                        const std::vector<std::uint32_t>& sizes, NodeBuilder& builder) {
    if (kind == "tristrips" || kind == "trifans") {
      for (std::size_t i = 0; i + 2 < corners.size(); ++i)
        if (kind == "trifans")
          builder.add({corners[0], corners[i + 1], corners[i + 2]});
        else
          builder.add({corners[i], corners[i + 1 + i % 2], corners[i + 2 - i % 2]});
      return;
    }
    if (kind == "polygons") {
      if (corners.size() >= 3) builder.add(corners);
      return;
    }
    if (kind == "triangles") {
      for (std::size_t i = 0; i < corners.size(); i += 3)
        builder.add({corners[i], corners[i + 1], corners[i + 2]});
      return;
    }
    auto at = corners.begin();
    for (const std::uint32_t size : sizes) {
      if (size >= 3) builder.add({at, at + size});
      at += size;
    }
  }

  const std::filesystem::path& path_;
  bool object_names_;
  tinyxml2::XMLDocument document_;
  std::unordered_map<std::string, const XmlElement*> by_id_;    ///< the first of each id
  std::unordered_map<const XmlElement*, Positions> positions_;  ///< of geometries in nodes
  MeshScene scene_;
  std::size_t triangles_ = 0, work_ = 0, crossed_ = 0, external_ = 0, with_holes_ = 0, no_mesh_ = 0;
};

}  // namespace

MeshScene read_collada(const std::filesystem::path& path, bool object_names) {
  return ColladaReader(path, object_names).read();
}

}  // namespace canyon::meshes
