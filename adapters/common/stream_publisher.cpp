#include "adapters/common/stream_publisher.hpp"

#include <exception>
#include <utility>

#include "canyon/base/input_error.hpp"

namespace canyon::adapters {
namespace {

class StreamPublisher final : public EpochPublisher {
 public:
  StreamPublisher(std::string setting, std::unique_ptr<output::EncodedStream> stream)
      : setting_(std::move(setting)), stream_(std::move(stream)) {}
  ~StreamPublisher() override {
    try {
      stream_->finish();
    } catch (const std::exception&) {  // a full disk leaves no file, and nobody is left to report to
    }
  }
  StreamPublisher(const StreamPublisher&) = delete;
  StreamPublisher& operator=(const StreamPublisher&) = delete;

  void publish(const ReceiverReport& report) override {
    if (broken_) return;
    try {
      stream_->serve();
      if (report.step == nullptr) return;
      for (const simulation::LiveReceiver::Step* step = report.step; step != nullptr;
           step = step->base.get()) {
        if (step->epoch.receiver != stream_->receiver()) continue;
        simulation::Epoch epoch = step->epoch;
        epoch.arrival = &step->arrival;
        stream_->write(epoch);
      }
    } catch (const std::exception& error) {
      broken_ = true;
      notes_.push_back(setting_ + ": " + error.what());
    }
  }
  std::vector<std::string> take_notes() override {
    for (const std::string& note : stream_->take_notes()) notes_.push_back(setting_ + ": " + note);
    return std::exchange(notes_, {});
  }

 private:
  std::string setting_;
  std::unique_ptr<output::EncodedStream> stream_;
  std::vector<std::string> notes_;
  bool broken_ = false;
};

}  // namespace

std::unique_ptr<EpochPublisher> make_stream_publisher(
    const std::string& setting, std::string_view stream,
    const std::vector<output::ReceiverDescription>& receivers, const LinkOpener& open) {
  try {
    output::StreamRequest request = output::parse_stream(stream);
    std::vector<std::string> names;
    for (const output::ReceiverDescription& receiver : receivers) names.push_back(receiver.name);
    if (request.receiver.empty()) request.receiver = names.front();
    const std::size_t r = output::find_receiver(request, names);
    std::shared_ptr<transport::Link> link = open ? open(request) : nullptr;
    return std::make_unique<StreamPublisher>(
        setting, link ? output::open_stream(request, r, receivers[r], std::move(link))
                      : output::open_stream(request, r, receivers[r]));
  } catch (const InputError& e) {
    throw InputError(setting + ": " + e.problem(), e.cure());
  }
}

void visit_streams(options::Visitor& v, const options::Field& field, std::vector<std::string>& streams) {
  v.texts(field, streams);
  if (!v.reads()) return;
  try {
    for (const std::string& text : streams) (void)output::format_named(output::parse_stream(text).format);
  } catch (const InputError& e) {
    throw v.fault(field.name, e.problem(), e.cure());
  }
}

}  // namespace canyon::adapters
