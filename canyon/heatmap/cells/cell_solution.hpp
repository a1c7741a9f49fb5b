#pragma once

#include <Eigen/Core>
#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "canyon/errors/atmosphere.hpp"
#include "canyon/gnss/navigation_data.hpp"
#include "canyon/heatmap/cells/linear_fix.hpp"
#include "canyon/heatmap/kernels/tile_tracer.hpp"
#include "canyon/positioning/dop.hpp"
#include "canyon/receiver/receiver.hpp"

// Position solutions that CellSolver shares among a tile's cells. Places and errors are ENU of the tile's
// centre [m].

namespace canyon::heatmap {

inline constexpr std::size_t kMostSatellites = 128;
/// positioning::solve_fix() first looks at mask and atmosphere up to this off, times PDOP: after a step of
/// 10 km ranges are bent by 10 km^2 / (2 * 20,000 km), of ten satellites.
inline constexpr double kFirstLook_m = 8;
inline constexpr double kUnknown = std::numeric_limits<double>::quiet_NaN();
inline constexpr positioning::Dop kNoDop{kUnknown, kUnknown, kUnknown, kUnknown, kUnknown};

/// Satellites of a tile by their index, below kMostSatellites.
struct SatelliteSet {
  std::array<std::uint64_t, 2> bits{};
  bool drifting = false;  ///< whether the noise's mean drifts where these are received

  void insert(std::size_t i) { bits[i / 64] |= std::uint64_t{1} << (i % 64); }
  [[nodiscard]] bool contains(std::size_t i) const { return (bits[i / 64] >> (i % 64) & 1) != 0; }
  [[nodiscard]] int size() const { return std::popcount(bits[0]) + std::popcount(bits[1]); }
  [[nodiscard]] bool operator==(const SatelliteSet&) const = default;
  /// Calls f(index), ascending.
  template <class F>
  void for_each(F&& f) const {
    for (std::size_t word = 0; word < 2; ++word) {
      for (std::uint64_t left = bits[word]; left != 0; left &= left - 1) {
        f(word * 64 + static_cast<std::size_t>(std::countr_zero(left)));
      }
    }
  }
};

/// A satellite as the solutions of a tile see it, linear about the centre.
struct TileSatellite {
  gnss::System system = gnss::System::GPS;
  Eigen::Vector3d direction;  ///< unit
  double range_m = 0;
  double sine = 0;             ///< of the elevation
  Eigen::Vector3d sine_slope;  ///< [1/m]
  /// The range to a place dx away is less by (1 + turning) direction.dx: over a longer flight the Earth turns
  /// further.
  double turning = 0;
  /// An error m of the pseudorange also shifts the instant of transmission: m (1 + range rate / c) in all.
  double error_scale = 1;
  double weight = 1;        ///< 1 / sigma^2, in any unit
  double weight_slope = 0;  ///< per sine of the elevation
  double ionosphere_m = 0;
  Eigen::Vector3d ionosphere_slope = Eigen::Vector3d::Zero();
};

/// Rotation that takes the directions b to the directions a, which are the same but for rounding (Black, A
/// passive system for determining the attitude of a satellite, AIAA Journal 2, 1964): by the first one and
/// the one that stands farthest off its line. Its error (Frobenius norm) is below 5e-15 over the sine
/// between the two for directions that are exact to rounding. Identity where all are parallel within 1e-6.
/// @param a unit, as many as b
[[nodiscard]] Eigen::Matrix3d rotation_between(std::span<const Eigen::Vector3d> a,
                                               std::span<const Eigen::Vector3d> b);

/// Saastamoinen's zenith delay over the height. Error below 1e-6 m (linear between steps of 10 m).
class ZenithDelay {
 public:
  explicit ZenithDelay(const geodesy::Geodetic& place);
  [[nodiscard]] double operator()(double height_m) const {
    if (!(height_m >= kLowest_m && height_m < kHighest_m)) return beyond(height_m);
    const double step = (height_m - kLowest_m) / kHeightStep_m;
    const auto i = static_cast<std::size_t>(step);
    const double part = step - static_cast<double>(i);
    return delay_m_[i] + part * (delay_m_[i + 1] - delay_m_[i]);
  }

 private:
  static constexpr double kLowest_m = -100, kHighest_m = 10e3, kHeightStep_m = 10;
  /// Where there is no table.
  [[nodiscard]] double beyond(double height_m) const;

  geodesy::Geodetic place_;
  std::vector<double> delay_m_;
};

/// Errors of one set of received satellites. Rows 0 to 2 of a Column are the place's error per metre of
/// pseudorange error, K; rows 3 to 11 the bend (3 x 3, by columns): how the least-squares solution moves per
/// metre of place, since H and W of the place found leave other residuals orthogonal.
struct SetSolution {
  using Column = Eigen::Matrix<double, 12, 1, Eigen::DontAlign>;
  using Matrix3 = Eigen::Matrix<double, 3, 3, Eigen::DontAlign>;

