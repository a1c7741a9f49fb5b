#include "canyon/validation/city_agreement.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/synthetic_city.hpp"
#include "canyon/geodesy/constants.hpp"

namespace canyon::validation {
namespace {

using ::testing::HasSubstr;

/// A wall of 20 km from west to east, 10 m north of latitude 48, longitude 11 deg.
city::City wall(double height_m) {
  city::City city;
  city.frame = geodesy::LocalFrame(geodesy::Geodetic::from_degrees(48, 11, 0));
  append_box(city.mesh, "wall", city::Surface::Building, city::Material::Concrete, {-1e4, 10, 0},
             {1e4, 11, height_m});
  return city;
}

CityAgreementOptions at_the_wall() {
  CityAgreementOptions options;
  options.bbox_deg = {{10.9999999, 47.9999999, 11.0000001, 48.0000001}};
  options.places = 1;
  options.directions = 100'000;
  options.mask_deg = 0;
  options.height_m = 2;
  return options;
}

std::string refusal(const std::vector<city::City>& cities, const CityAgreementOptions& options) {
  try {
    (void)compare_cities(cities, options);
  } catch (const InputError& error) {
    return error.what();
  }
  return "nothing is refused";
}

// A long wall hides a lune of the sky: of its angle a, 2 a of the hemisphere's 2 pi. Of 100,000 directions
// those that the lune's edge parts are some hundred.
TEST(CityAgreement, WallsHideLunes) {
  using geodesy::kPi;
  const std::vector<city::City> cities{wall(12), wall(7)};
  const CityAgreement found = compare_cities(cities, at_the_wall());
  const double high = std::atan2(10, 10), low = std::atan2(5, 10);
  EXPECT_NEAR(found.cities[0].open, 1 - high / kPi, 1e-3);
  EXPECT_NEAR(found.cities[1].open, 1 - low / kPi, 1e-3);
  ASSERT_EQ(found.pairs.size(), 1U);
  EXPECT_NEAR(found.pairs[0].agree, 1 - (high - low) / kPi, 1e-3);
  EXPECT_NEAR(found.pairs[0].agree_p05, found.pairs[0].agree, 1e-12);
  EXPECT_NEAR(found.pairs[0].hidden_by_both, low / high, 3e-3);
}

TEST(CityAgreement, TheSameCityAboutAnotherOriginAgrees) {
  city::SyntheticCityOptions some;
  some.blocks_east = some.blocks_north = 2;
  std::vector<city::City> cities{city::synthetic_city(some), city::synthetic_city(some)};
  geodesy::Geodetic origin = some.origin;
  origin.longitude_rad += geodesy::radians(0.02);
  origin.height_m += 30;
  city::City& moved = cities[1];
  const geodesy::LocalFrame frame(origin);
  for (Eigen::Vector3d& v : moved.mesh.vertices) v = frame.local_from_ecef(moved.frame.ecef_from_local(v));
  moved.frame = frame;
  CityAgreementOptions options;
  options.places = 50;
  EXPECT_GT(compare_cities(cities, options).pairs[0].agree, 0.9995);
}

TEST(CityAgreement, PlacesAreOutdoorsInEachCity) {
  city::SyntheticCityOptions some;
  some.blocks_east = some.blocks_north = 2;
  city::SyntheticCityOptions other = some;
  other.seed = some.seed + 1;
  const std::vector<city::City> cities{city::synthetic_city(some), city::synthetic_city(other),
                                       city::synthetic_city(some)};
  CityAgreementOptions options;
  options.places = 20;
  options.directions = 100;
  const CityAgreement found = compare_cities(cities, options);
  EXPECT_EQ(found.places, 20U);
  ASSERT_EQ(found.pairs.size(), 3U);
  EXPECT_GT(found.cities[0].inside, 0.2);
  EXPECT_LT(found.cities[0].inside, 0.8);
  EXPECT_LT(found.pairs[0].agree, 0.99);
  EXPECT_EQ(found.pairs[1].second, 2U);
  EXPECT_DOUBLE_EQ(found.pairs[1].agree, 1);
  EXPECT_DOUBLE_EQ(found.pairs[1].hidden_by_both, 1);
}

TEST(CityAgreement, CitiesOfDifferentPlacesAreRefused) {
  city::City elsewhere = wall(12);
  elsewhere.frame = geodesy::LocalFrame(geodesy::Geodetic::from_degrees(50, 11, 0));
  EXPECT_THAT(refusal({wall(12), elsewhere}, CityAgreementOptions{}),
              HasSubstr("has no buildings where the cities before"));
  CityAgreementOptions options = at_the_wall();
  options.bbox_deg = {{12, 48, 12.1, 48.1}};
  EXPECT_THAT(refusal({wall(12), wall(7)}, options), HasSubstr("has no buildings where the box is"));
  options = at_the_wall();
  options.places = 0;
  EXPECT_THAT(refusal({wall(12), wall(7)}, options), HasSubstr("places"));
}

}  // namespace
}  // namespace canyon::validation
