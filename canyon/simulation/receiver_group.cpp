#include "canyon/simulation/receiver_group.hpp"

#include <numeric>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"
#include "canyon/simulation/environment.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::simulation {

using geodesy::GpsTime;

ReceiverGroup::ReceiverGroup(RunnerConfig config, std::shared_ptr<CityScene> scene, GpsTime start,
                             std::shared_ptr<const BuiltSky> sky,
                             std::shared_ptr<const disturbance::Road> road)
    : configs_(config.receivers), seed_(config.seed) {
  if (!scene) throw InputError("a run needs a scene");
  for (ReceiverConfig& receiver : configs_)
    if (receiver.fixed) receiver.fixed->resolve(scene->city.frame);
  // Else the base of its one receiver is in another run.
  if (!config.allow_external_base || config.base() != nullptr) links_ = {configs_, seed_};
  order_.resize(configs_.size());
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  order_ = links_.order(std::move(order_));
  config.allow_external_base = true;  // for each ReceiverRunner
  for (const ReceiverConfig& receiver : configs_) {
    config.receivers = {receiver};
    receivers_.emplace_back(config, scene, start, sky, road);
    sky = receivers_.back().shared_sky();
    config.warnings.clear();  // they are reported once
  }
  last_.resize(configs_.size());
  restart_counts_.resize(configs_.size());
}

std::optional<Pose> ReceiverGroup::fixed_pose(std::size_t receiver, GpsTime time) const {
  if (!configs_[receiver].fixed) return std::nullopt;
  return Pose{time, configs_[receiver].fixed->position};
}

std::vector<ReceiverRunner::Step> ReceiverGroup::make(std::span<const Due> due, bool parallel) {
  std::vector<DueEpoch> epochs;
  epochs.reserve(due.size());
  for (const Due& each : due) {
    std::optional<GpsTime>& last = last_[each.receiver];
    if (last && each.time - *last < 0) restart();
    last = each.time;
    renew_link(each.receiver);
    epochs.push_back({each.receiver, each.time});
  }
  std::vector<ReceiverRunner::Step> steps(due.size());
  links_.make_epochs(epochs, parallel, [&](std::size_t i, auto came) -> const Epoch* {
    const Due& of = due[i];
    ReceiverRunner& receiver = receivers_[of.receiver];
    if (of.corrections) came = of.corrections;
    if (came) receiver.set_corrections(std::move(came));
    StepInputs inputs = of.inputs;
    if (configs_[of.receiver].fixed) inputs.continuous = true;
    steps[i] = of.antenna ? receiver.observe(*of.antenna, inputs) : receiver.observe_without_pose(of.time);
    steps[i].epoch.receiver = of.receiver;
    steps[i].epoch.arrival = &steps[i].arrival;
    return &steps[i].epoch;
  });
  return steps;
}

void ReceiverGroup::restart() {
  for (std::size_t r = 0; r < receivers_.size(); ++r) {
    receivers_[r].restart();
    renew_link(r);
  }
  last_.assign(receivers_.size(), std::nullopt);
}

void ReceiverGroup::renew_link(std::size_t receiver) {
  const ReceiverRunner& of = receivers_[receiver];
  if (std::exchange(restart_counts_[receiver], of.restart_count()) == of.restart_count()) return;
  if (const auto base = links_.base_of(receiver)) {
    links_.connect(receiver, *base, configs_[*base].fixed.has_value(), of.config().receiver().options, seed_);
  }
}

std::string ReceiverGroup::add_fault(const std::string& text, const std::string& source) {
  std::string name;
  for (ReceiverRunner& receiver : receivers_) name = receiver.add_fault(text, source);
  return name;
}

void ReceiverGroup::end_fault(const std::string& name) {
  std::vector<ReceiverRunner*> all;
  for (ReceiverRunner& receiver : receivers_) all.push_back(&receiver);
  (void)simulation::end_fault(all, name);
}

void finish_sinks(std::span<EpochSink* const> sinks, const EpochSink* broken, std::exception_ptr failure) {
  for (EpochSink* const sink : sinks) {
    if (sink == broken) continue;
    try {
      sink->finish();
    } catch (...) {
      if (!failure) failure = std::current_exception();
    }
  }
  if (failure) std::rethrow_exception(failure);
}

}  // namespace canyon::simulation
