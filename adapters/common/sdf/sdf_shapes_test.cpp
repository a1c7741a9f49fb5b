#include "adapters/common/sdf/sdf_shapes.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <fstream>
#include <map>
#include <sdf/Collision.hh>
#include <sdf/Link.hh>
#include <sdf/Model.hh>
#include <sdf/Root.hh>
#include <sdf/World.hh>
#include <set>

#include "adapters/common/gazebo_math.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/gazebo_export.hpp"
#include "canyon/city/gazebo_import.hpp"
#include "canyon/city/mesh_marks.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::adapters {
namespace {

using Eigen::Vector3d;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// A tetrahedron with legs of 1 m, as in kCorner.
const MeshNode kNode{
    "wing", {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}}, {}};
constexpr const char* kCorner =
    "o wing\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

struct Files : ShapeFiles {
  std::optional<MeshFile> mesh(const std::string& uri, const std::string&) override {
    if (uri == "broken.obj") throw InputError("broken.obj", 3, "is broken");
    return uri == "corner.obj" ? std::optional(MeshFile{{kNode}, false}) : std::nullopt;
  }
  std::optional<MeshNode> extrude(const std::string&, const std::vector<Polyline>& polylines,
                                  double height) override {
    MeshNode node = kNode;
    for (Vector3d& v : node.vertices) v.z() *= height * static_cast<double>(polylines.size());
    return node;
  }
  std::optional<HeightGrid> heights(const std::string& uri, const std::string&, double size_z) override {
    if (uri != "hill.png") return std::nullopt;
    HeightGrid grid;
    grid.columns = grid.rows = 2;
    grid.height = [size_z](int column, int) { return column * size_z; };
    return grid;
  }
};

std::string model(const std::string& name, const std::string& pose, const std::string& geometry) {
  return "<model name='" + name + "'><static>true</static><link name='link'><collision name='c'><pose>" +
         pose + "</pose><geometry>" + geometry + "</geometry></collision></link></model>\n";
}

class SdfShapes : public testing::Test {
 protected:
  void load(const std::string& models) {
    text_ = "<?xml version='1.0'?>\n<sdf version='1.9'>\n<world name='w'>" + models + "</world></sdf>";
    root_ = sdf::Root();
    const sdf::Errors errors = root_.LoadSdfString(text_);
    for (const sdf::Error& error : errors) ADD_FAILURE() << error.Message();
  }
  template <class Visit>
  void for_each_collision(const Visit& visit) {
    const sdf::World& world = *root_.WorldByIndex(0);
    for (std::uint64_t i = 0; i < world.ModelCount(); ++i) {
      const sdf::Model& model = *world.ModelByIndex(i);
      visit(model.Name() + "::link::c", *model.LinkByIndex(0)->CollisionByIndex(0));
    }
  }
  city::Mesh mesh(ShapeFiles* files) {
    LinkShapes shapes(notes_);
    for_each_collision([&](const std::string& name, const sdf::Collision& collision) {
      add_shape(shapes, {name, Eigen::Affine3d(eigen(collision.RawPose()))}, *collision.Geom(), files);
    });
    return shapes.take();
  }
  std::vector<std::uint64_t> fingerprints() {
    std::vector<std::uint64_t> result;
    for_each_collision([&](const std::string&, const sdf::Collision& collision) {
      result.push_back(fingerprint(*collision.Geom(), eigen(collision.RawPose())));
    });
    return result;
  }

  std::string text_;
  sdf::Root root_;
  Files files_;
  std::vector<std::string> notes_;
};

