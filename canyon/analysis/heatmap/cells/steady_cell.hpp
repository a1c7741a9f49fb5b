#pragma once

#include <Eigen/Core>
#include <complex>
#include <cstdint>
#include <optional>
#include <span>
#include <unordered_map>
#include <utility>
#include <vector>

#include "canyon/analysis/heatmap/cells/cell_fix.hpp"
#include "canyon/analysis/heatmap/cells/cell_values.hpp"
#include "canyon/analysis/heatmap/cells/steady_sky.hpp"
#include "canyon/paths/propagation/propagator.hpp"

namespace canyon::heatmap {

/// A path of a node, for the cells around it: diffuse, or of the second order.
struct NodePath {
  std::uint32_t satellite = 0;
  bool diffuse = false;
  double excess_m = 0, rate_mps = 0;
  std::complex<double> amplitude;  ///< signal::path_amplitude()
  std::uint64_t reflector = 0;
  Eigen::Vector3f arrival;
};

/// Paths and edges that were found at one cell.
struct PathNode {
  Eigen::Vector3d position = Eigen::Vector3d::Zero();
  std::vector<propagation::KnownEdge> edges;  ///< ascending
  std::vector<NodePath> paths;                ///< by satellite, each one's in its channels' order
};

/// The cells of one task, one after another. Not thread-safe.
class SteadyCell {
 public:
  /// The references must outlive it. @param ecef_from_enu of the city @param moves fixes() are needed, layers
  /// over draws are not set
  SteadyCell(const SteadySky& sky, const propagation::Propagator& propagator,
             const receiver::ReceiverOptions& options, const LimitOptions& limits,
             const Eigen::Matrix3d& ecef_from_enu, bool moves = false);

  /// Unmapped obstacles of the next cells are those around this point: a cell, or one within a few metres.
  void move_to(const Eigen::Vector3d& point, const raytrace::RayScene& scene);
  [[nodiscard]] PathNode trace(const Eigen::Vector3d& point);
  /// @param edges that may diffract signals here, ascending @param node next to the point @param statistics
  /// whether layers over realizations are requested
  void solve(const Eigen::Vector3d& point, std::span<const propagation::KnownEdge> edges,
             const PathNode& node, bool statistics, CellValues& values);
  /// A cell that is its own node.
  void solve(const Eigen::Vector3d& point, bool statistics, CellValues& values);
  /// Fixes of the last solved cell, by lane.
  [[nodiscard]] const std::vector<CellFix::CellSolution>& fixes() const { return fixes_; }

 private:
  /// A path in the channels of the lanes. Null: 1 in all lanes.
  struct CellPath {
    double excess_m = 0, rate_mps = 0;
    std::complex<double> amplitude;
    const float *re = nullptr, *im = nullptr;  ///< random phasor
    const float* power = nullptr;              ///< of a bundle, relative to its mean
    const float* factor = nullptr;             ///< of the amplitude
    bool diffuse = false;
  };
  /// A path's sum over integration and loop filter while another path is tracked.
  struct PathSum {
    float re = 0, im = 0;          ///< coherent sum; of a bundle, for a power of 1
    float incoherent = 0;          ///< power that adds incoherently; of a bundle, its fraction
    float coherent = 0, mean = 0;  ///< of a bundle: its fraction, and its power
  };
  /// A reflector in the random phases of all lanes.
  struct Reflector {
    std::complex<double> amplitude;  ///< without the phase of the excess, so equal wherever a facet is seen
    std::vector<float> re, im;
  };
  void gather(std::size_t satellite, std::span<const NodePath> far, const Eigen::Vector3d& from_node);
  const Reflector& reflector(std::size_t satellite, const propagation::Path& path);
  /// The reflector with that key, or a new one without an amplitude.
  std::pair<Reflector&, bool> reflector(std::uint64_t key, std::size_t satellite, std::uint64_t name);
  /// Amplitude factors of obstacles at the current point, in each lane, for paths from a direction. Null: 1.
  /// @param arrival unit, ENU
  const float* obstacles(const Eigen::Vector3d& arrival);
  void follow_strongest();
  [[nodiscard]] PathSum path_sum(const SteadySatellite& satellite, const CellPath& path,
                                 const CellPath& tracked) const;
  void fill_lanes(const SteadySatellite& satellite);
  void measure(std::size_t satellite);
  void compute(const Eigen::Vector3d& from_node, const PathNode& node, bool statistics, CellValues& values);
  void locate(bool statistics, CellValues& values);

  const SteadySky& sky_;
  const propagation::Propagator& propagator_;
  const receiver::ReceiverOptions& options_;
  const LimitOptions& limits_;
  Eigen::Matrix3d ecef_from_enu_;
  double noise_sigma_m_ = 0;
  bool moves_;
  CellFix fix_;
  std::vector<disturbance::Skyline> skylines_;  // [realization]
  std::unordered_map<std::uint64_t, Reflector> reflectors_;
  std::unordered_map<std::uint64_t, std::vector<float>>
      obstacles_;                                   // by rounded arrival, at the current point
  std::vector<std::vector<float>> direct_factors_;  // [satellite][lane]
  // Values of the current cell; members, so that their memory is reused.
  Eigen::Vector3d position_ = Eigen::Vector3d::Zero();
  std::vector<propagation::SatellitePaths> traced_;
  std::vector<CellPath> paths_;
  std::vector<std::optional<PathSum>> sums_;  // [tracked path] of the current path
  tracking::BatchCodeLock::Paths lanes_;
  std::vector<float> delay_m_, power_;
  std::vector<std::size_t> tracked_;            // [lane] index of the path with the tracked carrier
  std::vector<std::vector<CellRange>> ranges_;  // [lane]
  std::vector<CellFix::CellSolution> fixes_;    // [lane]
  int los_ = 0, nlos_ = 0, visible_ = 0, blocked_ = 0;
  double largest_excess_m_ = 0;
};

}  // namespace canyon::heatmap
