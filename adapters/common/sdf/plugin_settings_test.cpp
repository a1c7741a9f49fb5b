#include "adapters/common/sdf/plugin_settings.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/base/text.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "tests/support/documented.hpp"
#include "tests/support/option_values.hpp"
#include "tests/support/source_dir.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::adapters {
namespace {

using geodesy::degrees;
using test::TemporaryFolder;
using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;
using testing::Property;

const std::filesystem::path kSource = canyon_source_dir;

// The paper's listing: the children of the plugin element as printed there.
const std::string kPaper = R"(
    <ros>
        <namespace>/multipath</namespace>
        <remapping>~/out:=scan</remapping>
    </ros>
    <output_type>sensor_msgs/LaserScan</output_type>
    <disableNoise>0</disableNoise>
    <satNum>8</satNum>
    <satAzimuth>2.93 3.39 5.56 0.23 4.02 1.38 2.23 0.65</satAzimuth>
    <satElevation>0.78 0.32 1.02 0.90 0.47 0.26 1.09 0.38</satElevation>
)";

// A sensor from a complete world, as in Gazebo.
sdf::ElementPtr sensor(const std::string& children) {
  static const sdf::ElementPtr description = [] {
    auto sdf = std::make_shared<sdf::SDF>();
    sdf::init(sdf);  // slow: reads the whole description of the format
    return sdf->Root();
  }();
  auto sdf = std::make_shared<sdf::SDF>();
  sdf->Root()->Copy(description);
  const std::string world = R"(<sdf version="1.6"><world name="w"><model name="car"><link name="base">
      <sensor name="rays" type="ray">)" +
                            children + "</sensor></link></model></world></sdf>";
  if (!sdf::readString(world, sdf)) throw std::runtime_error("not SDF: " + children);
  return sdf->Root()->GetElement("world")->GetElement("model")->GetElement("link")->GetElement("sensor");
}

// The element as passed to a plugin by Gazebo.
sdf::ElementPtr plugin(const std::string& children) {
  return sensor("<plugin name='gnss' filename='libMultipathSensorPlugin.so'>" + children + "</plugin>")
      ->GetElement("plugin");
}

const std::string kName = "plugin 'gnss' of model 'car'";

// Gazebo's resource paths from its environment.
ResourcePaths gazebos_paths() {
  const auto paths = [](const char* variable) {
    std::vector<std::filesystem::path> folders;
    const char* const text = std::getenv(variable);
    for (const std::string_view folder : split(text != nullptr ? text : "", ':')) {
      if (!folder.empty()) folders.emplace_back(folder);
    }
    return folders;
  };
  return {paths("GAZEBO_MODEL_PATH"), paths("GAZEBO_RESOURCE_PATH"), "GAZEBO_RESOURCE_PATH"};
}

HostSettings read(const std::string& children, bool on_ray_sensor = false,
                  const std::filesystem::path& folder = {}) {
  return read_plugin_settings(plugin(children), {on_ray_sensor, kName, folder, gazebos_paths()});
}

// The complete message of the error thrown by reading.
std::string error_of(const sdf::ElementPtr& element, const std::string& what) {
  try {
    (void)read_plugin_settings(element, {false, kName, {}, gazebos_paths()});
  } catch (const InputError& e) {
    EXPECT_EQ(e.line(), 0) << e.what();
    EXPECT_EQ(e.file(), "") << e.what();
    return e.what();
  }
  ADD_FAILURE() << "no error from " << what;
  return "";
}
std::string error_of(const std::string& children) {
  return error_of(plugin(children), children);
}

void write(const std::filesystem::path& path) {
  std::filesystem::create_directories(path.parent_path());
  std::ofstream(path) << "x";
}

// Sets an environment variable during its lifetime.
class Variable {
 public:
  Variable(const char* name, const std::string& value) : name_(name) {
    if (const char* before = std::getenv(name)) before_ = before;
    setenv(name, value.c_str(), 1);
  }
  ~Variable() {
    if (before_) {
      setenv(name_, before_->c_str(), 1);
    } else {
      unsetenv(name_);
    }
  }
  Variable(const Variable&) = delete;
  Variable& operator=(const Variable&) = delete;

 private:
  const char* name_;
  std::optional<std::string> before_;
};

TEST(HostSettings, ThePapersSnippetWorksUnchanged) {
  const HostSettings s = read(kPaper, true);
  EXPECT_EQ(s.ros_namespace, "/multipath");
  EXPECT_THAT(s.remappings, ElementsAre(Pair("~/out", "scan")));
  EXPECT_TRUE(s.publish_scan);
  EXPECT_TRUE(s.live.receiver().options.noise.enabled);
  EXPECT_THAT(s.live.sky.frozen_azimuth_rad, ElementsAre(2.93, 3.39, 5.56, 0.23, 4.02, 1.38, 2.23, 0.65));
  EXPECT_THAT(s.live.sky.frozen_elevation_rad, ElementsAre(0.78, 0.32, 1.02, 0.90, 0.47, 0.26, 1.09, 0.38));
  EXPECT_EQ(s.live.receiver().propagation.model, propagation::Model::Mirror);
  // Section III of the paper: 15 deg, more than four satellites; and no strength or filter.
  const receiver::ReceiverOptions& options = s.live.receiver().options;
  EXPECT_NEAR(degrees(options.fix.elevation_mask_rad), 15, 1e-12);
  EXPECT_EQ(options.fix.min_satellites, 5);
  EXPECT_FALSE(options.signal.enabled || options.filter.enabled);
  EXPECT_EQ(s.ray_engine, RayEngine::Physics);
  EXPECT_THAT(s.warnings, IsEmpty());
  EXPECT_FALSE(s.origin);
}

