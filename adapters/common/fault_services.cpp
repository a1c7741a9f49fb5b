#include "adapters/common/fault_services.hpp"

#include <fmt/format.h>

#include <chrono>
#include <utility>

namespace canyon::adapters {
namespace {

constexpr std::string_view kRefused = "refused: ";
/// A transport may have one thread for all that a process receives: it must not be held for long.
constexpr std::chrono::milliseconds kPatience(1000);

}  // namespace

ServiceReply FaultAnswerer::call(OptionsRequest::Kind kind, const std::string& text) const {
  if (!changes && kind != OptionsRequest::Kind::Faults) {
    return {false, fmt::format("{}services may not change this simulation; {}", kRefused, allow_by)};
  }
  std::string said = answer({kind, {}, text});
  const bool done = !said.starts_with(kRefused);
  return {done, std::move(said)};
}

FaultAnswerer hosted_faults(std::shared_ptr<OptionsDesk> desk, const std::string& receiver,
                            const RosSettings& settings) {
  return {[desk = std::move(desk), receiver](OptionsRequest request) {
            request.receiver = receiver;
            return desk->ask(std::move(request), kPatience);
          },
          settings.changes, "write <ros><changes>true</changes></ros> in its settings"};
}

}  // namespace canyon::adapters
