#include "adapters/gazebo_classic/world_geometry.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <fstream>
#include <functional>
#include <gazebo/common/Image.hh>
#include <gazebo/physics/RayShape.hh>
#include <limits>
#include <optional>
#include <string>
#include <utility>

#include "adapters/gazebo_classic/testing/in_process_server.hpp"
#include "canyon/base/geodesy/constants.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/environment.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

using Eigen::Vector3d;
using gazebo::physics::ModelPtr;
using gazebo::physics::WorldPtr;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr double kExact = 1e-3;

std::string world(const std::string& models) {
  return R"(<?xml version="1.0"?><sdf version="1.6"><world name="w"><gravity>0 0 0</gravity><physics type="ode">
<max_step_size>0.01</max_step_size><real_time_update_rate>0</real_time_update_rate></physics>)" +
         models + "</world></sdf>";
}

/// A model of one link "link" with one shape, as collision and visual of the shape's name.
std::string model(const std::string& name, bool is_static, const std::string& pose,
                  const std::string& geometry, const std::string& shape_pose = "0 0 0 0 0 0") {
  return fmt::format(R"(<model name="{0}"><static>{1}</static><pose>{2}</pose><link name="link">
<collision name="shape"><pose>{4}</pose><geometry>{3}</geometry></collision></link></model>)",
                     name, is_static, pose, geometry, shape_pose);
}
std::string box(const std::string& size) {
  return "<box><size>" + size + "</size></box>";
}

std::optional<raytrace::Hit> cast(const live::WorldScene& geometry, const Vector3d& origin,
                                  const Vector3d& towards) {
  return geometry.scene()->scene.cast({origin, towards.normalized()});
}
/// Range, negative if the triangle is hit from behind; infinite without a hit.
double range(const live::WorldScene& geometry, const Vector3d& origin, const Vector3d& towards) {
  const auto hit = cast(geometry, origin, towards);
  if (!hit) return std::numeric_limits<double>::infinity();
  return hit->front ? hit->range_m : -hit->range_m;
}
constexpr double kNothing = std::numeric_limits<double>::infinity();

/// The same ray by Gazebo's own physics engine: an independent check of positions of shapes.
double physics_range(const WorldPtr& world, const Vector3d& origin, const Vector3d& towards) {
  const auto ray = boost::dynamic_pointer_cast<gazebo::physics::RayShape>(
      world->Physics()->CreateShape("ray", gazebo::physics::CollisionPtr()));
  const Vector3d end = origin + 1000 * towards.normalized();
  ray->SetPoints({origin.x(), origin.y(), origin.z()}, {end.x(), end.y(), end.z()});
  double distance = 0;
  std::string entity;
  ray->GetIntersection(distance, entity);
  return entity.empty() ? kNothing : distance;
}

class WorldGeometryTest : public ::testing::Test {
 protected:
  static WorldPtr load(const std::string& models) { return server().load(world(models)); }
  static test::InProcessServer& server() { return test::InProcessServer::get(); }
  static std::shared_ptr<live::WorldScene> of(const WorldPtr& world, bool visual = false,
                                              double heading_rad = 0) {
    live::WorldFrame frame;
    frame.heading_rad = heading_rad;
    live::WorldScene::Options options{world->Name(), visual, frame};
    options.facades.mix = city::FacadeMix::AsGiven;
    return scene_of(world, options);
  }
  static std::shared_ptr<live::WorldScene> updated(const WorldPtr& world, bool visual = false,
                                                   double heading_rad = 0) {
    auto geometry = of(world, visual, heading_rad);
    geometry->update({});
    return geometry;
  }
  static std::filesystem::path write(const std::string& name, const std::string& text) {
    static canyon::test::TemporaryFolder folder;
    std::ofstream(folder / name, std::ios::binary) << text;
    return folder / name;
  }
  void TearDown() override { server().unload(); }
};

// -- shapes -------------------------------------------------------------------------------------------------

TEST_F(WorldGeometryTest, PrimitivesStandWhereGazeboHasThem) {
  const auto w =
      load(model("box", true, "10 0 3 0 0 0.5", box("2 4 6")) +
           model("drum", true, "0 20 0 0 0 0", "<cylinder><radius>2</radius><length>8</length></cylinder>",
                 "0 0 1 0 0 0") +
           model("ball", true, "-30 0 5 0 0 0", "<sphere><radius>4</radius></sphere>") +
           model("floor", true, "0 0 -7 0 0 0", "<plane><normal>0 0 1</normal><size>50 80</size></plane>"));
  const auto geometry = updated(w);
  const auto outside = [&](const Vector3d& origin, const Vector3d& towards, double expected,
                           double tolerance = kExact) {
    EXPECT_NEAR(range(*geometry, origin, towards), expected, tolerance);
    EXPECT_NEAR(physics_range(w, origin, towards), expected, kExact);
  };
  // Half the box's 2 m, along the box's own x axis.
  const Vector3d axis(std::cos(0.5), std::sin(0.5), 0);
  outside(Vector3d(10, 0, 4) - 9 * axis, axis, 8);
  outside({10, 0, 20}, {0, 0, -1}, 20 - 6);
  EXPECT_NEAR(range(*geometry, {10, 0, 3}, axis), -1, kExact);
  EXPECT_NEAR(range(*geometry, {10, 0, 3}, {0, 0, 1}), -3, kExact);
  // The drum's collision is 1 m above its link; rays at its edges (multiples of 360/32 deg) are exact,
  // between them the prism is short by 2 m * (1 - cos(pi / 32)).
  outside({0, 10, 0}, {0, 1, 0}, 8);
  outside({0, 20, 12}, {0, 0, -1}, 12 - 5);
  outside(Vector3d(0, 20, 0) - 10 * Vector3d(std::sin(geodesy::kPi / 32), std::cos(geodesy::kPi / 32), 0),
          {std::sin(geodesy::kPi / 32), std::cos(geodesy::kPi / 32), 0}, 8,
          2 * (1 - std::cos(geodesy::kPi / 32)) + kExact);
  EXPECT_NEAR(range(*geometry, {0, 20, 0}, {1, 0, 0}), -2, kExact);
  outside({-30, 0, 30}, {0, 0, -1}, 30 - 9);
  outside({0, 0, 5}, {-1, 0, 0}, 26);
  EXPECT_NEAR(range(*geometry, {-30, 0, 5}, {0, 1, 0}), -4, kExact);
  // The floor reaches 25 m in x and 40 m in y, as in SDF; ODE's own is infinite.
  outside({20, 30, 0}, {0, 0, -1}, 7);
  EXPECT_NEAR(range(*geometry, {20, 30, -10}, {0, 0, 1}), -3, kExact);
  EXPECT_EQ(range(*geometry, {26, 0, 0}, {0, 0, -1}), kNothing);
  EXPECT_EQ(range(*geometry, {0, 41, 0}, {0, 0, -1}), kNothing);
  EXPECT_THAT(geometry->take_notes(), IsEmpty());
  EXPECT_EQ(geometry->scene()->city.mesh.objects[0].name, "box::link::shape");
}