TEST(HostSettings, DisableNoiseDisablesNoise) {
  EXPECT_FALSE(read("<disableNoise>1</disableNoise>").live.receiver().options.noise.enabled);
  EXPECT_FALSE(read("<disableNoise>True</disableNoise>").live.receiver().options.noise.enabled);
  EXPECT_FALSE(read("<noise>0</noise>").live.receiver().options.noise.enabled);  // a word for its switch
  EXPECT_TRUE(read("<disableNoise>false</disableNoise>").live.receiver().options.noise.enabled);
}

// The sensor's own noise, as in SDFormat for <navsat> and <gps>.
TEST(HostSettings, TheSensorsOwnNoiseStandsForAProfile) {
  const auto read_on = [](const std::string& type, const std::string& children) {
    const auto noise = [](const std::string& deviation) {
      return "<noise type='gaussian'><mean>0</mean><stddev>" + deviation + "</stddev></noise>";
    };
    PluginContext context;
    context.name = kName;
    context.sensor =
        sensor("<" + type + "><position_sensing><horizontal>" + noise("0.3") + "</horizontal><vertical>" +
               noise("0.5") + "</vertical></position_sensing><velocity_sensing><horizontal>" + noise("0.04") +
               "</horizontal></velocity_sensing></" + type + ">");
    return read_plugin_settings(plugin(children), context);
  };
  for (const std::string type : {"gps", "navsat"}) {
    const HostSettings s = read_on(type, "");
    const receiver::ReceiverOptions& o = s.live.receiver().options;
    EXPECT_EQ(o.fix_noise.horizontal_m, 0.3);
    EXPECT_EQ(o.fix_noise.vertical_m, 0.5);
    EXPECT_EQ(o.fix_noise.horizontal_mps, 0.04);
    EXPECT_EQ(o.fix_noise.vertical_mps, 0);
    EXPECT_FALSE(o.ionosphere || o.troposphere || o.orbit_errors || o.noise.enabled || o.signal.loop_noise);
    EXPECT_TRUE(o.signal.enabled) << "streets as ever";
    EXPECT_THAT(s.warnings, IsEmpty());
  }
  EXPECT_FALSE(read_on("gps", "<profile>ublox-m10</profile>").live.receiver().options.fix_noise.any());
  EXPECT_FALSE(read_on("gps", kPaper).live.receiver().options.fix_noise.any()) << "the paper's own";
  for (const char* own : {"<noise>1</noise>", "<gpsNoise>1</gpsNoise>", "<disableNoise>0</disableNoise>"}) {
    EXPECT_TRUE(read_on("gps", own).live.receiver().options.noise.enabled) << own;
  }
  const auto own = read_on("gps", "<fix_noise><horizontal_m>2</horizontal_m></fix_noise>").live.receiver();
  EXPECT_EQ(own.options.fix_noise.horizontal_m, 2);
  EXPECT_EQ(own.options.fix_noise.vertical_m, 0.5);
}

TEST(HostSettings, ThePapersDefaultsGiveWay) {
  // A plugin that is not on a ray sensor has no rays to use.
  EXPECT_EQ(read(kPaper, false).ray_engine, RayEngine::Embree);
  EXPECT_EQ(read(kPaper, false).live.receiver().propagation.model, propagation::Model::Mirror);
  const HostSettings specular = read(kPaper + "<propagation><model>specular</model></propagation>", true);
  EXPECT_EQ(specular.live.receiver().propagation.model, propagation::Model::Specular);
  EXPECT_EQ(specular.ray_engine, RayEngine::Embree);
  EXPECT_EQ(read(kPaper + "<ray_engine>embree</ray_engine>", true).ray_engine, RayEngine::Embree);
  EXPECT_EQ(read(kPaper + "<propagation><max_range_m>50</max_range_m></propagation>", true).ray_engine,
            RayEngine::Physics);
  const HostSettings phone = read(kPaper + "<profile>phone</profile>", true);
  EXPECT_TRUE(phone.live.receiver().options.signal.enabled);
  EXPECT_EQ(phone.ray_engine, RayEngine::Embree);
  // The scenario's own elements for the same satellites do not select the paper's defaults.
  const HostSettings frozen = read(
      "<sky><frozen><satAzimuth>1 2</satAzimuth><satElevation>0.5 0.6</satElevation></frozen></sky>", true);
  EXPECT_THAT(frozen.live.sky.frozen_azimuth_rad, ElementsAre(1, 2));
  EXPECT_EQ(frozen.live.receiver().propagation.model, propagation::Model::Specular);
  EXPECT_EQ(frozen.ray_engine, RayEngine::Embree);
}

