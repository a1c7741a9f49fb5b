#include "canyon/simulation/samples/sample_file.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/base/json.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/simulator.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::samples::sample_file_test {
namespace {

simulation::Simulation simulate(double duration_s) {
  const simulation::Scenario scenario = simulation::parse_scenario(
      "city: {open: true, origin: {latitude_deg: 48, longitude_deg: 11, height_m: 500}}\n"
      "sky: {nominal: true, systems: [GPS]}\nstart: 2026-06-01T08:00:00Z\nrate_hz: 2\nduration_s: " +
          std::to_string(duration_s) +
          "\ntrajectory: {waypoints: [{east_m: 0, north_m: 0, up_m: 2}], hold_s: 10}\n"
          "receivers: [{name: rx, clock: {bias_s: 0, drift: 0, drift_walk: 0}, signal: {enabled: true}}]\n",
      "test.yaml");
  city::City city;
  city.frame = geodesy::LocalFrame(*scenario.city.origin);
  return {scenario, std::move(city)};
}

class SampleFiles : public testing::Test {
 protected:
  std::string made(const simulation::Simulation& simulation, SampleFileOptions options) {
    options.path = folder_ / "x.iq";
    SampleFile file(simulation, options);
    (void)simulation.run({&file});
    EXPECT_EQ(std::filesystem::file_size(options.path), file.expected_bytes());
    return test::read_bytes(options.path);
  }
  [[nodiscard]] Json metadata() const { return Json::parse(test::read_bytes(folder_ / "x.sigmf-meta")); }
  test::TemporaryFolder folder_;
};

TEST_F(SampleFiles, BitsSayWhatTheyAre) {
  const simulation::Simulation simulation = simulate(0.5);
  SampleFileOptions options;
  options.samples.format = Format::TwoBit;
  options.samples.rate_hz = 2.048001e6;  // samples that fill no byte
  const std::string bytes = made(simulation, options);
  EXPECT_EQ(bytes.size(), (1'024'001U * 4 + 7) / 8);
  std::size_t large = 0;
  for (const char byte : bytes) {
    for (int shift = 0; shift < 8; shift += 2) {
      const int code = byte >> shift & 3;
      large += code == 1 || code == 2 ? 1 : 0;
    }
  }
  // Beyond one deviation: 31.7 % of the noise alone, and a little more with the satellites.
  const double fraction = static_cast<double>(large) / (4.0 * static_cast<double>(bytes.size()));
  EXPECT_GT(fraction, 0.317);
  EXPECT_LT(fraction, 0.345);
  const Json meta = metadata();
  EXPECT_EQ(meta["global"]["core:datatype"], "ru8");
  EXPECT_EQ(meta["global"]["canyon:bits"], 2);
  EXPECT_EQ(meta["global"]["canyon:parts"], 2);
  EXPECT_EQ(meta["global"]["core:extensions"][0]["optional"], false);
}

TEST_F(SampleFiles, RealOnesHaveTheirFrequencyAt0Hz) {
  const simulation::Simulation simulation = simulate(0.5);
  SampleFileOptions options;
  options.samples.real = true;
  options.samples.intermediate_hz = 1e6;
  EXPECT_EQ(made(simulation, options).size(), 2'000'000U);
  const Json meta = metadata();
  EXPECT_EQ(meta["global"]["core:datatype"], "ri8");
  EXPECT_EQ(meta["captures"][0]["core:frequency"], gnss::kL1_hz - 1e6);
  EXPECT_FALSE(meta["global"].contains("core:extensions"));
}

TEST_F(SampleFiles, RefusesLevelsOfASignAndBandsThatFoldBack) {
  const simulation::Simulation simulation = simulate(0.5);
  SampleFileOptions options;
  options.path = folder_ / "x.iq";
  options.samples.format = Format::OneBit;
  EXPECT_NO_THROW(SampleFile(simulation, options));
  options.samples.noise_level = 0.5;
  EXPECT_THROW(SampleFile(simulation, options), InputError);
  options.samples.format = Format::TwoBit;
  EXPECT_NO_THROW(SampleFile(simulation, options));
  options = {};
  options.path = folder_ / "x.iq";
  options.samples.real = true;
  for (const double hz : {0.2e6, 1.8e6}) {
    options.samples.intermediate_hz = hz;
    try {
      (void)SampleFile(simulation, options);
      ADD_FAILURE() << hz;
    } catch (const InputError& error) {
      EXPECT_NE(error.hint().find("now 1000000"), std::string::npos) << error.what();
    }
  }
}

}  // namespace
}  // namespace canyon::samples::sample_file_test
