#include "canyon/outputs/encoding/stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "canyon/base/geodesy/constants.hpp"
#include "canyon/base/geodesy/frames.hpp"
#include "canyon/base/input_error.hpp"
#include "canyon/base/options/describe.hpp"
#include "canyon/base/options/read.hpp"
#include "canyon/base/text.hpp"
#include "canyon/outputs/encoding/device.hpp"
#include "canyon/paths/disturbance/faults/receiver_faults.hpp"
#include "canyon/simulation/motion/nmea_fixes.hpp"
#include "canyon/simulation/motion/recorded_path.hpp"
#include "canyon/simulation/receiver_runner.hpp"
#include "canyon/simulation/scenario/scenario.hpp"
#include "canyon/simulation/sensor_run.hpp"
#include "canyon/simulation/simulator.hpp"

namespace canyon::encoding {
namespace {

transport::StreamDescription stream_description(const Format& format, const ReceiverDescription& receiver) {
  transport::StreamDescription stream{
      receiver.name, format.name == "rtcm" ? "RTCM 3.3" : std::string(format.name), {}, {}, {}};
  for (const gnss::System system : receiver.systems)
    stream.systems += fmt::format("{}{}", stream.systems.empty() ? "" : "+", gnss::name(system));
  if (receiver.station_ecef) {
    const geodesy::Geodetic position = geodesy::geodetic_from_ecef(*receiver.station_ecef);
    stream.latitude_deg = geodesy::degrees(position.latitude_rad);
    stream.longitude_deg = geodesy::degrees(position.longitude_rad);
  }
  return stream;
}

/// Throws InputError if no client can report its position, or if the receiver is not a base station.
void check_virtual_station(const StreamRequest& request, const ReceiverDescription& base) {
  const auto refuse = [](std::string_view problem, std::string_view hint) {
    throw InputError(fmt::format("virtual_station: {}", problem), hint);
  };
  if (request.format != "rtcm")
    refuse(fmt::format("{} has no corrections for a position", request.format), "use the format rtcm");
  if (transport::is_file_address(request.address)) {
    refuse("no client can report its position to a file",
           "serve it as ntrip-caster://HOST:PORT/MOUNT or tcp://HOST:PORT");
  }
  if (!base.station_ecef) {
    refuse(fmt::format("'{}' moves and is not a base station", base.name),
           "give that receiver fixed: {latitude_deg: ..., longitude_deg: ...}");
  }
}

}  // namespace

EncodedStream::EncodedStream(std::unique_ptr<Encoder> encoder, std::shared_ptr<transport::Link> link,
                             std::size_t receiver, const StreamOptions& options,
                             std::optional<VirtualStations> stations, ClockFunction now)
    : encoder_(std::move(encoder)),
      link_(std::move(link)),
      receiver_(receiver),
      options_(options),
      stations_(std::move(stations)),
      delays_(1, fmt::format("stream/{}", receiver)),
      now_(std::move(now)) {
  if (const std::string first = encoder_->begin(); !first.empty()) link_->transport().begin(first);
  listener_ = link_->listen([this](const transport::Received& received) {
    if (stations_) stations_->receive(received.reader, received.bytes);
    Device* const device = encoder_->device();
    if (device == nullptr) return;
    const std::string response = device->receive(received.reader, received.bytes);
    if (!response.empty()) link_->transport().send_to(received.reader, response);
    if (const auto baud = device->take_baud()) link_->transport().set_baud(*baud);
    if (const std::string command = device->take_setup_command(); !command.empty())
      link_->note(received.reader == 0
                      ? fmt::format("the other end configured its output: {}", command)
                      : fmt::format("client {} configured its own output: {}", received.reader, command));
  });
}

EncodedStream::~EncodedStream() {
  link_->forget(listener_);
}

bool EncodedStream::wanted(geodesy::GpsTime time) {
  if (!options_.rate_hz) return true;
  // Half a millisecond: epochs slightly off the grid count as on it.
  const auto number =
      static_cast<std::int64_t>(std::floor((time - geodesy::GpsTime{} + 0.0005) * *options_.rate_hz));
  return std::exchange(sent_, number) != number;
}

void EncodedStream::write(const simulation::Epoch& epoch) {
  if (epoch.receiver != receiver_) return;
  serve();
  if (!wanted(epoch.observed.time)) return;
  enqueue(encode(epoch));
}

void EncodedStream::write_samples(const simulation::SensorBatch& samples) {
  if (!encoder_->uses_sensors()) return;
  if (std::string bytes = encoder_->encode_samples(samples); !bytes.empty())
    enqueue({{{}, std::move(bytes), {}}});
}

void EncodedStream::enqueue(std::vector<Waiting> pieces) {
  if (options_.latency_s == 0 && options_.jitter_s == 0 && !options_.link_baud) {
    for (const Waiting& each : pieces) send(each);
    return;
  }
  const double delay_s = std::max(0.0, options_.latency_s + options_.jitter_s * delays_.normal());
  Clock::time_point due =
      now_() + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(delay_s));
  if (!waiting_.empty()) due = std::max(due, waiting_.back().due);
  const auto waited = static_cast<std::ptrdiff_t>(waiting_.size());
  for (Waiting& each : pieces) {
    if (options_.link_baud) {
      wait_one_by_one(each, due);
      continue;
    }
    each.due = due;
    waiting_.push_back(std::move(each));
  }
  // Each reader has its own line.
  std::stable_sort(waiting_.begin() + waited, waiting_.end(),
                   [](const Waiting& a, const Waiting& b) { return a.due < b.due; });
}

