#include "canyon/city/tiles/tile_selection.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <memory>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/city/meshes/json_values.hpp"

namespace canyon::tiles {
namespace {

constexpr std::size_t kDeepestTileset = 24;
constexpr int kDeepestTile = 200;
constexpr std::size_t kMaxVisits = 4'000'000;
/// Limit of tilesets and subtrees that lead to a tile, and of failed references, for each tile that may be
/// read; and a limit for the first tiles.
constexpr std::size_t kMaxFilesEach = 10, kMaxFilesAtFirst = 1000;
constexpr std::size_t kMaxTemplate = 4096;
constexpr int kMaxLevels = 31, kMaxSubtreeLevels = 15;
/// ECEF positions of tiles are between these distances from the Earth's centre.
constexpr double kInnermost_m = 6.3e6, kOutermost_m = 6.45e6;
/// The middle of a larger root does not give the position.
constexpr double kMaxRoot_m = 200e3;

/// One tileset.json.
struct Document {
  std::string address;
  Json json;
  char up = 'Y';
  std::vector<std::string> chain;  ///< addresses of the parent tilesets and of this one
};

/// Properties that a tile inherits from its parents.
struct Inherited {
  Eigen::Matrix4d transform = Eigen::Matrix4d::Identity();
  bool add = false;
  int levels_left = kDeepestTile;
};

/// The root of implicit tiling.
struct ImplicitRoot {
  std::shared_ptr<const Document> document;
  Eigen::Matrix4d transform;
  TileVolume volume;
  double error_m = 0;
  bool add = false;
  bool octree = false;
  int subtree_levels = 1, levels = 1;
  std::string subtree_uri;
  std::vector<std::string> content_uris;
};

struct Node {
  int level = 0;
  std::array<std::uint32_t, 3> tile_coordinates{};
};

/// A file that must be read before the selection continues.
struct Pending {
  std::string address;
  std::shared_ptr<const Document> from;  ///< of a tileset
  Inherited inherited;
  std::shared_ptr<const ImplicitRoot> implicit;  ///< of a subtree
  Node node;                                     ///< its root
};

std::shared_ptr<const Document> parse_document(const std::string& address, const std::string& bytes,
                                               const Document* from) {
  auto document = std::make_shared<Document>();
  document->address = address;
  document->json = Json::parse(bytes);
  if (!document->json.is_object() || !document->json["root"].is_object())
    throw InputError("is not a tileset: it has no root", "give a tileset.json of 3D Tiles 1.0 or 1.1");
  const Json& asset = document->json["asset"];
  const std::string version = asset.is_object() ? meshes::text_member(asset, "version") : std::string();
  if (version != "1.0" && version != "1.1" && version != "0.0")
    throw InputError(fmt::format("is of 3D Tiles version '{}'", version), "versions 1.0 and 1.1 are read");
  const std::string up = meshes::text_member(asset, "gltfUpAxis");
  if (up == "X" || up == "x" || up == "Z" || up == "z") document->up = static_cast<char>(up[0] & ~0x20);
  const Json* required = document->json.find("extensionsRequired");
  for (const Json& name : required != nullptr ? *required : Json()) {
    const std::string& text = name.text();
    if (text != "3DTILES_content_gltf" && text != "3DTILES_implicit_tiling" &&
        text != "3DTILES_multiple_contents" && text != "3DTILES_bounding_volume_S2" &&
        text != "3DTILES_metadata" && text != "3DTILES_batch_table_hierarchy")
      throw InputError(fmt::format("requires the extension '{}' of 3D Tiles, which is not supported", text));
  }
  if (from != nullptr) document->chain = from->chain;
  document->chain.push_back(address);
  return document;
}

std::string content_uri(const Json& content) {
  const std::string uri = meshes::text_member(content, "uri");
  return uri.empty() ? meshes::text_member(content, "url") : uri;
}

/// The contents of a tile, for all versions.
std::vector<const Json*> contents_of(const Json& tile) {
  std::vector<const Json*> contents;
  if (const Json* one = tile.find("content"); one != nullptr && one->is_object()) contents.push_back(one);
  const Json* several = tile.find("contents");
  const Json& extended = meshes::extension(tile, "3DTILES_multiple_contents");
  if (several == nullptr && extended.is_object())
    several = extended.contains("contents") ? extended.find("contents") : extended.find("content");
  if (several != nullptr && several->is_array())
    for (const Json& each : *several) contents.push_back(&each);
  return contents;
}

bool names_tileset(const std::string& uri) {
  const std::string bare = uri.substr(0, uri.find_first_of("?#"));
  return bare.size() > 5 && bare.substr(bare.size() - 5) == ".json";
}

std::string expand_uri_template(std::string uri, const Node& node) {
  if (uri.size() > kMaxTemplate)
    throw InputError(fmt::format("an address of implicit tiling has {} characters", uri.size()));
  const std::pair<const char*, std::uint32_t> kWords[]{{"{level}", static_cast<std::uint32_t>(node.level)},
                                                       {"{x}", node.tile_coordinates[0]},
                                                       {"{y}", node.tile_coordinates[1]},
                                                       {"{z}", node.tile_coordinates[2]}};
  for (const auto& [word, value] : kWords) {
    const std::string number = std::to_string(value);
    for (std::size_t at = uri.find(word); at != std::string::npos; at = uri.find(word, at + number.size()))
      uri.replace(at, std::string_view(word).size(), number);
  }
  return uri;
}

/// Morton order: x gives the lowest bit.
std::uint64_t morton(const Node& node, int bits, bool octree) {
  std::uint64_t out = 0;
  const unsigned axes = octree ? 3 : 2;
  for (int bit = 0; bit < bits; ++bit) {
    for (unsigned axis = 0; axis < axes; ++axis)
      out |= static_cast<std::uint64_t>(node.tile_coordinates[axis] >> bit & 1U)
             << (static_cast<unsigned>(bit) * axes + axis);
  }
  return out;
}

class Selector {
 public:
  Selector(TileSource& source, const TileArea& area, const TileOptions& options)
      : source_(source), area_(area), options_(options) {}

