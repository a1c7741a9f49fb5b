#include "canyon/paths/signal/radio_materials.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::signal {
namespace {

using geodesy::radians;

TEST(Foliage, WoodlandSaturatesAtTheTablesMaximum) {
  const auto loss = [](double depth, double mhz) {
    return foliage_loss_db(FoliageModel::Woodland, depth, mhz * 1e6, 0.5);
  };
  // Rows of P.833-9's table: slope gamma at the rim, A_m deep inside.
  EXPECT_NEAR(loss(1e-6, 949) / 1e-6, 0.17, 1e-6);
  EXPECT_NEAR(loss(1e5, 949), 26.5, 1e-9);
  EXPECT_NEAR(loss(1e-6, 1852.2) / 1e-6, 0.30, 1e-6);
  EXPECT_NEAR(loss(1e5, 2117.5), 34.1, 1e-9);
  EXPECT_NEAR(loss(1e5, 105.9), 9.4, 1e-9);
  // python3: t = log(1575.42/949)/log(1852.2/949); g = .17*(.3/.17)**t; A = 26.5*(29/26.5)**t;
  // A*(1-exp(-10*g/A)) -> 2.4978
  EXPECT_NEAR(loss(10, 1575.42), 2.4978, 5e-5);
  EXPECT_EQ(loss(0, 1575.42), 0);
}

TEST(Foliage, SlantPathIsThePowerLaw) {
  const auto loss = [](double depth, double deg) {
    return foliage_loss_db(FoliageModel::SlantPath, depth, 1575.42e6, radians(deg));
  };
  // python3 -c "print(.25*1575.42**.39*10**.25*30**.05)"
  EXPECT_NEAR(loss(10, 30), 9.3064, 5e-5);
  EXPECT_NEAR(loss(160, 30) / loss(10, 30), 2, 1e-12);
  EXPECT_EQ(loss(5, -3), loss(5, 1));
  EXPECT_EQ(loss(0, 30), 0);
}

TEST(Foliage, RefusesWhatIsOutOfRange) {
  EXPECT_THROW(static_cast<void>(foliage_loss_db(FoliageModel::Woodland, -1, 1.5e9, 0)), InputError);
  EXPECT_THROW(static_cast<void>(foliage_loss_db(FoliageModel::Woodland, 1, 1.5e10, 0)), InputError);
  EXPECT_THROW(static_cast<void>(foliage_loss_db(FoliageModel::Woodland, 1, 1.5e9, 2)), InputError);
}

}  // namespace
}  // namespace canyon::signal
