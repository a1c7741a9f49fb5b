#include "canyon/simulation/scenario/scenario.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <set>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/city/city.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/simulation_support.hpp"
#include "tests/support/source_dir.hpp"

namespace canyon::simulation::scenario_test {
namespace {

using canyon::test::read_bytes;
using geodesy::degrees;
using geodesy::GpsTime;
using geodesy::radians;
using test::error_of;
using test::TemporaryFolder;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::StartsWith;

const std::filesystem::path kSource = canyon_source_dir;

// The message for a scenario of this text, starting with its name.
std::string fault(const std::string& text) {
  std::string what = error_of([&] { (void)parse_scenario(text, "s.yaml"); }).what();
  EXPECT_THAT(what, StartsWith("s.yaml"));
  return what;
}

const std::string kCity = "city: {synthetic: {}}\n";
const std::string kPosition =
    "start: 2026-06-01T12:00:00Z\ntrajectory: {position: {east_m: 1, north_m: 2, up_m: 3}}\n";
const std::string kMinimal = kCity + kPosition;

// The issue's example, word for word.
const std::string kIssueExample = R"(city:
  mesh: hongkong/buildings.dae
  origin: {latitude_deg: 22.298251, longitude_deg: 114.178761, height_m: 0}
  offset: {east_m: 0, north_m: 8, up_m: 0}      # moves the city in its ENU frame
sky:
  navigation: [urbannav-tst-20190428/hksc1180.19n, urbannav-tst-20190428/hksc1180.19b]
  systems: [GPS, BeiDou]                        # also GLONASS, Galileo, QZSS, SBAS
  # allow_stale: true                           # older ephemerides than their system allows
trajectory:
  file: urbannav-tst-20190428/groundTruth_TST.csv
  format: urbannav                              # week, tow, latitude, longitude, height
  height_above_terrain_m: 2.0                   # clamps; default: the file's ellipsoidal heights
receivers:
  - name: rover
    profile: paper                              # anything below overrides it
    elevation_mask_deg: 10
propagation: {model: specular}                  # or mirror
noise: {enabled: true}
seed: 1
)";

// A folder with the files that kIssueExample names, all empty.
struct IssueFolder {
  IssueFolder() {
    std::filesystem::create_directories(folder / "hongkong");
    std::filesystem::create_directories(folder / "urbannav-tst-20190428");
    (void)folder.write("hongkong/buildings.dae", "");
    for (const char* name : {"hksc1180.19n", "hksc1180.19b", "groundTruth_TST.csv"}) {
      (void)folder.write(std::string("urbannav-tst-20190428/") + name, "");
    }
  }
  TemporaryFolder folder;
};

TEST(Scenario, ReadsTheExampleAsItStands) {
  const IssueFolder data;
  const Scenario s = read_scenario(data.folder.write("scenario.yaml", kIssueExample));
  EXPECT_EQ(s.city.as<MeshCity>()->path, data.folder / "hongkong/buildings.dae");
  EXPECT_NEAR(degrees(s.city.origin->latitude_rad), 22.298251, 1e-12);
  EXPECT_NEAR(degrees(s.city.origin->longitude_rad), 114.178761, 1e-12);
  EXPECT_EQ(s.city.as<MeshCity>()->import.offset_m, Eigen::Vector3d(0, 8, 0));
  EXPECT_THAT(s.sky.navigation, ElementsAre(data.folder / "urbannav-tst-20190428/hksc1180.19n",
                                            data.folder / "urbannav-tst-20190428/hksc1180.19b"));
  EXPECT_EQ(s.sky.systems, (std::set<gnss::System>{gnss::System::GPS, gnss::System::BeiDou}));
  EXPECT_FALSE(s.sky.allow_stale);
  EXPECT_FALSE(s.sky.nominal);
  EXPECT_EQ(s.trajectory.file, data.folder / "urbannav-tst-20190428/groundTruth_TST.csv");
  EXPECT_EQ(s.trajectory.format, "urbannav");
  EXPECT_EQ(s.trajectory.height_above_terrain_m, 2.0);
  EXPECT_FALSE(s.start || s.duration_s || s.rate_hz);
  ASSERT_EQ(s.receivers.size(), 1U);
  const ReceiverConfig& rover = s.receivers[0];
  EXPECT_EQ(rover.options.name, "rover");
  EXPECT_NEAR(degrees(rover.options.fix.elevation_mask_rad), 10, 1e-12) << "the key overrides the profile";
  EXPECT_EQ(rover.options.fix.min_satellites, 5);
  EXPECT_EQ(rover.propagation.model, propagation::Model::Specular) << "the scenario overrides the profile";
  EXPECT_TRUE(rover.options.noise.enabled);
  EXPECT_EQ(s.seed, 1U);
}

TEST(Scenario, ExamplesOfTheRepositoryParse) {
  EXPECT_EQ(read_scenario(kSource / "examples/synthetic_drive.yaml").trajectory.waypoints.size(), 12U);
  const Scenario frozen = read_scenario(kSource / "examples/frozen_sky.yaml");
  EXPECT_EQ(frozen.sky.frozen_azimuth_rad.size(), 8U);
  EXPECT_EQ(frozen.sky.frozen_elevation_rad[2], 1.02);
  EXPECT_EQ(frozen.receivers[0].propagation.model, propagation::Model::Mirror);
  const IssueFolder data;
  const std::string drive = read_bytes(kSource / "examples/urbannav_tst.yaml");
  (void)read_scenario(data.folder.write("urbannav_tst.yaml", drive));
  const Scenario scenario = read_scenario(
      data.folder.write("urbannav_tst_m8t.yaml", read_bytes(kSource / "examples/urbannav_tst_m8t.yaml")));
  EXPECT_TRUE(scenario.receivers[0].options.signal.enabled);
  EXPECT_THAT(drive, EndsWith(kIssueExample)) << "the example and the one in the documentation are one";
}

TEST(Scenario, TheExampleOfTheDocumentationIsTheTestedOne) {
  EXPECT_THAT(read_bytes(kSource / "docs/scenario.md"), HasSubstr("```yaml\n" + kIssueExample + "```"));
}

TEST(Scenario, SystemsMayStandInOneText) {
  const std::set<gnss::System> two{gnss::System::GPS, gnss::System::BeiDou};
  for (const char* text : {"GPS BeiDou", "'GPS, BeiDou'", "[GPS, BeiDou]"}) {
    EXPECT_EQ(parse_scenario(kMinimal + "sky: {systems: " + text + "}\n", "s.yaml").sky.systems, two) << text;
  }
}

TEST(Scenario, LeftOutKeysAreTheDefaultProfilesAndTheStructs) {
  const Scenario s = parse_scenario(kMinimal, "s.yaml");
  EXPECT_TRUE(s.sky.nominal);
  EXPECT_EQ(s.sky.systems.size(), gnss::kConstellations.size());
  ASSERT_EQ(s.receivers.size(), 1U);
  const receiver::ReceiverOptions defaults;
  const receiver::ReceiverOptions& rover = s.receivers[0].options;
  EXPECT_EQ(rover.name, "rover");
  EXPECT_TRUE(rover.signal.enabled);  // of ublox-m10
  EXPECT_EQ(rover.noise.ou.sigma_m_per_sqrt_s, defaults.noise.ou.sigma_m_per_sqrt_s);
  EXPECT_EQ(s.receivers[0].propagation.max_range_m, propagation::PropagationOptions().max_range_m);
  EXPECT_TRUE(s.outputs.has("epochs_csv") && s.outputs.has("pictures"));
  EXPECT_EQ(s.city.origin->latitude_rad, city::SyntheticCityOptions().origin.latitude_rad);
}

// A mapping changes the default outputs; a list replaces them.
TEST(Scenario, OutputsAreNamesAsAMappingOrAList) {
  const auto names = [](const std::string& outputs) {
    return parse_scenario(kMinimal + outputs, "s.yaml").outputs.names;
  };
  const std::set<std::string, std::less<>> plain{
      "epochs_csv", "satellites_csv", "nmea", "kml",    "rinex_observation", "rinex_navigation",
      "geojson",    "pictures",       "imu",  "wheels", "barometer",         "magnetometer"};
  EXPECT_EQ(names(""), plain);
  EXPECT_EQ(names("outputs:\n"), plain);
  EXPECT_EQ(names("outputs: {}\n"), plain);
  auto changed = plain;
  changed.erase("kml");
  changed.insert("ubx");
  EXPECT_EQ(names("outputs: {ubx: true, kml: false, nmea: true}\n"), changed);
  EXPECT_EQ(names("outputs: [nmea, ubx]\n"), (std::set<std::string, std::less<>>{"nmea", "ubx"}));
  EXPECT_EQ(names("outputs: nmea\n"), (std::set<std::string, std::less<>>{"nmea"}));
  const auto refusal = [&](const std::string& text) {
    return canyon::test::refusal([&] { (void)parse_scenario(kMinimal + text, "s.yaml"); });
  };
  EXPECT_THAT(refusal("outputs: {nmae: true}\n"),
              HasSubstr("unknown key 'nmae' in 'outputs'; did you mean 'nmea'?"));
  EXPECT_THAT(refusal("outputs: [kml, nmae]\n"),
              HasSubstr("outputs: 'nmae' is unknown; did you mean 'nmea'?"));
  EXPECT_THAT(refusal("outputs: [kml, kml]\n"), HasSubstr("outputs: 'kml' is given twice"));
  EXPECT_THAT(refusal("outputs: [view]\n"), HasSubstr("'view' is unknown"));
  EXPECT_THAT(refusal("outputs: []\n"), HasSubstr("the list is empty"));
  for (const char* text : {"outputs: {ubx_m8: true}\n", "outputs: [nmea, ubx_m8]\n"})
    EXPECT_THAT(refusal(text), HasSubstr("write ubx: {generation: m8}"));
  EXPECT_THAT(refusal("outputs: [gici]\n"), HasSubstr("examples/layouts.py"));
  EXPECT_THAT(refusal("outputs: {ubx: {generation: m7}}\n"), HasSubstr("known: m8, f9, m10, x20"));
  const OutputConfig m10 = parse_scenario(kMinimal + "outputs: {ubx: {generation: m10}}\n", "s.yaml").outputs;
  EXPECT_TRUE(m10.has("ubx"));
  EXPECT_EQ(m10.ubx_generation, UbxGeneration::M10);
  EXPECT_FALSE(parse_scenario(kMinimal + "outputs: {ubx: false}\n", "s.yaml").outputs.has("ubx"));
  // The effective scenario contains each name.
  Scenario scenario = parse_scenario(kMinimal + "outputs: [nmea, ubx]\n", "s.yaml");
  EXPECT_EQ(parse_scenario(scenario_yaml(scenario), "s.yaml").outputs.names, scenario.outputs.names);
  EXPECT_THAT(scenario_yaml(scenario), HasSubstr("outputs:\n  epochs_csv: false\n"));
  // A word, a list of words, or a mapping.
  const YAML::Node schema = YAML::Load(options::json_schema(scenario_description(), "scenario"));
  const YAML::Node forms = schema["properties"]["outputs"]["anyOf"];
  ASSERT_EQ(forms.size(), 3U);
  EXPECT_EQ(forms[0]["enum"].size(), outputs().size());
  EXPECT_EQ(forms[1]["items"]["enum"].size(), outputs().size());
  EXPECT_EQ(forms[2]["properties"].size(), outputs().size());
  // Names that a program sets are checked when the outputs are opened.
  scenario.outputs.names.insert("nmae");
  EXPECT_THAT(canyon::test::refusal([&] { scenario.outputs.validate(); }),
              HasSubstr("there is no output 'nmae'; did you mean 'nmea'?"));
}

TEST(Scenario, LaterLayersOverrideKeyByKey) {
  const Scenario s = parse_scenario(kMinimal + R"(
propagation: {max_range_m: 500, reflection_order: 0}
noise: {theta_per_s: 0.5, mu_m: 2, drift: {enabled: true}}
receivers:
  - {name: a}
  - {name: b, profile: paper}
  - name: c
    profile: paper
    min_satellites: 4
    propagation: {max_range_m: 100, model: specular}
    noise: {mu_m: 3}
)",
                                    "s.yaml");
  const auto& a = s.receivers[0];
  const auto& b = s.receivers[1];
  const auto& c = s.receivers[2];
  EXPECT_EQ(a.propagation.model, propagation::Model::Specular);
  EXPECT_EQ(b.propagation.model, propagation::Model::Mirror);
  EXPECT_EQ(c.propagation.model, propagation::Model::Specular);
  EXPECT_EQ(b.propagation.max_range_m, 500);
  EXPECT_EQ(c.propagation.max_range_m, 100);
  EXPECT_EQ(c.propagation.reflection_order, 0);
  EXPECT_EQ(c.options.noise.ou.theta_per_s, 0.5);
  EXPECT_EQ(b.options.noise.ou.mu_m, 2);
  EXPECT_EQ(c.options.noise.ou.mu_m, 3);
  EXPECT_TRUE(c.options.noise.drift_enabled);
  EXPECT_EQ(b.options.fix.min_satellites, 5);
  EXPECT_EQ(c.options.fix.min_satellites, 4);
  EXPECT_NEAR(degrees(c.options.fix.elevation_mask_rad), 15, 1e-12);
}