  bool solved = false;    ///< the geometry gives a fix
  bool doubtful = false;  ///< PDOP is so near its limit that places within the tile may differ
  int used = 0;
  positioning::Dop dop;
  double spread_m = 0;          ///< d_major of the stated covariance (horizontal_protection_level_m())
  double margin = 0;            ///< sine of the lowest received satellite's elevation above the mask's
  std::vector<Column> columns;  ///< [satellite]; 0 for those not used
  Column constant;              ///< by the noise's mean; the bend's part of the atmosphere as well
  /// Curvature of the ranges, as quadratic forms of the place: x x, y y, z z, x y, x z, y z.
  Eigen::Matrix<double, 3, 6, Eigen::DontAlign> curvature;
  Matrix3 turning;
  Eigen::Vector3d ionosphere;
  Matrix3 ionosphere_slope;
  Eigen::Vector3d troposphere;  ///< per metre of zenith delay
  Matrix3 troposphere_slope;
  std::vector<double> noise;  ///< [axis][draw]
};

/// Pseudorange errors at a cell.
struct CellErrors {
  SatelliteSet received;
  Eigen::Vector3d place = Eigen::Vector3d::Zero();
  int excesses = 0;  ///< that are not 0
  std::array<std::uint8_t, kMostSatellites> satellite{};
  std::array<double, kMostSatellites> excess_m{};
};

/// A fix, and how far it is off.
struct CellFix {
  int used = 0;
  positioning::Dop dop;
  double spread_m = 0;  ///< SetSolution's
  Eigen::Vector3d error = Eigen::Vector3d::Zero();
  bool shared = false;  ///< by the solution of all that is received, no edge near
};

/// Solutions of one tile at one time. Where a rule of the receiver may go either way between the places that
/// its iteration passes (mask, PDOP), and where the shared solution does not
/// converge, positioning::solve_fix() itself solves the cell. Not thread-safe: every call has its own.
class TileSolutions {
 public:
  static constexpr int kNoDraw = -1;

  /// The references must outlive it. @param draws of noise, 0: none
  TileSolutions(const receiver::ReceiverOptions& options,
                const std::map<gnss::System, gnss::Klobuchar>& klobuchar, const TileSignals& signals,
                int draws, std::uint64_t seed);

  /// ENU of the tile's centre from ENU of the city.
  [[nodiscard]] const Eigen::Matrix3d& enu_from_city() const { return enu_from_city_; }
  /// Horizontal (east, north) and vertical error at the vertical of a place.
  [[nodiscard]] Eigen::Vector3d at_vertical(const Eigen::Vector3d& place,
                                            const Eigen::Vector3d& error) const {
    const double east = place.x() * curvature_east_, north = place.y() * curvature_north_;
    return {error.x() - east * error.z(), error.y() - north * error.z(),
            error.z() + east * error.x() + north * error.y()};
  }

  /// Empty without a fix. @param draw of noise
  [[nodiscard]] std::optional<CellFix> locate(const CellErrors& cell, int draw = kNoDraw);
  /// Horizontal errors and sizes of vertical ones over the draws that have a fix, in order.
  /// @param undisturbed locate()'s answer
  void locate_draws(const CellErrors& cell, const CellFix& undisturbed, std::vector<double>& horizontal_m,
                    std::vector<double>& vertical_m);

  /// Forgets solutions where they have become many, so that memory stays bounded.
  void trim();

