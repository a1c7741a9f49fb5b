// read_ply(). Format: Greg Turk, "The PLY Polygon File Format", 1994.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/meshes/json_values.hpp"
#include "canyon/city/meshes/mesh_scene.hpp"

namespace canyon::meshes {
namespace {

template <typename Stored>
double number_in(std::string_view bytes) {
  return static_cast<double>(little<Stored>(bytes, 0));
}

struct PlyType {
  std::string_view name, other_name;
  std::size_t size;
  double (*read)(std::string_view bytes);
};
constexpr std::array kPlyTypes{PlyType{"char", "int8", 1, number_in<std::int8_t>},
                               PlyType{"uchar", "uint8", 1, number_in<std::uint8_t>},
                               PlyType{"short", "int16", 2, number_in<std::int16_t>},
                               PlyType{"ushort", "uint16", 2, number_in<std::uint16_t>},
                               PlyType{"int", "int32", 4, number_in<std::int32_t>},
                               PlyType{"uint", "uint32", 4, number_in<std::uint32_t>},
                               PlyType{"float", "float32", 4, number_in<float>},
                               PlyType{"double", "float64", 8, number_in<double>}};

/// Null: there is no such type.
const PlyType* ply_type(std::string_view word) {
  const auto* const found = std::find_if(kPlyTypes.begin(), kPlyTypes.end(), [&](const PlyType& type) {
    return word == type.name || word == type.other_name;
  });
  return found == kPlyTypes.end() ? nullptr : found;
}

struct PlyProperty {
  std::string name;
  const PlyType* count = nullptr;  ///< of a list
  const PlyType* type = nullptr;
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;
};

class PlyReader {
 public:
  explicit PlyReader(const std::filesystem::path& path)
      : path_(path), bytes_(mesh_bytes(path)), rest_(bytes_) {}

  MeshScene read() {
    read_header();
    node_.faces.emplace_back();
    for (const PlyElement& element : elements_)
      for (std::uint64_t i = 0; i < element.count; ++i) read_record(element, i);
    MeshScene scene;
    note_crossed(crossed_, scene.notes);
    if (rest_.find_first_not_of(std::string_view(" \t\r\n\0", 5)) != std::string_view::npos) {
      scene.notes.add_line(
          ReadReport::Level::Loss,
          fmt::format("{} bytes follow the data counted in the header and are left out", rest_.size()));
    }
    scene.nodes.push_back(std::move(node_));
    return scene;
  }

 private:
  [[nodiscard]] InputError fault(std::string_view what) const { return {path_, line_, what, kDamagedMesh}; }
  [[nodiscard]] InputError cut() const {
    return {path_, 0, "ends within its data", "export or copy it again: it is cut short"};
  }

  std::vector<std::string_view> next_words() {
    if (rest_.empty()) throw cut();
    const std::string_view line = rest_.substr(0, rest_.find('\n'));
    rest_.remove_prefix(std::min(rest_.size(), line.size() + 1));
    ++line_;
    return split_blanks(line);
  }

  void read_header() {
    if (next_words() != std::vector<std::string_view>{"ply"}) throw fault("does not begin with 'ply'");
    for (auto words = next_words(); words.empty() || words[0] != "end_header"; words = next_words()) {
      words.resize(std::max<std::size_t>(words.size(), 3));
      if (words[0] == "format") {
        big_ = words[1] == "binary_big_endian";
        binary_ = big_ || words[1] == "binary_little_endian";
        if (!binary_ && words[1] != "ascii") throw fault(fmt::format("is of the format '{}'", words[1]));
      } else if (words[0] == "element") {
        add_element(words);
      } else if (words[0] == "property" && !elements_.empty()) {
        add_property(words);
      }
    }
    const bool is_located = std::any_of(elements_.begin(), elements_.end(), [](const PlyElement& element) {
      return element.name == "vertex" &&
             std::count_if(element.properties.begin(), element.properties.end(), is_axis) == 3;
    });
    if (!is_located) throw fault("has no vertices with x, y and z");
    if (binary_) line_ = 0;
  }

