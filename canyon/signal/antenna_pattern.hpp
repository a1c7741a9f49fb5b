#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace canyon::signal {

/// Gains of a GNSS antenna towards one elevation, over an ideal isotropic antenna of the wave's polarisation.
struct AntennaGain {
  double rhcp_dbic = 0;
  double lhcp_dbic = 0;
};

/// One row of a pattern.
struct PatternPoint {
  double elevation_deg = 0;  ///< over the antenna's horizon, [-90, 90]
  double rhcp_dbic = 0;
  double lhcp_dbic = 0;
};

/// What an antenna makes of circular waves by elevation; the same at every azimuth. Linear in dB between
/// rows, constant beyond the first and the last. Immutable.
class AntennaPattern {
 public:
  /// @param points by elevation, rising strictly; at least one; gains within +-300 dB. Else InputError.
  AntennaPattern(std::string name, std::vector<PatternPoint> points);

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const std::vector<PatternPoint>& points() const { return points_; }
  /// @param elevation_rad [-pi/2, pi/2] (rounding beyond is forgiven); NaN throws InputError
  [[nodiscard]] AntennaGain gain(double elevation_rad) const;

 private:
  std::string name_;
  std::vector<PatternPoint> points_;
};

/// Ideal: 0 dBic for RHCP everywhere, deaf to LHCP (-200 dBic).
[[nodiscard]] AntennaPattern isotropic_antenna();
/// Low-cost patch (about 25 mm square on a ground plane of 5 to 15 cm). Model within cited ranges, not a
/// measurement (docs/propagation.md): 3 dBic and an axial ratio of 2 dB at zenith, 9 dB less at the horizon.
[[nodiscard]] AntennaPattern patch_antenna();
/// Survey or geodetic antenna. Model within cited ranges, not a measurement: 5 dBic and 1 dB of axial ratio
/// at zenith, steep below 10 degrees, small back lobe.
[[nodiscard]] AntennaPattern survey_antenna();
/// Phone: linear polarisation, hears both hands alike, at every elevation 10 dB below the survey antenna's
/// zenith (Pesyna et al., ION GNSS+ 2014: 5 to 15 dB).
[[nodiscard]] AntennaPattern phone_antenna();

/// The pattern "isotropic", "patch", "survey" or "phone"; InputError for another name.
[[nodiscard]] AntennaPattern antenna_by_name(std::string_view name);

/// Cross-polar discrimination [dB], RHCP over LHCP gain, of an antenna whose axial ratio is `axial_ratio_db`
/// >= 0: 20 log10((r + 1) / (r - 1)), r = 10^(AR/20) (C. A. Balanis, Antenna Theory, 2.12; the two circular
/// amplitudes make the ellipse's axes as sum and difference). Infinite for 0 dB. InputError below 0.
[[nodiscard]] double cross_polar_discrimination_db(double axial_ratio_db);
/// The inverse: 20 log10((q + 1) / (q - 1)), q = 10^(XPD/20); the formula is its own inverse.
[[nodiscard]] double axial_ratio_db(double cross_polar_discrimination_db);

}  // namespace canyon::signal
