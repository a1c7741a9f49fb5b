#pragma once

#include <map>
#include <vector>

#include "canyon/geodesy/frames.hpp"
#include "canyon/gnss/signals.hpp"
#include "canyon/heatmap/cells/cell_fix.hpp"
#include "canyon/propagation/arrival.hpp"
#include "canyon/receiver/receiver_options.hpp"

namespace canyon::heatmap {

/// Errors that the pseudoranges of all cells of a tile have in common: values at its centre.
struct TileErrors {
  const receiver::ReceiverOptions& options;
  const std::map<gnss::System, gnss::Klobuchar>& klobuchar;
  geodesy::GpsTime time;
  geodesy::Geodetic centre;

  /// The signal that the receiver measures first of a satellite; null: none.
  [[nodiscard]] const gnss::Signal* signal_of(gnss::SatelliteId id) const;
  /// Delays in a signal less what the fix takes off, and the receiver's own without its drift [m].
  /// @param carrier_hz of the satellite's signal
  [[nodiscard]] double error_m(const propagation::SatelliteView& view, const gnss::Signal& signal,
                               double carrier_hz) const;
  /// RangingOptions::sigma_factor of a signal.
  [[nodiscard]] double sigma_factor(gnss::SatelliteId id, const gnss::Signal& signal) const;
};

/// Place of the antenna from which a satellite is seen.
[[nodiscard]] geodesy::Geodetic seen_from(const orbit::LineOfSight& line);
/// Satellites for a CellFix. @param lines from the tile's centre
[[nodiscard]] std::vector<FixSatellite> fix_satellites(const std::vector<orbit::LineOfSight>& lines,
                                                       const geodesy::Geodetic& centre);

}  // namespace canyon::heatmap
