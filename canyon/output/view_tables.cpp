#include "canyon/output/view_tables.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>

namespace canyon::output {
namespace {

// One by one: GCC 10 has no `using enum`.
constexpr ViewType F64 = ViewType::F64, F32 = ViewType::F32, I32 = ViewType::I32, U32 = ViewType::U32,
                   U16 = ViewType::U16, U8 = ViewType::U8;

constexpr std::array kEpochColumns{
    ViewColumn{"time_s", F64, "s", "since `time.begin`"},
    ViewColumn{"east_m", F64, "m", "true antenna, east in the city's frame"},
    ViewColumn{"north_m", F64, "m", "true antenna, north"},
    ViewColumn{"up_m", F64, "m", "true antenna, up"},
    ViewColumn{"yaw_deg", F64, "deg", "true direction of travel, from east counter-clockwise"},
    ViewColumn{"roll_deg", F64, "deg", "left side up; 0 unless the trajectory has an attitude"},
    ViewColumn{"pitch_deg", F64, "deg", "nose up; 0 unless the trajectory has an attitude"},
    ViewColumn{"status", U8, "", "index into `words.status`; 1 is a fix"},
    ViewColumn{"fix_east_m", F64, "m", "fix, east in the city's frame"},
    ViewColumn{"fix_north_m", F64, "m", "fix, north"},
    ViewColumn{"fix_up_m", F64, "m", "fix, up"},
    ViewColumn{"covariance_east_m2", F64, "m^2", "variance east that the receiver states"},
    ViewColumn{"covariance_north_m2", F64, "m^2", "variance north"},
    ViewColumn{"covariance_up_m2", F64, "m^2", "variance up"},
    ViewColumn{"skyline", I32, "", "row of `skylines`; -1: none"},
};

constexpr std::array kSkylineColumns{
    ViewColumn{"elevation", U8, "0.5 deg", "highest hidden elevation in each of skyline_sectors directions"},
};

constexpr std::array kSatelliteColumns{
    ViewColumn{"epoch", U32, "", "index of the receiver's epoch"},
    ViewColumn{"satellite", U16, "", "index into the header's satellites"},
    ViewColumn{"flags", U8, "", "1 above the mask, 2 used in the fix, 4 measured, 8 excluded"},
    ViewColumn{"paths", U16, "", "so many rows of `paths` belong to it; they follow those of the row before"},
};

constexpr std::array kPathColumns{
    ViewColumn{"kind", U8, "", "index into `words.path`"},
};

constexpr std::array kMapCellColumns{
    ViewColumn{"state", U8, "", "index into map.states; 0 has values"},
    ViewColumn{"up_m", F32, "m", "of the cell's centre, city's frame; NaN without terrain"},
};

constexpr std::array kMapValueColumns{
    ViewColumn{"value", F32, "", "layer by layer, of each all cells; in the layer's unit over its factor"},
};

constexpr std::array kComparisonColumns{
    ViewColumn{"recorded_rms_m", F32, "m", "of the recorded pseudorange errors; NaN without one"},
    ViewColumn{"simulated_rms_m", F32, "m", "of the simulated ones"},
    ViewColumn{"difference_rms_m", F32, "m", "recorded less simulated, of satellites that both measure"},
    ViewColumn{"both", U16, "", "so many satellites"},
};

constexpr std::array kBodyColumns{
    ViewColumn{"epoch", U32, "", "index of the receiver's epoch"},
    ViewColumn{"kind", U8, "", "index into `words.body`"},
    ViewColumn{"east_m", F32, "m", "of its middle, city's frame, rounded to 1/64 as all that follows"},
    ViewColumn{"north_m", F32, "m", "of its middle"},
    ViewColumn{"low_m", F32, "m", "up, of its lowest point"},
    ViewColumn{"high_m", F32, "m", "up, of its highest point"},
    ViewColumn{"yaw_deg", F32, "deg", "of its length, from east counter-clockwise"},
    ViewColumn{"length_m", F32, "m", "of a crown its diameter"},
    ViewColumn{"width_m", F32, "m", "of a crown its diameter"},
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
  static const std::vector<ViewColumn> epochs = with_columns_of(TableKind::Epochs, kEpochColumns);
  static const std::vector<ViewColumn> satellites = with_columns_of(TableKind::Satellites, kSatelliteColumns);
  static const std::vector<ViewColumn> paths = with_columns_of(TableKind::Paths, kPathColumns);
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
  std::string text = "| column | type | unit | meaning |\n|---|---|---|---|\n";
  for (const ViewColumn& c : table.columns) {
    const bool indexed =
        c.from != nullptr && (c.from->kind == Column::Kind::Word || c.from->kind == Column::Kind::Text);
    text +=
        fmt::format("| `{}` | {} | {}{}| {}{} |\n", c.name, name(c.type), c.unit, c.unit.empty() ? "" : " ",
                    indexed ? fmt::format("index into `words.{}`: ", c.name) : "", c.about);
  }
  return text;
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
