// The power of paths without line of sight, by the surfaces of the path: a random walk backwards from the
// antenna. It checks independently which orders and combinations are worth tracing. Uses Tsim Sha Tsui if the
// shared data exist.
//
//   build-release/bin/signal_ways_bench [mix of facades] [scattering coefficient]

#include <fmt/format.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <random>
#include <string>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/facades.hpp"
#include "canyon/city/raytrace/ray_scene.hpp"
#include "canyon/paths/signal/radio_materials.hpp"
#include "tests/support/bench_city.hpp"

namespace {

using canyon::city::Mesh;
using Eigen::Vector3d;

constexpr double kPi = 3.14159265358979323846;
constexpr double kL1_hz = 1575.42e6;
constexpr int kRays = 20000, kMax = 6;

/// Fraction of power that a wall reflects, mean of both polarisations [1], by its material and whole degrees
/// of incidence.
double reflected_power(canyon::city::Material material, double incidence_rad) {
  static std::map<std::pair<int, int>, double> known;
  const int degrees = std::clamp(static_cast<int>(std::lround(incidence_rad * 180 / kPi)), 0, 89);
  const auto [at, fresh] = known.try_emplace({static_cast<int>(material), degrees}, 0.0);
  if (!fresh) return at->second;
  using namespace canyon::signal;
  const RadioMaterial m = radio_material(material);
  const auto eta = complex_permittivity(m, kL1_hz);
  const double theta = degrees * kPi / 180;
  const LinearReflection r = m.default_thickness_m > 0
                                 ? slab(eta, theta, m.default_thickness_m, wavelength_m(kL1_hz))
                                 : reflect_half_space(eta, theta);
  return at->second = (std::norm(r.perpendicular) + std::norm(r.parallel)) / 2;
}

}  // namespace

int main(int argc, char** argv) {
  canyon::bench::BenchCity bench = canyon::bench::bench_city();
  canyon::city::FacadeOptions facades;
  const std::string mix = argc > 1 ? argv[1] : "thermally_efficient";
  const double s = argc > 2 ? std::atof(argv[2]) : 0.4;
  if (mix == "thermally_efficient") facades.mix = canyon::city::FacadeMix::ThermallyEfficient;
  if (mix == "traditional") facades.mix = canyon::city::FacadeMix::Traditional;
  fmt::print("{}; {}\n", bench.city.name, canyon::city::assign_facades(bench.city, facades, false, 1));
  const Mesh& mesh = bench.city.mesh;
  std::vector<canyon::city::Surface> surfaces(mesh.triangles.size());
  for (const auto& object : mesh.objects)
    std::fill_n(surfaces.begin() + object.first_triangle, object.triangle_count, object.surface);
  const canyon::raytrace::RayScene scene{mesh};

  std::mt19937_64 random(1);
  std::uniform_real_distribution<double> uniform;
  const double low = std::sin(10 * kPi / 180);
  double hidden = 0;                    // solid angle of the sky above 10 deg, all points
  std::map<std::string, double> power;  // times solid angle; S: mirror, D: scatter, from the antenna on
  std::map<std::string, double> reached;
  for (std::size_t p = 0; p < bench.positions.size(); p += 10) {
    const Vector3d& antenna = bench.positions[p];
    for (int i = 0; i < kRays; ++i) {
      const double z = 2 * uniform(random) - 1, rotation = 2 * kPi * uniform(random),
                   across = std::sqrt(1 - z * z);
      Vector3d towards(across * std::cos(rotation), across * std::sin(rotation), z), from = antenna;
      double carried = 1;
      std::string routes;
      while (true) {
        const auto hit = scene.cast({from, towards}, scene.surface_offset_m(from));
        if (routes.empty() && hit && z > low) hidden += 1;
        if (!hit) {
          if (routes.empty() || towards.z() < low) break;
          if (!scene.occluded({antenna, towards}, scene.surface_offset_m(antenna))) break;
          power[routes] += carried;
          if (routes.find('D') == std::string::npos) reached[routes] += 1;
          break;
        }
        if (surfaces[hit->triangle] == canyon::city::Surface::Terrain || routes.size() == kMax) break;
        const Vector3d normal = hit->front ? hit->normal : Vector3d(-hit->normal);
        const double cosine = std::min(1.0, -normal.dot(towards));
        const Vector3d point = from + hit->range_m * towards;
        from = point + scene.surface_offset_m(point) * normal;
        carried *= reflected_power(mesh.materials[hit->triangle], std::acos(cosine));
        if (uniform(random) < s * s) {
          routes += 'D';
          const double u = uniform(random), v = 2 * kPi * uniform(random);
          const Vector3d x = normal.unitOrthogonal();
          towards =
              std::sqrt(u) * (std::cos(v) * x + std::sin(v) * normal.cross(x)) + std::sqrt(1 - u) * normal;
        } else {
          routes += 'S';
          towards += 2 * cosine * normal;
        }
        towards.normalize();
      }
    }
  }
  std::map<std::string, double> groups;
  double total = 0;
  for (const auto& [routes, sum] : power) {
    total += sum;
    const bool mirror = routes.find('D') == std::string::npos;
    const auto scattered = std::count(routes.begin(), routes.end(), 'D');
    groups[mirror               ? fmt::format("{} reflections", routes.size())
           : routes.size() == 1 ? "scatter"
           : scattered == 1     ? fmt::format("scatter and {} reflections", routes.size() - 1)
                                : fmt::format("{} scatters and more, {} in all", 2, routes.size())] += sum;
  }
  fmt::print("all: {:.1f} dB over the line of sight in the mean of the hidden sky above 10 deg\n",
             10 * std::log10(total / hidden));
  for (const auto& [name, sum] : groups)
    fmt::print("{:34} {:6.1f} dB {:5.1f} %\n", name, 10 * std::log10(sum / hidden), 100 * sum / total);
  for (const auto& [routes, count] : reached)
    fmt::print("{:6} paths to a hidden satellite: {:.3f}\n", routes, count / hidden);
}
