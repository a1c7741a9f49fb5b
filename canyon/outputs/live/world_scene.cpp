#include "canyon/outputs/live/world_scene.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <mutex>
#include <unordered_map>
#include <unordered_set>
#include <utility>

#include "canyon/city/gazebo_export.hpp"

namespace canyon::live {
namespace {

using Id = HostWorld::Id;
using raytrace::InstanceId;

/// Movable objects farther than this from the static city's centre are left out until they return: rays are
/// exact within 10 km, and a distant object would reduce the accuracy for all others.
constexpr double kReach_m = 10'000;
/// Static links farther than this from the world's origin are left out.
constexpr double kMaxWorld_m = 100'000;
/// Number of unmoved static models that are checked in each step, in turn.
constexpr std::size_t kStaticChecks = 16;

using simulation::RigidPose;

bool is_finite(const RigidPose& pose) {
  return pose.position_m.allFinite() && pose.attitude.coeffs().allFinite() && pose.attitude.norm() > 1e-6;
}

/// Compares to 10 micrometres and 2e-7 rad, above the rounding by a reset of the world. A quaternion and its
/// negative are the same rotation.
bool is_same_pose(const RigidPose& a, const RigidPose& b) {
  const double sign = a.attitude.dot(b.attitude) < 0 ? -1 : 1;
  return ((a.position_m - b.position_m).array().abs() < 1e-5).all() &&
         ((a.attitude.coeffs() - sign * b.attitude.coeffs()).array().abs() < 1e-7).all();
}

Eigen::Isometry3d isometry(const RigidPose& pose) {
  Eigen::Isometry3d result = Eigen::Isometry3d::Identity();
  result.linear() = pose.attitude.normalized().toRotationMatrix();
  result.translation() = pose.position_m;
  return result;
}

struct TrackedLink {
  Id id = 0;
  city::Mesh mesh;  ///< in the link's frame; never empty
  RigidPose pose;
  InstanceId instance = 0;  ///< 0: not in this scene
  bool in_reach = false;
};

/// A topmost model.
struct TrackedModel {
  Id id = 0;
  std::string name;
  bool vehicle = false;   ///< the host may move it
  bool movable = false;   ///< instances; else in the static mesh
  bool skipped = false;   ///< excluded from the city by its name
  unsigned reshaped = 0;  ///< number of changes of its shapes while static
  std::uint64_t structure = 0;
  std::uint64_t shapes = 0;
  std::vector<TrackedLink> links;  ///< with geometry, including nested models
};

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
                                                  city::Mesh mesh, std::string facades = {}) {
  city::City city;
  if (!facades.empty()) city.notes.add_line(ReadReport::Level::Remark, facades);
  city.name = name;
  city.frame = frame;
  city.mesh = std::move(mesh);
  return std::make_shared<simulation::CityScene>(std::move(city));
}

}  // namespace

struct WorldScene::Impl {
  std::unique_ptr<HostWorld> world;
  Options options;
  Eigen::Isometry3d enu_from_world = Eigen::Isometry3d::Identity();

  std::shared_ptr<simulation::CityScene> scene;
  std::uint64_t generation = 0;
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();  ///< centre of the static city, ENU
  double radius = 0;                                 ///< radius of the static city around it

  std::vector<TrackedModel> models;  ///< in the world's order
  std::vector<Id> ids;               ///< kept to reuse its memory
  std::optional<Id> left_out;
  std::size_t next_check = 0;
  bool stale = true;     ///< the static mesh must be (re)built
  bool changed = false;  ///< instances changed since the last commit

  std::vector<std::string> notes;
  std::unordered_set<std::string> logged;

  Impl(std::unique_ptr<HostWorld> of, Options with) : world(std::move(of)), options(std::move(with)) {
    enu_from_world.linear() = options.frame.enu_from_world();
    scene = make_scene(options.name, options.frame.enu, {});
  }

  void note(std::string line) {
    if (logged.insert(line).second) notes.push_back(std::move(line));
  }

  void show(std::optional<Id> leave_out) {
    hide(leave_out);
    if (stale)
      build();
    else if (changed)
      scene->scene.commit();
    changed = false;
  }

  // -- changes of the world --------------------------------------------------------------------------------

  void follow() {
    if (!world->has_advanced()) return;
    ids.clear();
    world->models(ids);
    match();
    const bool statics_moved = world->statics_may_have_moved();
    for (std::size_t i = 0; i < models.size(); ++i) {
      const bool checked = is_checked(i);
      follow(models[i], checked, models[i].movable || checked || statics_moved);
    }
    next_check = models.empty() ? 0 : (next_check + kStaticChecks) % models.size();
  }

  /// Movable models are checked in every step, static ones in turn.
  [[nodiscard]] bool is_checked(std::size_t i) const {
    return models[i].movable || (i + models.size() - next_check) % models.size() < kStaticChecks;
  }

