#include "canyon/simulation/scenario/receiver_bases.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "canyon/base/input_error.hpp"
#include "canyon/relative/correction_link.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::simulation {

std::optional<std::size_t> index_of_base(const std::vector<ReceiverConfig>& receivers,
                                         const ReceiverConfig& receiver) {
  const std::string& name = receiver.options.corrections.from;
  const auto at = std::find_if(receivers.begin(), receivers.end(),
                               [&name](const ReceiverConfig& each) { return each.options.name == name; });
  if (name.empty() || at == receivers.end()) return std::nullopt;
  return static_cast<std::size_t>(at - receivers.begin());
}

std::optional<ReceiverConfig> base_of(const std::vector<ReceiverConfig>& receivers,
                                      const ReceiverConfig& receiver) {
  const std::optional<std::size_t> base = index_of_base(receivers, receiver);
  return base ? std::optional(receivers[*base]) : std::nullopt;
}

void check_corrections(const std::vector<ReceiverConfig>& receivers, std::size_t index) {
  const receiver::ReceiverOptions& options = receivers[index].options;
  const std::string& from = options.corrections.from;
  if (options.rtk.enabled && !options.signal.enabled) {
    throw InputError(
        fmt::format("receiver '{}': rtk has no carrier phases without strengths of signals", options.name),
        "give signal: {enabled: true}, or a profile that has it");
  }
  if (from.empty() || relative::is_stream(from)) return;
  const auto refuse = [&](std::string_view problem, std::string_view cure) {
    throw InputError(
        fmt::format("receiver '{}' takes corrections from '{}', {}", options.name, from, problem), cure);
  };
  const std::optional<std::size_t> base = index_of_base(receivers, receivers[index]);
  if (!base) {
    refuse("which is not a receiver of the scenario",
           fmt::format("receivers: {}", fmt::join(receiver_names(receivers), ", ")));
  }
  if (*base == index) refuse("itself", "name a receiver with a fixed place");
  std::optional<std::size_t> next = base;
  for (std::size_t steps = 0; next && steps < receivers.size(); ++steps) {
    next = index_of_base(receivers, receivers[*next]);
    if (next == index) refuse("which itself depends on this receiver", "leave one of them out");
  }
  if (options.corrections.virtual_station && !receivers[*base].fixed) {
    refuse("which moves: a virtual station needs a fixed base",
           "leave virtual_station out, or give that receiver a fixed place");
  }
  if (!receivers[*base].fixed && !options.rtk.enabled) {
    refuse("whose place is not known",
           "give that receiver fixed: {latitude_deg: ..., longitude_deg: ...}, or this one rtk: true for the "
           "heading of two antennas");
  }
  if (!options.own_draws && !receivers[*base].options.own_draws) {
    refuse("and both draw the same noise, which would vanish in the difference",
           "leave own_draws: false out of one of them");
  }
}

}  // namespace canyon::simulation
