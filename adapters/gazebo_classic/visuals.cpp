#include <Eigen/Geometry>
#include <exception>
#include <gazebo/common/Console.hh>
#include <gazebo/common/Exception.hh>
#include <gazebo/msgs/msgs.hh>
#include <gazebo/physics/PhysicsIface.hh>
#include <gazebo/transport/Node.hh>
#include <gazebo/transport/Publisher.hh>
#include <memory>
#include <string>
#include <utility>

#include "adapters/common/ray_visuals.hpp"
#include "adapters/gazebo_classic/ignition_types.hpp"
#include "adapters/gazebo_classic/publishers.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

constexpr double kUpdateInterval_s = 0.1;  // of wall time
/// Everything is sent again after this time, for clients that connected unnoticed.
constexpr double kRepeatInterval_s = 5;

void fill(gazebo::msgs::Visual& message, const VisualLedger::Change& change) {
  const VisualShape& shape = change.shape;
  ignition::math::Quaterniond rotation;
  gazebo::msgs::Geometry* geometry = message.mutable_geometry();
  if (shape.kind == VisualShape::Kind::Cylinder) {
    rotation.From2Axes(ignition::math::Vector3d::UnitZ, ignition_from(shape.axis));
    geometry->set_type(gazebo::msgs::Geometry::CYLINDER);
    geometry->mutable_cylinder()->set_radius(shape.radius);
    geometry->mutable_cylinder()->set_length(shape.length);
  } else {
    geometry->set_type(gazebo::msgs::Geometry::SPHERE);
    geometry->mutable_sphere()->set_radius(shape.radius);
  }
  gazebo::msgs::Set(message.mutable_pose(), ignition::math::Pose3d(ignition_from(shape.centre), rotation));
  message.set_visible(true);
  // The rest is expensive for clients, which recompile their shaders for each colour.
  if (!change.whole) return;
  message.set_cast_shadows(false);
  message.set_transparency(1 - shape.colour.a);
  set_material(*message.mutable_material(), shape);
}

/// Draws by messages on ~/visual, subscribed to by every scene, in clients and of camera sensors. (Markers
/// reach only one scene: they are a service, handled by the first to respond.) Shapes belong to the world and
/// not to the vehicle, so that its visuals, frames and selection are unaffected.
class SceneVisuals final : public live::EpochPublisher {
 public:
  SceneVisuals(const gazebo::transport::NodePtr& node, const ReceiverIdentity& identity,
               const VisualSettings& settings)
      : node_(node),
        world_(identity.world),
        // The name has a number, so that a successor does not inherit shapes that are being removed.
        prefix_("gnss_" + identity.model + "_" + std::to_string(gazebo::physics::getUniqueId()) + "_"),
        settings_(settings),
        ledger_([] { return gazebo::physics::getUniqueId(); }),
        visuals_(node->Advertise<gazebo::msgs::Visual>("~/visual", kQueueLimit)),
        requests_(node->Advertise<gazebo::msgs::Request>("~/request", kQueueLimit)) {}

  ~SceneVisuals() override {
    safely([this] { remove(); });
  }
  SceneVisuals(const SceneVisuals&) = delete;
  SceneVisuals& operator=(const SceneVisuals&) = delete;

  void publish(const live::ReceiverReport& report) override {
    safely([&] {
      const double now = steady_now_s();
      if (!updates_.due(now)) return;
      const bool has_new_requests = subscriber_arrived();
      send(visual_shapes(report, settings_), repeats_.due(now) || has_new_requests);
    });
  }

  void reset() override {
    safely([this] {
      send({}, false);
      updates_.reset();
    });
  }

 private:
  static constexpr unsigned kQueueLimit = 5000;  // a few updates of every shape

  /// A drawing error must not end the simulation.
  template <typename Action>
  void safely(Action action) noexcept {
    try {
      action();
    } catch (const std::exception& e) {
      if (!std::exchange(logged_, true))
        gzwarn << "[canyon] rays and bubble are not drawn: " << e.what() << "\n";
    } catch (const gazebo::common::Exception& e) {  // no std::exception
      if (!std::exchange(logged_, true))
        gzwarn << "[canyon] rays and bubble are not drawn: " << e.GetErrorStr() << "\n";
    }
  }

  [[nodiscard]] bool subscriber_arrived() {
    const unsigned clients = visuals_->GetRemoteSubscriptionCount();
    const bool more = clients > clients_;
    clients_ = clients;
    return more;
  }

  void send(const std::vector<VisualShape>& shapes, bool everything) {
    for (const VisualLedger::Change& change : ledger_.update(shapes, everything)) {
      gazebo::msgs::Visual message = message_for(change.name, change.id);
      if (change.visible)
        fill(message, change);
      else
        message.set_visible(false);
      visuals_->Publish(message);
    }
  }

  [[nodiscard]] gazebo::msgs::Visual message_for(const std::string& name, std::uint32_t id) const {
    gazebo::msgs::Visual message;
    message.set_name(prefix_ + name);
    message.set_id(id);
    message.set_parent_name(world_);  // a scene has its world's name
    return message;
  }

  /// Hides all shapes first, since scenes process a removal only with their next frame.
  void remove() {
    send({}, false);
    for (const std::string& name : ledger_.clear()) {
      const std::unique_ptr<gazebo::msgs::Request> request(
          gazebo::msgs::CreateRequest("entity_delete", prefix_ + name));
      requests_->Publish(*request, true);
    }
  }

  gazebo::transport::NodePtr node_;
  std::string world_;
  std::string prefix_;
  VisualSettings settings_;
  VisualLedger ledger_;
  RateLimit updates_{kUpdateInterval_s};
  RateLimit repeats_{kRepeatInterval_s};
  unsigned clients_ = 0;
  bool logged_ = false;
  gazebo::transport::PublisherPtr visuals_, requests_;
};

}  // namespace

std::unique_ptr<live::EpochPublisher> make_visuals(const gazebo::transport::NodePtr& node,
                                                   const ReceiverIdentity& identity,
                                                   const VisualSettings& settings) {
  return std::make_unique<SceneVisuals>(node, identity, settings);
}

}  // namespace canyon::adapters::gazebo_classic
