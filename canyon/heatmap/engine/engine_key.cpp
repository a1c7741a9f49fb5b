#include "canyon/heatmap/engine/engine_key.hpp"

#include <fmt/format.h>

#include "canyon/base/text.hpp"
#include "canyon/options/values.hpp"
#include "canyon/simulation/scenario/scenario.hpp"

namespace canyon::heatmap {

std::string canonical_text(const Request& request, const simulation::ReceiverConfig& receiver,
                           const std::map<gnss::System, gnss::Klobuchar>& klobuchar,
                           const simulation::ReceiverConfig* base) {
  std::string text = options::exact_text(request) + fmt::format("receiver: {}\n", receiver.options.name);
  if (receiver.streets.enabled) text += "streets: " + options::exact_text(receiver.streets);
  for (const disturbance::Source& source : receiver.disturbances) {
    text += fmt::format("disturbance: {}\n", source.name);
  }
  for (const auto& [system, coefficients] : klobuchar) {
    text += fmt::format("klobuchar of {}: {}, {}\n", gnss::name(system), fmt::join(coefficients.alpha, " "),
                        fmt::join(coefficients.beta, " "));
  }
  text += options::exact_text(receiver.propagation) + options::exact_text(receiver.options);
  if (base != nullptr) {
    const geodesy::Geodetic& place = base->fixed->place;
    text += fmt::format("base at {} {} {}\n", place.latitude_rad, place.longitude_rad, place.height_m) +
            options::exact_text(base->propagation) + options::exact_text(base->options);
  }
  return text;
}

std::string hash_text(const std::string& text) {
  return fmt::format("{:016x}{:016x}", fnv1a(text), fnv1a("heat map\n" + text));
}

}  // namespace canyon::heatmap
