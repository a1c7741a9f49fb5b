#include "canyon/validation/report/report.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <tinyxml2.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/gnss/signals.hpp"
#include "canyon/validation/report/report_html.hpp"
#include "canyon/validation/report/report_pictures.hpp"
#include "canyon/validation/report/report_samples.hpp"
#include "tests/support/circular_sky.hpp"
#include "tests/support/png_pixels.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::validation {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

const std::vector<std::string> kNames{"track", "errors", "error_cdf", "prediction", "cn0", "sky"};

/// A drive around a corner, between two blocks of houses.
city::City corner_city() {
  city::City city{"corner", geodesy::LocalFrame(geodesy::Geodetic::from_degrees(22.3, 114.17, 0)), {}, {}};
  for (int k = 0; k < 3; ++k) {
    city::append_box(city.mesh, "house", city::Surface::Building, city::Material::Concrete, {60.0 * k, 12, 0},
                     {60.0 * k + 50, 40, 20.0 + 12 * k});
    city::append_box(city.mesh, "house", city::Surface::Building, city::Material::Concrete,
                     {60.0 * k, -45, 0}, {60.0 * k + 50, -12, 45.0 - 8 * k});
  }
  city::append_box(city.mesh, "tower", city::Surface::Building, city::Material::Glass, {212, 12, 0},
                   {250, 90, 70});
  return city;
}

/// A hand-made comparison: 120 epochs at 1 Hz with a gap, twelve satellites each, every third of them NLOS.
Comparison drive() {
  Comparison c;
  c.name = "specular, first order";
  std::mt19937 engine(7);
  // Without the library's distributions: their values differ between standard libraries.
  const auto uniform = [&engine] { return (static_cast<double>(engine() >> 5U) + 0.5) / 134217728.0; };
  const auto normal = [&] {
    return std::sqrt(-2 * std::log(uniform())) * std::cos(2 * geodesy::kPi * uniform());
  };
  const geodesy::GpsTime start = geodesy::GpsTime::from_week(2051, 45200);
  for (int e = 0; e < 120; ++e) {
    ComparedEpoch epoch;
    epoch.time = start + (e < 60 ? e : e + 12.0);
    epoch.place_enu_m = e < 80 ? Eigen::Vector3d(2.5 * e, 0, 2) : Eigen::Vector3d(200, 2.5 * (e - 80), 2);
    epoch.first = c.satellites.size();
    for (int k = 0; k < 12; ++k) {
      ComparedSatellite s;
      s.id = {k < 7 ? gnss::System::GPS : gnss::System::BeiDou, static_cast<std::uint8_t>(k + 1)};
      s.azimuth_rad = geodesy::radians(31.0 * k);
      s.elevation_rad = geodesy::radians(12.0 + 6.3 * k);
      s.clear = k % 3 != 0;
      const double delay = s.clear ? 0 : 12.0 + 50 * std::abs(std::sin(0.05 * e + k));
      if ((e + k) % 11 != 0) {
        s.measured = true;
        s.measured_error_m = delay + (s.clear ? 3 : 9) * normal();
        s.measured_cn0_dbhz = (s.clear ? 44 : 31) + 3 * normal();
      }
      if ((e + 2 * k) % 9 != 0) {
        s.simulated = true;
        s.simulated_error_m = 0.9 * delay + 3 * normal();
        s.simulated_cn0_dbhz = (s.clear ? 45 : 33) + 2 * normal();
      }
      if (!s.clear && (e + k) % 7 != 0) {
        static constexpr std::array kKinds{propagation::PathKind::Reflected, propagation::PathKind::Reflected,
                                           propagation::PathKind::Diffracted, propagation::PathKind::Diffuse};
        s.prediction = {kKinds[static_cast<std::size_t>(k / 3)], k / 3 == 1 ? 2 : 1, delay};
      }
      s.used_measured = s.measured;
      s.used_simulated = s.simulated;
      c.satellites.push_back(s);
    }
    epoch.count = c.satellites.size() - epoch.first;
    if (e % 17 != 5) {
      epoch.measured = {true, {6 * normal(), 9 * normal(), 15 * normal()}, 10};
    }
    if (e % 23 != 4) epoch.simulated = {true, {5 * normal(), 8 * normal(), 12 * normal()}, 9};
    epoch.segment = e < 80 ? 0 : 1;
    c.epochs.push_back(epoch);
  }
  c.segments = {{0, 80, 197.5, 90}, {80, 40, 97.5, 0}};
  return c;
}