TEST(Scenario, StartIsUtcOrGpst) {
  const auto start = [](const std::string& text) {
    return *parse_scenario(
                kCity + "start: " + text + "\ntrajectory: {position: {east_m: 1, north_m: 2, up_m: 3}}\n",
                "s.yaml")
                .start;
  };
  const GpsTime expected = GpsTime::from_week(2051, 46701);
  EXPECT_EQ(start("{week: 2051, tow: 46701}"), expected);
  EXPECT_EQ(start("2019-04-28T12:58:21 GPST"), expected);
  EXPECT_EQ(start("2019-04-28T12:58:03Z"), expected);
  EXPECT_EQ(start("2019-04-28T20:58:03+08:00"), expected);
}

TEST(Scenario, LocalWaypointsLieInTheCitysFrame) {
  const Scenario s = parse_scenario(
      "city: {open: true, origin: {latitude_deg: 48, longitude_deg: 11, height_m: 500}}\n"
      "trajectory:\n  waypoints:\n  - {east_m: 100, north_m: 0, up_m: 2}\n"
      "  - {latitude_deg: 48.001, longitude_deg: 11.001, height_m: 510}\n  hold_s: 3\n",
      "s.yaml");
  const geodesy::LocalFrame frame(geodesy::Geodetic::from_degrees(48, 11, 500));
  EXPECT_LT((frame.local_from_geodetic(s.trajectory.waypoints[0]) - Eigen::Vector3d(100, 0, 2)).norm(), 1e-6);
  EXPECT_EQ(s.trajectory.waypoints[1].height_m, 510);
  EXPECT_EQ(s.trajectory.hold_s, 3);
}

