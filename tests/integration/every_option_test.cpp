#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/city/buildings/sources/overpass.hpp"
#include "canyon/io.hpp"
#include "canyon/paths/disturbance/faults/receiver_faults.hpp"
#include "canyon/paths/disturbance/faults/satellite_faults.hpp"
#include "tests/support/option_values.hpp"
#include "tests/support/simulation_support.hpp"

// Every struct of options that has a list of fields. Scenarios check theirs again, by their own readers
// (canyon/simulation/scenario/scenario_keys_test.cpp), and the key of a heat map's store those that it
// depends on, its Request's among them (canyon/analysis/heatmap/engine/engine_key_test.cpp).

namespace canyon {
namespace {

using ::testing::StartsWith;

template <typename Options>
class EveryOption : public ::testing::Test {};

using Lists = ::testing::Types<
    buildings::BuildOptions, buildings::HeightDefaults, buildings::OverpassOptions, buildings::TerrainOptions,
    city::FacadeOptions, city::GazeboOptions, city::MeshImportOptions, city::SyntheticCityOptions,
    disturbance::AntennaFaultOptions, disturbance::DateOptions, disturbance::EphemerisOptions,
    disturbance::OscillatorOptions, disturbance::OutageOptions, disturbance::RestartOptions,
    disturbance::ScintillationOptions, disturbance::ShadowingOptions, drawing::SkySheet,
    drawing::SkyplotOptions, heatmap::MonteCarloOptions, heatmap::Grid, heatmap::RouteOptions,
    positioning::FixOptions, positioning::PositionFilterOptions, positioning::RaimOptions,
    positioning::WeightOptions, propagation::DiffractionOptions, propagation::DiffuseOptions,
    propagation::PropagationOptions, receiver::NoiseOptions, receiver::ReceiverOptions,
    signal::LinkBudgetOptions, signal::StrengthOptions, tracking::ClockOptions, tracking::DllOptions,
    tracking::FllOptions, tracking::OuOptions, tracking::PllOptions, tracking::SignalLockOptions,
    tracking::SignalOptions, validation::AlignOptions>;
TYPED_TEST_SUITE(EveryOption, Lists);

TYPED_TEST(EveryOption, IsRefusedOutsideItsRangeAndToldApart) {
  options::Document document;
  document.file = "o.yaml";
  const options::Description description = options::describe<TypeParam>();
  document.known = description.paths();
  EXPECT_FALSE(description.keys.empty());
  const std::string plain = options::exact_text(TypeParam());
  const auto read = [&](const options::Key& key, const std::string& value) {
    TypeParam result;
    options::read(options::parse_yaml("\n" + test::nested(key.path, value) + "\n", document, ""), document,
                  result);
    return options::exact_text(result);
  };
  for (const options::Key& key : description.keys) {
    for (const std::string& bad : test::bad_values(key)) {
      const InputError error = simulation::test::error_of([&] { (void)read(key, bad); });
      EXPECT_EQ(error.file(), "o.yaml") << key.path << ": " << error.what();
      EXPECT_EQ(error.line(), 2) << key.path << ": " << error.what();
      EXPECT_THAT(error.problem(), StartsWith(key.path.substr(key.path.rfind('.') + 1) + ": ")) << bad;
      EXPECT_NE(error.hint(), "") << key.path << ": " << error.what();
    }
    const std::string value = test::another_value(key);
    EXPECT_NE(read(key, value), plain) << key.path << ": " << value;
  }
}

}  // namespace
}  // namespace canyon