  static bool is_axis(const PlyProperty& property) {
    return property.count == nullptr &&
           (property.name == "x" || property.name == "y" || property.name == "z");
  }

  void add_element(const std::vector<std::string_view>& words) {
    if (words[1] == "tristrips")
      throw InputError(path_, line_, "has strips of triangles", "export it with faces");
    const std::optional<long long> count = parse_integer(words[2]);
    // A record has at least one byte.
    if (!count || *count < 0 || static_cast<std::uint64_t>(*count) > rest_.size())
      throw fault(fmt::format("declares {} elements in {} bytes", words[2], rest_.size()));
    elements_.push_back({std::string(words[1]), static_cast<std::uint64_t>(*count), {}});
  }

  void add_property(std::vector<std::string_view>& words) {
    const bool list = words[1] == "list";
    words.resize(std::max<std::size_t>(words.size(), 5));
    PlyProperty property;
    if (list) property.count = ply_type(words[2]);
    property.type = ply_type(words[list ? 3 : 1]);
    property.name = words[list ? 4 : 2];
    const bool counted =
        property.count != nullptr && property.count->name != "float" && property.count->name != "double";
    if (property.type == nullptr || property.name.empty() || (list && !counted))
      throw fault("is not a property");
    elements_.back().properties.push_back(std::move(property));
  }

  void read_record(const PlyElement& element, std::uint64_t number) {
    if (!binary_) {
      do words_ = next_words();
      while (words_.empty());
      word_ = 0;
    }
    const bool vertex = element.name == "vertex", face = element.name == "face";
    if (vertex) node_.vertices.emplace_back(Eigen::Vector3d::Zero());
    for (const PlyProperty& property : element.properties) {
      const double count = property.count != nullptr ? next(*property.count) : 1;
      const bool corners = face && (property.name == "vertex_indices" || property.name == "vertex_index");
      if (!(count >= (corners ? 1 : 0)))
        throw fault(fmt::format("{} {} has {} corners", element.name, number, count));
      corners_.clear();
      for (double i = 0; i < count; ++i) {
        const double value = next(*property.type);
        if (vertex && is_axis(property)) node_.vertices.back()[property.name[0] - 'x'] = value;
        if (!corners) continue;
        if (!(value >= 0 && value < static_cast<double>(node_.vertices.size())))
          throw fault(fmt::format("face {} uses vertex {} of {}", number, value, node_.vertices.size()));
        corners_.push_back(static_cast<std::uint32_t>(value));
      }
      if (corners_.size() >= 3 && !add_face(node_.vertices, corners_, node_.faces[0].triangles)) ++crossed_;
    }
  }

  double next(const PlyType& type) {
    if (binary_) return next_binary(type);
    const std::string_view word = word_ < words_.size() ? words_[word_++] : std::string_view();
    const std::optional<double> value = parse_double(word);
    if (word.empty() && rest_.empty()) throw cut();
    if (!value) throw fault(fmt::format("'{}' instead of a number", word));
    return *value;
  }

  double next_binary(const PlyType& type) {
    if (rest_.size() < type.size) throw cut();
    std::string bytes(rest_.substr(0, type.size));
    rest_.remove_prefix(type.size);
    if (big_) std::reverse(bytes.begin(), bytes.end());
    return type.read(bytes);
  }

  const std::filesystem::path& path_;
  const std::string bytes_;
  std::string_view rest_;  ///< not read yet
  int line_ = 0;
  bool binary_ = false, big_ = false;
  std::vector<PlyElement> elements_;
  SceneNode node_;
  std::vector<std::uint32_t> corners_;
  std::size_t crossed_ = 0;
  std::vector<std::string_view> words_;
  std::size_t word_ = 0;
};

}  // namespace

MeshScene read_ply(const std::filesystem::path& path) {
  return PlyReader(path).read();
}

}  // namespace canyon::meshes
