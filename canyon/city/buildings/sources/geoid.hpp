#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "canyon/city/buildings/sources/gdal.hpp"
#include "canyon/city/buildings/sources/map_data.hpp"
#include "canyon/city/buildings/sources/map_options.hpp"

namespace canyon::buildings {

/// Turns a file's heights into ellipsoidal ones (WGS 84): h = H + N. N comes, in this order, from the
/// user's number, from the vertical datum that the file's reference system names (or its format prescribes,
/// or the user names) by PROJ's grids, and by GeographicLib's geoid files (EGM84, EGM96, EGM2008;
/// $GEOGRAPHICLIB_GEOID_PATH). Reference systems with ellipsoidal heights, and those that say nothing of
/// heights where the user says nothing either, add nothing. A geoid that the user names also stands in for a
/// named datum whose grid is not at hand.
class Geoid {
 public:
  struct Heights {
    std::filesystem::path file;                ///< for messages
    OGRSpatialReferenceH reference = nullptr;  ///< the file's, may have no vertical part
    /// A compound system ("EPSG:4326+5773") that the file's format prescribes where `reference` has no
    /// vertical part.
    std::string prescribed;
    std::optional<double> metres_per_unit;  ///< where the file states the unit of its heights itself
    TerrainOptions options;                 ///< the user's
    /// Whether a named datum without a grid is an error; if not, heights are taken as ellipsoidal and the
    /// note says so. A geoid that the user names is required.
    bool required = true;
  };

  /// Throws InputError where a vertical datum is named and no grid for it is at hand (unless not required),
  /// and for depths.
  explicit Geoid(const Heights& heights);
  ~Geoid();
  Geoid(Geoid&&) noexcept;
  Geoid& operator=(Geoid&&) noexcept;

  /// N [m], to be added; as exact as the grid that is installed (EGM96 grids of 15' and 5' differ by
  /// decimetres in mountains). Throws InputError where the grid does not reach. Any thread.
  [[nodiscard]] double undulation_m(const LonLat& place) const;

  /// Whether undulation_m() is that of mean sea level: false where heights are taken as ellipsoidal.
  [[nodiscard]] bool above_sea_level() const { return above_sea_level_; }
  /// Says which geoid was added and why (a remark), or that heights are taken as ellipsoidal, since their
  /// datum is not named or its geoid not at hand (a guess); and which unit is taken where none is stated.
  void say(ReadReport& notes) const {
    notes.say(guessed_ ? ReadReport::Level::Guess : ReadReport::Level::Remark, note_);
    if (!unit_note_.empty()) notes.say(ReadReport::Level::Guess, unit_note_);
  }
  /// Metres in one unit of the file's heights: as stated, else the vertical system's, else the projected
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

/// N [m] of a geoid of that name at a place. Throws InputError where its grid is not installed. Precondition:
/// `model` is not ByFile.
[[nodiscard]] double geoid_undulation_m(GeoidModel model, const LonLat& place);

}  // namespace canyon::buildings
