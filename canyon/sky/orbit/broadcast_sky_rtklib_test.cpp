// RTKLIB 2.4.3 b34 as reference for the reader, the writer, the choice of records and the propagation.
// Debian's build has every system in it (satno() is not 0 for any), so no system needs another reference.

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include <fstream>
#include <map>
#include <memory>

#include "canyon/sky/gnss/navigation_data.hpp"
#include "canyon/sky/orbit/broadcast_sky.hpp"
#include "canyon/sky/rinex/navigation_reader.hpp"
#include "canyon/sky/rinex/navigation_writer.hpp"
#include "tests/support/rinex_sample.hpp"
#include "tests/support/rtklib.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::orbit {
namespace {

using geodesy::GpsTime;
using test::gps_time;
using test::rtklib_satellite;
using test::rtklib_time;

RtklibEphemeris rtklib_ephemeris(const gnss::KeplerEphemeris& e) {
  RtklibEphemeris r{};
  r.sat = rtklib_satellite(e.id);
  r.iode = e.iode;
  r.iodc = e.iodc;
  r.svh = e.health;
  r.code = e.data_sources;
  r.toe = rtklib_time(e.toe);
  r.toc = rtklib_time(e.toc);
  r.ttr = rtklib_time(e.transmission);
  r.A = e.sqrt_a * e.sqrt_a;
  r.e = e.eccentricity;
  r.i0 = e.inclination;
  r.OMG0 = e.right_ascension;
  r.omg = e.argument_of_perigee;
  r.M0 = e.mean_anomaly;
  r.deln = e.mean_motion_difference;
  r.OMGd = e.right_ascension_rate;
  r.idot = e.inclination_rate;
  r.crc = e.crc;
  r.crs = e.crs;
  r.cuc = e.cuc;
  r.cus = e.cus;
  r.cic = e.cic;
  r.cis = e.cis;
  r.toes = (e.id.system == gnss::System::BeiDou ? e.toe - 14.0 : e.toe).seconds_of_week();
  r.f0 = e.af0;
  r.f1 = e.af1;
  r.f2 = e.af2;
  r.tgd[0] = e.group_delay[0];
  r.tgd[1] = e.group_delay[1];
  return r;
}

RtklibGlonassEphemeris rtklib_ephemeris(const gnss::GlonassEphemeris& e) {
  RtklibGlonassEphemeris r{};
  r.sat = rtklib_satellite(e.id);
  r.frq = e.channel;
  r.svh = e.health;
  r.toe = rtklib_time(e.toe);
  r.tof = rtklib_time(e.transmission);
  for (std::size_t i = 0; i < 3; ++i) {
    r.pos[i] = e.position_m[i];
    r.vel[i] = e.velocity_mps[i];
    r.acc[i] = e.acceleration_mps2[i];
  }
  r.taun = -e.clock_bias_s;
  r.gamn = e.frequency_bias;
  return r;
}

RtklibSbasEphemeris rtklib_ephemeris(const gnss::SbasEphemeris& e) {
  RtklibSbasEphemeris r{};
  r.sat = rtklib_satellite(e.id);
  r.svh = e.health;
  r.t0 = rtklib_time(e.toe);
  r.tof = rtklib_time(e.transmission);
  for (std::size_t i = 0; i < 3; ++i) {
    r.pos[i] = e.position_m[i];
    r.vel[i] = e.velocity_mps[i];
    r.acc[i] = e.acceleration_mps2[i];
  }
  r.af0 = e.clock_bias_s;
  r.af1 = e.clock_drift;
  return r;
}

struct FreeNavigation {
  void operator()(RtklibNavigation* navigation) const {
    std::free(navigation->eph);  // RTKLIB's are from malloc
    std::free(navigation->geph);
    std::free(navigation->seph);
    delete navigation;
  }
};
using NavigationPointer = std::unique_ptr<RtklibNavigation, FreeNavigation>;

/// The records of a file, read by RTKLIB's own reader.
NavigationPointer rtklib_read(std::string_view text) {
  const test::TemporaryFolder folder;
  const std::filesystem::path file = folder / "brdc.rnx";
  std::ofstream(file, std::ios::binary) << text;
  NavigationPointer navigation(new RtklibNavigation{});
  EXPECT_EQ(readrnx(file.c_str(), 1, "", nullptr, navigation.get(), nullptr), 1);
  return navigation;
}

/// RTKLIB's structs differ between versions: one other than 2.4.3 b34 is detected here and not used.
class RtklibJudge : public testing::Test {
 protected:
  void SetUp() override {
    const auto navigation = rtklib_read(test::kRinex3Header + test::kG05 + test::kC21);
    const bool same = navigation->n == 2 && navigation->eph[0].e == 5.041313482914e-03 &&
                      navigation->eph[1].sat == satno(0x20, 21) &&
                      navigation->eph[1].tgd[0] == 1.600000021362e-09;
    if (!same) GTEST_SKIP() << "SKIPPED: the installed RTKLIB is not 2.4.3 b34 (other struct layout)";
  }
};

struct Worst {
  int compared = 0;
  double position_m = 0, clock_s = 0, age_s = 0;