TEST(Scenario, NamesUnknownKeysWithTheClosest) {
  EXPECT_EQ(fault(kMinimal + "receivers:\n- name: a\n  elevation_mask: 10\n"),
            "s.yaml:6: unknown key 'elevation_mask' in 'receivers[]'; did you mean 'elevation_mask_deg'?");
  EXPECT_THAT(fault(kMinimal + "receivers:\n- name: a\n  elevation_mask_rad: 0.1\n"),
              HasSubstr("did you mean 'elevation_mask_deg'?"));
  EXPECT_THAT(fault(kMinimal + "rate: 10\n"),
              HasSubstr("s.yaml:4: unknown key 'rate'; did you mean 'rate_hz'?"));
  EXPECT_THAT(fault(kMinimal + "duration_min: 10\n"), HasSubstr("did you mean 'duration_s'?"));
  EXPECT_THAT(fault(kMinimal + "propagation: {max_range_km: 10}\n"),
              HasSubstr("did you mean 'max_range_m'?"));
  EXPECT_THAT(fault(kMinimal + "recievers: []\n"), HasSubstr("did you mean 'receivers'?"));
  EXPECT_THAT(fault(kMinimal + "xyzzyplugh: 1\n"), HasSubstr("known here: city, sky, start"));
}

TEST(Scenario, NamesRepeatedKeys) {
  EXPECT_EQ(fault(kMinimal + "seed: 1\nseed: 2\n"),
            "s.yaml:5: 'seed' comes twice, first in line 4; remove one of them");
  EXPECT_THAT(fault(kMinimal + "noise: {mu_m: 1, mu_m: 2}\n"), HasSubstr("'mu_m' comes twice"));
}