TEST_F(WorldGeometryTest, TiltedPlaneAndItsCut) {
  const auto w = load(
      model("endless", true, "0 0 0 0 0 0", "<plane><normal>0 0 1</normal><size>1e6 1e6</size></plane>") +
      model("wall", true, "100 0 50 0 0 0", "<plane><normal>-1 0 0</normal><size>40 40</size></plane>"));
  const auto geometry = updated(w);
  EXPECT_NEAR(range(*geometry, {4990, -4990, 10}, {0, 0, -1}), 10, kExact);
  EXPECT_EQ(range(*geometry, {5010, 0, 10}, {0, 0, -1}), kNothing);
  EXPECT_NEAR(range(*geometry, {0, 3, 50}, {1, 0, 0}), 100, kExact);
  EXPECT_NEAR(range(*geometry, {110, 3, 50}, {-1, 0, 0}), -10, kExact);
  EXPECT_THAT(geometry->take_notes(),
              ElementsAre(HasSubstr("'endless::link::shape' is a plane cut to 10 km")));
}

TEST_F(WorldGeometryTest, SurfacesByName) {
  const auto w =
      load(model("terrain_1", true, "0 0 0 0 0 0", "<plane><size>10 10</size></plane>") +
           model("underground", true, "20 0 0 0 0 0", box("1 1 1")) +
           model("car", false, "40 0 0 0 0 0", box("1 1 1")) +
           model("canyon_ground_plane", true, "0 0 -1 0 0 0", "<plane><size>900 900</size></plane>"));
  const auto geometry = updated(w);
  const city::Mesh& mesh = geometry->scene()->city.mesh;
  ASSERT_EQ(mesh.objects.size(), 2u);
  EXPECT_EQ(mesh.objects[0].surface, city::Surface::Terrain);
  EXPECT_EQ(mesh.materials.front(), city::Material::Ground);
  EXPECT_EQ(mesh.objects[1].surface, city::Surface::Building);
  ASSERT_EQ(geometry->scene()->scene.posed_instances().size(), 1u);
  EXPECT_EQ(geometry->scene()->scene.posed_instances()[0].mesh->objects[0].surface, city::Surface::Vehicle);
  EXPECT_EQ(range(*geometry, {100, 0, 10}, {0, 0, -1}), kNothing);
  EXPECT_THAT(geometry->take_notes(), ElementsAre(HasSubstr("'canyon_ground_plane'")));
}

/// A tetrahedron with its right-angled corner at (1, 2, 3) and legs of 6, 4, 2 m, and a sheet next to it.
constexpr const char* kObj = R"(o corner
v 1 2 3
v 7 2 3
v 1 6 3
v 1 2 5
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
)";

TEST_F(WorldGeometryTest, MeshWithScaleAndMirror) {
  const std::string file = write("corner.obj", kObj).string();
  const auto mesh = [&](const std::string& scale) {
    return "<mesh><uri>" + file + "</uri><scale>" + scale + "</scale></mesh>";
  };
  const auto w = load(model("plain", true, "0 0 0 0 0 0", mesh("1 1 1")) +
                      model("large", true, "100 0 0 0 0 1.5707963267948966", mesh("2 2 3")) +
                      model("mirrored", true, "0 100 0 0 0 0", mesh("-1 1 1")));
  const auto geometry = updated(w);
  const auto both = [&](const Vector3d& origin, const Vector3d& towards, double expected) {
    EXPECT_NEAR(range(*geometry, origin, towards), expected, kExact);
    EXPECT_NEAR(physics_range(w, origin, towards), std::abs(expected), kExact);
  };
  both({-4, 2.5, 3.2}, {1, 0, 0}, 5);
  both({2, 2.5, 0}, {0, 0, 1}, 3);
  // Inside, to the slope (x-1)/6 + (y-2)/4 + (z-3)/2 = 1: at x 2.5, y 3, z = 3 + 2 * (1 - 0.25 - 0.25).
  EXPECT_NEAR(range(*geometry, {2.5, 3, 3.5}, {0, 0, 1}), -0.5, kExact);
  // Doubled and rotated by 90 deg: the corner is at (100 - 4, 2, 9), its long leg runs along y.
  both({95, -10, 9.5}, {0, 1, 0}, 12);
  // Mirrored: the corner is at (-1, 102, 3) and the long leg runs to -7.
  both({4, 102.5, 3.2}, {-1, 0, 0}, 5);
  EXPECT_NEAR(range(*geometry, {-2.5, 103, 3.5}, {0, 0, 1}), -0.5, kExact);
  EXPECT_EQ(geometry->scene()->city.mesh.objects[0].name.substr(0, 20), "plain::link::shape::");
}

