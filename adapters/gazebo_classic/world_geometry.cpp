#include "adapters/gazebo_classic/world_geometry.hpp"

#include <atomic>
#include <boost/weak_ptr.hpp>
#include <gazebo/common/Events.hh>
#include <gazebo/common/SphericalCoordinates.hh>
#include <gazebo/physics/Link.hh>
#include <gazebo/physics/Model.hh>
#include <gazebo/physics/PhysicsEngine.hh>
#include <gazebo/physics/World.hh>
#include <unordered_map>

#include "adapters/gazebo_classic/ignition_types.hpp"
#include "adapters/gazebo_classic/shape_meshes.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using gazebo::physics::Base;
using gazebo::physics::Link;
using gazebo::physics::Model;
using gazebo::physics::ModelPtr;

std::uint64_t structure_of(const Model& model) {
  const ignition::math::Vector3d scale = model.Scale();
  std::uint64_t sum = model.GetLinks().size();
  for (int i = 0; i < 3; ++i) live::mix(sum, std::hash<double>()(scale[static_cast<std::size_t>(i)]));
  for (const ModelPtr& nested : model.NestedModels()) live::mix(sum, nested ? structure_of(*nested) : 0);
  return sum;
}

template <typename Visit>
void for_each_link(const Model& model, const Visit& visit) {
  for (const gazebo::physics::LinkPtr& link : model.GetLinks())
    if (link) visit(link);
  for (const ModelPtr& nested : model.NestedModels())
    if (nested) for_each_link(*nested, visit);
}

class GazeboWorld final : public live::HostWorld {
 public:
  GazeboWorld(const gazebo::physics::WorldPtr& world, bool visual)
      : world_(world), shapes_(visual, world->Physics()->GetType()) {
    on_update_ = gazebo::event::Events::ConnectWorldUpdateBegin(
        [this, name = world->Name()](const gazebo::common::UpdateInfo& info) {
          if (info.worldName == name) due_ = true;
        });
    on_reset_ = gazebo::event::Events::ConnectWorldReset([this] { due_ = true; });
  }

  bool has_advanced() override { return due_.exchange(false) && world_.lock(); }

  void models(std::vector<Id>& ids) override {
    models_.clear();
    const gazebo::physics::WorldPtr world = world_.lock();
    if (!world) return;
    for (const ModelPtr& model : world->Models()) {
      if (!model) continue;
      ids.push_back(model->GetId());
      models_.emplace(model->GetId(), model);
    }
  }
  std::string name(Id model) override { return at(model)->GetName(); }
  bool is_static(Id model) override { return at(model)->IsStatic(); }
  std::uint64_t structure(Id model) override { return structure_of(*at(model)); }

  std::uint64_t shapes(Id model) override {
    std::uint64_t sum = 0;
    for_each_link(*at(model), [&](const gazebo::physics::LinkPtr& link) {
      live::mix(sum, link->GetId());
      live::mix(sum, shapes_.fingerprint(*link));
    });
    return sum;
  }

  void links(Id model, std::vector<Id>& ids) override {
    for_each_link(*at(model), [&](const gazebo::physics::LinkPtr& link) {
      ids.push_back(link->GetId());
      links_[link->GetId()] = link;
    });
  }

  std::optional<simulation::RigidPose> pose(Id link) override {
    const boost::shared_ptr<Link> at = locked(link);
    if (!at) return std::nullopt;
    return rigid_pose(at->WorldPose());
  }

  city::Mesh mesh(Id link, std::vector<std::string>& notes) override {
    const boost::shared_ptr<Link> at = locked(link);
    return at ? shapes_.link_mesh(*at, notes) : city::Mesh{};
  }

 private:
  /// Models are read only in the step that listed them.
  [[nodiscard]] ModelPtr at(Id model) const { return ModelPtr(models_.at(model)); }
  boost::shared_ptr<Link> locked(Id link) {
    const auto known = links_.find(link);
    if (known == links_.end()) return nullptr;
    boost::shared_ptr<Link> at = known->second.lock();
    if (!at) links_.erase(known);
    return at;
  }

  boost::weak_ptr<gazebo::physics::World> world_;
  ShapeMeshes shapes_;
  // Weak, since a model owns its plugins, and thereby this object.
  std::unordered_map<Id, boost::weak_ptr<Model>> models_;
  std::unordered_map<Id, boost::weak_ptr<Link>> links_;
  std::atomic<bool> due_{true};  // the world advanced since it was last read
  gazebo::event::ConnectionPtr on_update_, on_reset_;
};

}  // namespace

std::shared_ptr<live::WorldScene> scene_of(const gazebo::physics::WorldPtr& world,
                                           const live::WorldScene::Options& options) {
  return live::WorldScene::of(world.get(), options,
                              [&] { return std::make_unique<GazeboWorld>(world, options.visual); });
}

std::optional<live::HostOrigin> origin_of(const gazebo::physics::World& world) {
  const gazebo::common::SphericalCoordinatesPtr at = world.SphericalCoords();
  if (!at) return std::nullopt;
  return live::HostOrigin{
      {at->LatitudeReference().Radian(), at->LongitudeReference().Radian(), at->GetElevationReference()},
      at->HeadingOffset().Radian()};
}

live::HostWorld::Id topmost_id(const ModelPtr& model) {
  gazebo::physics::BasePtr top = model;
  while (top->GetParent() && top->GetParent()->HasType(Base::MODEL)) top = top->GetParent();
  return top->GetId();
}

}  // namespace canyon::adapters::gazebo_classic