TEST(Scenario, NamesWrongTypesUnitsAndRanges) {
  const auto receiver = [](const std::string& key) {
    return fault(kMinimal + "receivers:\n- " + key + "\n");
  };
  EXPECT_EQ(receiver("elevation_mask_deg: ten"),
            "s.yaml:5: elevation_mask_deg: 'ten' is not a number; it is at least 0 and below 90");
  EXPECT_EQ(receiver("elevation_mask_deg: 10 deg"),
            "s.yaml:5: elevation_mask_deg: '10 deg' is not a number; give the number alone, the unit is in "
            "the key's name");
  EXPECT_THAT(receiver("lever_arm: {up_m: 2m}"), HasSubstr("the unit is in the key's name"));
  EXPECT_THAT(receiver("elevation_mask_deg: 90"),
              HasSubstr("90 is out of range; it is at least 0 and below 90"));
  EXPECT_THAT(receiver("elevation_mask_deg: .nan"), HasSubstr("'.nan' is not a number"));
  EXPECT_THAT(receiver("elevation_mask_deg: [1, 2]"), HasSubstr("is a list instead of one value"));
  EXPECT_THAT(receiver("elevation_mask_deg:"), HasSubstr("has no value"));
  EXPECT_THAT(receiver("min_satellites: 4.5"), HasSubstr("'4.5' is not a whole number"));
  EXPECT_THAT(receiver("min_satellites: 3"), HasSubstr("runs from 4"));
  EXPECT_THAT(receiver("ionosphere: perhaps"), HasSubstr("'perhaps' is neither true nor false"));
  EXPECT_THAT(receiver("profile: papper"),
              AllOf(HasSubstr("s.yaml:5: profile: 'papper' is unknown; did you mean 'paper'?"),
                    HasSubstr("ublox-m8t"), HasSubstr("./my.yaml")));
  EXPECT_EQ(receiver("preset: paper"),
            "s.yaml:5: unknown key 'preset' in 'receivers[]'; did you mean 'profile'?");
  EXPECT_THAT(receiver("clock: {bias_s: 5}"), HasSubstr("bias_s: 5 is out of range"));
  EXPECT_THAT(receiver("clock: 5"), HasSubstr("'receivers[].clock' is not a mapping"));
  EXPECT_THAT(fault(kMinimal + "receivers: {name: a}\n"), HasSubstr("receivers: is not a list"));
  EXPECT_THAT(fault(kMinimal + "receivers: []\n"), HasSubstr("the list is empty"));
  EXPECT_THAT(fault(kMinimal + "receivers: [{name: a, fixed: {latitude_deg: 1, longitude_deg: 2}}]\n"),
              AllOf(HasSubstr("'height_m' is missing"), HasSubstr("give the height of the base station")));
  EXPECT_THAT(fault(kMinimal + "receivers: [{name: a, fixed: {east_m: 1, up_m: 2}}]\n"),
              HasSubstr("'north_m' is missing"));
  EXPECT_THAT(fault(kMinimal + "seed: -1\n"), HasSubstr("seed: -1 is out of range"));
  EXPECT_THAT(fault(kMinimal + "rate_hz: 0\n"), HasSubstr("rate_hz: 0 is out of range; it is above 0"));
  EXPECT_THAT(fault(kMinimal + "noise: {theta_per_s: 0}\n"), HasSubstr("theta_per_s: 0 is out of range"));
  EXPECT_THAT(fault(kMinimal + "propagation: {model: mirrow}\n"), HasSubstr("did you mean 'mirror'?"));
  EXPECT_THAT(fault(kMinimal + "propagation: {max_incidence_deg: 91}\n"), HasSubstr("at most 90"));
  EXPECT_THAT(fault("city: {open: true, origin: {latitude_deg: 1278, longitude_deg: 4}}\n" + kPosition),
              HasSubstr("s.yaml:1: latitude_deg: 1278 is out of range; it is at least -90 and at most 90"));
}

