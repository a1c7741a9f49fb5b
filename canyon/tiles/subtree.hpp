#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>
#include <vector>

namespace canyon::tiles {

/// A yes or no for each of many places: a constant, or a stream of bits, the lowest of each byte first.
class Availability {
 public:
  Availability() = default;
  explicit Availability(bool constant) : constant_(constant) {}
  /// Throws InputError where there are fewer than `bits` bits.
  Availability(std::string bytes, std::uint64_t bits);

  /// False beyond the end.
  [[nodiscard]] bool at(std::uint64_t index) const;

 private:
  bool constant_ = false;
  std::string bytes_;
};

/// A subtree of implicit tiling (3D Tiles 1.1, "Subtree file format"; with `bufferView` in place of
/// `bitstream` also of 3DTILES_implicit_tiling).
struct Subtree {
  Availability tiles;                  ///< by number of the node: level by level, in Morton order
  std::vector<Availability> contents;  ///< one for each content of a tile
  Availability children;               ///< of subtrees, in Morton order
};

/// @param levels of the subtree
/// @param fetch gives the bytes of an outer buffer. Throws InputError for a damaged subtree.
[[nodiscard]] Subtree read_subtree(std::string_view bytes, int levels, bool octree,
                                   const std::function<std::string(const std::string& uri)>& fetch);

/// Nodes of a subtree in all levels above `level`: the number of the first node of that level.
[[nodiscard]] std::uint64_t nodes_above(int level, bool octree);

}  // namespace canyon::tiles
