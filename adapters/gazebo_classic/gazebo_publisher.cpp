#include <gazebo/msgs/MsgFactory.hh>
#include <gazebo/transport/transport.hh>

#include "adapters/common/msgs/gnss_message.hpp"
#include "adapters/gazebo_classic/publishers.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

// Programs that load this library make the type by its name: `gz topic` with LD_PRELOAD.
boost::shared_ptr<google::protobuf::Message> make_message() {
  return boost::shared_ptr<google::protobuf::Message>(new msgs::GnssReceiver);
}
[[maybe_unused]] const bool kRegistered = [] {
  gazebo::msgs::MsgFactory::RegisterMsg("canyon.msgs.GnssReceiver", make_message);
  return true;
}();

class GazeboPublisher final : public live::EpochPublisher {
 public:
  GazeboPublisher(const gazebo::transport::NodePtr& node, const ReceiverIdentity& identity)
      : identity_(identity) {
    const std::string sensor = identity.sensor.empty() ? "" : identity.sensor + "/";
    publisher_ = node->Advertise<msgs::GnssReceiver>("~/" + identity.model + "/" + sensor + "gnss", kQueue);
  }

  void publish(const live::ReceiverReport& report) override {
    if (!publisher_->HasConnections()) return;
    fill_gnss_message(identity_, report, message_);
    publisher_->Publish(message_);
  }

 private:
  static constexpr unsigned kQueue = 100;  ///< messages; the oldest are dropped first

  ReceiverIdentity identity_;
  gazebo::transport::PublisherPtr publisher_;
  msgs::GnssReceiver message_;  ///< kept for its memory
};

}  // namespace

std::unique_ptr<live::EpochPublisher> make_gazebo_publisher(const gazebo::transport::NodePtr& node,
                                                            const ReceiverIdentity& identity) {
  return std::make_unique<GazeboPublisher>(node, identity);
}

}  // namespace canyon::adapters::gazebo_classic