TEST(Scenario, NamesWhatIsMissingOrContradicts) {
  EXPECT_THAT(fault(kPosition), HasSubstr("'city' is missing"));
  EXPECT_THAT(fault(kCity), HasSubstr("'trajectory' is missing"));
  EXPECT_THAT(fault("city: {origin: {latitude_deg: 1, longitude_deg: 1}}\n" + kPosition),
              HasSubstr("city has no content"));
  EXPECT_THAT(fault("city: {open: true}\n" + kPosition), HasSubstr("city has no origin"));
  EXPECT_THAT(
      fault("city: {open: true, synthetic: {}}\n" + kPosition),
      HasSubstr("open: conflicts with 'synthetic'; keep one of osm, file, mesh, tiles, synthetic or open"));
  EXPECT_THAT(fault("city: {synthetic: {}, scale: 2}\n" + kPosition), HasSubstr("scale: has no effect"));
  EXPECT_THAT(fault("city: {synthetic: {min_height_m: 50, max_height_m: 20}}\n" + kPosition),
              HasSubstr("height"));
  EXPECT_THAT(fault(kMinimal + "sky: {nominal: false}\n"), HasSubstr("no other source"));
  EXPECT_THAT(fault(kMinimal + "sky: {systems: [GPS, Galilei]}\n"),
              AllOf(HasSubstr("systems: "), HasSubstr("Galile")));
  EXPECT_THAT(fault(kMinimal + "sky: {systems: []}\n"), HasSubstr("the list is empty"));
  EXPECT_THAT(fault(kMinimal + "sky: {systems: \",\"}\n"), HasSubstr("systems: contains no system"));
  EXPECT_THAT(fault(kCity + "trajectory: {speed_mps: 3}\n"), HasSubstr("trajectory has no content"));
  EXPECT_THAT(fault(kCity + "trajectory: {position: {east_m: 1, north_m: 2}}\n"),
              HasSubstr("'up_m' is missing; give it, or trajectory.height_above_terrain_m"));
  EXPECT_THAT(fault(kCity + "trajectory: {position: {east_m: 1, latitude_deg: 2}}\n"),
              HasSubstr("'north_m' is missing"));
  EXPECT_THAT(fault(kCity + "trajectory: {position: {east_m: 1, north_m: 2, up_m: 0}, hold_s: 4}\n"),
              HasSubstr("hold_s: has no effect"));
  EXPECT_THAT(fault(kMinimal + "receivers:\n- {name: a}\n- {name: a}\n"),
              HasSubstr("s.yaml:6: name: 'a' names two receivers"));
  EXPECT_THAT(fault(kMinimal + "receivers:\n- {name: a}\n- {profile: paper}\n"), HasSubstr("has no name"));
  EXPECT_THAT(fault(kMinimal + "receivers:\n- {name: ../a}\n"), HasSubstr("cannot name a folder"));
  EXPECT_THAT(fault(kCity + "start: noon\ntrajectory: {position: {east_m: 1, north_m: 2, up_m: 3}}\n"),
              HasSubstr("s.yaml:2: start: "));
  EXPECT_THAT(
      fault(kCity + "start: {week: 2051}\ntrajectory: {position: {east_m: 1, north_m: 2, up_m: 3}}\n"),
      HasSubstr("'tow' is missing"));
}

