#include "adapters/gz_sim/gz_shape_files.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <gz/common/Image.hh>
#include <gz/common/Material.hh>
#include <gz/common/Mesh.hh>
#include <gz/common/MeshManager.hh>
#include <gz/common/SubMesh.hh>
#include <gz/common/URI.hh>
#include <gz/common/Util.hh>
#include <gz/common/geospatial/Dem.hh>
#include <gz/common/geospatial/ImageHeightmap.hh>
#include <gz/sim/Util.hh>
#include <memory>
#include <string_view>

#include "adapters/common/gazebo_math.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/mesh_marks.hpp"

namespace canyon::adapters::gz_sim {

namespace {

/// The node has no triangles if the submesh has lines, points or strips.
MeshNode read_submesh(const gz::common::SubMesh& submesh) {
  MeshNode node{submesh.Name(), {}, {}, {}};
  if (submesh.SubMeshPrimitiveType() != gz::common::SubMesh::TRIANGLES) return node;
  node.vertices.reserve(submesh.VertexCount());
  for (unsigned v = 0; v < submesh.VertexCount(); ++v) node.vertices.push_back(eigen(submesh.Vertex(v)));
  const unsigned* index = submesh.IndexPtr();
  node.triangles.reserve(submesh.IndexCount() / 3);
  for (unsigned i = 0; i + 2 < submesh.IndexCount(); i += 3)
    node.triangles.push_back({index[i], index[i + 1], index[i + 2]});
  return node;
}

bool is_image(std::string_view file) {
  const std::string name = lower_case(file);
  return name.ends_with(".png") || name.ends_with(".jpg") || name.ends_with(".jpeg");
}

}  // namespace

std::optional<MeshFile> GzShapeFiles::mesh(const std::string& uri, const std::string& sdf_file) {
  auto& manager = *gz::common::MeshManager::Instance();
  const std::string path = gz::sim::asFullPath(uri, sdf_file);
  // "name://" is a mesh made by a program.
  const bool made = gz::common::URI(uri).Scheme() == "name";
  const gz::common::Mesh* mesh = made ? manager.MeshByName(gz::common::basename(uri))
                                 : manager.IsValidFilename(uri) ? manager.Load(path)
                                                                : nullptr;
  if (mesh == nullptr) return std::nullopt;
  MeshFile file{{}, !made && city::has_mesh_mark(gz::common::findFile(path))};
  for (unsigned i = 0; i < mesh->SubMeshCount(); ++i) {
    const auto submesh = mesh->SubMeshByIndex(i).lock();
    if (!submesh) continue;
    MeshNode& node = file.nodes.emplace_back(read_submesh(*submesh));
    const auto index = submesh->GetMaterialIndex();
    const auto material = index ? mesh->MaterialByIndex(*index) : nullptr;
    if (material) node.colour = {material->Diffuse().R(), material->Diffuse().G(), material->Diffuse().B()};
  }
  return file;
}

std::optional<MeshNode> GzShapeFiles::extrude(const std::string& name, const std::vector<Polyline>& polylines,
                                              double height) {
  std::vector<std::vector<gz::math::Vector2d>> points;
  for (const Polyline& polyline : polylines) {
    auto& to = points.emplace_back();
    for (const Eigen::Vector2d& point : polyline) to.emplace_back(point.x(), point.y());
  }
  auto& manager = *gz::common::MeshManager::Instance();
  manager.CreateExtrudedPolyline(name, points, height);  // no effect if the name exists
  const gz::common::Mesh* mesh = manager.MeshByName(name);
  const auto submesh = mesh == nullptr ? nullptr : mesh->SubMeshByIndex(0).lock();
  if (!submesh) return std::nullopt;
  return read_submesh(*submesh);
}

std::optional<HeightGrid> GzShapeFiles::heights(const std::string& uri, const std::string& sdf_file,
                                                double size_z) {
  const std::string path = gz::common::findFile(gz::sim::asFullPath(uri, sdf_file));
  if (path.empty()) return std::nullopt;
  std::shared_ptr<gz::common::HeightmapData> data;
  if (is_image(path)) {
    auto image = std::make_shared<gz::common::ImageHeightmap>();
    if (image->Load(path) != 0) return std::nullopt;
    data = image;
  } else {
    auto dem = std::make_shared<gz::common::Dem>();
    if (origin_) dem->SetSphericalCoordinates(*origin_);
    if (dem->Load(path) != 0) return std::nullopt;
    data = dem;
  }
  const unsigned side = data->Width();
  if (side != data->Height()) {
    throw InputError(path, 0, fmt::format("has {} x {} heights", side, data->Height()),
                     "Gazebo's heightmaps are square");
  }
  // gz-physics scales heights so that the highest and the lowest are `size_z` apart.
  const double span = static_cast<double>(data->MaxElevation() - data->MinElevation());
  const gz::math::Vector3d scale(1, 1, span > 0 ? std::abs(size_z) / span : 1);
  const auto heights = std::make_shared<std::vector<float>>();
  data->FillHeightMap(1, side, {0, 0, size_z}, scale, false, *heights);
  if (heights->size() != static_cast<std::size_t>(side) * side) return std::nullopt;
  HeightGrid grid;
  grid.columns = grid.rows = static_cast<int>(side);
  grid.height = [heights, side](int column, int row) {
    return static_cast<double>(
        (*heights)[static_cast<std::size_t>(row) * side + static_cast<std::size_t>(column)]);
  };
  return grid;
}

}  // namespace canyon::adapters::gz_sim
