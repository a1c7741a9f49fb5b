#include "canyon/heatmap/engine/engine_key.hpp"

#include <fmt/format.h>

#include "canyon/base/text.hpp"
#include "canyon/options/values.hpp"
#include "canyon/simulation/scenario.hpp"

namespace canyon::heatmap {

std::string canonical_text(const Request& request, const simulation::ReceiverConfig& receiver,
                           const std::map<gnss::System, gnss::Klobuchar>& klobuchar) {
  std::string text = options::exact_text(request) + fmt::format("receiver: {}\n", receiver.options.name);
  if (receiver.streets.enabled) text += "streets: " + options::exact_text(receiver.streets);
  for (const disturbance::Source& source : receiver.disturbances) {
    text += fmt::format("disturbance: {}\n", source.name);
  }
  for (const auto& [system, coefficients] : klobuchar) {
    text += fmt::format("klobuchar of {}: {}, {}\n", gnss::name(system), fmt::join(coefficients.alpha, " "),
                        fmt::join(coefficients.beta, " "));
  }
  return text + options::exact_text(receiver.propagation) + options::exact_text(receiver.options);
}

std::string hash_text(const std::string& text) {
  return fmt::format("{:016x}{:016x}", fnv1a(text), fnv1a("heat map\n" + text));
}

}  // namespace canyon::heatmap
