#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <cmath>
#include <fstream>
#include <random>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/city/city.hpp"
#include "canyon/city/gazebo_export.hpp"
#include "canyon/city/gazebo_import.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::city {
namespace {

using geodesy::kPi;
using ::testing::Contains;
using ::testing::Each;
using ::testing::HasSubstr;
using ::testing::SizeIs;

class GazeboImport : public ::testing::Test {
 protected:
  std::filesystem::path write(const std::string& name, const std::string& text) {
    std::filesystem::create_directories((folder_ / name).parent_path());
    std::ofstream(folder_ / name, std::ios::binary) << text;
    return folder_ / name;
  }
  City world(const std::string& body) {
    return read_gazebo_world(
        write("w.world",
              "<?xml version='1.0'?>\n<sdf version='1.6'>\n<world name='w'>\n" + body + "\n</world></sdf>"));
  }
  std::string error(const std::string& body) {
    return test::refusal([&] { (void)world(body); });
  }

  canyon::test::TemporaryFolder folder_;
};

std::string model(const std::string& name, const std::string& pose, const std::string& geometry,
                  const std::string& kind = "collision") {
  return "<model name='" + name + "'><static>true</static><pose>" + pose + "</pose><link name='link'><" +
         kind + " name='c'><geometry>" + geometry + "</geometry></" + kind + "></link></model>\n";
}

constexpr const char* kBox = "<box><size>2 4 6</size></box>";

TEST_F(GazeboImport, PosesCompose) {
  // Model at (10, 20, 0) rotated 90 deg to the left, link 3 m along its x, box 1 m along that link's x.
  const City city = world(
      "<model name='m'><static>true</static><pose>10 20 0 0 0 1.5707963267948966</pose><link "
      "name='l'><pose>3 0 0 0 0 0"
      "</pose><collision name='c'><pose>1 0 3 0 0 0</pose><geometry>" +
      std::string(kBox) + "</geometry></collision></link></model>");
  // The box's 2 m are along north now: middle at (10, 24), 4 m wide to the east.
  EXPECT_LT((city.bounds().min - Eigen::Vector3d(8, 23, 0)).norm(), 1e-9);
  EXPECT_LT((city.bounds().max - Eigen::Vector3d(12, 25, 6)).norm(), 1e-9);
  ASSERT_EQ(city.mesh.objects.size(), 1U);
  EXPECT_EQ(city.mesh.objects[0].name, "m::l::c");
  EXPECT_EQ(city.mesh.objects[0].surface, Surface::Building);
}

TEST_F(GazeboImport, RollPitchYawFollowSdf) {
  // R = Rz(yaw) Ry(pitch) Rx(roll) (SDF specification, pose): a corner of the box by hand.
  const double roll = 0.1;
  const double pitch = 0.2;
  const double yaw = 0.3;
  const City city = world(model("m", "1 2 3 0.1 0.2 0.3", kBox));
  const Eigen::Matrix3d r =
      (Eigen::Matrix3d() << std::cos(yaw) * std::cos(pitch),
       std::cos(yaw) * std::sin(pitch) * std::sin(roll) - std::sin(yaw) * std::cos(roll),
       std::cos(yaw) * std::sin(pitch) * std::cos(roll) + std::sin(yaw) * std::sin(roll),
       std::sin(yaw) * std::cos(pitch),
       std::sin(yaw) * std::sin(pitch) * std::sin(roll) + std::cos(yaw) * std::cos(roll),
       std::sin(yaw) * std::sin(pitch) * std::cos(roll) - std::cos(yaw) * std::sin(roll), -std::sin(pitch),
       std::cos(pitch) * std::sin(roll), std::cos(pitch) * std::cos(roll))
          .finished();
  const Eigen::Vector3d corner = Eigen::Vector3d(1, 2, 3) + r * Eigen::Vector3d(1, 2, 3);
  double nearest = 1e9;
  for (const Eigen::Vector3d& v : city.mesh.vertices) nearest = std::min(nearest, (v - corner).norm());
  EXPECT_LT(nearest, 1e-12);
  const City degrees = world(
      "<model name='m'><static>true</static><pose degrees='true'>0 0 0 0 0 90</pose><link "
      "name='l'><collision "
      "name='c'><geometry>" +
      std::string(kBox) + "</geometry></collision></link></model>");
  EXPECT_NEAR(degrees.bounds().max.x(), 2, 1e-12);
}

TEST_F(GazeboImport, ReadsPrimitivesNestedModelsAndSurfaces) {
  const City city =
      world(model("tower", "0 0 50 0 0 0", "<cylinder><radius>5</radius><length>100</length></cylinder>") +
            model("ball", "50 0 10 0 0 0", "<sphere><radius>10</radius></sphere>") +
            model("pill", "80 0 10 0 0 0", "<capsule><radius>5</radius><length>10</length></capsule>") +
            model("egg", "90 0 10 0 0 0", "<ellipsoid><radii>2 3 10</radii></ellipsoid>") +
            model("roof", "95 0 10 0 0 0", "<cone><radius>2</radius><length>20</length></cone>") +
            model("terrain", "0 0 0 0 0 0", "<plane><normal>0 0 1</normal><size>500 400</size></plane>") +
            "<model name='outer'><static>1</static><pose>100 0 0 0 0 0</pose>" +
            model("inner", "0 7 3 0 0 0", kBox) + "</model>");
  ASSERT_EQ(city.mesh.objects.size(), 7U);
  EXPECT_EQ(city.mesh.objects[5].surface, Surface::Terrain);
  EXPECT_EQ(city.mesh.objects[6].name, "outer::inner::link::c");
  // Heights of the pill, the egg and the roof about their origins: 5 + 10 / 2, 10 and 20 / 2.
  for (const std::size_t object : {2U, 3U, 4U}) {
    double top = 0;
    const Object& o = city.mesh.objects[object];
    for (std::uint32_t t = o.first_triangle; t < o.first_triangle + o.triangle_count; ++t) {
      for (const std::uint32_t v : city.mesh.triangles[t]) top = std::max(top, city.mesh.vertices[v].z());
    }
    EXPECT_NEAR(top, 20, 1e-12) << o.name;
  }
  const CitySummary summary = summarize(city);
  EXPECT_EQ(summary.buildings, 6U);
  EXPECT_EQ(summary.terrain_triangles, 2U);
  EXPECT_NEAR(summary.highest_roof_m, 100, 1e-12);
  EXPECT_NEAR(summary.bounds.max.x(), 250, 1e-9);
}

TEST_F(GazeboImport, PrefersCollisionsToVisuals) {
  const std::string box_visual =
      "<visual name='v'><geometry><box><size>90 90 90</size></box></geometry></visual>";
  const City both = world("<model name='m'><static>true</static><link name='l'>" + box_visual +
                          "<collision name='c'><geometry>" + kBox + "</geometry></collision></link></model>");
  EXPECT_NEAR(both.bounds().max.x(), 1, 1e-12);
  const City visual =
      world("<model name='m'><static>true</static><link name='l'>" + box_visual + "</link></model>");
  EXPECT_NEAR(visual.bounds().max.x(), 45, 1e-12);
}

TEST_F(GazeboImport, ReadsMeshesWithScaleAndMirror) {
  write("meshes/corner.obj",
        "o wing\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  const City city =
      world(model("m", "0 0 0 0 0 0", "<mesh><uri>meshes/corner.obj</uri><scale>-2 3 4</scale></mesh>"));
  EXPECT_LT((city.bounds().min - Eigen::Vector3d(-2, 0, 0)).norm(), 1e-6);
  EXPECT_LT((city.bounds().max - Eigen::Vector3d(0, 3, 4)).norm(), 1e-6);
  double volume = 0;
  for (const auto& [a, b, c] : city.mesh.triangles) {
    volume += city.mesh.vertices[a].dot(city.mesh.vertices[b].cross(city.mesh.vertices[c])) / 6;
  }
  EXPECT_NEAR(volume, 4, 1e-6);  // 24 / 6, positive: front sides still face out
  EXPECT_EQ(city.mesh.objects[0].name, "m::link::c::wing");
}

TEST_F(GazeboImport, IncludesModelsFromBesideTheWorld) {
  write("house/model.config",
        "<?xml version='1.0'?><model><name>house</name><sdf version='1.4'>old.sdf</sdf>"
        "<sdf version='1.6'>model.sdf</sdf></model>");
  write("house/model.sdf", "<sdf version='1.6'>" + model("house", "0 0 3 0 0 0", kBox) + "</sdf>");
  write("plain.sdf", "<sdf version='1.6'>" + model("plain", "0 0 3 0 0 0", kBox) + "</sdf>");
  const City city = world(
      "<include><uri>model://house</uri></include>"
      "<include><uri>house</uri><name>second</name><pose>20 0 3 0 0 0</pose></include>"
      "<include><uri>plain.sdf</uri><pose>40 0 103 0 0 0</pose></include>"
      "<include><uri>model://sun</uri></include>"
      "<include><uri>model://ground_plane</uri></include>");
  ASSERT_EQ(city.mesh.objects.size(), 3U);
  EXPECT_EQ(city.mesh.objects[0].name, "house::link::c");
  EXPECT_EQ(city.mesh.objects[1].name, "second::link::c");
  EXPECT_NEAR(city.bounds().max.x(), 41, 1e-12);
  EXPECT_NEAR(city.bounds().max.z(), 106, 1e-12);
  EXPECT_NEAR(city.bounds().min.z(), 0, 1e-12);
  EXPECT_THAT(city.notes.lines(), Contains(HasSubstr("model://sun")));
}

TEST_F(GazeboImport, TakesOriginAndHeading) {
  const City city = world(
      "<spherical_coordinates><surface_model>EARTH_WGS84</surface_model><latitude_deg>22.3</latitude_deg>"
      "<longitude_deg>114.2</longitude_deg><elevation>5</elevation><heading_deg>90</heading_deg>"
      "</spherical_coordinates>" +
      model("m", "100 0 3 0 0 0", kBox));
  EXPECT_NEAR(city.frame.origin().latitude_rad, 22.3 * kPi / 180, 1e-15);
  EXPECT_EQ(city.frame.origin().height_m, 5);
  EXPECT_EQ(city.frame.heading_rad(), 0);
  // The world's x axis points north.
  EXPECT_NEAR(city.bounds().max.y(), 101, 1e-9);
  EXPECT_NEAR(city.bounds().max.x(), 2, 1e-9);
  EXPECT_THAT(world(model("m", "0 0 0 0 0 0", kBox)).notes.lines(),
              Contains(HasSubstr("no spherical_coordinates")));
}

TEST_F(GazeboImport, SaysWhatItLeavesOut) {
  const City city = world("<actor name='walker'/>" + model("m", "0 0 0 0 0 0", kBox) +
                          model("h", "0 0 0 0 0 0", "<heightmap><uri>file://x.png</uri></heightmap>"));
  EXPECT_THAT(city.notes.lines(), Contains(HasSubstr("1 <heightmap> geometries left out")));
  EXPECT_THAT(city.notes.lines(), Contains(HasSubstr("1 <actor> left out")));
}

TEST_F(GazeboImport, SaysWhatItCouldNotReadWhereNothingIsLeft) {
  EXPECT_THAT(error(model("m", "0 0 0 0 0 0", "<heightmap><uri>file://x.png</uri></heightmap>")),
              HasSubstr("has no triangle that is read; 1 <heightmap> geometries left out"));
}

/// By the divergence theorem: positive if front sides face outwards.
double volume_m3(const Mesh& mesh) {
  double six_volumes = 0;
  for (const auto& [a, b, c] : mesh.triangles)
    six_volumes += mesh.vertices[a].dot(mesh.vertices[b].cross(mesh.vertices[c]));
  return six_volumes / 6;
}

// An L of 300 m^2 with a yard of 16 m^2, 12 m high.
TEST_F(GazeboImport, ExtrudesPolylines) {
  const auto path = [](const char* points, const char* height) {
    std::string text = "<polyline>";
    for (const std::string_view point : split(points, ','))
      text += "<point>" + std::string(trim(point)) + "</point>";
    return text + "<height>" + height + "</height></polyline>";
  };
  const std::string outline = path("0 0, 20 0, 20 10, 10 10, 10 20, 0 20", "12");
  const std::string yard = path("2 2, 6 2, 6 6, 2 6", "12");
  const City house = world(model("house", "100 0 3 0 0 0", outline + yard));
  ASSERT_EQ(house.mesh.objects.size(), 1U);
  EXPECT_EQ(house.mesh.objects[0].name, "house::link::c");
  EXPECT_NEAR(volume_m3(house.mesh), (300 - 16) * 12, 1e-6);
  EXPECT_NEAR(house.bounds().min.z(), 3, 1e-12);
  EXPECT_NEAR(house.bounds().max.z(), 15, 1e-12);
  EXPECT_NEAR(house.bounds().max.x(), 120, 1e-12);
  // The opposite orientation, closed, and without the hole.
  const City rotated =
      world(model("m", "0 0 0 0 0 0", path("0 20, 10 20, 10 10, 20 10, 20 0, 0 0, 0 20", "5")));
  EXPECT_NEAR(volume_m3(rotated.mesh), 300 * 5, 1e-6);
  EXPECT_THAT(error(model("m", "0 0 0 0 0 0", path("0 0, 1 0", "3"))),
              HasSubstr("a polyline without height or with fewer than three points"));
  EXPECT_THAT(error(model("m", "0 0 0 0 0 0", path("0 0, 1 0, 2 0", "3"))), HasSubstr("cannot be extruded"));
  EXPECT_THAT(error(model("m", "0 0 0 0 0 0", "<polyline><point>0 0</point></polyline>")),
              HasSubstr("<polyline> without <height>"));
}

// Notepad's "Unicode".
TEST_F(GazeboImport, ReadsUtf16) {
  const std::string text = "<?xml version='1.0' encoding='UTF-16'?><sdf version='1.6'>" +
                           model("m", "0 0 0 0 0 0", kBox) + "</sdf>";
  std::string wide = "\xff\xfe";
  for (const char c : text) wide += {c, '\0'};
  write("wide.sdf", wide);
  EXPECT_EQ(read_gazebo_world(folder_ / "wide.sdf").mesh.objects.size(), 1U);
}

TEST_F(GazeboImport, ModelsStandWhereTheSavedStateSays) {
  const std::string state =
      "<state world_name='w'><model name='a'><pose>300 0 3 0 0 0</pose></model>"
      "<model name='b'><pose>50 0 3 0 0 0</pose></model></state>";
  const City city = world(model("a", "100 0 3 0 0 0", kBox) + model("b", "50 0 3 0 0 0", kBox) + state);
  EXPECT_NEAR(city.bounds().min.x(), 49, 1e-9);
  EXPECT_NEAR(city.bounds().max.x(), 301, 1e-9);
  EXPECT_THAT(city.notes.lines(), Contains("1 models have the poses of the world's <state>"));
}

TEST_F(GazeboImport, TheSavedStateDeletesAndAddsModels) {
  const std::string state = "<state world_name='w'><deletions><name>b</name></deletions><insertions>" +
                            model("c", "50 0 3 0 0 0", kBox) +
                            "</insertions><model name='a'><scale>2 2 2</scale></model></state>";
  const City city = world(model("a", "100 0 3 0 0 0", kBox) + model("b", "900 0 3 0 0 0", kBox) + state);
  ASSERT_EQ(city.mesh.objects.size(), 2U);
  EXPECT_NEAR(city.bounds().min.x(), 49, 1e-9);
  EXPECT_NEAR(city.bounds().max.x(), 101, 1e-9);
  EXPECT_THAT(city.notes.lines(), Contains("1 models that the world's <state> deletes left out"));
  EXPECT_THAT(city.notes.lines(), Contains(HasSubstr("<state> scales 'a', which is read unscaled")));
}

TEST_F(GazeboImport, OfAWorldOnlyWhatIsStatic) {
  const std::string car = "<model name='car'><link name='l'><collision name='c'><geometry>" +
                          std::string(kBox) + "</geometry></collision></link></model>";
  write("cart.sdf", "<sdf version='1.6'>" + car + "</sdf>");
  const City city =
      world(model("house", "0 0 3 0 0 0", kBox) + car + "<model name='parked'><static>false</static>" +
            model("inner", "9 0 0 0 0 0", kBox) +
            "</model><include><uri>cart.sdf</uri></include>"
            "<include><uri>cart.sdf</uri><name>kiosk</name><static>true</static></include>");
  ASSERT_EQ(city.mesh.objects.size(), 2U);
  EXPECT_EQ(city.mesh.objects[0].name, "house::link::c");
  EXPECT_EQ(city.mesh.objects[1].name, "kiosk::l::c");
  EXPECT_THAT(city.notes.lines(),
              Contains(HasSubstr("models that can move (without <static>true</static>) left out: 3 (car, "
                                 "parked, car)")));
  EXPECT_THAT(error(car), HasSubstr("has no triangle; set <static>true</static> in the models of the city"));
  // A single model is read as the city.
  EXPECT_EQ(read_gazebo_world(folder_ / "cart.sdf").mesh.objects.size(), 1U);
}

TEST_F(GazeboImport, NamesTheLineOfBadInput) {
  EXPECT_THAT(error("<model name='m'><link>"), HasSubstr("w.world:4"));
  EXPECT_THAT(error("<model name='m'><link>"), HasSubstr("not well-formed XML"));
  EXPECT_THAT(error(""), HasSubstr("has no triangle"));
  EXPECT_THAT(error("\n\n" + model("m", "0 0 x 0 0 0", kBox)), HasSubstr("w.world:6: <pose> has 'x'"));
  EXPECT_THAT(error(model("m", "0 0 0", kBox)), HasSubstr("<pose> has 3 numbers instead of 6"));
  EXPECT_THAT(error(model("m", "0 0 1e9 0 0 0", kBox)), HasSubstr("<pose> has '1e9'"));
  EXPECT_THAT(error(model("m", "0 0 0 0 0 0", "<box/>")), HasSubstr("<box> without <size>"));
  EXPECT_THAT(error(model("m", "0 0 0 0 0 0", "<box><size>1 0 1</size></box>")), HasSubstr("without extent"));
  EXPECT_THAT(error(model("m", "0 0 0 0 0 0", "<sphere><radius>-1</radius></sphere>")),
              HasSubstr("<sphere>: a sphere without extent"));
  EXPECT_THAT(error(model("m", "0 0 0 0 0 0", "<mesh><uri>none.dae</uri></mesh>")),
              HasSubstr("mesh 'none.dae' is not in the file's folder"));
  EXPECT_THAT(error("<include><uri>model://none</uri></include>"),
              HasSubstr("'model://none' is not in the file"));
  EXPECT_THAT(error("<include><uri>https://example.org/House</uri></include>"),
              HasSubstr("is not in the file"));
  EXPECT_THAT(
      error("<model name='m'><static>true</static><pose relative_to='other'>0 0 0 0 0 0</pose></model>"),
      HasSubstr("w.world:4: a pose is relative to 'other', which does not exist; there are 'm'"));
  EXPECT_THAT(error("<spherical_coordinates><latitude_deg>91</latitude_deg></spherical_coordinates>"),
              HasSubstr("latitude_deg"));
  EXPECT_THAT(error("<spherical_coordinates><world_frame_orientation>NED</world_frame_orientation>"
                    "</spherical_coordinates>"),
              HasSubstr("'NED'; Canyon reads ENU"));
  EXPECT_THROW((void)read_gazebo_world(folder_ / "missing.world"), InputError);
  EXPECT_THROW((void)read_gazebo_world(folder_.path()), InputError);
  try {
    (void)read_gazebo_world(write("r.urdf", "<robot name='r'/>"));
    ADD_FAILURE();
  } catch (const InputError& e) {
    EXPECT_THAT(e.what(), HasSubstr("begins with <robot>, not with <sdf>"));
  }
}

// One missing mesh of many omits only itself.
TEST_F(GazeboImport, MissingAndDamagedFilesCostThemselves) {
  write("bad.obj", "v 0 0 0\nf 1 2 3\n");
  write("broken/model.sdf", "<sdf version='1.6'><model name='b'><link>");
  const std::string house = model("house", "0 0 3 0 0 0", kBox);
  const City city =
      world(house + model("a", "0 0 0 0 0 0", "<mesh><uri>none.dae</uri></mesh>") +
            model("b", "0 0 0 0 0 0", "<mesh><uri>bad.obj</uri></mesh>") +
            model("c", "9 0 0 0 0 0", "<mesh><uri>bad.obj</uri></mesh>") +
            "<include><uri>model://none</uri></include><include><uri>model://broken</uri></include>"
            "<include><uri>model://broken</uri></include>");
  ASSERT_EQ(city.mesh.objects.size(), 1U);
  EXPECT_EQ(city.mesh.objects[0].name, "house::link::c");
  EXPECT_THAT(city.notes.lines(),
              Contains(HasSubstr("w.world:5: mesh 'none.dae' is not in the file's folder")));
  EXPECT_THAT(city.notes.lines(), Contains(HasSubstr("bad.obj:2: uses vertex 2 of 1")));
  EXPECT_THAT(city.notes.lines(), Contains(HasSubstr("'model://none' is not in the file's folder")));
  EXPECT_THAT(city.notes.lines(), Contains(HasSubstr("model.sdf:1: is not well-formed XML")));
  const std::vector<std::string> losses = city.notes.lines(ReadReport::Level::Loss);
  EXPECT_THAT(losses, SizeIs(4));
  EXPECT_THAT(losses, Each(HasSubstr("; left out: it blocks and reflects no signal")));
  EXPECT_THAT(losses, Contains(HasSubstr("signal (2 times)"))) << "included twice";
  std::string many = house;
  for (int i = 0; i < 9; ++i)
    many += model(std::to_string(i), "0 0 0 0 0 0", "<mesh><uri>" + std::to_string(i) + ".dae</uri></mesh>");
  EXPECT_THAT(world(many).notes.lines(ReadReport::Level::Loss), SizeIs(9));
}

TEST_F(GazeboImport, FilesOutsideTheWorldsFolderAreNotRead) {
  const std::string triangle = "v 0 0 0\nv 9 0 0\nv 0 9 0\nf 1 2 3\n";
  for (const char* name : {"out.obj", "w/in.obj", "w/models/other.obj"}) write(name, triangle);
  std::filesystem::create_symlink(folder_ / "out.obj", folder_ / "w/link.obj");
  const auto mesh = [](const std::string& uri) {
    return model("x", "0 0 0 0 0 0", "<mesh><uri>" + uri + "</uri></mesh>");
  };
  const auto world_entry = [&](const std::string& body) {
    return read_gazebo_world(
        write("w/w.world", "<sdf version='1.6'><world name='w'>" + body + "</world></sdf>"));
  };
  const std::string outside = (folder_ / "out.obj").string();
  for (const std::string& uri :
       {std::string("../out.obj"), outside, "file://" + outside, std::string("link.obj"),
        std::string("file://../out.obj"), std::string("model://../../out.obj")}) {
    EXPECT_THAT(test::refusal([&] { (void)world_entry(mesh(uri)); }), HasSubstr("is outside the folder"))
        << uri;
    EXPECT_THAT(world_entry(mesh("in.obj") + mesh(uri)).notes.lines(ReadReport::Level::Loss),
                Contains(HasSubstr("is outside the folder")))
        << uri;
  }
  // A model may name files in the folder of its world, and model:// covers the parent folder as before.
  write("w/models/m/model.sdf", "<sdf version='1.6'>" + mesh("../other.obj") + "</sdf>");
  EXPECT_EQ(world_entry("<include><uri>model://m</uri></include>").mesh.triangles.size(), 1U);
  EXPECT_EQ(world_entry(mesh("model://out.obj")).mesh.triangles.size(), 1U);
  write("w/models/m/model.config", "<model><sdf version='1.6'>../../../out.sdf</sdf></model>");
  write("out.sdf", "<sdf version='1.6'>" + mesh("in.obj") + "</sdf>");
  EXPECT_THAT(test::refusal([&] { (void)world_entry("<include><uri>model://m</uri></include>"); }),
              HasSubstr("is outside the folder"));
}

// 6,000 random points took 5.9 GB.
TEST_F(GazeboImport, TangledPolylinesAreRefused) {
  std::mt19937 random(1);
  std::string path;
  for (int i = 0; i < 6000; ++i)
    path += "<point>" + std::to_string(random() % 1000) + " " + std::to_string(random() % 1000) + "</point>";
  EXPECT_THAT(error(model("m", "0 0 0 0 0 0", "<polyline>" + path + "<height>3</height></polyline>")),
              HasSubstr("sides cross thousands of times"));
  std::string many;
  for (int i = 0; i < 600; ++i) many += "<polyline><point>0 0</point><height>3</height></polyline>";
  EXPECT_THAT(error(model("m", "0 0 0 0 0 0", many)), HasSubstr("600 <polyline> of a geometry"));
  // A star with as many corners, in order: twice the area of its 6,000 triangles about the middle.
  path.clear();
  for (int i = 0; i < 6000; ++i) {
    const double angle = i * kPi / 3000, radius = i % 2 == 0 ? 90 : 100;
    path += "<point>" + std::to_string(radius * std::cos(angle)) + " " +
            std::to_string(radius * std::sin(angle)) + "</point>";
  }
  const City star = world(model("m", "0 0 0 0 0 0", "<polyline>" + path + "<height>3</height></polyline>"));
  EXPECT_NEAR(volume_m3(star.mesh), 3 * 6000 * 0.5 * 90 * 100 * std::sin(kPi / 3000), 0.1);
}

constexpr const char* kShape = "<geometry><box><size>2 2 2</size></box></geometry>";

// X of the box's middle is the sum of the x along its frames.
TEST_F(GazeboImport, PosesRelativeToOtherFrames) {
  const auto middle = [&](const std::string& body) {
    const auto bounds = world(body).bounds();
    return Eigen::Vector3d(0.5 * (bounds.min + bounds.max));
  };
  const std::string shape = std::string("<collision name='c'>") + kShape + "</collision>";
  const std::string links =
      "<link name='base'><pose>1 0 0 0 0 0</pose></link>"
      "<link name='tower'><pose relative_to='base'>10 0 0 0 0 0</pose>" +
      shape + "</link>";
  const std::string first = "<model name='m'><static>true</static><pose>100 0 0 0 0 0</pose>";
  EXPECT_NEAR(middle(first + links + "</model>").x(), 111, 1e-9);
  // Rotated by 90 degrees to the left: 10 m along the base's x are 10 m along y.
  const std::string rotated =
      "<link name='base'><pose>1 0 0 0 0 1.5707963267948966</pose></link>"
      "<link name='tower'><pose relative_to='base'>10 0 0 0 0 0</pose>" +
      shape + "</link>";
  EXPECT_LT((middle(first + rotated + "</model>") - Eigen::Vector3d(101, 10, 0)).norm(), 1e-9);
  // Frames, attached and relative, of the model and of the world.
  EXPECT_NEAR(
      middle(
          first +
          "<link name='l'><pose>3 0 0 0 0 0</pose></link><frame name='f' attached_to='l'><pose>20 0 0 0 0 0"
          "</pose></frame><frame name='g'><pose relative_to='f'>5 0 0 0 0 0</pose></frame><link name='t'>"
          "<pose relative_to='g'>7 0 0 0 0 0</pose>" +
          shape + "</link></model>")
          .x(),
      135, 1e-9);
  EXPECT_NEAR(
      middle("<frame name='site'><pose>1000 0 0 0 0 0</pose></frame><model name='m'><static>true</static>"
             "<pose relative_to='site'>5 0 0 0 0 0</pose><link name='l'>" +
             shape + "</link></model>")
          .x(),
      1005, 1e-9);
  // Frames: another model's link, a joint (at its child), a collision in another link.
  EXPECT_NEAR(
      middle(
          "<model name='a'><pose>50 0 0 0 0 0</pose><link name='l'><pose>2 0 0 0 0 0</pose></link></model>"
          "<model name='m'><static>true</static><pose relative_to='a::l'>1 0 0 0 0 0</pose><link name='l'>" +
          shape + "</link></model>")
          .x(),
      53, 1e-9);
  EXPECT_NEAR(
      middle(first +
             "<link name='k'><pose>4 0 0 0 0 0</pose></link><joint name='j' type='fixed'><pose>1 0 0 0 "
             "0 0</pose><parent>world</parent><child>k</child></joint><link name='l'><collision name='c'>"
             "<pose relative_to='j'>2 0 0 0 0 0</pose>" +
             kShape + "</collision></link></model>")
          .x(),
      107, 1e-9);
  // The model's pose is that of its placement frame.
  EXPECT_NEAR(
      middle("<model name='m' placement_frame='foot'><static>true</static><pose>100 0 0 0 0 0</pose><link "
             "name='foot'><pose>30 0 0 0 0 0</pose></link><link name='l'>" +
             shape + "</link></model>")
          .x(),
      70, 1e-9);
  write("hut/model.sdf",
        "<sdf version='1.9'><model name='hut'><static>true</static><link name='door'><pose>4 0 0 0 0 "
        "0</pose></link><link name='l'>" +
            shape + "</link></model></sdf>");
  EXPECT_NEAR(
      middle("<frame name='site'><pose>1000 0 0 0 0 0</pose></frame><include><uri>model://hut</uri><pose "
             "relative_to='site'>1 0 0 0 0 0</pose><placement_frame>door</placement_frame></include>")
          .x(),
      997, 1e-9);
}

TEST_F(GazeboImport, FramesInACircleAreRefused) {
  EXPECT_THAT(
      error("<model name='m'><static>true</static><link name='a'><pose relative_to='b'>0 0 0 0 0 0</pose>"
            "</link><link name='b'><pose relative_to='a'>0 0 0 0 0 0</pose><collision name='c'>" +
            std::string(kShape) + "</collision></link></model>"),
      HasSubstr("w.world:4: poses are relative to each other in a circle: 'b' to 'a' to 'b'"));
  std::string deep = "<model name='m'><static>true</static>";
  for (int i = 0; i < 300; ++i) {
    deep += "<link name='" + std::to_string(i) + "'><pose relative_to='" + std::to_string(i + 1) +
            "'>0 0 0 0 0 0</pose><collision name='c'>" + kShape + "</collision></link>";
  }
  EXPECT_THAT(error(deep + "<link name='300'/></model>"), HasSubstr("more than 200 deep"));
}

TEST_F(GazeboImport, AModelThatIncludesItselfEnds) {
  write("loop/model.sdf",
        "<sdf version='1.6'><model "
        "name='loop'><static>true</static><include><uri>model://loop</uri></include></model></sdf>");
  EXPECT_THAT(error("<include><uri>model://loop</uri></include>"), HasSubstr("includes itself"));
}

TEST_F(GazeboImport, MutatedWorldsNeverCrash) {
  const std::string whole =
      "<?xml version='1.0'?><sdf version='1.6'><world "
      "name='w'><spherical_coordinates><latitude_deg>1</latitude_deg>"
      "<heading_deg>3</heading_deg></spherical_coordinates>" +
      model("a", "1 2 3 0.1 0.2 0.3", kBox) +
      model("b", "1 2 3 0 0 0", "<sphere><radius>2</radius></sphere>", "visual") +
      "<frame name='f' attached_to='a::link'><pose>1 0 0 0 0 0</pose></frame><model name='c' "
      "placement_frame='k'><static>true</static><pose relative_to='f'>1 0 0 0 0 0</pose><link "
      "name='k'/><link "
      "name='l'><pose relative_to='k'>1 0 0 0 0 0</pose><collision name='c'><geometry>" +
      std::string(kBox) + "</geometry></collision></link></model></world></sdf>";
  std::mt19937_64 random(7);
  for (int round = 0; round < 400; ++round) {
    std::string bad = whole;
    for (std::uint64_t n = 1 + random() % 3; n > 0; --n)
      bad[random() % bad.size()] = static_cast<char>(random());
    if (random() % 3 == 0) bad.resize(random() % bad.size());
    try {
      check_mesh(read_gazebo_world(write("f.world", bad)).mesh, "fuzzed");
    } catch (const InputError&) {
    }
  }
}

}  // namespace
}  // namespace canyon::city
