#include "adapters/gazebo_classic/world_geometry.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <boost/pointer_cast.hpp>
#include <boost/weak_ptr.hpp>
#include <cmath>
#include <gazebo/common/Events.hh>
#include <gazebo/physics/Link.hh>
#include <gazebo/physics/Model.hh>
#include <gazebo/physics/PhysicsEngine.hh>
#include <gazebo/physics/World.hh>
#include <mutex>
#include <optional>
#include <unordered_set>
#include <utility>

#include "adapters/gazebo_classic/ignition_types.hpp"
#include "adapters/gazebo_classic/shape_meshes.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/gazebo_names.hpp"
#include "canyon/simulation/city_scene.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using gazebo::physics::Base;
using gazebo::physics::Link;
using gazebo::physics::Model;
using gazebo::physics::ModelPtr;
using raytrace::InstanceId;

/// Movable things farther than this from the static city's centre are left out until they return: rays are
/// exact within 10 km, and something that fell off the world would make them coarse for all others.
constexpr double kReach_m = 10'000;
/// Static links farther than this from the world's origin are left out.
constexpr double kLargestWorld_m = 100'000;
/// Unmoved static models whose shapes are looked at in each step, in turn.
constexpr std::size_t kStaticChecks = 16;

using PoseNumbers = std::array<double, 7>;

/// Compared exactly: ignition's own comparison lets a millimetre pass.
PoseNumbers numbers_of(const ignition::math::Pose3d& pose) {
  const auto& p = pose.Pos();
  const auto& q = pose.Rot();
  return {p.X(), p.Y(), p.Z(), q.W(), q.X(), q.Y(), q.Z()};
}

bool is_finite(const PoseNumbers& pose) {
  return std::all_of(pose.begin(), pose.end(), [](double v) { return std::isfinite(v); }) &&
         std::hypot(std::hypot(pose[3], pose[4]), std::hypot(pose[5], pose[6])) > 1e-6;
}

/// Within 10 micrometres and 2e-7 rad, more than a reset of the world rounds. A quaternion and its negative
/// are one rotation.
bool is_same_place(const PoseNumbers& a, const PoseNumbers& b) {
  double dot = 0;
  for (std::size_t i = 3; i < 7; ++i) dot += a[i] * b[i];
  const double sign = dot < 0 ? -1 : 1;
  for (std::size_t i = 0; i < 7; ++i) {
    if (!(std::abs(a[i] - (i < 3 ? b[i] : sign * b[i])) < (i < 3 ? 1e-5 : 1e-7))) return false;
  }
  return true;
}

struct TrackedLink {
  boost::weak_ptr<Link> link;
  city::Mesh mesh;  ///< in the link's frame; never empty
  PoseNumbers pose{};
  InstanceId instance = 0;  ///< 0: none in this scene
  bool in_reach = false;
};

/// A topmost model.
struct TrackedModel {
  std::uint32_t id = 0;
  std::string name;
  bool movable = false;      ///< instances; else in the static mesh
  bool skipped = false;      ///< no geometry of the city by its name
  unsigned reshaped = 0;     ///< how often its shapes changed while it was static
  std::uint64_t scales = 0;  ///< of it and of nested models
  std::uint64_t shapes = 0;
  std::vector<TrackedLink> links;  ///< with geometry, nested models' too
};

void hash(std::uint64_t& sum, std::uint64_t value) {
  sum ^= value + 0x9E3779B97F4A7C15ULL + (sum << 6) + (sum >> 2);
}

/// Scales and structure of a model and the models in it: cheap enough for every step.
std::uint64_t scales_of(const Model& model) {
  const ignition::math::Vector3d scale = model.Scale();
  std::uint64_t sum = model.GetLinks().size();
  for (int i = 0; i < 3; ++i) hash(sum, std::hash<double>()(scale[static_cast<std::size_t>(i)]));
  for (const ModelPtr& nested : model.NestedModels()) hash(sum, nested ? scales_of(*nested) : 0);
  return sum;
}

template <typename Visit>
void for_each_link(const Model& model, const Visit& visit) {
  for (const gazebo::physics::LinkPtr& link : model.GetLinks()) {
    if (link) visit(link);
  }
  for (const ModelPtr& nested : model.NestedModels()) {
    if (nested) for_each_link(*nested, visit);
  }
}

std::uint32_t topmost_id(const ModelPtr& model) {
  gazebo::physics::BasePtr top = model;
  while (top->GetParent() && top->GetParent()->HasType(Base::MODEL)) top = top->GetParent();
  return top->GetId();
}

