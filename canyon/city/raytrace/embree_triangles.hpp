#pragma once

// Triangles by Embree, in floats; private to canyon/city/raytrace.

#include <Eigen/Core>
#include <algorithm>
#include <cassert>
#include <optional>
#include <stdexcept>
#include <string>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/city/raytrace/embree.hpp"

namespace canyon::raytrace {

/// Embree's device. AVX-512 is disabled: it rounds differently from AVX2 and is not faster, and a ray past an
/// edge must not depend on the processor. Embree's smaller triangle4i is not watertight.
struct Tracing {
  embree::Device device{rtcNewDevice("ignore_config_files=1,max_isa=avx2")};

  Tracing() {
    if (!device) throw std::runtime_error("Embree: no device");
  }
  [[nodiscard]] std::runtime_error failure(const char* what) const {
    return std::runtime_error("Embree: " + std::string(what) + " (error " +
                              std::to_string(static_cast<int>(rtcGetDeviceError(device.get()))) + ")");
  }
};

/// A ray with its origin relative to the centre of the triangles.
struct Probe {
  Probe() = default;
  Probe(const Eigen::Vector3d& origin, const Eigen::Vector3d& direction, double min_range_m,
        double max_range_m) {
    ray.org_x = static_cast<float>(origin.x());
    ray.org_y = static_cast<float>(origin.y());
    ray.org_z = static_cast<float>(origin.z());
    ray.tnear = static_cast<float>(min_range_m);
    ray.dir_x = static_cast<float>(direction.x());
    ray.dir_y = static_cast<float>(direction.y());
    ray.dir_z = static_cast<float>(direction.z());
    ray.time = 0;
    ray.tfar = static_cast<float>(max_range_m);
    ray.mask = 0xFFFFFFFFU;
    ray.id = 0;
    ray.flags = 0;
  }
  RTCRay ray;
};

/// Triangles of a mesh for ray queries; faster if all() is not needed.
class Triangles {
 public:
  struct TriangleHit {
    std::uint32_t triangle;
    double range;
  };

  Triangles() = default;
  Triangles(const Tracing& tracing, const city::Mesh& mesh, const Eigen::Vector3d& centre,
            bool requested_for_all)
      : scene_(rtcNewScene(tracing.device.get())) {
    if (!scene_) throw tracing.failure("no scene");
    int flags = RTC_SCENE_FLAG_ROBUST;
    if (requested_for_all) flags |= embree::kFilterSceneFlag;
    rtcSetSceneFlags(scene_.get(), static_cast<RTCSceneFlags>(flags));
    rtcSetSceneBuildQuality(scene_.get(), RTC_BUILD_QUALITY_HIGH);
    if (!mesh.triangles.empty()) attach(tracing, mesh, centre);
    rtcCommitScene(scene_.get());
    if (rtcGetDeviceError(tracing.device.get()) != RTC_ERROR_NONE) throw tracing.failure("scene not built");
  }

  [[nodiscard]] bool occluded(Probe& probe) const {
    embree::Query().occluded1(scene_.get(), &probe.ray);
    return probe.ray.tfar < 0;
  }
  [[nodiscard]] std::optional<TriangleHit> first(const Probe& probe) const {
    RTCRayHit hit;
    hit.ray = probe.ray;
    hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    embree::Query().intersect1(scene_.get(), &hit);
    if (hit.hit.geomID == RTC_INVALID_GEOMETRY_ID) return std::nullopt;
    return TriangleHit{hit.hit.primID, static_cast<double>(hit.ray.tfar)};
  }
  /// Every triangle on the ray; one that Embree has split may occur more than once.
  void all(const Probe& probe, std::vector<TriangleHit>& found) const {
    embree::Query query(
        [](const RTCFilterFunctionNArguments* arguments) {
          assert(arguments->N == 1);
          static_cast<std::vector<TriangleHit>*>(embree::Query::user(arguments))
              ->push_back({RTCHitN_primID(arguments->hit, 1, 0),
                           static_cast<double>(RTCRayN_tfar(arguments->ray, 1, 0))});
          arguments->valid[0] = 0;  // continue
        },
        &found);
    RTCRayHit hit;
    hit.ray = probe.ray;
    hit.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    query.intersect1(scene_.get(), &hit);
  }

 private:
  void attach(const Tracing& tracing, const city::Mesh& mesh, const Eigen::Vector3d& centre) {
    const RTCGeometry geometry = rtcNewGeometry(tracing.device.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* points = static_cast<float*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, 3 * sizeof(float), mesh.vertices.size()));
    auto* corners = static_cast<std::uint32_t*>(
        rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3,
                                3 * sizeof(std::uint32_t), mesh.triangles.size()));
    if (points == nullptr || corners == nullptr) {
      rtcReleaseGeometry(geometry);
      throw tracing.failure("no memory for the triangles");
    }
    for (const Eigen::Vector3d& v : mesh.vertices)
      for (int k = 0; k < 3; ++k) *points++ = static_cast<float>(v[k] - centre[k]);
    for (const auto& t : mesh.triangles) corners = std::copy(t.begin(), t.end(), corners);
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(scene_.get(), geometry, 0);
    rtcReleaseGeometry(geometry);
  }

  embree::Scene scene_;
};

}  // namespace canyon::raytrace
