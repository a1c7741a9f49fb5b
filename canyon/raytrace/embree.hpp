#pragma once

// Embree 3 and 4 behind one set of names. Private to canyon/raytrace.

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

/// How a query is made: coherent rays or not, optionally a filter that sees every hit.
class Query {
 public:
  explicit Query(bool coherent, RTCFilterFunctionN filter = nullptr, void* user = nullptr) {
    rtcInitRayQueryContext(&context_.base);
    context_.user = user;
    flags_ = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
    if (filter != nullptr)
      flags_ = static_cast<RTCRayQueryFlags>(flags_ | RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER);
    filter_ = filter;
  }
  void intersect1(RTCScene scene, RTCRayHit* ray) {
    RTCIntersectArguments arguments;
    rtcInitIntersectArguments(&arguments);
    arguments.flags = flags_;
    arguments.context = &context_.base;
    arguments.filter = filter_;
    rtcIntersect1(scene, ray, &arguments);
  }
  void occluded1(RTCScene scene, RTCRay* ray) {
    RTCOccludedArguments arguments = occluded_arguments();
    rtcOccluded1(scene, ray, &arguments);
  }
  [[nodiscard]] static void* user(const RTCFilterFunctionNArguments* arguments) {
    return reinterpret_cast<const Context*>(arguments->context)->user;
  }

 private:
  struct Context {
    RTCRayQueryContext base;
    void* user;
  };
  [[nodiscard]] RTCOccludedArguments occluded_arguments() {
    RTCOccludedArguments arguments;
    rtcInitOccludedArguments(&arguments);
    arguments.flags = flags_;
    arguments.context = &context_.base;
    return arguments;
  }
  Context context_;
  RTCRayQueryFlags flags_;
  RTCFilterFunctionN filter_;
};

#else

inline constexpr RTCSceneFlags kFilterSceneFlag = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;

/// How a query is made: coherent rays or not, optionally a filter that sees every hit.
class Query {
 public:
  explicit Query(bool coherent, RTCFilterFunctionN filter = nullptr, void* user = nullptr) {
    rtcInitIntersectContext(&context_.base);
    context_.base.flags =
        coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
    context_.base.filter = filter;
    context_.user = user;
  }
  void intersect1(RTCScene scene, RTCRayHit* ray) { rtcIntersect1(scene, &context_.base, ray); }
  void occluded1(RTCScene scene, RTCRay* ray) { rtcOccluded1(scene, &context_.base, ray); }
  [[nodiscard]] static void* user(const RTCFilterFunctionNArguments* arguments) {
    return reinterpret_cast<const Context*>(arguments->context)->user;
  }

 private:
  struct Context {
    RTCIntersectContext base;
    void* user;
  };
  Context context_;
};

#endif

}  // namespace canyon::raytrace::embree