  TileSelection select() {
    const auto root = parse_document(source_.root(), source_.read(source_.root()), nullptr);
    out_.version = meshes::text_member(root->json["asset"], "version");
    out_.tilesets = 1;
    visit(root, root->json["root"], {});
    while (!pending_.empty()) {
      const std::vector<Pending> now = std::exchange(pending_, {});
      std::vector<std::string> addresses;
      addresses.reserve(now.size());
      for (const Pending& each : now) addresses.push_back(each.address);
      source_.prefetch(addresses);
      for (const Pending& each : now)
        attempt(each.address, [&] { each.implicit ? open_subtree(each) : open_tileset(each); });
    }
    return std::move(out_);
  }

 private:
  /// Calls `work`; an error of one file is recorded as a gap.
  template <typename Work>
  void attempt(const std::string& address, const Work& work) {
    try {
      work();
    } catch (const TooMany&) {
      throw;
    } catch (const InputError& error) {
      count_file();
      out_.gaps.push_back(gap_line(address, error));
    } catch (const JsonError& error) {
      count_file();
      out_.gaps.push_back(gap_line(address, error));
    }
  }

  /// Aborts the selection, whichever file causes it.
  class TooMany final : public InputError {
   public:
    using InputError::InputError;
  };

  void count_visit() {
    if (++visits_ > kMaxVisits) {
      throw TooMany(fmt::format("the tileset has more than {} tiles in the area", kMaxVisits),
                    "give a smaller bbox or a larger error_m");
    }
  }

  /// For a tileset or subtree to be read, or a reference that cannot be followed.
  void count_file() {
    const std::size_t maximum =
        kMaxFilesAtFirst + kMaxFilesEach * static_cast<std::size_t>(options_.max_tiles);
    if (++files_ > maximum) {
      throw TooMany(
          fmt::format("the tileset has more than {} tilesets, subtrees and gaps in the area", maximum),
          "give a smaller bbox, a larger error_m, or more max_tiles");
    }
  }
  void read_later(Pending pending) {
    count_file();
    pending_.push_back(std::move(pending));
  }

  void open_tileset(const Pending& pending) {
    const Document& from = *pending.from;
    if (std::find(from.chain.begin(), from.chain.end(), pending.address) != from.chain.end())
      throw InputError("a tileset that refers to itself, directly or through others");
    if (from.chain.size() >= kDeepestTileset)
      throw InputError(fmt::format("tilesets are nested deeper than {}", kDeepestTileset));
    const auto document = parse_document(pending.address, source_.read(pending.address), &from);
    ++out_.tilesets;
    visit(document, document->json["root"], pending.inherited);
  }

