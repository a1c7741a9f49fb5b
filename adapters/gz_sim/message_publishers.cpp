#include <fmt/format.h>
#include <gz/msgs/navsat.pb.h>

#include <cstdint>
#include <gz/transport/Node.hh>

#include "adapters/common/msgs/gnss_message.hpp"
#include "adapters/gz_sim/publishers.hpp"
#include "canyon/base/input_error.hpp"

namespace canyon::adapters::gz_sim {
namespace {

/// A topic for one type of message.
template <typename Message>
class Topic {
 public:
  explicit Topic(const std::string& name) : publisher_(node_.Advertise<Message>(name)) {
    if (!publisher_) {
      throw InputError(fmt::format("the topic '{}' cannot be published", name),
                       "use a name without blanks, '@', '~', ':=' or '//'");
    }
  }
  [[nodiscard]] bool has_listeners() const { return publisher_.HasConnections(); }
  void send() { (void)publisher_.Publish(message); }

  Message message;  ///< kept to reuse its memory

 private:
  gz::transport::Node node_;
  gz::transport::Node::Publisher publisher_;
};

class NavSatPublisher final : public live::EpochPublisher {
 public:
  NavSatPublisher(const std::string& topic, std::string frame_id)
      : topic_(topic), frame_id_(std::move(frame_id)) {}

  void publish(const live::ReceiverReport& report) override {
    if (!topic_.has_listeners()) return;
    if (!fill_navsat(report, frame_id_, sequence_, topic_.message)) return;
    ++sequence_;
    topic_.send();
  }

 private:
  Topic<gz::msgs::NavSat> topic_;
  std::string frame_id_;
  std::uint64_t sequence_ = 0;
};

class GnssPublisher final : public live::EpochPublisher {
 public:
  GnssPublisher(ReceiverIdentity identity, const std::string& topic)
      : identity_(std::move(identity)), topic_(topic) {}

  void publish(const live::ReceiverReport& report) override {
    if (!topic_.has_listeners()) return;
    fill_gnss_message(identity_, report, topic_.message);
    topic_.send();
  }

 private:
  ReceiverIdentity identity_;
  Topic<msgs::GnssReceiver> topic_;
};

}  // namespace

std::unique_ptr<live::EpochPublisher> make_navsat_publisher(const std::string& topic,
                                                            const std::string& frame_id) {
  return std::make_unique<NavSatPublisher>(topic, frame_id);
}

std::string gnss_topic_for(const std::string& navsat_topic, bool chosen_by_user) {
  const std::size_t last = navsat_topic.rfind('/');
  const bool whole = chosen_by_user || last == std::string::npos;
  return whole ? navsat_topic + "/gnss" : navsat_topic.substr(0, last) + "/gnss";
}

std::unique_ptr<live::EpochPublisher> make_gnss_publisher(const ReceiverIdentity& identity,
                                                          const std::string& topic) {
  return std::make_unique<GnssPublisher>(identity, topic);
}

}  // namespace canyon::adapters::gz_sim
