#include "canyon/orbit/navigation_review.hpp"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <functional>

#include "canyon/geodesy/time_scales.hpp"
#include "canyon/orbit/nominal_constellation.hpp"
#include "canyon/rinex/navigation_reader.hpp"
#include "tests/support/refusal.hpp"
#include "tests/support/shared_data.hpp"

namespace canyon::orbit {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

gnss::NavigationData some_hours() {
  const geodesy::GpsTime begin = geodesy::parse_time("2024-02-29T00:00:00 GPST");
  gnss::NavigationData data = nominal_constellation(
      begin, begin + 6 * 3600, {gnss::System::GPS, gnss::System::GLONASS, gnss::System::Galileo});
  data.sources = {"some.rnx"};
  int line = 1;
  for (auto& e : data.kepler) e.line = ++line;
  for (auto& e : data.glonass) e.line = ++line;
  return data;
}

TEST(NavigationReview, LeavesGoodRecordsAlone) {
  gnss::NavigationData data = some_hours();
  const std::size_t kepler = data.kepler.size(), glonass = data.glonass.size();
  review_navigation(data);
  EXPECT_EQ(data.kepler.size(), kepler);
  EXPECT_EQ(data.glonass.size(), glonass);
  EXPECT_THAT(data.warnings, IsEmpty());
}

// Each fault is within what its field can hold: only the other records contradict it.
TEST(NavigationReview, LeavesOutRecordsThatContradictTheOthers) {
  using Ephemeris = gnss::KeplerEphemeris;
  const std::pair<const char*, std::function<void(Ephemeris&)>> faults[] = {
      {"orbit", [](Ephemeris& e) { e.mean_anomaly = -e.mean_anomaly + 0.01; }},
      {"orbit", [](Ephemeris& e) { e.right_ascension += 0.001; }},
      {"orbit", [](Ephemeris& e) { e.toe = e.toe + 3600; }},
      {"orbit", [](Ephemeris& e) { e.crs = 5000; }},
      {"orbit", [](Ephemeris& e) { e.sqrt_a += 10; }},
      {"clock", [](Ephemeris& e) { e.af0 = 1e-4; }},
  };
  for (std::size_t which = 0; which < 3; ++which) {  // the first, the second, one in the middle of G01
    for (const auto& [what, spoil] : faults) {
      gnss::NavigationData data = some_hours();
      Ephemeris& wrong = data.kepler.at(which);
      ASSERT_EQ(to_string(wrong.id), "G01");
      const int line = wrong.line;
      spoil(wrong);
      const std::size_t all = data.kepler.size();
      review_navigation(data);
      EXPECT_EQ(data.kepler.size(), all - 1) << which << what;
      EXPECT_THAT(data.warnings,
                  ElementsAre(AllOf(HasSubstr(fmt::format("some.rnx:{}: the {} of G01", line, what)),
                                    HasSubstr("contradicts its other records by"))));
      for (const Ephemeris& e : data.kepler) EXPECT_NE(e.line, line);
    }
  }
  gnss::NavigationData data = some_hours();
  data.glonass.at(1).position_m[0] += 5000;
  const std::size_t all = data.glonass.size();
  review_navigation(data);
  EXPECT_EQ(data.glonass.size(), all - 1);
}

TEST(NavigationReview, OfTwoAloneNeitherIsWrong) {
  gnss::NavigationData data = some_hours();
  data.kepler.resize(2);
  data.glonass.clear();
  data.kepler[1].mean_anomaly += 0.1;
  review_navigation(data);
  EXPECT_EQ(data.kepler.size(), 2U);
  EXPECT_THAT(data.warnings, ElementsAre(HasSubstr("no third record says which one is right")));
  // An unhealthy one says that its satellite is not to be used, whatever else is in it.
  data.warnings.clear();
  data.kepler[1].health = 63;
  review_navigation(data);
  EXPECT_THAT(data.warnings, IsEmpty());
}

// All records are wrong alike: only the planes of the orbits tell.
TEST(NavigationReview, GlonassInTheTimeOfMoscowIsFoundByItsPlanes) {
  const auto shifted = [](double seconds) {
    gnss::NavigationData data = some_hours();
    for (auto& e : data.glonass) {
      e.toe = e.toe + seconds;
      if (e.id.number == 24) e.id.number = 26;  // a spare has no slot
    }
    return data;
  };
  gnss::NavigationData data = shifted(3 * 3600);
  review_navigation(data);
  EXPECT_THAT(data.glonass, IsEmpty());
  EXPECT_FALSE(data.kepler.empty());
  EXPECT_THAT(data.warnings, ElementsAre(AllOf(HasSubstr("the time seems to be Moscow's"),
                                               HasSubstr("the plane of its slot"), HasSubstr("some.rnx:"))));
  data = shifted(3 * 3600);
  data.kepler.clear();
  EXPECT_THAT(test::refusal([&] { review_navigation(data); }),
              AllOf(HasSubstr("no usable ephemeris"), HasSubstr("the time seems to be Moscow's")));
  // A simulator's constellation has planes of its own.
  data = shifted(-3600);
  const std::size_t all = data.glonass.size();
  review_navigation(data);
  EXPECT_EQ(data.glonass.size(), all);
  EXPECT_THAT(data.warnings, ElementsAre(HasSubstr("right for a simulated constellation; else their times")));

  data = some_hours();
  for (auto& e : data.glonass)
    if (e.id.number == 5) e.id.number = 13;
  review_navigation(data);
  EXPECT_LT(data.glonass.size(), all);
  EXPECT_THAT(data.warnings, testing::Contains(HasSubstr("the satellite's number is wrong")));
}

TEST(NavigationReview, RealFilesLoseNothingButWrongRecords) {
  const std::pair<const char*, std::size_t> files[] = {
      {"orbits/brdc3050.12n", 0},
      {"orbits/ESBC00DNK_R_20201770000_01D_MN.rnx.gz", 0},
      {"orbits/KMS300DNK_R_20221591000_01H_MN.rnx.gz", 0},
      {"rtk-nagoya-20240624/base.nav", 0},
      {"berlin-potsdamer-platz/brdc1580.16n", 0},
      // R06 and R24 once 15 min late; the reader leaves out six that are stamped 12:15:17.
      {"berlin-potsdamer-platz/brdc1580.16g", 2},
      {"urbannav-tst-20190428/hksc1180.19n", 0},
      {"urbannav-tst-20190428/hksc1180.19b", 0},
      {"urbannav-tst-20210517/hksc137c.21n", 0},
      {"urbannav-tst-20210517/hksc137c.21f", 0}};
  for (const auto& [file, lost] : files) {
    CANYON_SHARED_DATA(path, file);
    const gnss::NavigationData all = rinex::read_rinex_navigation(path);
    const gnss::NavigationData kept = read_navigation({path});
    EXPECT_EQ(all.kepler.size() + all.glonass.size() + all.sbas.size(),
              kept.kepler.size() + kept.glonass.size() + kept.sbas.size() + lost)
        << file << ": " << (kept.warnings.empty() ? "" : kept.warnings.back());
  }
}

}  // namespace
}  // namespace canyon::orbit