TEST_F(WorldGeometryTest, MeshThatIsInsideOutIsTurned) {
  std::string inside_out = kObj;
  for (const auto& [from, to] : {std::pair{"f 1 3 2", "f 1 2 3"},
                                 {"f 1 2 4", "f 1 4 2"},
                                 {"f 1 4 3", "f 1 3 4"},
                                 {"f 2 3 4", "f 2 4 3"}}) {
    inside_out.replace(inside_out.find(from), 7, to);
  }
  const auto w = load(model("m", true, "0 0 0 0 0 0",
                            "<mesh><uri>" + write("inside_out.obj", inside_out).string() + "</uri></mesh>"));
  const auto geometry = updated(w);
  EXPECT_NEAR(range(*geometry, {-4, 2.5, 3.2}, {1, 0, 0}), 5, kExact);
}

/// Written by `canyon city build c.obj --origin 22.3,114.2,10 -o town/` of a box (10..14, 20..26, 0..30) with
/// one wall of glass in the south and a tetrahedron of foliage; the link is at (2, 8, 15).
constexpr const char* kCanyonMesh = R"(<?xml version="1.0" encoding="UTF-8"?>
<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset>
<contributor><authoring_tool>Canyon</authoring_tool><comments>Canyon city, one object in each node. collision mesh</comments></contributor>
<created>1980-01-06T00:00:00Z</created><modified>1980-01-06T00:00:00Z</modified>
<unit name="meter" meter="1"/><up_axis>Z_UP</up_axis></asset>
<library_effects>
<effect id="glass-effect"><profile_COMMON><technique sid="common"><lambert><emission><color>0 0 0 1</color></emission>
<ambient><color>0.35 0.55 0.7 1</color></ambient><diffuse><color>0.35 0.55 0.7 1</color></diffuse></lambert></technique></profile_COMMON></effect>
<effect id="brick-effect"><profile_COMMON><technique sid="common"><lambert><emission><color>0 0 0 1</color></emission>
<ambient><color>0.6 0.3 0.22 1</color></ambient><diffuse><color>0.6 0.3 0.22 1</color></diffuse></lambert></technique></profile_COMMON></effect>
<effect id="wood-effect"><profile_COMMON><technique sid="common"><lambert><emission><color>0 0 0 1</color></emission>
<ambient><color>0.45 0.36 0.2 1</color></ambient><diffuse><color>0.45 0.36 0.2 1</color></diffuse></lambert></technique></profile_COMMON></effect>
</library_effects>
<library_materials><material id="glass" name="glass"><instance_effect url="#glass-effect"/></material>
<material id="brick" name="brick"><instance_effect url="#brick-effect"/></material>
<material id="wood" name="wood"><instance_effect url="#wood-effect"/></material></library_materials>
<library_geometries>
<geometry id="g0" name="Tower_A"><mesh><source id="g0-positions"><float_array id="g0-positions-array" count="24">8 12 -15
12 12 -15
12 12 15
8 12 15
12 18 -15
12 18 15
8 18 -15
8 18 15</float_array><technique_common><accessor source="#g0-positions-array" count="8" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<source id="g0-normals"><float_array id="g0-normals-array" count="36">0 -1 0
0 -1 0
1 0 0
1 0 0
0 1 0
0 1 0
-1 0 0
-1 0 0
0 0 1
0 0 1
0 0 -1
0 0 -1</float_array><technique_common><accessor source="#g0-normals-array" count="12" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="g0-vertices"><input semantic="POSITION" source="#g0-positions"/></vertices>
<triangles material="glass" count="2"><input semantic="VERTEX" source="#g0-vertices" offset="0"/><input semantic="NORMAL" source="#g0-normals" offset="1"/>
<p>0 0 1 0 2 0
0 1 2 1 3 1</p></triangles>
<triangles material="brick" count="10"><input semantic="VERTEX" source="#g0-vertices" offset="0"/><input semantic="NORMAL" source="#g0-normals" offset="1"/>
<p>1 2 4 2 5 2
1 3 5 3 2 3
4 4 6 4 7 4
4 5 7 5 5 5
6 6 0 6 3 6
6 7 3 7 7 7
3 8 2 8 5 8
3 9 5 9 7 9
0 10 6 10 4 10
0 11 4 11 1 11</p></triangles></mesh></geometry>
<geometry id="g1" name="foliage_x003A_Oak_7"><mesh><source id="g1-positions"><float_array id="g1-positions-array" count="12">-12 -18 -12
-11 -16 -12
-10 -18 -12
-11 -17 -9</float_array><technique_common><accessor source="#g1-positions-array" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<source id="g1-normals"><float_array id="g1-normals-array" count="12">0 0 -1
0 -0.948683 0.316228
0.884652 0.442326 0.147442
-0.884652 0.442326 0.147442</float_array><technique_common><accessor source="#g1-normals-array" count="4" stride="3"><param name="X" type="float"/><param name="Y" type="float"/><param name="Z" type="float"/></accessor></technique_common></source>
<vertices id="g1-vertices"><input semantic="POSITION" source="#g1-positions"/></vertices>
<triangles material="wood" count="4"><input semantic="VERTEX" source="#g1-vertices" offset="0"/><input semantic="NORMAL" source="#g1-normals" offset="1"/>
<p>0 0 1 0 2 0
0 1 2 1 3 1
2 2 1 2 3 2
1 3 0 3 3 3</p></triangles></mesh></geometry>
</library_geometries>
<library_visual_scenes><visual_scene id="scene" name="scene">
<node id="n0" name="Tower_A" type="NODE"><instance_geometry url="#g0"><bind_material><technique_common><instance_material symbol="glass" target="#glass"/><instance_material symbol="brick" target="#brick"/></technique_common></bind_material></instance_geometry></node>
<node id="n1" name="foliage_x003A_Oak_7" type="NODE"><instance_geometry url="#g1"><bind_material><technique_common><instance_material symbol="wood" target="#wood"/></technique_common></bind_material></instance_geometry></node>
</visual_scene></library_visual_scenes><scene><instance_visual_scene url="#scene"/></scene></COLLADA>
)";

