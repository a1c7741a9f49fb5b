// Declared in canyon/city/mesh_file_format.hpp.
// check_collada(). Format: Khronos, COLLADA 1.4.1 specification.
#include <fmt/format.h>
#include <tinyxml2.h>

#include <algorithm>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/mesh_file_format.hpp"

namespace canyon::city {
namespace {

using Element = tinyxml2::XMLElement;

/// Attributes that the schema requires, of elements that meshes, nodes and their looks are made of.
const std::map<std::string_view, std::vector<const char*>>& required_attributes() {
  static const std::map<std::string_view, std::vector<const char*>> kRequired{
      {"vertices", {"id"}},
      {"float_array", {"id", "count"}},
      {"Name_array", {"id", "count"}},
      {"IDREF_array", {"id", "count"}},
      {"accessor", {"count", "source"}},
      {"param", {"type"}},
      {"input", {"semantic", "source"}},
      {"triangles", {"count"}},
      {"polylist", {"count"}},
      {"polygons", {"count"}},
      {"lines", {"count"}},
      {"linestrips", {"count"}},
      {"trifans", {"count"}},
      {"tristrips", {"count"}},
      {"skin", {"source"}},
      {"newparam", {"sid"}},
      {"setparam", {"ref"}},
      {"texture", {"texture"}},
      {"channel", {"source", "target"}},
      {"instance_geometry", {"url"}},
      {"instance_controller", {"url"}},
      {"instance_node", {"url"}},
      {"instance_camera", {"url"}},
      {"instance_light", {"url"}},
      {"instance_effect", {"url"}},
      {"instance_visual_scene", {"url"}},
      {"instance_material", {"symbol", "target"}},
      {"bind_vertex_input", {"semantic", "input_semantic"}}};
  return kRequired;
}

/// All of an element's text: comments and CDATA may divide it.
std::string whole_text(const Element& node) {
  std::string text;
  for (const tinyxml2::XMLNode* n = node.FirstChild(); n != nullptr; n = n->NextSibling())
    if (n->ToText() != nullptr) text += n->Value();
  return text;
}

class ColladaCheck {
 public:
  explicit ColladaCheck(const std::filesystem::path& path) : path_(path) {}

  std::vector<std::string> check(FileFrame& frame) {
    tinyxml2::XMLDocument document;
    if (document.LoadFile(path_.c_str()) != tinyxml2::XML_SUCCESS || document.RootElement() == nullptr) {
      throw InputError(path_, std::max(0, document.ErrorLineNum()),
                       fmt::format("is not well-formed XML ({})", document.ErrorName()),
                       "export it again, or check it with xmllint --noout");
    }
    const Element& root = *document.RootElement();
    frame = frame_of(root);
    check_attributes(root);
    for (const Element* library = root.FirstChildElement("library_geometries"); library != nullptr;
         library = library->NextSiblingElement("library_geometries")) {
      for (const Element* geometry = library->FirstChildElement("geometry"); geometry != nullptr;
           geometry = geometry->NextSiblingElement("geometry")) {
        geometries_.insert(attribute(*geometry, "id"));
        if (const Element* mesh = geometry->FirstChildElement("mesh")) check_mesh(*mesh);
      }
    }
    check_instances(root);
    std::vector<std::string> notes;
    if (nameless_ > 0)
      notes.push_back(fmt::format("{} positions have a coordinate without X, Y or Z", nameless_));
    const std::size_t unused = geometries_.size() - shown_.size();
    if (unused > 0)
      notes.push_back(
          fmt::format("{} of {} geometries are in no node and left out", unused, geometries_.size()));
    return notes;
  }

 private:
  [[nodiscard]] FileFrame frame_of(const Element& root) const {
    FileFrame frame{1, UpAxis::Y};
    const Element* asset = root.FirstChildElement("asset");
    if (asset == nullptr) return frame;
    if (const Element* unit = asset->FirstChildElement("unit")) {
      const std::string value = attribute(*unit, "meter"), name = attribute(*unit, "name");
      const std::optional<double> metres = mesh_number(trim(value));
      if (metres && *metres > 0) {
        frame.metres_per_unit = *metres;
      } else if (unit->Attribute("meter") != nullptr || !unit_note("unit " + name).empty() ||
                 (name.empty() && unit->FirstAttribute() != nullptr)) {
        throw InputError(path_, unit->GetLineNum(),
                         unit->Attribute("meter") != nullptr
                             ? fmt::format("unit of '{}' metres", value)
                             : fmt::format("states a unit '{}' without its length", name),
                         "give the unit's length in metres, like meter=\"0.01\"");
      }
    }
    if (const Element* axis = asset->FirstChildElement("up_axis")) {
      const std::string text = whole_text(*axis);
      const std::string_view value = trim(text);
      const std::size_t at = value.size() == 4 && value.substr(1) == "_UP"
                                 ? std::string_view("XYZ").find(value[0])
                                 : std::string_view::npos;
      if (at == std::string_view::npos) {
        throw InputError(path_, axis->GetLineNum(), fmt::format("up axis '{}'", value),
                         "use X_UP, Y_UP or Z_UP");
      }
      frame.up = static_cast<UpAxis>(at);
    }
    return frame;
  }

