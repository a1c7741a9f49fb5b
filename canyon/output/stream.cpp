#include "canyon/output/stream.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <thread>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/simulation/scenario.hpp"

namespace canyon::output {

EncodedStream::EncodedStream(std::unique_ptr<Encoder> encoder, std::unique_ptr<Transport> transport,
                             std::size_t receiver)
    : encoder_(std::move(encoder)), transport_(std::move(transport)), receiver_(receiver) {
  transport_->begin(encoder_->begin());
}

void EncodedStream::write(const simulation::Epoch& epoch) {
  if (epoch.receiver != receiver_) return;
  transport_->serve();
  transport_->send(encoder_->encode(epoch));
}

void EncodedStream::finish() {
  if (std::exchange(finished_, true)) return;
  transport_->send(encoder_->end());
  transport_->finish(encoder_->correction());
}

StreamRequest parse_stream(std::string_view text) {
  const std::size_t equals = text.find('=');
  const std::string_view what = text.substr(0, equals);
  const std::size_t slash = what.rfind('/');
  StreamRequest request;
  if (slash != std::string_view::npos) request.receiver = what.substr(0, slash);
  request.format = what.substr(slash + 1);  // npos + 1 is 0
  if (equals != std::string_view::npos) request.address = text.substr(equals + 1);
  if (request.format.empty() || request.address.empty()) {
    throw InputError(fmt::format("'{}' is no stream", text),
                     "write FORMAT=ADDRESS, such as nmea=tcp://127.0.0.1:2947; with several receivers "
                     "RECEIVER/FORMAT=ADDRESS");
  }
  return request;
}

std::unique_ptr<EncodedStream> open_stream(const StreamRequest& request, std::size_t receiver,
                                           const ReceiverDescription& description) {
  const Format& format = format_named(request.format);
  if (!format.live && !is_file_address(request.address)) {
    throw InputError(fmt::format("{} is whole only at the end of a run and cannot go to '{}'", format.name,
                                 request.address),
                     fmt::format("write it to a file, {}=file:{}", format.name, format.file));
  }
  return std::make_unique<EncodedStream>(format.make(description), open_transport(request.address), receiver);
}

std::unique_ptr<EncodedStream> open_stream(const StreamRequest& request,
                                           const simulation::Simulation& simulation) {
  std::vector<std::string> names;
  for (const auto& config : simulation.scenario().receivers) names.push_back(config.options.name);
  const auto at = request.receiver.empty() && names.size() == 1
                      ? names.begin()
                      : std::find(names.begin(), names.end(), request.receiver);
  if (at == names.end()) {
    throw InputError(request.receiver.empty()
                         ? fmt::format("the stream '{}' does not say of which receiver", request.format)
                         : fmt::format("the scenario has no receiver '{}'", request.receiver),
                     fmt::format("write RECEIVER/{}={}; receivers: {}", request.format, request.address,
                                 fmt::join(names, ", ")));
  }
  const auto receiver = static_cast<std::size_t>(at - names.begin());
  return open_stream(request, receiver, describe_receiver(simulation, receiver));
}

std::unique_ptr<EncodedStream> open_file(std::string_view format, const std::filesystem::path& path,
                                         std::size_t receiver, const ReceiverDescription& description) {
  return open_stream({{}, std::string(format), "file:" + path.string()}, receiver, description);
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

}  // namespace canyon::output