TEST_F(WorldGeometryTest, CanyonsOwnMeshKeepsObjectsSurfacesAndMaterials) {
  const auto w = load(model("town", true, "2 8 15 0 0 0",
                            "<mesh><uri>" + write("town.dae", kCanyonMesh).string() + "</uri></mesh>"));
  const auto geometry = updated(w);
  const city::Mesh& mesh = geometry->scene()->city.mesh;
  ASSERT_EQ(mesh.objects.size(), 2u);
  EXPECT_EQ(mesh.objects[0].name, "Tower_A");
  EXPECT_EQ(mesh.objects[0].surface, city::Surface::Building);
  EXPECT_EQ(mesh.objects[0].triangle_count, 12u);
  EXPECT_EQ(mesh.objects[1].name, "Oak_7");
  EXPECT_EQ(mesh.objects[1].surface, city::Surface::Foliage);
  EXPECT_EQ(mesh.vertices.size(), 12u) << "vertices of one place are one";
  const auto south = cast(*geometry, {12, 0, 9}, {0, 1, 0});
  ASSERT_TRUE(south);
  EXPECT_NEAR(south->range_m, 20, kExact);
  EXPECT_TRUE(south->front);
  EXPECT_EQ(mesh.materials[south->triangle], city::Material::Glass);
  const auto north = cast(*geometry, {12, 40, 9}, {0, -1, 0});
  ASSERT_TRUE(north);
  EXPECT_NEAR(north->range_m, 14, kExact);
  EXPECT_EQ(mesh.materials[north->triangle], city::Material::Brick);
  EXPECT_EQ(mesh.materials.back(), city::Material::Wood);
}

TEST_F(WorldGeometryTest, SubmeshAlone) {
  const std::string file = write("pair.dae", kCanyonMesh).string();
  const auto submesh = [&](const std::string& name, bool centre) {
    return fmt::format("<mesh><uri>{}</uri><submesh><name>{}</name><center>{}</center></submesh></mesh>",
                       file, name, centre);
  };
  const auto w = load(model("oak", true, "0 0 0 0 0 0", submesh("foliage_x003A_Oak_7", false)) +
                      model("centred", true, "100 0 0 0 0 0", submesh("foliage_x003A_Oak_7", true)) +
                      model("missing", true, "200 0 0 0 0 0", submesh("Elm", false)));
  const auto geometry = updated(w);
  // The foliage's floor is at z -12, its top at -9; centred about its bounds at -1.5.
  EXPECT_NEAR(range(*geometry, {-11, -17, -20}, {0, 0, 1}), 8, kExact);
  EXPECT_EQ(range(*geometry, {10, 0, 0}, {0, 1, 0}), kNothing) << "the tower was not chosen";
  EXPECT_NEAR(range(*geometry, {100, 0, -20}, {0, 0, 1}), 18.5, kExact);
  EXPECT_NEAR(physics_range(w, {100, 0, -20}, {0, 0, 1}), 18.5, kExact);
  EXPECT_NEAR(range(*geometry, {210, 0, 0}, {0, 1, 0}), 12, kExact);
  EXPECT_THAT(geometry->take_notes(), ElementsAre(HasSubstr("names submesh 'Elm'")));
}

class WorldGeometryByEngine : public WorldGeometryTest, public ::testing::WithParamInterface<const char*> {};

TEST_P(WorldGeometryByEngine, Heightmap) {
  // 17 x 17 grey values 8 * column + 7 * (16 - row), at most 240, which Gazebo scales to the height of 12 m:
  // z = 12 * (128 * (x / 80 + 0.5) + 112 * (y / 40 + 0.5)) / 240 on 80 m x 40 m.
  std::vector<unsigned char> pixels;
  for (int row = 0; row < 17; ++row) {
    for (int column = 0; column < 17; ++column) {
      pixels.insert(pixels.end(), 3, static_cast<unsigned char>(8 * column + 7 * (16 - row)));
    }
  }
  const std::string file = write("hill.png", "").string();
  gazebo::common::Image picture;
  picture.SetFromData(pixels.data(), 17, 17, gazebo::common::Image::RGB_INT8);
  picture.SavePNG(file);
  std::string text =
      world(model("hill", true, "0 0 0 0 0 0",
                  "<heightmap><uri>" + file + "</uri><size>80 40 12</size><pos>0 0 2</pos></heightmap>"));
  text.replace(text.find("\"ode\""), 5, std::string("\"") + GetParam() + "\"");
  const auto w = server().load(text);
  ASSERT_EQ(w->Physics()->GetType(), GetParam());
  const auto geometry = updated(w);
  const auto height = [](double x, double y) {
    return 2 + 12 * (128 * (x / 80 + 0.5) + 112 * (y / 40 + 0.5)) / 240;
  };
  for (const auto& [x, y] : {std::pair{0.3, 0.2}, {-31.0, 13.3}, {22.2, -17.7}, {38.0, 18.5}}) {
    EXPECT_NEAR(range(*geometry, {x, y, 50}, {0, 0, -1}), 50 - height(x, y), kExact);
    // Bullet leaves out <pos> and centres heights, DART has no rays: Canyon's shapes are positioned as in SDF
    // in any case.
    if (std::string(GetParam()) == "ode") {
      EXPECT_NEAR(physics_range(w, {x, y, 50}, {0, 0, -1}), 50 - height(x, y), kExact);
    }
  }
  EXPECT_NEAR(range(*geometry, {1, 1, 0}, {0, 0, 1}), -height(1, 1), kExact);
  EXPECT_EQ(range(*geometry, {41, 0, 50}, {0, 0, -1}), kNothing);
  ASSERT_EQ(geometry->scene()->city.mesh.objects.size(), 1u);
  EXPECT_EQ(geometry->scene()->city.mesh.objects[0].surface, city::Surface::Terrain);
  EXPECT_EQ(geometry->scene()->scene.containment({1, 1, 3}), raytrace::Containment::UnderTerrain);
}
// Rows of heights have the opposite order in all engines except ODE.
INSTANTIATE_TEST_SUITE_P(Engines, WorldGeometryByEngine, ::testing::Values("ode", "bullet", "dart"));