  void add(const SatelliteState& state, const double* position, double clock, double age) {
    ++compared;
    const Eigen::Vector3d p(position[0], position[1], position[2]);
    position_m = std::max(position_m, (state.position_m - p).norm());
    clock_s = std::max(clock_s, std::abs(state.clock_bias_s - clock));
    age_s = std::max(age_s, std::abs(age));
  }
};

// The record that the sky must use at t, by linear search.
template <typename Ephemeris>
const Ephemeris* best_record(const std::vector<Ephemeris>& records, gnss::SatelliteId id, GpsTime t,
                             bool fnav) {
  const Ephemeris* best = nullptr;
  for (const Ephemeris& e : records) {
    if (e.id != id || !validity(e).contains(t - e.toe)) continue;
    if constexpr (std::is_same_v<Ephemeris, gnss::KeplerEphemeris>) {
      if (is_galileo_fnav(e) != fnav) continue;
    }
    const bool better = best == nullptr || std::abs(t - e.toe) < std::abs(t - best->toe) ||
                        (std::abs(t - e.toe) == std::abs(t - best->toe) && e.toe >= best->toe);
    if (better) best = &e;  // ordered by transmission for equal toe
  }
  return best;
}

std::map<gnss::System, Worst> compare_with_rtklib(const gnss::NavigationData& data) {
  BroadcastOptions options;
  options.systems = {gnss::kAllSystems.begin(), gnss::kAllSystems.end()};
  options.allow_unhealthy = true;
  const BroadcastSky sky(data, options);
  std::map<gnss::System, Worst> worst;
  const auto [first, last] = sky.span();
  for (const gnss::SatelliteId id : sky.satellites()) {
    EXPECT_NE(rtklib_satellite(id), 0) << to_string(id) << " is not in this build of RTKLIB";
    for (GpsTime t = first - 7200.0; t <= last + 7200.0; t = t + 600.0) {
      const auto state = sky.state(id, t);
      double position[3] = {}, clock = 0, variance = 0;
      if (id.system == gnss::System::GLONASS) {
        const gnss::GlonassEphemeris* e = best_record(data.glonass, id, t, false);
        EXPECT_EQ(state.has_value(), e != nullptr);
        if (!state || e == nullptr) continue;
        const RtklibGlonassEphemeris r = rtklib_ephemeris(*e);
        geph2pos(rtklib_time(t), &r, position, &clock, &variance);
        worst[id.system].add(*state, position, clock, t - e->toe);
      } else if (id.system == gnss::System::SBAS) {
        const gnss::SbasEphemeris* e = best_record(data.sbas, id, t, false);
        EXPECT_EQ(state.has_value(), e != nullptr);
        if (!state || e == nullptr) continue;
        const RtklibSbasEphemeris r = rtklib_ephemeris(*e);
        seph2pos(rtklib_time(t), &r, position, &clock, &variance);
        worst[id.system].add(*state, position, clock, t - e->toe);
      } else {
        const gnss::KeplerEphemeris* e = best_record(data.kepler, id, t, false);
        if (e == nullptr) e = best_record(data.kepler, id, t, true);
        EXPECT_EQ(state.has_value(), e != nullptr);
        if (!state || e == nullptr) continue;
        const RtklibEphemeris r = rtklib_ephemeris(*e);
        eph2pos(rtklib_time(t), &r, position, &clock, &variance);
        worst[id.system].add(*state, position, clock, t - e->toe);
      }
    }
  }
  return worst;
}

void expect_within_bounds(const std::map<gnss::System, Worst>& worst) {
  for (const auto& [system, w] : worst) {
    std::printf("  %-8s %6d states, position within %.2e m, clock within %.2e s, ages to %.0f s\n",
                std::string(name(system)).c_str(), w.compared, w.position_m, w.clock_s, w.age_s);
    const double bound_m = system == gnss::System::GLONASS ? 1e-2
                           : system == gnss::System::SBAS  ? 1e-6
                                                           : 1e-3;
    EXPECT_LT(w.position_m, bound_m) << name(system);
    EXPECT_LT(w.clock_s, system == gnss::System::SBAS ? 1e-15 : 1e-10) << name(system);
  }
}

TEST_F(RtklibJudge, MixedDayOf2020) {
  CANYON_SHARED_DATA(path, "orbits/ESBC00DNK_R_20201770000_01D_MN.rnx.gz");
  const auto worst = compare_with_rtklib(rinex::read_rinex_navigation(path));
  expect_within_bounds(worst);
  ASSERT_EQ(worst.size(), gnss::kSystemCount);
  EXPECT_GT(worst.at(gnss::System::GPS).compared, 2000);
  EXPECT_GT(worst.at(gnss::System::GLONASS).compared, 1000);
  EXPECT_GT(worst.at(gnss::System::Galileo).compared, 2000);
  EXPECT_GT(worst.at(gnss::System::BeiDou).compared, 3000);
  EXPECT_GT(worst.at(gnss::System::QZSS).compared, 50);
  EXPECT_GT(worst.at(gnss::System::SBAS).compared, 400);  // all unhealthy, most without motion
}

TEST_F(RtklibJudge, GpsDayOf2012) {
  CANYON_SHARED_DATA(path, "orbits/brdc3050.12n");
  const auto worst = compare_with_rtklib(rinex::read_rinex_navigation(path));
  expect_within_bounds(worst);
  EXPECT_GT(worst.at(gnss::System::GPS).compared, 4000);
}

TEST_F(RtklibJudge, HongKongGpsAndBeidouOf2019) {
  CANYON_SHARED_DATA(gps, "urbannav-tst-20190428/hksc1180.19n");
  CANYON_SHARED_DATA(beidou, "urbannav-tst-20190428/hksc1180.19b");
  const auto worst = compare_with_rtklib(rinex::read_rinex_navigation({gps, beidou}));
  expect_within_bounds(worst);
  EXPECT_GT(worst.at(gnss::System::GPS).compared, 2000);
  EXPECT_GT(worst.at(gnss::System::BeiDou).compared, 2000);
}

TEST_F(RtklibJudge, Rinex4Hour) {
  CANYON_SHARED_DATA(path, "orbits/KMS300DNK_R_20221591000_01H_MN.rnx.gz");
  expect_within_bounds(compare_with_rtklib(rinex::read_rinex_navigation(path)));
}

/// RTKLIB's record of an ephemeris; null and a failure if there is none.
template <typename Record, typename Ours, typename Same>
const Record* find_record(const Record* records, int count, const Ours& ours, const Same& same) {
  const Record* found = std::find_if(records, records + count, same);
  if (found != records + count) return found;
  ADD_FAILURE() << to_string(ours.id) << " toe " << ours.toe.seconds_of_week() << " is not in RTKLIB's list";
  return nullptr;
}

void expect_same_records(const gnss::NavigationData& data, const RtklibNavigation& rtklib) {
  for (const gnss::KeplerEphemeris& ours : data.kepler) {
    const RtklibEphemeris want = rtklib_ephemeris(ours);
    const RtklibEphemeris* found = find_record(rtklib.eph, rtklib.n, ours, [&](const RtklibEphemeris& r) {
      return r.sat == want.sat && gps_time(r.toe) == ours.toe && r.iode == want.iode && r.f0 == want.f0 &&
             r.code == want.code && gps_time(r.ttr) == ours.transmission;
    });
    if (found == nullptr) continue;
    const RtklibEphemeris& r = *found;
    EXPECT_EQ(gps_time(r.toc), ours.toc);
    EXPECT_EQ(r.svh, want.svh);
    EXPECT_EQ(r.iodc, want.iodc);
    EXPECT_NEAR(r.toes, want.toes, 1e-9);
    const double mine[] = {want.A,    want.e,    want.i0,  want.OMG0,   want.omg,   want.M0,  want.deln,
                           want.OMGd, want.idot, want.crc, want.crs,    want.cuc,   want.cus, want.cic,
                           want.cis,  want.f1,   want.f2,  want.tgd[0], want.tgd[1]};
    const double theirs[] = {r.A,   r.e,   r.i0,  r.OMG0, r.omg, r.M0, r.deln, r.OMGd,   r.idot,  r.crc,
                             r.crs, r.cuc, r.cus, r.cic,  r.cis, r.f1, r.f2,   r.tgd[0], r.tgd[1]};
    for (std::size_t i = 0; i < std::size(mine); ++i) {
      // RTKLIB sums digits and powers of ten itself: the last bits differ.
      EXPECT_NEAR(mine[i], theirs[i], 4e-15 * std::abs(mine[i])) << to_string(ours.id) << " field " << i;
    }
  }
  for (const gnss::GlonassEphemeris& ours : data.glonass) {
    const RtklibGlonassEphemeris want = rtklib_ephemeris(ours);
    const auto* found = find_record(rtklib.geph, rtklib.ng, ours, [&](const RtklibGlonassEphemeris& r) {
      return r.sat == want.sat && gps_time(r.toe) == ours.toe && r.svh == want.svh;
    });
    if (found == nullptr) continue;
    EXPECT_EQ(gps_time(found->tof), ours.transmission) << to_string(ours.id);
    EXPECT_EQ(found->frq, want.frq);
    EXPECT_NEAR(found->taun, want.taun, 1e-18);
    EXPECT_NEAR(found->gamn, want.gamn, 1e-24);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(found->pos[i], want.pos[i], 1e-7);
      EXPECT_NEAR(found->vel[i], want.vel[i], 1e-11);
      EXPECT_NEAR(found->acc[i], want.acc[i], 1e-18);
    }
  }
  for (const gnss::SbasEphemeris& ours : data.sbas) {
    const RtklibSbasEphemeris want = rtklib_ephemeris(ours);
    const auto* found = find_record(rtklib.seph, rtklib.ns, ours, [&](const RtklibSbasEphemeris& r) {
      return r.sat == want.sat && gps_time(r.t0) == ours.toe && r.svh == want.svh;
    });
    if (found == nullptr) continue;
    EXPECT_EQ(gps_time(found->tof), ours.transmission) << to_string(ours.id);
    EXPECT_NEAR(found->af0, want.af0, 1e-21);
    EXPECT_NEAR(found->af1, want.af1, 1e-25);
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(found->pos[i], want.pos[i], 1e-7);
      EXPECT_NEAR(found->vel[i], want.vel[i], 1e-11);
      EXPECT_NEAR(found->acc[i], want.acc[i], 1e-18);
    }
  }
}

