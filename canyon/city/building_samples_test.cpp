#include "canyon/city/building_samples.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <vector>

#include "canyon/city/city.hpp"
#include "tests/support/append_box.hpp"

namespace canyon::city {
namespace {

using testing::HasSubstr;

City rows_of_houses(int count) {
  City city;
  for (int i = 0; i < count; ++i) {
    canyon::test::append_box(city.mesh, "house", Surface::Building, Material::Concrete, {30.0 * i, 0, 5},
                             {30.0 * i + 20, 10, 25});
  }
  canyon::test::append_box(city.mesh, "bus", Surface::Vehicle, Material::Metal, {0, -20, 5}, {12, -17, 8});
  return city;
}

/// Height of each building's top above its base [m].
std::vector<double> heights(const City& city) {
  std::vector<double> found;
  for (const Building& building : buildings_of(city.mesh)) {
    const Box box = bounds_of(city.mesh, building);
    EXPECT_EQ(box.min.z(), 5);
    found.push_back(box.max.z() - box.min.z());
  }
  return found;
}

TEST(Roofs, RiseByTheirDistribution) {
  City city = rows_of_houses(2000);
  const Box bus = bounds_of(city.mesh, {"", FacadeMix::ByBuilding, {2000 * 12}});
  EXPECT_THAT(raise_roofs(city, 6, 1), HasSubstr("(2000 buildings)"));
  double sum = 0, square = 0;
  for (const double height : heights(city)) {
    EXPECT_GE(height, 20);
    sum += height - 20;
    square += (height - 20) * (height - 20);
  }
  const double mean = sum / 2000;
  EXPECT_NEAR(mean, 6, 0.3);
  EXPECT_NEAR(square / 2000 - mean * mean, 18, 3);  // gamma, shape 2: mean squared over 2
  EXPECT_EQ(bounds_of(city.mesh, {"", FacadeMix::ByBuilding, {2000 * 12}}).max, bus.max);
}

TEST(Roofs, DependOnSeedAndBuildingAlone) {
  City one = rows_of_houses(5), again = rows_of_houses(9), other = rows_of_houses(5),
       none = rows_of_houses(5);
  (void)raise_roofs(one, 6, 1);
  (void)raise_roofs(again, 6, 1);
  (void)raise_roofs(other, 6, 2);
  EXPECT_EQ(raise_roofs(none, 0, 1), "");
  for (std::size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(heights(one)[i], heights(again)[i]);
    EXPECT_NE(heights(one)[i], heights(other)[i]);
    EXPECT_EQ(heights(none)[i], 20);
  }
}

}  // namespace
}  // namespace canyon::city
