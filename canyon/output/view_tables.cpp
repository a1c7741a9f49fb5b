#include "canyon/output/view_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>

#include "canyon/base/text.hpp"

namespace canyon::output {
namespace {

// One by one: GCC 10 has no `using enum`.
constexpr ViewType kF64 = ViewType::F64, kF32 = ViewType::F32, kI32 = ViewType::I32, kU32 = ViewType::U32,
                   kU16 = ViewType::U16, kU8 = ViewType::U8;

constexpr std::array kViewOfEpochs{
    ViewColumn{"time_s", kF64, "s", "since `time.begin`"},
    ViewColumn{"east_m", kF64, "m", "true antenna, east in the city's frame"},
    ViewColumn{"north_m", kF64, "m", "true antenna, north"},
    ViewColumn{"up_m", kF64, "m", "true antenna, up"},
    ViewColumn{"yaw_deg", kF64, "deg", "true direction of travel, from east counter-clockwise"},
    ViewColumn{"roll_deg", kF64, "deg", "left side up; 0 unless the trajectory has an attitude"},
    ViewColumn{"pitch_deg", kF64, "deg", "nose up; 0 unless the trajectory has an attitude"},
    ViewColumn{"status", kU8, "", "index into `words.status`; 1 is a fix"},
    ViewColumn{"fix_east_m", kF64, "m", "fix, east in the city's frame"},
    ViewColumn{"fix_north_m", kF64, "m", "fix, north"},
    ViewColumn{"fix_up_m", kF64, "m", "fix, up"},
    ViewColumn{"covariance_east_m2", kF64, "m^2", "variance east that the receiver states"},
    ViewColumn{"covariance_north_m2", kF64, "m^2", "variance north"},
    ViewColumn{"covariance_up_m2", kF64, "m^2", "variance up"},
    ViewColumn{"skyline", kI32, "", "row of `skylines`; -1: none"},
};

constexpr std::array kSkylineColumns{
    ViewColumn{"elevation", kU8, "0.5 deg", "highest hidden elevation in each of skyline_sectors directions"},
};

constexpr std::array kViewOfSatellites{
    ViewColumn{"epoch", kU32, "", "index of the receiver's epoch"},
    ViewColumn{"satellite", kU16, "", "index into the header's satellites"},
    ViewColumn{"flags", kU8, "", "1 above the mask, 2 used in the fix, 4 measured, 8 excluded"},
    ViewColumn{"paths", kU16, "", "number of its rows of `paths`; they follow those of the row before"},
};

constexpr std::array kViewOfPaths{
    ViewColumn{"kind", kU8, "", "index into `words.path`"},
};

constexpr std::array kMapCellColumns{
    ViewColumn{"state", kU8, "", "index into map.states; 0 has values"},
    ViewColumn{"up_m", kF32, "m", "of the cell's centre, city's frame; NaN without terrain"},
};

constexpr std::array kMapValueColumns{
    ViewColumn{"value", kF32, "", "layer by layer, of each all cells; in the layer's unit over its factor"},
};

constexpr std::array kComparisonColumns{
    ViewColumn{"recorded_rms_m", kF32, "m", "of the recorded pseudorange errors; NaN without one"},
    ViewColumn{"simulated_rms_m", kF32, "m", "of the simulated ones"},
    ViewColumn{"difference_rms_m", kF32, "m", "recorded less simulated, of satellites that both measure"},
    ViewColumn{"both", kU16, "", "number of satellites"},
};

constexpr std::array kBodyColumns{
    ViewColumn{"epoch", kU32, "", "index of the receiver's epoch"},
    ViewColumn{"kind", kU8, "", "index into `words.body`"},
    ViewColumn{"east_m", kF32, "m", "of its middle, city's frame, rounded to 1/64 as all that follows"},
    ViewColumn{"north_m", kF32, "m", "of its middle"},
    ViewColumn{"low_m", kF32, "m", "up, of its lowest point"},
    ViewColumn{"high_m", kF32, "m", "up, of its highest point"},
    ViewColumn{"yaw_deg", kF32, "deg", "of its length, from east counter-clockwise"},
    ViewColumn{"length_m", kF32, "m", "of a crown its diameter"},
    ViewColumn{"width_m", kF32, "m", "of a crown its diameter"},
};

/// Own columns, and behind them those of a table of all outputs.
std::vector<ViewColumn> with_columns_of(TableKind kind, std::span<const ViewColumn> own) {
  std::vector<ViewColumn> columns(own.begin(), own.end());
  for (const Column& c : table(kind).columns) {
    if (c.view) columns.push_back({c.view_name, *c.view, c.unit, c.help, &c});
  }
  return columns;
}

}  // namespace

std::string_view name(ViewType type) {
  static constexpr std::array<std::string_view, 6> kNames{"f64", "f32", "i32", "u32", "u16", "u8"};
  return kNames[static_cast<std::size_t>(type)];
}

std::size_t size_of(ViewType type) {
  static constexpr std::array<std::size_t, 6> kSizes{8, 4, 4, 4, 2, 1};
  return kSizes[static_cast<std::size_t>(type)];
}

std::span<const ViewTable> view_tables() {
  static const std::vector<ViewColumn> epochs = with_columns_of(TableKind::Epochs, kViewOfEpochs);
  static const std::vector<ViewColumn> satellites = with_columns_of(TableKind::Satellites, kViewOfSatellites);
  static const std::vector<ViewColumn> paths = with_columns_of(TableKind::Paths, kViewOfPaths);
  static const std::array all{ViewTable{"epochs", epochs},
                              ViewTable{"skylines", kSkylineColumns},
                              ViewTable{"satellites", satellites},
                              ViewTable{"paths", paths},
                              ViewTable{"map_cells", kMapCellColumns},
                              ViewTable{"map_values", kMapValueColumns},
                              ViewTable{"comparison", kComparisonColumns},
                              ViewTable{"bodies", kBodyColumns}};
  return all;
}

std::string markdown(const ViewTable& table) {
  std::vector<TextRow> rows;
  for (const ViewColumn& c : table.columns) {
    const bool indexed =
        c.from != nullptr && (c.from->kind == Column::Kind::Word || c.from->kind == Column::Kind::Text);
    rows.push_back({fmt::format("`{}`", c.name), std::string(name(c.type)), std::string(c.unit),
                    (indexed ? fmt::format("index into `words.{}`: ", c.name) : "") + std::string(c.about)});
  }
  return markdown_table({"column", "type", "unit", "meaning"}, rows);
}

std::size_t ViewWords::index(std::string_view column, const std::string& text) {
  std::vector<std::string>& list = lists_.find(column)->second;
  const auto at = std::find(list.begin(), list.end(), text);
  if (at == list.end()) list.push_back(text);
  return static_cast<std::size_t>(std::find(list.begin(), list.end(), text) - list.begin());
}

void ViewWords::clear() {
  for (const ViewTable& table : view_tables()) {
    for (const ViewColumn& c : table.columns) {
      if (c.from != nullptr && c.from->kind == Column::Kind::Text) lists_[std::string(c.name)] = {""};
    }
  }
}

}  // namespace canyon::output