 private:
  /// Solves the cell by positioning::solve_fix(), as the receiver does.
  [[nodiscard]] std::optional<CellFix> solve_alone(const CellErrors& cell, int draw) const;
  /// The solution of a set, from the cache.
  const SetSolution& solution(const SatelliteSet& set);
  void solve(SetSolution& solution, const SatelliteSet& set) const;
  /// A satellite of a set that has a clock, and its column.
  struct Row {
    std::size_t satellite;
    int clock;
  };
  /// Fills in columns, constant, curvature, turning and atmosphere of a set's solution.
  /// @param fix factorised @param covariance its covariance()
  void linearise(SetSolution& solution, const std::vector<Row>& rows, const LinearFix& fix,
                 const Eigen::Matrix3d& covariance) const;
  void add_noise(SetSolution& solution, const std::vector<Row>& rows, bool drifting) const;
  void grow();
  [[nodiscard]] SetSolution::Column sum(const SetSolution& set, const CellErrors& cell) const;
  /// The shift of a place by the atmosphere.
  [[nodiscard]] Eigen::Vector3d shift_by_ionosphere(const SetSolution& set,
                                                    const Eigen::Vector3d& place) const {
    return set.ionosphere + set.ionosphere_slope * place;
  }
  [[nodiscard]] Eigen::Vector3d shift_by_troposphere(const SetSolution& set, double zenith_m,
                                                     const Eigen::Vector3d& place) const {
    return zenith_m * (set.troposphere + set.troposphere_slope * place);
  }
  /// The place's error by pseudorange errors and the signals' atmosphere.
  [[nodiscard]] Eigen::Vector3d error(const SetSolution& set, const SetSolution::Column& sums,
                                      const Eigen::Vector3d& place) const;
  /// The error x of a place solves x = constant + linear x - curvature(x), less the troposphere's correction.
  struct Terms {
    Eigen::Vector3d constant;
    Eigen::Matrix3d linear;
  };
  /// @param error by pseudorange errors alone @param corrected the ionosphere, where it is to be
  [[nodiscard]] Terms terms(const SetSolution& set, const Eigen::Vector3d& error,
                            const SetSolution::Column& sums, const Eigen::Vector3d& place,
                            bool corrected) const;
  /// Solves it from x on. Empty where it does not converge near the ground.
  /// @param delay where the troposphere is corrected: what that takes out of the error; null: not corrected
  [[nodiscard]] std::optional<Eigen::Vector3d> converge(const SetSolution& set, const Terms& terms,
                                                        const Eigen::Vector3d& place, Eigen::Vector3d x,
                                                        Eigen::Vector3d* delay) const;
  /// The error at which the receiver's looks at mask and atmosphere end. Empty where it does not converge
  /// near the ground, and where a rule of the receiver may go either way.
  /// @param terms corrected @param x to begin from
  [[nodiscard]] std::optional<Eigen::Vector3d> end_of_looks(const SetSolution& set,
                                                            const SatelliteSet& received, const Terms& terms,
                                                            const Eigen::Vector3d& place,
                                                            const Eigen::Vector3d& x) const;
  /// Solves all draws together. False, without an answer, where an edge is near.
  bool converge_draws(const SetSolution& set, const Terms& terms, const CellErrors& cell,
                      const CellFix& undisturbed);
  [[nodiscard]] double height_m(const Eigen::Vector3d& place) const {
    return height_m_ + place.z() +
           0.5 * (place.x() * place.x() * curvature_east_ + place.y() * place.y() * curvature_north_);
  }
  /// Whether every received satellite is surely above the mask at all places at which a receiver looks whose
  /// fix converges at `place`. @param shift_m distance by which corrections moved the place
  [[nodiscard]] bool clear_of_mask(const SetSolution& set, const SatelliteSet& received,
                                   const Eigen::Vector3d& place, double shift_m) const {
    const double around_m = kFirstLook_m * set.dop.pdop + shift_m;
    return (place.lpNorm<1>() + around_m) * sine_change_per_m_ < set.margin ||
           each_clear_of_mask(received, place, around_m);
  }
  [[nodiscard]] bool each_clear_of_mask(const SatelliteSet& received, const Eigen::Vector3d& place,
                                        double around_m) const;
  [[nodiscard]] Eigen::Vector3d noise(const SetSolution& set, int draw) const {
    const auto d = static_cast<std::size_t>(draw), n = static_cast<std::size_t>(draws_);
    return {set.noise[d], set.noise[n + d], set.noise[2 * n + d]};
  }
  /// A satellite's drawn noise without its mean.
  [[nodiscard]] double drawn_noise_m(std::size_t satellite, std::size_t draw, bool drifting) const {
    const auto draws = static_cast<std::size_t>(draws_);
    const double drift = drifting ? noise_m_[(satellites_.size() + satellite) * draws + draw] : 0;
    return noise_m_[satellite * draws + draw] + drift;
  }
  [[nodiscard]] double sine(const TileSatellite& satellite, const Eigen::Vector3d& place) const;
  void place_satellites(const TileSignals& signals);
  [[nodiscard]] TileSatellite satellite_of(const orbit::LineOfSight& line) const;
  void draw_noise(std::uint64_t seed);

  const receiver::ReceiverOptions& options_;
  const std::map<gnss::System, gnss::Klobuchar>& klobuchar_;
  int draws_ = 0;
  bool corrects_ = false;
  double sine_of_mask_ = 0;

  double variance_m2_ = 1;  ///< that a measurement states, over that which weights are of
  const std::vector<orbit::LineOfSight>& lines_;
  std::vector<TileSatellite> satellites_;
  Eigen::Vector3d centre_ecef_ = Eigen::Vector3d::Zero();
  Eigen::Matrix3d enu_from_ecef_ = Eigen::Matrix3d::Identity();
  geodesy::GpsTime time_;
  Eigen::Matrix3d enu_from_city_ = Eigen::Matrix3d::Identity();
  double height_m_ = 0;
  double curvature_east_ = 0, curvature_north_ = 0;  ///< of the ellipsoid [1/m]
  double sine_change_per_m_ = 0;
  std::optional<ZenithDelay> zenith_;
  std::vector<double> noise_m_;  ///< [satellite][draw], and then what drift adds
  std::vector<double> drawn_m_;  ///< errors, [axis][draw]

  std::vector<std::uint32_t> slots_;  ///< open addressing: 1 + index into sets_, or 0
  std::vector<SatelliteSet> keys_;
  std::vector<std::unique_ptr<SetSolution>> sets_;
  std::size_t last_ = 0;  ///< the set requested last: neighbours mostly request the same
};

}  // namespace canyon::heatmap
