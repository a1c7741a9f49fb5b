// Broadcast orbits and clocks against the precise ones of the same day: the errors of a user of the
// navigation message. Prints the table of docs/results.md.

#include <gtest/gtest.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/orbit/precise_sky.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon::orbit {
namespace {

struct Sums {
  int count = 0, clock_count = 0;
  std::set<gnss::SatelliteId> satellites;
  Eigen::Vector3d squares = Eigen::Vector3d::Zero();  ///< radial, along, cross
  double radial = 0;
  double clock_squares = 0, worst = 0;
  gnss::SatelliteId worst_id;

  [[nodiscard]] Eigen::Vector3d rms() const { return (squares / count).cwiseSqrt(); }
  [[nodiscard]] double rms_3d() const { return std::sqrt(squares.sum() / count); }
  [[nodiscard]] double clock_rms_m() const { return std::sqrt(clock_squares / clock_count); }
};

/// `difference` along the radial, along-track and normal directions of `orbit`.
Eigen::Vector3d radial_along_cross(const SatelliteState& orbit, const Eigen::Vector3d& difference) {
  const Eigen::Vector3d inertial_velocity =
      orbit.velocity_mps + Eigen::Vector3d(0, 0, geodesy::kEarthRotationRate).cross(orbit.position_m);
  const Eigen::Vector3d radial = orbit.position_m.normalized();
  const Eigen::Vector3d cross = orbit.position_m.cross(inertial_velocity).normalized();
  return {difference.dot(radial), difference.dot(cross.cross(radial)), difference.dot(cross)};
}

TEST(BroadcastAgainstPrecise, ADayOf2020) {
  CANYON_SHARED_DATA(broadcast_path, "orbits/ESBC00DNK_R_20201770000_01D_MN.rnx.gz");
  CANYON_SHARED_DATA(precise_path, "orbits/GRG0MGXFIN_20201770000_01D_15M_ORB.SP3.gz");
  const BroadcastSky broadcast(rinex::read_rinex_navigation(broadcast_path));
  const PreciseSky precise(precise_path);

  std::map<gnss::System, Sums> sums;
  const auto [first, last] = precise.span();
  for (geodesy::GpsTime t = first; t <= last; t = t + 900.0) {
    // The common part of the clocks is a difference of time scales: a receiver's clock absorbs it.
    std::map<gnss::System, std::vector<double>> clocks_m;
    for (const gnss::SatelliteId id : broadcast.satellites()) {
      const auto b = broadcast.state(id, t), p = precise.state(id, t);
      if (!b || !p) continue;
      Sums& s = sums[id.system];
      const Eigen::Vector3d difference = b->position_m - p->position_m;
      ++s.count;
      s.satellites.insert(id);
      const Eigen::Vector3d components = radial_along_cross(*p, difference);
      s.radial += components[0];
      s.squares += components.cwiseAbs2();
      if (difference.norm() > s.worst) {
        s.worst = difference.norm();
        s.worst_id = id;
      }
      clocks_m[id.system].push_back((b->clock_bias_s - p->clock_bias_s) * geodesy::kSpeedOfLight);
    }
    for (const auto& [system, clocks] : clocks_m) {
      if (clocks.size() < 3) continue;
      double mean = 0;
      for (const double c : clocks) mean += c / static_cast<double>(clocks.size());
      for (const double c : clocks) sums[system].clock_squares += (c - mean) * (c - mean);
      sums[system].clock_count += static_cast<int>(clocks.size());
    }
  }

  std::printf(
      "| system | satellites | states | radial mean | radial | along | cross | 3D | worst | clock |\n");
  std::printf("|---|---|---|---|---|---|---|---|---|---|\n");
  for (const auto& [system, s] : sums) {
    const Eigen::Vector3d rms = s.rms();
    std::printf("| %s | %zu | %d | %+.2f | %.2f | %.2f | %.2f | %.2f | %.2f (%s) | %.2f |\n",
                std::string(name(system)).c_str(), s.satellites.size(), s.count, s.radial / s.count, rms[0],
                rms[1], rms[2], s.rms_3d(), s.worst, to_string(s.worst_id).c_str(), s.clock_rms_m());
  }

  ASSERT_EQ(sums.size(), 3u);  // the precise file has GPS, GLONASS and Galileo
  EXPECT_GT(sums[gnss::System::GPS].count, 800);
  EXPECT_GT(sums[gnss::System::GLONASS].count, 500);
  EXPECT_GT(sums[gnss::System::Galileo].count, 800);
  const std::map<gnss::System, double> bound_3d{
      {gnss::System::GPS, 2.5}, {gnss::System::GLONASS, 5}, {gnss::System::Galileo, 1.5}};
  const std::map<gnss::System, double> bound_clock{
      {gnss::System::GPS, 1.5}, {gnss::System::GLONASS, 5}, {gnss::System::Galileo, 1}};
  const std::map<gnss::System, double> bound_worst{
      {gnss::System::GPS, 6}, {gnss::System::GLONASS, 12}, {gnss::System::Galileo, 10}};
  for (const auto& [system, s] : sums) {
    EXPECT_LT(s.rms_3d(), bound_3d.at(system)) << name(system);
    EXPECT_LT(s.clock_rms_m(), bound_clock.at(system)) << name(system);
    EXPECT_LT(s.worst, bound_worst.at(system)) << to_string(s.worst_id);
  }
}

// The error of a record by its age, on either side of its toe: the reason for validity().
struct Ageing {
  static constexpr std::array<int, 12> kAges_min{-360, -240, -120, -60, -30, 0, 30, 60, 120, 180, 240, 360};
  struct Cell {
    int count = 0;
    double squares = 0;
  };
  std::map<std::string, std::array<Cell, kAges_min.size()>> rows;

