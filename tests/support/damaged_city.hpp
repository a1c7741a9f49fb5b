#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "canyon/city/city.hpp"
#include "canyon/geodesy/frames.hpp"
#include "canyon/simulation/load_city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "tests/support/damages.hpp"
#include "tests/support/temporary_folder.hpp"

// A damaged city is the sound one, or within a metre of it, or a remark or an error says so.

namespace canyon::test {

/// A reader's remarks beside the city, without their numbers.
inline std::vector<std::string> remarks_of(const buildings::BuiltCity& built) {
  std::vector<std::string> remarks = built.report.cautions;
  remarks.insert(remarks.end(), built.city.notes.begin(), built.city.notes.end());
  for (std::string& line : remarks) std::erase_if(line, [](unsigned char c) { return std::isdigit(c) != 0; });
  std::sort(remarks.begin(), remarks.end());
  return remarks;
}

struct Measure {
  std::array<std::size_t, 4> objects{};  ///< of each surface
  std::array<double, 4> area{};
  std::vector<Eigen::Vector3d> corners;  ///< in ECEF
};

inline Measure measure(const city::City& city) {
  Measure m;
  std::set<std::array<long, 3>> seen;
  const city::Mesh& mesh = city.mesh;
  for (const city::Object& object : mesh.objects) {
    const auto kind = static_cast<std::size_t>(object.surface);
    ++m.objects[kind];
    for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t) {
      const auto& [a, b, c] = mesh.triangles[t];
      const Eigen::Vector3d twice =
          (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
      std::array<long, 3> middle{};
      const Eigen::Vector3d sum = mesh.vertices[a] + mesh.vertices[b] + mesh.vertices[c];
      for (std::size_t i = 0; i < 3; ++i) middle[i] = std::lround(100 * sum[static_cast<Eigen::Index>(i)]);
      // No ray meets a floor, and a triangle twice is one.
      if (twice.z() < -0.9 * twice.norm() || !seen.insert(middle).second) continue;
      m.area[kind] += 0.5 * twice.norm();
      if (object.surface == city::Surface::Terrain) continue;
      for (const std::uint32_t v : mesh.triangles[t])
        m.corners.push_back(city.frame.ecef_from_local(mesh.vertices[v]));
    }
  }
  return m;
}

inline double farthest(const std::vector<Eigen::Vector3d>& from, const std::vector<Eigen::Vector3d>& to) {
  double most = 0;
  for (const Eigen::Vector3d& a : from) {
    double least = 1e9;
    for (const Eigen::Vector3d& b : to) least = std::min(least, (a - b).squaredNorm());
    most = std::max(most, std::sqrt(least));
  }
  return most;
}

/// Reads damaged versions of the file of a city.
class DamagedCity {
 public:
  using Settings = std::function<simulation::CityConfig(const std::filesystem::path& file)>;

  /// @param settings of a file's city; city_config() of the file where there are none
  DamagedCity(std::string name, std::string text, Settings settings = {})
      : name_(std::move(name)), text_(std::move(text)), settings_(std::move(settings)) {
    const buildings::BuiltCity sound = read(text_);
    sound_ = measure(sound.city);
    remarks_ = remarks_of(sound);
  }

  DamageCounts run(std::size_t every) {
    return Damages(name_, text_, every, true).run([this](const std::string& text) { return judge(text); });
  }

 private:
  [[nodiscard]] Damages::Judgement judge(const std::string& text) const {
    const buildings::BuiltCity built = read(text);
    const Measure now = measure(built.city);
    const double moved_m =
        std::max(farthest(now.corners, sound_.corners), farthest(sound_.corners, now.corners));
    double area = 0;
    for (std::size_t i = 0; i < 4; ++i)
      area = std::max(area, std::abs(now.area[i] - sound_.area[i]) / std::max(1.0, sound_.area[i]));
    const bool like = now.objects == sound_.objects;
    if (like && moved_m < 0.001 && area < 1e-4) return {Outcome::Same, {}};
    if (like && moved_m < 1 && area < 0.01) return {Outcome::Noise, {}};
    if (remarks_of(built) != remarks_) return {Outcome::Said, {}};
    return {Outcome::Same,
            fmt::format("moved {:.1f} m, {} buildings, area {:.3f}", moved_m, now.objects[0], area)};
  }
  [[nodiscard]] buildings::BuiltCity read(const std::string& text) const {
    const auto path = folder_ / name_;
    std::ofstream(path, std::ios::binary) << text;
    return simulation::read_city(settings_ ? settings_(path) : simulation::city_config(path));
  }

  TemporaryFolder folder_;
  std::string name_, text_;
  Settings settings_;
  Measure sound_;
  std::vector<std::string> remarks_;
};

}  // namespace canyon::test