  [[nodiscard]] InputError fault(const Element& at, std::string_view what) const {
    return {path_, at.GetLineNum(), fmt::format("<{}> {}", at.Name(), what),
            "export or copy it again: it is damaged"};
  }

  static std::string attribute(const Element& node, const char* name) {
    const char* value = node.Attribute(name);
    return value == nullptr ? "" : value;
  }

  [[nodiscard]] std::size_t count_of(const Element& node, const char* name, std::size_t otherwise) const {
    const std::string text = attribute(node, name);
    if (text.empty()) return otherwise;
    const std::optional<long long> value = parse_integer(text);
    if (!value || *value < 0) throw fault(node, fmt::format("has {}=\"{}\"", name, text));
    return static_cast<std::size_t>(*value);
  }

  static std::vector<std::string_view> words_of(const Element& node) {
    const char* text = node.GetText();
    return text == nullptr ? std::vector<std::string_view>{} : split_blanks(text);
  }

  [[nodiscard]] std::vector<std::size_t> indices_of(const Element& node) const {
    std::vector<std::size_t> indices;
    for (const std::string_view word : words_of(node)) {
      const std::optional<long long> value = parse_integer(word);
      if (!value || *value < 0) throw fault(node, fmt::format("has '{}' where a number is needed", word));
      indices.push_back(static_cast<std::size_t>(*value));
    }
    return indices;
  }

  void check_attributes(const Element& node) {
    const auto required = required_attributes().find(node.Name());
    if (required != required_attributes().end()) {
      const bool parameter = required->first == "param" && node.Attribute("ref") != nullptr;
      for (const char* name : required->second)
        if (node.Attribute(name) == nullptr && !parameter)
          throw fault(node, fmt::format("has no '{}'", name));
    }
    for (const Element* e = node.FirstChildElement(); e != nullptr; e = e->NextSiblingElement())
      check_attributes(*e);
  }

  void check_mesh(const Element& mesh) {
    sources_.clear();
    axes_.clear();
    for (const Element* source = mesh.FirstChildElement("source"); source != nullptr;
         source = source->NextSiblingElement("source")) {
      check_source(*source);
    }
    const Element* vertices = mesh.FirstChildElement("vertices");
    if (vertices != nullptr) {
      for (const Element* input = vertices->FirstChildElement("input"); input != nullptr;
           input = input->NextSiblingElement("input")) {
        const std::size_t count = elements_of(*input);
        if (attribute(*input, "semantic") != "POSITION") continue;
        sources_[attribute(*vertices, "id")] = count;
        nameless_ += axes_[attribute(*input, "source").substr(1)] == "XYZ" ? 0U : 1U;
      }
    }
    for (const Element* e = mesh.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const std::string_view kind = e->Name();
      if (kind != "source" && kind != "vertices" && kind != "extra") check_faces(*e, kind);
    }
  }

  void check_source(const Element& source) {
    if (source.Attribute("id") == nullptr) throw fault(source, "has no 'id'");
    const Element* array = source.FirstChildElement("float_array");
    if (array == nullptr) return;
    const std::vector<std::string_view> words = words_of(*array);
    const std::size_t stated = count_of(*array, "count", words.size());
    if (stated != words.size())
      throw fault(*array, fmt::format("has {} of {} numbers", words.size(), stated));
    for (const std::string_view word : words)
      if (!mesh_number(word)) {
        throw InputError(path_, array->GetLineNum(),
                         fmt::format("<float_array> has '{}' where a number is needed", word),
                         mesh_number_cure(word));
      }
    const Element* technique = source.FirstChildElement("technique_common");
    const Element* accessor = technique == nullptr ? nullptr : technique->FirstChildElement("accessor");
    if (accessor == nullptr) throw fault(source, "has no accessor");
    const std::size_t count = count_of(*accessor, "count", 0), stride = count_of(*accessor, "stride", 1);
    const std::size_t offset = count_of(*accessor, "offset", 0);
    const bool within = offset <= stated && (stride == 0 || count <= (stated - offset) / stride);
    if (!within || (offset == 0 && count * stride != stated))
      throw fault(*accessor, fmt::format("takes {} x {} of {} numbers", count, stride, stated));
    if (attribute(*accessor, "source") != "#" + attribute(*array, "id"))
      throw fault(*accessor, fmt::format("names '{}'", attribute(*accessor, "source")));
    sources_[attribute(source, "id")] = count;
    std::string& axes = axes_[attribute(source, "id")];
    for (const Element* param = accessor->FirstChildElement("param"); param != nullptr;
         param = param->NextSiblingElement("param")) {
      axes += attribute(*param, "name");
    }
  }

