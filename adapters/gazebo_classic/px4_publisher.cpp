#include <gazebo/common/Console.hh>
#include <gazebo/transport/transport.hh>

#include "adapters/gazebo_classic/publishers.hpp"
#include "adapters/gazebo_classic/sitl_gps.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

class Px4Publisher final : public live::EpochPublisher {
 public:
  Px4Publisher(const gazebo::transport::NodePtr& node, const ReceiverIdentity& identity,
               const HostSettings& settings)
      : name_("plugin '" + identity.plugin + "' of '" + identity.link + "'") {
    const std::string& name = settings.px4_topic.empty() ? identity.parent : settings.px4_topic;
    publisher_ = node->Advertise("~/" + identity.model + "/link/" + name, kSitlGpsType, kQueue);
  }

  void publish(const live::ReceiverReport& report) override {
    if (!publisher_->HasConnections()) return;
    const auto gps = sitl_gps_of(report);
    if (!gps) return;
    if (const auto* message = message_.fill(*gps)) {
      publisher_->Publish(*message);
    } else if (!warned_) {
      gzwarn << "[canyon] " << name_ << ": the " << kSitlGpsType << " of this process requires "
             << message_.problem() << ", which Canyon does not support: PX4 gets no position\n";
      warned_ = true;
    }
  }

 private:
  static constexpr unsigned kQueue = 10;  ///< messages, as in PX4's own plugin

  std::string name_;  ///< for messages
  gazebo::transport::PublisherPtr publisher_;
  SitlGpsMessage message_;
  bool warned_ = false;
};

}  // namespace

std::unique_ptr<live::EpochPublisher> make_px4_publisher(const gazebo::transport::NodePtr& node,
                                                         const ReceiverIdentity& identity,
                                                         const HostSettings& settings) {
  return std::make_unique<Px4Publisher>(node, identity, settings);
}

}  // namespace canyon::adapters::gazebo_classic
