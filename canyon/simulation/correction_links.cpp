#include "canyon/simulation/correction_links.hpp"

#include <tbb/parallel_for.h>
#include <algorithm>
#include <array>
#include <utility>

#include "canyon/receiver/corrections.hpp"
#include "canyon/receiver/receiver_options.hpp"

namespace canyon::simulation {

CorrectionLinks::CorrectionLinks(const std::vector<ReceiverConfig>& receivers, std::uint64_t seed)
    : nodes_(receivers.size()) {
  for (std::size_t r = 0; r < receivers.size(); ++r) {
    check_corrections(receivers, r);
    const auto base = index_of_base(receivers, receivers[r]);
    if (base) connect(r, *base, receivers[*base].fixed.has_value(), receivers[r].options, seed);
  }
}

CorrectionLinks::Node& CorrectionLinks::node(std::size_t receiver) {
  if (receiver >= nodes_.size()) nodes_.resize(receiver + 1);
  return nodes_[receiver];
}

void CorrectionLinks::connect(std::size_t rover, std::size_t base, bool reports_true_position,
                              const receiver::ReceiverOptions& options, std::uint64_t seed) {
  Node& of = node(rover) = {};
  of.base = base;
  of.reports_true_position = reports_true_position;
  of.link.emplace(options.corrections, seed, options.name);
  if (options.corrections.virtual_station) of.station.emplace();
}

void CorrectionLinks::disconnect(std::size_t rover) {
  node(rover) = {};
}

std::optional<std::size_t> CorrectionLinks::base_of(std::size_t receiver) const {
  return receiver < nodes_.size() ? nodes_[receiver].base : std::nullopt;
}

std::vector<std::size_t> CorrectionLinks::order(std::vector<std::size_t> receivers) const {
  std::vector<std::size_t> ordered;
  ordered.reserve(receivers.size());
  while (!receivers.empty()) {
    // The first receiver whose base is not among the remaining ones; in a cycle the first one.
    auto next = std::find_if(receivers.begin(), receivers.end(), [&](std::size_t r) {
      const auto base = base_of(r);
      return !base || std::find(receivers.begin(), receivers.end(), *base) == receivers.end();
    });
    if (next == receivers.end()) next = receivers.begin();
    ordered.push_back(*next);
    receivers.erase(next);
  }
  return ordered;
}

void CorrectionLinks::make_epochs(std::span<const DueEpoch> due, bool parallel, const Make& make) {
  std::vector<const Epoch*> made(due.size());
  std::vector<std::shared_ptr<const rtk::Corrections>> came(due.size());
  const auto make_one = [&](std::size_t i) { made[i] = make(i, std::move(came[i])); };
  for (std::size_t begin = 0; begin < due.size();) {
    std::size_t end = begin;
    std::vector<bool> seen(nodes_.size());
    for (; end < due.size() && (parallel || end == begin); ++end) {
      Node& of = node(due[end].receiver);
      seen.resize(nodes_.size());
      if (seen[due[end].receiver] || (of.base && seen[*of.base])) break;
      seen[due[end].receiver] = true;
      if (of.link) came[end] = of.link->take(due[end].time);
    }
    if (end - begin == 1)
      make_one(begin);
    else
      tbb::parallel_for(begin, end, make_one);
    for (; begin < end; ++begin)
      if (made[begin] != nullptr) send(due[begin].receiver, *made[begin]);
  }
}

void CorrectionLinks::send(std::size_t receiver, const Epoch& epoch) {
  Node& from = node(receiver);
  from.antenna_position_ecef = epoch.truth_ecef;
  if (epoch.observed.fix.solved()) from.reported_ecef = epoch.observed.fix.position_ecef;
  std::array<std::shared_ptr<const rtk::Corrections>, 2> shared;  // [reports_true_position]
  for (Node& to : nodes_) {
    if (to.base != receiver) continue;
    std::optional<Epoch> moved;
    if (to.station) {
      // The rover's position at its last epoch, since its epoch follows its base's.
      moved = to.station->move(epoch, to.reported_ecef);
      if (!moved) continue;
    }
    std::shared_ptr<const rtk::Corrections> own;
    auto& sent = moved ? own : shared[to.reports_true_position ? 1 : 0];
    if (!sent) {
      const Epoch& base = moved ? *moved : epoch;
      sent = receiver::corrections_of(
          base.observed, to.reports_true_position ? std::optional(base.truth_ecef) : std::nullopt);
    }
    if (sent) to.link->send(epoch.observed.time, sent, to.antenna_position_ecef);
  }
}

}  // namespace canyon::simulation
