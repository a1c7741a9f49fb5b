#include "canyon/city/buildings/sources/map_data.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "tests/support/refusal.hpp"

namespace canyon::buildings {
namespace {

using ::testing::HasSubstr;

std::string problem(const LonLatBox& box) {
  return test::refusal([&] { box.validate(); });
}

TEST(LonLatBox, ValidateNamesTheBound) {
  EXPECT_EQ(problem({}), "");
  EXPECT_EQ(problem({114.1, 22.2, 114.2, 22.3}), "");
  EXPECT_THAT(problem({-181, 0, 1, 1}), HasSubstr("west bound of the box is -181 deg"));
  EXPECT_THAT(problem({0, 0, 1, 91}), HasSubstr("north bound of the box is 91 deg"));
  EXPECT_THAT(problem({0, std::numeric_limits<double>::quiet_NaN(), 1, 1}), HasSubstr("south bound"));
  EXPECT_EQ(problem({179, 0, -179, 1}), "");
  EXPECT_NEAR((LonLatBox{179, 0, -179, 1}.unwrapped().east), 181, 0);
  EXPECT_THAT(problem({11.6, 48, 11.5, 49}),
              HasSubstr("west bound 11.6 of the box is east of its east bound"));
  EXPECT_THAT(problem({1, 5, 2, 4}), HasSubstr("south bound 5"));
  EXPECT_THAT(problem({1, 5, 1, 6}), HasSubstr("no width"));
}

}  // namespace
}  // namespace canyon::buildings
