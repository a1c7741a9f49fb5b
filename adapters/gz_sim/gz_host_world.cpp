#include "adapters/gz_sim/gz_host_world.hpp"

#include <algorithm>
#include <gz/sim/components/Collision.hh>
#include <gz/sim/components/Geometry.hh>
#include <gz/sim/components/Link.hh>
#include <gz/sim/components/Material.hh>
#include <gz/sim/components/Model.hh>
#include <gz/sim/components/Name.hh>
#include <gz/sim/components/ParentEntity.hh>
#include <gz/sim/components/Pose.hh>
#include <gz/sim/components/SphericalCoordinates.hh>
#include <gz/sim/components/Static.hh>
#include <gz/sim/components/Visual.hh>
#include <gz/sim/components/World.hh>

#include "adapters/common/gazebo_math.hpp"

namespace canyon::adapters::gz_sim {

namespace components = gz::sim::components;

namespace {

// A shape that was changed without notice is detected after this number of checks.
constexpr unsigned kUnsaidAge = 50;

}  // namespace

std::optional<live::HostOrigin> origin_of(const gz::sim::EntityComponentManager& ecm) {
  const auto at = ecm.ComponentData<components::SphericalCoordinates>(gz::sim::worldEntity(ecm));
  if (!at) return std::nullopt;
  return live::HostOrigin{
      {at->LatitudeReference().Radian(), at->LongitudeReference().Radian(), at->ElevationReference()},
      at->HeadingOffset().Radian()};
}

void GzHostWorld::update_models(const gz::sim::EntityComponentManager& ecm) {
  ecm_ = &ecm;
  went_on_ = true;
  if (ecm.HasNewEntities() || ecm.HasEntitiesMarkedForRemoval()) changed_ = models_changed_ = true;
  if (ecm.HasOneTimeComponentChanges()) changed_ = true;
}

void GzHostWorld::models(std::vector<Id>& ids) {
  if (changed_)
    for (auto& [model, known] : fingerprints_) known.age = kUnsaidAge;
  // Entities are marked in the step before they are removed.
  const bool gone = std::any_of(models_.begin(), models_.end(), [&](Id id) { return !ecm_->HasEntity(id); });
  if (std::exchange(models_changed_, false) || gone) {
    models_.clear();
    // The manager's own graph of entities has no edges while a log is played back.
    children_.clear();
    ecm_->Each<components::ParentEntity>(
        [&](const gz::sim::Entity& entity, const components::ParentEntity* parent) {
          children_[parent->Data()].push_back(entity);
          return true;
        });
    for (auto& [parent, children] : children_) std::sort(children.begin(), children.end());
    ecm_->Each<components::Model, components::ParentEntity>(
        [&](const gz::sim::Entity& entity, const components::Model*, const components::ParentEntity* parent) {
          if (ecm_->Component<components::World>(parent->Data()) != nullptr) models_.push_back(entity);
          return true;
        });
    std::sort(models_.begin(), models_.end());
    ecm_->EachRemoved<components::Model>([&](const gz::sim::Entity& entity, const components::Model*) {
      models_.erase(std::remove(models_.begin(), models_.end(), entity), models_.end());
      fingerprints_.erase(entity);
      return true;
    });
  }
  ids.insert(ids.end(), models_.begin(), models_.end());
}

std::string GzHostWorld::name(Id model) {
  return ecm_->ComponentData<components::Name>(model).value_or("");
}

bool GzHostWorld::is_static(Id model) {
  return ecm_->ComponentData<components::Static>(model).value_or(false);
}

void GzHostWorld::links(Id model, std::vector<Id>& ids) {
  for (const Id child : children(model))
    if (ecm_->Component<components::Link>(child) != nullptr) ids.push_back(child);
  for (const Id child : children(model))
    if (ecm_->Component<components::Model>(child) != nullptr) links(child, ids);
}

const std::vector<GzHostWorld::Id>& GzHostWorld::children(Id parent) const {
  static const std::vector<Id> kNone;
  const auto found = children_.find(parent);
  return found == children_.end() ? kNone : found->second;
}

template <typename Visit>
void GzHostWorld::for_each_shape(Id link, const Visit& visit) const {
  for (const Id entity : children(link)) {
    const bool is_shape = visual_ ? ecm_->Component<components::Visual>(entity) != nullptr
                                  : ecm_->Component<components::Collision>(entity) != nullptr;
    if (!is_shape) continue;
    const auto* geometry = ecm_->Component<components::Geometry>(entity);
    const auto* pose = ecm_->Component<components::Pose>(entity);
    if (geometry != nullptr && pose != nullptr) visit(entity, geometry->Data(), pose->Data());
  }
}

std::uint64_t GzHostWorld::shapes(Id model) {
  Fingerprint& known = fingerprints_.try_emplace(model, Fingerprint{0, kUnsaidAge}).first->second;
  if (known.age++ < kUnsaidAge) return known.sum;
  known = {};
  std::vector<Id> ids;
  links(model, ids);
  for (const Id link : ids) {
    live::mix(known.sum, link);
    for_each_shape(link, [&](Id entity, const sdf::Geometry& geometry, const gz::math::Pose3d& pose) {
      live::mix(known.sum, entity);
      live::mix(known.sum, fingerprint(geometry, eigen(pose)));
    });
  }
  return known.sum;
}

std::optional<simulation::RigidPose> GzHostWorld::pose(Id link) {
  if (ecm_->Component<components::Pose>(link) == nullptr) return std::nullopt;
  return rigid_pose(gz::sim::worldPose(link, *ecm_));
}

city::Mesh GzHostWorld::mesh(Id link, std::vector<std::string>& notes) {
  files_.set_world_origin(ecm_->ComponentData<components::SphericalCoordinates>(gz::sim::worldEntity(*ecm_)));
  LinkShapes shapes(notes);
  for_each_shape(link, [&](Id entity, const sdf::Geometry& geometry, const gz::math::Pose3d& pose) {
    const auto* material = ecm_->Component<components::Material>(entity);
    const std::string name =
        gz::sim::removeParentScope(gz::sim::scopedName(entity, *ecm_, "::", false), "::");
    add_shape(shapes, {name, eigen(pose), material_of(material == nullptr ? nullptr : &material->Data())},
              geometry, &files_);
  });
  return shapes.take();
}

}  // namespace canyon::adapters::gz_sim
