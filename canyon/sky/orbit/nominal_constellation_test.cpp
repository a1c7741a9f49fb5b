#include "canyon/sky/orbit/nominal_constellation.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <random>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/geodesy/time_scales.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "canyon/sky/rinex/navigation_writer.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon::orbit {
namespace {

using geodesy::degrees;
using geodesy::GpsTime;
using geodesy::parse_time;
using geodesy::radians;
using ::testing::HasSubstr;

const std::set<gnss::System> kFour{gnss::System::GPS, gnss::System::GLONASS, gnss::System::Galileo,
                                   gnss::System::BeiDou};
constexpr double kDay = 86'400;

BroadcastSky sky_of(GpsTime begin, double duration_s, std::set<gnss::System> systems = kFour) {
  return BroadcastSky(nominal_constellation(begin, begin + duration_s, systems));
}

/// Osculating elements in the frame that coincides with ECEF at the instant. If the node moves without a
/// corresponding force, as in broadcast orbits, they differ by up to 2e-3 deg from the mean ones.
struct Elements {
  double a, e, inclination, node, latitude;
};
Elements elements(const SatelliteState& s) {
  constexpr double kMu = 3.986004418e14;
  const Eigen::Vector3d p = s.position_m;
  const Eigen::Vector3d v = s.velocity_mps + Eigen::Vector3d(0, 0, geodesy::kEarthRotationRate).cross(p);
  const Eigen::Vector3d h = p.cross(v);
  const Eigen::Vector3d n = Eigen::Vector3d::UnitZ().cross(h).normalized();
  const Eigen::Vector3d ecc = v.cross(h) / kMu - p.normalized();
  return {1 / (2 / p.norm() - v.squaredNorm() / kMu), ecc.norm(), std::acos(h.z() / h.norm()),
          std::atan2(n.y(), n.x()), std::atan2(p.dot(h.normalized().cross(n)), p.dot(n))};
}

double wrapped_deg(double rad) {
  return degrees(std::remainder(rad, 2 * geodesy::kPi));
}

// Published shape of each constellation: SPS PS, ICD GLONASS, Galileo GSC, BDS OS PS.
TEST(NominalConstellation, OrbitsHaveThePublishedShape) {
  const GpsTime t = parse_time("2024-03-15T10:20:30Z");
  const BroadcastSky sky = sky_of(t, 0);
  std::map<gnss::System, int> count;
  int geo = 0;
  for (const gnss::SatelliteId id : sky.satellites()) {
    const auto s = sky.state(id, t);
    ASSERT_TRUE(s) << to_string(id);
    const Elements o = elements(*s);
    ++count[id.system];
    EXPECT_EQ(s->clock_bias_s, 0);
    EXPECT_EQ(s->group_delay_s, 0);
    switch (id.system) {
      case gnss::System::GPS:
        EXPECT_NEAR(s->position_m.norm(), 26'559.7e3, 1);
        EXPECT_NEAR(degrees(o.inclination), 55, 0.01);
        break;
      case gnss::System::GLONASS:
        EXPECT_NEAR(o.a, 25'508e3, 5e3);
        EXPECT_LT(o.e, 5e-4);
        EXPECT_NEAR(degrees(o.inclination), 64.8, 0.01);
        break;
      case gnss::System::Galileo:
        EXPECT_NEAR(s->position_m.norm(), 29'599.8e3, 1);
        EXPECT_NEAR(degrees(o.inclination), 56, 0.01);
        break;
      default:
        if (id.number >= 59) {
          ++geo;
          const geodesy::Geodetic g = geodesy::geodetic_from_ecef(s->position_m);
          EXPECT_NEAR(g.latitude_rad, 0, 1e-9);
          const std::map<int, double> longitude{{59, 140}, {60, 80}, {61, 110.5}};
          EXPECT_NEAR(degrees(g.longitude_rad), longitude.at(id.number), 1e-9);
          EXPECT_LT(s->velocity_mps.norm(), 1e-3);
        } else {
          const bool igso = id.number >= 38 && id.number <= 40;
          EXPECT_NEAR(s->position_m.norm(), igso ? 42'164.1e3 : 27'906.1e3, 100);
          EXPECT_NEAR(degrees(o.inclination), 55, 0.01);
        }
    }
  }
  EXPECT_EQ(count, (std::map<gnss::System, int>{{gnss::System::GPS, 24},
                                                {gnss::System::GLONASS, 24},
                                                {gnss::System::Galileo, 24},
                                                {gnss::System::BeiDou, 30}}));
  EXPECT_EQ(geo, 3);
}

TEST(NominalConstellation, PlanesAndPhasesAreSpacedAsAWalkerPattern) {
  const GpsTime t = parse_time("2031-11-02T23:59:59Z");
  const BroadcastSky sky = sky_of(t, 0);
  const auto at = [&](gnss::System system, int number) {
    return elements(*sky.state({system, static_cast<std::uint8_t>(number)}, t));
  };
  for (int n = 1; n <= 16; ++n) {
    const Elements galileo = at(gnss::System::Galileo, n);
    const Elements galileo_next = at(gnss::System::Galileo, n + 8);
    EXPECT_NEAR(wrapped_deg(galileo_next.node - galileo.node), 120, 1e-3);
    EXPECT_NEAR(wrapped_deg(galileo_next.latitude - galileo.latitude), 15, 1e-3);
    // GLONASS is under J2, whose short periods are hundreds of metres: 0.01 deg.
    const Elements glonass = at(gnss::System::GLONASS, n);
    const Elements glonass_next = at(gnss::System::GLONASS, n + 8);
    EXPECT_NEAR(wrapped_deg(glonass_next.node - glonass.node), 120, 0.01);
    EXPECT_NEAR(wrapped_deg(glonass_next.latitude - glonass.latitude), 15, 0.01);
  }
  for (int plane = 0; plane < 5; ++plane) {
    EXPECT_NEAR(
        wrapped_deg(at(gnss::System::GPS, 4 * plane + 5).node - at(gnss::System::GPS, 4 * plane + 1).node),
        60, 2e-3);
  }
  // SPS PS table 3.2-1: slots A1 and A2 are 268.126 - 161.786 deg apart.
  EXPECT_NEAR(wrapped_deg(at(gnss::System::GPS, 1).latitude - at(gnss::System::GPS, 2).latitude),
              268.126 - 161.786, 2e-3);
}

// SPS PS table 3.2-1 at its own epoch: slot A1, right ascension of the node 272.847 deg, Greenwich
// 18:36:14.4.
TEST(NominalConstellation, GpsSlotA1StandsAtThePublishedPlaceAtItsEpoch) {
  const GpsTime t = parse_time("1993-07-01T00:00:00Z");
  const Elements o = elements(*sky_of(t, 0, {gnss::System::GPS}).state({gnss::System::GPS, 1}, t));
  EXPECT_NEAR(wrapped_deg(o.node - radians(272.847 - (18 + 36 / 60.0 + 14.4 / 3600) * 15)), 0, 1e-3);
  EXPECT_NEAR(wrapped_deg(o.latitude - radians(268.126)), 0, 1e-3);
}

// Ground tracks close after the published number of revolutions and nodal days.
TEST(NominalConstellation, GroundTracksRepeat) {
  struct Repeat {
    gnss::SatelliteId id;
    double days;       ///< sidereal, about 4 min shorter than solar
    double tolerance;  ///< [m]; the nodal day is 8 s shorter than the sidereal one for GPS
  };
  const GpsTime begin = parse_time("2025-01-01T00:00:00Z");
  const BroadcastSky sky = sky_of(begin, 11 * kDay);
  for (const Repeat& r :
       {Repeat{{gnss::System::GPS, 7}, 1, 1}, Repeat{{gnss::System::GLONASS, 3}, 8, 5000},
        Repeat{{gnss::System::Galileo, 5}, 10, 20}, Repeat{{gnss::System::BeiDou, 24}, 7, 1},
        Repeat{{gnss::System::BeiDou, 39}, 1, 1}}) {
    const auto first = sky.state(r.id, begin + 3600.0);
    ASSERT_TRUE(first);
    const std::vector<OrbitSlot> slots = nominal_slots(r.id.system);
    const auto slot =
        std::find_if(slots.begin(), slots.end(), [&](const OrbitSlot& s) { return s.id == r.id; });
    const double nodal_day = 2 * geodesy::kPi / (slot->earth_rate - slot->node_rate);
    EXPECT_NEAR(nodal_day, 86'164.1, 10);
    const auto again = sky.state(r.id, begin + 3600.0 + r.days * nodal_day);
    ASSERT_TRUE(again);
    EXPECT_LT((first->position_m - again->position_m).norm(), r.tolerance) << to_string(r.id);
  }
}

TEST(NominalConstellation, SuccessiveRecordsDescribeOneOrbit) {
  const gnss::NavigationData data =
      nominal_constellation(parse_time("2026-12-31T20:00:00Z"), parse_time("2027-01-02T03:00:00Z"), kFour);
  double worst = 0;
  int borders = 0;
  const auto compare = [&](const auto& a, const auto& b) {
    if (a.id != b.id) return;
    ++borders;
    const double half = (b.toe - a.toe) / 2;
    const SatelliteState from_a = propagate(a, a.toe + half);
    const SatelliteState from_b = propagate(b, a.toe + half);
    worst = std::max(worst, (from_a.position_m - from_b.position_m).norm());
    EXPECT_LT((from_a.velocity_mps - from_b.velocity_mps).norm(), 1e-6);
    EXPECT_GT(b.toe, a.toe);
  };
  for (std::size_t i = 1; i < data.kepler.size(); ++i) compare(data.kepler[i - 1], data.kepler[i]);
  for (std::size_t i = 1; i < data.glonass.size(); ++i) compare(data.glonass[i - 1], data.glonass[i]);
  RecordProperty("worst_jump_m", std::to_string(worst));
  EXPECT_LT(worst, 1e-3);
  EXPECT_GT(borders, 3000);
}

TEST(NominalConstellation, EveryInstantOfTheSpanHasEverySatellite) {
  std::mt19937 random(3);
  for (const char* text : {"2019-04-28T12:58:03Z", "2020-02-29T00:00:00Z", "2016-12-31T23:50:00Z",
                           "2022-05-01T00:14:59Z", "2022-05-01T23:45:01Z"}) {
    const GpsTime begin = parse_time(text);
    const double duration = 9.3 * 3600;
    const BroadcastSky sky = sky_of(begin, duration);
    EXPECT_EQ(sky.satellites().size(), 102U);
    std::uniform_real_distribution<double> offset(0, duration);
    // A signal received at the start left a fraction of a second earlier.
    std::vector<double> instants{-0.14, 0, duration};
    for (int i = 0; i < 100; ++i) instants.push_back(offset(random));
    for (const double dt : instants) {
      for (const gnss::SatelliteId id : sky.satellites()) {
        ASSERT_TRUE(sky.state(id, begin + dt)) << to_string(id) << " at " << text << " + " << dt;
      }
    }
  }
}

TEST(NominalConstellation, TheSameInstantGivesTheSameSatellites) {
  const GpsTime t = parse_time("2023-08-09T17:23:00Z");
  const BroadcastSky a = sky_of(t, 60);
  const BroadcastSky b = sky_of(parse_time("2023-08-09T02:00:00Z"), kDay);
  const BroadcastSky earlier = sky_of(parse_time("2023-08-05T23:59:00Z"), 6 * kDay);
  for (const gnss::SatelliteId id : a.satellites()) {
    const Eigen::Vector3d p = a.state(id, t)->position_m;
    EXPECT_LT((p - b.state(id, t)->position_m).norm(), 1e-3) << to_string(id);
    // GLONASS restarts from the slot table on the day of the start: about a kilometre for each day.
    const double tolerance = id.system == gnss::System::GLONASS ? 8e3 : 1e-3;
    EXPECT_LT((p - earlier.state(id, t)->position_m).norm(), tolerance) << to_string(id);
  }
}

TEST(NominalConstellation, APlausibleNumberOfSatellitesIsUpEverywhere) {
  const GpsTime t = parse_time("2026-06-01T00:00:00Z");
  const BroadcastSky sky = sky_of(t, kDay);
  std::map<gnss::System, std::pair<int, int>> range;
  for (int hour = 0; hour < 24; hour += 3) {
    for (int latitude = -80; latitude <= 80; latitude += 20) {
      for (int longitude = -180; longitude < 180; longitude += 45) {
        const Observer observer(
            geodesy::ecef_from_geodetic(geodesy::Geodetic::from_degrees(latitude, longitude, 0)));
        std::map<gnss::System, int> up;
        for (const gnss::SatelliteId id : sky.satellites()) {
          const auto los = line_of_sight(sky, id, t + hour * 3600.0, observer);
          ASSERT_TRUE(los);
          if (los->elevation_rad > radians(5)) ++up[id.system];
        }
        for (const gnss::System system : kFour) {
          auto [it, first] = range.try_emplace(system, up[system], up[system]);
          it->second.first = std::min(it->second.first, up[system]);
          it->second.second = std::max(it->second.second, up[system]);
        }
      }
    }
  }
  // SPS PS, 3.2: 24 slots easily give four or more above 5 deg; observed 5 to 11.
  EXPECT_GE(range[gnss::System::GPS].first, 5);
  EXPECT_LE(range[gnss::System::GPS].second, 12);
  EXPECT_GE(range[gnss::System::Galileo].first, 5);
  EXPECT_LE(range[gnss::System::Galileo].second, 12);
  EXPECT_GE(range[gnss::System::GLONASS].first, 4);
  EXPECT_LE(range[gnss::System::GLONASS].second, 12);
  EXPECT_GE(range[gnss::System::BeiDou].first, 4);
  EXPECT_LE(range[gnss::System::BeiDou].second, 18);
  for (const auto& [system, r] : range) {
    RecordProperty(std::string(name(system)), std::to_string(r.first) + " to " + std::to_string(r.second));
  }
}

// The slot tables against the real satellites of a day, long after their epochs: the operators maintain the
// phases of GLONASS and Galileo.
TEST(NominalConstellation, RealSatellitesStandNearTheirSlots) {
  CANYON_SHARED_DATA(path, "orbits/ESBC00DNK_R_20201770000_01D_MN.rnx.gz");
  const GpsTime t = parse_time("2020-06-25T12:00:00Z");
  const BroadcastSky nominal = sky_of(t, 0);
  BroadcastOptions options;
  options.allow_stale = true;  // satellites beyond the station's horizon at that time
  options.allow_unhealthy = true;
  const BroadcastSky real(rinex::read_rinex_navigation(path), options);
  std::map<gnss::System, std::vector<double>> distance_deg;
  for (const gnss::SatelliteId id : real.satellites()) {
    const bool extended = id.system == gnss::System::Galileo && (id.number == 14 || id.number == 18);
    const bool bds2 = id.system == gnss::System::BeiDou && id.number < 19;
    if (id.system == gnss::System::QZSS || id.system == gnss::System::GPS || extended || bds2) continue;
    const auto s = real.state(id, t);
    ASSERT_TRUE(s);
    double best = 180;
    for (const gnss::SatelliteId slot : nominal.satellites()) {
      if (slot.system != id.system) continue;
      if (id.system != gnss::System::Galileo && slot != id) continue;  // Galileo numbers are not slots
      const Eigen::Vector3d n = nominal.state(slot, t)->position_m.normalized();
      best = std::min(best, degrees(std::acos(std::min(1.0, n.dot(s->position_m.normalized())))));
    }
    distance_deg[id.system].push_back(best);
  }
  for (auto& [system, values] : distance_deg) {
    ASSERT_GE(values.size(), 16U) << name(system);
    std::sort(values.begin(), values.end());
    RecordProperty(std::string(name(system)) + "_median_deg", std::to_string(values[values.size() / 2]));
    EXPECT_LT(values[values.size() / 2], system == gnss::System::GLONASS ? 3.0 : 1.5) << name(system);
  }
}

TEST(NominalConstellation, SurvivesRinex) {
  const GpsTime begin = parse_time("2024-12-31T22:00:00Z");
  const gnss::NavigationData data = nominal_constellation(begin, begin + 7200.0, kFour);
  const gnss::NavigationData back = rinex::read_rinex_navigation(
      TextFile::from_string(rinex::format_rinex_navigation(data), "nominal.rnx"));
  EXPECT_TRUE(back.report.lines().empty());
  ASSERT_EQ(back.kepler.size(), data.kepler.size());
  ASSERT_EQ(back.glonass.size(), data.glonass.size());
  const BroadcastSky a{data};
  const BroadcastSky b{back};
  for (const gnss::SatelliteId id : a.satellites()) {
    for (const double dt : {0.0, 1234.5, 7200.0}) {
      const auto from_tables = a.state(id, begin + dt);
      const auto from_file = b.state(id, begin + dt);
      ASSERT_TRUE(from_tables && from_file) << to_string(id);
      EXPECT_LT((from_tables->position_m - from_file->position_m).norm(), 0.01) << to_string(id);
      EXPECT_EQ(from_tables->carrier_frequency_hz, from_file->carrier_frequency_hz);
    }
  }
}

TEST(NominalConstellation, RefusesWhatItCannotMake) {
  const GpsTime t = parse_time("2024-12-31T22:00:00Z");
  const auto message = [](GpsTime begin, GpsTime end, const std::set<gnss::System>& systems) -> std::string {
    return test::refusal([&] { (void)nominal_constellation(begin, end, systems); });
  };
  EXPECT_THAT(message(t, t - 1.0, kFour), HasSubstr("before it begins"));
  EXPECT_THAT(message(t, t + 61 * kDay, kFour), HasSubstr("at most 60 days"));
  EXPECT_THAT(message(t, t, {}), HasSubstr("no system"));
  EXPECT_THAT(message(t, t, {gnss::System::QZSS}), HasSubstr("no system"));
  EXPECT_EQ(message(t, t, {gnss::System::QZSS, gnss::System::GPS}), "");
}

TEST(StandardIonosphere, IsThatOfBroadcastSetsOfSevenYears) {
  EXPECT_EQ(standard_ionosphere().alpha[0], 0.1118e-07);
  EXPECT_EQ(mean_solar_flux_sfu(parse_time("2024-07-01T00:00:00Z")), 191);
  EXPECT_EQ(mean_solar_flux_sfu(parse_time("1996-01-02T00:00:00Z")), 72);
  EXPECT_EQ(mean_solar_flux_sfu(parse_time("1995-01-02T00:00:00Z")), kMediumSolarFlux_sfu);
  EXPECT_EQ(mean_solar_flux_sfu(parse_time("2031-01-02T00:00:00Z")), kMediumSolarFlux_sfu);

  // At 14 h the delay is 5 ns plus the amplitude, here at the zenith at these magnetic latitudes.
  const auto noon_s = [](const gnss::Klobuchar& set, double latitude_deg) {
    double amplitude_s = 0;
    for (std::size_t n = 0; n < set.alpha.size(); ++n)
      amplitude_s += set.alpha[n] * std::pow(latitude_deg / 180, static_cast<double>(n));
    return 5e-9 + std::max(0.0, amplitude_s);
  };
  CANYON_SHARED_DATA(folder, ".");
  const std::vector<std::pair<const char*, const char*>> files{
      {"orbits/brdc3050.12n", "2012-10-31T00:00:00Z"},
      {"berlin-potsdamer-platz/brdc1580.16n", "2016-06-06T00:00:00Z"},
      {"urbannav-tst-20190428/hksc1180.19n", "2019-04-28T00:00:00Z"},
      {"orbits/ESBC00DNK_R_20201770000_01D_MN.rnx.gz", "2020-06-25T00:00:00Z"},
      {"urbannav-tst-20210517/hksc137c.21n", "2021-05-17T00:00:00Z"},
      {"orbits/KMS300DNK_R_20221591000_01H_MN.rnx.gz", "2022-06-08T00:00:00Z"},
      {"rtk-nagoya-20240624/base.nav", "2024-06-24T00:00:00Z"}};
  double sum = 0;
  for (const auto& [file, date] : files) {
    const gnss::Klobuchar broadcast =
        rinex::read_rinex_navigation(folder / file).klobuchar.at(gnss::System::GPS);
    const gnss::Klobuchar standard = standard_ionosphere(mean_solar_flux_sfu(parse_time(date)));
    for (const double latitude_deg : {0, 15, 30, 45}) {
      const double ratio = noon_s(standard, latitude_deg) / noon_s(broadcast, latitude_deg);
      EXPECT_GT(ratio, 1 / 1.4) << file << " " << latitude_deg;
      EXPECT_LT(ratio, 1.4) << file << " " << latitude_deg;
      sum += ratio / 4 / static_cast<double>(files.size());
    }
  }
  EXPECT_NEAR(sum, 1, 0.05);
}

}  // namespace
}  // namespace canyon::orbit
