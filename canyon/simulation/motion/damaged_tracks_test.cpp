#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text_file.hpp"
#include "canyon/geodesy/time_scales.hpp"
#include "canyon/simulation/motion/trajectory.hpp"
#include "tests/support/damages.hpp"
#include "tests/support/shared_data.hpp"
#include "tests/support/simulation_support.hpp"

// Small files of each format with a byte left out or a line doubled: they give the same path, a warning, an
// error, or a path within noise.
namespace canyon::simulation::damaged_tracks_test {
namespace {

using canyon::test::Damages;
using canyon::test::Outcome;
using geodesy::GpsTime;
using test::TemporaryFolder;

constexpr double kNoise_m = 30;  // recorded_path.hpp: a first or last point off by 30 m may stay
const GpsTime kStart = geodesy::parse_time("2024-05-01T10:00:10Z");

std::string with_checksum(const std::string& body) {
  unsigned sum = 0;
  for (const char c : body) sum ^= static_cast<unsigned char>(c);
  return fmt::format("${}*{:02X}\n", body, sum);
}

std::string file_of(const std::string& format, int count) {
  std::string text;
  for (int i = 0; i < count; ++i) {
    const double latitude = 48.13714 + 1.1e-4 * i, longitude = 11.57537 + 0.7e-4 * i,
                 height = 565.4 + 0.3 * i;
    const std::string time = fmt::format("2024-05-01T10:00:{}Z", 10 + i);
    if (format == "csv") {
      text += fmt::format("{},{:.6f},{:.6f},{:.2f}\n", time, latitude, longitude, height);
    } else if (format == "urbannav") {
      text += fmt::format("2312,{},{:.8f},{:.8f},{:.3f}\n", 295228 + i, latitude, longitude, height);
    } else if (format == "gpx") {
      text += fmt::format("<trkpt lat=\"{:.6f}\" lon=\"{:.6f}\"><ele>{:.1f}</ele><time>{}</time></trkpt>\n",
                          latitude, longitude, height, time);
    } else if (format == "kml") {
      text += fmt::format("<when>{}</when>\n<gx:coord>{:.6f} {:.6f} {:.1f}</gx:coord>\n", time, longitude,
                          latitude, height);
    } else if (format == "gnsslogger") {
      text += fmt::format("Fix,GPS,{:.6f},{:.6f},{:.2f},14.5,3.0,32.6,{}\n", latitude, longitude, height,
                          1714557610000 + 1000LL * i);
    } else {
      text +=
          with_checksum(fmt::format("GNGGA,1000{}.00,4808.{:05d},N,01134.{:05d},E,1,12,0.8,{:.1f},M,45.6,M,,",
                                    10 + i, 22840 + 660 * i, 52220 + 420 * i, height - 45.6));
      text += with_checksum(
          fmt::format("GNRMC,1000{}.00,A,4808.22840,N,01134.52220,E,21.1,32.6,010524,,,A", 10 + i));
    }
  }
  if (format == "csv") return "time,latitude,longitude,height\n" + text;
  if (format == "gnsslogger") {
    return "# Fix,Provider,LatitudeDegrees,LongitudeDegrees,AltitudeMeters,SpeedMps,AccuracyMeters,"
           "BearingDegrees,UnixTimeMillis\n" +
           text;
  }
  if (format == "gpx") return "<gpx version=\"1.1\"><trk><trkseg>\n" + text + "</trkseg></trk></gpx>\n";
  if (format == "kml")
    return "<kml><gx:Track><altitudeMode>absolute</altitudeMode>\n" + text + "</gx:Track></kml>\n";
  return text;
}

class DamagedTrack {
 public:
  explicit DamagedTrack(const std::string& format) : DamagedTrack(format, format, file_of(format, 12)) {}
  DamagedTrack(std::string name, std::string format, std::string text)
      : name_(std::move(name)), format_(std::move(format)), text_(std::move(text)), sound_(read(text_)) {}

  /// @param every how many bytes lie between those that are left out in turn
  canyon::test::DamageCounts run(std::size_t every) {
    return Damages(name_, text_, every).run([this](const std::string& text) { return judge(text); });
  }

 private:
  [[nodiscard]] Damages::Judgement judge(const std::string& text) const {
    const TrajectoryFile file = read(text);
    const double off_m = difference_m(file);
    if (off_m < 1e-6) return {Outcome::Same, {}};
    if (file.warnings.size() > sound_.warnings.size()) return {Outcome::Said, {}};
    if (off_m < kNoise_m) return {Outcome::Noise, {}};
    return {Outcome::Same, fmt::format("{:.0f} m", off_m)};
  }
  [[nodiscard]] TrajectoryFile read(const std::string& text) const {
    return read_trajectory_file(folder_.write("track", text), format_, kStart);
  }
  /// The largest at the sound file's instants; a path that begins or ends elsewhere is off by its way.
  [[nodiscard]] double difference_m(const TrajectoryFile& file) const {
    double off_m = 0;
    const Trajectory& sound = sound_.trajectory;
    const auto place = [](const Trajectory& t, GpsTime at) {
      return geodesy::ecef_from_geodetic(t.at(at).position);
    };
    for (double t = 0; t < 12; t += 1) {
      const GpsTime at = sound.begin() + t;
      off_m = std::max(off_m, (place(file.trajectory, at) - place(sound, at)).norm());
    }
    return std::max({off_m, 15 * std::abs(file.trajectory.begin() - sound.begin()),
                     15 * std::abs(file.trajectory.end() - sound.end())});
  }

  TemporaryFolder folder_;
  std::string name_, format_, text_;
  TrajectoryFile sound_;
};

TEST(DamagedTracks, NoneMovesSilently) {
  constexpr std::size_t kEvery = 3;
  for (const std::string& format : trajectory_formats()) {
    const canyon::test::DamageCounts counts = DamagedTrack(format).run(kEvery);
    EXPECT_EQ(counts.silent.size(), 0U) << testing::PrintToString(counts.silent);
    EXPECT_GT(counts.said, 10) << format;
  }
}

/// The first lines of a recorded file.
std::string head_of(const std::filesystem::path& path, int lines) {
  TextFile file = TextFile::streamed(path);
  std::string text;
  for (int i = 0; i < lines; ++i)
    if (const auto line = file.next_line()) text += std::string(*line) + "\n";
  return text;
}

void check_recorded(const std::filesystem::path& path, const std::string& format, int lines) {
  const canyon::test::DamageCounts counts =
      DamagedTrack(path.filename().string(), format, head_of(path, lines)).run(11);
  EXPECT_EQ(counts.silent.size(), 0U) << testing::PrintToString(counts.silent);
}

TEST(DamagedTracks, RecordedUrbanNav2019) {
  CANYON_SHARED_DATA(path, "urbannav-tst-20190428/groundTruth_TST.csv");
  check_recorded(path, "urbannav", 20);
}
TEST(DamagedTracks, RecordedUrbanNav2021) {
  CANYON_SHARED_DATA(path, "urbannav-tst-20210517/UrbanNav_TST_GT.txt");
  check_recorded(path, "urbannav", 20);
}
TEST(DamagedTracks, RecordedBerlin) {
  CANYON_SHARED_DATA(path, "berlin-potsdamer-platz/truth.csv");
  check_recorded(path, "urbannav", 40);
}
TEST(DamagedTracks, RecordedRtklib) {
  CANYON_SHARED_DATA(path, "ubx-longmont-20250828/gnss_1730_sf.pos");
  check_recorded(path, "csv", 70);
}

}  // namespace
}  // namespace canyon::simulation::damaged_tracks_test