TEST(HostSettings, NothingButDefaults) {
  for (const sdf::ElementPtr& element : {plugin(""), sdf::ElementPtr()}) {
    const HostSettings s = read_plugin_settings(element, {true, kName, {}});
    EXPECT_TRUE(s.live.sky.nominal);
    EXPECT_FALSE(s.live.start);
    EXPECT_FALSE(s.live.rate_hz);
    EXPECT_EQ(s.live.seed, 1U);
    EXPECT_EQ(s.live.receiver().propagation.model, propagation::Model::Specular);
    EXPECT_TRUE(s.live.receiver().options.signal.enabled);  // of the profile ublox-m10
    EXPECT_TRUE(s.live.receiver().options.filter.enabled);
    EXPECT_FALSE(s.named);
    EXPECT_FALSE(s.origin);
    EXPECT_EQ(s.ray_engine, RayEngine::Embree);
    EXPECT_FALSE(s.visual_geometry);
    EXPECT_FALSE(s.vehicle_blocks);
    EXPECT_EQ(s.ros_namespace, "");
    EXPECT_THAT(s.remappings, IsEmpty());
    EXPECT_EQ(s.frame_id, "");
    EXPECT_FALSE(s.publish_scan);
    EXPECT_EQ(s.pose_topic, "");
    EXPECT_EQ(s.pose_timeout_s, 0.5);
    EXPECT_TRUE(s.publish_gazebo);
    EXPECT_TRUE(s.publish_ros);
    EXPECT_FALSE(s.publish_px4);
    EXPECT_EQ(s.nmea_port, 0);
    EXPECT_FALSE(s.show_rays);
    EXPECT_FALSE(s.show_bubble);
    EXPECT_THAT(s.warnings, IsEmpty());
  }
}

TEST(HostSettings, EveryElementOfItsOwn) {
  const HostSettings s = read(R"(
    <origin_latitude>-33.5</origin_latitude>
    <origin_longitude>151.25</origin_longitude>
    <origin_altitude>58.75</origin_altitude>
    <ray_engine>physics</ray_engine>
    <propagation><model>mirror</model></propagation>
    <geometry>visual</geometry>
    <vehicle_blocks>1</vehicle_blocks>
    <ros>
      <namespace>uav1/gnss</namespace>
      <remapping>fix:=gps/fix</remapping>
      <remapping> ~/out := /laser </remapping>
    </ros>
    <frame_id>antenna</frame_id>
    <output_type>sensor_msgs/LaserScan</output_type>
    <pose_topic>/mocap/car/pose</pose_topic>
    <pose_timeout_s>1.5</pose_timeout_s>
    <publishers><gazebo>0</gazebo><ros>false</ros><px4>true</px4><nmea_port>5763</nmea_port>
      <stream>nmea=pty:</stream><stream>epochs_csv=file:a.csv</stream></publishers>
    <topic>gps1</topic>
    <visuals><rays>true</rays><bubble>1</bubble><bubble_scale>0.25</bubble_scale>
      <ray_length_m>42</ray_length_m></visuals>)");
  ASSERT_TRUE(s.origin);
  EXPECT_NEAR(degrees(s.origin->latitude_rad), -33.5, 1e-12);
  EXPECT_NEAR(degrees(s.origin->longitude_rad), 151.25, 1e-12);
  EXPECT_EQ(s.origin->height_m, 58.75);
  EXPECT_EQ(s.ray_engine, RayEngine::Physics);
  EXPECT_TRUE(s.visual_geometry);
  EXPECT_TRUE(s.vehicle_blocks);
  EXPECT_EQ(s.ros_namespace, "uav1/gnss");
  EXPECT_THAT(s.remappings, ElementsAre(Pair("fix", "gps/fix"), Pair("~/out", "/laser")));
  EXPECT_EQ(s.frame_id, "antenna");
  EXPECT_TRUE(s.publish_scan);
  EXPECT_EQ(s.pose_topic, "/mocap/car/pose");
  EXPECT_EQ(s.pose_timeout_s, 1.5);
  EXPECT_FALSE(s.publish_gazebo);
  EXPECT_FALSE(s.publish_ros);
  EXPECT_TRUE(s.publish_px4);
  EXPECT_EQ(s.nmea_port, 5763);
  EXPECT_THAT(s.streams, ElementsAre("nmea=pty:", "epochs_csv=file:a.csv"));
  EXPECT_EQ(s.px4_topic, "gps1");
  EXPECT_TRUE(s.show_rays);
  EXPECT_TRUE(s.show_bubble);
  EXPECT_EQ(s.bubble_scale, 0.25);
  EXPECT_EQ(s.ray_length_m, 42);
  EXPECT_THAT(s.warnings, IsEmpty());
}