/// Figures with a round value in each place: those of a page need not come from its comparison.
Figures sample_figures(const std::string& model) {
  Figures f;
  f.model = model;
  f.part = "second half: 12:34:20 to 12:35:31 GPST, 60 epochs";
  f.epochs = 60;
  f.los = 430;
  f.nlos = 210;
  f.by_cn0 = Separation{0.912, 0.85, 38.5};
  f.by_error = Separation{0.871, 0.81, 12.0};
  f.by_cn0_interval = Interval{0.88, 0.94};
  f.bands = {
      {10, 30, 100, 90, f.by_cn0, {}}, {30, 50, 200, 70, f.by_cn0, f.by_error}, {50, 90, 130, 50, {}, {}}};
  f.tracked_los = {450, 430, 420};
  f.tracked_nlos = {300, 210, 150};
  f.explained = {{"reflected 1", 100, 0.476, 4.1, Correlation{0.8, 0.7, 0.9, 100}},
                 {"all", 180, 0.857, 5.5, Correlation{0.76, 0.7, 0.82, 180}}};
  f.error_los_m = {430, 420, {-4, -1, 0, 1, 5}, {-5, -1, 0, 1, 4}, 0.061};
  f.error_nlos_m = {210, 150, {-2, 8, 20, 45, 90}, {0, 5, 14, 30, 60}, 0.22};
  f.cn0_los_dbhz = {430, 420, {38, 41, 44, 46, 48}, {39, 42, 45, 47, 48}, 0.15};
  f.cn0_nlos_dbhz = {210, 150, {22, 26, 31, 35, 39}, {21, 27, 32, 36, 40}, 0.1};
  f.used = {60, 58, {8, 9, 10, 11, 12}, {8, 9, 9, 10, 11}, 0.2};
  f.measured = {60, 57, 10.1, {2, 5, 10, 18, 40}, {1, 5, 12, 25, 60}};
  f.simulated = {60, 58, 9.3, {2, 4, 9, 15, 24}, {1, 4, 10, 20, 50}};
  f.segments = {{1, {60, 20, 60, 90}, f.measured, f.simulated}};
  return f;
}

/// The report must agree with the figures: pictures count as the figures do.
TEST(ReportSamples, AreThoseOfTheFigures) {
  const Comparison c = drive();
  FigureOptions options;
  options.resamples = 0;
  const Figures f = figures(c, 40, 70, "part", options);
  const ReportSamples samples = report_samples(c, 40, 70);
  const auto same = [](const SamplePair& pair, const DistributionPair& figure) {
    EXPECT_EQ(pair.measured.size(), figure.measured_n);
    EXPECT_EQ(pair.simulated.size(), figure.simulated_n);
    EXPECT_NEAR(*median(pair.measured), figure.measured[2], 1e-12);
    EXPECT_NEAR(kolmogorov_smirnov(pair.measured, pair.simulated).value(), *figure.ks, 1e-12);
  };
  same(samples.error_los_m, f.error_los_m);
  same(samples.error_nlos_m, f.error_nlos_m);
  EXPECT_EQ(samples.horizontal_m.measured.size(), f.measured.fixes);
  EXPECT_NEAR(*median(samples.horizontal_m.simulated), f.simulated.horizontal_m[2], 1e-12);
  // Kinds of paths have the same words.
  std::map<std::string, std::size_t> kinds;
  for (std::size_t e = 40; e < 110; ++e) {
    for (const ComparedSatellite& s : satellites_of(c, c.epochs[e])) {
      if (!s.clear && s.measured && s.prediction) ++kinds[path_words(*s.prediction)];
    }
  }
  std::size_t all = 0;
  for (const Explained& e : f.explained) {
    if (e.kind == "all") continue;
    EXPECT_EQ(e.n, kinds[e.kind]) << e.kind;
    all += kinds[e.kind];
  }
  EXPECT_EQ(f.explained.back().n, all);
  EXPECT_EQ(kinds.size(), 4U);
}