/// Canyon's own reader of worlds uses other code for XML and mesh files.
TEST_F(SdfShapes, AreWhatTheImportOfTheWorldHas) {
  const std::string shapes =
      model("box", "1 2 3 0.1 0.2 0.3", "<box><size>2 4 6</size></box>") +
      model("drum", "20 0 0 1 0 0", "<cylinder><radius>2</radius><length>5</length></cylinder>") +
      model("ball", "0 20 1 0 0 0", "<sphere><radius>3</radius></sphere>") +
      model("pill", "0 30 1 0 1 0", "<capsule><radius>1</radius><length>4</length></capsule>") +
      model("egg", "0 40 1 0 0 2", "<ellipsoid><radii>1 2 3</radii></ellipsoid>") +
      model("ground", "0 0 0 0 0 0", "<plane><normal>0 0 1</normal><size>90 80</size></plane>") +
      model("wing", "9 9 9 0 0 1", "<mesh><uri>corner.obj</uri><scale>-2 3 4</scale></mesh>");
  load(shapes);
  const city::Mesh ours = mesh(&files_);
  EXPECT_THAT(notes_, IsEmpty());
  const canyon::test::TemporaryFolder folder;
  std::ofstream(folder / "corner.obj") << kCorner;
  std::ofstream(folder / "w.sdf") << text_;
  const city::Mesh theirs = city::read_gazebo_world(folder / "w.sdf").mesh;
  ASSERT_EQ(ours.objects.size(), 7U);
  ASSERT_EQ(ours.objects.size(), theirs.objects.size());
  ASSERT_EQ(ours.triangles.size(), theirs.triangles.size());
  EXPECT_EQ(ours.materials, theirs.materials);
  for (std::size_t i = 0; i < ours.objects.size(); ++i) {
    EXPECT_EQ(ours.objects[i].name, theirs.objects[i].name);
    EXPECT_EQ(ours.objects[i].surface, theirs.objects[i].surface);
    EXPECT_EQ(ours.objects[i].triangle_count, theirs.objects[i].triangle_count);
  }
  for (std::size_t t = 0; t < ours.triangles.size(); ++t) {
    for (std::size_t i = 0; i < 3; ++i) {
      const Vector3d &a = ours.vertices[ours.triangles[t][i]], &b = theirs.vertices[theirs.triangles[t][i]];
      EXPECT_LT((a - b).norm(), 1e-9);
    }
  }
}

TEST_F(SdfShapes, ReadHeights) {
  load(model("hill", "0 0 5 0 0 0",
             "<heightmap><uri>hill.png</uri><size>40 20 12</size><pos>100 0 2</pos></heightmap>"));
  const city::Mesh terrain = mesh(&files_);
  EXPECT_EQ(terrain.objects.at(0).surface, city::Surface::Terrain);
  for (const Vector3d& v : terrain.vertices) {
    EXPECT_NEAR(std::abs(v.x() - 100), 20, 1e-12);
    EXPECT_NEAR(std::abs(v.y()), 10, 1e-12);
    EXPECT_NEAR(v.z(), v.x() < 100 ? 7 : 19, 1e-12);
  }
  EXPECT_THAT(notes_, IsEmpty());
}

TEST_F(SdfShapes, WhatCannotBeReadIsLeftOut) {
  load(model("lost", "0 0 0 0 0 0", "<mesh><uri>lost.dae</uri></mesh>") +
       model("broken", "0 0 0 0 0 0", "<mesh><uri>broken.obj</uri></mesh>") +
       model("flat", "0 0 0 0 0 0", "<mesh><uri>corner.obj</uri><scale>1 1 0</scale></mesh>") +
       model("plain", "0 0 0 0 0 0", "<heightmap><uri>plain.png</uri><size>1 1 1</size></heightmap>") +
       model("nothing", "0 0 0 0 0 0", "<empty/>"));
  EXPECT_TRUE(mesh(&files_).triangles.empty());
  EXPECT_THAT(notes_,
              ElementsAre("'lost::link::c' is left out: its mesh 'lost.dae' is not found or cannot be read",
                          HasSubstr("'broken::link::c' is left out: broken.obj:3"), HasSubstr("a scale of 0"),
                          HasSubstr("its heights 'plain.png' are not found")));
  notes_.clear();
  EXPECT_TRUE(mesh(nullptr).triangles.empty()) << "a host without files";
  EXPECT_EQ(notes_.size(), 4U);
}

