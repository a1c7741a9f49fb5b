#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "canyon/outputs/live/controls.hpp"

namespace canyon::adapters::gz_sim {

/// Services of a world's receivers, gz.msgs.StringMsg in and out, see response():
///     /world/WORLD/canyon/get_options             a key, a section or nothing
///     /world/WORLD/canyon/set_options             YAML or JSON of what changes, for all receivers
///     /world/WORLD/canyon/get_faults              the timelines of faults
///     /world/WORLD/canyon/add_fault               YAML or JSON of one fault (docs/faults.md)
///     /world/WORLD/canyon/end_fault               its name
///     /world/WORLD/canyon/RECEIVER/get_options    and so on: of one
/// RECEIVER is the receiver's name with '/' for '::'. In addition to a sensor's topic there is
/// TOPIC/set_rate, as of Gazebo's own sensors: gz.msgs.Double in [Hz], no response. A request waits for
/// serve(), at most one second.
class OptionsService {
 public:
  explicit OptionsService(const std::string& world);
  ~OptionsService();
  OptionsService(const OptionsService&) = delete;
  OptionsService& operator=(const OptionsService&) = delete;

  /// Offers the services of a receiver, "iris::base_link::gps", served by serve() under that name.
  /// @param topic of its sensor. Returns RECEIVER's services' common part. Throws InputError if Gazebo or
  /// another receiver already uses a name.
  std::string add(const std::string& receiver, const std::string& topic);
  void remove(const std::string& receiver);
  /// The desk, for requests of other transports.
  [[nodiscard]] std::shared_ptr<live::RequestQueue> desk() const;
  /// For the simulation's thread, at every update, also while paused (live::RequestQueue::serve()).
  void serve(const std::function<std::vector<live::ReceiverHandle>()>& receivers);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace canyon::adapters::gz_sim