class ReportTest : public ::testing::Test {
 protected:
  ReportTest()
      : comparison_(drive()),
        environment_(corner_city(), std::make_shared<test::CircularSky>(std::vector{gnss::System::GPS})) {
    input_.title = "Corner <drive> & \"test\"";
    input_.city = &environment_.city();
    input_.environment = &environment_;
    input_.comparison = &comparison_;
    input_.first = 60;
    input_.count = 60;
    input_.models = {sample_figures("specular, first order"), sample_figures("mirror & more")};
    Alignment alignment;
    alignment.registration.east_m = -1.25;
    alignment.registration.north_m = 7.5;
    alignment.sigma_east_m = 0.4;
    alignment.sigma_north_m = 0.75;
    alignment.score = 0.89;
    alignment.score_before = 0.84;
    alignment.count = 60;
    input_.alignment = alignment;
    input_.notes = {"observations: drive.obs", "a < b"};
  }

  [[nodiscard]] std::string html() const { return test::read_bytes(folder_ / "report.html"); }

  /// The page as XML; fails the test where it is not well-formed.
  void parse(tinyxml2::XMLDocument& document) const {
    ASSERT_EQ(document.Parse(html().c_str()), tinyxml2::XML_SUCCESS) << document.ErrorStr();
  }

  void expect_whole_files() const {
    for (const std::string& name : kNames) {
      EXPECT_THAT(test::read_bytes(folder_ / (name + ".png")), StartsWith("\x89PNG\r\n\x1a\n")) << name;
      const std::string svg = test::read_bytes(folder_ / (name + ".svg"));
      tinyxml2::XMLDocument document;
      EXPECT_EQ(document.Parse(svg.c_str()), tinyxml2::XML_SUCCESS) << name;
    }
    tinyxml2::XMLDocument document;
    parse(document);
    std::size_t files = 0;
    for ([[maybe_unused]] const auto& entry : std::filesystem::directory_iterator(folder_.path())) ++files;
    EXPECT_EQ(files, 13U);  // nothing temporary is left
  }

  Comparison comparison_;
  simulation::Environment environment_;
  ReportInput input_;
  test::TemporaryFolder folder_;
};

/// Calls `visit` for an element and all below it.
template <class Visit>
void each_element(const tinyxml2::XMLElement* element, const Visit& visit) {
  for (; element != nullptr; element = element->NextSiblingElement()) {
    visit(*element);
    each_element(element->FirstChildElement(), visit);
  }
}

TEST_F(ReportTest, FilesAreWholeAndThePageIsWellFormed) {
  write_report(folder_.path(), input_);
  expect_whole_files();
}

TEST_F(ReportTest, ThePageLoadsNothing) {
  write_report(folder_.path(), input_);
  tinyxml2::XMLDocument document;
  parse(document);
  std::vector<std::string> pictures;
  each_element(document.RootElement(), [&](const tinyxml2::XMLElement& element) {
    const std::string name = element.Name();
    EXPECT_NE(name, "script");
    EXPECT_NE(name, "link");
    EXPECT_EQ(element.Attribute("href"), nullptr) << name;
    if (const char* source = element.Attribute("src")) {
      EXPECT_THAT(source, StartsWith("data:image/png;base64,"));
      pictures.emplace_back(source);
      ASSERT_NE(element.Attribute("alt"), nullptr);
      EXPECT_GT(std::string(element.Attribute("alt")).size(), 20U);
    }
  });
  ASSERT_EQ(pictures.size(), kNames.size());
  EXPECT_THAT(html(), Not(HasSubstr("http")));
  EXPECT_THAT(html(), Not(HasSubstr("@import")));
  EXPECT_THAT(html(), Not(HasSubstr("url(")));
  // The pictures inside are those beside it.
  for (std::size_t k = 0; k < kNames.size(); ++k) {
    EXPECT_EQ(pictures[k],
              "data:image/png;base64," + base64(test::read_bytes(folder_ / (kNames[k] + ".png"))));
  }
}

TEST_F(ReportTest, NamesAreEscaped) {
  write_report(folder_.path(), input_);
  const std::string page = html();
  EXPECT_THAT(page, HasSubstr("Corner &lt;drive&gt; &amp; &quot;test&quot;"));
  EXPECT_THAT(page, HasSubstr("mirror &amp; more"));
  EXPECT_THAT(page, HasSubstr("<li>a &lt; b</li>"));
  EXPECT_THAT(page, Not(HasSubstr("<drive>")));
}