TEST(Scenario, FrozenSkyTakesThePapersWordsInRadians) {
  const auto frozen = [](const std::string& keys) { return kMinimal + "sky: {frozen: {" + keys + "}}\n"; };
  const Scenario s =
      parse_scenario(frozen("satNum: 2, satAzimuth: 2.93 3.39, satElevation: [0.78, 0.32]"), "s.yaml");
  EXPECT_THAT(s.sky.frozen_azimuth_rad, ElementsAre(2.93, 3.39));
  EXPECT_THAT(s.sky.frozen_elevation_rad, ElementsAre(0.78, 0.32));
  EXPECT_THAT(fault(frozen("satAzimuth: 2.93, satElevation: 45")),
              HasSubstr("give radians from 0 to 1.5708; 45 deg is 0.785398"));
  EXPECT_THAT(fault(frozen("satAzimuth: 270, satElevation: 1")),
              HasSubstr("satAzimuth: 270 is out of range"));
  EXPECT_THAT(fault(frozen("satNum: 3, satAzimuth: 1 2, satElevation: 1 1")),
              HasSubstr("2 azimuths and 2 elevations for 3"));
  EXPECT_THAT(fault(frozen("satAzimuth: 1 2, satElevation: 1")), HasSubstr("2 azimuths and 1 elevations"));
  EXPECT_THAT(fault(frozen("satAzimuth: 1 two, satElevation: 1 1")), HasSubstr("'two' is not a number"));
  EXPECT_THAT(fault(frozen("satAzimuth: 1")), HasSubstr("needs satAzimuth and satElevation"));
}

TEST(Scenario, FilesMustExist) {
  EXPECT_THAT(fault(kMinimal + "sky:\n  navigation:\n  - nowhere.19n\n"),
              HasSubstr("s.yaml:5: navigation: there is no file 'nowhere.19n'; paths are relative to the "
                        "scenario's folder"));
  EXPECT_THAT(fault("city: {mesh: nowhere.dae, origin: {latitude_deg: 1, longitude_deg: 1}}\n" + kPosition),
              HasSubstr("s.yaml:1: mesh: there is no file"));
  EXPECT_THAT(fault(kCity + "trajectory:\n  file: t.csv\n"),
              HasSubstr("s.yaml:3: file: there is no file 't.csv'"));
  EXPECT_THAT(fault(kMinimal + "sky: {sp3: .}\n"), HasSubstr("is a folder"));
  EXPECT_THAT(fault(kMinimal + "sky: {sp3: .}\n"), HasSubstr("end its name with /"));
  EXPECT_THAT(error_of([] { (void)read_scenario("/nowhere/s.yaml"); }).what(), HasSubstr("/nowhere/s.yaml"));
}

TEST(Scenario, BrokenYamlNamesTheLine) {
  EXPECT_THAT(fault("city: {synthetic: {}\nsky: }\n"), StartsWith("s.yaml:"));
  EXPECT_THAT(fault(kMinimal + "\tseed: 1\n"), AllOf(StartsWith("s.yaml:"), HasSubstr("not YAML")));
  EXPECT_THAT(fault(""), HasSubstr("the file is empty"));
  EXPECT_THAT(fault("# nothing\n"), HasSubstr("the file is empty"));
  EXPECT_THAT(fault("hello\n"), HasSubstr("the scenario is not a mapping"));
  EXPECT_THAT(fault("[1, 2]\n"), HasSubstr("not a mapping"));
  EXPECT_THAT(fault(kMinimal + "---\n" + kMinimal), HasSubstr("second YAML document"));
  EXPECT_THAT(fault("? [a, b]\n: 1\n"), HasSubstr("not a plain word"));
  EXPECT_THAT(fault(std::string("\0\1\2\xff", 4)), StartsWith("s.yaml"));
}