std::vector<EncodedStream::Waiting> EncodedStream::encode(const simulation::Epoch& epoch) {
  std::vector<Waiting> pieces;
  std::string all = stations_ ? std::string() : encoder_->encode(epoch);
  std::vector<std::uint64_t> others;
  Device* const device = encoder_->device();
  for (const std::uint64_t reader : link_->transport().readers()) {
    std::optional<std::string> own;
    if (stations_)
      own = stations_->encode(reader, epoch);
    else if (device != nullptr)
      own = device->encode_for_reader(reader);
    if (own) pieces.push_back({{}, std::move(*own), {reader}});
    if (!own) others.push_back(reader);
  }
  if (stations_ || (!pieces.empty() && others.empty())) return pieces;
  if (pieces.empty()) others.clear();  // sent to all
  pieces.push_back({{}, std::move(all), std::move(others)});
  return pieces;
}

void EncodedStream::wait_one_by_one(const Waiting& what, Clock::time_point due) {
  constexpr double kBitsOfByte = 10;
  for (std::string_view bytes = what.bytes; !bytes.empty();) {
    const std::size_t size = encoder_->datagram(bytes);
    const double takes_s = kBitsOfByte * static_cast<double>(size) / *options_.link_baud;
    due += std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(takes_s));
    waiting_.push_back({due, std::string(bytes.substr(0, size)), what.readers});
    bytes.remove_prefix(size);
  }
}

void EncodedStream::send(const Waiting& what) {
  for (const std::uint64_t reader : what.readers) link_->transport().send_to(reader, what.bytes);
  if (!what.readers.empty()) return;
  for (std::string_view bytes = what.bytes; !bytes.empty();) {
    const std::size_t size = encoder_->datagram(bytes);
    link_->transport().send(bytes.substr(0, size));
    bytes.remove_prefix(size);
  }
}

void EncodedStream::serve() {
  link_->serve();
  send_due();
}

void EncodedStream::send_due() {
  while (!waiting_.empty() && waiting_.front().due <= now_()) {
    send(waiting_.front());
    waiting_.pop_front();
  }
}

void EncodedStream::send_waiting() {
  for (const Waiting& each : std::exchange(waiting_, {})) send(each);
}

std::optional<EncodedStream::Clock::time_point> EncodedStream::next_due() const {
  if (waiting_.empty()) return std::nullopt;
  return waiting_.front().due;
}

void EncodedStream::finish() {
  if (std::exchange(finished_, true)) return;
  send_waiting();
  encoder_->end([this](std::string_view bytes) { link_->transport().send(bytes); });
  link_->finish(listener_, encoder_->correction());
}

StreamRequest parse_stream(std::string_view text) {
  const std::size_t equals = text.find('=');
  const std::string_view what = text.substr(0, equals);
  const std::size_t slash = what.rfind('/');
  StreamRequest request;
  if (slash != std::string_view::npos) request.receiver = what.substr(0, slash);
  request.format = what.substr(slash + 1);  // npos + 1 is 0
  if (equals != std::string_view::npos) request.address = text.substr(equals + 1);
  const std::size_t question = request.address.rfind('?');
  if (question != std::string::npos && request.address.find('=', question) != std::string::npos) {
    options::Node root;
    root.kind = options::Node::Kind::Mapping;
    for (const std::string_view pair : split(std::string_view(request.address).substr(question + 1), '&')) {
      const std::size_t at = pair.find('=');
      options::Node value;
      value.kind = options::Node::Kind::Scalar;
      if (at != std::string_view::npos) value.text = pair.substr(at + 1);
      root.entries.push_back({std::string(pair.substr(0, at)), 0, std::move(value)});
    }
    options::Document document;
    document.kind = "stream";
    document.page = "docs/outputs.md";
    document.known = options::describe<StreamOptions>().paths();
    options::read(root, document, request.options);
    request.address.resize(question);
  }
  if (request.format.empty() || request.address.empty()) {
    throw InputError(fmt::format("'{}' is not a stream", text),
                     "write FORMAT=ADDRESS, such as nmea=tcp://127.0.0.1:10110; with several receivers "
                     "RECEIVER/FORMAT=ADDRESS");
  }
  return request;
}

