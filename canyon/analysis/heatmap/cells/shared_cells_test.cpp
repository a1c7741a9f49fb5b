#include "canyon/analysis/heatmap/cells/shared_cells.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <string>
#include <vector>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/receiver/receiver_options.hpp"
#include "tests/support/tile_scene.hpp"

namespace canyon::heatmap::shared_cells_test {
namespace {

using geodesy::Geodetic;
using gnss::System;
using positioning::Weighting;
using receiver::ReceiverOptions;
using test::Maps;
using test::solve;
using test::TileScene;

const Geodetic kHongKong = Geodetic::from_degrees(22.3, 114.18, 30);
const std::vector<System> kGps{System::GPS};
const std::vector<System> kThree{System::GPS, System::Galileo, System::BeiDou};

const std::vector<Layer> kFixLayers{
    Layer::HorizontalError, Layer::VerticalError, Layer::Availability, Layer::Hdop, Layer::Pdop, Layer::Vdop,
    Layer::SatellitesUsed};

/// Bounds on the linear fix's error, relative to the error: it neglects the curvature of the ranges at PDOPs
/// up to 100, and uses the directions and (second bound) the atmosphere of the tile's centre.
constexpr double kLinear = 1e-3, kByAtmosphere = 4e-3;

struct Agreement {
  int fixes = 0, none = 0, differ = 0, fewer = 0, extreme = 0, below = 0;
  double worst = 0;  ///< difference of errors over the error, or over 1 m if that is more
  double worst_dop = 0, largest_m = 0;
};

/// Compares every cell with positioning::solve_fix() there, for errors below 1 km and PDOP below 100.
Agreement compare(const TileScene& scene, const ReceiverOptions& options) {
  const SharedReceiver solver{options, {}, scene.klobuchar, {}};
  const Maps maps = solve(solver, scene, kFixLayers);
  Agreement agreement;
  for (std::size_t i = 0; i < scene.cells.state.size(); ++i) {
    const TileScene::Result result = scene.reference_fix(i, options);
    const bool solved = result.fix.solved();
    const bool far = solved && std::hypot(result.horizontal_m, result.vertical_m) > 1000;
    if (far || maps[4][i] > 100 || std::hypot(maps[0][i], maps[1][i]) > 1000) {
      ++agreement.extreme;
      continue;
    }
    if ((maps[2][i] == 1) != solved || maps[6][i] != static_cast<float>(result.fix.used.size())) {
      std::printf("  cell %zu: fix %d with %zu, map %.0f with %.0f; error %.1f %.1f, PDOP %.1f\n", i, solved,
                  result.fix.used.size(), double{maps[2][i]}, double{maps[6][i]}, result.horizontal_m,
                  result.vertical_m, result.fix.dop ? result.fix.dop->pdop : 0);
      ++agreement.differ;
      continue;
    }
    ++(solved ? agreement.fixes : agreement.none);
    if (!solved) {
      EXPECT_TRUE(std::isnan(maps[0][i]) && std::isnan(maps[1][i]) && std::isnan(maps[3][i]));
      continue;
    }
    std::size_t received = 0;
    for (const auto& visibility : scene.signals.visibility)
      received += visibility[i] != CellVisibility::Blocked;
    agreement.fewer += result.fix.used.size() < received;
    agreement.below += result.fix.position.height_m < -100;
    const double error_m = std::hypot(result.horizontal_m, result.vertical_m);
    agreement.largest_m = std::max(agreement.largest_m, error_m);
    agreement.worst = std::max(agreement.worst, std::max(std::abs(double{maps[0][i]} - result.horizontal_m),
                                                         std::abs(double{maps[1][i]} - result.vertical_m)) /
                                                    std::max(1.0, error_m));
    const positioning::Dop& dop = *result.fix.dop;
    agreement.worst_dop =
        std::max({agreement.worst_dop, std::abs(double{maps[3][i]} / dop.hdop - 1),
                  std::abs(double{maps[4][i]} / dop.pdop - 1), std::abs(double{maps[5][i]} / dop.vdop - 1)});
  }
  std::printf(
      "  %d fixes (%d of fewer satellites, %d below -100 m), %d none, %d extreme, %d differ; errors to "
      "%.0f m within %.2e, DOPs within %.1e\n",
      agreement.fixes, agreement.fewer, agreement.below, agreement.none, agreement.extreme, agreement.differ,
      agreement.largest_m, agreement.worst, agreement.worst_dop);
  return agreement;
}

ReceiverOptions quiet() {
  ReceiverOptions options;
  options.noise.enabled = false;
  return options;
}

TEST(SharedCells, FindsTheFixOfOneSystem) {
  TileScene scene(kGps, kHongKong);
  scene.lay({-310, 170}, 12, 20, 20, 15);
  scene.compute_sky(quiet().fix.elevation_mask_rad);
  scene.receive(0.55, 0.25, 300, 1);
  const Agreement agreement = compare(scene, quiet());
  EXPECT_GT(agreement.fixes, 100);
  EXPECT_GT(agreement.none, 20);
  EXPECT_EQ(agreement.differ, 0);
  EXPECT_LT(agreement.worst, kLinear);
  EXPECT_LT(agreement.worst_dop, 1e-3);
  EXPECT_GT(agreement.largest_m, 300);
}

// A constellation of one satellite is left out; each further constellation needs one more satellite.
TEST(SharedCells, FindsTheFixOfSeveralSystemsFarFromATurnedCitysOrigin) {
  TileScene scene(kThree, Geodetic::from_degrees(-33.9, 18.4, 60), 0.7);
  scene.lay({9'000, -12'000}, 12, 20, 20, 40, 60);
  scene.compute_sky(quiet().fix.elevation_mask_rad);
  scene.receive(0.15, 0.15, 300, 2);
  const Agreement agreement = compare(scene, quiet());
  EXPECT_GT(agreement.fixes, 100);
  EXPECT_GT(agreement.fewer, 30);
  EXPECT_GT(agreement.none, 20);
  EXPECT_EQ(agreement.differ, 0);
  EXPECT_LT(agreement.worst, kLinear);
  EXPECT_LT(agreement.worst_dop, 1e-3);
}

TEST(SharedCells, FindsTheFixOfStricterRules) {
  TileScene scene(kThree, kHongKong);
  scene.lay({0, 0}, 5, 20, 20, 15);
  scene.compute_sky(quiet().fix.elevation_mask_rad);
  scene.receive(0.25, 0.1, 100, 3);
  const int any = compare(scene, quiet()).fixes;
  ReceiverOptions options = quiet();
  options.fix.min_satellites = 6;
  options.fix.max_pdop = 6;
  options.fix.weights.weighting = Weighting::Equal;
  const Agreement agreement = compare(scene, options);
  EXPECT_GT(agreement.fixes, 50);
  EXPECT_LT(agreement.fixes, any - 50);
  EXPECT_EQ(agreement.differ, 0);
  EXPECT_LT(agreement.worst, kLinear);
}

// The clock of SBAS is GPS's: both have one unknown.
TEST(SharedCells, FindsTheFixWithSbas) {
  TileScene scene({System::GPS, System::Galileo, System::SBAS}, kHongKong);
  scene.lay({0, 0}, 12, 20, 20, 15);
  scene.compute_sky(quiet().fix.elevation_mask_rad);
  scene.receive(0.15, 0.15, 300, 2);
  const Agreement agreement = compare(scene, quiet());
  EXPECT_GT(agreement.fixes, 100);
  EXPECT_GT(agreement.fewer, 30);
  EXPECT_EQ(agreement.differ, 0);
  EXPECT_LT(agreement.worst, kLinear);
  EXPECT_LT(agreement.worst_dop, 1e-3);
}

TEST(SharedCells, FindsTheFixOfElevationWeights) {
  TileScene scene(kThree, kHongKong);
  scene.lay({-100, -100}, 12, 20, 20, 15);
  ReceiverOptions options = quiet();
  options.fix.elevation_mask_rad = geodesy::radians(3);
  options.fix.weights.weighting = Weighting::Elevation;
  scene.compute_sky(options.fix.elevation_mask_rad);
  scene.receive(0.4, 0.3, 150, 4);
  const Agreement agreement = compare(scene, options);
  EXPECT_GT(agreement.fixes, 300);
  EXPECT_EQ(agreement.differ, 0);
  EXPECT_GT(agreement.largest_m, 100);
  EXPECT_LT(agreement.worst, kLinear);
  EXPECT_LT(agreement.worst_dop, 1e-3);
}

// The atmosphere is in the signal, corrected, both, or the reverse; some fixes are below sea level.
TEST(SharedCells, FindsTheFixThroughAnAtmosphere) {
  TileScene scene(kThree, Geodetic::from_degrees(22.3, 114.18, 5));
  // IS-GPS-200's order of magnitude; RTKLIB's default set (ionmodel, rtkcmn.c).
  scene.klobuchar[System::GPS] = {{0.1118e-07, -0.7451e-08, -0.5961e-07, 0.1192e-06},
                                  {0.1167e+06, -0.2294e+06, -0.1311e+06, 0.1049e+07}};
  scene.lay({-100, -100}, 12, 16, 16, 5);
  int below = 0;
  for (int flags = 1; flags < 16; ++flags) {
    ReceiverOptions options = quiet();
    options.ionosphere = (flags & 1) != 0;
    options.troposphere = (flags & 2) != 0;
    options.fix.correct_ionosphere = (flags & 4) != 0;
    options.fix.correct_troposphere = (flags & 8) != 0;
    if (flags % 3 == 0) options.fix.weights.weighting = Weighting::Elevation;
    scene.compute_sky(options.fix.elevation_mask_rad);
    scene.receive(0.2, 0.25, 200, 5);
    const Agreement agreement = compare(scene, options);
    EXPECT_GT(agreement.fixes, 100) << flags;
    EXPECT_LE(agreement.differ, 0) << flags;
    EXPECT_LT(agreement.worst, kLinear + kByAtmosphere) << flags;
    below += agreement.below;
  }
  EXPECT_GT(below, 20);
}

TEST(SharedCells, CountsSatellitesAndMarksWhatIsNone) {
  TileScene scene(kGps, kHongKong);
  scene.lay({0, 0}, 2, 3, 2, 15);
  scene.compute_sky(quiet().fix.elevation_mask_rad);
  const std::size_t n = scene.signals.satellites.size();
  ASSERT_GE(n, 6U);
  auto set = [&](std::size_t satellite, std::size_t cell, CellVisibility visibility, float excess_m = 0) {
    scene.signals.visibility[satellite][cell] = visibility;
    scene.signals.excess_m[satellite][cell] = excess_m;
  };
  for (std::size_t k = 0; k < n; ++k) {
    for (std::size_t cell = 0; cell < 6; ++cell) set(k, cell, CellVisibility::LOS);
  }
  set(0, 1, CellVisibility::NLOS, 12.5F);  // cell 1: two of them reflected, one blocked
  set(1, 1, CellVisibility::NLOS, 40.25F);
  set(2, 1, CellVisibility::Blocked);
  for (std::size_t k = 0; k < n; ++k)
    set(k, 2, k < 3 ? CellVisibility::NLOS : CellVisibility::Blocked, 7);  // too few
  for (std::size_t k = 0; k < n; ++k) set(k, 3, CellVisibility::Blocked);  // nothing
  scene.cells.state[4] = CellState::InsideBuilding;
  scene.cells.state[5] = CellState::OutsideArea;
  std::vector<Layer> wanted;
  for (int layer = 0; layer <= static_cast<int>(Layer::SkyView); ++layer) {
    wanted.push_back(static_cast<Layer>(layer));
  }
  const Maps maps = solve(SharedReceiver{{}, {}, {}, {}}, scene, wanted);
  const auto value = [&](Layer layer, std::size_t cell) {
    return maps[static_cast<std::size_t>(layer)][cell];
  };
  const auto all = static_cast<float>(n);
  for (std::size_t cell = 0; cell < 6; ++cell) EXPECT_EQ(value(Layer::SkyView, cell), -77);
  for (const Layer layer : wanted) {
    if (layer == Layer::SkyView) continue;
    EXPECT_TRUE(std::isnan(value(layer, 4)) && std::isnan(value(layer, 5))) << static_cast<int>(layer);
    EXPECT_FALSE(std::isnan(value(layer, 0)) || std::isnan(value(layer, 1))) << static_cast<int>(layer);
    const bool counted = layer == Layer::Availability || layer == Layer::SatellitesLos ||
                         layer == Layer::SatellitesVisible || layer == Layer::SatellitesUsed ||
                         layer == Layer::SatellitesBlocked;
    EXPECT_EQ(std::isnan(value(layer, 3)), !counted) << static_cast<int>(layer);
    const bool seen = counted || layer == Layer::NlosFraction || layer == Layer::LargestExcess;
    EXPECT_EQ(std::isnan(value(layer, 2)), !seen) << static_cast<int>(layer);
  }
  EXPECT_EQ(value(Layer::SatellitesLos, 0), all);
  EXPECT_EQ(value(Layer::SatellitesVisible, 0), all);
  EXPECT_EQ(value(Layer::SatellitesUsed, 0), all);
  EXPECT_EQ(value(Layer::SatellitesBlocked, 0), 0);
  EXPECT_EQ(value(Layer::Availability, 0), 1);
  EXPECT_EQ(value(Layer::NlosFraction, 0), 0);
  EXPECT_EQ(value(Layer::LargestExcess, 0), 0);
  EXPECT_LT(value(Layer::HorizontalError, 0), 1e-5F);
  EXPECT_EQ(value(Layer::SatellitesLos, 1), all - 3);
  EXPECT_EQ(value(Layer::SatellitesVisible, 1), all - 1);
  EXPECT_EQ(value(Layer::SatellitesUsed, 1), all - 1);
  EXPECT_EQ(value(Layer::SatellitesBlocked, 1), 1);
  EXPECT_EQ(value(Layer::NlosFraction, 1), 2 / (all - 1));
  EXPECT_EQ(value(Layer::LargestExcess, 1), 40.25F);
  EXPECT_GT(value(Layer::HorizontalError, 1), 1);
  EXPECT_EQ(value(Layer::SatellitesUsed, 2), 0);
  EXPECT_EQ(value(Layer::Availability, 2), 0);
  EXPECT_EQ(value(Layer::NlosFraction, 2), 1);
  EXPECT_EQ(value(Layer::LargestExcess, 2), 7);
  EXPECT_EQ(value(Layer::SatellitesVisible, 3), 0);
  EXPECT_EQ(value(Layer::SatellitesBlocked, 3), all);
  EXPECT_EQ(value(Layer::Availability, 3), 0);
}

// Without excess (only line of sight requested) counts and DOPs are the same.
TEST(SharedCells, NeedsNoExcessForCountsAndDops) {
  TileScene scene(kGps, kHongKong);
  scene.lay({0, 0}, 2, 20, 20, 15);
  scene.compute_sky(quiet().fix.elevation_mask_rad);
  scene.receive(0.6, 0, 0, 7);
  const std::vector<Layer> wanted{Layer::Hdop, Layer::Pdop, Layer::SatellitesVisible, Layer::Availability};
  const SharedReceiver solver{};
  const Maps with = solve(solver, scene, wanted);
  scene.signals.excess_m.clear();
  const Maps without = solve(solver, scene, wanted);
  for (std::size_t k = 0; k < wanted.size(); ++k) {
    for (std::size_t i = 0; i < with[k].size(); ++i) {
      EXPECT_TRUE(with[k][i] == without[k][i] || (std::isnan(with[k][i]) && std::isnan(without[k][i])));
    }
  }
}

// A grid with other tiles gives the same values, except for the directions, which are of a tile's centre.
TEST(SharedCells, DoesNotDependOnHowAGridIsCut) {
  TileScene whole(kThree, kHongKong);
  const double mask = quiet().fix.elevation_mask_rad;
  whole.lay({-70, 30}, 4, 48, 32, 15);
  whole.compute_sky(mask);
  whole.receive(0.3, 0.3, 200, 13);
  const std::vector<Layer> wanted{Layer::HorizontalError,
                                  Layer::VerticalError,
                                  Layer::HorizontalErrorMean,
                                  Layer::HorizontalErrorP95,
                                  Layer::VerticalErrorRms,
                                  Layer::Availability,
                                  Layer::Pdop};
  const SharedReceiver solver{{}, {32, 4}, {}, {}};
  const Maps expected = solve(solver, whole, wanted);
  double worst = 0;
  for (std::uint32_t row = 0; row < 32; row += 16) {
    for (std::uint32_t column = 0; column < 48; column += 16) {
      TileScene part(kThree, kHongKong);
      part.lay({-70 + 4.0 * column, 30 + 4.0 * row}, 4, 16, 16, 15);
      part.compute_sky(mask);
      ASSERT_EQ(part.signals.satellites.size(), whole.signals.satellites.size());
      const auto from = [&](std::size_t i) { return (row + i / 16) * 48 + column + i % 16; };
      for (std::size_t k = 0; k < part.signals.satellites.size(); ++k) {
        for (std::size_t i = 0; i < 256; ++i) {
          part.signals.visibility[k][i] = whole.signals.visibility[k][from(i)];
          part.signals.excess_m[k][i] = whole.signals.excess_m[k][from(i)];
        }
      }
      const Maps maps = solve(solver, part, wanted);
      for (std::size_t i = 0; i < 256; ++i) {
        ASSERT_EQ(maps[5][i], expected[5][from(i)]);
        if (maps[5][i] == 0 || maps[6][i] > 100) continue;
        for (std::size_t k = 0; k < 5; ++k) {
          if (std::abs(expected[k][from(i)]) < 1000) {
            worst = std::max(worst, std::abs(double{maps[k][i]} - double{expected[k][from(i)]}));
          }
        }
        EXPECT_NEAR(maps[6][i], expected[6][from(i)], 1e-4F * maps[6][i]);
      }
    }
  }
  EXPECT_LT(worst, 0.1);  // of errors to 1 km, PDOP to 100
  std::printf("  within %.4f m\n", worst);
}

// There are more satellites than bits in a word.
TEST(SharedCells, SolvesForMoreThan64Satellites) {
  TileScene scene({gnss::kAllSystems.begin(), gnss::kAllSystems.end()}, kHongKong);
  scene.lay({0, 0}, 10, 8, 8, 15);
  ReceiverOptions options = quiet();
  options.fix.elevation_mask_rad = 0;
  scene.compute_sky(0);
  // As many additional satellites at the same positions, with other names.
  ASSERT_GT(scene.signals.satellites.size(), 32U);
  scene.receive(0.5, 0.2, 100, 14);
  const Maps half = solve(SharedReceiver{options, {}, {}, {}}, scene, kFixLayers);
  for (const std::size_t n = scene.signals.satellites.size(); scene.signals.satellites.size() < 2 * n;) {
    const std::size_t k = scene.signals.satellites.size() - n;
    scene.signals.satellites.push_back(scene.signals.satellites[k]);
    scene.signals.directions.push_back(scene.signals.directions[k]);
    scene.signals.visibility.push_back(scene.signals.visibility[k]);
    scene.signals.excess_m.push_back(scene.signals.excess_m[k]);
  }
  const Maps twice = solve(SharedReceiver{options, {}, {}, {}}, scene, kFixLayers);
  int fixes = 0;
  for (std::size_t i = 0; i < 64; ++i) {
    if (half[2][i] != 1) continue;
    ++fixes;
    EXPECT_NEAR(twice[0][i], half[0][i], 1e-4F * half[0][i] + 1e-4F);
    EXPECT_EQ(twice[6][i], 2 * half[6][i]);
    EXPECT_NEAR(twice[4][i] * std::sqrt(2.0F), half[4][i], 1e-5F * half[4][i]);  // half the variance
  }
  EXPECT_GT(fixes, 30);
  for (int i = 0; i < 2; ++i) {
    const TileSignals more = scene.signals;
    for (std::size_t k = 0; k < more.satellites.size(); ++k) {
      scene.signals.satellites.push_back(more.satellites[k]);
      scene.signals.directions.push_back(more.directions[k]);
      scene.signals.visibility.push_back(more.visibility[k]);
      scene.signals.excess_m.push_back(more.excess_m[k]);
    }
  }
  EXPECT_THROW(solve(SharedReceiver{options, {}, {}, {}}, scene, kFixLayers), InputError);
}

}  // namespace
}  // namespace canyon::heatmap::shared_cells_test