TEST_F(ReportTest, TargetsStandBesideWhatWasReachedInWords) {
  write_report(folder_.path(), input_);
  tinyxml2::XMLDocument document;
  parse(document);
  // The first table's rows as text.
  std::vector<std::string> rows;
  const tinyxml2::XMLElement* first = nullptr;
  each_element(document.RootElement(), [&](const tinyxml2::XMLElement& element) {
    if (first == nullptr && std::string(element.Name()) == "tbody") first = &element;
  });
  ASSERT_NE(first, nullptr);
  for (const auto* row = first->FirstChildElement(); row != nullptr; row = row->NextSiblingElement()) {
    std::string text;
    for (const auto* cell = row->FirstChildElement(); cell != nullptr; cell = cell->NextSiblingElement()) {
      const auto* inner = cell->FirstChildElement("span");
      text += std::string((inner != nullptr ? inner : cell)->GetText()) + "|";
    }
    rows.push_back(text);
  }
  ASSERT_EQ(rows.size(), 14U);
  EXPECT_EQ(rows[0], "LOS and NLOS separated by C/N0, AUC|at least 0.88|0.912|\u2713 reached|");
  EXPECT_EQ(rows[1],
            "LOS and NLOS separated by pseudorange error, AUC|at least 0.88|0.871|\u2717 not reached|");
  EXPECT_EQ(rows[2], "Tracked NLOS observations with a modelled path|at least 80 %|85.7 %|\u2713 reached|");
  EXPECT_EQ(rows[7], "LOS C/N0, KS distance|at most 0.15|0.150|\u2713 reached|");
  EXPECT_THAT(html(), HasSubstr("reaches 10 of 14 targets"));
}

TEST_F(ReportTest, AlignmentIsStatedWithUncertaintyAndParts) {
  write_report(folder_.path(), input_);
  EXPECT_THAT(html(), HasSubstr("<th scope=\"row\">City moved east [m]</th><td>-1.25</td><td>0.40</td>"));
  EXPECT_THAT(html(), HasSubstr("<th scope=\"row\">City moved north [m]</th><td>7.50</td><td>0.75</td>"));
  // 45,200 s of a week are 12:33:20; the first 60 epochs end 59 s later, the next follow a gap of 12 s.
  EXPECT_THAT(html(),
              HasSubstr("<th scope=\"row\">Alignment</th><td>12:33:20 to 12:34:19 GPST, 60 epochs</td>"));
  EXPECT_THAT(html(),
              HasSubstr("<th scope=\"row\">Figures</th><td>12:34:32 to 12:35:31 GPST, 60 epochs</td>"));
  EXPECT_THAT(html(), Not(HasSubstr("Caution")));
  input_.alignment->count = 61;
  input_.alignment->at_border = true;
  write_report(folder_.path(), input_);
  EXPECT_THAT(html(), HasSubstr("both parts share epochs"));
  EXPECT_THAT(html(), HasSubstr("border of the search"));
  input_.alignment.reset();
  write_report(folder_.path(), input_);
  EXPECT_THAT(html(), HasSubstr("no alignment was estimated"));
}

TEST_F(ReportTest, SignalsAndTheirPhases) {
  const auto gps = gnss::signals_of(gnss::System::GPS);
  const PhaseFigures phase{{200, 150, 0.0021, 120}, {100, 25, {}, 0}, 7, 175};
  SignalFigures first, l2c, l5;
  first.signal = &gps[0];
  l2c.signal = &gps[2];
  l5.signal = &gps[3];
  first.recorded = first.tracked = l2c.recorded = l2c.tracked = l5.recorded = true;
  first.measured_phase = phase;
  l2c.error_los_m = {30, 31, {-4, -1, 0, 1, 5}, {-5, -1, 0, 1, 4}, 0.061};
  l2c.tracked_los = {40, 30, 31};
  input_.models.front().signals = {first, l2c, l5};
  write_report(folder_.path(), input_);
  expect_whole_files();
  EXPECT_THAT(html(), HasSubstr("<h3>GPS L2C</h3>"));
  EXPECT_THAT(html(), HasSubstr("<th scope=\"row\">LOS</th><td>40</td><td>75.0</td><td>77.5</td>"));
  EXPECT_THAT(html(), HasSubstr("<th scope=\"row\">GPS L5</th><td>yes</td><td>no</td>"));
  EXPECT_THAT(html(),
              HasSubstr("<th scope=\"row\">GPS L1CA, measured</th><td>75.0</td><td>25.0</td><td>25.0</td>"
                        "<td>7</td><td>2.1</td><td>\u2013</td>"));
}