std::unique_ptr<EncodedStream> open_stream(const StreamRequest& request, std::size_t receiver,
                                           ReceiverDescription description,
                                           std::shared_ptr<transport::Link> link,
                                           EncodedStream::ClockFunction now) {
  if (!link) link = std::make_shared<transport::Link>(request.address);
  const Format& format = format_named(request.format);
  if (!format.live && !transport::is_file_address(request.address)) {
    throw InputError(fmt::format("{} is complete only at the end of a run and cannot be sent to '{}'",
                                 format.name, request.address),
                     fmt::format("write it to a file, {}=file:{}", format.name, format.file));
  }
  if (transport::is_input_address(request.address)) {
    throw InputError(fmt::format("nothing can be sent to '{}'", request.address),
                     fmt::format("write {}", transport::address_forms()));
  }
  description.ephemerides = request.options.ephemerides;
  description.ubx_generation = request.options.generation;
  transport::StreamDescription described = stream_description(format, description);
  std::optional<VirtualStations> stations;
  if (request.options.virtual_station) {
    check_virtual_station(request, description);
    described.wants_position = true;
    stations.emplace(format, description);
  }
  std::unique_ptr<Encoder> encoder = format.make(description);
  if (request.options.rate_hz && encoder->uses_sensors()) {
    throw InputError(fmt::format("rate_hz would leave out samples of {}", format.name),
                     "remove rate_hz; sensors have their own rate_hz");
  }
  link->transport().describe(described);
  return std::make_unique<EncodedStream>(std::move(encoder), std::move(link), receiver, request.options,
                                         std::move(stations), std::move(now));
}

std::string apply_commands(EncodedStream& stream, simulation::ReceiverRunner& receiver) {
  Device* const device = stream.device();
  if (device == nullptr) return {};
  if (auto came = device->take_corrections(); !came.empty()) receiver.set_corrections(std::move(came.back()));
  const auto kind = device->take_restart();
  if (!kind) return {};
  try {
    return fmt::format("{} start, requested over its line: fault '{}'", disturbance::name(*kind),
                       receiver.add_fault(fmt::format("restart: {{kind: {}}}", disturbance::name(*kind))));
  } catch (const InputError& error) {
    return fmt::format("no restart: {}", error.what());
  }
}

std::size_t find_receiver(const StreamRequest& request, const std::vector<std::string>& names) {
  const auto at = request.receiver.empty() && names.size() == 1
                      ? names.begin()
                      : std::find(names.begin(), names.end(), request.receiver);
  if (at == names.end()) {
    throw InputError(request.receiver.empty()
                         ? fmt::format("the stream '{}' does not name its receiver", request.format)
                         : fmt::format("the scenario has no receiver '{}'", request.receiver),
                     fmt::format("write RECEIVER/{}={}; receivers: {}", request.format, request.address,
                                 fmt::join(names, ", ")));
  }
  return static_cast<std::size_t>(at - names.begin());
}

std::unique_ptr<EncodedStream> open_stream(const StreamRequest& request,
                                           const simulation::Simulation& simulation) {
  const std::size_t receiver =
      find_receiver(request, simulation::receiver_names(simulation.scenario().receivers));
  ReceiverDescription description = describe_receiver(simulation, receiver);
  description.sensors = simulation::sensors_of(simulation.scenario(), receiver);
  return open_stream(request, receiver, description);
}

std::unique_ptr<EncodedStream> open_file(std::string_view format, const std::filesystem::path& path,
                                         std::size_t receiver, const ReceiverDescription& description) {
  StreamOptions options;
  options.generation = description.ubx_generation;
  return open_stream({{}, std::string(format), "file:" + path.string(), options}, receiver, description,
                     std::make_shared<transport::Link>(transport::open_result(path)));
}

void RealTimePacer::write(const simulation::Epoch& epoch) {
  using Clock = std::chrono::steady_clock;
  const geodesy::GpsTime time = epoch.truth.time;
  if (!start_) start_ = {time, Clock::now()};
  const auto due = start_->wall + std::chrono::duration_cast<Clock::duration>(
                                      std::chrono::duration<double>(time - start_->epoch));
  for (auto now = Clock::now(); now < due; now = Clock::now()) {
    if (stop_ != nullptr && *stop_) return;
    if (meanwhile_) meanwhile_();
    std::this_thread::sleep_until(std::min(due, now + std::chrono::milliseconds(50)));
  }
}

VirtualStations::VirtualStations(const Format& format, ReceiverDescription base)
    : format_(&format), base_(std::move(base)) {
  base_.virtual_station = true;
}

void VirtualStations::receive(std::uint64_t reader, std::string_view bytes) {
  Rover& rover = rovers_.of(reader);
  rover.lines.receive(bytes, [&rover](std::optional<std::string_view> line) {
    if (!line) return;
    if (const auto position = simulation::position_of_gga(*line))
      rover.reported_ecef = geodesy::ecef_from_geodetic(*position);
  });
}

std::optional<std::string> VirtualStations::encode(std::uint64_t reader, const simulation::Epoch& epoch) {
  Rover* const rover = rovers_.find(reader);
  if (rover == nullptr) return std::nullopt;
  const std::optional<simulation::Epoch> moved = rover->station.move(epoch, rover->reported_ecef);
  if (!moved) return std::nullopt;
  if (!rover->encoder || moved->truth_ecef != rover->antenna_position_ecef) {
    rover->antenna_position_ecef = moved->truth_ecef;
    base_.station_ecef = rover->antenna_position_ecef;
    rover->encoder = format_->make(base_);
  }
  return rover->encoder->encode(*moved);
}

}  // namespace canyon::encoding
