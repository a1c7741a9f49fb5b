#include "canyon/base/transport/ntrip.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <poll.h>

#include <atomic>
#include <chrono>
#include <functional>
#include <future>

#include "canyon/base/input_error.hpp"
#include "canyon/base/payload.hpp"
#include "canyon/base/transport/devices.hpp"
#include "tests/support/child_process.hpp"
#include "tests/support/free_port.hpp"
#include "tests/support/local_connection.hpp"
#include "tests/support/program.hpp"
#include "tests/support/temporary_folder.hpp"

namespace canyon::transport {
namespace {

using canyon::test::free_port;
using test::LocalConnection;
using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::Not;
using ::testing::StartsWith;
using State = NtripClient::State;
using Clock = std::chrono::steady_clock;

const std::string kBase = "BASE";
const std::string kGga = "$GPGGA,120000.00,2218.0,N,11410.2,E,1,08,1.0,5.0,M,0.0,M,,*6A\r\n";

std::string address(const char* scheme, int port, const std::string& mount, const char* secret = "rover:pw") {
  return std::string(scheme) + "://" + secret + (*secret == 0 ? "" : "@") +
         "127.0.0.1:" + std::to_string(port) + "/" + mount;
}

/// Serves `served` until `holds`, for 20 s at most.
bool serve_until(Transport& served, const std::function<bool()>& holds) {
  const auto deadline = Clock::now() + std::chrono::seconds(20);
  for (served.serve(); !holds(); served.serve()) {
    if (Clock::now() > deadline) return false;
    std::vector<int> handles;
    served.add_handles(handles);
    std::vector<pollfd> polled;
    for (const int handle : handles) polled.push_back({handle, POLLIN, 0});
    poll(polled.data(), polled.size(), 2);
  }
  return true;
}

/// The bytes that a transport receives from all peers, until there are `size`.
std::string take(Transport& served, std::size_t size) {
  std::string bytes;
  serve_until(served, [&] {
    for (const Received& received : served.take_received()) bytes += received.bytes;
    return bytes.size() >= size;
  });
  return bytes;
}

/// The bytes that a client reads while the other end is served, up to `size` or the end.
std::string read_while_serving(Transport& served, LocalConnection& client, std::size_t size) {
  auto reader = std::async(std::launch::async, [&] { return client.read(size); });
  while (reader.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready) served.serve();
  return reader.get();
}

std::string authorization(const std::string& secret) {
  return "Authorization: Basic " + base64(secret) + "\r\n";
}
std::string first_revision(const std::string& mount, const std::string& secret) {
  return "GET /" + mount + " HTTP/1.0\r\nUser-Agent: NTRIP test\r\n" + authorization(secret) + "\r\n";
}
std::string second_revision(const std::string& mount, const std::string& secret) {
  return "GET /" + mount + " HTTP/1.1\r\nHost: x\r\nntrip-version: NTRIP/2.0\r\nUser-Agent: NTRIP test\r\n" +
         authorization(secret) + "\r\n";
}

/// The complete response of a caster to a request that it rejects.
std::string refusal(Transport& caster, int port, const std::string& request) {
  LocalConnection client(port);
  client.send_text(request);
  return read_while_serving(caster, client, 100'000);
}

/// A connection that a caster streams to.
LocalConnection connected(Transport& caster, int port, const std::string& request, const char* first_line) {
  LocalConnection client(port);
  client.send_text(request);
  const std::string start = read_while_serving(caster, client, std::string(first_line).size());
  EXPECT_EQ(start, first_line);
  if (start[0] == 'H') {
    std::string head;
    while (head.find("\r\n\r\n") == std::string::npos && head.size() < 1000) head += client.read(1);
    EXPECT_THAT(head,
                AllOf(HasSubstr("Ntrip-Version: Ntrip/2.0\r\n"), HasSubstr("Content-Type: gnss/data\r\n"),
                      HasSubstr("Transfer-Encoding: chunked\r\n")));
  }
  return client;
}

constexpr const char* kFirstGrants = "ICY 200 OK\r\n";
constexpr const char* kSecondGrants = "HTTP/1.1 200 OK\r\n";

TEST(NtripCaster, SendsToClientsOfBothRevisions) {
  const int port = free_port();
  const auto caster = open_transport(address("ntrip-caster", port, kBase));
  caster->begin("head ");
  LocalConnection old = connected(*caster, port, first_revision(kBase, "rover:pw"), kFirstGrants);
  LocalConnection now = connected(*caster, port, second_revision(kBase, "rover:pw"), kSecondGrants);
  caster->send(std::string(16, 'x'));
  caster->send("");  // an empty chunk would end the stream
  EXPECT_EQ(old.read(21), "head " + std::string(16, 'x'));
  EXPECT_EQ(now.read(32), "5\r\nhead \r\n10\r\n" + std::string(16, 'x') + "\r\n");
  caster->finish({});
  EXPECT_EQ(now.read(100), "0\r\n\r\n");
  EXPECT_EQ(old.read(100), "");
  EXPECT_THAT(caster->take_notes(), IsEmpty());
}

TEST(NtripCaster, TakesLinesThatEndWithLfAlone) {
  const auto lf = [](std::string request) {
    std::erase(request, '\r');
    return request;
  };
  const int port = free_port();
  const auto caster = open_transport(address("ntrip-caster", port, kBase));
  LocalConnection old = connected(*caster, port, lf(first_revision(kBase, "rover:pw")) + kGga, kFirstGrants);
  LocalConnection now = connected(*caster, port, lf(second_revision(kBase, "rover:pw")), kSecondGrants);
  EXPECT_EQ(take(*caster, kGga.size()), kGga);
  caster->send("x");
  EXPECT_EQ(old.read(1), "x");
  EXPECT_EQ(now.read(6), "1\r\nx\r\n");
  EXPECT_THAT(refusal(*caster, port, lf(second_revision("ELSE", "rover:pw"))), StartsWith("HTTP/1.1 404 "));
}

// RFC 7235, section 2.1: the scheme is case-insensitive.
TEST(NtripCaster, TakesTheSchemeInAnyCase) {
  const int port = free_port();
  const auto caster = open_transport(address("ntrip-caster", port, kBase));
  for (const char* scheme : {"basic", "BASIC  "}) {
    std::string request = first_revision(kBase, "rover:pw");
    request.replace(request.find("Basic"), 5, scheme);
    (void)connected(*caster, port, request, kFirstGrants);
  }
  std::string other = first_revision(kBase, "rover:pw");
  other.replace(other.find("Basic"), 5, "Bearer");
  EXPECT_EQ(refusal(*caster, port, other), "ERROR - Bad Password\r\n");
}

TEST(NtripCaster, RefusesAsEachRevisionDoes) {
  const int port = free_port();
  const auto caster = open_transport(address("ntrip-caster", port, kBase));
  EXPECT_EQ(refusal(*caster, port, first_revision(kBase, "rover:no")), "ERROR - Bad Password\r\n");
  EXPECT_THAT(refusal(*caster, port, second_revision(kBase, "rover:no")),
              AllOf(StartsWith("HTTP/1.1 401 "), HasSubstr("WWW-Authenticate: Basic realm=\"/BASE\"\r\n")));
  EXPECT_THAT(refusal(*caster, port, second_revision("ELSE", "rover:pw")), StartsWith("HTTP/1.1 404 "));
  EXPECT_THAT(refusal(*caster, port, first_revision("ELSE", "rover:pw")),
              AllOf(StartsWith("SOURCETABLE 200 OK\r\n"), EndsWith("ENDSOURCETABLE\r\n")));
  for (const std::string& nonsense :
       {std::string("POST /BASE HTTP/1.1\r\n\r\n"), std::string("SOURCE pw /BASE\r\n\r\n"),
        std::string("\x16\x03\x01\r\n\r\n"), std::string(20'000, 'x')}) {
    EXPECT_THAT(refusal(*caster, port, nonsense), StartsWith("HTTP/1.1 400 "));
  }
}

TEST(NtripCaster, SourceTableHasAllMountPointsOfAPort) {
  const int port = free_port();
  const auto base = open_transport(address("ntrip-caster", port, kBase));
  const auto open = open_transport(address("ntrip-caster", port, "OPEN-2", ""));
  base->describe({"roof; of the base", "RTCM 3.3", "GPS+Galileo", 22.3, 114.17});
  const std::string table =
      "STR;BASE;roof  of the base;RTCM 3.3;;;GPS+Galileo;;;22.30;114.17;0;0;Canyon;none;B;N;;\r\n"
      "STR;OPEN-2;;;;;;;;0.00;0.00;0;0;Canyon;none;N;N;;\r\nENDSOURCETABLE\r\n";
  const std::string length = "Content-Length: " + std::to_string(table.size()) + "\r\n";
  EXPECT_THAT(refusal(*base, port, first_revision("", ":")),
              AllOf(StartsWith("SOURCETABLE 200 OK\r\n"), HasSubstr(length), EndsWith("\r\n\r\n" + table)));
  EXPECT_THAT(refusal(*open, port, second_revision("", ":")),
              AllOf(StartsWith("HTTP/1.1 200 OK\r\n"), HasSubstr("Content-Type: gnss/sourcetable\r\n"),
                    HasSubstr(length), EndsWith("\r\n\r\n" + table)));

  // Each has its own clients and password, and ends independently.
  LocalConnection base_measurements = connected(*base, port, first_revision(kBase, "rover:pw"), kFirstGrants);
  LocalConnection open_connection =
      connected(*base, port, first_revision("OPEN-2", "any:thing"), kFirstGrants);
  base->send("base");
  open->send("open");
  EXPECT_EQ(base_measurements.read(4), "base");
  EXPECT_EQ(open_connection.read(4), "open");
  try {
    (void)open_transport(address("ntrip-caster", port, kBase));
    ADD_FAILURE();
  } catch (const InputError& error) {
    EXPECT_THAT(error.problem(), HasSubstr("mount point BASE already"));
  }
  base->finish({});
  EXPECT_EQ(read_while_serving(*open, base_measurements, 1), "");
  open->send("still");
  EXPECT_EQ(open_connection.read(5), "still");
}

TEST(NtripCaster, HandsOnWhatClientsSayAndAnswersOne) {
  const int port = free_port();
  const auto caster = open_transport(address("ntrip-caster", port, kBase, ""));
  LocalConnection a = connected(*caster, port, first_revision(kBase, ":") + kGga, kFirstGrants);
  std::string request = second_revision(kBase, ":");
  request.insert(request.size() - 2, "Ntrip-GGA: $GPGGA,2\r\n");
  LocalConnection b = connected(*caster, port, request, kSecondGrants);
  b.send_text("$GPGGA,3\r\n");
  std::map<std::uint64_t, std::string> logged;
  EXPECT_TRUE(serve_until(*caster, [&] {
    for (const Received& received : caster->take_received()) logged[received.reader] += received.bytes;
    return logged.size() == 2 && logged.rbegin()->second.size() == 20;
  }));
  EXPECT_EQ(logged.begin()->second, kGga);
  EXPECT_EQ(logged.rbegin()->second, "$GPGGA,2\r\n$GPGGA,3\r\n");
  caster->send_to(logged.begin()->first, "at a");
  caster->send("all");
  EXPECT_EQ(a.read(7), "at aall");
  EXPECT_EQ(b.read(8), "3\r\nall\r\n");
}

TEST(NtripCaster, LetsGoOfClientsThatFloodIt) {
  const int port = free_port();
  const auto caster = open_transport(address("ntrip-caster", port, kBase));
  LocalConnection flood = connected(*caster, port, first_revision(kBase, "rover:pw"), kFirstGrants);
  std::atomic<bool> over = false;
  auto flooding = std::async(std::launch::async, [&] {
    while (!over) flood.send_text(std::string(50'000, 'x'));
  });
  EXPECT_EQ(read_while_serving(*caster, flood, 1), "");
  over = true;
  // Its further bytes are discarded.
  while (flooding.wait_for(std::chrono::milliseconds(1)) != std::future_status::ready) caster->serve();
  (void)caster->take_received();
  LocalConnection good = connected(*caster, port, first_revision(kBase, "rover:pw") + kGga, kFirstGrants);
  EXPECT_EQ(take(*caster, kGga.size()), kGga);
}

/// Arbitrary bytes instead of a base's messages.
std::string binary(std::size_t size) {
  std::string bytes;
  for (std::size_t i = 0; i < size; ++i) bytes += static_cast<char>((i * 7919 + i / 256) % 256);
  return bytes;
}

void send_in_pieces(Transport& to, const std::string& bytes) {
  for (std::size_t at = 0, n = 0; at < bytes.size(); at += n) {
    n = at % 977 + 1;
    to.send(bytes.substr(at, n));
    to.serve();
  }
}

test::ChildProcess str2str(const std::string& arguments) {
  return test::ChildProcess({"sh", "-c", "exec str2str " + arguments + " 2>/dev/null"});
}

TEST(NtripCaster, ServesRtklibsClient) {
  CANYON_NEEDS_PROGRAM("str2str");
  const test::TemporaryFolder folder;
  const int port = free_port();
  const auto caster = open_transport(address("ntrip-caster", port, kBase));
  const auto file = folder / "taken";
  test::ChildProcess client = str2str("-n 100 -p 22.3 114.17 10 -in " + address("ntrip", port, kBase) +
                                      " -out file://" + file.string());
  EXPECT_THAT(take(*caster, 20), AllOf(StartsWith("$G"), HasSubstr("GGA,")));
  const std::string bytes = binary(50'000);
  send_in_pieces(*caster, bytes);
  EXPECT_TRUE(serve_until(*caster, [&] {
    return std::filesystem::exists(file) && std::filesystem::file_size(file) >= bytes.size();
  }));
  client.stop();
  EXPECT_TRUE(test::read_bytes(file) == bytes);
}

// Python's http.client decodes the chunks.
TEST(NtripCaster, Revision2IsHttp) {
  CANYON_NEEDS_PROGRAM("python3");
  const test::TemporaryFolder folder;
  const int port = free_port();
  const auto caster = open_transport(address("ntrip-caster", port, kBase));
  const auto file = folder / "taken";
  const std::string bytes = binary(50'000);
  test::ChildProcess client(
      {"python3", "-c",
       "import http.client, sys\n"
       "c = http.client.HTTPConnection('127.0.0.1', int(sys.argv[1]), timeout=20)\n"
       "c.request('GET', '/BASE', headers={'Ntrip-Version': 'Ntrip/2.0', 'Ntrip-GGA': '$',"
       " 'Authorization': sys.argv[2]})\n"
       "r = c.getresponse()\n"
       "sys.stdout.buffer.write(b'%d ' % r.status + r.read())\n",
       std::to_string(port), "Basic " + base64("rover:pw")},
      file);
  EXPECT_EQ(take(*caster, 3), "$\r\n");
  send_in_pieces(*caster, bytes);
  caster->finish({});
  client.wait();
  EXPECT_TRUE(test::read_bytes(file) == "200 " + bytes);
}

/// A caster with scripted responses, for any client.
class ScriptedCaster {
 public:
  ScriptedCaster() : port(free_port()), server_(port, "127.0.0.1", kMaxClients, true) {}

  /// The next complete request, while `client` is served.
  std::string request(NtripClient& client) {
    std::string bytes;
    EXPECT_TRUE(serve_until(client, [&] {
      server_.serve();
      for (const Received& received : server_.take_received()) {
        if (received.reader != reader_) bytes.clear();
        reader_ = received.reader;
        bytes += received.bytes;
      }
      return bytes.find("\r\n\r\n") != std::string::npos;
    }));
    return bytes;
  }
  void send_text(std::string_view bytes) { server_.send_to(reader_, bytes); }
  void end() {
    server_.close(reader_);
    server_.serve();
  }
  /// The client's further bytes.
  std::string take(std::size_t size) { return transport::take(server_, size); }

  const int port;

 private:
  TcpServer server_;
  std::uint64_t reader_ = 0;
};

const NtripClient::Options kQuick{std::chrono::milliseconds(20), std::chrono::milliseconds(80),
                                  std::chrono::milliseconds(10'000)};

NtripClient client_of(const ScriptedCaster& caster, const char* scheme = "ntrip") {
  return NtripClient(address(scheme, caster.port, kBase), kQuick);
}

bool becomes(NtripClient& client, State state) {
  return serve_until(client, [&] { return client.status().state == state; });
}

TEST(NtripClient, TakesTheStreamOfOurCasterAndSendsItsPlace) {
  const int port = free_port();
  NtripClient client(address("ntrip", port, kBase), kQuick);
  EXPECT_EQ(client.status().state, State::Connecting);
  EXPECT_TRUE(becomes(client, State::Closed));
  EXPECT_EQ(client.status().reason, "no response");
  client.send(kGga);
  const auto caster = open_transport(address("ntrip-caster", port, kBase));
  std::string logged;
  EXPECT_TRUE(serve_until(client, [&] {
    caster->serve();
    for (const Received& received : caster->take_received()) logged += received.bytes;
    return logged.size() == 2 * kGga.size();
  }));
  EXPECT_EQ(logged, kGga + kGga) << "with the request and when it is granted";
  EXPECT_EQ(client.status().state, State::Streaming);
  client.send("$GPGGA,next");
  EXPECT_EQ(take(*caster, 13), "$GPGGA,next\r\n");
  const std::string bytes = binary(30'000);
  send_in_pieces(*caster, bytes);
  EXPECT_TRUE(take(client, bytes.size()) == bytes);
  EXPECT_THAT(client.take_notes(), ElementsAre("no response: retrying", "the caster streams"));
  caster->finish({});
  EXPECT_TRUE(becomes(client, State::Closed));
}

TEST(NtripClient, TakesTheStreamOfRtklibsCaster) {
  CANYON_NEEDS_PROGRAM("str2str");
  const int port = free_port(), source_port = free_port();
  TcpServer source(source_port);
  const test::ChildProcess caster = str2str("-in tcpcli://127.0.0.1:" + std::to_string(source_port) +
                                            " -out ntripc://rover:pw@:" + std::to_string(port) + "/BASE");
  EXPECT_TRUE(serve_until(source, [&] { return source.clients() == 1; }));
  NtripClient client(address("ntrip", port, kBase), kQuick);
  EXPECT_TRUE(becomes(client, State::Streaming)) << client.status().reason;
  const std::string bytes = binary(30'000);
  send_in_pieces(source, bytes);
  EXPECT_TRUE(take(client, bytes.size()) == bytes);

  NtripClient wrong(address("ntrip", port, kBase, "rover:no"), kQuick);
  EXPECT_TRUE(becomes(wrong, State::Refused));
  EXPECT_EQ(wrong.status().reason, "wrong user or password");
  NtripClient lost(address("ntrip", port, "ROOF"), kQuick);
  EXPECT_TRUE(becomes(lost, State::Refused));
  EXPECT_EQ(lost.status().reason, "no mount point ROOF; the caster has BASE");
  EXPECT_THAT(lost.status().mounts, ElementsAre("BASE"));
  EXPECT_THAT(lost.take_notes(), ElementsAre(HasSubstr("no mount point ROOF; the caster has BASE")));
}

TEST(NtripClient, AsksForTheTableOfACasterThatHasNoSuchMountPoint) {
  const int port = free_port();
  const auto caster = open_transport(address("ntrip-caster", port, kBase));
  NtripClient client(address("ntrip", port, "ROOF"), kQuick);
  EXPECT_TRUE(serve_until(client, [&] {
    caster->serve();
    return !client.status().mounts.empty();
  }));
  EXPECT_EQ(client.status().state, State::Refused);
  EXPECT_EQ(client.status().reason, "no mount point ROOF; the caster has BASE");
}

// A caster may repeat a request, with the password plain or encoded.
TEST(NtripClient, TellsNoSecretThatACasterSaysBack) {
  const std::string encoded = base64("rover:S3CRET!");
  for (const std::string& response :
       {"HTTP/1.1 500 no " + encoded + "\r\n\r\n", "ERROR - " + encoded + " is not known\r\n",
        std::string("HTTP/1.1 403x rover:S3CRET!\r\n\r\n"),
        "HTTP/1.1 500 " + std::string(80, '.') + "S3CRET!\r\n\r\n",
        std::string("SOURCETABLE 200 OK\r\n\r\nSTR;ROOF-S3CRET!;;\r\nENDSOURCETABLE\r\n")}) {
    ScriptedCaster caster;
    NtripClient client(address("ntrip", caster.port, kBase, "rover:S3CRET!"), kQuick);
    (void)caster.request(client);
    caster.send_text(response);
    EXPECT_TRUE(becomes(client, State::Refused)) << response;
    std::string reported = client.status().reason;
    for (const std::string& line : client.take_notes()) reported += line;
    for (const std::string& mount : client.status().mounts) reported += mount;
    EXPECT_THAT(reported, AllOf(Not(HasSubstr("S3C")), Not(HasSubstr(encoded.substr(0, 12)))));
  }
}

TEST(NtripClient, TakesChunksHoweverTheyAreCut) {
  ScriptedCaster caster;
  NtripClient client = client_of(caster);
  EXPECT_THAT(caster.request(client),
              AllOf(StartsWith("GET /BASE HTTP/1.1\r\n"), HasSubstr("\r\nNtrip-Version: Ntrip/2.0\r\n"),
                    HasSubstr("\r\n" + authorization("rover:pw")), HasSubstr("\r\nUser-Agent: NTRIP ")));
  const std::string response =
      "HTTP/1.1 200 OK\r\nNtrip-Version: Ntrip/2.0\r\nContent-Type: gnss/data\r\nTransfer-Encoding: "
      "chunked\r\n\r\n"
      "3\r\none\r\n00C;name=value\r\n two\r\n three\r\n1\r\n!\r\n";
  for (const char c : response) {
    caster.send_text({&c, 1});
    client.serve();
  }
  EXPECT_EQ(take(client, 16), "one two\r\n three!");
  caster.send_text("0\r\n\r\n");
  EXPECT_TRUE(becomes(client, State::Closed));
  EXPECT_EQ(client.status().reason, "the caster ended the stream");
}

TEST(NtripClient, TakesWhatHttpDoesNotCut) {
  ScriptedCaster caster;
  NtripClient client = client_of(caster);
  (void)caster.request(client);
  caster.send_text("HTTP/1.0 200 OK\r\n\r\nas it is");
  EXPECT_EQ(take(client, 8), "as it is");
}

TEST(NtripClient, TakesAnswersWhoseLinesEndWithLfAlone) {
  for (const char* head :
       {"HTTP/1.1 200 OK\nContent-Type: gnss/data\n\n", "ICY 200 OK\n\n", "ICY 200 OK\n"}) {
    ScriptedCaster caster;
    NtripClient client = client_of(caster);
    (void)caster.request(client);
    caster.send_text(std::string(head) + "as\r\nit\nis");
    EXPECT_EQ(take(client, 9), "as\r\nit\nis") << head;
  }
}

TEST(NtripClient, FallsBackToRevision1) {
  for (const char* response :
       {"HTTP/1.1 501 Not Implemented\r\n\r\n", "ERROR - Bad Request\r\n", "hello\r\n", ""}) {
    ScriptedCaster caster;
    NtripClient client = client_of(caster);
    EXPECT_THAT(caster.request(client), HasSubstr("Ntrip/2.0"));
    caster.send_text(response);
    caster.end();
    EXPECT_EQ(caster.request(client),
              "GET /BASE HTTP/1.0\r\nUser-Agent: NTRIP Canyon\r\n" + authorization("rover:pw") + "\r\n");
    caster.send_text("ICY 200 OK\r\n\r\nbytes");
    EXPECT_EQ(take(client, 5), "bytes") << response;
    EXPECT_EQ(client.status().state, State::Streaming);
  }
}

TEST(NtripClient, SaysWhyItIsRefused) {
  const auto status_after = [](const char* result) {
    ScriptedCaster caster;
    NtripClient client = client_of(caster);
    (void)caster.request(client);
    caster.send_text(result);
    caster.end();
    EXPECT_TRUE(becomes(client, State::Refused)) << result;
    return client.status();
  };
  EXPECT_EQ(status_after("HTTP/1.0 401 Unauthorized\r\n").reason, "wrong user or password");
  EXPECT_EQ(status_after("ERROR - Bad Password\r\n").reason, "wrong user or password");
  EXPECT_EQ(status_after("HTTP/1.1 404 Not Found\r\n\r\n").reason, "no mount point BASE");
  EXPECT_EQ(status_after("HTTP/1.1 503 \x1B[2J\r\n\r\n").reason, "the caster responds 'HTTP/1.1 503 ?[2J'");
  EXPECT_EQ(status_after("SOURCETABLE 200 OK\r\n\r\nSTR;BASE;x\r\nENDSOURCETABLE\r\n").reason,
            "the mount point BASE has no stream now");
  const auto table =
      status_after("HTTP/1.1 200 OK\r\nContent-Type: gnss/sourcetable\r\n\r\nCAS;x\r\nSTR;A;\r\nSTR;B\r\n");
  EXPECT_EQ(table.reason, "no mount point BASE; the caster has A, B");
  EXPECT_THAT(table.mounts, ElementsAre("A", "B"));
}

// Each of these responses is endless: the client disconnects by itself, and stores nothing of it.
TEST(NtripClient, LetsGoOfHostileCasters) {
  const std::string http = "HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n";
  struct Attack {
    std::string begin, more;
  };
  for (const Attack& attack :
       {Attack{"", std::string(1000, 'x')}, Attack{"HTTP/1.1 200 OK\r\n", "X: y\r\n"},
        Attack{http + "X: ", "yyyyyyyy"}, Attack{http + "\r\n1;", "name=value;"},
        Attack{http + "\r\n", "0000000000"}, Attack{http + "\r\nFFFFFFFFFFFFFFFFFFFF\r\n", "x"},
        Attack{http + "\r\nhello\r\n", "x"},
        Attack{"HTTP/1.1 200 OK\r\nContent-Length: 99999999999999999999999\r\n\r\n", "x"}}) {
    ScriptedCaster caster;
    NtripClient client = client_of(caster);
    (void)caster.request(client);
    caster.send_text(attack.begin);
    EXPECT_TRUE(serve_until(client,
                            [&] {
                              for (int i = 0; i < 100; ++i) caster.send_text(attack.more);
                              return client.status().state == State::Refused;
                            }))
        << attack.begin << attack.more;
    EXPECT_THAT(client.status().reason,
                AnyOf(HasSubstr("not that of an NTRIP caster"), HasSubstr("HTTP is broken")));
  }
}

TEST(NtripClient, KeepsLittleOfAHostileStreamAndTable) {
  ScriptedCaster caster;
  NtripClient client = client_of(caster);
  (void)caster.request(client);
  // No memory is reserved for chunks and contents of this size.
  caster.send_text("HTTP/1.1 200 OK\r\nTransfer-Encoding: chunked\r\n\r\n7FFFFFFFFFFFFFFF\r\n");
  for (int i = 0; i < 300; ++i) {
    caster.send_text(std::string(1000, 'x'));
    client.serve();
  }
  EXPECT_EQ(client.status().state, State::Streaming);
  const auto kept = client.take_received();
  ASSERT_EQ(kept.size(), 1U);
  EXPECT_LE(kept.front().bytes.size(), kMaxReceived);
  EXPECT_GT(kept.front().bytes.size(), kMaxReceived / 2);

  ScriptedCaster other;
  NtripClient requester = client_of(other);
  (void)other.request(requester);
  other.send_text("SOURCETABLE 200 OK\r\n\r\nSTR;" + std::string(5000, 'x') + ";\r\n");
  for (int i = 0; i < 3000; ++i) {
    other.send_text("STR;" + std::string(200, 'm') + std::to_string(i) + ";\r\n");
    requester.serve();
  }
  other.send_text("ENDSOURCETABLE\r\n");
  EXPECT_TRUE(becomes(requester, State::Refused));
  EXPECT_EQ(requester.status().mounts.size(), 1000U);
  EXPECT_EQ(requester.status().mounts.front(), std::string(100, 'm'));
  EXPECT_THAT(requester.status().reason, EndsWith("and 980 more"));
}

TEST(NtripClient, ConnectsAnewWhenACasterStalls) {
  ScriptedCaster caster;
  NtripClient::Options options = kQuick;
  options.patience = std::chrono::milliseconds(100);
  NtripClient client(address("ntrip", caster.port, kBase), options);
  (void)caster.request(client);
  EXPECT_TRUE(becomes(client, State::Stalled)) << "no answer";
  EXPECT_EQ(client.status().reason, "no byte for 0.1 s");
  (void)caster.request(client);
  caster.send_text("ICY 200 OK\r\nbytes");
  EXPECT_EQ(take(client, 5), "bytes");
  const auto last_byte = Clock::now();
  EXPECT_TRUE(becomes(client, State::Stalled)) << "no more bytes";
  EXPECT_GE(Clock::now() - last_byte, std::chrono::milliseconds(90));
  (void)caster.request(client);
  EXPECT_THAT(client.take_notes(), ElementsAre("no byte for 0.1 s: retrying", "the caster streams",
                                               "no byte for 0.1 s: retrying"));
}

TEST(NtripClient, WaitsLongerEachTimeUntilItGetsBytes) {
  ScriptedCaster caster;
  NtripClient client(
      address("ntrip", caster.port, kBase),
      {std::chrono::milliseconds(30), std::chrono::milliseconds(120), std::chrono::seconds(10)});
  auto before = Clock::now() - std::chrono::seconds(1);
  for (const int least : {0, 30, 60, 120, 120}) {
    (void)caster.request(client);
    EXPECT_GE(Clock::now() - before, std::chrono::milliseconds(least - 2));
    caster.send_text("ERROR - Bad Password\r\n");
    caster.end();
    // It disconnects when it reads that.
    std::vector<int> handles;
    EXPECT_TRUE(serve_until(client, [&] {
      handles.clear();
      client.add_handles(handles);
      return handles.empty();
    }));
    before = Clock::now();
  }
}

TEST(NtripSource, BringsAStreamToACaster) {
  ScriptedCaster caster;
  NtripClient source = client_of(caster, "ntrip-source");
  source.send("lost");
  EXPECT_THAT(caster.request(source),
              AllOf(StartsWith("POST /BASE HTTP/1.1\r\n"), HasSubstr("\r\nNtrip-Version: Ntrip/2.0\r\n"),
                    HasSubstr("\r\nTransfer-Encoding: chunked\r\n"), HasSubstr(authorization("rover:pw"))));
  caster.send_text("HTTP/1.1 200 OK\r\nContent-Length: 0\r\n\r\n");
  EXPECT_TRUE(becomes(source, State::Streaming));
  source.send("");
  source.send("one two three four");
  EXPECT_EQ(caster.take(24), "12\r\none two three four\r\n");
  source.finish({});
  EXPECT_EQ(caster.take(5), "0\r\n\r\n");
}

TEST(NtripSource, SpeaksRevision1ToOldCasters) {
  ScriptedCaster caster;
  NtripClient source = client_of(caster, "ntrip-source");
  (void)caster.request(source);
  caster.send_text("ERROR - Bad Request\r\n");
  caster.end();
  EXPECT_THAT(caster.request(source), StartsWith("SOURCE pw /BASE\r\nSource-Agent: NTRIP "));
  caster.send_text("OK\r\n");
  EXPECT_TRUE(becomes(source, State::Streaming));
  source.send("as it is");
  EXPECT_EQ(caster.take(8), "as it is");
}

TEST(NtripAddress, RefusesWhatIsNone) {
  const auto error_of = [](const std::string& text) {
    try {
      (void)open_transport(text);
    } catch (const InputError& error) {
      return std::string(error.what()) + " | " + error.hint();
    }
    ADD_FAILURE() << text;
    return std::string();
  };
  for (const char* scheme : {"ntrip://", "ntrip-caster://", "ntrip-source://"}) {
    const std::string form = "write " + std::string(scheme) + "[USER:PASSWORD@]HOST:PORT/MOUNT";
    for (const char* rest : {"", "127.0.0.1:2101", "127.0.0.1:2101/", "rover:secret@127.0.0.1:2101"}) {
      EXPECT_THAT(error_of(std::string(scheme) + rest),
                  AllOf(HasSubstr("has no mount point"), HasSubstr(form), Not(HasSubstr("secret"))));
    }
    EXPECT_THAT(error_of(std::string(scheme) + "127.0.0.1:2101/A;B"),
                AllOf(HasSubstr("'A;B' is not a mount point"), HasSubstr(form)));
    EXPECT_THAT(
        error_of(std::string(scheme) + "rover:secret@127.0.0.1/BASE"),
        AllOf(HasSubstr("no host and port"), HasSubstr("rover:...@127.0.0.1"), Not(HasSubstr("secret"))));
  }
  EXPECT_THAT(error_of("ntrip://rover:sec/ret@127.0.0.1:2101"),
              AllOf(HasSubstr("rover:...@127.0.0.1:2101' has no mount point"), Not(HasSubstr("ret@"))));
  EXPECT_THAT(error_of("ntrip://me@example.com:secret@127.0.0.1:2101"),
              AllOf(HasSubstr("'ntrip://...@127.0.0.1:2101'"), Not(HasSubstr("example"))));
  EXPECT_THAT(error_of("ntrip://nowhere.invalid:2101/BASE"),
              HasSubstr("'nowhere.invalid' is not a known host"));
  EXPECT_THAT(error_of("ntrip-caster://here:2101/BASE"), HasSubstr("'here' is not an address to listen at"));
}

TEST(NtripAddress, PasswordsAreNotShown) {
  EXPECT_EQ(hide_passwords("base/rtcm=ntrip-caster://rover:p@ss:w/rd@127.0.0.1:2101/BASE"),
            "base/rtcm=ntrip-caster://rover:...@127.0.0.1:2101/BASE");
  for (const char* open : {"ntrip://127.0.0.1:2101/BASE", "tcp://127.0.0.1:2101", "serial:/dev/ttyS0@9600"}) {
    EXPECT_EQ(hide_passwords(open), open);
  }
}

}  // namespace
}  // namespace canyon::transport