TEST_F(ReportTest, SameInputSameBytes) {
  write_report(folder_.path(), input_);
  const test::TemporaryFolder again;
  write_report(again.path(), input_);
  for (const auto& entry : std::filesystem::directory_iterator(folder_.path())) {
    const std::string name = entry.path().filename().string();
    EXPECT_EQ(test::read_bytes(entry.path()), test::read_bytes(again / name)) << name;
  }
}

TEST_F(ReportTest, AMissingFolderIsAnInputError) {
  EXPECT_THROW(write_report(folder_ / "missing", input_), InputError);
}

TEST_F(ReportTest, NoFixAtAll) {
  for (ComparedEpoch& epoch : comparison_.epochs) epoch.measured = epoch.simulated = {};
  for (Figures& f : input_.models) f.measured.fixes = f.simulated.fixes = 0;
  write_report(folder_.path(), input_);
  expect_whole_files();
  EXPECT_THAT(html(), HasSubstr("no value"));
  EXPECT_THAT(html(), Not(HasSubstr("<td>nan")));
}

TEST_F(ReportTest, NoNlosSatellite) {
  for (ComparedSatellite& s : comparison_.satellites) {
    s.clear = true;
    s.prediction.reset();
  }
  Figures& f = input_.models.front();
  f.nlos = 0;
  f.by_cn0.reset();
  f.by_error.reset();
  f.tracked_nlos = {};
  f.explained = {{"all", 0, 0, {}, {}}};
  f.error_nlos_m = f.cn0_nlos_dbhz = {};
  write_report(folder_.path(), input_);
  expect_whole_files();
  EXPECT_THAT(html(), HasSubstr("<td>at least 80 %</td><td>no value</td>"));
}

TEST_F(ReportTest, OneEpochAndNone) {
  input_.count = 1;
  write_report(folder_.path(), input_);
  expect_whole_files();
  input_.count = 0;
  write_report(folder_.path(), input_);
  expect_whole_files();
  comparison_ = {};
  input_.first = 0;
  input_.alignment.reset();
  input_.models = {Figures{}};
  write_report(folder_.path(), input_);
  expect_whole_files();
  EXPECT_THAT(html(), HasSubstr("reaches 0 of 14 targets"));
}

TEST_F(ReportTest, AFixDrawsWhereItLies) {
  // One fix at the place itself, no other: its colour is there, and on the other map it is not.
  for (ComparedEpoch& epoch : comparison_.epochs) epoch.measured = epoch.simulated = {};
  const test::PngPixels without(draw_report_track(input_).png);
  comparison_.epochs[70].measured = {true, {20, 5, 0}, 8};
  const test::PngPixels with(draw_report_track(input_).png);
  EXPECT_GT(with.count(kMeasured), without.count(kMeasured) + 10);
  EXPECT_EQ(with.count(kSimulated), without.count(kSimulated));
}

TEST_F(ReportTest, ErrorsOnTheMapTurnWithTheCity) {
  // A city turned by 90 deg counter-clockwise: in its own axes an error to the north points east.
  for (ComparedEpoch& epoch : comparison_.epochs) epoch.measured = epoch.simulated = {};
  comparison_.epochs[70].measured = {true, {0, 40, 0}, 8};
  comparison_.registration.heading_rad = 0.5 * geodesy::kPi;
  const std::string turned = draw_report_track(input_).png;
  comparison_.registration.heading_rad = 0;
  comparison_.epochs[70].measured.error_enu_m = {40, 0, 0};
  // sin and cos of pi / 2 are exact to 1e-16: the same picture.
  EXPECT_EQ(draw_report_track(input_).png, turned);
}

TEST(Overview, IsWellFormedAndLinksTheReports) {
  RecordingRow row{"a & b", "<class>", headlines(sample_figures("m")), "a/report.html", "part", "", "", {}};
  row.headlines[0].simulated_interval = Interval{1, 2};
  RecordingRow pooled{"all", "<class>", row.headlines, "", "", "", "", {"a & b"}};
  const std::string html = overview_html("drives", {row, pooled}, {"canyon"});
  tinyxml2::XMLDocument document;
  ASSERT_EQ(document.Parse(html.c_str()), tinyxml2::XML_SUCCESS) << document.ErrorStr();
  int links = 0, rows = 0;
  each_element(document.RootElement(), [&](const tinyxml2::XMLElement& element) {
    if (std::string(element.Name()) == "tr") ++rows;
    if (std::string(element.Name()) != "a") return;
    ++links;
    EXPECT_STREQ(element.Attribute("href"), "a/report.html");
    EXPECT_STREQ(element.GetText(), "a & b");
  });
  EXPECT_EQ(links, 1);
  EXPECT_EQ(rows, static_cast<int>(row.headlines.size()) + 1);
  EXPECT_NE(html.find("1.0 to 2.0"), std::string::npos);
}