  void add(const std::string& row, std::size_t age, const Eigen::Vector3d& difference) {
    ++rows[row][age].count;
    rows[row][age].squares += difference.squaredNorm();
  }
  [[nodiscard]] double rms(const std::string& row, int minutes) const {
    const auto age = std::find(kAges_min.begin(), kAges_min.end(), minutes) - kAges_min.begin();
    const Cell& cell = rows.at(row)[static_cast<std::size_t>(age)];
    return std::sqrt(cell.squares / cell.count);
  }
  void print() const {
    std::printf("| 3D RMS [m] at t - toe |");
    for (const int minutes : kAges_min) std::printf(" %+.1f h |", minutes / 60.0);
    std::printf("\n|---|");
    for (std::size_t i = 0; i < kAges_min.size(); ++i) std::printf("---|");
    std::printf("\n");
    for (const auto& [row, cells] : rows) {
      std::printf("| %s |", row.c_str());
      for (const Cell& cell : cells) {
        cell.count == 0 ? std::printf(" |") : std::printf(" %.1f |", std::sqrt(cell.squares / cell.count));
      }
      std::printf("\n");
    }
  }
};

TEST(BroadcastAgainstPrecise, RecordsAgeAsTheirValiditySays) {
  CANYON_SHARED_DATA(broadcast_path, "orbits/ESBC00DNK_R_20201770000_01D_MN.rnx.gz");
  CANYON_SHARED_DATA(precise_path, "orbits/GRG0MGXFIN_20201770000_01D_15M_ORB.SP3.gz");
  const gnss::NavigationData data = rinex::read_rinex_navigation(broadcast_path);
  const PreciseSky precise(precise_path);
  Ageing ageing;
  const auto add = [&](const auto& e) {
    if (!is_healthy(e)) return;
    for (std::size_t i = 0; i < Ageing::kAges_min.size(); ++i) {
      const geodesy::GpsTime t = e.toe + 60.0 * Ageing::kAges_min[i];
      const auto p = precise.state(e.id, t);
      if (p) ageing.add(std::string(name(e.id.system)), i, propagate(e, t).position_m - p->position_m);
    }
  };
  for (const gnss::KeplerEphemeris& e : data.kepler) add(e);
  for (const gnss::GlonassEphemeris& e : data.glonass) add(e);
  // No precise orbits here: BeiDou and QZSS against the record whose toe is that instant.
  for (const gnss::KeplerEphemeris& e : data.kepler) {
    if ((e.id.system != gnss::System::BeiDou && e.id.system != gnss::System::QZSS) || !is_healthy(e))
      continue;
    const std::string row = e.id.system == gnss::System::QZSS ? "QZSS (own records)"
                            : is_beidou_geo(e.id)             ? "BeiDou GEO (own records)"
                            : e.sqrt_a > 6000                 ? "BeiDou IGSO (own records)"
                                                              : "BeiDou MEO (own records)";
    for (const gnss::KeplerEphemeris& other : data.kepler) {
      if (other.id != e.id || !is_healthy(other)) continue;
      for (std::size_t i = 0; i < Ageing::kAges_min.size(); ++i) {
        if (other.toe - e.toe != 60.0 * Ageing::kAges_min[i]) continue;
        ageing.add(row, i, propagate(e, other.toe).position_m - propagate(other, other.toe).position_m);
      }
    }
  }
  ageing.print();
  EXPECT_LT(ageing.rms("GPS", -120), 2);
  EXPECT_LT(ageing.rms("GPS", 120), 2);
  EXPECT_LT(ageing.rms("GLONASS", -30), 5);
  EXPECT_LT(ageing.rms("GLONASS", 30), 5);
  EXPECT_LT(ageing.rms("Galileo", -30), 1.5);
  EXPECT_LT(ageing.rms("Galileo", 240), 5);
  EXPECT_GT(ageing.rms("Galileo", -120), 5)
      << "before toe is no longer worse than after it: widen the validity?";
  for (const char* row :
       {"BeiDou MEO (own records)", "BeiDou IGSO (own records)", "BeiDou GEO (own records)"}) {
    EXPECT_LT(ageing.rms(row, -60), 1) << row;
    EXPECT_LT(ageing.rms(row, 180), 5) << row;
  }
  EXPECT_LT(ageing.rms("QZSS (own records)", 120), 5);
}

}  // namespace
}  // namespace canyon::orbit
