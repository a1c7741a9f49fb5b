#include "canyon/output/stream.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>

#include "canyon/base/input_error.hpp"
#include "canyon/output/nmea.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/local_connection.hpp"
#include "tests/support/sample_epochs.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::output {
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
    EXPECT_THAT(error_of([&] { (void)parse_stream(text); }).cure(), HasSubstr("FORMAT=ADDRESS")) << text;
  }
}

TEST(Stream, RefusesFormatsThatItDoesNotKnowOrThatWaitForTheEnd) {
  const auto open = [](const char* text) { (void)open_stream(parse_stream(text), 0, {}); };
  const InputError unknown = error_of([&] { open("nmae=pty:"); });
  EXPECT_THAT(unknown.problem(), HasSubstr("no output format 'nmae'"));
  EXPECT_THAT(unknown.cure(), HasSubstr("did you mean 'nmea'"));
  const InputError late = error_of([&] { open("kml=pty:"); });
  EXPECT_THAT(late.problem(), HasSubstr("whole only at the end of a run"));
  EXPECT_THAT(late.cure(), HasSubstr("kml=file:track.kml"));
}

TEST(Stream, EveryFormatHasAFileNameOfItsOwnAndStreamsToAFile) {
  const test::TemporaryFolder folder;
  std::set<std::string_view> names, files;
  for (const Format& format : formats()) {
    EXPECT_TRUE(names.insert(format.name).second) << format.name;
    EXPECT_TRUE(files.insert(format.file).second) << format.file;
    EXPECT_EQ(&format_named(format.name), &format);
    const auto stream = open_file(format.name, folder / std::string(format.file), 0, {"rover"});
    stream->write(test::sample_epoch(test::sample_time(), test::sample_place(), {1, 2, 3}));
    stream->finish();
    EXPECT_NE(test::read_bytes(folder / std::string(format.file)), "") << format.name;
  }
}

TEST(Stream, TakesOneReceiversEpochsToATcpClient) {
  const int port = test::free_port();
  const auto stream = open_stream(parse_stream("nmea=tcp://127.0.0.1:" + std::to_string(port)), 1, {});
  test::LocalConnection client(port);
  stream->serve();
  simulation::Epoch epoch = test::sample_epoch(test::sample_time(), test::sample_place(), {1, 2, 3});
  stream->write(epoch);  // of receiver 0
  epoch.receiver = 1;
  epoch.observed.time = epoch.observed.time + 1;
  stream->write(epoch);
  stream->finish();
  const std::string expected = nmea_epoch(epoch);
  EXPECT_EQ(client.read(expected.size() + 1), expected);
}

TEST(RealTimePacer, TakesAsMuchTimeAsTheEpochsAndNoMoreWhereStopped) {
  using Clock = std::chrono::steady_clock;
  simulation::Epoch epoch = test::sample_epoch(test::sample_time(), test::sample_place(), {1, 2, 3});
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
}  // namespace canyon::output