void append_mesh(city::Mesh& mesh, const city::Mesh& part, const Eigen::Isometry3d& mesh_from_part) {
  const auto vertex = static_cast<std::uint32_t>(mesh.vertices.size());
  const auto triangle = static_cast<std::uint32_t>(mesh.triangles.size());
  for (const Eigen::Vector3d& v : part.vertices) mesh.vertices.emplace_back(mesh_from_part * v);
  for (const auto& [a, b, c] : part.triangles) mesh.triangles.push_back({vertex + a, vertex + b, vertex + c});
  mesh.materials.insert(mesh.materials.end(), part.materials.begin(), part.materials.end());
  for (city::Object object : part.objects) {
    object.first_triangle += triangle;
    mesh.objects.push_back(std::move(object));
  }
}

std::shared_ptr<simulation::CityScene> make_scene(const std::string& name, const geodesy::LocalFrame& frame,
                                                  city::Mesh mesh) {
  city::City city;
  city.name = name;
  city.frame = frame;
  city.mesh = std::move(mesh);
  return std::make_shared<simulation::CityScene>(std::move(city));
}

}  // namespace

struct WorldGeometry::Impl {
  boost::weak_ptr<gazebo::physics::World> world;
  std::string name;
  Options options;
  Eigen::Isometry3d enu_from_world = Eigen::Isometry3d::Identity();
  ShapeMeshes shapes;

  std::shared_ptr<simulation::CityScene> scene;
  std::uint64_t generation = 0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< of the static city, ENU
  double radius = 0;                                 ///< of the static city about it

  std::vector<TrackedModel> models;  ///< in the world's order
  std::optional<std::uint32_t> left_out;
  std::size_t next_check = 0;
  bool stale = true;     ///< the static mesh is to be built (anew)
  bool changed = false;  ///< instances changed since the last commit

  std::atomic<bool> due{true};  ///< the world went on since the last look at it
  gazebo::event::ConnectionPtr on_update, on_reset;

  std::vector<std::string> notes;
  std::unordered_set<std::string> said;

  Impl(const gazebo::physics::WorldPtr& of_world, const Options& with)
      : world(of_world),
        name(of_world->Name()),
        options(with),
        shapes(with.visual, of_world->Physics()->GetType()) {
    enu_from_world.linear() = options.frame.enu_from_world();
    scene = make_scene(name, options.frame.enu, {});
    on_update =
        gazebo::event::Events::ConnectWorldUpdateBegin([this](const gazebo::common::UpdateInfo& info) {
          if (info.worldName == name) due = true;
        });
    on_reset = gazebo::event::Events::ConnectWorldReset([this] { due = true; });
  }

  void note(std::string line) {
    if (said.insert(line).second) notes.push_back(std::move(line));
  }

  void update(const ModelPtr& leave_out) {
    const gazebo::physics::WorldPtr now = world.lock();
    if (!now) return;
    if (due.exchange(false)) follow(*now);
    hide(leave_out ? std::optional(topmost_id(leave_out)) : std::nullopt);
    if (stale) {
      build();
    } else if (changed) {
      scene->scene.commit();
    }
    changed = false;
  }

  // -- what changed in the world ---------------------------------------------------------------------------

  void follow(const gazebo::physics::World& now) {
    gazebo::physics::Model_V present = now.Models();
    present.erase(std::remove(present.begin(), present.end(), nullptr), present.end());
    match(present);
    for (std::size_t i = 0; i < models.size(); ++i) follow(models[i], *present[i], is_checked(i));
    next_check = models.empty() ? 0 : (next_check + kStaticChecks) % models.size();
  }

  /// Static models take turns.
  [[nodiscard]] bool is_checked(std::size_t i) const {
    return models[i].movable || (i + models.size() - next_check) % models.size() < kStaticChecks;
  }

  /// Makes `models` those that are present, in their order.
  void match(const gazebo::physics::Model_V& present) {
    if (std::equal(models.begin(), models.end(), present.begin(), present.end(),
                   [](const TrackedModel& m, const ModelPtr& p) { return m.id == p->GetId(); })) {
      return;
    }
    std::vector<TrackedModel> before = std::exchange(models, {});
    models.reserve(present.size());
    for (const ModelPtr& model : present) {
      const auto known = std::find_if(before.begin(), before.end(),
                                      [&](const TrackedModel& m) { return m.id == model->GetId(); });
      if (known != before.end()) {
        models.push_back(std::move(*known));
        before.erase(known);
      } else {
        models.push_back(track(*model));
      }
    }
    for (TrackedModel& gone : before) forget(gone);
  }

