#include "canyon/city/buildings/sources/terrain.hpp"

#include <fmt/format.h>
#include <gdal_frmts.h>
#include <Eigen/Geometry>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <functional>
#include <map>
#include <thread>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/buildings/sources/gdal.hpp"
#include "canyon/city/buildings/sources/raster.hpp"
#include "canyon/city/city.hpp"
#include "tests/support/local_listener.hpp"
#include "tests/support/program.hpp"
#include "tests/support/temporary_folder.hpp"
#include "tests/support/utm.hpp"

namespace canyon::buildings::terrain_test {
namespace {

using geodesy::Geodetic;

/// Description of a raster made for a test.
struct Made {
  std::string crs = "EPSG:4326";
  double west = 114.0, north = 22.5;  ///< corner of the first pixel
  double pixel_x = 0.001, pixel_y = 0.001;
  int width = 200, height = 150;
  GDALDataType type = GDT_Float64;
  std::optional<double> nodata, scale, offset;
  std::string unit;
  std::string driver = "GTiff";
  int bands = 1;
  bool georeference = true;
};

/// Writes a raster whose pixels have the value f(x, y) at their centres.
void make_raster(const std::filesystem::path& path, const Made& made,
                 const std::function<double(double, double)>& f) {
  GDALRegister_GTiff();  // as in raster.cpp: any registered driver opens files next to rasters
  const gdal::Quiet quiet;
  const GDALDriverH driver = GDALGetDriverByName(made.driver.c_str());
  ASSERT_NE(driver, nullptr);
  // GeoTIFF 1.1 stores the vertical part of the reference system.
  std::string version = "GEOTIFF_VERSION=1.1";
  std::array<char*, 2> creation{version.data(), nullptr};
  const gdal::Dataset dataset(GDALCreate(driver, path.string().c_str(), made.width, made.height, made.bands,
                                         made.type, made.driver == "GTiff" ? creation.data() : nullptr));
  ASSERT_NE(dataset, nullptr) << quiet.message();
  if (made.georeference) {
    std::array<double, 6> transform{made.west, made.pixel_x, 0, made.north, 0, -made.pixel_y};
    ASSERT_EQ(GDALSetGeoTransform(dataset.get(), transform.data()), CE_None);
    if (!made.crs.empty()) {
      const auto reference = gdal::spatial_reference(made.crs);
      ASSERT_NE(reference, nullptr);
      ASSERT_EQ(GDALSetSpatialRef(dataset.get(), reference.get()), CE_None);
    }
  }
  const GDALRasterBandH band = GDALGetRasterBand(dataset.get(), 1);
  if (made.nodata) GDALSetRasterNoDataValue(band, *made.nodata);
  if (made.scale) GDALSetRasterScale(band, *made.scale);
  if (made.offset) GDALSetRasterOffset(band, *made.offset);
  if (!made.unit.empty()) GDALSetRasterUnitType(band, made.unit.c_str());
  std::vector<double> row(static_cast<std::size_t>(made.width));
  for (int j = 0; j < made.height; ++j) {
    for (int i = 0; i < made.width; ++i) {
      row[static_cast<std::size_t>(i)] =
          f(made.west + (i + 0.5) * made.pixel_x, made.north - (j + 0.5) * made.pixel_y);
    }
    ASSERT_EQ(GDALRasterIO(band, GF_Write, 0, j, made.width, 1, row.data(), made.width, 1, GDT_Float64, 0, 0),
              CE_None);
  }
}

double plane(double x, double y) {
  return 100 + 500 * (x - 114) - 300 * (y - 22);
}

/// The InputError of a call, as text.
std::string error_of(const std::function<void()>& call) {
  try {
    call();
  } catch (const InputError& e) {
    return e.what();
  }
  ADD_FAILURE() << "no InputError";
  return {};
}

bool contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

class TerrainTest : public ::testing::Test {
 protected:
  test::TemporaryFolder folder_;
};

// An undeclared fill value is not ground: it is replaced by its neighbours.
TEST_F(TerrainTest, ImpossibleHeightsAreFilledAndSaid) {
  for (const double fill : {32767.0, -9999.0, 1e20, -3.4e38}) {
    SCOPED_TRACE(fill);
    make_raster(folder_ / "bad.tif", {}, [fill](double x, double y) {
      return std::abs(x - 114.0495) < 1e-6 && std::abs(y - 22.4505) < 1e-6 ? fill : 500.0;
    });
    const Terrain terrain({folder_ / "bad.tif"});
    EXPECT_TRUE(terrain.notes().lines(ReadReport::Level::Loss).empty());
    EXPECT_NEAR(terrain.height_m({114.0495, 22.4505}).value_or(0), 500, 1e-6);
    EXPECT_NEAR(terrain.height_m({114.0499, 22.4501}).value_or(0), 500, 1e-6);
    ASSERT_EQ(terrain.notes().lines(ReadReport::Level::Loss).size(), 1U);
    EXPECT_TRUE(contains(terrain.notes().lines(ReadReport::Level::Loss)[0], "bad.tif: 1 of the posts"))
        << terrain.notes().lines(ReadReport::Level::Loss)[0];
  }
  make_raster(folder_ / "all.tif", {}, [](double, double) { return 32767.0; });
  EXPECT_FALSE(Terrain({folder_ / "all.tif"}).height_m({114.0495, 22.4505}));
}

// Formats that reference files or servers are not supported for terrain, whatever the file's name.
TEST_F(TerrainTest, ReadsFormatsOfHeightsAlone) {
  const test::LocalListener server(100);
  const std::string web = fmt::format("http://127.0.0.1:{}/x.tif", server.port());
  make_raster(folder_ / "plane.tif", {}, plane);
  const auto vrt = [](const std::string& source) {
    return "<VRTDataset rasterXSize=\"200\" rasterYSize=\"150\"><SRS>EPSG:4326</SRS><GeoTransform>114, "
           "0.001, 0, "
           "22.5, 0, -0.001</GeoTransform><VRTRasterBand dataType=\"Float64\" band=\"1\"><SimpleSource>"
           "<SourceFilename>" +
           source +
           "</SourceFilename><SourceBand>1</SourceBand></SimpleSource>"
           "</VRTRasterBand></VRTDataset>";
  };
  const std::map<std::string, std::string> files{
      {"local.tif", vrt((folder_ / "plane.tif").string())},
      {"web.tif", vrt("/vsicurl/" + web)},
      {"wms.hgt", "<GDAL_WMS><Service name=\"TMS\"><ServerUrl>" + web +
                      "</ServerUrl></Service><DataWindow>"
                      "<UpperLeftX>113</UpperLeftX><UpperLeftY>23</UpperLeftY><LowerRightX>115</LowerRightX>"
                      "<LowerRightY>21</LowerRightY><SizeX>256</SizeX><SizeY>256</SizeY></"
                      "DataWindow><Projection>EPSG:4326"
                      "</Projection><BandsCount>1</BandsCount></GDAL_WMS>"},
      {"raw.tif",
       "<VRTDataset rasterXSize=\"10\" rasterYSize=\"10\"><SRS>EPSG:4326</SRS><GeoTransform>114, 0.001, "
       "0, 22.5, 0, -0.001</GeoTransform><VRTRasterBand dataType=\"Byte\" band=\"1\" "
       "subClass=\"VRTRawRasterBand\"><SourceFilename>/etc/passwd</SourceFilename></VRTRasterBand>"
       "</VRTDataset>"}};
  for (const auto& [name, text] : files) {
    std::ofstream(folder_ / name) << text;
    EXPECT_TRUE(contains(error_of([&, file = folder_ / name] { (void)Terrain({file}); }), "not a raster"))
        << name;
  }
  EXPECT_TRUE(contains(error_of([&] { (void)Terrain({"/vsicurl/" + web}); }), "no such file"));
  // A file next to a raster is opened by its own driver.
  for (const char* ending : {".aux.xml", ".msk", ".ovr"}) {
    make_raster(folder_ / "beside.tif", {}, plane);
    const std::string file = std::string("beside.tif") + ending;
    std::ofstream(folder_ / file)
        << (ending == std::string(".aux.xml")
                ? "<PAMDataset><Metadata domain=\"OVERVIEWS\"><MDI key=\"OVERVIEW_FILE\">"
                  "/vsicurl/" +
                      web + "</MDI></Metadata></PAMDataset>"
                : files.at("wms.hgt"));
    const Raster raster(folder_ / "beside.tif", {});
    EXPECT_EQ(raster.summary().columns, 200);
    EXPECT_NEAR(raster.height_m({114.05, 22.45}).value_or(0), plane(114.05, 22.45), 1e-9) << ending;
    std::filesystem::remove(folder_ / file);
  }
  EXPECT_EQ(server.next(), -1);  // no request arrived
}

TEST_F(TerrainTest, PlaneIsSampledExactly) {
  make_raster(folder_ / "plane.tif", {}, plane);
  const Terrain terrain({folder_ / "plane.tif"});
  // Bilinear interpolation reproduces a plane: closed form. 1e-9 m covers rounding of 0.001 deg pixels.
  for (const LonLat& position : {LonLat(114.05, 22.45), LonLat(114.0123456, 22.3987654),
                                 LonLat(114.1995, 22.3505), LonLat(114.0005, 22.4995)}) {
    const auto height = terrain.height_m(position);
    ASSERT_TRUE(height) << position.transpose();
    EXPECT_NEAR(*height, plane(position.x(), position.y()), 1e-9) << position.transpose();
  }
  // The outermost half pixel has its pixel's value.
  EXPECT_NEAR(terrain.height_m({114.0, 22.5}).value(), plane(114.0005, 22.4995), 1e-9);
  for (const LonLat& outside :
       {LonLat(113.9999, 22.4), LonLat(114.2001, 22.4), LonLat(114.1, 22.5001), LonLat(114.1, 22.3499)}) {
    EXPECT_FALSE(terrain.height_m(outside)) << outside.transpose();
  }
  EXPECT_FALSE(terrain.height_m({std::nan(""), 22.4}));
  ASSERT_EQ(terrain.notes().lines().size(), 1U);
  EXPECT_TRUE(contains(terrain.notes().lines()[0], "read as ellipsoidal")) << terrain.notes().lines()[0];
}

TEST_F(TerrainTest, ProjectedRasterAgreesWithGeographicLibsUtm) {
  Made made;
  made.crs = "EPSG:32650";
  made.west = 200000;
  made.north = 2480000;
  made.pixel_x = 30;
  made.pixel_y = 25;
  made.width = made.height = 400;
  const auto grid_plane = [](double x, double y) { return 50 + 0.01 * (x - 200000) - 0.02 * (y - 2470000); };
  make_raster(folder_ / "utm.tif", made, grid_plane);
  const Terrain terrain({folder_ / "utm.tif"});
  for (const geodesy::Utm utm :
       {geodesy::Utm{50, true, 205123.4, 2474567.8}, geodesy::Utm{50, true, 211000, 2471500}}) {
    const Geodetic at = test::geodetic_from_utm(utm);
    const auto height =
        terrain.height_m({geodesy::degrees(at.longitude_rad), geodesy::degrees(at.latitude_rad)});
    ASSERT_TRUE(height);
    // PROJ's and GeographicLib's transverse Mercator agree to micrometres.
    EXPECT_NEAR(*height, grid_plane(utm.easting_m, utm.northing_m), 1e-6);
  }
}

TEST_F(TerrainTest, RotatedRasterAndLongitudesPast180) {
  Made made;
  made.west = 285;  // 75 deg west, as in some global grids
  made.north = 41;
  make_raster(folder_ / "past.tif", made, [](double x, double y) { return 10 * (x - 285) + y; });
  const Terrain terrain({folder_ / "past.tif"});
  EXPECT_NEAR(terrain.height_m({-74.9, 40.9}).value(), 1 + 40.9, 1e-9);
}

TEST_F(TerrainTest, AcrossTheAntimeridian) {
  const auto east_of_180 = [](double x) { return x < 0 ? x + 180 : x - 180; };
  const auto height = [&](double x, double y) { return 100 + 1000 * east_of_180(x) + 500 * (y + 16.8); };
  Made made;
  made.north = -16.7;
  made.west = 179.9;
  make_raster(folder_ / "one.tif", made, height);
  made.west = 179.8;
  make_raster(folder_ / "west.tif", made, height);
  made.west = -180;
  make_raster(folder_ / "east.tif", made, height);
  const Terrain one({folder_ / "one.tif"}), two({folder_ / "west.tif", folder_ / "east.tif"});
  for (const double x : {179.95, 179.98, -179.98, -179.95}) {
    EXPECT_NEAR(one.height_m({x, -16.8}).value(), 100 + 1000 * east_of_180(x), 1e-6) << x;
    EXPECT_NEAR(two.height_m({x, -16.8}).value(), 100 + 1000 * east_of_180(x), 1e-6) << x;
  }
}

TEST_F(TerrainTest, NoDataIsNoAnswerAndTheNextRasterIsAsked) {
  Made made;
  made.type = GDT_Float32;
  made.nodata = -9999;
  make_raster(folder_ / "hole.tif", made, [](double x, double) { return x > 114.1 ? -9999.0 : 7.0; });
  const Terrain alone({folder_ / "hole.tif"});
  EXPECT_DOUBLE_EQ(alone.height_m({114.05, 22.4}).value(), 7);
  EXPECT_FALSE(alone.height_m({114.15, 22.4}));
  EXPECT_FALSE(alone.height_m({114.1002, 22.4}));  // between a valid pixel and an invalid one
  make_raster(folder_ / "below.tif", {}, [](double, double) { return 3.0; });
  const Terrain both({folder_ / "hole.tif", folder_ / "below.tif"});
  EXPECT_DOUBLE_EQ(both.height_m({114.05, 22.4}).value(), 7);
  EXPECT_DOUBLE_EQ(both.height_m({114.15, 22.4}).value(), 3);

  made.nodata = std::nan("");
  make_raster(folder_ / "nan.tif", made, [](double x, double) { return x > 114.1 ? std::nan("") : 7.0; });
  EXPECT_FALSE(Terrain({folder_ / "nan.tif"}).height_m({114.15, 22.4}));
}

// GDAL reads a grid of whole numbers as integers, which have no NaN.
TEST_F(TerrainTest, NanAmongWholeNumbersOfAnAsciiGrid) {
  std::string rows;
  for (int row = 0; row < 20; ++row) {
    for (int column = 0; column < 20; ++column) rows += row < 10 ? "7 " : "nan ";
    rows += "\n";
  }
  std::ofstream(folder_ / "nan.asc") << "ncols 20\nnrows 20\nxllcorner 114\nyllcorner 22\ncellsize 0.01\n"
                                     << rows;
  std::ofstream(folder_ / "nan.prj")
      << R"(GEOGCS["WGS 84",DATUM["WGS_1984",SPHEROID["WGS 84",6378137,298.257223563]],PRIMEM["Greenwich",0],UNIT["degree",0.0174532925199433]])";
  const Terrain terrain({folder_ / "nan.asc"});
  EXPECT_DOUBLE_EQ(terrain.height_m({114.1, 22.15}).value(), 7);
  EXPECT_FALSE(terrain.height_m({114.1, 22.05}));
}

TEST_F(TerrainTest, FeetScaleAndOffset) {
  Made made;
  made.unit = "ft";
  make_raster(folder_ / "feet.tif", made, [](double, double) { return 1000.0; });
  EXPECT_NEAR(Terrain({folder_ / "feet.tif"}).height_m({114.1, 22.4}).value(), 304.8, 1e-9);
  made.unit = "US survey foot";
  make_raster(folder_ / "survey.tif", made, [](double, double) { return 3937.0; });
  EXPECT_NEAR(Terrain({folder_ / "survey.tif"}).height_m({114.1, 22.4}).value(), 1200, 1e-9);
  made.unit = "m";
  made.type = GDT_Int16;
  made.scale = 0.1;
  made.offset = 1000;
  make_raster(folder_ / "scaled.tif", made, [](double, double) { return 123; });
  EXPECT_NEAR(Terrain({folder_ / "scaled.tif"}).height_m({114.1, 22.4}).value(), 1012.3, 1e-9);
  made.unit = "fathom";
  make_raster(folder_ / "fathom.tif", made, [](double, double) { return 1; });
  EXPECT_TRUE(contains(error_of([&] { Terrain({folder_ / "fathom.tif"}); }), "\"fathom\""));
}

// 1640.42 US survey feet = 500 m. EPSG: 2263 and 6360 are in US survey feet, 2222 in international ones, 5703
// in metres.
TEST_F(TerrainTest, HeightsWithoutAUnitAreInThatOfTheirReferenceSystem) {
  struct Case {
    const char *crs, *unit;
    double metres;
    bool configured;
  };
  for (const Case& c : {Case{"EPSG:2263", "", 1200.0 / 3937, true}, Case{"EPSG:2222", "", 0.3048, true},
                        Case{"EPSG:2263", "m", 1, false}, Case{"EPSG:2263", "ft", 0.3048, false},
                        Case{"EPSG:2263+6360", "", 1200.0 / 3937, false},
                        Case{"EPSG:2263+5703", "", 1, false}, Case{"EPSG:32618", "", 1, false}}) {
    SCOPED_TRACE(std::string(c.crs) + " " + c.unit);
    Made made;
    made.crs = c.crs;
    made.unit = c.unit;
    made.pixel_x = made.pixel_y = 100;
    made.width = made.height = 20;
    const bool utm = made.crs == "EPSG:32618";
    made.west = utm ? 583000 : made.crs == "EPSG:2222" ? 700000 : 984000;
    made.north = utm ? 4508000 : made.crs == "EPSG:2222" ? 500000 : 198000;
    make_raster(folder_ / "r.tif", made, [](double, double) { return 1000.0; });
    for (const bool by_name : {false, true}) {
      TerrainOptions options;
      if (by_name) {
        options.geoid = GeoidModel::EGM96;
      } else {
        options.geoid_undulation_m = 0;
      }
      std::optional<Raster> raster;
      try {
        raster.emplace(folder_ / "r.tif", options);
      } catch (const InputError& e) {
        if (by_name) continue;  // no EGM96 grid is installed
        throw;
      }
      const LonLat middle = raster->summary().middle.value();
      const double undulation = raster->geoid_undulation_m(middle).value_or(0);
      EXPECT_NEAR(raster->height_m(middle).value() - undulation, 1000 * c.metres, 1e-6);
      const auto guesses = raster->notes().lines(ReadReport::Level::Guess);
      EXPECT_EQ(guesses.size(), c.configured ? 1U : 0U);
      if (c.configured) {
        EXPECT_TRUE(contains(guesses.at(0), "r.tif: heights read in the unit of")) << guesses.at(0);
      }
    }
  }
}

// A small file may declare gigabytes: sparse GeoTIFF of one huge block, and of many.
TEST_F(TerrainTest, PixelsThatAFileDoesNotStoreAreBounded) {
  GDALRegister_GTiff();
  const auto sparse = [&](const char* name, int size, const char* block) {
    std::string tiled = "TILED=YES", none = "SPARSE_OK=TRUE", width = std::string("BLOCKXSIZE=") + block,
                height = std::string("BLOCKYSIZE=") + block;
    std::array<char*, 5> creation{tiled.data(), none.data(), width.data(), height.data(), nullptr};
    const gdal::Dataset dataset(GDALCreate(GDALGetDriverByName("GTiff"), (folder_ / name).string().c_str(),
                                           size, size, 1, GDT_Float32, creation.data()));
    std::array<double, 6> transform{114, 1e-6, 0, 22.5, 0, -1e-6};
    GDALSetGeoTransform(dataset.get(), transform.data());
    GDALSetSpatialRef(dataset.get(), gdal::spatial_reference("EPSG:4326").get());
  };
  sparse("block.tif", 30000, "30000");
  sparse("blocks.tif", 100000, "4096");
  sparse("good.tif", 10000, "256");
  for (const char* name : {"block.tif", "blocks.tif"})
    EXPECT_TRUE(contains(error_of([&] { Terrain({folder_ / name}); }), "pixels in blocks of")) << name;
  EXPECT_EQ(Terrain({folder_ / "good.tif"}).height_m({114.005, 22.495}), 0);
}

TEST_F(TerrainTest, GeoidByNumberIsAddedWhateverTheDatum) {
  TerrainOptions options;
  options.geoid_undulation_m = -2.5;
  make_raster(folder_ / "plain.tif", {}, plane);
  Made made;
  made.crs = "EPSG:4326+3855";
  make_raster(folder_ / "egm2008.tif", made, plane);
  for (const char* name : {"plain.tif", "egm2008.tif"}) {
    const Terrain terrain({folder_ / name}, options);
    EXPECT_NEAR(terrain.height_m({114.1, 22.4}).value(), plane(114.1, 22.4) - 2.5, 1e-9);
    EXPECT_TRUE(contains(terrain.notes().lines().at(0), "-2.500 m added")) << terrain.notes().lines()[0];
    EXPECT_EQ(terrain.geoid_undulation_m({114.1, 22.4}), -2.5);
    EXPECT_FALSE(terrain.geoid_undulation_m({0, 0}));
  }
  options.geoid_undulation_m = 151;
  EXPECT_TRUE(contains(error_of([&] { options.validate(); }), "151"));
  options.geoid_undulation_m = std::nan("");
  EXPECT_THROW(options.validate(), InputError);
}

TEST_F(TerrainTest, EllipsoidalReferenceSystemAddsNothing) {
  Made made;
  made.crs = "EPSG:4979";
  make_raster(folder_ / "ellipsoidal.tif", made, plane);
  const Terrain terrain({folder_ / "ellipsoidal.tif"});
  EXPECT_NEAR(terrain.height_m({114.1, 22.4}).value(), plane(114.1, 22.4), 1e-6);
  EXPECT_TRUE(contains(terrain.notes().lines().at(0), "ellipsoidal")) << terrain.notes().lines()[0];
  EXPECT_FALSE(terrain.geoid_undulation_m({114.1, 22.4}));
}

/// EGM96 undulation at (114.17, 22.3) from PROJ's egm96_15.gtx:
///   echo "114.17 22.3 0" | gdaltransform -s_srs EPSG:4326+5773 -t_srs EPSG:4979   (GDAL 3.6.2, PROJ 9.1.1)
constexpr double kUndulationHongKong = -2.16720933532729;
/// Between interpolations of EGM96 grids at 15' and 5'.
constexpr double kBetweenGrids_m = 0.1;

TEST_F(TerrainTest, Egm96IsAddedWhereTheDatumSaysSo) {
  Made made;
  made.crs = "EPSG:4326+5773";
  make_raster(folder_ / "egm96.tif", made, plane);
  try {
    const Terrain terrain({folder_ / "egm96.tif"});
    EXPECT_NEAR(terrain.height_m({114.17, 22.4}).value() - plane(114.17, 22.4), -2.2, 0.5);
    EXPECT_TRUE(contains(terrain.notes().lines().at(0), "EPSG:5773")) << terrain.notes().lines()[0];
    made.crs = "EPSG:32650+5773";
    made.west = 200000;
    made.north = 2480000;
    made.pixel_x = made.pixel_y = 100;
    make_raster(folder_ / "egm96utm.tif", made, [](double, double) { return 0; });
    EXPECT_NEAR(Terrain({folder_ / "egm96utm.tif"}).height_m({114.17, 22.3}).value(), kUndulationHongKong,
                kBetweenGrids_m);
  } catch (const InputError& e) {
    if (contains(e.what(), "no geoid grid"))
      GTEST_SKIP() << "SKIPPED: no EGM96 grid is installed: " << e.what();
    throw;
  }
}

TEST_F(TerrainTest, DatumWithoutGridIsAnErrorWithTheCure) {
  // EGM2008's grid is in no Debian package; if it is installed, heights change instead.
  Made made;
  made.crs = "EPSG:4326+3855";
  make_raster(folder_ / "egm2008.tif", made, plane);
  try {
    const Terrain terrain({folder_ / "egm2008.tif"});
    EXPECT_NE(terrain.height_m({114.17, 22.4}).value(), plane(114.17, 22.4));
  } catch (const InputError& e) {
    EXPECT_TRUE(contains(e.what(), "EGM2008 height (EPSG:3855)")) << e.what();
    EXPECT_TRUE(contains(e.what(), "--geoid-undulation")) << e.what();
  }
}

TEST_F(TerrainTest, GeographicLibsGeoidFilesAreUsedWherePROJHasNoGrid) {
  // A geoid file of constant undulation: raw value 37,000 * 0.003 m - 108 m = 3 m everywhere.
  {
    std::ofstream out(folder_ / "egm2008-2_5.pgm", std::ios::binary);
    out << "P5\n# Offset -108\n# Scale 0.003\n36 19\n65535\n";
    for (int i = 0; i < 36 * 19; ++i)
      out.put(static_cast<char>(37000 >> 8)).put(static_cast<char>(37000 & 0xff));
  }
  Made made;
  made.crs = "EPSG:4326+3855";
  make_raster(folder_ / "egm2008.tif", made, plane);
  ASSERT_EQ(setenv("GEOGRAPHICLIB_GEOID_PATH", folder_.path().c_str(), 1), 0);
  const Terrain terrain({folder_ / "egm2008.tif"});
  // The user names the datum of a raster without one.
  make_raster(folder_ / "plain.tif", {}, plane);
  TerrainOptions named;
  named.geoid = GeoidModel::EGM2008;
  const Terrain plain({folder_ / "plain.tif"}, named);
  unsetenv("GEOGRAPHICLIB_GEOID_PATH");
  if (contains(terrain.notes().lines().at(0), "PROJ's grid"))
    GTEST_SKIP() << "SKIPPED: PROJ has EGM2008's grid here";
  EXPECT_TRUE(contains(terrain.notes().lines().at(0), "egm2008-2_5")) << terrain.notes().lines()[0];
  EXPECT_NEAR(terrain.height_m({114.1, 22.4}).value(), plane(114.1, 22.4) + 3, 1e-6);
  EXPECT_NEAR(terrain.geoid_undulation_m({114.1, 22.4}).value(), 3, 1e-9);
  EXPECT_NEAR(plain.height_m({114.1, 22.4}).value(), plane(114.1, 22.4) + 3, 1e-6);
  EXPECT_TRUE(contains(plain.notes().lines().at(0), "(EPSG:3855), as given")) << plain.notes().lines()[0];
}

TEST_F(TerrainTest, SrtmTileIsReadAndIsEgm96) {
  // 1201 x 1201 big-endian 16-bit heights from the north-west corner, posts on whole degrees (SRTM user
  // guide).
  const auto path = folder_ / "N22E114.hgt";
  {
    std::ofstream out(path, std::ios::binary);
    for (int row = 0; row < 1201; ++row) {
      for (int column = 0; column < 1201; ++column) {
        const int height = row == 1200 && column == 1200 ? -32768 : column - 2 * row + 2500;
        out.put(static_cast<char>((height >> 8) & 0xff)).put(static_cast<char>(height & 0xff));
      }
    }
  }
  TerrainOptions options;
  options.geoid_undulation_m = 0;
  const Terrain raw({path}, options);
  // Post (column, row) is at longitude 114 + column / 1200, latitude 23 - row / 1200.
  EXPECT_NEAR(raw.height_m({114 + 300 / 1200.0, 23 - 500 / 1200.0}).value(), 300 - 1000 + 2500, 1e-6);
  EXPECT_NEAR(raw.height_m({114 + 300.25 / 1200.0, 23 - 500.5 / 1200.0}).value(), 300.25 - 1001 + 2500, 1e-6);
  EXPECT_NEAR(raw.height_m({114, 23}).value(), 2500, 1e-6);
  EXPECT_FALSE(raw.height_m({115, 22}));  // the void
  try {
    const Terrain terrain({path});
    EXPECT_NEAR(*terrain.height_m({114.17, 22.3}) - *raw.height_m({114.17, 22.3}), kUndulationHongKong,
                kBetweenGrids_m);
    EXPECT_TRUE(contains(terrain.notes().lines().at(0), "EPSG:5773")) << terrain.notes().lines()[0];
  } catch (const InputError& e) {
    if (contains(e.what(), "no geoid grid"))
      GTEST_SKIP() << "SKIPPED: no EGM96 grid is installed: " << e.what();
    throw;
  }
}

TEST_F(TerrainTest, SheetFollowsTheEllipsoidOverTenKilometres) {
  // Constant ellipsoidal height 55 m: posts must be at that height, far from the plane z = 55 m.
  Made made;
  made.west = 113.9;
  made.width = made.height = 600;
  made.north = 22.6;
  make_raster(folder_ / "level.tif", made, [](double, double) { return 55; });
  const Terrain terrain({folder_ / "level.tif"});
  const geodesy::LocalFrame frame(Geodetic::from_degrees(22.3, 114.2, 30));
  city::Mesh mesh;
  terrain.append(mesh, frame, {-10000, -10000}, {10000, 10000}, 700);
  ASSERT_EQ(mesh.objects.size(), 1U);
  EXPECT_EQ(mesh.objects[0].name, "terrain");
  EXPECT_EQ(mesh.objects[0].surface, city::Surface::Terrain);
  EXPECT_EQ(mesh.vertices.size(), 30U * 30U);  // 20,000 m / 700 m: 29 steps
  EXPECT_EQ(mesh.triangles.size(), 29U * 29U * 2U);
  EXPECT_NO_THROW(city::check_mesh(mesh, "sheet"));
  double lowest = 1e9;
  for (const auto& v : mesh.vertices) {
    EXPECT_NEAR(frame.geodetic_from_local(v).height_m, 55, 1e-3);
    lowest = std::min(lowest, v.z());
  }
  // Corner 14,142 m away: -d^2 / 2R = -15.7 m below 25 m.
  EXPECT_NEAR(lowest, 25 - 15.7, 0.1);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& [a, b, c] = mesh.triangles[t];
    EXPECT_EQ(mesh.materials[t], city::Material::Ground);
    const Eigen::Vector3d normal =
        (mesh.vertices[b] - mesh.vertices[a]).cross(mesh.vertices[c] - mesh.vertices[a]);
    EXPECT_GT(normal.z(), 0.99 * normal.norm());
  }
}

TEST_F(TerrainTest, SlopesAreMetOnTheFramesVerticalLine) {
  make_raster(folder_ / "steep.tif", {},
              [](double x, double y) { return 3600 + 100000 * (x - 114.1) + 50000 * (y - 22.42); });
  const Terrain terrain({folder_ / "steep.tif"});  // about 0.97 and 0.45 m per metre
  const geodesy::LocalFrame frame(Geodetic::from_degrees(22.42, 114.1, 0));
  for (const Eigen::Vector2d& position :
       {Eigen::Vector2d(0, 0), Eigen::Vector2d(4000, 3000), Eigen::Vector2d(-5000, 2500)}) {
    const auto z = terrain.local_height_m(frame, position);
    ASSERT_TRUE(z);
    const Geodetic at = frame.geodetic_from_local({position.x(), position.y(), *z});
    EXPECT_NEAR(
        at.height_m,
        terrain.height_m({geodesy::degrees(at.longitude_rad), geodesy::degrees(at.latitude_rad)}).value(),
        1e-4);
  }
}

TEST_F(TerrainTest, PartialCoverageNamesTheShare) {
  make_raster(folder_ / "plane.tif", {}, plane);
  const Terrain terrain({folder_ / "plane.tif"});
  const geodesy::LocalFrame frame(Geodetic::from_degrees(22.42, 114.2, 0));  // on the eastern edge
  city::Mesh mesh;
  const std::string error = error_of([&] { terrain.append(mesh, frame, {-1000, -1000}, {1000, 1000}, 100); });
  EXPECT_TRUE(contains(error, "cover 52.4 %") || contains(error, "cover 47.6 %"))
      << error;  // 11 or 10 of 21 columns
  EXPECT_TRUE(mesh.vertices.empty() && mesh.objects.empty());
  EXPECT_THROW(terrain.append(mesh, frame, {0, 0}, {-1, 1}, 1), InputError);
  EXPECT_THROW(terrain.append(mesh, frame, {-100, 0}, {-50, 10}, 0), InputError);
  EXPECT_THROW(terrain.append(mesh, frame, {-1e4, 0}, {-50, 1e4}, 0.1), InputError);
}

TEST_F(TerrainTest, BadInputIsOneClearError) {
  EXPECT_THROW(Terrain({}), InputError);
  EXPECT_TRUE(contains(error_of([&] { Terrain({folder_ / "none.tif"}); }), "none.tif: no such file"));
  std::ofstream(folder_ / "text.tif") << "this is no raster\n";
  EXPECT_TRUE(
      contains(error_of([&] { Terrain({folder_ / "text.tif"}); }), "not a raster that GDAL can read"));
  Made made;
  made.georeference = false;
  make_raster(folder_ / "bare.tif", made, plane);
  EXPECT_TRUE(contains(error_of([&] { Terrain({folder_ / "bare.tif"}); }), "no georeference"));
  made.georeference = true;
  made.crs.clear();
  make_raster(folder_ / "nocrs.tif", made, plane);
  EXPECT_TRUE(
      contains(error_of([&] { Terrain({folder_ / "nocrs.tif"}); }), "no coordinate reference system"));
  made = {};
  made.type = GDT_Byte;
  made.bands = 3;
  make_raster(folder_ / "picture.tif", made, [](double, double) { return 9; });
  EXPECT_TRUE(contains(error_of([&] { Terrain({folder_ / "picture.tif"}); }), "picture"));
}

TEST_F(TerrainTest, TruncatedRasterIsAnErrorNotZeros) {
  make_raster(folder_ / "cut.tif", {}, plane);
  std::filesystem::resize_file(folder_ / "cut.tif", std::filesystem::file_size(folder_ / "cut.tif") / 2);
  const std::string error = error_of([&] {
    const Terrain terrain({folder_ / "cut.tif"});
    (void)terrain.height_m({114.1, 22.495});
    (void)terrain.height_m({114.1, 22.355});
  });
  EXPECT_TRUE(contains(error, "cut.tif")) << error;
}

TEST_F(TerrainTest, ManyThreadsGetTheSameHeights) {
  Made made;
  made.crs = "EPSG:32650";
  made.west = 200000;
  made.north = 2480000;
  made.pixel_x = made.pixel_y = 30;
  make_raster(folder_ / "utm.tif", made, [](double x, double y) { return std::sin(x) + std::cos(y); });
  const Terrain terrain({folder_ / "utm.tif"});
  const auto point = [](int i) { return LonLat(114.10 + 1e-5 * (i % 977), 22.395 + 1e-5 * (i % 991)); };
  std::vector<double> expected;
  expected.reserve(2000);
  for (int i = 0; i < 2000; ++i) expected.push_back(terrain.height_m(point(i)).value_or(-1));
  std::vector<std::thread> threads;
  std::vector<int> wrong(4);
  for (std::size_t t = 0; t < wrong.size(); ++t) {
    threads.emplace_back([&, t] {
      for (int i = 0; i < 2000; ++i) {
        wrong[t] += terrain.height_m(point(i)).value_or(-1) != expected[static_cast<std::size_t>(i)];
      }
    });
  }
  for (auto& thread : threads) thread.join();
  EXPECT_EQ(wrong, std::vector<int>(4));
}

TEST_F(TerrainTest, GdalLocationInfoAgreesOnPixelCentres) {
  CANYON_NEEDS_PROGRAM("gdallocationinfo");
  Made made;
  made.crs = "EPSG:32650";
  made.west = 200000;
  made.north = 2480000;
  made.pixel_x = made.pixel_y = 30;
  make_raster(folder_ / "utm.tif", made,
              [](double x, double y) { return 100 * std::sin(x / 700) + y / 1e5; });
  const Terrain terrain({folder_ / "utm.tif"});
  for (const auto& [column, row] : {std::pair{0, 0}, std::pair{17, 93}, std::pair{199, 149}}) {
    const auto checked = test::run_program(
        fmt::format("gdallocationinfo -valonly '{}' {} {}", (folder_ / "utm.tif").string(), column, row));
    ASSERT_EQ(checked.status, 0);
    const Geodetic at =
        test::geodetic_from_utm({50, true, 200000 + 30 * (column + 0.5), 2480000 - 30 * (row + 0.5)});
    EXPECT_NEAR(
        terrain.height_m({geodesy::degrees(at.longitude_rad), geodesy::degrees(at.latitude_rad)}).value(),
        std::stod(checked.output), 1e-5);
  }
}

}  // namespace
}  // namespace canyon::buildings::terrain_test
