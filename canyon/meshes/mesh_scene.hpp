#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <vector>

#include "canyon/base/read_report.hpp"
#include "canyon/meshes/polygon.hpp"

namespace canyon::meshes {

/// Triangles of one material, as indices into SceneNode::vertices.
struct SceneFaces {
  std::string material;  ///< its name; may be empty
  TriangleIndices triangles;
};

/// A node of a mesh file that has triangles.
struct SceneNode {
  std::string name;                       ///< may be empty
  std::string above;                      ///< names of the nodes above it, with '/' between them
  std::vector<Eigen::Vector3d> vertices;  ///< in the file's unit and axes, after the nodes' transforms
  std::vector<SceneFaces> faces;          ///< counter-clockwise triangles seen from their front
};

/// What is read of a mesh file: nodes with triangles. Lines, points, pictures, lights and animations are not
/// read.
struct MeshScene {
  double metres_per_unit = 1;
  char up = 'Z';  ///< 'X', 'Y' or 'Z'
  std::vector<SceneNode> nodes;
  ReadReport notes;  ///< what was left out, by name and number; without the path
};

/// The largest file of a mesh, or that a mesh names [bytes].
inline constexpr std::uint64_t kLargestMesh = std::uint64_t{2} << 30;
/// A file with more triangles is refused.
inline constexpr std::size_t kMostTriangles = 30'000'000;
/// Names of nodes and materials are cut here: many may share one.
inline constexpr std::size_t kLongestName = 1000;

/// Reads a file by its ending. Vertices are doubles as the file has them; faces with notches are cut into
/// triangles that cover them. Every index refers to a vertex of its node. Throws InputError for a file that
/// is cut short, for numbers that are none or do not agree, for references to what is not there, and for
/// another ending.
///  - .dae: COLLADA 1.4 and 1.5. Geometries of triangles, polylist, polygons, trifans and tristrips; nodes
///    with matrix, translate, rotate and scale; instances of geometries, controllers (the mesh as modelled)
///    and nodes. `lookat` and `skew` are refused.
///  - .gltf, .glb: read_gltf(), with buffers beside the file or in it
///  - .obj: v, f, o, g and usemtl
///  - .stl: binary, or the words of the ASCII form in capitals or not
///  - .ply: x, y and z of vertices, and faces; ASCII or binary; strips are refused
/// @param own_names nodes of COLLADA are called by their names, which other programs may repeat, not by their
///   ids
[[nodiscard]] MeshScene read_mesh_scene(const std::filesystem::path& path, bool own_names = false);

}  // namespace canyon::meshes
