#include "canyon/simulation/scenario/profile.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <yaml-cpp/yaml.h>

#include <cmath>
#include <sstream>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/values.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "tests/support/simulation_support.hpp"
#include "tests/support/source_dir.hpp"

namespace canyon::simulation {
namespace {

using geodesy::degrees;
using test::error_of;
using test::TemporaryFolder;
using ::testing::AllOf;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

const std::filesystem::path kSource = canyon_source_dir;
const std::string kScene =
    "city: {synthetic: {}}\nstart: 2026-06-01T12:00:00Z\n"
    "trajectory: {position: {east_m: 1, north_m: 2, up_m: 3}}\n";

Profile built_in(std::string_view name) {
  return parse_profile(std::string(built_in_profile(name).text), std::string(name));
}

// The message for a profile of this text.
std::string fault(const std::string& text) {
  return error_of([&] { (void)parse_profile(text, "p.yaml"); }).what();
}

TEST(Profile, TheLibraryHasTheFilesOfTheRepository) {
  std::vector<std::string> names;
  for (const BuiltInProfile& profile : built_in_profiles()) {
    names.emplace_back(profile.name);
    EXPECT_EQ(profile.text, canyon::test::read_bytes(kSource / "profiles" / (names.back() + ".yaml")))
        << profile.name;
  }
  EXPECT_THAT(names, ElementsAre("ideal", "paper", "phone", "septentrio-mosaic", "survey", "ublox-f9p",
                                 "ublox-f9r", "ublox-m10", "ublox-m8t"));
}

TEST(Profile, BuiltInOnesAreWhole) {
  for (const BuiltInProfile& each : built_in_profiles()) {
    const Profile profile = built_in(each.name);
    EXPECT_FALSE(profile.description.empty()) << each.name;
    EXPECT_EQ(profile.description.find('\n'), std::string::npos) << each.name;
    EXPECT_NO_THROW(profile.receiver.options.validate()) << each.name;
    EXPECT_NO_THROW(profile.receiver.propagation.validate()) << each.name;
  }
}

TEST(Profile, StandsForTheScenariosOwn) {
  const TemporaryFolder folder;
  const auto read = [&](const std::string& receivers, const std::string& profile) {
    return read_scenario_with_profile(folder.write("s.yaml", kScene + "sky: {nominal: true}\n" + receivers),
                                      profile)
        .receivers.front();
  };
  // Keys of the receiver still apply, and so does its name.
  const ReceiverConfig m8t =
      read("receivers: [{name: car, profile: paper, elevation_mask_deg: 12}]\n", "ublox-m8t");
  EXPECT_EQ(m8t.options.name, "car");
  EXPECT_TRUE(m8t.options.signal.enabled);
  EXPECT_NEAR(degrees(m8t.options.fix.elevation_mask_rad), 12, 1e-12);
  EXPECT_TRUE(read("receivers: [{name: car}]\n", "ublox-m8t").options.signal.enabled);
  EXPECT_TRUE(read("", "ublox-m8t").options.signal.enabled);
  (void)folder.write("mine.yaml", "description: mine\nelevation_mask_deg: 33\n");
  EXPECT_NEAR(degrees(read("", "./mine.yaml").options.fix.elevation_mask_rad), 33, 1e-12);
  EXPECT_THAT(error_of([&] { (void)read("", "ublox"); }).what(),
              AllOf(HasSubstr("s.yaml"), HasSubstr("ublox-m8t")));
}

// The F9R is the F9P with the vehicle's sensors, without other differences.
TEST(Profile, TheF9rIsTheF9pWithDeadReckoning) {
  const auto keys_of = [](const char* name) {
    YAML::Node tree = YAML::Load(std::string(built_in_profile(name).text));
    tree.remove("description");
    const bool fused = tree["dead_reckoning"].IsDefined();
    tree.remove("dead_reckoning");
    return std::pair(YAML::Dump(tree), fused);
  };
  EXPECT_EQ(keys_of("ublox-f9p"), std::pair(keys_of("ublox-f9r").first, false));
  EXPECT_TRUE(keys_of("ublox-f9r").second);
}

// Each number of an existing receiver has its source next to it.
TEST(Profile, EveryNumberOfARealReceiverHasAComment) {
  for (const char* name : {"ublox-m10", "ublox-m8t", "ublox-f9p", "phone", "survey", "septentrio-mosaic"}) {
    std::istringstream text{std::string(built_in_profile(name).text)};
    for (std::string line; std::getline(text, line);) {
      const std::size_t colon = line.find(": ");
      if (line.find_first_not_of(' ') == std::string::npos || line[line.find_first_not_of(' ')] == '#' ||
          colon == std::string::npos || line.find("description") == 0) {
        continue;
      }
      const std::size_t comment = line.find(" # ");
      const std::string value = line.substr(colon, comment == std::string::npos ? comment : comment - colon);
      if (value.find_first_of("0123456789") == std::string::npos ||
          line.find("reflection_order") != line.npos)
        continue;
      EXPECT_NE(comment, std::string::npos) << name << ": " << line;
    }
  }
}

TEST(Profile, ReceiversWithoutOneAreACommonModule) {
  ReceiverConfig common = built_in(kDefaultProfile).receiver;
  common.options.signal.shadowing.enabled = true;  // of the surroundings
  common.options.signal.shadowing.environment = disturbance::ShadowingEnvironment::Auto;
  const std::string module = options::exact_text(common);
  const auto named = [](ReceiverConfig config) {
    config.options.name = "receiver";
    return options::exact_text(config);
  };
  EXPECT_EQ(kDefaultProfile, "ublox-m10");
  for (const char* receivers : {"", "receivers: [{name: a}]\n", "receivers: [{profile: ublox-m10}]\n"}) {
    EXPECT_EQ(named(parse_scenario(kScene + receivers, "s.yaml").receivers.front()), module) << receivers;
  }
  RunnerConfig live = parse_live_config("seed: 1\n", "host");
  EXPECT_TRUE(live.receiver().options.independent_noise);  // several vehicles
  live.receiver().options.independent_noise = receiver::ReceiverOptions{}.independent_noise;
  EXPECT_EQ(named(live.receiver()), module);
  EXPECT_NE(named(parse_scenario(kScene + "receivers: [{profile: ideal}]\n", "s.yaml").receivers.front()),
            module);
}

// Obstacles belong to the surroundings: a scenario's settings apply to every receiver, and no profile has
// any.
TEST(Profile, ObstaclesAreOfTheScenario) {
  for (const BuiltInProfile& profile : built_in_profiles()) {
    const std::string receivers = fmt::format("receivers: [{{profile: {}}}]\n", profile.name);
    const auto shadowing = [&](const std::string& line) {
      return parse_scenario(kScene + receivers + line, "s.yaml").receivers.front().options.signal.shadowing;
    };
    EXPECT_TRUE(shadowing("").enabled) << profile.name;
    EXPECT_EQ(shadowing("").environment, disturbance::ShadowingEnvironment::Auto) << profile.name;
    EXPECT_EQ(shadowing("surroundings: dense\n").environment, disturbance::ShadowingEnvironment::Dense);
    EXPECT_FALSE(shadowing("shadowing: {enabled: false}\n").enabled);
    EXPECT_EQ(parse_live_config(fmt::format("profile: {}\nsurroundings: urban\n", profile.name), "host")
                  .receiver()
                  .options.signal.shadowing.environment,
              disturbance::ShadowingEnvironment::Urban);
  }
  try {
    (void)parse_profile("description: d\nsignal: {enabled: true, shadowing: {enabled: false}}\n", "p.yaml");
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("p.yaml:2: shadowing: obstacles belong to the world"));
    EXPECT_THAT(e.what(), HasSubstr("write surroundings: or shadowing: in the scenario"));
  }
}

// Systems that the hardware receives concurrently (docs/profiles.md).
TEST(Profile, TracksWhatTheHardwareReceivesAtOnce) {
  const receiver::ReceiverOptions m10 = built_in("ublox-m10").receiver.options;
  receiver::ReceiverOptions chosen = m10;
  chosen.choose_signals({});
  const auto beidou_signals = receiver::tracked_signals(chosen.tracks, gnss::System::BeiDou);
  ASSERT_EQ(beidou_signals.size(), 1U);
  EXPECT_EQ(beidou_signals.front()->name, "B1C");

  const receiver::ReceiverOptions m8t = built_in("ublox-m8t").receiver.options;
  const gnss::SatelliteId gps{gnss::System::GPS, 5}, glonass{gnss::System::GLONASS, 3},
      beidou{gnss::System::BeiDou, 20};
  const auto left_out = [&](const std::vector<gnss::SatelliteId>& sky) {
    receiver::ReceiverOptions options = m8t;
    options.choose_signals(sky);
    options.choose_signals(sky);
    return options.leaves_out;
  };
  EXPECT_THAT(left_out({gps, beidou}), ::testing::IsEmpty());
  EXPECT_THAT(left_out({gps, glonass, beidou}), ElementsAre("B1I"));

  for (receiver::ReceiverOptions options : {m10, m8t}) {
    options.tracks = {"L1CA", "E1", "B1I"};
    EXPECT_NO_THROW(options.validate());
    options.tracks.emplace_back("G1");
    EXPECT_THAT(error_of([&] { options.validate(); }).what(),
                HasSubstr("it tracks B1I and G1, which its hardware does not receive at the same time"));
  }
}

// Real receivers output the fixes of their navigation engines; the ideal and the paper's receiver have none.
TEST(Profile, RealReceiversFilterTheirFixes) {
  for (const BuiltInProfile& each : built_in_profiles()) {
    const bool real = each.name != "ideal" && each.name != "paper";
    const receiver::ReceiverOptions options = built_in(each.name).receiver.options;
    EXPECT_EQ(options.filter.enabled, real) << each.name;
    EXPECT_EQ(options.signal.enabled, real) << each.name;
  }
}

TEST(Profile, IdealHasNoNoiseAndLosesNothing) {
  const ReceiverConfig ideal = built_in("ideal").receiver;
  EXPECT_FALSE(ideal.options.noise.enabled);
  EXPECT_FALSE(ideal.options.signal.enabled);
  EXPECT_EQ(ideal.options.fix.elevation_mask_rad, 0);
  EXPECT_EQ(ideal.propagation.model, propagation::Model::Specular);
  EXPECT_EQ(ideal.propagation.reflection_order, 1);
}

// Section III of the paper.
TEST(Profile, PaperIsThePapersReceiver) {
  const ReceiverConfig paper = built_in("paper").receiver;
  EXPECT_NEAR(degrees(paper.options.fix.elevation_mask_rad), 15, 1e-12);
  EXPECT_EQ(paper.options.fix.min_satellites, 5);
  EXPECT_TRUE(paper.options.noise.enabled);
  EXPECT_FALSE(paper.options.noise.drift_enabled);
  EXPECT_FALSE(paper.options.signal.enabled);
  EXPECT_FALSE(paper.options.filter.enabled);
  EXPECT_FALSE(paper.options.ionosphere || paper.options.troposphere);
  EXPECT_EQ(paper.propagation.model, propagation::Model::Mirror);
}

// Sensitivities of data sheets [dBm] over -174 dBm/Hz of thermal noise, k 290 K. A threshold of a profile may
// be above its data sheet's, not below.
TEST(Profile, ThresholdsAreWithinTheDataSheets) {
  struct Sheet {
    const char* profile;
    double tracking_dbm, reacquisition_dbm, cold_start_dbm;
  };
  constexpr double kThermalNoise_dbm_hz = -173.98;  // 10 log10(1.380649e-23 * 290 / 1e-3)
  for (const Sheet& sheet : {Sheet{"ublox-m8t", -167, -160, -148},
                             {"ublox-f9p", -167, -160, -148},
                             {"ublox-m10", -165, -158, -146}}) {
    const tracking::SignalLockOptions lock = built_in(sheet.profile).receiver.options.signal.lock;
    EXPECT_GE(lock.tracking_threshold_dbhz, sheet.tracking_dbm - kThermalNoise_dbm_hz - 0.05);
    EXPECT_LE(lock.tracking_threshold_dbhz, sheet.tracking_dbm - kThermalNoise_dbm_hz + 8);
    EXPECT_GE(lock.acquisition_threshold_dbhz, sheet.reacquisition_dbm - kThermalNoise_dbm_hz);
    EXPECT_LE(lock.acquisition_threshold_dbhz, sheet.cold_start_dbm - kThermalNoise_dbm_hz);
  }
}

// docs/propagation.md: in the recorded drive the GPS C/N0 of the M8T reaches 42 to 44 dB-Hz at the 90th
// percentile and 48 at most; phones receive some 10 dB less than survey antennas (Pesyna et al. 2014: 5 to 15
// dB).
TEST(Profile, LinkBudgetsGiveTheC_N0OfTheirKind) {
  const auto cn0 = [](std::string_view name, double elevation_deg, gnss::System system) {
    const tracking::SignalOptions s = built_in(name).receiver.options.signal;
    const gnss::Signal& signal = gnss::signals_of(system).front();
    return signal::los_cn0_dbhz(signal, geodesy::radians(elevation_deg), s.antenna, s.link) +
           gnss::sum_of(s.offset_db, {system, 30}, signal, geodesy::GpsTime());
  };
  using gnss::System;
  const double m8t = cn0("ublox-m8t", 50, System::GPS);
  EXPECT_GT(m8t, 44);
  EXPECT_LT(m8t, 48);
  EXPECT_LE(m8t - cn0("ublox-m8t", 50, System::BeiDou), 4);
  EXPECT_GE(m8t - cn0("ublox-m8t", 50, System::BeiDou), 2);
  EXPECT_GT(cn0("survey", 60, System::GPS) - cn0("phone", 60, System::GPS), 5);
  EXPECT_LT(cn0("survey", 60, System::GPS) - cn0("phone", 60, System::GPS), 15);
  EXPECT_GT(cn0("ublox-f9p", 50, System::GPS), m8t);
}

TEST(Profile, MissingUnknownAndMisplacedKeysNameTheLine) {
  EXPECT_EQ(fault("elevation_mask_deg: 5\n"),
            "p.yaml:1: 'description' is missing; describe the receiver in one line");
  EXPECT_THAT(fault("description: d\nelevation_mask: 5\n"),
              HasSubstr("p.yaml:2: unknown key 'elevation_mask'; did you mean 'elevation_mask_deg'?"));
  // Names, profiles of profiles, and a scenario's own keys are not allowed there.
  for (const char* key : {"name: a", "profile: paper", "seed: 1", "city: {}"}) {
    EXPECT_THAT(fault(std::string("description: d\n") + key + "\n"), HasSubstr("p.yaml:2: unknown key"));
  }
  EXPECT_THAT(fault(""), AllOf(HasSubstr("the file is empty"), Not(HasSubstr("trajectory"))));
  EXPECT_THAT(fault("[1]\n"), HasSubstr("the profile is not a mapping"));
  EXPECT_THAT(fault("description: d\nsignal: {lock: {tracking_threshold_dbhz: 30}}\n"),
              AllOf(StartsWith("p.yaml:2: "), HasSubstr("at most the acquisition threshold")));
  EXPECT_THAT(fault("description: d\nsignal:\n  dll: {discriminator: doubledelta}\n"),
              HasSubstr("p.yaml:3: discriminator: 'doubledelta' is unknown; did you mean 'double_delta'?"));
  EXPECT_THAT(fault("description: d\nmax_pdop: never\n"), HasSubstr("max_pdop: 'never' is not a number"));
}

TEST(Profile, AntennasByNameOrByRows) {
  const auto antenna = [](const std::string& keys) {
    return parse_profile("description: d\nsignal: {" + keys + "}\n", "p.yaml")
        .receiver.options.signal.antenna;
  };
  EXPECT_EQ(antenna("antenna: survey").name(), "survey");
  for (const char* rows : {"antenna_rows: [[-90, -20, -12], [90, 4, -9]]",
                           "antenna_rows: [-90, -20, -12, 90, 4, -9]", "antenna_rows: -90 -20 -12 90 4 -9"}) {
    const signal::AntennaPattern pattern = antenna(rows);
    ASSERT_EQ(pattern.points(signal::Band::Upper).size(), 2U) << rows;
    // Halfway in elevation, halfway in dB.
    EXPECT_NEAR(pattern.gain(0, gnss::kL1_hz).rhcp_dbic, -8, 1e-12) << rows;
    EXPECT_NEAR(pattern.gain(0, gnss::kL1_hz).lhcp_dbic, -10.5, 1e-12) << rows;
  }
  const auto wrong = [](const std::string& keys) {
    return fault("description: d\nsignal: {" + keys + "}\n");
  };
  EXPECT_THAT(wrong("antenna: pach"), HasSubstr("did you mean 'patch'?"));
  EXPECT_THAT(wrong("antenna: patch, antenna_rows: [0, 1, 2]"), HasSubstr("conflicts with 'antenna'"));
  EXPECT_THAT(wrong("antenna_rows: [0, 1]"), HasSubstr("2 numbers do not make rows of 3"));
  EXPECT_THAT(wrong("antenna_rows: [[0, 1, 2], [3, 4]]"),
              HasSubstr("p.yaml:2: antenna_rows: row 2 does not have 3"));
  EXPECT_THAT(wrong("antenna_rows: [[10, 1, 2], [3, 4, 5]]"), HasSubstr("p.yaml:2: antenna_rows: "));
  EXPECT_THAT(wrong("antenna_rows: [[x, 1, 2]]"), HasSubstr("'x' is not a number"));
  EXPECT_THAT(wrong("antenna_rows: []"), HasSubstr("the list is empty"));
}

TEST(Profile, UsersBringTheirsByAPathFromTheScenariosFolder) {
  const TemporaryFolder folder;
  std::filesystem::create_directories(folder / "kinds");
  (void)folder.write("kinds/mine.yaml", "description: mine\nelevation_mask_deg: 7\nmin_satellites: 6\n");
  (void)folder.write("bad.yml", "description: bad\n\nmin_satellites: 3\n");
  const auto read = [&](const std::string& receiver) {
    return parse_scenario(kScene + "receivers: [{" + receiver + "}]\n", folder / "s.yaml")
        .receivers[0]
        .options.fix;
  };
  EXPECT_NEAR(degrees(read("profile: kinds/mine.yaml").elevation_mask_rad), 7, 1e-12);
  EXPECT_EQ(read("profile: ./kinds/mine.yaml, elevation_mask_deg: 8").min_satellites, 6);
  EXPECT_NEAR(degrees(read("profile: ./kinds/mine.yaml, elevation_mask_deg: 8").elevation_mask_rad), 8,
              1e-12);
  const auto wrong = [&](const std::string& receiver) {
    return std::string(error_of([&] { (void)read(receiver); }).what());
  };
  EXPECT_THAT(wrong("profile: ./none.yaml"), HasSubstr("s.yaml:4: profile: there is no file"));
  EXPECT_THAT(
      wrong("profile: bad.yml"),
      AllOf(StartsWith((folder / "bad.yml").string() + ":3: min_satellites"), HasSubstr("runs from 4")));
}

TEST(Profile, ScenarioAndReceiverOverrideKeyByKey) {
  const Scenario s = parse_scenario(kScene + R"(
propagation: {diffraction: {max_range_m: 70}, reflection_order: 1}
noise: {mu_m: 2}
receivers:
  - {name: a, profile: ublox-m8t}
  - name: b
    profile: ublox-m8t
    signal: {link: {noise_figure_db: 1.5}, front_end_bandwidth_hz: none}
    propagation: {reflection_order: 0, diffuse: {enabled: false}}
    max_pdop: none
)",
                                    "s.yaml");
  const ReceiverConfig m8t = built_in("ublox-m8t").receiver;
  const ReceiverConfig& a = s.receivers[0];
  const ReceiverConfig& b = s.receivers[1];
  EXPECT_EQ(a.options.name, "a");
  EXPECT_EQ(a.propagation.edges.max_range_m, 70);
  EXPECT_TRUE(a.propagation.through_foliage) << "of the profile";
  EXPECT_EQ(a.propagation.reflection_order, 1);
  EXPECT_EQ(b.propagation.reflection_order, 0);
  EXPECT_TRUE(a.propagation.diffuse);
  EXPECT_FALSE(b.propagation.diffuse);
  EXPECT_EQ(a.options.noise.ou.mu_m, 2);
  EXPECT_EQ(a.options.signal.front_end_bandwidth_hz, m8t.options.signal.front_end_bandwidth_hz);
  EXPECT_TRUE(std::isinf(b.options.signal.front_end_bandwidth_hz));
  EXPECT_TRUE(std::isinf(b.options.fix.max_pdop));
  EXPECT_EQ(b.options.signal.link.noise_figure_db, 1.5);
  EXPECT_EQ(b.options.signal.link.implementation_loss_db, m8t.options.signal.link.implementation_loss_db);
  EXPECT_EQ(b.options.signal.offset_db, m8t.options.signal.offset_db);
}

TEST(Profile, LiveReceiversHaveThem) {
  const RunnerConfig config =
      parse_live_config("profile: paper\nelevation_mask_deg: 12\nsignal: {antenna: phone}\n", "plugin");
  EXPECT_EQ(config.receiver().propagation.model, propagation::Model::Mirror);
  EXPECT_EQ(config.receiver().options.fix.min_satellites, 5);
  EXPECT_NEAR(degrees(config.receiver().options.fix.elevation_mask_rad), 12, 1e-12);
  EXPECT_EQ(config.receiver().options.signal.antenna.name(), "phone");
  EXPECT_THAT(error_of([] { (void)parse_live_config("preset: paper\n", "plugin"); }).what(),
              HasSubstr("did you mean 'profile'?"));
}

TEST(Profile, PathsAreToldFromNames) {
  for (const char* path : {"./a.yaml", "a.yaml", "a.yml", "a/b", "/x/y"})
    EXPECT_TRUE(is_profile_path(path)) << path;
  for (const char* name : {"paper", "ublox-m8t", "yaml", ".yaml"})
    EXPECT_FALSE(is_profile_path(name)) << name;
}

}  // namespace
}  // namespace canyon::simulation