  void visit(const std::shared_ptr<const Document>& document, const Json& tile, const Inherited& above) {
    count_visit();
    if (above.levels_left == 0)
      throw InputError(fmt::format("tiles are nested deeper than {}", kDeepestTile));
    Inherited here;
    here.transform = above.transform * meshes::matrix_member(tile, "transform");
    if (!here.transform.allFinite()) throw InputError("the transforms of tiles multiply to no number");
    here.levels_left = above.levels_left - 1;
    const std::string refine = meshes::text_member(tile, "refine");
    here.add = refine.empty() ? above.add : refine == "ADD" || refine == "add";
    const TileVolume volume = read_volume(tile["boundingVolume"]);
    if (!area_.touches(volume, here.transform)) {
      ++out_.beyond;
      return;
    }
    const double error = meshes::number_member(tile, "geometricError", 0);
    const Json* implicit = tile.find("implicitTiling");
    const Json& old_implicit = meshes::extension(tile, "3DTILES_implicit_tiling");
    if (implicit == nullptr && old_implicit.is_object()) implicit = &old_implicit;
    if (implicit != nullptr) {
      begin_implicit(document, tile, *implicit, here, volume, error);
      return;
    }
    const Json* children = tile.find("children");
    const bool has_children = children != nullptr && children->is_array() && !children->empty();
    visit_explicit(document, tile, here, error, has_children ? children : nullptr);
  }

  void visit_explicit(const std::shared_ptr<const Document>& document, const Json& tile,
                      const Inherited& here, double error, const Json* children) {
    const bool fine = error <= options_.error_m;
    bool shown = false;
    for (const Json* content : contents_of(tile)) {
      const std::string uri = content_uri(*content);
      if (uri.empty()) continue;
      const TileVolume bounds = read_volume((*content)["boundingVolume"]);
      const bool tileset = names_tileset(uri);
      if (!tileset && !(here.add || fine || children == nullptr)) continue;
      shown = true;
      if (!area_.touches(bounds, here.transform)) continue;
      attempt(document->address, [&] {
        const std::string address = source_.resolve(document->address, uri);
        if (tileset)
          read_later({address, document, here, nullptr, {}});
        else
          take({address, here.transform, document->up, error});
      });
    }
    if (children == nullptr || (fine && shown)) return;
    for (const Json& child : *children) attempt(document->address, [&] { visit(document, child, here); });
  }

  void take(SelectedTile tile) {
    if (out_.tiles.size() >= static_cast<std::size_t>(options_.max_tiles)) {
      throw TooMany(fmt::format("more than {} tiles are needed for this area with a geometric error of {} m",
                                options_.max_tiles, options_.error_m),
                    "give a smaller bbox, a larger error_m, or more max_tiles");
    }
    out_.coarsest_m = std::max(out_.coarsest_m, tile.error_m);
    out_.tiles.push_back(std::move(tile));
  }

  void begin_implicit(const std::shared_ptr<const Document>& document, const Json& tile, const Json& implicit,
                      const Inherited& here, const TileVolume& volume, double error) {
    auto root = std::make_shared<ImplicitRoot>();
    root->document = document;
    root->transform = here.transform;
    root->volume = volume;
    root->error_m = error;
    root->add = here.add;
    const std::string scheme = meshes::text_member(implicit, "subdivisionScheme");
    if (scheme != "QUADTREE" && scheme != "OCTREE")
      throw InputError(fmt::format("subdivisionScheme '{}' does not exist", scheme));
    root->octree = scheme == "OCTREE";
    const std::uint64_t subtree_levels = meshes::count_member(implicit, "subtreeLevels");
    const std::uint64_t levels = implicit.contains("availableLevels")
                                     ? meshes::count_member(implicit, "availableLevels")
                                     : meshes::count_member(implicit, "maximumLevel") + 1;
    if (subtree_levels < 1 || subtree_levels > kMaxSubtreeLevels || levels < 1 || levels > kMaxLevels)
      throw InputError(fmt::format("implicit tiling has {} levels, {} in a subtree", levels, subtree_levels));
    root->subtree_levels = static_cast<int>(subtree_levels);
    root->levels = static_cast<int>(levels);
    root->subtree_uri = meshes::text_member(implicit.at("subtrees"), "uri");
    for (const Json* content : contents_of(tile)) root->content_uris.push_back(content_uri(*content));
    push_subtree(root, {});
  }

  void push_subtree(const std::shared_ptr<const ImplicitRoot>& root, const Node& node) {
    attempt(root->document->address, [&] {
      const std::string& base = root->document->address;
      read_later(
          {source_.resolve(base, expand_uri_template(root->subtree_uri, node)), nullptr, {}, root, node});
    });
  }

  void open_subtree(const Pending& pending) {
    const ImplicitRoot& root = *pending.implicit;
    const Subtree subtree = read_subtree(
        source_.read(pending.address), root.subtree_levels, root.octree,
        [&](const std::string& uri) { return source_.read(source_.resolve(pending.address, uri)); });
    ++out_.subtrees;
    visit_implicit(pending.implicit, subtree, pending.node, pending.node);
  }

