#include "adapters/gazebo_classic/physics_rays.hpp"

#include <fmt/format.h>

#include <gazebo/physics/ode/ode_inc.h>
#include <algorithm>
#include <array>
#include <boost/thread/recursive_mutex.hpp>
#include <cmath>
#include <functional>
#include <gazebo/physics/Collision.hh>
#include <gazebo/physics/Link.hh>
#include <gazebo/physics/Model.hh>
#include <gazebo/physics/MultiRayShape.hh>
#include <gazebo/physics/World.hh>
#include <gazebo/physics/ode/ODECollision.hh>
#include <gazebo/physics/ode/ODEPhysics.hh>
#include <gazebo/sensors/RaySensor.hh>
#include <limits>
#include <thread>
#include <vector>

#include "adapters/gazebo_classic/ignition_types.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::adapters::gazebo_classic {

using gazebo::physics::Collision;
using gazebo::physics::ModelPtr;
using gazebo::physics::ODECollision;
using gazebo::physics::ODEPhysics;
using ignition::math::Vector3d;

namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();
constexpr double kUnitTolerance = 1e-6;
// Triangles that one ray may cross.
constexpr int kHeightmapContacts = 256;

void check(std::span<const PhysicsRay> rays, std::span<double> ranges, const std::string& name) {
  if (rays.size() != ranges.size()) {
    throw InputError(fmt::format("{}: {} rays, but {} ranges", name, rays.size(), ranges.size()),
                     "give one range for each ray");
  }
  for (std::size_t i = 0; i < rays.size(); ++i) {
    const PhysicsRay& ray = rays[i];
    if (!ray.origin.allFinite() || !(std::abs(ray.direction.norm() - 1) <= kUnitTolerance)) {
      throw InputError(
          fmt::format("{}: ray {} is not finite, or its direction is not of unit length", name, i),
          "check the pose of the vehicle");
    }
    if (!(ray.max_range_m > 0) || !std::isfinite(ray.max_range_m)) {
      throw InputError(fmt::format("{}: max_range_m of ray {} is {}", name, i, ray.max_range_m),
                       "give a finite value above 0");
    }
  }
}

/// The collision of an ODE geometry; null if it is not Gazebo's.
const Collision* collision_of(dGeomID geometry) {
  if (dGeomGetClass(geometry) == dGeomTransformClass) geometry = dGeomTransformGetGeom(geometry);
  return static_cast<const ODECollision*>(dGeomGetData(geometry));
}

/// Appends the collisions of a model and of its nested models.
void collect_collisions(const gazebo::physics::Model& model, std::vector<const Collision*>& collisions) {
  for (const auto& link : model.GetLinks())
    for (const auto& collision : link->GetCollisions()) collisions.push_back(collision.get());
  for (const ModelPtr& nested : model.NestedModels()) collect_collisions(*nested, collisions);
}

}  // namespace

struct PhysicsRays::Impl {
  std::string name;
  gazebo::physics::LinkPtr link;
  boost::shared_ptr<ODEPhysics> engine;
  // Weak, because the sensor owns the plugin, which owns this object.
  std::weak_ptr<gazebo::sensors::RaySensor> sensor;
  bool sensor_was_active = false;
  std::thread::id prepared_thread;
  std::vector<const Collision*> left_out;  // sorted
  std::array<dContactGeom, kHeightmapContacts> contacts{};
  dGeomID ray = nullptr;  // in no space, set to one ray after the other

  Impl() = default;
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;
  ~Impl() {
    if (ray != nullptr) dGeomDestroy(ray);
  }

  [[nodiscard]] bool is_left_out(const Collision* collision) const {
    return std::binary_search(left_out.begin(), left_out.end(), collision, std::less<>());
  }
  // ODE's callback for a pair whose boxes overlap. A hit shortens the ray, so that only nearer hits follow.
  static void meet(void* data, dGeomID a, dGeomID b) {
    if (dGeomIsSpace(a) || dGeomIsSpace(b)) {
      dSpaceCollide2(a, b, data, &Impl::meet);
      return;
    }
    Impl& self = *static_cast<Impl*>(data);
    const dGeomID other = a == self.ray ? b : a;
    const Collision* collision = collision_of(other);
    if (collision == nullptr || self.is_left_out(collision)) return;
    // A heightmap returns its triangles unordered: take the nearest. Other shapes return their nearest.
    const int wanted = dGeomGetClass(other) == dHeightfieldClass ? kHeightmapContacts : 1;
    const int found = dCollide(self.ray, other, wanted, self.contacts.data(), sizeof(dContactGeom));
    for (int i = 0; i < found; ++i) {
      const double depth = self.contacts[static_cast<std::size_t>(i)].depth;
      if (depth < dGeomRayGetLength(self.ray)) dGeomRaySetLength(self.ray, depth);
    }
  }

