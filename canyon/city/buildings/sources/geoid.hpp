#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "canyon/city/buildings/sources/gdal.hpp"
#include "canyon/city/buildings/sources/map_data.hpp"
#include "canyon/city/buildings/sources/map_options.hpp"

namespace canyon::buildings {

/// Converts a file's heights into ellipsoidal ones (WGS 84): h = H + N. The sources of N, in this order: the
/// user's number; PROJ's grid of the vertical datum named in the file's reference system (or prescribed by
/// its format, or named by the user); GeographicLib's geoid files (EGM84, EGM96, EGM2008;
/// $GEOGRAPHICLIB_GEOID_PATH). Reference systems with ellipsoidal heights add nothing, nor do those without a
/// height reference if the user names none. The user's geoid also replaces a datum without a grid.
class Geoid {
 public:
  struct Heights {
    std::filesystem::path file;                ///< for messages
    OGRSpatialReferenceH reference = nullptr;  ///< the file's; may lack a vertical part
    /// A compound system ("EPSG:4326+5773") of the file's format, used if `reference` has no vertical part.
    std::string prescribed;
    std::optional<double> metres_per_unit;  ///< if the file gives the unit of its heights
    TerrainOptions options;                 ///< the user's
    /// Whether a named datum without a grid is an error; if not, heights are read as ellipsoidal, with a
    /// note. A geoid named by the user is always required.
    bool required = true;
  };

  /// Throws InputError for depths, and if a named vertical datum has no grid (unless not required).
  explicit Geoid(const Heights& heights);
  ~Geoid();
  Geoid(Geoid&&) noexcept;
  Geoid& operator=(Geoid&&) noexcept;

  /// N [m], to be added; as accurate as the installed grid (EGM96 grids of 15' and 5' differ by decimetres in
  /// mountains). Throws InputError outside the grid. Thread-safe.
  [[nodiscard]] double undulation_m(const LonLat& point) const;

  /// Whether undulation_m() is that of mean sea level; false if heights are read as ellipsoidal.
  [[nodiscard]] bool above_sea_level() const { return above_sea_level_; }
  /// Notes which geoid was added and why (a remark), or that heights are read as ellipsoidal, because their
  /// datum is not named or its geoid not available (a guess); and which unit is assumed if none is given.
  void add_line(ReadReport& notes) const {
    notes.add_line(guessed_ ? ReadReport::Level::Guess : ReadReport::Level::Remark, note_);
    if (!unit_note_.empty()) notes.add_line(ReadReport::Level::Guess, unit_note_);
  }
  /// Metres in one unit of the file's heights: as given, else the vertical system's, else the projected
  /// one's; 1 without these.
  [[nodiscard]] double metres_per_unit() const { return metres_per_unit_; }

 private:
  struct Grid;
  std::unique_ptr<Grid> grid_;
  double constant_m_ = 0;
  double metres_per_unit_ = 1;
  bool guessed_ = false, above_sea_level_ = false;
  std::string note_, unit_note_;
};

/// N [m] of a geoid model at a position. InputError without its grid. Precondition: `model` is not ByFile.
[[nodiscard]] double geoid_undulation_m(GeoidModel model, const LonLat& point);

}  // namespace canyon::buildings
