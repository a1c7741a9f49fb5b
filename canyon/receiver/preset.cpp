#include "canyon/receiver/preset.hpp"

#include <fmt/format.h>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"
#include "canyon/geodesy/constants.hpp"

namespace canyon::receiver {
namespace {

std::string cure(std::string_view name) {
  const std::vector<std::string> names = receiver_preset_names();
  std::string known;
  for (const std::string& each : names) known += (known.empty() ? "" : ", ") + each;
  const std::optional<std::string> near = closest(name, names);
  return near ? fmt::format("did you mean '{}'? Presets: {}", *near, known)
              : fmt::format("presets: {}", known);
}

}  // namespace

std::vector<std::string> receiver_preset_names() {
  return {"default", "paper"};
}

ReceiverOptions receiver_preset(std::string_view name) {
  ReceiverOptions options;
  if (name == "default") return options;
  if (name == "paper") {
    options.fix.elevation_mask_rad = geodesy::radians(15);
    options.fix.min_satellites = 5;
    options.noise.enabled = true;
    return options;
  }
  throw InputError(fmt::format("unknown receiver preset '{}'", name), cure(name));
}

}  // namespace canyon::receiver
