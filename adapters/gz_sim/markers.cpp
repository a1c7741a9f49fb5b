#include <gz/msgs/boolean.pb.h>
#include <gz/msgs/marker_v.pb.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <atomic>
#include <exception>
#include <gz/transport/Node.hh>
#include <set>
#include <utility>

#include "adapters/common/ray_visuals.hpp"
#include "adapters/gz_sim/publishers.hpp"

namespace canyon::adapters::gz_sim {
namespace {

constexpr const char* kService = "/marker_array";
constexpr double kUpdateInterval_s = 0.1;  // of wall time
/// Everything is sent again after this time, for clients that connected unnoticed.
constexpr double kRepeatInterval_s = 5;
/// Interval of searches for clients. A query earlier than this after the transport's start would block.
constexpr double kLookInterval_s = 1, kFirstLook_s = 2.5;
/// A client without a response for this time is dropped; until then nothing more is sent to it.
constexpr double kPatience_s = 5;

template <typename Vector>
void set_vector(Vector* to, double x, double y, double z) {
  to->set_x(x);
  to->set_y(y);
  to->set_z(z);
}

void fill(const VisualShape& shape, bool with_colour, gz::msgs::Marker& marker) {
  const double width = 2 * shape.radius;  // markers are shapes of size 1, scaled
  const bool cylinder = shape.kind == VisualShape::Kind::Cylinder;
  const Eigen::Quaterniond rotation =
      cylinder ? Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d::UnitZ(), shape.axis)
               : Eigen::Quaterniond::Identity();
  marker.set_action(gz::msgs::Marker::ADD_MODIFY);
  marker.set_type(cylinder ? gz::msgs::Marker::CYLINDER : gz::msgs::Marker::SPHERE);
  set_vector(marker.mutable_scale(), width, width, cylinder ? shape.length : width);
  auto* pose = marker.mutable_pose();
  set_vector(pose->mutable_position(), shape.centre.x(), shape.centre.y(), shape.centre.z());
  pose->mutable_orientation()->set_w(rotation.w());
  set_vector(pose->mutable_orientation(), rotation.x(), rotation.y(), rotation.z());
  if (!with_colour) return;  // expensive for clients
  set_material(*marker.mutable_material(), shape);
}

class Markers final : public live::EpochPublisher {
 public:
  Markers(const ReceiverIdentity& identity, const VisualSettings& settings)
      : namespace_("canyon/" + identity.link + "/" + identity.sensor),
        settings_(settings),
        ledger_([id = std::uint32_t{0}]() mutable { return ++id; }) {}  // 0 would mean any number

  ~Markers() override {
    try {
      if (!present_ || ledger_.clear().empty()) return;
      gz::msgs::Marker_V all;
      add(all).set_action(gz::msgs::Marker::DELETE_ALL);
      send(all);
    } catch (const std::exception&) {  // shapes remain in the picture
    }
  }
  Markers(const Markers&) = delete;
  Markers& operator=(const Markers&) = delete;

  void publish(const live::ReceiverReport& report) override {
    const double now = steady_now_s();
    if (!updates_.due(now) || !look_for_client(now)) return;
    update(visual_shapes(report, settings_), now);
  }

  void reset() override {
    if (present_) update({}, steady_now_s());
    updates_.reset();
  }

 private:
  /// Whether there is a client for markers. A new client gets everything.
  [[nodiscard]] bool look_for_client(double now) {
    if (now - begin_s_ < kFirstLook_s || !looks_.due(now)) return present_;
    std::vector<gz::transport::ServicePublisher> found;
    (void)node_.ServiceInfo(kService, found);
    std::set<std::string> clients;
    for (const auto& each : found) clients.insert(each.PUuid());
    if (!std::includes(clients_.begin(), clients_.end(), clients.begin(), clients.end())) everything_ = true;
    clients_ = std::move(clients);
    present_ = !clients_.empty();
    if (!present_) (void)ledger_.clear();
    return present_;
  }

  void update(const std::vector<VisualShape>& shapes, double now) {
    if (*awaiting_reply_) {
      if (now - sent_s_ < kPatience_s) return;
      everything_ = true;  // its last message may be lost
    }
    if (repeats_.due(now)) everything_ = true;
    gz::msgs::Marker_V message;
    for (const VisualLedger::Change& change : ledger_.update(shapes, std::exchange(everything_, false))) {
      gz::msgs::Marker& marker = add(message);
      marker.set_id(change.id);
      if (change.visible) {
        const bool back = removed_.erase(change.id) != 0;
        fill(change.shape, change.whole || back, marker);
      } else {
        marker.set_action(gz::msgs::Marker::DELETE_MARKER);
        removed_.insert(change.id);
      }
    }
    if (message.marker_size() == 0) return;
    sent_s_ = now;
    send(message);
  }

  [[nodiscard]] gz::msgs::Marker& add(gz::msgs::Marker_V& message) const {
    gz::msgs::Marker& marker = *message.add_marker();
    marker.set_ns(namespace_);
    return marker;
  }

  void send(const gz::msgs::Marker_V& message) {
    awaiting_reply_ = std::make_shared<std::atomic<bool>>(true);
    // The response may arrive after this object's destruction.
    std::function<void(const gz::msgs::Boolean&, bool)> answered =
        [unanswered = awaiting_reply_](const gz::msgs::Boolean&, bool) { *unanswered = false; };
    (void)node_.Request(kService, message, answered);
  }

  std::string namespace_;
  VisualSettings settings_;
  VisualLedger ledger_;
  std::set<std::uint32_t> removed_;  // by their ids: clients have deleted their colours
  RateLimit updates_{kUpdateInterval_s};
  RateLimit repeats_{kRepeatInterval_s};
  RateLimit looks_{kLookInterval_s};
  double begin_s_ = steady_now_s();
  double sent_s_ = 0;
  bool present_ = false;
  bool everything_ = false;
  std::set<std::string> clients_;  // by their processes
  std::shared_ptr<std::atomic<bool>> awaiting_reply_ = std::make_shared<std::atomic<bool>>(false);
  gz::transport::Node node_;
};

}  // namespace

std::unique_ptr<live::EpochPublisher> make_markers(const ReceiverIdentity& identity,
                                                   const VisualSettings& settings) {
  return std::make_unique<Markers>(identity, settings);
}

}  // namespace canyon::adapters::gz_sim
