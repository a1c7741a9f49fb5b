#include "canyon/view/tables/tables.hpp"

#include <array>
#include <cstddef>

namespace canyon::view {
namespace {

// One by one: GCC 10 has no `using enum`.
constexpr ColumnType F64 = ColumnType::F64, F32 = ColumnType::F32, I32 = ColumnType::I32,
                     U32 = ColumnType::U32, U16 = ColumnType::U16, U8 = ColumnType::U8;

constexpr std::array kEpochColumns{
    Column{"time_s", F64, "s", "since the header's time.begin"},
    Column{"east_m", F64, "m", "true antenna, city's frame"},
    Column{"north_m", F64, "m", ""},
    Column{"up_m", F64, "m", ""},
    Column{"yaw_deg", F64, "deg", "direction of travel, from east counter-clockwise"},
    Column{"roll_deg", F64, "deg", "left side up; 0 unless the trajectory has an attitude"},
    Column{"pitch_deg", F64, "deg", "nose up"},
    Column{"velocity_east_mps", F64, "m/s", "true"},
    Column{"velocity_north_mps", F64, "m/s", ""},
    Column{"velocity_up_mps", F64, "m/s", ""},
    Column{"status", U8, "", "index into words.status; 1 is a fix"},
    Column{"placement", U8, "", "index into words.placement"},
    Column{"fix_east_m", F64, "m", "fix, city's frame; NaN without one"},
    Column{"fix_north_m", F64, "m", ""},
    Column{"fix_up_m", F64, "m", ""},
    Column{"error_east_m", F64, "m", "fix minus truth, at the truth; NaN without a fix"},
    Column{"error_north_m", F64, "m", ""},
    Column{"error_up_m", F64, "m", ""},
    Column{"covariance_east_m2", F64, "m^2", "that the receiver states; NaN without a fix"},
    Column{"covariance_north_m2", F64, "m^2", ""},
    Column{"covariance_up_m2", F64, "m^2", ""},
    Column{"covariance_east_north_m2", F64, "m^2", ""},
    Column{"covariance_east_up_m2", F64, "m^2", ""},
    Column{"covariance_north_up_m2", F64, "m^2", ""},
    Column{"gdop", F64, "", "NaN without a fix"},
    Column{"pdop", F64, "", ""},
    Column{"hdop", F64, "", ""},
    Column{"vdop", F64, "", ""},
    Column{"tdop", F64, "", ""},
    Column{"used", U16, "", "satellites in the fix"},
    Column{"visible", U16, "", "tracked, above the mask"},
    Column{"blocked", U16, "", "above the mask, not tracked"},
    Column{"skyline", I32, "", "row of skylines; -1: none"},
};

constexpr std::array kSkylineColumns{
    Column{"elevation", U8, "0.5 deg", "highest hidden elevation in each of skyline_sectors directions"},
};

constexpr std::array kSatelliteColumns{
    Column{"epoch", U32, "", "index of the receiver's epoch"},
    Column{"satellite", U16, "", "index into the header's satellites"},
    Column{"azimuth_deg", F32, "deg", "true, from north clockwise"},
    Column{"elevation_deg", F32, "deg", "true"},
    Column{"visibility", U8, "", "index into words.visibility"},
    Column{"flags", U8, "", "1 above the mask, 2 used, 4 measured, 8 excluded"},
    Column{"lock", U8, "", "index into words.lock"},
    Column{"cn0_dbhz", F32, "dB-Hz", "that the receiver states; NaN where it measures nothing"},
    Column{"true_cn0_dbhz", F32, "dB-Hz", "NaN where nothing arrives or signals have no strength"},
    Column{"excess_m", F32, "m", "code delay by paths; NaN where the signal is not tracked"},
    Column{"pseudorange_error_m", F32, "m", "NaN without a measurement"},
    Column{"residual_m", F32, "m", "NaN where not in the fix"},
    Column{"paths", U16, "", "rows of the table paths that belong to it, in order"},
};

constexpr std::array kPathColumns{
    Column{"kind", U8, "", "index into words.path"},
    Column{"order", U8, "", "reflections on the way"},
    Column{"excess_m", F32, "m", "to 1/1024"},
    Column{"loss_db", F32, "dB", "below the clear line of sight, to 1/64; NaN without strength"},
    Column{"point_east_m", F32, "m", "next to the antenna, to 1/64; NaN on a direct path"},
    Column{"point_north_m", F32, "m", ""},
    Column{"point_up_m", F32, "m", ""},
    Column{"far_east_m", F32, "m", "next to the satellite, where two facets reflect; else NaN"},
    Column{"far_north_m", F32, "m", ""},
    Column{"far_up_m", F32, "m", ""},
};

constexpr std::array kMapCellColumns{
    Column{"state", U8, "", "index into map.states; 0 has values"},
    Column{"up_m", F32, "m", "of the cell's centre, city's frame; NaN without terrain"},
};

constexpr std::array kMapValueColumns{
    Column{"value", F32, "", "layer by layer, of each all cells; in the layer's unit over its factor"},
};

constexpr std::array kComparisonColumns{
    Column{"recorded_rms_m", F32, "m", "of the recorded pseudorange errors; NaN without one"},
    Column{"simulated_rms_m", F32, "m", "of the simulated ones"},
    Column{"difference_rms_m", F32, "m", "recorded less simulated, of satellites that both measure"},
    Column{"both", U16, "", "so many satellites"},
};

constexpr std::array kBodyColumns{
    Column{"epoch", U32, "", "index of the receiver's epoch"},
    Column{"kind", U8, "", "index into words.body"},
    Column{"east_m", F32, "m", "of its middle, city's frame, to 1/64"},
    Column{"north_m", F32, "m", ""},
    Column{"low_m", F32, "m", "up, of its lowest and its highest point"},
    Column{"high_m", F32, "m", ""},
    Column{"yaw_deg", F32, "deg", "of its length, from east counter-clockwise"},
    Column{"length_m", F32, "m", ""},
    Column{"width_m", F32, "m", ""},
};

constexpr std::array kTables{Table{"epochs", kEpochColumns},          Table{"skylines", kSkylineColumns},
                             Table{"satellites", kSatelliteColumns},  Table{"paths", kPathColumns},
                             Table{"map_cells", kMapCellColumns},     Table{"map_values", kMapValueColumns},
                             Table{"comparison", kComparisonColumns}, Table{"bodies", kBodyColumns}};

}  // namespace

std::string_view name(ColumnType type) {
  static constexpr std::array<std::string_view, 6> kNames{"f64", "f32", "i32", "u32", "u16", "u8"};
  return kNames[static_cast<std::size_t>(type)];
}

std::size_t size_of(ColumnType type) {
  static constexpr std::array<std::size_t, 6> kSizes{8, 4, 4, 4, 2, 1};
  return kSizes[static_cast<std::size_t>(type)];
}

std::span<const Table> tables() {
  return kTables;
}

}  // namespace canyon::view