// One test for each file: a missing file skips only its own test.
class RtklibJudgeOfRealDay : public RtklibJudge, public testing::WithParamInterface<const char*> {};
TEST_P(RtklibJudgeOfRealDay, ReaderFindsTheSameRecords) {
  CANYON_SHARED_DATA(path, GetParam());
  const gnss::NavigationData data = rinex::read_rinex_navigation(path);
  const auto rtklib = rtklib_read(TextFile(path).text());
  EXPECT_EQ(static_cast<std::size_t>(rtklib->n), data.kepler.size());
  EXPECT_EQ(static_cast<std::size_t>(rtklib->ng), data.glonass.size());
  EXPECT_EQ(static_cast<std::size_t>(rtklib->ns), data.sbas.size());
  expect_same_records(data, *rtklib);
}
INSTANTIATE_TEST_SUITE_P(Rtklib, RtklibJudgeOfRealDay, testing::ValuesIn(test::kRealDays));

TEST_F(RtklibJudge, WrittenFileIsRead) {
  CANYON_SHARED_DATA(path, "orbits/ESBC00DNK_R_20201770000_01D_MN.rnx.gz");
  const gnss::NavigationData data = rinex::read_rinex_navigation(path);
  const auto rtklib = rtklib_read(rinex::format_rinex_navigation(data));
  EXPECT_EQ(static_cast<std::size_t>(rtklib->n), data.kepler.size());
  EXPECT_EQ(static_cast<std::size_t>(rtklib->ng), data.glonass.size());
  EXPECT_EQ(static_cast<std::size_t>(rtklib->ns), data.sbas.size());
  expect_same_records(data, *rtklib);
}

