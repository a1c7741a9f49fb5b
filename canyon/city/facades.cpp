#include "canyon/city/facades.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/base/options/visitor.hpp"
#include "canyon/base/random.hpp"
#include "canyon/city/building_samples.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/mesh_topology.hpp"

namespace canyon::city {
namespace {

/// The electrical kind of a facade at L band: a word of FacadeOptions::shares. Coated glass (low-emissivity,
/// solar control) has a metal film and is therefore Material::Metal; tile is a thin layer on reinforced
/// concrete, render is one on brickwork.
struct FacadeType {
  std::string_view name;
  Material material;
};
constexpr std::array<FacadeType, 9> kTypes{{{"coated_glass", Material::Metal},
                                            {"metal", Material::Metal},
                                            {"glass", Material::Glass},
                                            {"concrete", Material::Concrete},
                                            {"tile", Material::Concrete},
                                            {"brick", Material::Brick},
                                            {"render", Material::Brick},
                                            {"stone", Material::Stone},
                                            {"wood", Material::Wood}}};

constexpr double kSteepest_cos = 0.5;  // of a roof, 60 deg

const FacadeType& draw(const std::map<std::string, double>& fractions, double uniform) {
  double sum = 0;
  const FacadeType* last = nullptr;
  for (const FacadeType& type : kTypes) {
    const auto fraction = fractions.find(std::string(type.name));
    if (fraction == fractions.end() || fraction->second == 0) continue;
    last = &type;
    sum += fraction->second;
    if (uniform < sum) break;
  }
  return *last;  // the fractions add up to 1
}

// Assumed; docs/results.md compares it with recordings.
constexpr double kLow_m = 15;

FacadeMix mix_of(FacadeMix mix, double height_m, FacadeMix named) {
  if (mix != FacadeMix::ByBuilding) return mix;
  if (named != FacadeMix::ByBuilding) return named;
  return height_m < kLow_m ? FacadeMix::Traditional : FacadeMix::UrbanStock;
}

}  // namespace

void FacadeOptions::validate() const {
  options::check(*this, "facades");
  if (fractions.empty()) return;
  double sum = 0;
  std::vector<std::string> names;
  std::transform(kTypes.begin(), kTypes.end(), std::back_inserter(names),
                 [](const FacadeType& type) { return std::string(type.name); });
  for (const auto& [name, fraction] : fractions) {
    if (std::find(names.begin(), names.end(), name) == names.end()) {
      throw InputError(fmt::format("facades of '{}' are not known", name),
                       fmt::format("write {}", fmt::join(names, ", ")));
    }
    sum += fraction;
  }
  if (!(sum > 0)) throw InputError("the weights of the facades are all 0", "give at least one above 0");
}

void visit(options::Visitor& v, FacadeOptions& o) {
  static constexpr std::string_view kMixes[]{"as_given", "traditional", "thermally_efficient", "urban_stock",
                                             "europe",   "east_asia",   "by_building"};
  static constexpr std::string_view kNamed[]{"by_source", "keep", "redraw"};
  v.choice({"mix", "",
            "mix from which the facades of each building are sampled: by_building (by its tags and height), "
            "traditional, thermally_efficient, urban_stock, europe, east_asia; as_given samples nothing"},
           o.mix, kMixes);
  v.named_numbers({"fractions", "",
                   "weights of facade types instead of a mix, normalised by their sum: [coated_glass=30, "
                   "concrete=50, brick=20]"},
                  o.fractions, {0, 100}, "FACADE=SHARE");
  v.former_name("shares", "fractions");
  v.choice({"named", "",
            "materials named by the source: by_source keeps a map's tags and resamples a mesh's names of "
            "textures; keep; redraw"},
           o.named, kNamed);
}

std::map<std::string, double> facade_fractions(const FacadeOptions& options, double height_m,
                                               FacadeMix named) {
  if (!options.fractions.empty()) {
    double sum = 0;
    for (const auto& [name, fraction] : options.fractions) sum += fraction;
    std::map<std::string, double> fractions = options.fractions;
    for (auto& [name, fraction] : fractions) fraction /= sum;
    return fractions;
  }
  switch (mix_of(options.mix, height_m, named)) {
    case FacadeMix::AsGiven:
    case FacadeMix::ByBuilding:
      break;
    case FacadeMix::Traditional:
      return {{"glass", 0.3}, {"concrete", 0.7}};
    case FacadeMix::ThermallyEfficient:
      return {{"coated_glass", 0.7}, {"concrete", 0.3}};
    case FacadeMix::UrbanStock:
      return {{"glass", 0.24}, {"concrete", 0.62}, {"coated_glass", 0.14}};
    case FacadeMix::Europe:
      return {{"render", 0.35}, {"brick", 0.15},        {"stone", 0.15}, {"concrete", 0.10},
              {"glass", 0.10},  {"coated_glass", 0.10}, {"metal", 0.05}};
    case FacadeMix::EastAsia:
      return {{"tile", 0.45},  {"coated_glass", 0.20}, {"concrete", 0.10},
              {"glass", 0.10}, {"metal", 0.10},        {"stone", 0.05}};
  }
  return {};
}

std::string assign_facades(City& city, const FacadeOptions& options, bool keep_named, std::uint64_t seed) {
  options.validate();
  if (!options.is_sampled()) return {};
  Mesh& mesh = city.mesh;
  std::array<std::size_t, kTypes.size()> counts{};
  std::size_t kept = 0, buildings = 0;
  for (const Building& building : buildings_of(mesh)) {
    const Box box = bounds_of(mesh, building);
    const FacadeType& type = draw(facade_fractions(options, box.max.z() - box.min.z(), building.facades),
                                  RandomStream(seed, "facades/" + building.key).uniform());
    std::size_t walls = 0, dressed = 0;
    for (const std::uint32_t triangle : building.triangles) {
      const Eigen::Vector3d normal = normal_of(mesh.vertices, mesh.triangles[triangle]);
      if (!(std::abs(normal.z()) <= kSteepest_cos * normal.norm())) continue;  // not a wall
      ++walls;
      Material& material = mesh.materials[triangle];
      if (keep_named && material != Material::Unknown) continue;
      material = type.material;
      ++dressed;
    }
    if (walls == 0) continue;
    ++buildings;
    if (dressed > 0)
      ++counts.at(static_cast<std::size_t>(&type - kTypes.data()));
    else
      ++kept;
  }
  std::vector<std::string> logged;
  for (std::size_t i = 0; i < kTypes.size(); ++i)
    if (counts.at(i) > 0) logged.push_back(fmt::format("{} {}", counts.at(i), kTypes.at(i).name));
  std::string text =
      fmt::format("facades drawn: {}", logged.empty() ? "none" : fmt::to_string(fmt::join(logged, ", ")));
  if (kept > 0) text += fmt::format("; {} of {} buildings keep theirs", kept, buildings);
  return text;
}

}  // namespace canyon::city
