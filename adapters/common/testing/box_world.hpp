#pragma once

#include <Eigen/Geometry>
#include <map>
#include <string>
#include <vector>

#include "canyon/city/link_shapes.hpp"
#include "canyon/outputs/live/world_scene.hpp"

namespace canyon::test {

/// Models of one link each, a box; ids of links are those of models plus 1000.
class BoxWorld final : public live::HostWorld {
 public:
  struct Box {
    bool is_static = true;
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    Eigen::Vector3d size{2, 2, 2};
    std::string name = "box";
  };
  std::map<Id, Box> boxes;
  bool statics_move = true;

  bool has_advanced() override { return true; }
  bool statics_may_have_moved() override { return statics_move; }
  void models(std::vector<Id>& ids) override {
    for (const auto& [id, box] : boxes) ids.push_back(id);
  }
  std::string name(Id model) override { return boxes.at(model).name; }
  bool is_static(Id model) override { return boxes.at(model).is_static; }
  std::uint64_t structure(Id) override { return 0; }
  std::uint64_t shapes(Id model) override {
    return static_cast<std::uint64_t>(boxes.at(model).size.sum() * 1e6);
  }
  void links(Id model, std::vector<Id>& ids) override { ids.push_back(model + 1000); }
  std::optional<simulation::RigidPose> pose(Id link) override {
    const auto box = boxes.find(link - 1000);
    if (box == boxes.end()) return std::nullopt;
    return simulation::RigidPose{box->second.centre, Eigen::Quaterniond::Identity()};
  }
  city::Mesh mesh(Id link, std::vector<std::string>& notes) override {
    const Box& box = boxes.at(link - 1000);
    city::Mesh mesh;
    if (!(box.size.minCoeff() > 0)) {
      notes.push_back(box.name + " is left out: a box without extent");
      return mesh;
    }
    const city::TriangleSet set = city::box_mesh(box.size);
    city::append_object(mesh, box.name, city::Surface::Building, city::Material::Unknown, set.vertices,
                        set.triangles);
    return mesh;
  }
};

}  // namespace canyon::test
