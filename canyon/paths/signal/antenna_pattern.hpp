#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace canyon::signal {

/// Gains of a GNSS antenna towards one elevation, over an ideal isotropic antenna of the wave's polarisation.
struct AntennaGain {
  double rhcp_dbic = 0;
  double lhcp_dbic = 0;
};

/// The two bands of satellite navigation (ITU Radio Regulations): 1164 to 1300 MHz (L5, E5, B2, L2, G2, B3,
/// E6) and 1559 to 1610 MHz (L1, E1, B1, G1).
enum class Band { Lower, Upper };
[[nodiscard]] constexpr Band band_of(double carrier_hz) {
  return carrier_hz < 1.43e9 ? Band::Lower : Band::Upper;
}

/// One row of a pattern.
struct PatternPoint {
  double elevation_deg = 0;  ///< over the antenna's horizon, [-90, 90]
  double rhcp_dbic = 0;
  double lhcp_dbic = 0;
};

/// An antenna's gains for circular waves by elevation, in each of its bands; the same at every azimuth.
/// Linear in dB between rows, constant beyond the first and the last. Immutable.
class AntennaPattern {
 public:
  /// @param upper rows of the upper band, by elevation, strictly increasing, at least one; gains in +-300 dB.
  /// @param lower likewise of the lower band; none: the antenna does not receive it
  /// Else InputError.
  AntennaPattern(std::string name, std::vector<PatternPoint> upper, std::vector<PatternPoint> lower = {});

  [[nodiscard]] const std::string& name() const { return name_; }
  [[nodiscard]] const std::vector<PatternPoint>& points(Band band) const {
    return band == Band::Lower ? lower_ : upper_;
  }
  [[nodiscard]] bool receives(Band band) const { return !points(band).empty(); }
  /// @param elevation_rad [-pi/2, pi/2] (roundings beyond are accepted). NaN, and a carrier in a band that
  /// the antenna does not receive, throw InputError.
  [[nodiscard]] AntennaGain gain(double elevation_rad, double carrier_hz) const;

 private:
  std::string name_;
  std::vector<PatternPoint> upper_, lower_;
};

/// Ideal: 0 dBic for RHCP everywhere, no response to LHCP (-200 dBic).
[[nodiscard]] AntennaPattern isotropic_antenna();
/// Low-cost patch (about 25 mm square on a ground plane of 5 to 15 cm). Model within cited ranges, not a
/// measurement (docs/propagation.md): 3 dBic and an axial ratio of 2 dB at zenith, 9 dB less at the horizon.
/// Upper band only.
[[nodiscard]] AntennaPattern patch_antenna();
/// The same for both bands (two stacked patches): 1 dB less in the lower band (u-blox ZED-F9H integration
/// manual, table 27: 3 and 2 dBic typically).
[[nodiscard]] AntennaPattern dual_patch_antenna();
/// Survey or geodetic antenna. Model within cited ranges, not a measurement: 5 dBic and 1 dB of axial ratio
/// at zenith, steep below 10 degrees, small back lobe; alike in both bands (ORBIT/FR ANTE 011-A, manual).
[[nodiscard]] AntennaPattern survey_antenna();
/// Phone: linear polarisation, receives both hands equally, at every elevation 10 dB below the survey
/// antenna's zenith (Pesyna et al., ION GNSS+ 2014: 5 to 15 dB); 5 dB less in the lower band (assumed).
[[nodiscard]] AntennaPattern phone_antenna();

/// "isotropic", "patch", "dual_patch", "survey", "phone".
[[nodiscard]] std::span<const std::string_view> antenna_names();
/// The pattern of one of these names; InputError for others.
[[nodiscard]] AntennaPattern antenna_by_name(std::string_view name);

/// Cross-polar discrimination [dB], RHCP over LHCP gain, of an antenna whose axial ratio is `axial_ratio_db`
/// >= 0: 20 log10((r + 1) / (r - 1)), r = 10^(AR/20) (C. A. Balanis, Antenna Theory, 2.12; the axes of the
/// ellipse are the sum and the difference of the two circular amplitudes). The formula is its own inverse.
/// Infinite for 0 dB. InputError below 0.
[[nodiscard]] double cross_polar_discrimination_db(double axial_ratio_db);

}  // namespace canyon::signal