TEST(Scenario, NamesTheKindOfAnotherFile) {
  const TemporaryFolder folder;
  const auto given = [&](const char* name, const std::string& bytes) {
    std::ofstream(folder / name, std::ios::binary) << bytes;
    return std::string(error_of([&] { (void)read_scenario(folder / name); }).what());
  };
  const std::string sentence = "$GPGGA,120000,2218,N,11410,E,1,08,1,5,M,0,M,,*5A\n";
  EXPECT_THAT(
      given("drive.gpx", "<?xml version=\"1.0\"?><gpx><trk/></gpx>"),
      HasSubstr("drive.gpx: is a GPX file, not a scenario (YAML); use it as a trajectory of format gpx"));
  EXPECT_THAT(given("drive.nmea", sentence), HasSubstr("is a log of NMEA sentences, not a scenario (YAML)"));
  // The message suggests the intended name.
  EXPECT_THAT(given("drive.yaml", sentence), HasSubstr("the scenario is not a mapping"));
}

TEST(Scenario, CitiesOfMapsAndFiles) {
  const TemporaryFolder folder;
  for (const char* name : {"a.osm.pbf", "b.JSON", "c.canyon", "d.world", "e.glb", "f.txt"}) {
    (void)folder.write(name, "");
  }
  const auto read = [&](const std::string& city) {
    return parse_scenario("city: {" + city + "}\n" + kPosition, folder / "s.yaml").city;
  };
  const CityConfig map =
      read("osm: [a.osm.pbf, b.JSON], bbox: [10.5, -20, 11, 20.5], default_height_m: 11, heights: [house=7]");
  ASSERT_TRUE(map.is<MapCity>());
  const MapCity& source = *map.as<MapCity>();
  EXPECT_EQ(source.files.size(), 2U);
  EXPECT_EQ((*source.bbox_deg)[1], -20);
  EXPECT_EQ(source.build.heights.building_m, 11);
  EXPECT_EQ(source.build.heights.by_type.at("house"), 7);
  EXPECT_FALSE(map.origin);
  EXPECT_TRUE(read("osm: a.osm.pbf, origin: {latitude_deg: 1, longitude_deg: 2}").origin);
  EXPECT_TRUE(read("file: a.osm.pbf").is<MapCity>());
  EXPECT_TRUE(read("file: c.canyon").is<CityFile>());
  EXPECT_TRUE(read("mesh: c.canyon").is<CityFile>());
  EXPECT_TRUE(read("file: d.world").is<CityFile>());
  EXPECT_TRUE(read("file: e.glb, origin: {latitude_deg: 1, longitude_deg: 2}, scale: 2").is<MeshCity>());
  const auto wrong = [&](const std::string& city) {
    return std::string(error_of([&] { (void)read(city); }).what());
  };
  EXPECT_THAT(wrong("file: f.txt"), HasSubstr("known are .osm"));
  EXPECT_THAT(wrong("file: c.canyon, origin: {latitude_deg: 1, longitude_deg: 2}"),
              HasSubstr("its own origin"));
  EXPECT_THAT(wrong("file: c.canyon, scale: 2"), HasSubstr("scale"));
  EXPECT_THAT(wrong("osm: a.osm.pbf, bbox: [2, 1, 1, 2]"), HasSubstr("is not a box"));
  EXPECT_THAT(wrong("osm: a.osm.pbf, heights: [house]"), HasSubstr("TYPE=METRES"));
  EXPECT_EQ(read("osm: a.osm.pbf, geoid_undulation_m: 3").sea_level.geoid_undulation_m, 3);
  EXPECT_EQ(read("file: c.canyon, geoid: EGM96").sea_level.geoid, buildings::GeoidModel::EGM96);
  for (const char* bad : {".nan", "1e9", "-151", "sea", "[1]"}) {
    EXPECT_THAT(wrong(fmt::format("file: c.canyon, geoid_undulation_m: {}", bad)),
                AllOf(StartsWith((folder / "s.yaml").string() + ":1: "), HasSubstr("geoid_undulation_m: ")));
  }
  EXPECT_THAT(wrong("file: c.canyon, geoid: EGM69"), HasSubstr("EGM96"));
  EXPECT_THAT(wrong("file: c.canyon, geoid: EGM96, geoid_undulation_m: -2"), HasSubstr("keep one of them"));
  EXPECT_THAT(wrong("osm: a.osm.pbf, level_height_m: 0"), HasSubstr("level_height_m"));
  EXPECT_THAT(wrong("osm: absent.osm"), HasSubstr("there is no file"));
}

