#include "canyon/receiver/positioning/least_squares.hpp"

#include <gtest/gtest.h>

namespace canyon::positioning {
namespace {

TEST(Residual, IsThatOfTheSatelliteInASolvedFix) {
  using gnss::System;
  Fix fix;
  fix.status = FixStatus::Fix;
  fix.used = {{System::GPS, 3}, {System::GPS, 7}, {System::Galileo, 2}};
  fix.residuals_m = {0.5, -1.5};
  EXPECT_EQ(residual_m(fix, {System::GPS, 3}), 0.5);
  EXPECT_EQ(residual_m(fix, {System::GPS, 7}), -1.5);
  EXPECT_FALSE(residual_m(fix, {System::GPS, 5}).has_value()) << "not used";
  EXPECT_FALSE(residual_m(fix, {System::Galileo, 2}).has_value()) << "without a residual";
  fix.status = FixStatus::NotConverged;
  EXPECT_FALSE(residual_m(fix, {System::GPS, 3}).has_value()) << "not solved";
}

}  // namespace
}  // namespace canyon::positioning
