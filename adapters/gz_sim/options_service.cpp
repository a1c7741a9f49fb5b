#include "adapters/gz_sim/options_service.hpp"

#include <fmt/format.h>
#include <gz/msgs/double.pb.h>
#include <gz/msgs/stringmsg.pb.h>

#include <gz/common/Console.hh>
#include <gz/transport/Node.hh>
#include <gz/transport/TopicUtils.hh>
#include <map>

#include "canyon/base/input_error.hpp"

namespace canyon::adapters::gz_sim {
namespace {

using live::ControlService;
using live::kControlServices;

}  // namespace

struct OptionsService::Impl {
  explicit Impl(const std::string& world_name) : world(world_name) { offer(""); }
  ~Impl() { desk->close(); }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  /// The topic of a receiver, or of all receivers if `receiver` is empty.
  [[nodiscard]] std::string topic(const std::string& receiver, const ControlService& service) const {
    std::string path = receiver.empty() ? "" : receiver + "/";
    for (std::size_t at = 0; (at = path.find("::", at)) != std::string::npos;) path.replace(at, 2, "/");
    return gz::transport::TopicUtils::AsValidTopic(
        fmt::format("/world/{}/canyon/{}{}", world, path, service.name));
  }

  void offer(const std::string& receiver) {
    for (const ControlService& service : kControlServices) {
      const std::string name = topic(receiver, service);
      const auto [known, added] = offered.emplace(name, receiver);
      if (!added) {
        throw InputError(fmt::format("the service '{}' of receiver '{}' is already used by receiver '{}'",
                                     name, receiver, known->second),
                         "rename one: in Gazebo's topics, names that differ only in blanks are equal");
      }
      // A call in progress may outlive this object.
      std::function<bool(const gz::msgs::StringMsg&, gz::msgs::StringMsg&)> call =
          [desk = desk, receiver, kind = service.kind](const gz::msgs::StringMsg& request,
                                                       gz::msgs::StringMsg& reply) {
            reply.set_data(desk->submit({kind, receiver, request.data()}));
            return true;
          };
      if (!node.Advertise(name, call)) {
        throw InputError(fmt::format("the service '{}' cannot be offered", name),
                         "use only letters, digits and '_' in names of worlds and models");
      }
    }
  }

  void offer_rate(const std::string& receiver, const std::string& sensor_topic) {
    std::function<void(const gz::msgs::Double&)> call = [desk = desk,
                                                         receiver](const gz::msgs::Double& rate) {
      const std::string logged =
          desk->submit({live::OptionsRequest::Kind::Set, receiver, fmt::format("rate_hz: {}", rate.data())});
      if (logged.starts_with("refused")) gzerr << "[canyon] " << receiver << ": set_rate: " << logged << "\n";
    };
    // If two sensors have one topic, the first has the service.
    if (node.Advertise(sensor_topic + "/set_rate", call)) rates[receiver] = sensor_topic + "/set_rate";
  }

  std::string world;
  std::map<std::string, std::string> offered;  // services and their receivers
  std::map<std::string, std::string> rates;    // by receiver: the service of its topic
  std::shared_ptr<live::RequestQueue> desk = std::make_shared<live::RequestQueue>();
  gz::transport::Node node;  // last member: its services end first
};

OptionsService::OptionsService(const std::string& world) : impl_(std::make_unique<Impl>(world)) {}
OptionsService::~OptionsService() = default;

std::string OptionsService::add(const std::string& receiver, const std::string& topic) {
  impl_->offer(receiver);
  impl_->offer_rate(receiver, topic);
  const std::string first = impl_->topic(receiver, kControlServices[0]);
  return first.substr(0, first.rfind('/'));
}

void OptionsService::remove(const std::string& receiver) {
  for (const ControlService& service : kControlServices) {
    (void)impl_->node.UnadvertiseSrv(impl_->topic(receiver, service));
    impl_->offered.erase(impl_->topic(receiver, service));
  }
  if (const auto rate = impl_->rates.find(receiver); rate != impl_->rates.end()) {
    (void)impl_->node.UnadvertiseSrv(rate->second);
    impl_->rates.erase(rate);
  }
}

std::shared_ptr<live::RequestQueue> OptionsService::desk() const {
  return impl_->desk;
}

void OptionsService::serve(const std::function<std::vector<live::ReceiverHandle>()>& receivers) {
  impl_->desk->serve(receivers);
}

}  // namespace canyon::adapters::gz_sim
