#include <gtest/gtest.h>

#include <gmock/gmock.h>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <limits>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "canyon/analysis/heatmap/engine/map_source.hpp"
#include "canyon/analysis/heatmap/pictures/map_pictures.hpp"
#include "canyon/analysis/heatmap/pictures/map_pictures_sheet.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/city/mesh_file.hpp"
#include "tests/support/append_box.hpp"
#include "tests/support/png_pixels.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::heatmap {
namespace {

using test::PngPixels;
using test::TemporaryFolder;
using ::testing::Each;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// A map defined by functions of the cell, south-western one first.
struct MadeUpMap {
  Request request;
  std::function<float(Layer, std::size_t time, std::uint32_t column, std::uint32_t row)> value =
      [](Layer, std::size_t, std::uint32_t column, std::uint32_t row) {
        return static_cast<float>(column + row);
      };
  std::function<CellState(std::uint32_t column, std::uint32_t row)> state = [](std::uint32_t, std::uint32_t) {
    return CellState::Computed;
  };
  std::set<std::size_t> missing_tiles;
  std::map<std::pair<std::size_t, std::size_t>, int> requested;  ///< how often, by tile and time

  MadeUpMap(std::uint32_t columns, std::uint32_t rows, std::vector<Layer> layers = default_layers()) {
    request.grid = {-100, -50, 2, columns, rows, 16};
    request.layers = std::move(layers);
    request.times = {geodesy::parse_time("2019-04-28T04:44:00Z")};
  }

  MapSource source() {
    MapSource source;
    source.request = &request;
    source.frame = geodesy::LocalFrame(geodesy::Geodetic::from_degrees(22.3, 114.17, 10));
    source.title = "Blocks";
    source.attributes = {{"model", "mirror"}, {"systems", "GPS"}};
    source.slice = [this](std::size_t index, std::size_t time) { return slice(index, time); };
    return source;
  }