TEST(HostSettings, EveryElementOfTheScenario) {
  const HostSettings s = read(R"(
    <sky><nominal>1</nominal><systems>GPS, Galileo</systems><systems>BeiDou</systems></sky>
    <start>2019-04-28T12:58:03Z</start>
    <rate_hz>8</rate_hz>
    <seed>77</seed>
    <name>roof</name>
    <profile>paper</profile>
    <elevation_mask_deg>12.5</elevation_mask_deg>
    <min_satellites>6</min_satellites>
    <max_iterations>31</max_iterations>
    <convergence_m>0.001</convergence_m>
    <ionosphere>1</ionosphere>
    <troposphere>true</troposphere>
    <correct_ionosphere>TRUE</correct_ionosphere>
    <correct_troposphere>1</correct_troposphere>
    <lever_arm><forward_m>1.5</forward_m><left_m>-0.25</left_m><up_m>0.75</up_m></lever_arm>
    <clock><bias_s>0.001</bias_s><drift>2e-7</drift><drift_walk>3e-9</drift_walk></clock>
    <noise>
      <enabled>0</enabled><theta_per_s>0.05</theta_per_s><mu_m>0.3</mu_m>
      <sigma_m_per_sqrt_s>0.4</sigma_m_per_sqrt_s><doppler_sigma_hz>0.6</doppler_sigma_hz>
      <drift><enabled>1</enabled></drift>
    </noise>
    <propagation>
      <model>specular</model><reflection_order>0</reflection_order><max_range_m>450</max_range_m>
      <max_incidence_deg>80</max_incidence_deg><ground_reflection>1</ground_reflection>
    </propagation>)");
  const simulation::RunnerConfig& live = s.live;
  EXPECT_TRUE(live.sky.nominal);
  EXPECT_THAT(live.sky.systems, ElementsAre(gnss::System::GPS, gnss::System::Galileo, gnss::System::BeiDou));
  EXPECT_EQ(*live.start, geodesy::parse_time("2019-04-28T12:58:03Z"));
  EXPECT_EQ(live.rate_hz, 8);
  EXPECT_EQ(live.seed, 77U);
  EXPECT_TRUE(s.named);
  const receiver::ReceiverOptions& o = live.receiver().options;
  EXPECT_EQ(o.name, "roof");
  EXPECT_NEAR(degrees(o.fix.elevation_mask_rad), 12.5, 1e-12);
  EXPECT_EQ(o.fix.min_satellites, 6);
  EXPECT_EQ(o.fix.max_iterations, 31);
  EXPECT_EQ(o.fix.convergence_m, 0.001);
  EXPECT_TRUE(o.ionosphere);
  EXPECT_TRUE(o.troposphere);
  EXPECT_TRUE(o.fix.correct_ionosphere);
  EXPECT_TRUE(o.fix.correct_troposphere);
  EXPECT_EQ(live.receiver().lever_arm_m, Eigen::Vector3d(1.5, -0.25, 0.75));
  EXPECT_EQ(o.clock.bias_s, 0.001);
  EXPECT_EQ(o.clock.drift, 2e-7);
  EXPECT_EQ(o.clock.drift_walk, 3e-9);
  EXPECT_FALSE(o.noise.enabled);
  EXPECT_EQ(o.noise.ou.theta_per_s, 0.05);
  EXPECT_EQ(o.noise.ou.mu_m, 0.3);
  EXPECT_EQ(o.noise.ou.sigma_m_per_sqrt_s, 0.4);
  EXPECT_EQ(o.noise.doppler_sigma_hz, 0.6);
  EXPECT_TRUE(o.noise.drift_enabled);
  const propagation::PropagationOptions& p = live.receiver().propagation;
  EXPECT_EQ(p.model, propagation::Model::Specular);  // overrides the profile's
  EXPECT_EQ(p.reflection_order, 0);
  EXPECT_EQ(p.max_range_m, 450);
  EXPECT_NEAR(degrees(p.max_incidence_rad), 80, 1e-12);
  EXPECT_TRUE(p.ground_reflection);
  EXPECT_THAT(s.warnings, IsEmpty());
}

TEST(HostSettings, ABaseStandsInTheWorld) {
  const simulation::RunnerConfig live =
      read_plugin_settings(
          plugin("<base><profile>survey</profile><fixed><east_m>400</east_m><north_m>-20</north_m>"
                 "<up_m>12</up_m></fixed></base><corrections><from>base</from></corrections>"),
          {false, kName, {}})
          .live;
  ASSERT_NE(live.base(), nullptr);
  EXPECT_EQ(live.base()->options.name, "base");
  EXPECT_EQ(*live.base()->fixed->local_m, Eigen::Vector3d(400, -20, 12));
  EXPECT_TRUE(live.base()->options.independent_noise);
  EXPECT_EQ(live.receiver().options.corrections.from, "base");
}

TEST(HostSettings, StartByWeek) {
  const HostSettings s = read("<start><week>2051</week><tow>46701</tow></start>");
  EXPECT_EQ(*s.live.start, geodesy::GpsTime::from_week(2051, 46701));
}

