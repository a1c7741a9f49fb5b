#include "canyon/city/facades.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "tests/support/append_box.hpp"

namespace canyon::city {
namespace {

using ::testing::HasSubstr;
using ::testing::IsEmpty;

FacadeOptions of(FacadeMix mix) {
  FacadeOptions options;
  options.mix = mix;
  return options;
}

FacadeOptions of(std::map<std::string, double> fractions) {
  FacadeOptions options;
  options.fractions = std::move(fractions);
  return options;
}

// Boxes in a row, each a separate object.
City row_of_boxes(int count, Material material = Material::Unknown) {
  City city;
  for (int i = 0; i < count; ++i) {
    canyon::test::append_box(city.mesh, fmt::format("way/{}", i), Surface::Building, material,
                             {20.0 * i, 0, 0}, {20.0 * i + 10, 10, 30});
  }
  return city;
}

bool level(const Mesh& mesh, std::size_t t) {
  const auto& [a, b, c] = mesh.triangles[t];
  return mesh.vertices[a].z() == mesh.vertices[b].z() && mesh.vertices[a].z() == mesh.vertices[c].z();
}

// The material of an object's walls, which must have only one.
Material wall_material(const Mesh& mesh, const Object& object) {
  std::optional<Material> found;
  for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t) {
    if (level(mesh, t)) continue;
    if (found) {
      EXPECT_EQ(*found, mesh.materials[t]) << object.name;
    }
    found = mesh.materials[t];
  }
  return found.value();
}

TEST(Facades, AsGivenTouchesNothing) {
  City city = row_of_boxes(3, Material::Stone);
  EXPECT_EQ(assign_facades(city, of(FacadeMix::AsGiven), false, 1), "");
  EXPECT_EQ(city.mesh.materials, row_of_boxes(3, Material::Stone).mesh.materials);
}

TEST(Facades, ByDefaultAreThoseOfTheBuildingsHeight) {
  constexpr int kCount = 1000;
  City city;
  for (int i = 0; i < 2 * kCount; ++i) {
    canyon::test::append_box(city.mesh, fmt::format("way/{}", i), Surface::Building, Material::Unknown,
                             {20.0 * i, 0, 50}, {20.0 * i + 10, 10, i < kCount ? 60.0 : 110.0});
  }
  (void)assign_facades(city, {}, false, 1);
  std::array<int, 2> metal{};
  for (std::size_t i = 0; i < city.mesh.objects.size(); ++i) {
    metal.at(i / kCount) += wall_material(city.mesh, city.mesh.objects[i]) == Material::Metal;
  }
  EXPECT_EQ(metal[0], 0) << "10 m: traditional, whatever the ground's height";
  EXPECT_NEAR(metal[1], 0.14 * kCount, 4 * std::sqrt(0.14 * 0.86 * kCount)) << "60 m";
}

TEST(Facades, AMapsWordsOverrideTheHeight) {
  const auto metal = [](double height_m, FacadeMix named) {
    const std::map<std::string, double> fractions = facade_fractions({}, height_m, named);
    const auto coated = fractions.find("coated_glass");
    return coated != fractions.end() ? coated->second : 0;
  };
  EXPECT_EQ(metal(60, FacadeMix::Traditional), 0);
  EXPECT_EQ(metal(10, FacadeMix::ThermallyEfficient), 0.7);
  City city = row_of_boxes(1);
  city.mesh.objects.front().facades = FacadeMix::ThermallyEfficient;
  FacadeOptions stock = of(FacadeMix::Traditional);
  for (std::uint64_t seed = 0; seed < 20; ++seed) {
    City dressed = city;
    (void)assign_facades(dressed, stock, false, seed);
    EXPECT_NE(wall_material(dressed.mesh, dressed.mesh.objects.front()), Material::Metal)
        << "a mix that is set";
  }
}

// TR 38.901: 70 % of the high-loss facade are coated glazing; four standard deviations of a fraction of n
// samples, sqrt(p (1 - p) / n).
TEST(Facades, SharesAreThoseOfTheMix) {
  constexpr int kCount = 4000;
  City city = row_of_boxes(kCount);
  const std::string logged = assign_facades(city, of(FacadeMix::ThermallyEfficient), false, 1);
  int metal = 0, concrete = 0;
  for (const Object& object : city.mesh.objects) {
    const Material material = wall_material(city.mesh, object);
    metal += static_cast<int>(material == Material::Metal);
    concrete += static_cast<int>(material == Material::Concrete);
  }
  EXPECT_EQ(metal + concrete, kCount);
  EXPECT_NEAR(metal, 0.7 * kCount, 4 * std::sqrt(0.7 * 0.3 * kCount));
  EXPECT_EQ(logged, fmt::format("facades drawn: {} coated_glass, {} concrete", metal, concrete));
}

TEST(Facades, RoofsFloorsGroundAndVehiclesStay) {
  City city = row_of_boxes(2, Material::Brick);
  // A roof of 45 deg is not a wall, one of 80 deg is: a mansard.
  append_object(city.mesh, "roof", Surface::Building, Material::Brick, {{0, 50, 0}, {10, 50, 0}, {0, 60, 10}},
                {{0, 1, 2}});
  append_object(city.mesh, "mansard", Surface::Building, Material::Brick,
                {{0, 70, 0}, {10, 70, 0}, {0, 70 + 10 * std::cos(80 * M_PI / 180), 10}}, {{0, 1, 2}});
  canyon::test::append_box(city.mesh, "bus", Surface::Vehicle, Material::Glass, {0, 80, 0}, {10, 83, 3});
  canyon::test::append_box(city.mesh, "hill", Surface::Terrain, Material::Ground, {0, 100, 0}, {10, 110, 3});
  canyon::test::append_box(city.mesh, "oak", Surface::Foliage, Material::Foliage, {0, 120, 0}, {10, 130, 3});
  const std::string logged = assign_facades(city, of({{"metal", 1}}), false, 1);
  EXPECT_EQ(logged, "facades drawn: 3 metal");
  for (const Object& object : city.mesh.objects) {
    for (std::uint32_t t = object.first_triangle; t < object.first_triangle + object.triangle_count; ++t) {
      const bool wall = object.surface == Surface::Building && object.name != "roof" && !level(city.mesh, t);
      if (wall) {
        EXPECT_EQ(city.mesh.materials[t], Material::Metal) << object.name;
      } else {
        EXPECT_NE(city.mesh.materials[t], Material::Metal) << object.name;
      }
    }
  }
}

TEST(Facades, HangOnSeedAndNameAlone) {
  City whole = row_of_boxes(200);
  City again = row_of_boxes(200);
  City other = row_of_boxes(200);
  (void)assign_facades(whole, of(FacadeMix::EastAsia), false, 7);
  (void)assign_facades(again, of(FacadeMix::EastAsia), false, 7);
  (void)assign_facades(other, of(FacadeMix::EastAsia), false, 8);
  EXPECT_EQ(whole.mesh.materials, again.mesh.materials);
  EXPECT_NE(whole.mesh.materials, other.mesh.materials);
  // Only the last boxes, as in a smaller part of the map.
  City cut;
  for (int i = 150; i < 200; ++i) {
    canyon::test::append_box(cut.mesh, fmt::format("way/{}", i), Surface::Building, Material::Unknown,
                             {20.0 * i, 0, 0}, {20.0 * i + 10, 10, 30});
  }
  (void)assign_facades(cut, of(FacadeMix::EastAsia), false, 7);
  EXPECT_TRUE(
      std::equal(cut.mesh.materials.begin(), cut.mesh.materials.end(),
                 whole.mesh.materials.end() - static_cast<std::ptrdiff_t>(cut.mesh.materials.size())));
}

TEST(Facades, NamedOnesAreKeptWhereAsked) {
  City city = row_of_boxes(3);
  std::fill_n(city.mesh.materials.begin(), 12, Material::Stone);  // the first box, of 12 triangles
  City redrawn = city;
  EXPECT_EQ(assign_facades(city, of({{"metal", 1}}), true, 1),
            "facades drawn: 2 metal; 1 of 3 buildings keep theirs");
  EXPECT_EQ(wall_material(city.mesh, city.mesh.objects[0]), Material::Stone);
  EXPECT_EQ(wall_material(city.mesh, city.mesh.objects[1]), Material::Metal);
  EXPECT_EQ(assign_facades(redrawn, of({{"metal", 1}}), false, 1), "facades drawn: 3 metal");
  EXPECT_EQ(wall_material(redrawn.mesh, redrawn.mesh.objects[0]), Material::Metal);

  FacadeOptions options;
  EXPECT_TRUE(options.keeps_named(true));
  EXPECT_FALSE(options.keeps_named(false));
  options.named = FacadeOptions::Named::Keep;
  EXPECT_TRUE(options.keeps_named(false));
  options.named = FacadeOptions::Named::Redraw;
  EXPECT_FALSE(options.keeps_named(true));
}

// 400 boxes, none of which touches another, in one object.
TEST(Facades, PartsOfACityInOneObjectAreItsBuildings) {
  City city = row_of_boxes(400);
  const std::uint32_t all = static_cast<std::uint32_t>(city.mesh.triangles.size());
  const std::vector<Object> boxes = city.mesh.objects;
  city.mesh.objects = {{"city", Surface::Building, 0, all}};
  (void)assign_facades(city, of({{"brick", 0.5}, {"metal", 0.5}}), false, 3);
  int metal = 0;
  for (const Object& box : boxes) metal += static_cast<int>(wall_material(city.mesh, box) == Material::Metal);
  EXPECT_NEAR(metal, 200, 4 * std::sqrt(0.25 * 400));
}

TEST(Facades, SameNamesAreDifferentBuildings) {
  City city = row_of_boxes(64);
  for (Object& object : city.mesh.objects) object.name = "house";
  (void)assign_facades(city, of({{"brick", 0.5}, {"metal", 0.5}}), false, 1);
  const auto& m = city.mesh.materials;
  EXPECT_THAT(m, ::testing::Contains(Material::Brick));
  EXPECT_THAT(m, ::testing::Contains(Material::Metal));
}

TEST(Facades, EveryMixIsWhole) {
  const auto sum = [](const std::map<std::string, double>& fractions) {
    double all = 0;
    for (const auto& [name, fraction] : fractions) all += fraction;
    return all;
  };
  for (const FacadeMix mix : {FacadeMix::Traditional, FacadeMix::ThermallyEfficient, FacadeMix::UrbanStock,
                              FacadeMix::Europe, FacadeMix::EastAsia}) {
    EXPECT_NO_THROW(of(facade_fractions(of(mix))).validate()) << static_cast<int>(mix);
    EXPECT_NEAR(sum(facade_fractions(of(mix))), 1, 1e-12) << static_cast<int>(mix);
  }
  const auto own = facade_fractions(of({{"tile", 30}, {"metal", 10}}));
  EXPECT_NEAR(own.at("tile"), 0.75, 1e-12);
  EXPECT_NEAR(sum(own), 1, 1e-12);
  EXPECT_THAT(facade_fractions(of(FacadeMix::AsGiven)), IsEmpty());
  EXPECT_EQ(facade_fractions({}, 14.9), facade_fractions(of(FacadeMix::Traditional)));
  EXPECT_EQ(facade_fractions({}, 15), facade_fractions(of(FacadeMix::UrbanStock)));
  // One high-loss building in five (ITU-R M.2412): 0.2 x 0.7 coated, 0.8 x 0.3 plain glass.
  const auto stock = facade_fractions(of(FacadeMix::UrbanStock));
  EXPECT_NEAR(stock.at("coated_glass"), 0.2 * 0.7, 1e-12);
  EXPECT_NEAR(stock.at("glass"), 0.8 * 0.3, 1e-12);
  EXPECT_NEAR(stock.at("concrete"), 0.2 * 0.3 + 0.8 * 0.7, 1e-12);
}

TEST(Facades, WrongSharesAreRefused) {
  const auto problem = [](const FacadeOptions& options) -> std::string {
    try {
      options.validate();
    } catch (const InputError& error) {
      return error.problem() + " | " + error.hint();
    }
    return {};
  };
  EXPECT_THAT(problem(of({{"cheese", 1}})), HasSubstr("'cheese' are not known | write coated_glass, metal"));
  EXPECT_THAT(problem(of({{"metal", 0}, {"brick", 0}})), HasSubstr("all 0 | give at least one"));
  EXPECT_THAT(problem(of({{"metal", 2}, {"brick", -1}})), HasSubstr("fractions"));
  FacadeOptions both = of(FacadeMix::Europe);
  both.fractions = {{"metal", 1}};
  EXPECT_EQ(facade_fractions(both).size(), 1U) << "shares are instead of the mix";
  EXPECT_EQ(problem(of({{"metal", 0.1}, {"brick", 0.2}, {"tile", 0.7}})), "");
}

TEST(Facades, AnOpenFieldHasNone) {
  City city;
  EXPECT_EQ(assign_facades(city, of(FacadeMix::Europe), false, 1), "facades drawn: none");
}

}  // namespace
}  // namespace canyon::city