TEST_F(WorldGeometryTest, PolylineWithAHole) {
  const auto path = [](const std::string& points) {
    std::string text = "<polyline><height>9</height>";
    for (std::size_t at = 0; at < points.size();) {
      const std::size_t end = std::min(points.find(',', at), points.size());
      text += "<point>" + points.substr(at, end - at) + "</point>";
      at = end + 1;
    }
    return text + "</polyline>";
  };
  // A square of 20 m with a square court of 8 m.
  const auto w = load(
      model("court", true, "0 0 1 0 0 0", path("-10 -10,10 -10,10 10,-10 10") + path("-4 -4,4 -4,4 4,-4 4")));
  const auto geometry = updated(w);
  const auto outside = [&](const Vector3d& origin, const Vector3d& towards, double expected) {
    EXPECT_NEAR(range(*geometry, origin, towards), expected, kExact);
    EXPECT_NEAR(physics_range(w, origin, towards), expected, kExact);
  };
  outside({-20, 1, 3}, {1, 0, 0}, 10);
  outside({7, 1, 30}, {0, 0, -1}, 20);
  outside({7, 1, -3}, {0, 0, 1}, 4);
  outside({0.5, 0.5, 3}, {0, 1, 0}, 3.5);
  EXPECT_EQ(range(*geometry, {0.5, 0.5, 30}, {0, 0, -1}), kNothing);
  EXPECT_NEAR(range(*geometry, {7, 1, 3}, {1, 0, 0}), -3, kExact);
  EXPECT_NEAR(range(*geometry, {7, 1, 3}, {-1, 0, 0}), -3, kExact);
}

TEST_F(WorldGeometryTest, WhatCannotBeTakenIsNamedOnce) {
  const auto w =
      load(model("lost", true, "0 0 0 0 0 0", "<mesh><uri>/nowhere/lost.dae</uri></mesh>") +
           model("flat", true, "0 0 0 0 0 0",
                 "<mesh><uri>" + write("flat.obj", kObj).string() + "</uri><scale>1 0 1</scale></mesh>") +
           R"(<model name="bare"><static>true</static><link name="link"/></model>)");
  const auto geometry = updated(w);
  EXPECT_THAT(geometry->take_notes(),
              ::testing::UnorderedElementsAre(
                  HasSubstr("'lost::link::shape' is left out: its mesh '/nowhere/lost.dae' is not found"),
                  HasSubstr("'flat::link::shape' is left out: a mesh with a scale of 0"),
                  HasSubstr("world 'w' has no collision geometry")));
  server().step();
  geometry->update({});
  EXPECT_THAT(geometry->take_notes(), IsEmpty());
  EXPECT_EQ(range(*geometry, {0, 0, 10}, {0, 0, -1}), kNothing);
}

TEST_F(WorldGeometryTest, VisualsByChoice) {
  const auto w = load(R"(<model name="m"><static>true</static><pose>10 0 0 0 0 0</pose><link name="l">
<collision name="c"><geometry><box><size>2 2 2</size></box></geometry></collision>
<visual name="v"><pose>0 0 0 0 0 0</pose><geometry><box><size>6 6 6</size></box></geometry></visual>
<visual name="mast"><pose>0 0 10 0 0 0</pose><geometry><cylinder><radius>1</radius><length>14</length></cylinder></geometry></visual>
</link></model>)" + model("unseen", true, "0 50 0 0 0 0", box("2 2 2")));
  const auto collisions = updated(w);
  const auto visuals = updated(w, true);
  EXPECT_NE(collisions, visuals);
  EXPECT_NEAR(range(*collisions, {0, 0, 0}, {1, 0, 0}), 9, kExact);
  EXPECT_NEAR(range(*visuals, {0, 0, 0}, {1, 0, 0}), 7, kExact);
  EXPECT_EQ(range(*collisions, {0, 0, 16}, {1, 0, 0}), kNothing);
  EXPECT_NEAR(range(*visuals, {0, 0, 16}, {1, 0, 0}), 9, kExact);
  EXPECT_NEAR(range(*collisions, {0, 40, 0}, {0, 1, 0}), 9, kExact);
  EXPECT_EQ(range(*visuals, {0, 40, 0}, {0, 1, 0}), kNothing);
  w->ModelByName("m")->SetScale({2, 1, 1});
  server().step();
  visuals->update({});
  EXPECT_NEAR(range(*visuals, {0, 0, 0}, {1, 0, 0}), 4, kExact);
}

TEST_F(WorldGeometryTest, BrokenFilesAreNamed) {
  // A server does not read files of visuals, so errors were not reported before.
  std::string models;
  for (const std::string name : {"cut.dae", "junk.obj", "junk.stl", "empty.dae"}) {
    const std::string text = name == "cut.dae"     ? std::string(kCanyonMesh).substr(0, 3000)
                             : name == "empty.dae" ? ""
                                                   : std::string("\x01\x02junk\n\nno mesh at all\n");
    models += "<model name='" + name.substr(0, name.find('.')) + name.substr(name.size() - 3) +
              "'><static>true</static><link name='l'><visual name='v'><geometry><mesh><uri>" +
              write(name, text).string() + "</uri></mesh></geometry></visual></link></model>";
  }
  const auto w = load(models);
  const auto geometry = updated(w, true);
  EXPECT_EQ(range(*geometry, {12, 0, 0}, {0, 1, 0}), kNothing);
  const auto notes = geometry->take_notes();
  for (const auto* name : {"'cutdae::", "'junkobj::", "'junkstl::", "'emptydae::"}) {
    EXPECT_THAT(notes, Contains(HasSubstr(std::string(name) + "l::v' is left out")));
  }
}

// -- what changes -------------------------------------------------------------------------------------------

