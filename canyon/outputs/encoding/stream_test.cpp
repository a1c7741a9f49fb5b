#include "canyon/outputs/encoding/stream.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fmt/format.h>
#include <chrono>

#include "canyon/base/input_error.hpp"
#include "canyon/outputs/encoding/device.hpp"
#include "canyon/outputs/encoding/nmea.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/local_connection.hpp"
#include "tests/support/sample_epochs.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::encoding::stream_test {
namespace {

using ::testing::HasSubstr;

template <class Action>
InputError error_of(Action action) {
  try {
    action();
  } catch (const InputError& error) {
    return error;
  }
  ADD_FAILURE() << "nothing was thrown";
  return InputError("nothing", "");
}

TEST(Stream, ReadsRequests) {
  const StreamRequest one = parse_stream("nmea=tcp://127.0.0.1:2947");
  EXPECT_EQ(one.receiver, "");
  EXPECT_EQ(one.format, "nmea");
  EXPECT_EQ(one.address, "tcp://127.0.0.1:2947");
  const StreamRequest other = parse_stream("left/rover/epochs_csv=file:a=b/c");
  EXPECT_EQ(other.receiver, "left/rover");
  EXPECT_EQ(other.format, "epochs_csv");
  EXPECT_EQ(other.address, "file:a=b/c");
  for (const char* text : {"", "nmea", "nmea=", "=pty:", "rover/=pty:"}) {
    EXPECT_THAT(error_of([&] { (void)parse_stream(text); }).hint(), HasSubstr("FORMAT=ADDRESS")) << text;
  }
}

TEST(Stream, RefusesFormatsThatItDoesNotKnowOrThatWaitForTheEnd) {
  const auto open = [](const char* text) { (void)open_stream(parse_stream(text), 0, {}); };
  const InputError unknown = error_of([&] { open("nmae=pty:"); });
  EXPECT_THAT(unknown.problem(), HasSubstr("no output format 'nmae'"));
  EXPECT_THAT(unknown.hint(), HasSubstr("did you mean 'nmea'"));
  const InputError late = error_of([&] { open("kml=pty:"); });
  EXPECT_THAT(late.problem(), HasSubstr("complete only at the end of a run"));
  EXPECT_THAT(late.hint(), HasSubstr("kml=file:track.kml"));
  EXPECT_EQ(parse_stream("ubx=pty:?generation=x20").options.generation, simulation::UbxGeneration::X20);
  EXPECT_THAT(error_of([&] { open("ubx_m8=pty:"); }).hint(), HasSubstr("ubx=ADDRESS?generation=m8"));
}

TEST(Stream, SendsAllSamplesOfSensorsOrNone) {
  ReceiverDescription car{"car"};
  const StreamRequest some = parse_stream("highres_imu=pty:?rate_hz=1");
  EXPECT_THAT(error_of([&] { (void)open_stream(some, 0, car); }).problem(), HasSubstr("no sensor samples"));
  car.sensors.imu.emplace();
  EXPECT_THAT(error_of([&] { (void)open_stream(some, 0, car); }).problem(),
              HasSubstr("rate_hz would leave out"));
}

TEST(Stream, EveryFormatHasAFileNameOfItsOwnAndStreamsToAFile) {
  const test::TemporaryFolder folder;
  std::set<std::string_view> names, files;
  ReceiverDescription rover{"rover"};
  rover.sensors.imu.emplace();
  for (const Format& format : formats()) {
    EXPECT_TRUE(names.insert(format.name).second) << format.name;
    EXPECT_TRUE(files.insert(format.file).second) << format.file;
    EXPECT_EQ(&format_named(format.name), &format);
    const auto stream = open_file(format.name, folder / std::string(format.file), 0, rover);
    stream->write(test::sample_epoch(test::sample_time(), test::sample_point(), {1, 2, 3}));
    stream->finish();
    EXPECT_NE(test::read_bytes(folder / std::string(format.file)), "") << format.name;
  }
}

TEST(Stream, TakesOneReceiversEpochsToATcpClient) {
  const int port = test::free_port();
  const auto stream = open_stream(parse_stream("nmea=tcp://127.0.0.1:" + std::to_string(port)), 1, {});
  test::LocalConnection client(port);
  stream->serve();
  simulation::Epoch epoch = test::sample_epoch(test::sample_time(), test::sample_point(), {1, 2, 3});
  stream->write(epoch);  // of receiver 0
  epoch.receiver = 1;
  epoch.observed.time = epoch.observed.time + 1;
  stream->write(epoch);
  stream->finish();
  const std::string expected = nmea_epoch(epoch);
  EXPECT_EQ(client.read(expected.size() + 1), expected);
}

TEST(Stream, TellsAnNtripCasterWhatItSends) {
  const int port = test::free_port();
  ReceiverDescription description{"base"};
  description.systems = {gnss::System::GPS, gnss::System::Galileo};
  description.station_ecef = geodesy::ecef_from_geodetic(geodesy::Geodetic::from_degrees(-22.3, 114.17, 5));
  const auto stream = open_stream(
      parse_stream("base/rtcm=ntrip-caster://127.0.0.1:" + std::to_string(port) + "/BASE"), 0, description);
  test::LocalConnection client(port);
  client.send_text("GET / HTTP/1.0\r\n\r\n");
  for (int step = 0; step < 3; ++step) stream->serve();  // it is accepted, gets a response and the end
  EXPECT_THAT(client.read(10'000), HasSubstr("\r\nSTR;BASE;base;RTCM 3.3;;;GPS+Galileo;;;-22.30;114.17;"));
  const auto open = [] { (void)open_stream(parse_stream("rtcm=ntrip://a:secret@127.0.0.1:1/C"), 0, {}); };
  const InputError sent = error_of(open);
  EXPECT_THAT(sent.problem(), HasSubstr("nothing can be sent to 'ntrip://a:...@127.0.0.1:1/C'"));
  EXPECT_THAT(sent.hint(), HasSubstr("ntrip-source://"));
}

TEST(Stream, RefusesVirtualStationsThatNobodyCanPlace) {
  ReceiverDescription base{"base"};
  const auto problem = [&](const char* text) {
    return error_of([&] { (void)open_stream(parse_stream(text), 0, base); }).problem();
  };
  EXPECT_THAT(problem("rtcm=pty:?virtual_station=true"), HasSubstr("'base' moves"));
  base.station_ecef = geodesy::ecef_from_geodetic(geodesy::Geodetic::from_degrees(22.3, 114.17, 5));
  EXPECT_THAT(problem("nmea=pty:?virtual_station=true"), HasSubstr("nmea has no corrections"));
  EXPECT_THAT(problem("rtcm=file:a?virtual_station=true"), HasSubstr("no client can report"));
}

/// Returns the received bytes.
class Echo final : public Encoder, public Device {
  std::string encode(const simulation::Epoch&) override { return "e"; }
  Device* device() override { return this; }
  std::string receive(std::uint64_t, std::string_view bytes) override {
    return "<" + std::string(bytes) + ">";
  }
  std::optional<std::string> encode_for_reader(std::uint64_t) override { return {}; }
  std::vector<std::shared_ptr<const rtk::Corrections>> take_corrections() override { return {}; }
};

/// Stores its input.
class Memory final : public transport::Transport {
 public:
  explicit Memory(std::string& bytes) : bytes_(bytes) {}
  void send(std::string_view bytes) override { bytes_ += bytes; }
  std::vector<transport::Received> take_received() override { return std::exchange(received, {}); }
  void finish(const std::optional<transport::Correction>&) override { bytes_ += "."; }
  std::vector<transport::Received> received;

 private:
  std::string& bytes_;
};

struct Recorded {
  std::string bytes;
  Memory* transport = nullptr;
  std::shared_ptr<transport::Link> link;
  Recorded() {
    auto memory = std::make_unique<Memory>(bytes);
    transport = memory.get();
    link = std::make_shared<transport::Link>(std::move(memory));
  }
};

simulation::Epoch epoch_at(double seconds) {
  simulation::Epoch epoch = test::sample_epoch(test::sample_time(), test::sample_point(), {1, 2, 3});
  epoch.observed.time = epoch.observed.time + seconds;
  return epoch;
}

TEST(Stream, SendsTheEpochsOfItsOwnRate) {
  Recorded to;
  EncodedStream stream(std::make_unique<Echo>(), to.link, 0, {4, 0, 0, {}});
  for (int i = 0; i <= 20; ++i) stream.write(epoch_at(0.1 * i));  // 10 Hz: 0, 0.3, 0.5, 0.8, 1.0, ...
  EXPECT_EQ(to.bytes, std::string(9, 'e'));
}

TEST(Stream, LateEpochsWaitAndKeepTheirOrder) {
  Recorded to;
  EncodedStream stream(std::make_unique<Echo>(), to.link, 0, {{}, 0.1, 0.05, {}});
  const auto begin = EncodedStream::Clock::now();
  for (int i = 0; i < 3; ++i) stream.write(epoch_at(i));
  EXPECT_EQ(to.bytes, "");
  ASSERT_TRUE(stream.next_due());
  while (to.bytes.size() < 3 && EncodedStream::Clock::now() < begin + std::chrono::seconds(20))
    stream.serve();
  // Three samples around 0.1 s: all below 5 standard deviations.
  EXPECT_LT(EncodedStream::Clock::now() - begin, std::chrono::seconds(20));
  EXPECT_FALSE(stream.next_due());
  stream.write(epoch_at(4));
  stream.finish();
  EXPECT_EQ(to.bytes, "eeee.");
}

// Bytes of ten bits at 10 baud: one per second, epochs one after the other, by the given clock.
TEST(Stream, ASlowLinkPassesAnEpochPieceByPiece) {
  Recorded to;
  auto now = EncodedStream::Clock::time_point{};
  StreamOptions options;
  options.latency_s = 0.5;
  options.link_baud = 10;
  EncodedStream stream(std::make_unique<Echo>(), to.link, 0, options, {}, [&] { return now; });
  for (int i = 0; i < 3; ++i) stream.write(epoch_at(i));
  const auto bytes_at = [&](double seconds) {
    now = EncodedStream::Clock::time_point{} +
          std::chrono::duration_cast<EncodedStream::Clock::duration>(std::chrono::duration<double>(seconds));
    stream.serve();
    return to.bytes.size();
  };
  EXPECT_EQ(bytes_at(1.4), 0U);
  EXPECT_EQ(bytes_at(1.6), 1U);
  EXPECT_EQ(bytes_at(2.6), 2U);
  EXPECT_EQ(bytes_at(3.4), 2U);
  EXPECT_EQ(bytes_at(3.6), 3U);
}

// One client's commands do not change the other client's bytes, and are reported.
TEST(Stream, AClientSetsWhatItAloneGets) {
  const int port = test::free_port();
  const auto link = std::make_shared<transport::Link>(fmt::format("tcp://127.0.0.1:{}", port));
  const auto stream = open_stream({{}, "sbf", {}, {}}, 0, {"rover"}, link);
  test::LocalConnection quiet(port), talker(port);
  double seconds = 0;
  const auto write = [&] { stream->write(epoch_at(++seconds)); };
  const auto logged = [&](const std::string& text) {
    talker.send_text(text);
    std::string response;
    while (!response.ends_with("COM1>")) {
      stream->serve();
      response += talker.read_some();
    }
    return response;
  };
  (void)logged("\n");
  write();
  const std::string whole = quiet.read_some();
  EXPECT_EQ(talker.read_some(), whole);
  (void)logged("S\n\n");
  EXPECT_THAT(link->take_notes(), testing::IsEmpty());
  write();
  EXPECT_EQ(talker.read_some().size(), whole.size()) << "S is no command";
  (void)logged("SSSSSSSSSS\n");
  EXPECT_THAT(link->take_notes(), testing::ElementsAre("client 2 configured its own output: SSSSSSSSSS"));
  write();
  (void)logged("sso, Stream1, COM1, DOP, OnChange\n");
  seconds += 2;
  write();
  EXPECT_THAT(talker.read_some(), HasSubstr("$@")) << "the DOP block alone";
  EXPECT_THAT(link->take_notes(), testing::IsEmpty()) << "told once";
  std::string rest;
  while (rest.size() < 3 * whole.size()) rest += quiet.read_some();
  EXPECT_EQ(rest.size(), 3 * whole.size()) << "whose client said nothing";
}

TEST(Stream, AnswersAndSharesALinkWithOthers) {
  Recorded to;
  std::string poses;
  const int listener = to.link->listen([&](const transport::Received& received) { poses += received.bytes; });
  {
    EncodedStream a(std::make_unique<Echo>(), to.link, 0), b(std::make_unique<Echo>(), to.link, 1);
    to.transport->received.push_back({7, "hi"});
    a.serve();
    EXPECT_EQ(to.bytes, "<hi><hi>");
    EXPECT_EQ(poses, "hi");
    a.finish();
    b.finish();
  }
  EXPECT_EQ(to.bytes, "<hi><hi>");  // the third user of the link continues
  to.link->finish(listener, {});
  EXPECT_EQ(to.bytes, "<hi><hi>.");
}

TEST(Stream, ReadsOptionsBehindTheAddress) {
  const StreamRequest request = parse_stream("rover/nmea=tcp://127.0.0.1:2947?rate_hz=5&latency_s=0.1");
  EXPECT_EQ(request.address, "tcp://127.0.0.1:2947");
  EXPECT_EQ(request.options.rate_hz, 5);
  EXPECT_EQ(request.options.latency_s, 0.1);
  EXPECT_EQ(parse_stream("nmea=file:what?.txt").address, "file:what?.txt");
  EXPECT_THAT(error_of([] { (void)parse_stream("nmea=pty:?rate=5"); }).problem(), HasSubstr("rate"));
  EXPECT_THAT(error_of([] { (void)parse_stream("nmea=pty:?latency_s=99"); }).problem(),
              HasSubstr("latency_s"));
}

TEST(RealTimePacer, TakesAsMuchTimeAsTheEpochsAndNoMoreWhereStopped) {
  using Clock = std::chrono::steady_clock;
  simulation::Epoch epoch = test::sample_epoch(test::sample_time(), test::sample_point(), {1, 2, 3});
  int served = 0;
  std::atomic<bool> stop{false};
  RealTimePacer pacer(&stop, [&] { ++served; });
  const auto begin = Clock::now();
  pacer.write(epoch);
  EXPECT_EQ(served, 0);  // the first one does not wait
  epoch.truth.time = epoch.truth.time + 0.12;
  pacer.write(epoch);
  EXPECT_GE(Clock::now() - begin, std::chrono::milliseconds(120));
  EXPECT_GE(served, 1);
  stop = true;
  epoch.truth.time = epoch.truth.time + 1e6;  // the test's time limit would end this
  pacer.write(epoch);
}

}  // namespace
}  // namespace canyon::encoding::stream_test
