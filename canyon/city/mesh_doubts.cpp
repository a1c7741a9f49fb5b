#include "canyon/city/mesh_doubts.hpp"

#include <assimp/scene.h>
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>

#include "canyon/city/boxes.hpp"
#include "canyon/city/mesh_file_format.hpp"

namespace canyon::city {
namespace {

constexpr double kFlat = 0.02;      ///< corners this share of a face's width off its plane are off
constexpr double kAgrees = 0.966;   ///< cosine of 15 deg
constexpr double kFewFaces = 0.25;  ///< where more are so, that is how the mesh is made

Eigen::Vector3d from(const aiVector3D& v) {
  return {v.x, v.y, v.z};
}

class FaceDoubts {
 public:
  void add(const aiMesh& mesh) {
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      const bool within = std::all_of(face.mIndices, face.mIndices + face.mNumIndices,
                                      [&](unsigned v) { return v < mesh.mNumVertices; });
      if (face.mNumIndices >= 3 && within) add(mesh, face);
    }
  }
  void say(std::vector<std::string>& doubts) const {
    if (bent_ > 0 && static_cast<double>(bent_) < kFewFaces * static_cast<double>(polygons_))
      doubts.push_back(
          fmt::format("{} of {} polygons are not flat: a vertex may be damaged", bent_, polygons_));
    if (turned_ > 0 && static_cast<double>(turned_) < kFewFaces * static_cast<double>(stated_)) {
      doubts.push_back(fmt::format(
          "{} of {} faces do not agree with the normals that the file states: a vertex may be damaged",
          turned_, stated_));
    }
  }

 private:
  void add(const aiMesh& mesh, const aiFace& face) {
    const auto at = [&](unsigned i) { return from(mesh.mVertices[face.mIndices[i % face.mNumIndices]]); };
    const Eigen::Vector3d first = at(0);
    Eigen::Vector3d twice = Eigen::Vector3d::Zero(), stated = Eigen::Vector3d::Zero();
    double width = 0, off = 0;
    for (unsigned i = 0; i < face.mNumIndices; ++i) {
      twice += (at(i) - first).cross(at(i + 1) - first);
      width = std::max(width, (at(i) - first).norm());
      if (mesh.mNormals != nullptr) stated += from(mesh.mNormals[face.mIndices[i]]);
    }
    if (!(twice.norm() > 0)) return;
    const Eigen::Vector3d normal = twice.normalized();
    for (unsigned i = 1; i < face.mNumIndices; ++i) off = std::max(off, std::abs(normal.dot(at(i) - first)));
    if (face.mNumIndices > 3) {
      ++polygons_;
      bent_ += off > kFlat * width ? 1U : 0U;
    }
    if (stated.norm() > 0.1) {
      ++stated_;
      turned_ += std::abs(normal.dot(stated.normalized())) < kAgrees ? 1U : 0U;
    }
  }

  std::size_t polygons_ = 0, bent_ = 0, stated_ = 0, turned_ = 0;
};

/// The middle one of several.
double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

/// "'a', 'b' and 3 more" of the objects whose value is above a limit, with the largest value.
std::string named_above(const std::vector<const Object*>& objects, const std::vector<double>& values,
                        double limit, double& largest) {
  std::vector<std::string> names;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (values[i] > limit) names.push_back(fmt::format("'{}'", objects[i]->name));
    largest = std::max(largest, values[i]);
  }
  const std::size_t more = names.size() > 3 ? names.size() - 3 : 0;
  names.resize(names.size() - more);
  return fmt::format("{}{}", fmt::join(names, ", "), more > 0 ? fmt::format(" and {} more", more) : "");
}

/// How far the farthest corner of an object stands from its middle on the ground [m], where all others are
/// within a quarter of that; else 0.
double stray_corner_m(const Mesh& mesh, const Object& object) {
  std::vector<std::array<long, 2>> places;  // in centimetres, each once
  for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t) {
    for (const std::uint32_t v : mesh.triangles[t])
      places.push_back({std::lround(100 * mesh.vertices[v].x()), std::lround(100 * mesh.vertices[v].y())});
  }
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  if (places.size() < 4) return 0;
  std::vector<double> east, north, away;
  for (const auto& [x, y] : places) {
    east.push_back(0.01 * static_cast<double>(x));
    north.push_back(0.01 * static_cast<double>(y));
  }
  const double middle_east = median(east), middle_north = median(north);
  for (std::size_t i = 0; i < places.size(); ++i)
    away.push_back(std::hypot(east[i] - middle_east, north[i] - middle_north));
  std::nth_element(away.begin(), away.end() - 2, away.end());
  constexpr double kFar_m = 30, kTimes = 4;
  const double farthest = away.back(), next = away[away.size() - 2];
  return farthest > kFar_m && farthest > kTimes * next ? farthest : 0;
}

}  // namespace

void add_face_doubts(const aiScene& scene, std::vector<std::string>& doubts) {
  FaceDoubts faces;
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) faces.add(*scene.mMeshes[m]);
  faces.say(doubts);
}