TEST_F(WorldGeometryTest, MovingBoxIsFollowedOnTheNextUpdate) {
  const auto w = load(model("house", true, "0 50 0 0 0 0", box("2 2 2")) +
                      model("cart", false, "10 0 0 0 0 0", box("2 2 2")));
  const auto geometry = updated(w);
  const auto generation = geometry->generation();
  const auto scene = geometry->scene();
  EXPECT_NEAR(range(*geometry, {0, 0, 0}, {1, 0, 0}), 9, kExact);
  EXPECT_EQ(cast(*geometry, {0, 0, 0}, {1, 0, 0})->instance, 1u);
  const ModelPtr cart = w->ModelByName("cart");
  cart->SetWorldPose({20, 0, 0, 0, 0, geodesy::kPi / 4});
  server().step();
  geometry->update({});
  EXPECT_NEAR(range(*geometry, {0, 0, 0}, {1, 0, 0}), 20 - std::sqrt(2), kExact);
  cart->SetLinearVel({0, 100, 0});  // 1 m in a step of 10 ms
  server().step();
  geometry->update({});
  EXPECT_NEAR(range(*geometry, {20, 30, 0}, {0, -1, 0}), 29 - std::sqrt(2), kExact);
  EXPECT_EQ(geometry->generation(), generation);
  EXPECT_EQ(geometry->scene(), scene);
}

TEST_F(WorldGeometryTest, TurnedByTheHeading) {
  const auto w = load(model("house", true, "10 0 0 0 0 0", box("2 2 2")) +
                      model("cart", false, "0 20 0 0 0 0", box("2 2 2")));
  const double heading = geodesy::radians(30);
  const auto geometry = updated(w, false, heading);
  // World x is 30 deg counter-clockwise from east.
  EXPECT_NEAR(range(*geometry, {0, 0, 0}, {std::cos(heading), std::sin(heading), 0}), 9, kExact);
  EXPECT_NEAR(range(*geometry, {0, 0, 0}, {-std::sin(heading), std::cos(heading), 0}), 19, kExact);
  EXPECT_EQ(range(*geometry, {0, 0, 0}, {1, 0, 0}), kNothing);
  EXPECT_NE(geometry, of(w)) << "another frame is another geometry";
}

TEST_F(WorldGeometryTest, ModelsComeAndGo) {
  const auto w =
      load(model("a", true, "10 0 0 0 0 0", box("2 2 2")) + model("b", true, "-10 0 0 0 0 0", box("2 2 2")));
  const auto geometry = updated(w);
  const auto generation = geometry->generation();
  const auto go_on = [&](unsigned count) {
    // Gazebo handles such requests five times per second of wall time.
    const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(20);
    while (w->ModelCount() != count && std::chrono::steady_clock::now() < deadline) server().step();
    ASSERT_EQ(w->ModelCount(), count);
    server().step();
    geometry->update({});
  };
  w->InsertModelString("<sdf version='1.6'>" + model("c", true, "0 10 0 0 0 0", box("2 2 2")) + "</sdf>");
  go_on(3);
  EXPECT_NEAR(range(*geometry, {0, 0, 0}, {0, 1, 0}), 9, kExact);
  EXPECT_EQ(geometry->generation(), generation) << "a latecomer is an instance";
  w->RemoveModel("c");
  go_on(2);
  EXPECT_EQ(range(*geometry, {0, 0, 0}, {0, 1, 0}), kNothing);
  EXPECT_EQ(geometry->generation(), generation);
  w->RemoveModel("a");
  go_on(1);
  EXPECT_EQ(range(*geometry, {0, 0, 0}, {1, 0, 0}), kNothing);
  EXPECT_NEAR(range(*geometry, {0, 0, 0}, {-1, 0, 0}), 9, kExact);
  EXPECT_EQ(geometry->generation(), generation + 1);
  // A new model with the old name is another model.
  w->InsertModelString("<sdf version='1.6'>" + model("b2", false, "0 -30 0 0 0 0", box("2 2 2")) + "</sdf>");
  go_on(2);
  EXPECT_NEAR(range(*geometry, {0, 0, 0}, {0, -1, 0}), 29, kExact);
}

TEST_F(WorldGeometryTest, ScaleIsFollowed) {
  const auto w = load(model("house", true, "10 0 0 0 0 0", box("2 2 2")) +
                      model("cart", false, "0 10 0 0 0 0", box("2 2 2")));
  const auto geometry = updated(w);
  const auto generation = geometry->generation();
  w->ModelByName("cart")->SetScale({1, 2, 1});
  server().step();
  geometry->update({});
  EXPECT_NEAR(range(*geometry, {0, 0, 0}, {0, 1, 0}), 8, kExact);
  EXPECT_EQ(geometry->generation(), generation);
  w->ModelByName("house")->SetScale({3, 1, 1});
  server().step();
  geometry->update({});
  EXPECT_NEAR(range(*geometry, {0, 0, 0}, {1, 0, 0}), 7, kExact);
  EXPECT_EQ(geometry->generation(), generation + 1);
  EXPECT_EQ(cast(*geometry, {0, 0, 0}, {1, 0, 0})->instance, 0u) << "still a part of the static city";
  // A model that continues to change becomes an instance, so that the city is not built again and again.
  for (const double scale : {5.0, 1.0, 2.0, 4.0}) {
    w->ModelByName("house")->SetScale({scale, 1, 1});
    server().step();
    geometry->update({});
    EXPECT_NEAR(range(*geometry, {0, 0, 0}, {1, 0, 0}), 10 - scale, kExact);
  }
  EXPECT_EQ(geometry->generation(), generation + 2);
}

