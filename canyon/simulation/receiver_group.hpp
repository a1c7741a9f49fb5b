#pragma once

#include <cstddef>
#include <exception>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "canyon/simulation/correction_links.hpp"
#include "canyon/simulation/receiver_runner.hpp"

namespace canyon::simulation {

/// The receivers of one world with the corrections between them. Computes their epochs from given times and
/// poses, which come from a trajectory (Simulation), arriving poses (live::Session) or a host's steps
/// (live::HostedReceiver).
class ReceiverGroup {
 public:
  /// A receiver for each of `config.receivers`; other parameters as ReceiverRunner(). Throws as
  /// ReceiverRunner() and check_corrections(); resolves fixed positions by FixedPosition::resolve().
  ReceiverGroup(RunnerConfig config, std::shared_ptr<CityScene> scene, geodesy::GpsTime start,
                std::shared_ptr<const BuiltSky> sky = nullptr,
                std::shared_ptr<const disturbance::Road> road = nullptr);

  [[nodiscard]] std::size_t size() const { return receivers_.size(); }
  [[nodiscard]] ReceiverRunner& operator[](std::size_t receiver) { return receivers_[receiver]; }
  [[nodiscard]] const ReceiverRunner& operator[](std::size_t receiver) const { return receivers_[receiver]; }
  /// All receivers, a base before its rovers.
  [[nodiscard]] const std::vector<std::size_t>& order() const { return order_; }
  [[nodiscard]] std::optional<std::size_t> base_of(std::size_t receiver) const {
    return links_.base_of(receiver);
  }
  /// The pose of a receiver with a fixed position; empty for others.
  [[nodiscard]] std::optional<Pose> fixed_pose(std::size_t receiver, geodesy::GpsTime time) const;

  /// One epoch of one receiver.
  struct Due {
    std::size_t receiver = 0;
    geodesy::GpsTime time;
    std::optional<Pose> antenna =
        {};  ///< at `time`; empty: there is no truth (ReceiverRunner::observe_without_pose())
    StepInputs inputs = {};
    /// Corrections from outside, instead of those of a receiver of this run; null: none.
    std::shared_ptr<const rtk::Corrections> corrections = nullptr;
  };
  /// Computes the epochs, with Epoch::receiver and Epoch::arrival, in the order of `due`, each from the
  /// corrections that have arrived for it. Epochs of a receiver must be in order of time and after those of
  /// its base; a time that goes back restarts the run.
  /// @param parallel compute epochs of independent receivers on several threads
  [[nodiscard]] std::vector<ReceiverRunner::Step> make(std::span<const Due> due, bool parallel);

  /// Restarts as constructed.
  void restart();

  /// ReceiverRunner::add_fault() and end_fault() of all receivers; a fault may affect only some of them.
  std::string add_fault(const std::string& text, const std::string& source = "fault");
  void end_fault(const std::string& name);

 private:
  /// Resets the link to a receiver that has restarted, with its current options.
  void renew_link(std::size_t receiver);

  std::vector<ReceiverRunner> receivers_;
  std::vector<ReceiverConfig> configs_;
  std::uint64_t seed_;
  CorrectionLinks links_;
  std::vector<std::size_t> order_;
  std::vector<std::optional<geodesy::GpsTime>> last_;  // epoch of each
  std::vector<int> restart_counts_;  // ReceiverRunner::started() of each, at the last renew_link()
};

/// Finishes all sinks except `broken`, which has failed (its file stays absent); null: all. Rethrows the
/// first exception, or the earlier `failure` of the run.
void finish_sinks(std::span<EpochSink* const> sinks, const EpochSink* broken, std::exception_ptr failure);

}  // namespace canyon::simulation