  TrackedModel track(const Model& model) {
    TrackedModel tracked;
    tracked.id = model.GetId();
    tracked.name = model.GetName();
    // A new static city costs more than some instances, so that latecomers are these.
    tracked.movable = !model.IsStatic() || generation > 0;
    if (tracked.name == city::kGroundPlaneModel) {
      tracked.skipped = true;
      note(fmt::format("'{}', the ground under a city without terrain, is no part of it", tracked.name));
    }
    read_shapes(tracked, model);
    return tracked;
  }

  void forget(TrackedModel& model) {
    if (!model.movable && !model.links.empty()) stale = true;
    for (TrackedLink& link : model.links) drop(link);
  }

  void drop(TrackedLink& link) {
    if (link.instance == 0) return;
    scene->scene.remove_instance(link.instance);
    link.instance = 0;
    changed = true;
  }

  std::uint64_t shapes_of(const Model& model) const {
    std::uint64_t sum = 0;
    for_each_link(model, [&](const gazebo::physics::LinkPtr& link) {
      hash(sum, link->GetId());
      hash(sum, shapes.fingerprint(*link));
    });
    return sum;
  }

  /// Meshes of a model's links; instances where it is movable and a city stands already.
  void read_shapes(TrackedModel& tracked, const Model& model) {
    for (TrackedLink& link : tracked.links) drop(link);
    tracked.links.clear();
    tracked.scales = scales_of(model);
    if (tracked.skipped) return;
    tracked.shapes = shapes_of(model);
    std::vector<std::string> remarks;
    for_each_link(model, [&](const gazebo::physics::LinkPtr& link) {
      TrackedLink part;
      part.link = link;
      part.mesh = shapes.link_mesh(*link, remarks);
      if (part.mesh.triangles.empty()) return;
      if (!model.IsStatic()) {
        // What moves through a city is no building, though it reflects like one.
        for (city::Object& object : part.mesh.objects) {
          if (object.surface == city::Surface::Building) object.surface = city::Surface::Vehicle;
        }
      }
      part.pose = numbers_of(link->WorldPose());
      if (tracked.movable && generation > 0) add(tracked, part, *link);
      tracked.links.push_back(std::move(part));
    });
    for (std::string& remark : remarks) note(std::move(remark));
  }

  void follow(TrackedModel& tracked, const Model& model, bool check_shapes) {
    if (tracked.skipped) return;
    if (tracked.scales != scales_of(model) || (check_shapes && tracked.shapes != shapes_of(model))) {
      if (!tracked.movable) {
        stale = true;
        // Once may be an edit; what goes on changing would have the city built in every step.
        tracked.movable = ++tracked.reshaped > 1;
      }
      read_shapes(tracked, model);
    }
    for (TrackedLink& part : tracked.links) {
      const boost::shared_ptr<Link> link = part.link.lock();
      if (!link) continue;  // with its model, or with the next look at the model's shapes
      const PoseNumbers pose = numbers_of(link->WorldPose());
      if (tracked.movable ? pose == part.pose : is_same_place(pose, part.pose)) continue;
      part.pose = pose;
      if (!tracked.movable) {
        tracked.movable = true;
        stale = true;
      }
      if (part.instance != 0) place(tracked, part, *link);
    }
  }

  // -- the scene -------------------------------------------------------------------------------------------

  void add(const TrackedModel& model, TrackedLink& part, const Link& link) {
    part.instance = scene->scene.add_instance(part.mesh);
    part.in_reach = false;
    place(model, part, link);
  }

  void place(const TrackedModel& model, TrackedLink& part, const Link& link) {
    part.in_reach = is_finite(part.pose);
    if (part.in_reach) {
      const Eigen::Isometry3d pose = enu_from_world * eigen(link.WorldPose());
      part.in_reach = (pose.translation() - centre).norm() <= std::max(kReach_m, radius);
      if (part.in_reach) scene->scene.set_pose(part.instance, pose);
    }
    if (!part.in_reach) {
      note(fmt::format("'{}' is left out while it is more than {:.0f} km from the city, or nowhere",
                       model.name, kReach_m / 1e3));
    }
    scene->scene.set_visible(part.instance, part.in_reach && left_out != model.id);
    changed = true;
  }