TEST_F(WorldGeometryTest, ShapeChangedByMessage) {
  const auto w = load(model("cart", false, "0 10 0 0 0 0", box("2 2 2")) +
                      model("house", true, "10 0 0 0 0 0", box("2 2 2")));
  const auto geometry = updated(w);
  for (const auto* name : {"cart", "house"}) {
    gazebo::msgs::Geometry message;
    message.set_type(gazebo::msgs::Geometry::BOX);
    gazebo::msgs::Set(message.mutable_box()->mutable_size(), ignition::math::Vector3d(6, 6, 6));
    w->ModelByName(name)->GetLinks().front()->GetCollision("shape")->GetShape()->ProcessMsg(message);
  }
  server().step();
  geometry->update({});
  EXPECT_NEAR(range(*geometry, {0, 0, 0}, {0, 1, 0}), 7, kExact);
  // Static models are checked in turn.
  EXPECT_NEAR(range(*geometry, {0, 0, 0}, {1, 0, 0}), 7, kExact);
}

TEST_F(WorldGeometryTest, StaticModelThatIsMoved) {
  const auto w = load(model("house", true, "10 0 0 0 0 0", box("2 2 2")) +
                      model("other", true, "0 30 0 0 0 0", box("2 2 2")));
  const auto geometry = updated(w);
  const auto generation = geometry->generation();
  const auto before = geometry->scene();
  for (const double x : {20.0, 25.0, 30.0}) {
    w->ModelByName("house")->SetWorldPose({x, 0, 0, 0, 0, 0});
    server().step();
    geometry->update({});
    EXPECT_NEAR(range(*geometry, {0, 0, 0}, {1, 0, 0}), x - 1, kExact);
  }
  EXPECT_EQ(geometry->generation(), generation + 1) << "built anew once, an instance from then on";
  EXPECT_NE(geometry->scene(), before);
  EXPECT_NEAR(range(*geometry, {0, 0, 0}, {0, 1, 0}), 29, kExact);
}

TEST_F(WorldGeometryTest, NestedModelsAndSeveralLinks) {
  const auto w = load(R"(<model name="truck"><pose>0 100 0 0 0 0</pose>
<link name="cab"><collision name="c"><geometry><box><size>2 2 2</size></box></geometry></collision></link>
<link name="empty"/>
<model name="trailer"><pose>10 0 0 0 0 0</pose><link name="bed">
<collision name="c"><pose>0 0 1 0 0 0</pose><geometry><box><size>6 2 2</size></box></geometry></collision></link></model>
</model>)");
  const auto geometry = updated(w);
  EXPECT_EQ(geometry->scene()->scene.posed_instances().size(), 2u);
  EXPECT_NEAR(range(*geometry, {0, 90, 0}, {0, 1, 0}), 9, kExact);
  EXPECT_NEAR(range(*geometry, {10, 90, 1}, {0, 1, 0}), 9, kExact);
  EXPECT_NEAR(range(*geometry, {20, 100, 1}, {-1, 0, 0}), 7, kExact);
  w->ModelByName("truck")->SetWorldPose({0, 200, 0, 0, 0, 0});
  server().step();
  geometry->update({});
  EXPECT_NEAR(range(*geometry, {10, 190, 1}, {0, 1, 0}), 9, kExact);
  geometry->update(topmost_id(w->ModelByName("truck")));
  EXPECT_EQ(range(*geometry, {10, 190, 1}, {0, 1, 0}), kNothing);
  EXPECT_EQ(range(*geometry, {0, 190, 0}, {0, 1, 0}), kNothing);
}

TEST_F(WorldGeometryTest, ReceiversShareAndLeaveOutTheirOwnVehicles) {
  const auto w = load(model("one", false, "10 0 0 0 0 0", box("2 2 2")) +
                      model("two", false, "20 0 0 0 0 0", box("2 2 2")) +
                      model("base", true, "30 0 0 0 0 0", box("2 2 2")));
  const auto first = of(w);
  const auto second = of(w);
  EXPECT_EQ(first, second);
  const ModelPtr one = w->ModelByName("one"), two = w->ModelByName("two"), base = w->ModelByName("base");
  for (int i = 0; i < 3; ++i) {
    server().step();
    first->update(topmost_id(one));
    EXPECT_NEAR(range(*first, {0, 0, 0}, {1, 0, 0}), 19, kExact);
    EXPECT_NEAR(range(*first, {40, 0, 0}, {-1, 0, 0}), 9, kExact);
    second->update(topmost_id(two));
    EXPECT_NEAR(range(*second, {0, 0, 0}, {1, 0, 0}), 9, kExact);
    EXPECT_NEAR(range(*second, {19.5, 0, 0}, {1, 0, 0}), 9.5, kExact);
  }
  // A receiver on a static model makes that model an instance; it stays visible to others.
  const auto generation = first->generation();
  for (int i = 0; i < 2; ++i) {
    first->update(topmost_id(base));
    EXPECT_EQ(range(*first, {40, 0, 0}, {-1, 0, 0}), 19);
    first->update({});
    EXPECT_NEAR(range(*first, {40, 0, 0}, {-1, 0, 0}), 9, kExact);
    EXPECT_EQ(first->generation(), generation + 1);
  }
}

TEST_F(WorldGeometryTest, WorldResetAndThingsThatFlyAway) {
  const auto w = load(model("house", true, "0 50 0 0 0 0", box("2 2 2")) +
                      model("cart", false, "10 0 0 0 0 0", box("2 2 2")));
  const auto geometry = updated(w);
  const double offset = geometry->scene()->scene.surface_offset_m({0, 0, 0});
  w->ModelByName("cart")->SetWorldPose({3e5, 0, 0, 0, 0, 0});
  server().step();
  geometry->update({});
  EXPECT_EQ(range(*geometry, {0, 0, 0}, {1, 0, 0}), kNothing);
  EXPECT_LE(geometry->scene()->scene.surface_offset_m({0, 0, 0}), offset);
  EXPECT_THAT(geometry->take_notes(),
              ElementsAre(HasSubstr("'cart' is left out while it is more than 10 km")));
  const auto iterations = w->Iterations();
  w->Reset();
  for (int i = 0; i < 2; ++i) {
    server().step();
    geometry->update({});
    EXPECT_NEAR(range(*geometry, {0, 0, 0}, {1, 0, 0}), 9, kExact);
  }
  EXPECT_LE(w->Iterations(), iterations + 2);
  EXPECT_EQ(geometry->generation(), 1u);
}