TEST_F(SdfShapes, FingerprintsTellKindSizeScaleMeshAndPlace) {
  const std::string mesh_of = "<mesh><uri>a.dae</uri>";
  load(model("m0", "0 0 0 0 0 0", "<box><size>1 2 3</size></box>") +
       model("m1", "0 0 1e-9 0 0 0", "<box><size>1 2 3</size></box>") +
       model("m2", "0 0 0 1e-9 0 0", "<box><size>1 2 3</size></box>") +
       model("m3", "0 0 0 0 0 0", "<box><size>1 2 4</size></box>") +
       model("m4", "0 0 0 0 0 0", "<ellipsoid><radii>1 2 3</radii></ellipsoid>") +
       model("m5", "0 0 0 0 0 0", "<sphere><radius>1</radius></sphere>") +
       model("m6", "0 0 0 0 0 0", "<cylinder><radius>1</radius><length>2</length></cylinder>") +
       model("m7", "0 0 0 0 0 0", "<capsule><radius>1</radius><length>2</length></capsule>") +
       model("m8", "0 0 0 0 0 0", "<capsule><radius>1</radius><length>3</length></capsule>") +
       model("m9", "0 0 0 0 0 0", "<plane><normal>0 0 1</normal><size>5 5</size></plane>") +
       model("m10", "0 0 0 0 0 0", "<plane><normal>0 1 0</normal><size>5 5</size></plane>") +
       model("m11", "0 0 0 0 0 0", mesh_of + "</mesh>") +
       model("m12", "0 0 0 0 0 0", mesh_of + "<scale>1 1 2</scale></mesh>") +
       model("m13", "0 0 0 0 0 0", mesh_of + "<submesh><name>s</name></submesh></mesh>") +
       model("m14", "0 0 0 0 0 0", mesh_of + "<submesh><name>s</name><center>1</center></submesh></mesh>") +
       model("m15", "0 0 0 0 0 0", "<mesh><uri>b.dae</uri></mesh>") +
       model("m16", "0 0 0 0 0 0", "<heightmap><uri>a.png</uri><size>9 9 9</size></heightmap>") +
       model("m17", "0 0 0 0 0 0",
             "<heightmap><uri>a.png</uri><size>9 9 9</size><pos>0 0 1</pos></heightmap>") +
       model("m18", "0 0 0 0 0 0", "<empty/>"));
  const std::vector<std::uint64_t> all = fingerprints();
  EXPECT_EQ(all.size(), 19U);
  EXPECT_EQ(std::set<std::uint64_t>(all.begin(), all.end()).size(), 19U);
  load(text_.substr(text_.find("<model"), text_.find("</world>") - text_.find("<model")));
  EXPECT_EQ(fingerprints(), all) << "and are the same for the same";
}

#if __has_include(<sdf/Cone.hh>)
TEST_F(SdfShapes, ConesAndPolylines) {
  const auto polyline = [](const std::string& last) {
    return "<polyline><point>0 0</point><point>4 0</point><point>" + last +
           "</point><height>9</height></polyline>";
  };
  load(model("cone", "0 0 10 0 0 0", "<cone><radius>2</radius><length>6</length></cone>") +
       model("yard", "0 0 0 0 0 0", polyline("4 4")) + model("yard2", "0 0 0 0 0 0", polyline("4 5")));
  const city::Mesh mesh_of_all = mesh(&files_);
  EXPECT_THAT(notes_, IsEmpty());
  ASSERT_EQ(mesh_of_all.objects.size(), 3U);
  double top = 0;
  for (const Vector3d& v : mesh_of_all.vertices) top = std::max(top, v.z());
  EXPECT_NEAR(top, 13, 1e-12);
  const std::vector<std::uint64_t> all = fingerprints();
  EXPECT_EQ(std::set<std::uint64_t>(all.begin(), all.end()).size(), 3U);
}
#endif

TEST(MaterialOf, ScriptThenColour) {
  EXPECT_EQ(material_of(nullptr), city::Material::Unknown);
  sdf::Material material;
  EXPECT_EQ(material_of(&material), city::Material::Unknown);
  const auto [r, g, b] = city::material_colour(city::Material::Glass);
  auto colour = material.Diffuse();
  colour.Set(static_cast<float>(r), static_cast<float>(g), static_cast<float>(b));
  material.SetDiffuse(colour);
  EXPECT_EQ(material_of(&material), city::Material::Glass);
  material.SetScriptName("Gazebo/Bricks");
  EXPECT_EQ(material_of(&material), city::Material::Brick);
}

}  // namespace
}  // namespace canyon::adapters