TEST(Scenario, PlacesInACityWhoseOriginOnlyItsFileKnowsWaitForIt) {
  const TemporaryFolder folder;
  (void)folder.write("c.canyon", "");
  const Scenario scenario = parse_scenario(
      "city: {file: c.canyon}\nstart: 2026-06-01T12:00:00Z\ntrajectory: {waypoints: ["
      "{latitude_deg: 48, longitude_deg: 11, height_m: 3}, {east_m: 100, north_m: 50, up_m: 2}]}\n",
      folder / "s.yaml");
  ASSERT_EQ(scenario.trajectory.waypoints.size(), 2U);
  ASSERT_EQ(scenario.trajectory.local_waypoints.size(), 1U);
  EXPECT_EQ(scenario.trajectory.local_waypoints[0].first, 1U);
  EXPECT_EQ(scenario.trajectory.local_waypoints[0].second, Eigen::Vector3d(100, 50, 2));
}

TEST(Scenario, TrajectoryMayBeAbsentWhereItIsNotNeeded) {
  ScenarioReadOptions options;
  options.trajectory_needed = false;
  const Scenario s = parse_scenario(kCity, "s.yaml", options);
  EXPECT_FALSE(s.trajectory.file);
  EXPECT_TRUE(s.trajectory.waypoints.empty());
  EXPECT_EQ(parse_scenario(kMinimal, "s.yaml", options).trajectory.waypoints.size(), 1U);
  // Existing keys are checked as always.
  EXPECT_THROW((void)parse_scenario(kCity + "trajectory: {speed_mps: 3}\n", "s.yaml", options), InputError);
}

TEST(Scenario, TakesReflectionsUpToTheSecondOrder) {
  const auto with = [](const std::string& order) {
    return kMinimal + "propagation: {reflection_order: " + order + "}\n";
  };
  EXPECT_EQ(parse_scenario(with("2"), "s.yaml").receivers[0].propagation.reflection_order, 2);
  EXPECT_EQ(parse_scenario(kMinimal + "receivers: [{profile: ideal}]\n", "s.yaml")
                .receivers[0]
                .propagation.reflection_order,
            1);
  for (const char* bad : {"3", "-1", "1.5"}) EXPECT_THAT(fault(with(bad)), HasSubstr("reflection_order"));
}

TEST(Scenario, FindsReceiversByName) {
  const Scenario scenario = parse_scenario(kMinimal + "receivers: [{name: car}, {name: bus}]\n", "s.yaml");
  EXPECT_EQ(find_receiver(scenario, ""), 0U);
  EXPECT_EQ(find_receiver(scenario, "bus"), 1U);
  EXPECT_THAT(error_of([&] { (void)find_receiver(scenario, "Bus"); }).what(),
              AllOf(HasSubstr("'Bus'"), HasSubstr("car, bus")));
}

TEST(Scenario, WarnsOfAStartWithoutAZone) {
  const auto warnings = [](const std::string& start) {
    return parse_scenario(
               kCity + "start: " + start + "\ntrajectory: {position: {east_m: 1, north_m: 2, up_m: 3}}\n",
               "s.yaml")
        .warnings;
  };
  EXPECT_THAT(warnings("2026-06-01T12:00:00"),
              ElementsAre(HasSubstr("2026-06-01T12:00:00 has no time zone")));
  EXPECT_THAT(warnings("2026-06-01T12:00:00Z"), ElementsAre());
  EXPECT_THAT(warnings("{week: 2420, tow: 0}"), ElementsAre());
  EXPECT_THAT(fault(kCity + "start: 1975-06-01\ntrajectory: {position: {east_m: 1, north_m: 2, up_m: 3}}\n"),
              AllOf(StartsWith("s.yaml:2:"), HasSubstr("1980-01-06")));
}

TEST(Scenario, WarnsOfNoiseThatErrorsFromSpaceReplace) {
  const auto warnings = [](const std::string& keys) {
    return parse_scenario(
               kCity +
                   "start: 2026-06-01T12:00:00Z\ntrajectory: {position: {east_m: 1, north_m: 2, up_m: 3}}\n" +
                   keys,
               "s.yaml")
        .warnings;
  };
  const std::string sigma = "noise: {sigma_m_per_sqrt_s: 0.5}";
  EXPECT_THAT(warnings(sigma), ElementsAre(HasSubstr("noise of rover has no effect")));
  EXPECT_THAT(warnings("receivers: [{name: a, " + sigma + "}, {name: b}]"),
              ElementsAre(HasSubstr("noise of a has no effect")));
  EXPECT_THAT(warnings("receivers: [{name: a, noise: {enabled: true, sigma_m_per_sqrt_s: 0.5}}]"),
              ElementsAre());
  EXPECT_THAT(warnings("receivers: [{name: a, profile: paper, " + sigma + "}]"), ElementsAre());
  EXPECT_THAT(warnings(sigma + "\nsky: {nominal: true, errors: {enabled: false}}"), ElementsAre());
  EXPECT_THAT(warnings(""), ElementsAre());
}

}  // namespace
}  // namespace canyon::simulation::scenario_test