TEST(HostSettings, FilesLieBesideTheWorldOrOnGazebosPaths) {
  const TemporaryFolder folder;
  write(folder / "world/nav/a.rnx");
  write(folder / "world/b c.rnx");
  write(folder / "models/site/orbits.sp3");
  write(folder / "resources/far.rnx");
  write(folder / "ros/nav_data/a.rnx");
  const Variable models("GAZEBO_MODEL_PATH", (folder / "models").string());
  const Variable resources("GAZEBO_RESOURCE_PATH", (folder / "resources").string());
  const Variable packages("ROS_PACKAGE_PATH", "/nowhere:" + (folder / "ros/nav_data").string());
  const auto sky = [&](const std::string& children) {
    return read("<sky>" + children + "</sky>", false, folder / "world").live.sky;
  };
  const auto navigation = [](const std::string& name) { return "<navigation>" + name + "</navigation>"; };
  EXPECT_THAT(sky(navigation("nav/a.rnx") + navigation("b c.rnx")).navigation,
              ElementsAre(folder / "world/nav/a.rnx", folder / "world/b c.rnx"));
  EXPECT_THAT(sky(navigation((folder / "resources/far.rnx").string())).navigation,
              ElementsAre(folder / "resources/far.rnx"));
  EXPECT_THAT(sky(navigation("file://" + (folder / "resources/far.rnx").string())).navigation,
              ElementsAre(folder / "resources/far.rnx"));
  EXPECT_THAT(sky(navigation("far.rnx")).navigation, ElementsAre(folder / "resources/far.rnx"));
  EXPECT_THAT(sky(navigation("package://nav_data/a.rnx") + "<allow_stale>1</allow_stale>").navigation,
              ElementsAre(folder / "ros/nav_data/a.rnx"));
  EXPECT_TRUE(sky(navigation("far.rnx") + "<allow_stale>1</allow_stale>").allow_stale);
  EXPECT_EQ(sky("<sp3>model://site/orbits.sp3</sp3>").sp3,
            std::vector<std::filesystem::path>{folder / "models/site/orbits.sp3"});
  std::ofstream(folder / "world/mine.yaml") << "description: d\nmin_satellites: 7\n";
  std::ofstream(folder / "resources/bad.yaml") << "description: d\nmin_satellites: x\n";
  const auto satellites = [&](const std::string& profile) {
    return read("<profile>" + profile + "</profile>", false, folder / "world")
        .live.receiver()
        .options.fix.min_satellites;
  };
  EXPECT_EQ(satellites("mine.yaml"), 7);
  EXPECT_EQ(satellites("./mine.yaml"), 7);
  try {
    (void)satellites("bad.yaml");
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr((folder / "resources/bad.yaml").string() + ":2: min_satellites: 'x'"));
  }
  try {
    (void)sky(navigation("nav/b.rnx"));
    FAIL();
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), AllOf(HasSubstr(kName + ": <sky><navigation>: there is no file 'nav/b.rnx'"),
                                HasSubstr((folder / "world/nav/b.rnx").string()),
                                HasSubstr((folder / "resources/nav/b.rnx").string()),
                                HasSubstr("GAZEBO_RESOURCE_PATH")));
  }
  try {
    (void)sky(navigation("nav"));
    FAIL() << "a folder is no file";
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("there is no file 'nav'"));
  }
}

TEST(HostSettings, FilesLieBesideTheModelsOwnFile) {
  const TemporaryFolder folder;
  write(folder / "a.rnx");
  const sdf::ElementPtr element = plugin("<sky><navigation>a.rnx</navigation></sky>");
  element->SetFilePath((folder / "model.sdf").string());
  EXPECT_THAT(read_plugin_settings(element, {false, kName, "/nowhere", {}}).live.sky.navigation,
              ElementsAre(folder / "a.rnx"));
}

TEST(HostSettings, TheOlderPrototypesNames) {
  const HostSettings s = read(R"(
    <frameName>gps_frame</frameName><topicName>/uav/scan</topicName><robotNamespace>/uav</robotNamespace>
    <offsetTopicName>offset</offsetTopicName><satRayTopicName>rays</satRayTopicName>
    <errorScale>2</errorScale>)");
  EXPECT_EQ(s.frame_id, "gps_frame");
  EXPECT_EQ(s.ros_namespace, "/uav");
  EXPECT_THAT(s.remappings, ElementsAre(Pair("~/out", "/uav/scan")));
  EXPECT_TRUE(s.publish_scan);
  EXPECT_FALSE(s.publish_px4);
  EXPECT_THAT(s.warnings, ElementsAre(AllOf(HasSubstr("<offsetTopicName>"), HasSubstr("gnss_multipath")),
                                      AllOf(HasSubstr("<satRayTopicName>"), HasSubstr("<visuals><rays>")),
                                      AllOf(HasSubstr("<errorScale>"), HasSubstr("<bubble_scale>"))));
}

TEST(HostSettings, Px4sGpsPluginNeedsOnlyItsLineExchanged) {
  // The children that models/gps/gps.sdf of PX4's Gazebo Classic models gives its plugin.
  const std::string children = R"(
    <robotNamespace></robotNamespace>
    <gpsNoise>1</gpsNoise>
    <gpsXYRandomWalk>2.0</gpsXYRandomWalk>
    <gpsZRandomWalk>4.0</gpsZRandomWalk>
    <gpsXYNoiseDensity>2.0e-4</gpsXYNoiseDensity>
    <gpsZNoiseDensity>4.0e-4</gpsZNoiseDensity>
    <gpsVXYNoiseDensity>0.2</gpsVXYNoiseDensity>
    <gpsVZNoiseDensity>0.4</gpsVZNoiseDensity>)";
  const HostSettings s = read(children);
  EXPECT_TRUE(s.publish_px4);
  EXPECT_EQ(s.ros_namespace, "");
  EXPECT_TRUE(s.live.receiver().options.noise.enabled);
  EXPECT_THAT(s.warnings, ElementsAre(AllOf(HasSubstr("<gpsXYRandomWalk>, <gpsZRandomWalk>"),
                                            HasSubstr("<gpsVZNoiseDensity> without effect"),
                                            HasSubstr("<noise><sigma_m_per_sqrt_s>"))));
  EXPECT_FALSE(read(children + "<publishers><px4>0</px4></publishers>").publish_px4);
  const HostSettings other = read("<gpsNoise>0</gpsNoise><topic>gps1</topic><update_rate>5</update_rate>");
  EXPECT_TRUE(other.publish_px4);
  EXPECT_FALSE(other.live.receiver().options.noise.enabled);
  EXPECT_EQ(other.px4_topic, "gps1");
  EXPECT_EQ(other.live.rate_hz, 5);
  EXPECT_THAT(read("<homeLatitude>47</homeLatitude>").warnings,
              ElementsAre(AllOf(HasSubstr("<homeLatitude>"), HasSubstr("<origin_latitude>"))));
}

