// Fields by the OEM7 Commands and Logs Reference Manual. The parsers of the ROS driver novatel_gps_driver and
// NovAtel's own decoder read whole files (docs/outputs.md), RTKLIB does in tests/integration.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <zlib.h>

#include <cmath>
#include <map>

#include "canyon/base/text.hpp"
#include "canyon/geodesy/constants.hpp"
#include "canyon/output/formats.hpp"
#include "tests/support/sample_epochs.hpp"
#include "tests/support/ubx_device.hpp"

namespace canyon::output::novatel_test {
namespace {

using test::ubx_epoch;
using ::testing::HasSubstr;
using ::testing::SizeIs;
using Logs = std::map<std::string, std::vector<std::string>>;

/// The fields behind the header, by name; those of the header as "NAME header".
Logs logs_of(const std::string& bytes) {
  Logs logs;
  for (std::string_view line : split(bytes, '\n')) {
    if (line.empty()) continue;
    EXPECT_EQ(line.front(), '#');
    EXPECT_EQ(line.back(), '\r');
    line = line.substr(1, line.size() - 2);
    const std::size_t star = line.rfind('*'), semicolon = line.find(';');
    const std::string text(line.substr(0, star));
    // zlib's CRC inverts at both ends.
    const auto crc =
        ~crc32(0xFFFFFFFF, reinterpret_cast<const Bytef*>(text.data()), static_cast<uInt>(text.size()));
    EXPECT_EQ(std::stoul(std::string(line.substr(star + 1)), nullptr, 16), crc & 0xFFFFFFFF) << line;
    const auto strings = [](std::string_view part) {
      std::vector<std::string> fields;
      for (const std::string_view field : split(part, ',')) fields.emplace_back(field);
      return fields;
    };
    const auto header = strings(std::string_view(text).substr(0, semicolon));
    logs[header.front()] = strings(std::string_view(text).substr(semicolon + 1));
    logs[header.front() + " header"] = header;
  }
  return logs;
}

std::unique_ptr<Encoder> device() {
  return format_named("novatel").make({.name = "rover", .begin = test::sample_time()});
}

TEST(Novatel, TellsTheFix) {
  auto e = ubx_epoch();
  e.geoid_undulation_m = 39.625;
  const Logs logs = logs_of(device()->encode(e));
  EXPECT_THAT(logs, SizeIs(2 * 5)) << "TIME, BESTPOS, BESTVEL, PSRDOP, RANGE";
  const auto& header = logs.at("BESTPOSA header");
  ASSERT_THAT(header, SizeIs(10));
  EXPECT_EQ(header[4], "FINESTEERING");
  EXPECT_EQ(header[5], "2051");
  EXPECT_EQ(header[6], "46701.125");
  const auto& p = logs.at("BESTPOSA");
  ASSERT_THAT(p, SizeIs(21));
  EXPECT_EQ(p[0] + " " + p[1], "SOL_COMPUTED SINGLE");
  const positioning::Fix& fix = e.observed.fix;
  EXPECT_NEAR(std::stod(p[2]), geodesy::degrees(fix.position.latitude_rad), 1e-11);
  EXPECT_NEAR(std::stod(p[3]), geodesy::degrees(fix.position.longitude_rad), 1e-11);
  EXPECT_NEAR(std::stod(p[4]), fix.position.height_m - 39.625, 1e-4);
  EXPECT_EQ(p[5], "39.6250");
  EXPECT_EQ(p[6], "WGS84");
  EXPECT_EQ(p[7] + " " + p[8] + " " + p[9], "1.5000 2.0000 3.0000") << "north, east, up";
  EXPECT_EQ(p[10], "\"\"");
  EXPECT_EQ(p[14], std::to_string(fix.used.size()));
  const auto& v = logs.at("BESTVELA");
  ASSERT_THAT(v, SizeIs(8));
  EXPECT_EQ(v[1], "DOPPLER_VELOCITY");
  EXPECT_NEAR(std::stod(v[4]), 5.2202, 1e-4);  // hypot(3.1, 4.2)
  EXPECT_NEAR(std::stod(v[5]), 143.569, 1e-3);
  EXPECT_EQ(v[6], "0.4000");
  const auto& t = logs.at("TIMEA");
  EXPECT_EQ(t[3], "-18.00000000000");
  EXPECT_EQ(t[4] + t[5] + t[6] + " " + t[7] + ":" + t[8] + " " + t[9], "2019428 12:58 3125");
}

TEST(Novatel, TellsEachKindOfFix) {
  using positioning::FixKind;
  const auto type = [](const simulation::Epoch& e) { return logs_of(device()->encode(e)).at("BESTPOSA")[1]; };
  EXPECT_EQ(type(test::corrected(ubx_epoch(), FixKind::Differential)), "PSRDIFF");
  EXPECT_EQ(type(test::corrected(ubx_epoch(), FixKind::Float)), "NARROW_FLOAT");
  EXPECT_EQ(type(test::corrected(ubx_epoch(), FixKind::Fixed)), "NARROW_INT");
  auto none = ubx_epoch();
  none.observed.fix.status = positioning::FixStatus::NoSignal;
  const Logs logs = logs_of(device()->encode(none));
  EXPECT_EQ(logs.at("BESTPOSA")[0] + " " + logs.at("BESTPOSA")[1], "INSUFFICIENT_OBS NONE");
  EXPECT_EQ(logs.at("BESTPOSA header")[4], "UNKNOWN") << "no fix has told the time yet";
  EXPECT_EQ(logs.at("BESTVELA")[1], "NONE");
}

TEST(Novatel, TellsTheHeadingOfTwoAntennas) {
  const auto e = test::with_baseline(ubx_epoch(), positioning::FixKind::Fixed, true);
  const auto h = logs_of(device()->encode(e)).at("HEADING2A");
  ASSERT_THAT(h, SizeIs(18));
  EXPECT_EQ(h[1], "NARROW_INT");
  EXPECT_NEAR(std::stod(h[2]), std::hypot(0.80456, 0.6012, 0.1234), 1e-4);
  EXPECT_NEAR(std::stod(h[3]), 360 - 36.7686, 1e-4);
  EXPECT_NEAR(std::stod(h[4]), -geodesy::degrees(std::asin(0.1234 / 1.01193)), 1e-3);
  const auto base = test::with_baseline(ubx_epoch(), positioning::FixKind::Fixed, false);
  EXPECT_EQ(logs_of(device()->encode(base)).count("HEADING2A"), 0U) << "a base far away tells no heading";
}

TEST(Novatel, ListsItsMeasurements) {
  const auto e = ubx_epoch();
  const auto r = logs_of(device()->encode(e)).at("RANGEA");
  const auto count = std::stoul(r[0]);
  // Measurements are those of the nearest whole millisecond of the receiver's clock.
  const auto beyond_ns = e.observed.receiver_time.nanoseconds() % 1'000'000;
  const double clock_m = static_cast<double>(beyond_ns) * 1e-9 * geodesy::kSpeedOfLight;
  ASSERT_EQ(r.size(), 1 + 10 * count);
  ASSERT_GT(count, 3U);
  for (std::size_t i = 0; i < count; ++i) {
    const auto field = [&](std::size_t k) { return r[1 + 10 * i + k]; };
    const auto status = std::stoul(field(9), nullptr, 16);
    const bool phase = (status >> 10 & 1) != 0;
    EXPECT_EQ(status & 31, phase ? 4U : 3U) << i;
    EXPECT_EQ(status >> 5 & 31, i) << "channel";
    EXPECT_EQ(phase, std::stod(field(4)) != 0) << i;
    const auto system = status >> 16 & 7;
    const int number = std::stoi(field(0));
    if (system == 1) {
      EXPECT_GE(number, 38);
      EXPECT_GE(std::stoi(field(1)), 0);
    } else {
      EXPECT_EQ(field(1), "0");
    }
    const gnss::System systems[]{gnss::System::GPS,     gnss::System::GLONASS, gnss::System::SBAS,
                                 gnss::System::Galileo, gnss::System::BeiDou,  gnss::System::QZSS};
    constexpr int kBehind[]{0, 37, 100, 0, 0, 192};  // the number of a satellite of each of these
    const gnss::SatelliteId id{systems[system], static_cast<std::uint8_t>(number - kBehind[system])};
    const auto seen = std::find_if(e.observed.satellites.begin(), e.observed.satellites.end(),
                                   [&](const auto& s) { return s.id == id; });
    ASSERT_NE(seen, e.observed.satellites.end()) << field(0);
    if ((status >> 27 & 1) == 0) continue;
    EXPECT_NEAR(std::stod(field(2)), seen->measurement->pseudorange_m - clock_m, 0.2) << field(0);
    EXPECT_NEAR(std::stod(field(7)), seen->measurement->cn0_dbhz.value_or(0), 0.05);
  }
}

/// The types of a binary body's fields: e an enumeration, d and f real numbers, L, H and B whole ones of 4, 2
/// and 1 bytes, W and X 4 and 1 bytes in hexadecimal, s a name of four characters. Of RANGE and PSRDOP the
/// part in brackets repeats.
struct Layout {
  std::string_view name;
  std::uint64_t number;
  std::string_view fields, repeated;
};
constexpr Layout kLayouts[]{{"TIMEA", 101, "edddLBBBBLe", ""},
                            {"BESTPOSA", 42, "eedddfefffsffBBBBBXXX", ""},
                            {"BESTVELA", 99, "eeffdddf", ""},
                            {"PSRDOPA", 174, "ffffffL", "L"},
                            {"HEADING2A", 1335, "eeffffffssBBBBBXXX", ""},
                            {"RANGEA", 43, "L", "HHdfdffffW"}};

std::size_t size_of(char field) {
  return field == 'd' ? 8 : field == 'H' ? 2 : field == 'B' || field == 'X' ? 1 : 4;
}

/// The text of a field, as near as `text` of the same field in ASCII has it.
void expect_field(char field, const std::string& bytes, const std::string& text, const std::string& where) {
  const test::Message m{0, bytes};
  const std::size_t point = text.find('.');
  const double half = point == std::string::npos ? 0 : 0.51 * std::pow(0.1, text.size() - point - 1.0);
  switch (field) {
    case 'd':
      EXPECT_NEAR(m.r8(0), std::stod(text), half) << where;
      return;
    case 'f':
      EXPECT_NEAR(m.r4(0), std::stod(text), half + 1e-6 * std::abs(std::stod(text))) << where;
      return;
    case 's':
      EXPECT_EQ('"' + std::string(bytes.c_str()) + '"', text) << where;
      return;
    case 'e':  // the same number for one name, but for VALID of a clock (0) and of UTC (1)
      EXPECT_EQ(m.u(0, 4), (std::map<std::string, std::uint64_t>{{"SOL_COMPUTED", 0},
                                                                 {"SINGLE", 16},
                                                                 {"NARROW_INT", 50},
                                                                 {"DOPPLER_VELOCITY", 8},
                                                                 {"WGS84", 61},
                                                                 {"VALID", where == "TIMEA 0" ? 0 : 1}})
                               .at(text))
          << where;
      return;
    default:
      EXPECT_EQ(m.u(0, bytes.size()), std::stoull(text, nullptr, field == 'W' || field == 'X' ? 16 : 10))
          << where;
  }
}

// Each log in both encodings, of one epoch.
TEST(Novatel, TellsTheSameInBinary) {
  auto e = test::with_baseline(ubx_epoch(), positioning::FixKind::Fixed, true);
  e.geoid_undulation_m = 39.625;
  const Logs ascii = logs_of(device()->encode(e));
  std::string bytes =
      format_named("novatel_binary").make({.name = "rover", .begin = test::sample_time()})->encode(e);
  for (const Layout& layout : kLayouts) {
    ASSERT_GE(bytes.size(), 28U);
    const test::Message header{0, bytes.substr(0, 28)};
    const std::size_t length = header.u(8, 2), whole = 28 + length;
    ASSERT_GE(bytes.size(), whole + 4);
    EXPECT_EQ(header.payload.substr(0, 4), "\xAA\x44\x12\x1C");
    EXPECT_EQ(header.u(4, 2), layout.number);
    const auto& told = ascii.at(std::string(layout.name) + " header");
    EXPECT_EQ(header.u(13, 1), 180U) << "FINESTEERING";
    EXPECT_EQ(std::to_string(header.u(14, 2)), told[5]);
    EXPECT_NEAR(static_cast<double>(header.u(16, 4)), std::stod(told[6]) * 1e3, 1e-3);
    const auto crc =
        ~crc32(0xFFFFFFFF, reinterpret_cast<const Bytef*>(bytes.data()), static_cast<uInt>(whole));
    EXPECT_EQ((test::Message{0, bytes.substr(whole, 4)}.u(0, 4)), crc & 0xFFFFFFFF) << layout.name;
    const auto& texts = ascii.at(std::string(layout.name));
    std::string fields(layout.fields);
    while (fields.size() < texts.size()) fields += layout.repeated;
    ASSERT_EQ(fields.size(), texts.size()) << layout.name;
    std::size_t at = 28;
    for (std::size_t i = 0; i < fields.size(); ++i) {
      const std::size_t size = size_of(fields[i]);
      expect_field(fields[i], bytes.substr(at, size), texts[i],
                   std::string(layout.name) + ' ' + std::to_string(i));
      at += size;
    }
    EXPECT_EQ(at, whole) << layout.name;
    bytes.erase(0, whole + 4);
  }
  EXPECT_EQ(bytes, "");
}

TEST(Novatel, MixesEncodings) {
  const auto receiver = device();
  EXPECT_EQ(receiver->receive(0, "log bestposb ontime 1\r\nlog timea ontime 1\r\n"),
            "\r\n<OK\r\n[COM1]\r\n<OK\r\n[COM1]");
  const std::string bytes = receiver->encode(ubx_epoch());
  const std::size_t binary = bytes.find('\xAA');
  EXPECT_EQ(bytes.size() - binary, 28U + 72 + 4);
  EXPECT_EQ(logs_of(bytes.substr(0, binary)).count("TIMEA"), 1U);
  (void)receiver->receive(0, "unlog bestposb\r\n");
  EXPECT_EQ(receiver->receive(0, "log bestpos ontime 1\r\n"), "\r\n<ERROR:Invalid Message ID\r\n[COM1]")
      << "abbreviated ASCII";
  (void)receiver->receive(0, "unlogall\r\n");
  EXPECT_EQ(receiver->encode(ubx_epoch()), "");
}

TEST(Novatel, LogsWhatIsAskedFor) {
  const auto receiver = device();
  EXPECT_EQ(receiver->receive(0, "unlogall thisport_all\r\n"), "\r\n<OK\r\n[COM1]");
  EXPECT_EQ(receiver->encode(ubx_epoch()), "");
  EXPECT_EQ(receiver->receive(0, "log bestposa ontime"), "");
  EXPECT_EQ(receiver->receive(0, " 0.5\r\n"), "\r\n<OK\r\n[COM1]") << "cut anywhere";
  EXPECT_EQ(receiver->receive(0, "LOG COM1 RANGEA ONNEW\r\n"), "\r\n<OK\r\n[COM1]");
  EXPECT_THAT(receiver->receive(0, "log raincoat ontime 1\r\n"), HasSubstr("<ERROR:Invalid Message ID"));
  for (const char* wrong : {"log timea ontime soon\r\n", "log timea ontime\r\n", "log timea ontime -1\r\n",
                            "log timea ontime nan\r\n"}) {
    EXPECT_THAT(receiver->receive(0, wrong), HasSubstr("<ERROR:Invalid Message Field")) << wrong;
  }
  EXPECT_EQ(receiver->receive(0, "\xD3\x00\x13\x3E\xD0\n"), "") << "RTCM 3";
  EXPECT_EQ(receiver->receive(0, std::string(5000, 'x') + "\n"), "") << "longer than a command";
  int positions = 0, measurements = 0;
  auto e = ubx_epoch();
  for (int i = 0; i < 20; ++i) {
    e.observed.time = e.observed.receiver_time = test::sample_time() + 1 + 0.1 * i;
    const Logs logs = logs_of(receiver->encode(e));
    positions += static_cast<int>(logs.count("BESTPOSA"));
    measurements += static_cast<int>(logs.count("RANGEA"));
    EXPECT_EQ(logs.count("TIMEA"), 0U);
  }
  EXPECT_EQ(positions, 4);
  EXPECT_EQ(measurements, 20);
  EXPECT_FALSE(receiver->take_restart());
  (void)receiver->receive(0, "freset\r\n");
  EXPECT_EQ(receiver->take_restart(), disturbance::RestartKind::Cold);
}

// The first LOG of a program replaces what is sent from the start.
TEST(Novatel, SendsAllUntilItIsTold) {
  const auto receiver = device();
  (void)receiver->receive(0, "log bestvela ontime 0.1\r\n");
  const Logs logs = logs_of(receiver->encode(ubx_epoch()));
  EXPECT_EQ(logs.count("BESTVELA"), 1U);
  EXPECT_EQ(logs.count("BESTPOSA"), 0U);
}

}  // namespace
}  // namespace canyon::output::novatel_test
