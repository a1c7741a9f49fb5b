#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "canyon/analysis/heatmap/cells/cell_fix.hpp"
#include "canyon/analysis/heatmap/cells/cell_solver.hpp"
#include "canyon/analysis/heatmap/kernels/tile_tracer.hpp"
#include "canyon/paths/disturbance/shadowing.hpp"
#include "canyon/paths/disturbance/skyline.hpp"
#include "canyon/receiver/receiver.hpp"
#include "canyon/receiver/tracking/batch_code_lock.hpp"
#include "canyon/receiver/tracking/channel.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/sky/range_errors.hpp"

namespace canyon::heatmap {

/// A satellite above the mask of a tile, and its position-independent values in the receivers of all lanes.
/// Lane 0 is the receiver without noise, lane d + 1 that of realization d; lists of lanes are padded.
struct SteadySatellite {
  orbit::LineOfSight line;          ///< from the tile's centre
  Eigen::Vector3d direction;        ///< unit, ENU of the city
  double direction_rate_radps = 0;  ///< SatelliteView::direction_rate_radps()
  const gnss::Signal* signal = nullptr;
  double carrier_hz = 0, wavelength_m = 0;
  std::shared_ptr<const tracking::BatchCodeLock> code;
  double peak_power = 1;  ///< of the prompt correlator on a path of power 1
  /// Noise of the code; empty: the receiver's loops have no noise.
  std::optional<tracking::CodeLoopNoise> noise;
  double sigma_factor = 1;            ///< FixInputOptions::sigma_factor
  std::vector<double> clear_cn0_hz;   ///< [lane] in a clear line of sight
  std::vector<double> direct_factor;  ///< [lane] factor of shadows on the direct path's amplitude
  std::vector<double> error_m;        ///< [lane] of the pseudorange, without paths and code loop
  std::vector<double> code_normal;    ///< [lane] code loop's noise over its deviation
  std::vector<double> cn0_noise_db;   ///< [lane] of the reported C/N0
  /// Unit phasors of diffuse bundles in their order, and their power over its mean; [bundle][lane].
  std::vector<float> fade_re, fade_im, fade_power;
};

/// The sky and the realizations of one tile and time: everything independent of the cell. Const, thread-safe.
class SteadySky {
 public:
  SteadySky(const simulation::Environment& environment, const receiver::ReceiverOptions& options,
            int max_clusters, const MonteCarloOptions& monte_carlo, int lanes, const Eigen::Vector3d& centre,
            geodesy::GpsTime time);

  [[nodiscard]] const std::vector<SteadySatellite>& satellites() const { return satellites_; }
  [[nodiscard]] const std::vector<FixSatellite>& fix_satellites() const { return fix_satellites_; }
  [[nodiscard]] const std::vector<Eigen::Vector3d>& directions() const { return directions_; }
  [[nodiscard]] int lanes() const { return lanes_; }
  /// A multiple of BatchCodeLock::kWidth.
  [[nodiscard]] std::size_t padded() const { return padded_; }
  /// e^(j phi0) of a reflector in each lane. @param re, im padded() each
  void phases_of(std::size_t satellite, std::uint64_t reflector, float* re, float* im) const;
  /// Skyline of each realization, not yet at a point; empty without obstacles. Each task has its own copy.
  [[nodiscard]] const std::vector<disturbance::Skyline>& skylines() const { return skylines_; }

 private:
  struct NoiseSamples {
    std::vector<std::uint64_t> seeds;                         ///< [realization]
    std::vector<sky::RangeErrorModel> space;                  ///< [realization], or empty
    std::vector<sky::RangeErrorModel::Reception> receptions;  ///< likewise, at the tile's centre
    std::vector<disturbance::Shadowing> shadowings;           ///< [realization], or empty
  };
  /// Code loops that already exist.
  using Locks = std::vector<std::shared_ptr<const tracking::BatchCodeLock>>;
  [[nodiscard]] SteadySatellite satellite_of(const TileErrors& common, const orbit::LineOfSight& line,
                                             Locks& locks);
  void fill_lanes(const TileErrors& common, NoiseSamples& monte_carlo, std::size_t bundles,
                  SteadySatellite& s);

  int lanes_;
  std::size_t padded_;
  std::vector<SteadySatellite> satellites_;
  std::vector<FixSatellite> fix_satellites_;
  std::vector<Eigen::Vector3d> directions_;
  std::vector<tracking::ChannelModel> models_;  // [realization]
  std::vector<disturbance::Skyline> skylines_;  // [realization]
};

}  // namespace canyon::heatmap
