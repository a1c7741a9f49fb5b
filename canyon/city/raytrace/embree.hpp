#pragma once

// Common names for Embree 3 and 4. Private to canyon/raytrace.

#if __has_include(<embree4/rtcore.h>)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

#include <memory>
#include <type_traits>

namespace canyon::raytrace::embree {

struct ReleaseDevice {
  void operator()(RTCDevice device) const { rtcReleaseDevice(device); }
};
struct ReleaseScene {
  void operator()(RTCScene scene) const { rtcReleaseScene(scene); }
};
using Device = std::unique_ptr<std::remove_pointer_t<RTCDevice>, ReleaseDevice>;
using Scene = std::unique_ptr<std::remove_pointer_t<RTCScene>, ReleaseScene>;

#if RTC_VERSION_MAJOR >= 4
inline constexpr RTCSceneFlags kFilterSceneFlag = RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS;
using QueryContext = RTCRayQueryContext;
#else
inline constexpr RTCSceneFlags kFilterSceneFlag = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;
using QueryContext = RTCIntersectContext;
#endif

/// The arguments of a query, optionally with a filter called for every hit.
class Query {
 public:
#if RTC_VERSION_MAJOR >= 4
  explicit Query(RTCFilterFunctionN filter = nullptr, void* user = nullptr) : filter_(filter) {
    rtcInitRayQueryContext(&context_.base);
    context_.user = user;
  }
  void intersect1(RTCScene scene, RTCRayHit* ray) {
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    if (filter_ != nullptr) arguments.flags = RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER;
    arguments.context = &context_.base;
    arguments.filter = filter_;
    rtcIntersect1(scene, ray, &arguments);
  }
  void occluded1(RTCScene scene, RTCRay* ray) {
    RTCOccludedArguments arguments;
    rtcInitOccludedArguments(&arguments);
    arguments.context = &context_.base;
    rtcOccluded1(scene, ray, &arguments);
  }
#else
  explicit Query(RTCFilterFunctionN filter = nullptr, void* user = nullptr) {
    rtcInitIntersectContext(&context_.base);
    context_.base.filter = filter;
    context_.user = user;
  }
  void intersect1(RTCScene scene, RTCRayHit* ray) {
    rtcIntersect1(scene, &context_.base, ray);
  }
  void occluded1(RTCScene scene, RTCRay* ray) {
    rtcOccluded1(scene, &context_.base, ray);
  }
#endif
  [[nodiscard]] static void* user(const RTCFilterFunctionNArguments* arguments) {
    return reinterpret_cast<const Context*>(arguments->context)->user;
  }

 private:
  struct Context {
    QueryContext base;
    void* user;
  };
  Context context_;
#if RTC_VERSION_MAJOR >= 4
  RTCFilterFunctionN filter_;
#endif
};

}  // namespace canyon::raytrace::embree