std::vector<std::string> implausible_objects(const Mesh& mesh) {
  std::vector<const Object*> objects;
  std::vector<Box> boxes;
  std::vector<double> east, north, widths, heights, strays;
  for (const Object& object : mesh.objects) {
    if (object.surface == Surface::Terrain || object.triangle_count == 0) continue;
    Box box;
    extend(box, mesh, object);
    objects.push_back(&object);
    boxes.push_back(box);
    east.push_back(0.5 * (box.min.x() + box.max.x()));
    north.push_back(0.5 * (box.min.y() + box.max.y()));
    widths.push_back((box.max - box.min).head<2>().norm());
    heights.push_back((box.max - box.min).z());
    strays.push_back(stray_corner_m(mesh, object));
  }
  std::vector<std::string> lines;
  if (objects.empty()) return lines;
  constexpr double kHighest_m = 1000;  // the highest building is 828 m high
  double highest = 0, widest = 0, farthest = 0, stray = 0;
  std::string named = named_above(objects, heights, kHighest_m, highest);
  if (!named.empty())
    lines.push_back(fmt::format("{}: {:.0f} m high, as no building is; is the unit right? scale corrects it",
                                named, highest));
  named = named_above(objects, strays, 0, stray);
  if (!named.empty())
    lines.push_back(fmt::format("{}: one corner is {:.0f} m away from the others; damaged?", named, stray));
  constexpr double kLowest_m = 1;
  const double tallest = *std::max_element(heights.begin(), heights.end());
  if (objects.size() > 2 && tallest > 0 && tallest < kLowest_m) {
    lines.push_back(
        fmt::format("the highest of {} objects is {:.2g} m high; is the unit right? scale corrects it",
                    objects.size(), tallest));
  }
  constexpr double kThin_m = 0.05;
  const double widest_m = *std::max_element(widths.begin(), widths.end());
  if (tallest >= kLowest_m && widest_m < kThin_m) {
    lines.push_back(
        fmt::format("all objects are less than {:.2g} m wide, and up to {:.3g} m high; are x and y degrees?",
                    std::max(widest_m, 1e-6), tallest));
  }
  if (objects.size() < 4) return lines;
  constexpr double kWide_m = 500, kFar_m = 5000, kTimes = 20;
  const double usual = median(widths);
  named = named_above(objects, widths, std::max(kWide_m, kTimes * usual), widest);
  if (!named.empty()) {
    lines.push_back(fmt::format("{}: {:.0f} m wide, where half of the others are below {:.0f} m; damaged?",
                                named, widest, usual));
  }
  const Eigen::Vector2d middle(median(east), median(north));
  std::vector<double> away;
  for (std::size_t i = 0; i < objects.size(); ++i)
    away.push_back((Eigen::Vector2d(east[i], north[i]) - middle).norm());
  named = named_above(objects, away, std::max(kFar_m, kTimes * median(away)), farthest);
  if (!named.empty())
    lines.push_back(fmt::format("{}: {:.0f} km from the rest of the city; damaged?", named, farthest / 1e3));
  return lines;
}

std::string up_axis_caution(const City& city, UpAxis up, const std::filesystem::path& path,
                            double heading_rad) {
  if (up == UpAxis::X) return {};
  const Mesh& mesh = city.mesh;
  double terrain_area = 0, level_area = 0;
  // The lowest coordinate of each building, along the axis that would be up and along z.
  const Eigen::Vector3d file_other = up == UpAxis::Z ? Eigen::Vector3d::UnitY() : Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d other =
      Eigen::AngleAxisd(heading_rad, Eigen::Vector3d::UnitZ()) * (z_up_from(up) * file_other);
  std::vector<double> feet_y, feet_z;
  for (const Object& object : mesh.objects) {
    double lowest_y = 1e300, lowest_z = 1e300;
    for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t) {
      const auto& [a, b, c] = mesh.triangles[t];
      const Eigen::Vector3d normal =
          (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
      if (object.surface == Surface::Terrain) {
        terrain_area += normal.norm();
        level_area += std::abs(normal.z());
      }
      for (const std::uint32_t v : mesh.triangles[t]) {
        lowest_y = std::min(lowest_y, mesh.vertices[v].dot(other));
        lowest_z = std::min(lowest_z, mesh.vertices[v].z());
      }
    }
    if (object.surface != Surface::Building) continue;
    feet_y.push_back(lowest_y);
    feet_z.push_back(lowest_z);
  }
  // The largest share of values within 0.5 m of one another.
  const auto share = [](std::vector<double>& values) {
    std::sort(values.begin(), values.end());
    std::size_t most = 0;
    for (std::size_t i = 0, j = 0; i < values.size(); ++i) {
      while (j < values.size() && values[j] <= values[i] + 0.5) ++j;
      most = std::max(most, j - i);
    }
    return static_cast<double>(most) / static_cast<double>(values.size());
  };
  constexpr double kUpright = 0.3, kMost = 0.75, kFew = 0.5;
  const bool upright = terrain_area > 0 && level_area < kUpright * terrain_area;
  const bool beside = feet_y.size() >= 3 && share(feet_y) >= kMost && share(feet_z) < kFew;
  if (!upright && !beside) return {};
  return fmt::format("{}: {}; is {} the file's up axis? Then set up_axis: {}", path.filename().string(),
                     upright ? "its terrain stands upright" : "its buildings lie on their sides",
                     up == UpAxis::Z ? 'y' : 'z', up == UpAxis::Z ? 'Y' : 'Z');
}

}  // namespace canyon::city