  /// @param top the root of the subtree
  void visit_implicit(const std::shared_ptr<const ImplicitRoot>& shared, const Subtree& subtree,
                      const Node& top, const Node& node) {
    count_visit();
    const ImplicitRoot& root = *shared;
    const int depth = node.level - top.level;
    const std::uint64_t index = nodes_above(depth, root.octree) + morton(node, depth, root.octree);
    if (!subtree.tiles.at(index)) return;
    if (!area_.touches(root.volume.part(node.level, node.tile_coordinates, root.octree), root.transform)) {
      ++out_.beyond;
      return;
    }
    const std::vector<Node> children = available_children(root, subtree, top, node);
    const double error = std::ldexp(root.error_m, -node.level);
    const bool fine = error <= options_.error_m;
    bool shown = false;
    for (std::size_t i = 0; i < root.content_uris.size() && i < subtree.contents.size(); ++i) {
      if (!subtree.contents[i].at(index) || !(root.add || fine || children.empty())) continue;
      shown = true;
      attempt(root.document->address, [&] { take_implicit(shared, root.content_uris[i], node, error); });
    }
    if (fine && shown) return;
    for (const Node& child : children)
      if (depth + 1 < root.subtree_levels)
        visit_implicit(shared, subtree, top, child);
      else if (area_.touches(root.volume.part(child.level, child.tile_coordinates, root.octree),
                             root.transform))
        push_subtree(shared, child);
      else
        ++out_.beyond;
  }

  void take_implicit(const std::shared_ptr<const ImplicitRoot>& root, const std::string& uri,
                     const Node& node, double error) {
    const std::string address = source_.resolve(root->document->address, expand_uri_template(uri, node));
    if (!names_tileset(uri)) {
      take({address, root->transform, root->document->up, error});
      return;
    }
    Inherited here;
    here.transform = root->transform;
    here.add = root->add;
    read_later({address, root->document, here, nullptr, {}});
  }

  static std::vector<Node> available_children(const ImplicitRoot& root, const Subtree& subtree,
                                              const Node& top, const Node& node) {
    std::vector<Node> out;
    if (node.level + 1 >= root.levels) return out;
    const int depth = node.level + 1 - top.level;
    for (std::uint32_t i = 0; i < (root.octree ? 8U : 4U); ++i) {
      Node child;
      child.level = node.level + 1;
      for (unsigned axis = 0; axis < 3; ++axis)
        child.tile_coordinates[axis] = node.tile_coordinates[axis] * 2 + (i >> axis & 1U);
      if (!root.octree) child.tile_coordinates[2] = 0;
      const std::uint64_t order = morton(child, depth, root.octree);
      const bool there = depth < root.subtree_levels
                             ? subtree.tiles.at(nodes_above(depth, root.octree) + order)
                             : subtree.children.at(order);
      if (there) out.push_back(child);
    }
    return out;
  }

  TileSource& source_;
  const TileArea& area_;
  const TileOptions& options_;
  TileSelection out_;
  std::vector<Pending> pending_;
  std::size_t visits_ = 0, files_ = 0;
};

}  // namespace

TilesetRoot read_root(TileSource& source) {
  const auto document = parse_document(source.root(), source.read(source.root()), nullptr);
  const Json& root = document->json["root"];
  TilesetRoot out;
  const TileVolume volume = read_volume(root["boundingVolume"]);
  const Eigen::Matrix4d transform = meshes::matrix_member(root, "transform");
  out.centre = volume.centre(transform);
  const double reach_m = volume.radius(transform);
  if (volume.kind == TileVolume::Kind::Unknown) {
    out.on_earth = transform.topRightCorner<3, 1>().norm() > kInnermost_m ||
                   meshes::extension(root["boundingVolume"], "3DTILES_bounding_volume_S2").is_object();
  } else {
    out.on_earth = volume.kind == TileVolume::Kind::Region || out.centre->norm() + reach_m > kInnermost_m;
  }
  if (out.centre && (out.centre->norm() < kInnermost_m || out.centre->norm() > kOutermost_m) && out.on_earth)
    out.centre.reset();  // of the whole Earth
  if (reach_m > kMaxRoot_m && out.on_earth) out.centre.reset();
  return out;
}

TileSelection select_tiles(TileSource& source, const TileArea& area, const TileOptions& options) {
  return Selector(source, area, options).select();
}

std::string gap_line(const std::string& address, const std::exception& error) {
  std::string logged = error.what();
  if (const auto* input = dynamic_cast<const InputError*>(&error))
    logged = input->problem() + (input->hint().empty() ? "" : "; " + input->hint());
  return fmt::format("{}: {}", public_address(address), logged);
}

}  // namespace canyon::tiles