TEST_F(WorldGeometryTest, AResetDoesNotMoveStaticModels) {
  // Poses that are not exact in float, in a chain of frames.
  const auto w = load(R"(<model name="house"><static>true</static><pose>10.1 0.3 0.7 0.1 0.2 0.3</pose>
<link name="l"><pose>0.1 0.7 0.3 1.1 0.3 2.9</pose><collision name="c"><geometry><box><size>2 2 2</size></box></geometry></collision></link>
<link name="wing"><pose>3.3 0.1 0.7 0.4 0.7 -2.3</pose>
<collision name="c"><geometry><box><size>2 2 2</size></box></geometry></collision></link></model>)");
  const auto geometry = updated(w);
  for (int i = 0; i < 3; ++i) {
    server().step(5);
    w->Reset();
    server().step();
    geometry->update({});
  }
  EXPECT_EQ(geometry->generation(), 1u);
  EXPECT_TRUE(geometry->scene()->scene.posed_instances().empty());
}

TEST_F(WorldGeometryTest, AnUnloadedWorldIsForgotten) {
  auto w = load(model("house", true, "10 0 0 0 0 0", box("2 2 2")));
  const auto before = updated(w);
  EXPECT_NEAR(range(*before, {0, 0, 0}, {1, 0, 0}), 9, kExact);
  const boost::weak_ptr<gazebo::physics::World> weak = w;
  w.reset();
  w = load(model("house", true, "20 0 0 0 0 0", box("2 2 2")));
  EXPECT_TRUE(weak.expired()) << "the geometry does not hold its world";
  before->update({});  // no models left to follow
  const auto after = updated(w);
  EXPECT_NE(before, after);
  EXPECT_NEAR(range(*after, {0, 0, 0}, {1, 0, 0}), 19, kExact);
}

TEST_F(WorldGeometryTest, RaysOfSensorsAreNothing) {
  const auto w = load(R"(<model name="lidar"><static>true</static><link name="l">
<sensor name="s" type="ray"><ray><scan><horizontal><samples>4</samples><min_angle>-1</min_angle><max_angle>1</max_angle></horizontal></scan>
<range><min>0.1</min><max>100</max></range></ray><always_on>1</always_on></sensor></link></model>)" +
                      model("house", true, "10 0 0 0 0 0", box("2 2 2")));
  server().step(3);
  const auto geometry = updated(w);
  EXPECT_EQ(geometry->scene()->city.mesh.objects.size(), 1u);
  EXPECT_THAT(geometry->take_notes(), IsEmpty());
}

// -- cost ---------------------------------------------------------------------------------------------------

TEST_F(WorldGeometryTest, CostInACityOf500HousesAnd20Vehicles) {
  std::string models;
  for (int i = 0; i < 500; ++i) {
    models += model(fmt::format("house_{}", i), true,
                    fmt::format("{} {} 15 0 0 0", 40 * (i % 25), 40 * (i / 25)), box("20 20 30"));
  }
  for (int i = 0; i < 20; ++i) {
    std::string links =
        R"(<link name="body"><collision name="c"><geometry><box><size>4 2 1.5</size></box></geometry></collision></link>)";
    for (int k = 0; k < 4; ++k) {
      links += fmt::format(
          R"(<link name="wheel_{0}"><pose>{1} {2} -0.7 1.5708 0 0</pose><collision name="c"><geometry><cylinder><radius>0.3</radius><length>0.2</length></cylinder></geometry></collision></link>)",
          k, k % 2 == 0 ? 1.5 : -1.5, k < 2 ? 1.2 : -1.2);
    }
    models +=
        fmt::format(R"(<model name="car_{0}"><pose>20 {1} 1 0 0 0</pose>{2}</model>)", i, 40 * i + 20, links);
  }
  const auto w = load(models);
  const auto geometry = of(w);
  std::vector<ModelPtr> cars;
  for (int i = 0; i < 20; ++i) cars.push_back(w->ModelByName(fmt::format("car_{}", i)));
  const auto microseconds = [](const std::function<void()>& work) {
    const auto begin = std::chrono::steady_clock::now();
    work();
    return std::chrono::duration<double, std::micro>(std::chrono::steady_clock::now() - begin).count();
  };
  const double first = microseconds([&] { geometry->update(topmost_id(cars[0])); });
  double moving = 0, still = 0, others = 0, none = 0;
  constexpr int kSteps = 50;
  for (int step = 0; step < kSteps; ++step) {
    for (std::size_t i = 0; i < cars.size(); ++i) {
      cars[i]->SetWorldPose({20.0 + step, 40.0 * static_cast<double>(i) + 20, 1, 0, 0, 0});
    }
    server().step();
    moving += microseconds([&] { geometry->update(topmost_id(cars[0])); });
    others += microseconds([&] {
      for (std::size_t i = 1; i < cars.size(); ++i) geometry->update(topmost_id(cars[i]));
    });
    none += microseconds([&] { geometry->update(topmost_id(cars.back())); });
  }
  for (const ModelPtr& car : cars) car->SetEnabled(false);
  for (int step = 0; step < kSteps; ++step) {
    server().step();
    still += microseconds([&] { geometry->update(topmost_id(cars.back())); });
  }
  fmt::print(
      "500 houses, 20 cars of 5 links: first update {:.1f} ms; then per step: cars moving {:.0f} us, each of "
      "19 "
      "more receivers {:.1f} us, the same again {:.2f} us; nothing moving {:.0f} us\n",
      first / 1e3, moving / kSteps, others / kSteps / 19, none / kSteps, still / kSteps);
  EXPECT_EQ(geometry->generation(), 1u) << "the city is built once";
  EXPECT_EQ(geometry->scene()->scene.posed_instances().size(), 95u) << "19 cars, one left out";
}

}  // namespace
}  // namespace canyon::adapters::gazebo_classic