TEST(HostSettings, UnknownElementsWarnByNameAndStopNothing) {
  const HostSettings s = read(R"(
    <sattNum>8</sattNum><max_range>5</max_range>
    <noise><sigmma_m_per_sqrt_s>1</sigmma_m_per_sqrt_s><elevation_mask_deg>3</elevation_mask_deg>
      <mu_m>0.5</mu_m></noise>
    <propagation><max_range>5</max_range></propagation>
    <zzz_unheard_of><mu_m>3</mu_m></zzz_unheard_of>)");
  EXPECT_EQ(s.live.receiver().options.noise.ou.mu_m, 0.5);
  EXPECT_THAT(
      s.warnings,
      ElementsAre(
          "<sattNum> is unknown and has no effect; did you mean <satNum>?",
          "<max_range> is unknown and has no effect",
          "<noise><sigmma_m_per_sqrt_s> is unknown and has no effect; did you mean "
          "<noise><sigma_m_per_sqrt_s>?",
          "<noise><elevation_mask_deg> is unknown and has no effect; did you mean <elevation_mask_deg>?",
          "<propagation><max_range> is unknown and has no effect; did you mean "
          "<propagation><max_range_m>?",
          "<zzz_unheard_of> is unknown and has no effect"));
}

struct Wrong {
  const char* children;
  const char* where;
  const char* problem;
  const char* hint;
};

TEST(HostSettings, AttributesWarnAndStopNothing) {
  const HostSettings settings =
      read("<noise enabled='false'><theta_per_s unit='1/s'>0.1</theta_per_s></noise><name>roof</name>");
  EXPECT_EQ(settings.live.receiver().options.noise.ou.theta_per_s, 0.1);
  EXPECT_THAT(settings.warnings,
              ElementsAre("the attribute enabled=\"false\" of <noise> has no effect; write "
                          "<noise><enabled>false</enabled>",
                          AllOf(HasSubstr("unit"), HasSubstr("<noise><theta_per_s>"))));
  const sdf::ElementPtr own = sensor("<canyon profile='ideal'/>")->GetElement("canyon");
  EXPECT_THAT(read_plugin_settings(own, {false, kName, {}, gazebos_paths()}).warnings,
              ElementsAre(HasSubstr("write <canyon><profile>ideal</profile>")));
}