TEST(ReportSamples, FollowTheCitysWordAndWhatIsThere) {
  Comparison c;
  ComparedEpoch epoch;
  epoch.count = 3;
  epoch.measured = {true, {3, 4, 100}, 7};
  c.epochs = {epoch};
  c.satellites.resize(3);
  c.satellites[0].clear = true;
  c.satellites[0].measured = true;
  c.satellites[0].measured_error_m = 1.5;
  c.satellites[1].simulated = true;
  c.satellites[1].simulated_error_m = 30;
  c.satellites[2].measured_error_m = 9;  // of a satellite that is not measured
  const ReportSamples samples = report_samples(c, 0, 1);
  EXPECT_THAT(samples.error_los_m.measured, ElementsAre(1.5));
  EXPECT_THAT(samples.error_nlos_m.simulated, ElementsAre(30));
  EXPECT_TRUE(samples.error_nlos_m.measured.empty());
  EXPECT_THAT(samples.horizontal_m.measured, ElementsAre(5));
  EXPECT_TRUE(samples.horizontal_m.simulated.empty());
}

TEST(ReportSamples, TheRichestEpochIsNearestToTheMiddle) {
  Comparison c;
  for (const int measured : {1, 3, 2, 3, 0}) {
    ComparedEpoch epoch;
    epoch.first = c.satellites.size();
    epoch.count = 3;
    c.epochs.push_back(epoch);
    for (int k = 0; k < 3; ++k) {
      c.satellites.emplace_back();
      c.satellites.back().measured = k < measured;
    }
  }
  EXPECT_EQ(richest_epoch(c, 0, 5), 1U);  // 1 and 3 are as far from 2: the first one
  EXPECT_EQ(richest_epoch(c, 2, 3), 3U);
  EXPECT_EQ(richest_epoch(c, 4, 1), 4U);
}

TEST(Targets, BoundsAreTheStatedOnes) {
  Figures f = sample_figures("model");
  const auto target = [&f](std::string_view key) {
    const std::vector<Target> all = targets(f);
    return *std::find_if(all.begin(), all.end(), [key](const Target& t) { return t.info->key == key; });
  };
  EXPECT_TRUE(target("auc_cn0").reached());
  f.by_cn0->auc = 0.8799;
  EXPECT_FALSE(target("auc_cn0").reached());
  // 420 and 430 of 450: 0.0222 fewer. 150 and 210 of 300: 0.2 fewer.
  EXPECT_NEAR(*target("tracked_los").value, -10.0 / 450, 1e-12);
  EXPECT_TRUE(target("tracked_los").reached());
  EXPECT_NEAR(*target("tracked_nlos").value, -0.2, 1e-12);
  EXPECT_FALSE(target("tracked_nlos").reached());
  EXPECT_NEAR(*target("satellites_used").value, -0.8, 1e-12);
  EXPECT_EQ(target("satellites_used").value_text(), "-0.80");
  EXPECT_NEAR(*target("horizontal_p50_m").value, 0.9, 1e-12);
  EXPECT_TRUE(target("horizontal_p50_m").reached());
  EXPECT_NEAR(*target("horizontal_p95_m").value, 0.6, 1e-12);
  EXPECT_FALSE(target("horizontal_p95_m").reached());
  EXPECT_EQ(target("nlos_explained").wanted(), "at least 80 %");
  EXPECT_EQ(target("median_difference_m").wanted(), "at most 6 m");
  EXPECT_EQ(target("satellites_used").wanted(), "within 1");
  EXPECT_EQ(target("horizontal_p50_m").wanted(), "0.8 to 1.25");
  const auto empty = targets(Figures{});
  EXPECT_TRUE(
      std::none_of(empty.begin(), empty.end(), [](const Target& t) { return t.value || t.reached(); }));
  EXPECT_EQ(empty[0].value_text(), "no value");
}

TEST(Base64, Rfc4648Vectors) {
  // RFC 4648, section 10.
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foo"), "Zm9v");
  EXPECT_EQ(base64("foob"), "Zm9vYg==");
  EXPECT_EQ(base64("fooba"), "Zm9vYmE=");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xFB\xFF\xFE"), "+//+");
}

}  // namespace
}  // namespace canyon::validation