// Real files have no healthy one: records every 128 s of three satellites with velocities, accelerations and
// clocks up to the limits of message 9, read by RTKLIB and by our reader from one text.
TEST_F(RtklibJudge, SbasOfMadeUpRecords) {
  std::string text = test::kRinex3Header;
  for (int satellite = 0; satellite < 3; ++satellite) {
    for (int k = 0; k < 28; ++k) {
      const double s = satellite + 1 + 0.1 * k;
      text += fmt::format(
          "S{} 2019 04 28 12 {:02d} {:02d}{:19.12E}{:19.12E}{:19.12E}\n"
          "    {:19.12E}{:19.12E}{:19.12E}{:19.12E}\n    {:19.12E}{:19.12E}{:19.12E}{:19.12E}\n"
          "    {:19.12E}{:19.12E}{:19.12E}{:19.12E}\n",
          23 + 10 * satellite, 128 * k / 60, 128 * k % 60, 9e-7 * std::sin(s), 1.1e-10 * std::cos(3 * s),
          43200.0 + 128 * k, 42164 * std::cos(s), 0.04 * std::sin(2 * s), 6e-6 * std::cos(s), 0.0,
          42164 * std::sin(s), 0.04 * std::cos(2 * s), 6e-6 * std::sin(s), 4.0, 100 * s,
          0.5 * std::sin(5 * s), 3e-5 * std::cos(5 * s), 1.0 * k);
    }
  }
  const gnss::NavigationData data = rinex::read_rinex_navigation(TextFile::from_string(text, "sbas.rnx"));
  EXPECT_TRUE(data.report.lines().empty());
  EXPECT_EQ(data.sbas.size(), 84U);
  const auto rtklib = rtklib_read(text);
  EXPECT_EQ(rtklib->ns, 84);
  expect_same_records(data, *rtklib);
  const auto worst = compare_with_rtklib(data);
  expect_within_bounds(worst);
  EXPECT_GT(worst.at(gnss::System::SBAS).compared, 15);
  EXPECT_GT(worst.at(gnss::System::SBAS).age_s, 100);
}

}  // namespace
}  // namespace canyon::orbit
