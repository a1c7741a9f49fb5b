#pragma once

#include <functional>
#include <memory>
#include <string>

#include "adapters/common/options_desk.hpp"
#include "adapters/common/ros_names.hpp"

// A receiver's faults as services of ROS: canyon_msgs/FaultCommand, text in, success and message out.

namespace canyon::adapters {

struct FaultService {
  const char* name;  ///< below the receiver's own names: "~/add_fault"
  OptionsRequest::Kind kind;
};
inline constexpr FaultService kFaultServices[]{{"get_faults", OptionsRequest::Kind::Faults},
                                               {"add_fault", OptionsRequest::Kind::AddFault},
                                               {"end_fault", OptionsRequest::Kind::EndFault}};

struct ServiceReply {
  bool success = false;
  std::string message;  ///< as adapters::answer() says it
};

/// Answers the services of one receiver, in the thread of their caller.
struct FaultAnswerer {
  std::function<std::string(const OptionsRequest&)> answer;
  bool changes = false;       ///< requests may change the simulation
  std::string allow_by = {};  ///< how somebody allows it, "set the parameter live.changes"

  /// Calls `answer` if the request is allowed.
  [[nodiscard]] ServiceReply call(OptionsRequest::Kind kind, const std::string& text) const;
};

/// Answers for a simulator's receiver, which `desk` knows by this name, if settings allow changes.
[[nodiscard]] FaultAnswerer hosted_faults(std::shared_ptr<OptionsDesk> desk, const std::string& receiver,
                                          const RosSettings& settings);

}  // namespace canyon::adapters
