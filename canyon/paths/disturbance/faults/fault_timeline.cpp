#include "canyon/paths/disturbance/faults/fault_timeline.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <map>
#include <utility>

#include "canyon/base/options/values.hpp"

namespace canyon::disturbance {
namespace {

/// More faults than any scenario has. Limits the faults that clients of a running receiver add.
constexpr std::size_t kMaxFaults = 10'000;

}  // namespace

/// Effects on one receiver; a restart rebuilds them.
class FaultTimeline::Effects final : public Disturbance {
 public:
  Effects(std::shared_ptr<const FaultTimeline> timeline, std::uint64_t seed, std::string stream_name)
      : timeline_(std::move(timeline)), seed_(seed), stream_name_(std::move(stream_name)) {}

  void apply(const propagation::Antenna& antenna, propagation::Arrival& arrival) override {
    if (!(timeline_->surroundings_ == around_)) {
      around_ = timeline_->surroundings_;
      effects_.clear();
    }
    for (const Entry& entry : timeline_->entries_) {
      const Fault& fault = entry.fault;
      const FaultContext context = context_of(fault);
      if (antenna.time < context.begin || (context.end && antenna.time >= *context.end)) {
        effects_.erase(entry.number);
        continue;
      }
      std::unique_ptr<Disturbance>& effect = effects_[entry.number];
      if (!effect) effect = fault.settings->make(context);
      effect->apply(antenna, arrival);
    }
  }

  void happen(const propagation::Antenna& antenna, ReceiverEvents& events) override {
    for (const Entry& entry : timeline_->entries_) {
      keep_fixes(entry.fault, antenna.time, events.fixes_from);
      const auto effect = effects_.find(entry.number);
      if (effect == effects_.end()) continue;
      effect->second->happen(antenna, events);
      events.faults.push_back(entry.fault.name);
    }
  }

 private:
  /// Extends the stored fixes to those that a late fix may report from now on.
  void keep_fixes(const Fault& fault, geodesy::GpsTime now, std::optional<geodesy::GpsTime>& from) const {
    const double late_s = fault.settings->late_s();
    if (late_s == 0 || (fault.until_s && now >= timeline_->start_ + *fault.until_s)) return;
    const geodesy::GpsTime first = std::max(now, timeline_->start_ + fault.from_s) - late_s;
    from = std::min(first, from.value_or(first));
  }
  [[nodiscard]] FaultContext context_of(const Fault& fault) const {
    FaultContext context;
    context.name = fault.name;
    context.begin = timeline_->start_ + fault.from_s;
    if (fault.until_s) context.end = timeline_->start_ + *fault.until_s;
    context.seed = seed_;
    context.receiver = stream_name_;
    context.sky = around_.sky;
    context.city = around_.city;
    context.rays = around_.rays;
    return context;
  }

  std::shared_ptr<const FaultTimeline> timeline_;
  std::uint64_t seed_;
  std::string stream_name_;
  Surroundings around_;
  std::map<std::uint64_t, std::unique_ptr<Disturbance>> effects_;  // by Entry::number
};

FaultTimeline::FaultTimeline(geodesy::GpsTime start, const std::vector<Fault>& faults, std::string receiver)
    : start_(start), receiver_(std::move(receiver)) {
  for (const Fault& fault : faults) add(fault);
}

void FaultTimeline::set_surroundings(Surroundings surroundings) {
  surroundings_ = std::move(surroundings);
  if (!surroundings_.sky) return;
  for (const Entry& entry : entries_) entry.fault.check(*surroundings_.sky);
}

bool FaultTimeline::add(Fault fault) {
  if (fault.kind == nullptr || !fault.settings)
    throw InputError(fmt::format("fault '{}' has no kind", fault.name), "give the settings of its kind");
  const auto same = [&](const Entry& entry) { return entry.fault.name == fault.name; };
  if (std::any_of(entries_.begin(), entries_.end(), same))
    throw InputError(fmt::format("two faults have the name '{}'", fault.name),
                     "give each fault another name");
  if (entries_.size() >= kMaxFaults) {
    throw InputError(fmt::format("a timeline has at most {} faults, ended ones included", kMaxFaults),
                     "restart the run");
  }
  if (surroundings_.sky) fault.check(*surroundings_.sky);
  ++next_;  // also for other receivers' faults, so that all receivers of a host use the same numbers
  if (!fault.concerns(receiver_)) return false;
  entries_.push_back({next_, std::move(fault)});
  return true;
}

void FaultTimeline::end(const std::string& name, double at_s) {
  std::vector<std::string> names;
  for (Entry& entry : entries_) {
    std::optional<double>& until_s = entry.fault.until_s;
    if (until_s && *until_s <= at_s) continue;
    if (entry.fault.name == name) {
      until_s = at_s;
      return;
    }
    names.push_back(entry.fault.name);
  }
  throw InputError(fmt::format("no active or future fault '{}'", name),
                   names.empty() ? std::string("there is no fault")
                                 : fmt::format("use one of {}", fmt::join(names, ", ")));
}

std::vector<FaultState> FaultTimeline::states(double now_s) const {
  std::vector<FaultState> states;
  for (const Entry& entry : entries_) {
    const Fault& fault = entry.fault;
    states.push_back({fault.name, fault.kind->name, fault.from_s, fault.until_s,
                      now_s >= fault.from_s && (!fault.until_s || now_s < *fault.until_s)});
  }
  return states;
}

DisturbanceSource FaultTimeline::source(std::shared_ptr<const FaultTimeline> timeline) {
  std::string name = "faults";
  for (const Entry& entry : timeline->entries_) name += "\n" + options::exact_text(entry.fault);
  return {std::move(name),
          [timeline = std::move(timeline)](std::uint64_t seed, const std::string& stream_name) {
            return std::make_unique<Effects>(timeline, seed, stream_name);
          }};
}

}  // namespace canyon::disturbance
