// Declared in canyon/tiles/tile_selection.hpp.
#include "canyon/tiles/tile_selection.hpp"

#include <fmt/format.h>

#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/meshes/json_values.hpp"

namespace canyon::tiles {
namespace {

constexpr std::uint32_t kSubtreeMagic = 0x74627573;

class SubtreeReader {
 public:
  SubtreeReader(const Json& json, std::string_view binary,
                const std::function<std::string(const std::string&)>& fetch)
      : json_(json), binary_(binary), fetch_(fetch) {}

  [[nodiscard]] Subtree read(int levels, bool octree) const {
    const std::uint64_t nodes = nodes_above(levels, octree);
    const std::uint64_t children = nodes_above(levels + 1, octree) - nodes;
    Subtree out;
    out.tiles = availability(json_.at("tileAvailability"), nodes);
    out.children = availability(json_.at("childSubtreeAvailability"), children);
    const Json* of_contents = json_.find("contentAvailability");
    const Json& several = meshes::extension(json_, "3DTILES_multiple_contents")["contentAvailability"];
    if (several.is_array()) of_contents = &several;
    if (of_contents != nullptr && of_contents->is_array()) {
      for (const Json& each : *of_contents) out.contents.push_back(availability(each, nodes));
    } else if (of_contents != nullptr) {
      out.contents.push_back(availability(*of_contents, nodes));
    }
    return out;
  }

 private:
  [[nodiscard]] Availability availability(const Json& of, std::uint64_t bits) const {
    if (of.contains("constant")) return Availability(meshes::count_member(of, "constant") != 0);
    const char* key = of.contains("bitstream") ? "bitstream" : "bufferView";
    const Json& view = member("bufferViews", meshes::count_member(of, key));
    const Json& buffer = member("buffers", meshes::count_member(view, "buffer"));
    const std::string uri = meshes::text_member(buffer, "uri");
    const std::string outer = uri.empty() ? std::string() : fetch_(uri);
    const std::string_view bytes =
        meshes::piece(uri.empty() ? binary_ : std::string_view(outer),
                      meshes::count_member(view, "byteOffset", 0), meshes::count_member(view, "byteLength"));
    return Availability(std::string(bytes), bits);
  }

  [[nodiscard]] const Json& member(std::string_view list, std::uint64_t index) const {
    const Json& items = json_.at(list);
    if (!items.is_array() || index >= items.size())
      throw InputError(fmt::format("{} {} does not exist", list, index));
    return items[static_cast<std::size_t>(index)];
  }

  const Json& json_;
  std::string_view binary_;
  const std::function<std::string(const std::string&)>& fetch_;
};

}  // namespace

Availability::Availability(std::string bytes, std::uint64_t bits) : bytes_(std::move(bytes)) {
  if (bytes_.size() < (bits + 7) / 8) {
    throw InputError(fmt::format("a list of {} bits has {} bytes", bits, bytes_.size()),
                     "get the subtree again");
  }
}

bool Availability::at(std::uint64_t index) const {
  if (bytes_.empty()) return constant_;
  if (index / 8 >= bytes_.size()) return false;
  return (static_cast<unsigned char>(bytes_[static_cast<std::size_t>(index / 8)]) >> (index % 8) & 1U) != 0;
}

Subtree read_subtree(std::string_view bytes, int levels, bool octree,
                     const std::function<std::string(const std::string& uri)>& fetch) {
  std::string_view text = bytes, binary;
  if (bytes.size() >= 4 && meshes::little<std::uint32_t>(bytes, 0) == kSubtreeMagic) {
    if (meshes::little<std::uint32_t>(bytes, 4) != 1) {
      throw InputError(fmt::format("is a subtree of version {}; only version 1 exists",
                                   meshes::little<std::uint32_t>(bytes, 4)));
    }
    const auto length = meshes::little<std::uint64_t>(bytes, 8);
    text = meshes::piece(bytes, 24, length);
    binary = meshes::piece(bytes, 24 + length, meshes::little<std::uint64_t>(bytes, 16));
  }
  try {
    const Json json = Json::parse(text);
    return SubtreeReader(json, binary, fetch).read(levels, octree);
  } catch (const JsonError& error) {
    throw InputError(fmt::format("has JSON that is not as it should be: {}", error.what()),
                     "get the subtree again");
  }
}

std::uint64_t nodes_above(int level, bool octree) {
  std::uint64_t nodes = 0;
  for (int i = 0; i < level; ++i) nodes = nodes * (octree ? 8 : 4) + 1;
  return nodes;
}

}  // namespace canyon::tiles
