#include "canyon/live/host_bases.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "canyon/base/input_error.hpp"

namespace canyon::live {
namespace {

// Places of a rover and its base in the links of the two.
constexpr std::size_t kRover = 0, kBase = 1;

const std::string& name_of(const HostedReceiver& receiver) {
  return receiver.receiver().config().receiver().options.name;
}

}  // namespace

void HostBases::add(HostedReceiver& receiver, std::uint64_t vehicle) {
  members_.push_back({&receiver, vehicle, nullptr, {}, 0});
}

void HostBases::remove(const HostedReceiver& receiver) {
  std::erase_if(members_, [&](const Member& member) { return member.receiver == &receiver; });
  for (Member& member : members_) {
    if (member.base != &receiver) continue;
    member.base = nullptr;
    member.links.reset();
  }
}

HostBases::Member* HostBases::member_of(const HostedReceiver* receiver) {
  const auto at = std::find_if(members_.begin(), members_.end(),
                               [&](const Member& member) { return member.receiver == receiver; });
  return at == members_.end() ? nullptr : &*at;
}

HostBases::Member* HostBases::named(const std::string& name, const HostedReceiver& except) {
  const auto at = std::find_if(members_.begin(), members_.end(), [&](const Member& member) {
    return member.receiver != &except && name_of(*member.receiver) == name;
  });
  return at == members_.end() ? nullptr : &*at;
}

std::string HostBases::names() const {
  std::vector<std::string> all;
  for (const Member& member : members_) all.push_back(name_of(*member.receiver));
  return fmt::format("{}", fmt::join(all, ", "));
}

void HostBases::sort(std::vector<HostedReceiver*>& due) {
  for (Member& member : members_) {
    if (member.receiver->begun_ns() < member.last_ns) {  // the world was reset
      member.base = nullptr;
      member.links.reset();
    }
    member.last_ns = member.receiver->begun_ns();
    find_base(member);
  }
  const auto depth = [this](const HostedReceiver* receiver) {
    int steps = 0;
    for (const HostedReceiver* at = receiver; at != nullptr && steps < static_cast<int>(members_.size());
         ++steps) {
      const Member* member = member_of(at);
      at = member == nullptr ? nullptr : member->base;
    }
    return steps;
  };
  std::stable_sort(due.begin(), due.end(),
                   [&](const HostedReceiver* a, const HostedReceiver* b) { return depth(a) < depth(b); });
}

void HostBases::find_base(Member& member) {
  HostedReceiver& rover = *member.receiver;
  const std::string from = rover.base_elsewhere();
  if (from.empty() || member.base != nullptr) return;
  Member* base = named(from, rover);
  if (base == nullptr) {
    return rover.say(HostedReceiver::Tone::Warning,
                     fmt::format("there is no receiver '{}' in this world yet, whose corrections it takes; "
                                 "receivers: {}; give one <name>{}</name>",
                                 from, names(), from));
  }
  const simulation::LiveConfig& own = rover.receiver().config();
  const simulation::LiveConfig& others = base->receiver->receiver().config();
  if (own.seed != others.seed || rover.receiver().start() != base->receiver->receiver().start()) {
    rover.say(HostedReceiver::Tone::Warning,
              fmt::format("its base '{}' has another seed or start: errors of the sky do not cancel; give "
                          "both the same <seed> and <start>",
                          from));
  }
  std::vector<simulation::ReceiverConfig> receivers{own.receiver(), others.receiver()};
  receivers[kBase].options.corrections = {};
  if (base->vehicle != member.vehicle) receivers[kBase].fixed.emplace();
  try {
    member.links.emplace(receivers, own.seed);
    member.base = base->receiver;
  } catch (const InputError& e) {
    rover.say(HostedReceiver::Tone::Error, e.what());
  }
}

void HostBases::finish(HostedReceiver& receiver) {
  Member* member = member_of(&receiver);
  if (member == nullptr) return receiver.finish();
  if (member->links) {
    const geodesy::GpsTime now = receiver.receiver().start() + std::chrono::nanoseconds(receiver.begun_ns());
    if (auto came = member->links->take(kRover, now)) receiver.receiver().give(std::move(came));
  }
  receiver.finish();
  const simulation::LiveReceiver::Step* step = receiver.step();
  if (step == nullptr) return;
  const auto send = [step](simulation::CorrectionLinks& links, std::size_t as) {
    simulation::Epoch epoch = step->epoch;
    epoch.receiver = as;
    links.send(epoch);
  };
  if (member->links) send(*member->links, kRover);
  for (Member& other : members_) {
    if (other.base == &receiver && other.links) send(*other.links, kBase);
  }
}

}  // namespace canyon::live
