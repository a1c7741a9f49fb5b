#include "canyon/outputs/drawing/views/sky_mask.hpp"

#include <tbb/parallel_for.h>

#include <algorithm>
#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"

namespace canyon::drawing {

namespace {

constexpr int kElevationSteps = 180;
constexpr double kElevationStep_rad = 0.5 * geodesy::kPi / kElevationSteps;
constexpr int kBisections = 5;

}  // namespace

bool SkyMask::hidden(double azimuth_rad, double elevation_rad) const {
  if (azimuths.empty()) return false;
  const double cycles = azimuth_rad / (2 * geodesy::kPi);
  const double sector = (cycles - std::floor(cycles)) * static_cast<double>(azimuths.size());
  const auto& stretches = azimuths[std::min(static_cast<std::size_t>(sector), azimuths.size() - 1)];
  return std::any_of(stretches.begin(), stretches.end(), [elevation_rad](const Stretch& s) {
    return elevation_rad >= s.low_rad && elevation_rad <= s.high_rad;
  });
}

double SkyMask::hidden_fraction() const {
  if (azimuths.empty()) return 0;
  double hidden = 0;  // area of a band of the unit sphere is proportional to sin(high) - sin(low)
  for (const auto& stretches : azimuths)
    for (const Stretch& s : stretches) hidden += std::sin(s.high_rad) - std::sin(s.low_rad);
  return hidden / static_cast<double>(azimuths.size());
}

SkyMask make_sky_mask(const raytrace::RayScene& scene, const Eigen::Vector3d& antenna_enu, int sectors) {
  SkyMask mask;
  mask.azimuths.resize(static_cast<std::size_t>(sectors));
  const auto look_angles = [&](int a) {
    auto& stretches = mask.azimuths[static_cast<std::size_t>(a)];
    const double azimuth = (a + 0.5) * 2 * geodesy::kPi / sectors;
    const auto hidden = [&](double elevation_rad) {
      raytrace::Ray ray;
      ray.origin = antenna_enu;
      ray.direction = geodesy::enu_from_azimuth_elevation(azimuth, elevation_rad);
      return scene.occluded(ray);
    };
    // The elevation between two others at which the sky changes from hidden to open, by bisection.
    const auto border = [&](double low, double high, bool hidden_at_low) {
      for (int i = 0; i < kBisections; ++i) {
        const double middle = 0.5 * (low + high);
        (hidden(middle) == hidden_at_low ? low : high) = middle;
      }
      return 0.5 * (low + high);
    };
    bool before = false;
    for (int e = 0; e < kElevationSteps; ++e) {
      const double elevation = (e + 0.5) * kElevationStep_rad;
      const bool now = hidden(elevation);
      if (now && !before)
        stretches.push_back(
            {e == 0 ? 0 : border(elevation - kElevationStep_rad, elevation, false), 0.5 * geodesy::kPi});
      else if (!now && before)
        stretches.back().high_rad = border(elevation - kElevationStep_rad, elevation, true);
      before = now;
    }
  };
  tbb::parallel_for(tbb::blocked_range<int>(0, sectors, 16),
                    [&look_angles](const tbb::blocked_range<int>& range) {
                      for (int a = range.begin(); a != range.end(); ++a) look_angles(a);
                    });
  return mask;
}

}  // namespace canyon::drawing
