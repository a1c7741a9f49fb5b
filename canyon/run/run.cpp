#include "canyon/run/run.hpp"

#include <numeric>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/city/city.hpp"

namespace canyon::simulation {

using geodesy::GpsTime;

Run::Run(LiveConfig config, std::shared_ptr<CityScene> scene, GpsTime start,
         std::shared_ptr<const BuiltSky> sky, std::shared_ptr<const disturbance::Road> way)
    : configs_(config.receivers),
      seed_(config.seed),
      linked_(!config.bases_elsewhere || config.base() != nullptr) {
  if (!scene) throw InputError("a run needs a scene");
  for (ReceiverConfig& receiver : configs_)
    if (receiver.fixed) receiver.fixed->settle(scene->city.frame);
  if (linked_) links_ = {configs_, seed_};
  order_.resize(configs_.size());
  std::iota(order_.begin(), order_.end(), std::size_t{0});
  order_ = links_.order(std::move(order_));
  config.bases_elsewhere = true;  // for each alone
  for (const ReceiverConfig& receiver : configs_) {
    config.receivers = {receiver};
    receivers_.emplace_back(config, scene, start, sky, way);
    sky = receivers_.back().shared_sky();
    config.warnings.clear();  // they are said once
  }
  last_.resize(configs_.size());
}

std::optional<Pose> Run::fixed_pose(std::size_t receiver, GpsTime time) const {
  if (!configs_[receiver].fixed) return std::nullopt;
  return Pose{time, configs_[receiver].fixed->place};
}

std::vector<LiveReceiver::Step> Run::make(std::span<Due> due, bool parallel) {
  std::vector<DueEpoch> epochs;
  epochs.reserve(due.size());
  for (const Due& each : due) {
    std::optional<GpsTime>& last = last_[each.receiver];
    if (last && each.time - *last < 0) restart();
    last = each.time;
    epochs.push_back({each.receiver, each.time});
  }
  std::vector<LiveReceiver::Step> steps(due.size());
  links_.make_epochs(epochs, parallel, [&](std::size_t i, auto came) -> const Epoch* {
    const Due& of = due[i];
    LiveReceiver& receiver = receivers_[of.receiver];
    if (of.corrections) came = of.corrections;
    if (came) receiver.give(std::move(came));
    EpochInputs inputs = of.inputs;
    if (configs_[of.receiver].fixed) inputs.continuous = true;
    steps[i] = of.antenna ? receiver.observe(*of.antenna, inputs) : receiver.lose(of.time);
    steps[i].epoch.receiver = of.receiver;
    steps[i].epoch.arrival = &steps[i].arrival;
    return &steps[i].epoch;
  });
  return steps;
}

void Run::restart() {
  for (LiveReceiver& receiver : receivers_) receiver.restart();
  last_.assign(receivers_.size(), std::nullopt);
  if (linked_) links_ = {configs_, seed_};
}

std::string Run::add_fault(const std::string& text, const std::string& source) {
  std::string name;
  for (LiveReceiver& receiver : receivers_) name = receiver.add_fault(text, source);
  return name;
}

void Run::end_fault(const std::string& name) {
  std::optional<InputError> refused;
  std::size_t ended = 0;
  for (LiveReceiver& receiver : receivers_) {
    try {
      receiver.end_fault(name);
      ++ended;
    } catch (const InputError& error) {
      refused = error;
    }
  }
  if (ended == 0 && refused) throw *refused;
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