  [[nodiscard]] double cast_one(const PhysicsRay& aim) {
    dGeomRaySetLength(ray, aim.max_range_m);
    dGeomRaySet(ray, aim.origin.x(), aim.origin.y(), aim.origin.z(), aim.direction.x(), aim.direction.y(),
                aim.direction.z());
    dSpaceCollide2(ray, reinterpret_cast<dGeomID>(engine->GetSpaceId()), this, &Impl::meet);
    const double length = dGeomRayGetLength(ray);
    return length < aim.max_range_m ? length : kInfinite;
  }

  // Rays of a sensor are given in its link's frame.
  void show(std::span<const PhysicsRay> rays, std::span<const double> ranges) const {
    const auto owner = sensor.lock();
    if (!owner || owner->IsActive()) return;
    const auto shape = owner->LaserShape();
    if (!shape) return;
    const auto world_from_link = link->WorldPose();
    const auto link_from_world = world_from_link.Rot().Inverse();
    const std::size_t count = std::min<std::size_t>(rays.size(), shape->RayCount());
    for (std::size_t i = 0; i < count; ++i) {
      const double length = std::min(ranges[i], rays[i].max_range_m);
      const Vector3d start = link_from_world * (ignition_from(rays[i].origin) - world_from_link.Pos());
      const Vector3d direction = link_from_world * ignition_from(rays[i].direction);
      shape->SetRay(static_cast<unsigned>(i), start, start + direction * length);
      shape->Ray(static_cast<unsigned>(i))->SetLength(length);
    }
  }
};

PhysicsRays::PhysicsRays(const gazebo::physics::LinkPtr& link, const gazebo::sensors::RaySensorPtr& sensor,
                         const std::string& name)
    : impl_(std::make_unique<Impl>()) {
  impl_->name = name;
  impl_->link = link;
  impl_->sensor = sensor;
  const auto engine = link->GetWorld()->Physics();
  impl_->engine = boost::dynamic_pointer_cast<ODEPhysics>(engine);
  if (!impl_->engine) {
    throw InputError(fmt::format("{}: the physics engine '{}' has no rays that can be set at every update",
                                 name, engine->GetType()),
                     "write <ray_engine>embree</ray_engine>, or <physics type=\"ode\"> in the world");
  }
  impl_->ray = dCreateRay(nullptr, 1);
  // The bits of Gazebo's own rays: rays of sensors do not hit each other.
  dGeomSetCategoryBits(impl_->ray, GZ_SENSOR_COLLIDE);
  dGeomSetCollideBits(impl_->ray, ~static_cast<unsigned long>(GZ_SENSOR_COLLIDE));
  dGeomRaySetParams(impl_->ray, 0, 0);  // any contact, from both sides
  dGeomRaySetClosestHit(impl_->ray, 1);
  if (sensor) {
    impl_->sensor_was_active = sensor->IsActive();
    sensor->SetActive(false);
  }
}

PhysicsRays::~PhysicsRays() {
  if (const auto sensor = impl_->sensor.lock()) {
    if (impl_->sensor_was_active) sensor->SetActive(true);
  }
}

void PhysicsRays::cast(std::span<const PhysicsRay> rays, const ModelPtr& left_out, std::span<double> ranges) {
  check(rays, ranges, impl_->name);
  impl_->left_out.clear();
  if (left_out) collect_collisions(*left_out, impl_->left_out);
  std::sort(impl_->left_out.begin(), impl_->left_out.end(), std::less<>());
  // ODE has buffers for meshes in each thread.
  if (impl_->prepared_thread != std::this_thread::get_id()) {
    impl_->engine->InitForThread();
    impl_->prepared_thread = std::this_thread::get_id();
  }
  {
    const boost::recursive_mutex::scoped_lock lock(*impl_->engine->GetPhysicsUpdateMutex());
    for (std::size_t i = 0; i < rays.size(); ++i) ranges[i] = impl_->cast_one(rays[i]);
  }
  impl_->show(rays, ranges);
}

}  // namespace canyon::adapters::gazebo_classic