TEST(HostSettings, WhatASensorSaysOfCanyonIsChecked) {
  const auto refusal = [](const std::string& children) -> std::string {
    try {
      check_sensor(sensor(children), kName);
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_EQ(refusal(""), "");
  EXPECT_EQ(refusal("<canyon><profile>ideal</profile></canyon>"), "");
  EXPECT_THAT(refusal("<canyon/><canyon><profile>ideal</profile></canyon>"),
              AllOf(HasSubstr(kName), HasSubstr("twice")));
  EXPECT_THAT(refusal("<canyon><serve>all</serve></canyon>"),
              AllOf(HasSubstr("<serve>"), HasSubstr("<plugin>")));
  EXPECT_EQ(frame_of(sensor(""), "car::base::gps"), "car::base::gps");
  EXPECT_EQ(frame_of(sensor("<gz_frame_id>gps_link</gz_frame_id>"), "car::base::gps"), "gps_link");
  EXPECT_EQ(frame_of(sensor("<ignition_frame_id>old</ignition_frame_id>"), "car::base::gps"), "old");
}

TEST(HostSettings, WrongValuesNamePluginElementAndCure) {
  const std::vector<Wrong> cases{
      // The scenario's own checks, with names of SDF.
      {"<noise><sigma_m_per_sqrt_s>-1</sigma_m_per_sqrt_s></noise>", "<noise><sigma_m_per_sqrt_s>",
       "-1 is out of range", "at least 0"},
      {"<min_satellites>x</min_satellites>", "<min_satellites>", "'x' is not a whole number", ""},
      {"<elevation_mask_deg>10 deg</elevation_mask_deg>", "<elevation_mask_deg>", "'10 deg' is not a number",
       "the unit is in the element's name"},
      {"<propagation><model>miror</model></propagation>", "<propagation><model>", "'miror' is unknown",
       "did you mean 'mirror'?"},
      {"<profile>papre</profile>", "<profile>", "'papre' is unknown", "did you mean 'paper'?"},
      {"<name>a/b</name>", "<name>", "'a/b' cannot name a folder", "letters"},
      {"<rate_hz>0</rate_hz>", "<rate_hz>", "0 is out of range", "above 0"},
      {"<update_rate>0</update_rate>", "<update_rate>", "0 is out of range", "above 0"},
      {"<seed>-3</seed>", "<seed>", "-3 is out of range", ""},
      {"<start>yesterday</start>", "<start>", "yesterday", ""},
      {"<start><tow>5</tow></start>", "<start>", "'week' is missing", "give week and tow"},
      {"<sky><nominal>0</nominal></sky>", "<sky><nominal>", "is false, but there is no other source", ""},
      {"<sky><systems>GPS Galilei</systems></sky>", "<sky><systems>", "Galilei", ""},
      {"<sky><allow_stale>1</allow_stale></sky>", "<sky><allow_stale>", "has no effect with", "docs/sdf.md"},
      {"<satAzimuth>1 2</satAzimuth>", "<satAzimuth>", "frozen needs satAzimuth and satElevation", "radians"},
      {"<satNum>2</satNum>", "<satNum>", "frozen needs satAzimuth and satElevation", "radians"},
      {"<satAzimuth>1 90</satAzimuth><satElevation>1 1</satElevation>", "<satAzimuth>", "90 is out of range",
       "radians"},
      {"<satAzimuth>1, 2</satAzimuth><satElevation>1 1</satElevation>", "<satAzimuth>",
       "'1,' is not a number", ""},
      {"<satNum>3</satNum><satAzimuth>1 2</satAzimuth><satElevation>1 1</satElevation>", "<satNum>",
       "2 azimuths and 2 elevations for 3", ""},
      {"<sky><nominal>1</nominal></sky><satAzimuth>1</satAzimuth><satElevation>1</satElevation>",
       "<satAzimuth>", "conflicts with 'nominal'", "keep one"},
      // Booleans, numbers, choices of the adapter's own.
      {"<noise><enabled>yes</enabled></noise>", "<noise><enabled>", "'yes' is neither true nor false",
       "true"},
      {"<disableNoise>2</disableNoise>", "<disableNoise>", "'2' is neither true nor false", ""},
      {"<gpsNoise>on</gpsNoise>", "<gpsNoise>", "'on' is neither true nor false", ""},
      {"<vehicle_blocks>-</vehicle_blocks>", "<vehicle_blocks>", "'-' is neither true nor false", ""},
      {"<ray_engine>embre</ray_engine>", "<ray_engine>", "'embre' is unknown", "did you mean 'embree'?"},
      {"<geometry>Visual</geometry>", "<geometry>", "'Visual' is unknown", "collision, visual"},
      {"<ray_engine>physics</ray_engine>", "<ray_engine>", "no facets for the specular model",
       "propagation.model"},
      {"<output_type>sensor_msgs/PointCloud</output_type>", "<output_type>",
       "'sensor_msgs/PointCloud' is unknown", "known: sensor_msgs/LaserScan"},
      {"<pose_timeout_s>0</pose_timeout_s>", "<pose_timeout_s>", "0 is out of range", ""},
      {"<pose_timeout_s>nan</pose_timeout_s>", "<pose_timeout_s>", "'nan' is not a number", ""},
      {"<pose_topic>/a b</pose_topic>", "<pose_topic>", "contains blanks", ""},
      {"<publishers><nmea_port>65536</nmea_port></publishers>", "<publishers><nmea_port>",
       "65536 is out of range", "65535"},
      {"<publishers><stream>nmae=pty:</stream></publishers>", "<publishers><stream>", "nmae",
       "did you mean 'nmea'"},
      {"<publishers><nmea_port>1.5</nmea_port></publishers>", "<publishers><nmea_port>",
       "'1.5' is not a whole number", ""},
      {"<visuals><bubble_scale>0</bubble_scale></visuals>", "<visuals><bubble_scale>", "out of range", ""},
      {"<visuals><ray_length_m>1e6</ray_length_m></visuals>", "<visuals><ray_length_m>", "out of range", ""},
      {"<visuals><ray_length_m>-3</ray_length_m></visuals>", "<visuals><ray_length_m>", "out of range", ""},
      {"<origin_latitude>91</origin_latitude><origin_longitude>0</origin_longitude>", "<origin_latitude>",
       "91 is out of range", "90"},
      {"<origin_latitude>91</origin_latitude>", "<origin_latitude>", "without latitude or longitude", "give"},
      {"<origin_altitude>5</origin_altitude>", "<origin_altitude>", "without latitude or longitude", "give"},
      {"<ros><namespace>a-b</namespace></ros>", "<ros><namespace>", "'a-b' is not a valid ROS namespace",
       "letters"},
      {"<robotNamespace>a b</robotNamespace>", "<robotNamespace>", "'a b' is not a valid ROS namespace",
       "letters"},
      {"<ros><remapping>fix=gps</remapping></ros>", "<ros><remapping>", "'fix=gps' is not a remapping",
       "FROM:=TO"},
      {"<ros><remapping>fix:=</remapping></ros>", "<ros><remapping>", "'' is not a valid ROS name",
       "letters"},
      {"<ros><remapping>fix:=a</remapping><remapping>fix:=b</remapping></ros>", "<ros><remapping>",
       "'fix' is already mapped to 'a'", "keep one"},
      // The shape of the element.
      {"<seed>1</seed><seed>1</seed>", "<seed>", "is given twice", "keep one"},
      {"<noise><mu_m>1</mu_m></noise><noise><enabled>1</enabled></noise>", "<noise>", "is given twice", ""},
      {"<start>2019-04-28T12:58:03Z</start><start><week>1</week></start>", "<start>", "is given twice", ""},
      {"<satNum>1</satNum><sky><frozen><satNum>1</satNum></frozen></sky>", "<satNum>",
       "conflicts with 'sky.frozen.satNum'", "keep one"},
      {"<frameName>a</frameName><frame_id>b</frame_id>", "<frameName>", "conflicts with 'frame_id'", ""},
      {"<gpsNoise>1</gpsNoise><noise><enabled>1</enabled></noise>", "<gpsNoise>",
       "conflicts with 'noise.enabled'", ""},
      {"<seed/>", "<seed>", "has no value", "between its tags"},
      {"<pose_topic>  </pose_topic>", "<pose_topic>", "has no value", "between its tags"},
      {"<visuals>1</visuals>", "<visuals>", "has the text '1' instead of elements", "<rays>"},
      {"<noise>loud</noise>", "<noise>", "'loud' is neither true nor false", "write true"},
      {"<noise>1<enabled>1</enabled></noise>", "<noise>", "the text '1' is next to elements", "remove it"},
      {"<seed><value>1</value></seed>", "<seed>", "has elements instead of a value", "only the value"},
  };
  for (const Wrong& wrong : cases) {
    const std::string what = error_of(wrong.children);
    EXPECT_THAT(what, AllOf(testing::StartsWith(kName + ": " + wrong.where + ": "), HasSubstr(wrong.problem),
                            HasSubstr(wrong.hint)))
        << wrong.children;
    EXPECT_THAT(what, testing::Not(HasSubstr("scenario"))) << wrong.children;
  }
}

TEST(HostSettings, EmptyNamespacesAreTheDefault) {
  EXPECT_EQ(read("<ros><namespace/></ros>").ros_namespace, "");
  EXPECT_EQ(read("<ros><namespace/></ros><robotNamespace>/a</robotNamespace>").ros_namespace, "/a");
  EXPECT_EQ(read("<ros/>").ros_namespace, "");
}

TEST(HostSettings, AnOriginWithoutAltitudeLiesOnTheEllipsoid) {
  const HostSettings s =
      read("<origin_latitude>22.3</origin_latitude><origin_longitude>114.18</origin_longitude>");
  EXPECT_EQ(s.origin->height_m, 0);
  EXPECT_NEAR(degrees(s.origin->latitude_rad), 22.3, 1e-12);
}

TEST(HostSettings, ValuesAreTextWhateverIsInThem) {
  // Quotes, backslashes and colons have a meaning in YAML, and the scenario checks a name.
  EXPECT_THAT(error_of("<name>a: \"b\\</name>"), HasSubstr("<name>: 'a: \"b\\' cannot name a folder"));
  EXPECT_THAT(read("<satAzimuth>1\n\t 2</satAzimuth><satElevation>\n0.5 0.25\n</satElevation>")
                  .live.sky.frozen_azimuth_rad,
              ElementsAre(1, 2));
}

// --- the table
// -------------------------------------------------------------------------------------------------

// "<noise><enabled>"
std::string tag_of(const options::Key& key) {
  std::string tag;
  for (const std::string_view name : split(key.path, '.')) tag += "<" + std::string(name) + ">";
  return tag;
}

// A plugin of one element, made without parsing a world's text, which is slow.
sdf::ElementPtr plugin(const options::Key& key, const std::string& value) {
  auto root = std::make_shared<sdf::Element>();
  sdf::ElementPtr parent = root;
  for (const std::string_view name : split(key.path, '.')) {
    auto child = std::make_shared<sdf::Element>();
    child->SetName(std::string(name));
    parent->InsertElement(child);
    parent = child;
  }
  parent->AddValue("string", value, true);
  return root;
}

TEST(PluginKeys, HoldEveryKeyOfALiveReceiver) {
  for (const options::Key& live : options::describe<simulation::RunnerConfig>().keys) {
    EXPECT_THAT(plugin_keys(), testing::Contains(testing::Field(&options::Key::path, live.path)));
  }
}

TEST(PluginKeys, EveryElementOfTheTableIsRead) {
  // An element that is known but not read would cause an error of the scenario's reader. A value that no
  // element accepts shows that each is checked; elements that accept any word are listed.
  const std::vector<std::string> any_word{"frame_id",      "pose_topic",      "topic",     "frameName",
                                          "ros.namespace", "robotNamespace",  "topicName", "name",
                                          "link",          "corrections.from"};
  for (const options::Key& key : plugin_keys()) {
    if (std::find(any_word.begin(), any_word.end(), key.path) != any_word.end()) {
      EXPECT_THAT(read_plugin_settings(plugin(key, "word"), {false, kName, {}}).warnings, IsEmpty())
          << key.path;
    } else {
      EXPECT_THAT(error_of(plugin(key, "?"), key.path),
                  HasSubstr(kName + ": <" + key.path.substr(0, key.path.find('.'))))
          << key.path;
    }
  }
}

// An element rejects the same values as a receiver's key in YAML, and the message has the element's name.
TEST(PluginKeys, RefuseWhatIsOutOfRange) {
  int refused = 0;
  for (const options::Key& key : plugin_keys()) {
    // These need other elements, which other tests have.
    bool alone = key.path != "sky.allow_stale";
    for (const char* one : {"satNum", "satAzimuth", "satElevation", "origin_", "start."}) {
      alone = alone && key.path.find(one) == std::string::npos;
    }
    // Elements may be empty, and several.
    const bool text = key.type == options::Type::Text || key.type == options::Type::Texts;
    if (!alone || text) continue;
    for (const std::string& bad : test::bad_values(key)) {
      EXPECT_THAT(error_of(plugin(key, bad), key.path),
                  testing::StartsWith(kName + ": " + tag_of(key) + ": "))
          << bad;
      ++refused;
    }
  }
  EXPECT_GT(refused, 200);
}

TEST(PluginKeys, DocumentationHasTheSameTable) {
  test::expect_documented("sdf.md", "elements of a receiver", options::markdown(plugin_keys()));
}

}  // namespace
}  // namespace canyon::adapters