  void hide(std::optional<std::uint32_t> id) {
    if (left_out == id) return;
    const std::optional<std::uint32_t> before = std::exchange(left_out, id);
    for (TrackedModel& model : models) {
      if (model.id != before && model.id != id) continue;
      if (!model.movable && model.id == id && !model.links.empty()) {
        model.movable = true;
        stale = true;
      }
      for (const TrackedLink& link : model.links) {
        if (link.instance == 0) continue;
        scene->scene.set_visible(link.instance, link.in_reach && model.id != id);
        changed = true;
      }
    }
  }

  /// A new scene: the static mesh and every instance.
  void build() {
    city::Mesh mesh;
    bool any = false;
    for (const TrackedModel& model : models) {
      any = any || !model.links.empty();
      if (model.movable) continue;
      for (const TrackedLink& part : model.links) {
        const boost::shared_ptr<Link> link = part.link.lock();
        if (!link) continue;
        if (!is_finite(part.pose) || link->WorldPose().Pos().Length() > kLargestWorld_m) {
          note(fmt::format(
              "'{}' is left out: it stands more than {:.0f} km from the world's origin, or nowhere",
              model.name, kLargestWorld_m / 1e3));
          continue;
        }
        append_mesh(mesh, part.mesh, enu_from_world * eigen(link->WorldPose()));
      }
    }
    if (!any) {
      note(fmt::format("world '{}' holds no {} geometry: every satellite is in sight", name,
                       options.visual ? "visual" : "collision"));
    }
    scene = make_scene(name, options.frame.enu, std::move(mesh));
    ++generation;
    stale = false;
    const city::Box bounds = scene->city.bounds();
    const bool empty = scene->city.mesh.vertices.empty();
    centre = empty ? Eigen::Vector3d::Zero() : Eigen::Vector3d(0.5 * (bounds.min + bounds.max));
    radius = empty ? 0 : 0.5 * (bounds.max - bounds.min).norm();
    if (radius > kReach_m) {
      note(fmt::format(
          "the static geometry reaches {:.0f} km from its centre: rays are exact within {:.0f} km",
          radius / 1e3, kReach_m / 1e3));
    }
    for (TrackedModel& model : models) {
      for (TrackedLink& part : model.links) {
        part.instance = 0;
        const boost::shared_ptr<Link> link = part.link.lock();
        if (model.movable && link) add(model, part, *link);
      }
    }
    scene->scene.commit();
  }
};

WorldGeometry::WorldGeometry(const gazebo::physics::WorldPtr& world, const Options& options)
    : impl_(std::make_unique<Impl>(world, options)) {}
WorldGeometry::~WorldGeometry() = default;

std::shared_ptr<WorldGeometry> WorldGeometry::of(const gazebo::physics::WorldPtr& world,
                                                 const Options& options) {
  // Never destroyed: plugins may be unloaded after static objects are gone.
  static auto& mutex = *new std::mutex;
  static auto& known = *new std::vector<std::weak_ptr<WorldGeometry>>;
  const std::lock_guard lock(mutex);
  known.erase(std::remove_if(known.begin(), known.end(), [](const auto& g) { return g.expired(); }),
              known.end());
  const auto same_frame = [&options](const WorldFrame& other) {
    const geodesy::Geodetic &a = options.frame.enu.origin(), &b = other.enu.origin();
    return a.latitude_rad == b.latitude_rad && a.longitude_rad == b.longitude_rad &&
           a.height_m == b.height_m && options.frame.enu.heading_rad() == other.enu.heading_rad() &&
           options.frame.heading_rad == other.heading_rad;
  };
  for (const std::weak_ptr<WorldGeometry>& weak : known) {
    const std::shared_ptr<WorldGeometry> geometry = weak.lock();
    if (geometry && geometry->impl_->world.lock() == world &&
        geometry->impl_->options.visual == options.visual && same_frame(geometry->impl_->options.frame)) {
      return geometry;
    }
  }
  const std::shared_ptr<WorldGeometry> made(new WorldGeometry(world, options));
  known.push_back(made);
  return made;
}

void WorldGeometry::update(const gazebo::physics::ModelPtr& left_out) {
  impl_->update(left_out);
}

const std::shared_ptr<simulation::CityScene>& WorldGeometry::scene() const {
  return impl_->scene;
}

std::uint64_t WorldGeometry::generation() const {
  return impl_->generation;
}

std::vector<std::string> WorldGeometry::take_notes() {
  return std::exchange(impl_->notes, {});
}

}  // namespace canyon::adapters::gazebo_classic