  /// Updates `models` to `ids`, in their order.
  void match() {
    if (std::equal(models.begin(), models.end(), ids.begin(), ids.end(),
                   [](const TrackedModel& m, Id id) { return m.id == id; }))
      return;
    std::unordered_map<Id, TrackedModel> before;
    for (TrackedModel& model : models) before.emplace(model.id, std::move(model));
    models.clear();
    models.reserve(ids.size());
    for (const Id id : ids)
      if (auto known = before.extract(id))
        models.push_back(std::move(known.mapped()));
      else
        models.push_back(track(id));
    for (auto& [id, gone] : before) forget(gone);
  }

  TrackedModel track(Id id) {
    TrackedModel tracked;
    tracked.id = id;
    tracked.name = world->name(id);
    // Rebuilding the static city costs more than some instances, so models added later become instances.
    tracked.vehicle = !world->is_static(id);
    tracked.movable = tracked.vehicle || generation > 0;
    if (tracked.name == city::kGroundPlaneModel) {
      tracked.skipped = true;
      note(fmt::format("'{}', the ground under a city without terrain, is not part of the city",
                       tracked.name));
    }
    tracked.structure = world->structure(id);
    tracked.shapes = world->shapes(id);
    read_shapes(tracked);
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

  /// Builds the meshes of a model's links; instances if it is movable and the city has been built.
  void read_shapes(TrackedModel& tracked) {
    for (TrackedLink& link : tracked.links) drop(link);
    tracked.links.clear();
    if (tracked.skipped) return;
    std::vector<std::string> remarks;
    std::vector<Id> links;
    world->links(tracked.id, links);
    tracked.vehicle = !world->is_static(tracked.id);
    for (const Id link : links) {
      TrackedLink part;
      part.id = link;
      part.mesh = world->mesh(link, remarks);
      const std::optional<RigidPose> pose = world->pose(link);
      if (part.mesh.triangles.empty() || !pose) continue;
      if (tracked.vehicle) {
        // A moving model reflects like a building but is not one.
        for (city::Object& object : part.mesh.objects)
          if (object.surface == city::Surface::Building) object.surface = city::Surface::Vehicle;
      }
      part.pose = *pose;
      tracked.links.push_back(std::move(part));
    }
    for (std::string& remark : remarks) note(std::move(remark));
    if (!tracked.movable || generation == 0) return;
    (void)dress({&tracked});
    for (TrackedLink& part : tracked.links) add(tracked, part);
  }

  /// Assigns facades to models that are not vehicles; returns the note of assign_facades().
  std::string dress(const std::vector<TrackedModel*>& among) const {
    city::City city;
    std::vector<city::Mesh*> parts;
    for (TrackedModel* model : among) {
      for (TrackedLink& part : model->links) {
        if (model->vehicle || !is_finite(part.pose)) continue;
        append_mesh(city.mesh, part.mesh, enu_from_world * isometry(part.pose));
        parts.push_back(&part.mesh);
      }
    }
    std::string summary =
        city::assign_facades(city, options.facades, options.facades.keeps_named(false), options.seed);
    auto sampled = city.mesh.materials.cbegin();
    for (city::Mesh* part : parts) {
      const auto end = sampled + static_cast<std::ptrdiff_t>(part->materials.size());
      part->materials.assign(sampled, end);
      sampled = end;
    }
    return summary;
  }

  void follow(TrackedModel& tracked, bool check_shapes, bool check_poses) {
    if (tracked.skipped) return;
    const std::uint64_t structure = world->structure(tracked.id);
    const std::uint64_t shapes =
        check_shapes || structure != tracked.structure ? world->shapes(tracked.id) : tracked.shapes;
    if (tracked.structure != structure || tracked.shapes != shapes) {
      tracked.structure = structure;
      tracked.shapes = shapes;
      if (!tracked.movable) {
        stale = true;
        // One change may be an edit; further ones would rebuild the city in every step.
        tracked.movable = ++tracked.reshaped > 1;
      }
      read_shapes(tracked);
    }
    if (!check_poses) return;
    for (TrackedLink& part : tracked.links) {
      const std::optional<RigidPose> pose = world->pose(part.id);
      if (!pose) continue;  // removed with its model, or when the model's shapes are read next
      const bool stays = tracked.movable ? pose->position_m == part.pose.position_m &&
                                               pose->attitude.coeffs() == part.pose.attitude.coeffs()
                                         : is_same_pose(*pose, part.pose);
      if (stays) continue;
      part.pose = *pose;
      if (!tracked.movable) {
        tracked.movable = true;
        stale = true;
      }
      if (part.instance != 0) set_pose(tracked, part);
    }
  }

  // -- the scene -------------------------------------------------------------------------------------------

  void add(const TrackedModel& model, TrackedLink& part) {
    part.instance = scene->scene.add_instance(part.mesh);
    part.in_reach = false;
    set_pose(model, part);
  }

  void set_pose(const TrackedModel& model, TrackedLink& part) {
    part.in_reach = is_finite(part.pose);
    if (part.in_reach) {
      const Eigen::Isometry3d pose = enu_from_world * isometry(part.pose);
      part.in_reach = (pose.translation() - centre).norm() <= std::max(kReach_m, radius);
      if (part.in_reach) scene->scene.set_pose(part.instance, pose);
    }
    if (!part.in_reach) {
      note(fmt::format(
          "'{}' is left out while it is more than {:.0f} km from the city, or its position is not finite",
          model.name, kReach_m / 1e3));
    }
    scene->scene.set_visible(part.instance, part.in_reach && left_out != model.id);
    changed = true;
  }

  void hide(std::optional<Id> id) {
    if (left_out == id) return;
    const std::optional<Id> before = std::exchange(left_out, id);
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

  /// Makes a new scene: the static mesh and every instance.
  void build() {
    std::vector<TrackedModel*> all;
    for (TrackedModel& model : models) all.push_back(&model);
    std::string facades = dress(all);
    city::Mesh mesh;
    bool any = false;
    for (const TrackedModel& model : models) {
      any = any || !model.links.empty();
      if (model.movable) continue;
      for (const TrackedLink& part : model.links) {
        const Eigen::Isometry3d pose = isometry(part.pose);
        if (!is_finite(part.pose) || pose.translation().norm() > kMaxWorld_m) {
          note(
              fmt::format("'{}' is left out: it is more than {:.0f} km from the world's origin, or its "
                          "position is not finite",
                          model.name, kMaxWorld_m / 1e3));
          continue;
        }
        append_mesh(mesh, part.mesh, enu_from_world * pose);
      }
    }
    if (!any) {
      note(fmt::format("world '{}' has no {} geometry: all satellites are in line of sight", options.name,
                       options.visual ? "visual" : "collision"));
    }
    scene = make_scene(options.name, options.frame.enu, std::move(mesh), std::move(facades));
    ++generation;
    stale = false;
    const city::Box bounds = scene->city.bounds();
    const bool empty = scene->city.mesh.vertices.empty();
    centre = empty ? Eigen::Vector3d::Zero() : Eigen::Vector3d(0.5 * (bounds.min + bounds.max));
    radius = empty ? 0 : 0.5 * (bounds.max - bounds.min).norm();
    if (radius > kReach_m) {
      note(fmt::format(
          "the static geometry extends {:.0f} km from its centre: rays are exact within {:.0f} km",
          radius / 1e3, kReach_m / 1e3));
    }
    for (TrackedModel& model : models) {
      for (TrackedLink& part : model.links) {
        part.instance = 0;
        if (model.movable) add(model, part);
      }
    }
    scene->scene.commit();
  }
};

WorldScene::WorldScene(std::unique_ptr<HostWorld> world, Options options)
    : impl_(std::make_unique<Impl>(std::move(world), std::move(options))) {}
WorldScene::~WorldScene() = default;

std::shared_ptr<WorldScene> WorldScene::of(const void* world, const Options& options,
                                           const std::function<std::unique_ptr<HostWorld>()>& make) {
  struct KnownModel {
    const void* world = nullptr;
    std::weak_ptr<WorldScene> scene;
  };
  // Never destroyed: plugins may be unloaded after static objects are gone.
  static auto& mutex = *new std::mutex;
  static auto& known = *new std::vector<KnownModel>;
  const std::lock_guard lock(mutex);
  std::erase_if(known, [](const KnownModel& k) { return k.scene.expired(); });
  for (const KnownModel& other : known) {
    std::shared_ptr<WorldScene> scene = other.scene.lock();
    if (scene && other.world == world && scene->impl_->options == options) return scene;
  }
  auto made = std::make_shared<WorldScene>(make(), options);
  known.push_back({world, made});
  return made;
}

void WorldScene::follow() {
  impl_->follow();
}

void WorldScene::show(std::optional<HostWorld::Id> left_out) {
  impl_->show(left_out);
}

HostWorld& WorldScene::world() {
  return *impl_->world;
}

const std::shared_ptr<simulation::CityScene>& WorldScene::scene() const {
  return impl_->scene;
}

std::uint64_t WorldScene::generation() const {
  return impl_->generation;
}

std::vector<std::string> WorldScene::take_notes() {
  return std::exchange(impl_->notes, {});
}

bool operator==(const HostOrigin& a, const HostOrigin& b) {
  return a.origin.latitude_rad == b.origin.latitude_rad && a.origin.longitude_rad == b.origin.longitude_rad &&
         a.origin.height_m == b.origin.height_m && a.heading_rad == b.heading_rad;
}

bool operator==(const WorldScene::Options& a, const WorldScene::Options& b) {
  return a.name == b.name && a.visual == b.visual && a.frame == b.frame && a.facades.mix == b.facades.mix &&
         a.facades.fractions == b.facades.fractions && a.facades.named == b.facades.named && a.seed == b.seed;
}

}  // namespace canyon::live
