#include "canyon/outputs/live/epoch_publisher.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

#include "canyon/base/input_error.hpp"

namespace canyon::live {
namespace {

class StreamPublisher final : public EpochPublisher {
 public:
  StreamPublisher(std::string setting, const encoding::StreamRequest& request, std::size_t receiver,
                  const encoding::ReceiverDescription& description, std::shared_ptr<transport::Link> link,
                  simulation::ReceiverRunner* device)
      : setting_(std::move(setting)),
        stream_(encoding::open_stream(request, receiver, description, std::move(link),
                                      [this] {
                                        return encoding::EncodedStream::Clock::time_point(
                                            std::chrono::nanoseconds(now_ns_));
                                      })),
        device_(receiver == 0 ? device : nullptr) {}
  ~StreamPublisher() override {
    try {
      stream_->finish();
    } catch (const std::exception&) {  // a full disk: no file, and no way to report it here
    }
  }
  StreamPublisher(const StreamPublisher&) = delete;
  StreamPublisher& operator=(const StreamPublisher&) = delete;

  void publish(const ReceiverReport& report) override {
    serve(report.sim_time_ns);
    const auto* step = stream_->receiver() == 0 ? report.step : report.base;
    if (step != nullptr) stream_->write(step->epoch);
  }
  void serve(std::int64_t sim_time_ns) override {
    now_ns_ = sim_time_ns;
    stream_->serve();
    if (device_ == nullptr) return;
    if (std::string line = encoding::apply_commands(*stream_, *device_); !line.empty())
      notes_.push_back(line);
  }
  void reset() override { stream_->send_waiting(); }
  std::vector<std::string> take_notes() override {
    for (const std::string& note : stream_->take_notes()) notes_.push_back(setting_ + ": " + note);
    return std::exchange(notes_, {});
  }

 private:
  std::string setting_;
  std::int64_t now_ns_ = 0;
  std::unique_ptr<encoding::EncodedStream> stream_;
  simulation::ReceiverRunner* device_;
  std::vector<std::string> notes_;
};

}  // namespace

std::unique_ptr<EpochPublisher> make_stream_publisher(
    const std::string& setting, std::string_view stream,
    const std::vector<encoding::ReceiverDescription>& receivers, const LinkOpener& open,
    simulation::ReceiverRunner* device) {
  try {
    encoding::StreamRequest request = encoding::parse_stream(stream);
    std::vector<std::string> names;
    names.reserve(receivers.size());
    for (const encoding::ReceiverDescription& receiver : receivers) names.push_back(receiver.name);
    if (request.receiver.empty()) request.receiver = names.front();
    const std::size_t r = encoding::find_receiver(request, names);
    std::shared_ptr<transport::Link> link = open ? open(request) : nullptr;
    if (!link) link = std::make_shared<transport::Link>(request.address);
    return std::make_unique<StreamPublisher>(setting, request, r, receivers[r], std::move(link), device);
  } catch (const InputError& e) {
    throw InputError(setting + ": " + e.problem(), e.hint());
  } catch (const OutputError& e) {
    throw OutputError(setting + ": " + e.problem(), e.hint());
  }
}

std::string stream_of_model(const std::string& setting, const std::string& stream, const std::string& model) {
  const std::size_t digits = model.find_last_not_of("0123456789") + 1;  // npos + 1 is 0
  std::string result;
  for (std::size_t at = 0; at < stream.size();) {
    const std::size_t open = std::min(stream.find('{', at), stream.size());
    result += stream.substr(at, open - at);
    const std::string name = stream.substr(open, stream.find('}', open) - open + 1);
    if (name == "{model}") result += model;
    if (name == "{number}") result += digits < model.size() ? model.substr(digits) : "0";
    if (!name.empty() && name != "{model}" && name != "{number}") {
      throw InputError(
          fmt::format("{}: '{}' is not known", setting, name),
          "write {model} for the name of the receiver's model, or {number} for the number at its end");
    }
    at = open + name.size();
  }
  return result;
}

void SkyWarnings::take(simulation::ReceiverRunner& receiver,
                       const std::function<void(const std::string& line, bool is_sky_warning)>& log) {
  const std::vector<std::string> is_sky_warning = receiver.sky().report.warnings();
  for (const std::string& line : receiver.take_warnings()) {
    const bool shared = std::find(is_sky_warning.begin(), is_sky_warning.end(), line) != is_sky_warning.end();
    if (shared) {
      const std::lock_guard lock(mutex_);
      if (!logged_.insert(line).second) continue;
    }
    log(line, shared);
  }
}

}  // namespace canyon::live