  /// Number of elements of the source that an input names.
  [[nodiscard]] std::size_t elements_of(const Element& input) const {
    const std::string name = attribute(input, "source");
    const auto found = name.empty() ? sources_.end() : sources_.find(name.substr(1));
    if (found == sources_.end()) throw fault(input, fmt::format("names '{}', which is not there", name));
    return found->second;
  }

  void check_faces(const Element& faces, std::string_view kind) {
    std::size_t stride = 0;
    std::map<std::size_t, std::size_t> limits;  // by offset
    for (const Element* input = faces.FirstChildElement("input"); input != nullptr;
         input = input->NextSiblingElement("input")) {
      const std::size_t offset = count_of(*input, "offset", 0);
      stride = std::max(stride, offset + 1);
      limits[offset] = elements_of(*input);
    }
    const std::size_t count = count_of(faces, "count", 0);
    const bool whole = kind == "triangles" || kind == "polylist" || kind == "lines";
    std::size_t corners = (kind == "lines" ? 2 : 3) * count;
    const Element* vcount = faces.FirstChildElement("vcount");
    if (kind == "polylist" && vcount != nullptr) {
      const std::vector<std::size_t> sizes = indices_of(*vcount);
      if (sizes.size() != count)
        throw fault(*vcount, fmt::format("has {} of {} counts", sizes.size(), count));
      corners = 0;
      for (const std::size_t size : sizes) corners += size;
    }
    std::size_t pieces = 0;
    for (const Element* p = faces.FirstChildElement("p"); p != nullptr;
         p = p->NextSiblingElement("p"), ++pieces) {
      const std::vector<std::size_t> indices = indices_of(*p);
      if (stride == 0 || indices.size() % stride != 0 || (whole && indices.size() != corners * stride)) {
        throw fault(*p, fmt::format("has {} numbers for {} corners of {}", indices.size(), corners, stride));
      }
      for (std::size_t i = 0; i < indices.size(); ++i) {
        const auto limit = limits.find(i % stride);
        if (limit != limits.end() && indices[i] >= limit->second)
          throw fault(*p, fmt::format("names element {} of {}", indices[i], limit->second));
      }
    }
    const std::size_t holes =
        kind == "polygons" && faces.FirstChildElement("ph") != nullptr ? count - pieces : 0;
    if (pieces + holes != (whole ? std::min<std::size_t>(count, 1) : count))
      throw fault(faces, fmt::format("has {} <p> for {} of them", pieces, count));
  }

  void check_instances(const Element& parent) {
    for (const Element* e = parent.FirstChildElement(); e != nullptr; e = e->NextSiblingElement()) {
      const std::string_view kind = e->Name();
      if (kind == "library_geometries") continue;
      if (kind == "skin") shown_.insert(attribute(*e, "source").substr(1));
      if (kind == "instance_geometry") {
        const std::string url = attribute(*e, "url");
        const std::string id = url.empty() ? url : url.substr(1);
        if (geometries_.count(id) == 0) throw fault(*e, fmt::format("names '{}', which is not there", url));
        shown_.insert(id);
      }
      check_instances(*e);
    }
  }

  const std::filesystem::path& path_;
  std::map<std::string, std::size_t> sources_;  ///< elements by id, of one mesh
  std::map<std::string, std::string> axes_;     ///< names of their parameters, joined
  std::size_t nameless_ = 0;
  std::set<std::string> geometries_, shown_;
};

}  // namespace

std::vector<std::string> check_collada(const std::filesystem::path& path, FileFrame& frame) {
  return ColladaCheck(path).check(frame);
}

}  // namespace canyon::city