  std::optional<MapSource::Slice> slice(std::size_t index, std::size_t time) {
    ++requested[{index, time}];
    if (missing_tiles.count(index) > 0) return std::nullopt;
    const Tile tile = request.grid.tile(index);
    MapSource::Slice slice;
    for (const Layer layer : request.layers) {
      for (std::size_t altitude = 0; altitude < request.altitudes_m.size(); ++altitude) {
        for (std::uint32_t r = 0; r < tile.rows; ++r) {
          for (std::uint32_t c = 0; c < tile.columns; ++c) {
            const std::uint32_t column = tile.first_column + c, row = tile.first_row + r;
            const CellState s = state(column, row);
            slice.values.push_back(s == CellState::Computed ? value(layer, time, column, row) : kNaN);
            if (layer == request.layers.front()) slice.state.push_back(s);
          }
        }
      }
    }
    return slice;
  }
};

city::City block_city() {
  city::City city;
  city.name = "blocks";
  canyon::test::append_box(city.mesh, "block", city::Surface::Building, city::Material::Concrete,
                           {-60, -30, 0}, {-30, 0, 40});
  return city;
}

std::vector<std::string> files_in(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

TEST(MapRaster, PixelsAreMeansOfCells) {
  MadeUpMap map(8, 4, {Layer::HorizontalError});
  map.request.grid.tile_size = 3;  // pixels cross tiles
  const auto rasters = reduce(map.source(), 0, {4, 2});
  // Column 0, bottom row: cells (0, 0), (1, 0), (0, 1), (1, 1), values 0, 1, 1, 2.
  EXPECT_THAT(rasters[0][0].values, ElementsAre(3, 5, 7, 9, 1, 3, 5, 7));
  EXPECT_THAT(rasters[0][0].shades, Each(CellShade::Value));
}

TEST(MapRaster, SidesThatDoNotDivide) {
  MadeUpMap map(5, 3, {Layer::HorizontalError});
  map.value = [](Layer, std::size_t, std::uint32_t column, std::uint32_t) {
    return static_cast<float>(column);
  };
  // Columns 0 to 2 go to pixel 0 (c * 2 / 5), 3 and 4 to pixel 1.
  EXPECT_THAT(reduce(map.source(), 0, {2, 1})[0][0].values, ElementsAre(1, 3.5));
}

TEST(MapRaster, HalfOfTheCellsMakeAValue) {
  MadeUpMap map(8, 1, {Layer::HorizontalError, Layer::SatellitesVisible});
  // Pairs: value and building; two buildings; value and no fix; no fix and building.
  map.state = [](std::uint32_t column, std::uint32_t) {
    return column == 1 || column == 2 || column == 3 || column == 7 ? CellState::InsideBuilding
                                                                    : CellState::Computed;
  };
  map.value = [](Layer layer, std::size_t, std::uint32_t column, std::uint32_t) {
    return layer == Layer::HorizontalError && column >= 5 ? kNaN : 4.0F;
  };
  const auto layers = reduce(map.source(), 0, {4, 1})[0];
  EXPECT_THAT(layers[0].shades,
              ElementsAre(CellShade::Value, CellShade::InsideBuilding, CellShade::Value, CellShade::NoValue));
  EXPECT_EQ(layers[0].values[0], 4);
  EXPECT_TRUE(std::isnan(layers[0].values[1]));
  // A count needs no fix.
  EXPECT_EQ(layers[1].shades[3], CellShade::Value);
}

TEST(MapRaster, EveryStateHasItsShade) {
  MadeUpMap map(5, 1, {Layer::HorizontalError});
  map.state = [](std::uint32_t column, std::uint32_t) { return static_cast<CellState>(column); };
  EXPECT_THAT(reduce(map.source(), 0, {5, 1})[0][0].shades,
              ElementsAre(CellShade::Value, CellShade::InsideBuilding, CellShade::UnderTerrain,
                          CellShade::Nothing, CellShade::Nothing));
  map.missing_tiles = {0};
  EXPECT_THAT(reduce(map.source(), 0, {5, 1})[0][0].shades, Each(CellShade::NotComputed));
}

TEST(MapOutlines, RoofEdgesWithoutDiagonals) {
  const city::City city = block_city();
  const city::Box all{{-1000, -1000, 0}, {1000, 1000, 0}};
  EXPECT_EQ(drawing::building_outlines(city.mesh, all).size(), 4U);
  EXPECT_TRUE(drawing::building_outlines(city.mesh, {{0, 10, 0}, {50, 50, 0}}).empty());
}

TEST(MapPictures, OnePictureOfThePapersPanels) {
  MadeUpMap map(60, 70);
  map.state = [](std::uint32_t column, std::uint32_t row) {
    return column >= 20 && column < 35 && row >= 10 && row < 25 ? CellState::InsideBuilding
                                                                : CellState::Computed;
  };
  map.value = [](Layer, std::size_t, std::uint32_t column, std::uint32_t row) {
    return row >= 60 ? kNaN : static_cast<float>(column);
  };
  const TemporaryFolder folder;
  EXPECT_THAT(write_map_pictures(folder / "new", map.source(), block_city()), ElementsAre("map.png"));
  EXPECT_THAT(files_in(folder / "new"), ElementsAre("map.png"));
  for (const auto& [pair, times] : map.requested) EXPECT_EQ(times, 1);

  const PngPixels png(test::read_bytes(folder / "new" / "map.png"));
  const SheetLayout layout(map.request.grid, map.request.layers);
  EXPECT_EQ(png.width(), 2 * static_cast<int>(layout.width()));
  EXPECT_EQ(png.height(), 2 * static_cast<int>(layout.height(3)));
  ValueCounts values;
  for (std::uint32_t row = 0; row < 60; ++row) {
    for (std::uint32_t column = 0; column < 60; ++column) {
      if (map.state(column, row) == CellState::Computed) values.add(static_cast<float>(column));
    }
  }
  for (std::size_t panel = 0; panel < 3; ++panel) {
    const drawing::Rect area = layout.map(panel);
    const auto pixel = [&](double column, double row) {
      return png.pixel(static_cast<int>(2 * (area.x + area.width * column / 60)),
                       static_cast<int>(2 * (area.bottom() - area.height * row / 70)));
    };
    const ColourScale scale = make_colour_scale(map.request.layers[panel], values);
    for (const int column : {2, 17, 41, 58}) {
      EXPECT_TRUE(PngPixels::is(pixel(column + 0.5, 40.5), scale.colour(column))) << panel << " " << column;
    }
    EXPECT_TRUE(PngPixels::is(pixel(27, 17), drawing::rgb(0xC9C9C9)));  // inside
    // The building's edge, from (-60, -30) on: darker than the grey inside.
    EXPECT_LT(pixel(20, 17) & 0xFFU, 0xB0U);
    // Stripes where there is no fix.
    std::set<std::uint32_t> stripes;
    for (int i = 0; i < 8; ++i) {
      stripes.insert(png.pixel(static_cast<int>(2 * area.x) + 100 + i, static_cast<int>(2 * area.y) + 20));
    }
    EXPECT_THAT(stripes, ElementsAre(0x56B4E9, 0xFFFFFF));
  }
}

TEST(MapPictures, SameBytesAgain) {
  MadeUpMap map(40, 30);
  map.request.times.push_back(map.request.times[0] + 900.0);
  const TemporaryFolder one, two;
  const auto names = write_map_pictures(one.path(), map.source(), block_city());
  EXPECT_EQ(write_map_pictures(two.path(), map.source(), block_city()), names);
  ASSERT_EQ(names.size(), 2U);
  for (const std::string& name : names) EXPECT_EQ(test::read_bytes(one / name), test::read_bytes(two / name));
}

TEST(MapPictures, ValuesHaveTheSameColoursAtAllTimes) {
  MadeUpMap map(20, 20, {Layer::HorizontalError});
  map.value = [](Layer, std::size_t time, std::uint32_t column, std::uint32_t) {
    return time == 0 ? 10.0F : static_cast<float>(column) + 8;
  };
  for (int i = 1; i < 3; ++i) map.request.times.push_back(map.request.times[0] + 30.0 * i);
  std::vector<std::size_t> steps;
  MapSource source = map.source();
  source.progress = [&](std::size_t done, std::size_t all) {
    EXPECT_EQ(all, 6U);
    steps.push_back(done);
  };
  const TemporaryFolder folder;
  const auto names = write_map_pictures(folder.path(), source, {});
  EXPECT_THAT(names, ElementsAre("map_t20190428T044400Z.png", "map_t20190428T044430Z.png",
                                 "map_t20190428T044500Z.png"));
  EXPECT_THAT(steps, ElementsAre(1, 2, 3, 4, 5, 6));
  // 10 m has the same colour at both times.
  const SheetLayout layout(map.request.grid, map.request.layers);
  const drawing::Rect area = layout.map(0);
  const auto at = [&](std::size_t time) {
    const PngPixels still(test::read_bytes(folder / names[time]));
    return still.pixel(static_cast<int>(2 * (area.x + area.width * 2.5 / 20)),
                       static_cast<int>(2 * (area.y + 0.5 * area.height)));
  };
  EXPECT_EQ(at(0), at(1));
}

TEST(MapPictures, AltitudesAndSheetsHaveNamesOfTheirOwn) {
  std::vector<Layer> maximum;
  for (const LayerInfo& each : all_layers()) maximum.push_back(each.layer);
  maximum.resize(21);
  MadeUpMap map(20, 16, maximum);
  map.request.altitudes_m = {2, 15.5};
  const TemporaryFolder folder;
  const auto names = write_map_pictures(folder.path(), map.source(), {});
  EXPECT_THAT(names,
              ElementsAre("map_1_a2m.png", "map_2_a2m.png", "map_3_a2m.png", "map_4_a2m.png",
                          "map_1_a15.5m.png", "map_2_a15.5m.png", "map_3_a15.5m.png", "map_4_a15.5m.png"));
  const PngPixels full(test::read_bytes(folder / "map_1_a2m.png"));
  const PngPixels last(test::read_bytes(folder / "map_4_a2m.png"));
  EXPECT_EQ(last.width(), full.width());
  EXPECT_LT(last.height(), full.height());  // three panels, not six
}

TEST(MapPictures, TimesWithinASecondAreToldApart) {
  MadeUpMap map(4, 4, {Layer::Hdop});
  map.request.times.push_back(map.request.times[0] + 0.25);
  const TemporaryFolder folder;
  EXPECT_THAT(write_map_pictures(folder.path(), map.source(), {}),
              ElementsAre("map_t20190428T044400Z.png", "map_t20190428T044400.25Z.png"));
}

TEST(MapPictures, MapsOfNothing) {
  const TemporaryFolder folder;
  MadeUpMap unknown(10, 10);
  unknown.value = [](Layer, std::size_t, std::uint32_t, std::uint32_t) { return kNaN; };
  write_map_pictures(folder / "nan", unknown.source(), {});
  unknown.missing_tiles = {0};
  write_map_pictures(folder / "missing", unknown.source(), {});
  for (const char* name : {"nan", "missing"}) {
    const PngPixels png(test::read_bytes(folder / name / "map.png"));
    EXPECT_GT(png.width(), 800);
  }
  EXPECT_NE(test::read_bytes(folder / "nan" / "map.png"), test::read_bytes(folder / "missing" / "map.png"));
}

TEST(MapPictures, OddShapes) {
  const TemporaryFolder folder;
  const std::vector<std::pair<std::uint32_t, std::uint32_t>> shapes{{1, 1}, {3000, 1}, {1, 3000}, {700, 30}};
  for (const auto& [columns, rows] : shapes) {
    MadeUpMap map(columns, rows, {Layer::SatellitesVisible, Layer::Hdop});
    map.request.grid.tile_size = 256;
    write_map_pictures(folder.path(), map.source(), block_city());
    const PngPixels png(test::read_bytes(folder / "map.png"));
    EXPECT_GE(png.height(), 2 * (94 + 215));  // of a map at least half as high as wide
    EXPECT_LE(png.height(), 2 * 920);
    // The middle of the map has the value's colour: the grid is there, however slim.
    const SheetLayout layout(map.request.grid, map.request.layers);
    const drawing::Point middle = layout.map(1).centre();
    std::set<std::uint32_t> colours;
    for (int i = -3; i <= 3; ++i) {
      for (int k = -3; k <= 3; ++k) {
        colours.insert(png.pixel(static_cast<int>(2 * middle.x) + i, static_cast<int>(2 * middle.y) + k));
      }
    }
    colours.erase(0xFFFFFF);
    EXPECT_FALSE(colours.empty()) << columns << " x " << rows;
  }
}

TEST(MapPictures, LongTitlesStayOnTheSheet) {
  MadeUpMap map(10, 10, {Layer::VerticalErrorP95});
  MapSource source = map.source();
  source.title = std::string(400, 'W');
  source.attributes["receiver"] = std::string(500, 'm');
  const TemporaryFolder folder;
  write_map_pictures(folder.path(), source, {});
  const PngPixels png(test::read_bytes(folder / "map.png"));
  for (int y = 0; y < 180; ++y) {
    for (int x = png.width() - 20; x < png.width(); ++x)
      ASSERT_EQ(png.pixel(x, y), 0xFFFFFFU) << x << " " << y;
  }
}

TEST(MapPictures, RefusesWhatItCannotWrite) {
  MadeUpMap map(4, 4);
  const TemporaryFolder folder;
  std::ofstream(folder / "file") << "no folder";
  EXPECT_THROW(write_map_pictures(folder / "file", map.source(), {}), InputError);
  EXPECT_THAT(files_in(folder.path()), ElementsAre("file"));

  // The source's exceptions pass through, and no half-written file stays.
  map.request.times.push_back(map.request.times[0] + 60.0);
  MapSource source = map.source();
  int calls = 0;
  source.slice = [&](std::size_t tile, std::size_t time) {
    if (++calls > 1) throw InputError("tile is damaged");
    return map.slice(tile, time);
  };
  EXPECT_THROW(write_map_pictures(folder.path(), source, {}), InputError);
  EXPECT_THAT(files_in(folder.path()), ElementsAre("file"));
}

TEST(MapPictures, RealCityWithItsOutlines) {
  CANYON_SHARED_DATA(mesh, "hongkong/buildings.dae");
  city::MeshImportOptions import;
  import.origin = geodesy::Geodetic::from_degrees(22.298251, 114.178761, 0);
  const city::City city = city::read_mesh_city(mesh, import);
  const city::Box bounds = city.bounds();
  MadeUpMap map(1, 1);
  map.request.grid = Grid::covering(bounds.min.x(), bounds.min.y(), bounds.max.x(), bounds.max.y(), 4);
  const TemporaryFolder folder;
  write_map_pictures(folder.path(), map.source(), city);
  const SheetLayout layout(map.request.grid, map.request.layers);
  const drawing::Outlines outlines = drawing::building_outlines(city.mesh, layout.extent());
  EXPECT_GT(outlines.size(), 2000U);
  // Lines are visible and leave the map readable.
  const auto coverage = outline_coverage(outlines, layout);
  std::size_t covered = 0;
  for (const std::uint8_t c : coverage) covered += c > 127 ? 1U : 0U;
  EXPECT_GT(covered, coverage.size() / 50);
  EXPECT_LT(covered, coverage.size() / 5);
}

}  // namespace
}  // namespace canyon::heatmap
