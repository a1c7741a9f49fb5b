#pragma once

#include <Eigen/Core>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "canyon/analysis/heatmap/engine/engine.hpp"
#include "canyon/city/city.hpp"

// Boxes, times and checks against the city, for hosts that make a Request from a user's input.
namespace canyon::heatmap {

/// A box in the city's east-north plane [m].
struct EnuBox {
  Eigen::Vector2d min = Eigen::Vector2d::Zero(), max = Eigen::Vector2d::Zero();
};

/// Around a box in degrees (west, south, east, north). InputError if it is reversed, empty or not on Earth.
[[nodiscard]] EnuBox enu_box(const std::array<double, 4>& degrees, const geodesy::LocalFrame& frame);
/// West, south, east, north [deg] around a box in metres. West is above east across the antimeridian.
[[nodiscard]] std::array<double, 4> degrees_around(const EnuBox& box, const geodesy::LocalFrame& frame);
/// Around the whole city, but at most 150 m beyond everything except terrain, which may extend far. Throws
/// InputError for a city without triangles.
[[nodiscard]] EnuBox built_box(const city::City& city);
/// Throws InputError for a box that is reversed or empty, is outside the city, or extends more than 10 km
/// beyond it: rays are exact within that (RayScene). In a city without triangles every box is valid.
void check_box(const EnuBox& box, const city::City& city);
/// "terrain" or "ellipsoid". @param what the option's name in the InputError for another word
[[nodiscard]] AltitudeKind altitude_kind_named(const std::string& name, const char* what);
/// The default altitude of a map [m]: the height above the terrain of the trajectory
/// (height_above_terrain_m), else 15.
[[nodiscard]] double usual_altitude_m(const simulation::Scenario& scenario, AltitudeKind kind);
/// Throws InputError if an altitude is below the whole city.
void check_altitudes(const Request& request, const city::City& city);

/// A sidereal day, after which the satellites of GPS have the same positions: 23 h 56 m 4 s [s].
inline constexpr double kSiderealDay_s = 86'164;
/// "T,T,...", "START/END/STEP" (both ends) or "day/STEP" (a sidereal day from the start, its end left out); a
/// T is an instant (geodesy::parse_simulated_time()) or seconds from `start`, a STEP seconds or a number with
/// the suffix s, min or h. Ascending, each once, at most 100,000; `start` if `text` is empty. Throws
/// InputError for other texts. @param start empty: unknown, an InputError if it is needed
[[nodiscard]] std::vector<geodesy::GpsTime> parse_times(const std::string& text,
                                                        std::optional<geodesy::GpsTime> start);

/// Values of the whole map: cells times altitudes, times and layers. A store needs four bytes for each.
[[nodiscard]] double value_count(const Request& request);

/// Heatmap's `input_key`: a hash of the city's triangles and of the sky at `times`.
[[nodiscard]] std::string input_key(const simulation::Environment& environment,
                                    const std::vector<geodesy::GpsTime>& times);

}  // namespace canyon::heatmap
