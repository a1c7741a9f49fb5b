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

/// Who answers the services of one receiver, in the thread of their caller.
struct FaultAnswerer {
  std::function<std::string(const OptionsRequest&)> answer;
  bool changes = false;       ///< what changes the simulation is allowed
  std::string allow_by = {};  ///< how somebody allows it, "set the parameter live.changes"

  /// Asks `answer`, unless that may not be.
  [[nodiscard]] ServiceReply call(OptionsRequest::Kind kind, const std::string& text) const;
};

/// Of a simulator's receiver, which `desk` knows by this name; settings say whether changes are allowed.
[[nodiscard]] FaultAnswerer hosted_faults(std::shared_ptr<OptionsDesk> desk, const std::string& receiver,
                                          const RosSettings& settings);

}  // namespace canyon::adapters
