#pragma once

#include <algorithm>

#include "canyon/city/city.hpp"
#include "canyon/city/raytrace/embree.hpp"

namespace canyon::bench {

/// Direct use of Embree alone: a robust scene of a mesh, in floats.
struct BareScene {
  explicit BareScene(const city::Mesh& mesh) {
    device.reset(rtcNewDevice(nullptr));
    scene.reset(rtcNewScene(device.get()));
    rtcSetSceneFlags(scene.get(), RTC_SCENE_FLAG_ROBUST);
    const RTCGeometry geometry = rtcNewGeometry(device.get(), RTC_GEOMETRY_TYPE_TRIANGLE);
    auto* points = static_cast<float*>(rtcSetNewGeometryBuffer(geometry, RTC_BUFFER_TYPE_VERTEX, 0,
                                                               RTC_FORMAT_FLOAT3, 12, mesh.vertices.size()));
    auto* corners = static_cast<unsigned*>(rtcSetNewGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, 12, mesh.triangles.size()));
    for (const Eigen::Vector3d& v : mesh.vertices) {
      for (int k = 0; k < 3; ++k) *points++ = static_cast<float>(v[k]);
    }
    for (const auto& t : mesh.triangles) corners = std::copy(t.begin(), t.end(), corners);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene.get(), geometry);
    rtcReleaseGeometry(geometry);
    rtcCommitScene(scene.get());
  }

  raytrace::embree::Device device;
  raytrace::embree::Scene scene;
};

}  // namespace canyon::bench
