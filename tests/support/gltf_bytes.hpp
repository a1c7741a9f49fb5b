#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

// Synthetic glTF and 3D Tiles.

namespace canyon::test {

/// The bytes of numbers, little-endian.
template <typename T>
std::string bytes_of(const std::vector<T>& values) {
  std::string out(values.size() * sizeof(T), '\0');
  if (!values.empty()) std::memcpy(out.data(), values.data(), out.size());
  return out;
}

/// A GLB of JSON and its binary chunk.
inline std::string glb(std::string json, std::string binary, std::uint32_t version = 2) {
  while (json.size() % 4 != 0) json += ' ';
  while (binary.size() % 4 != 0) binary += '\0';
  const auto size = static_cast<std::uint32_t>(12 + 8 + json.size() + 8 + binary.size());
  return bytes_of<std::uint32_t>(
             {0x46546C67, version, size, static_cast<std::uint32_t>(json.size()), 0x4E4F534A}) +
         json + bytes_of<std::uint32_t>({static_cast<std::uint32_t>(binary.size()), 0x004E4942}) + binary;
}

/// Triangles with one node. @param node members of the node, with a comma before: ",\"translation\":[1,2,3]"
/// @param material the name of the material
/// @param features the _BATCHID of each position; none if empty
inline std::string triangle_glb(const std::vector<float>& positions,
                                const std::vector<std::uint16_t>& indices, const std::string& node = {},
                                const std::string& material = "brick",
                                const std::vector<std::uint16_t>& features = {}) {
  const std::string a = bytes_of(positions), b = bytes_of(indices), c = bytes_of(features);
  const std::string pad(b.size() % 4, '\0');
  std::string views =
      fmt::format(R"({{"buffer":0,"byteLength":{}}},{{"buffer":0,"byteOffset":{},"byteLength":{}}})",
                  a.size(), a.size(), b.size());
  std::string accessors = fmt::format(R"({{"bufferView":0,"componentType":5126,"count":{},"type":"VEC3"}},)"
                                      R"({{"bufferView":1,"componentType":5123,"count":{},"type":"SCALAR"}})",
                                      positions.size() / 3, indices.size());
  std::string attributes = R"("POSITION":0)";
  if (!features.empty()) {
    views += fmt::format(R"(,{{"buffer":0,"byteOffset":{},"byteLength":{}}})",
                         a.size() + b.size() + pad.size(), c.size());
    accessors += fmt::format(R"(,{{"bufferView":2,"componentType":5123,"count":{},"type":"SCALAR"}})",
                             features.size());
    attributes += R"(,"_BATCHID":2)";
  }
  return glb(
      fmt::format(R"({{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],)"
                  R"("nodes":[{{"mesh":0{}}}],"meshes":[{{"primitives":[{{"attributes":{{{}}},"indices":1,)"
                  R"("material":0}}]}}],"materials":[{{"name":"{}"}}],"buffers":[{{"byteLength":{}}}],)"
                  R"("bufferViews":[{}],"accessors":[{}]}})",
                  node, attributes, material, a.size() + b.size() + pad.size() + c.size(), views, accessors),
      a + b + pad + c);
}

/// A closed box with y up: x in [0, width], height in [0, height] along y, and z in [-depth, 0]; so with z up
/// x east, y north in [0, depth].
inline std::string box_glb(float width, float depth, float height, const std::string& node = {},
                           const std::string& material = "brick") {
  std::vector<float> positions;
  for (int i = 0; i < 8; ++i) {
    positions.push_back((i & 1) != 0 ? width : 0);
    positions.push_back((i & 4) != 0 ? height : 0);
    positions.push_back((i & 2) != 0 ? -depth : 0);
  }
  return triangle_glb(positions, {0, 2, 3, 0, 3, 1, 4, 5, 7, 4, 7, 6, 0, 1, 5, 0, 5, 4,
                                  2, 6, 7, 2, 7, 3, 0, 4, 6, 0, 6, 2, 1, 3, 7, 1, 7, 5},
                      node, material);
}

/// A b3dm with a glTF.
inline std::string b3dm(const std::string& gltf, std::string feature_table = R"({"BATCH_LENGTH":0})",
                        std::string batch_table = "") {
  while (feature_table.size() % 8 != 4) feature_table += ' ';
  while (batch_table.size() % 8 != 0) batch_table += ' ';
  const auto size = static_cast<std::uint32_t>(28 + feature_table.size() + batch_table.size() + gltf.size());
  return "b3dm" +
         bytes_of<std::uint32_t>({1, size, static_cast<std::uint32_t>(feature_table.size()), 0,
                                  static_cast<std::uint32_t>(batch_table.size()), 0}) +
         feature_table + batch_table + gltf;
}

/// A tileset.json with its root in ENU at a position: box volumes, z up. @param root members of the root
inline std::string tileset(const std::string& root, const std::string& version = "1.1") {
  return fmt::format(R"({{"asset":{{"version":"{}"}},"geometricError":100,"root":{{{}}}}})", version, root);
}

}  // namespace canyon::test
