#include "adapters/ros2/node_parameters.hpp"

#include <cmath>
#include <set>
#include <utility>

#include "canyon/base/input_error.hpp"
#include "canyon/base/options/describe.hpp"

namespace canyon::adapters::ros2 {
namespace {

using rcl_interfaces::msg::SetParametersResult;
using rclcpp::ParameterType;

ParameterValue from_ros(const rclcpp::ParameterValue& value) {
  switch (value.get_type()) {
    case ParameterType::PARAMETER_BOOL:
      return value.get<bool>();
    case ParameterType::PARAMETER_INTEGER:
      return value.get<std::int64_t>();
    case ParameterType::PARAMETER_DOUBLE:
      return value.get<double>();
    case ParameterType::PARAMETER_STRING:
      return value.get<std::string>();
    case ParameterType::PARAMETER_STRING_ARRAY:
      return value.get<std::vector<std::string>>();
    case ParameterType::PARAMETER_DOUBLE_ARRAY:
      return value.get<std::vector<double>>();
    case ParameterType::PARAMETER_INTEGER_ARRAY: {
      const auto& integers = value.get<std::vector<std::int64_t>>();
      return std::vector<double>(integers.begin(), integers.end());
    }
    default:
      return std::monostate();
  }
}

rclcpp::ParameterValue to_ros(const ParameterValue& value) {
  return std::visit(
      [](const auto& v) {
        if constexpr (std::is_same_v<std::decay_t<decltype(v)>, std::monostate>)
          return rclcpp::ParameterValue();
        else
          return rclcpp::ParameterValue(v);
      },
      value);
}

rcl_interfaces::msg::ParameterDescriptor descriptor_of(const options::Key& key) {
  rcl_interfaces::msg::ParameterDescriptor descriptor;
  descriptor.name = key.path;
  descriptor.description = key.meaning;
  if (!key.unit.empty()) descriptor.description += " [" + key.unit + "]";
  descriptor.additional_constraints = key.values();
  descriptor.dynamic_typing = true;  // 5 for 5.0, "none" for infinity, empty for not set
  if (key.range && std::isfinite(key.range->low) && std::isfinite(key.range->high)) {
    if (key.type == options::Type::Integer) {
      rcl_interfaces::msg::IntegerRange range;
      range.from_value = static_cast<std::int64_t>(key.range->low);
      range.to_value = static_cast<std::int64_t>(key.range->high);
      range.step = 1;
      if (key.range->high < 9e18) descriptor.integer_range.push_back(range);
    } else if (key.type == options::Type::Number) {
      rcl_interfaces::msg::FloatingPointRange range;
      range.from_value = key.range->low;
      range.to_value = key.range->high;
      descriptor.floating_point_range.push_back(range);
    }
  }
  return descriptor;
}

// rclcpp would reject a number outside the descriptor's range with its own message; a text reaches the
// engine, which has better messages.
void leave_to_engine(std::vector<rclcpp::Parameter>& changes) {
  for (rclcpp::Parameter& change : changes) {
    const options::Key* key = find_parameter(change.get_name());
    if (key == nullptr || !key->range) continue;
    double number = 0;
    if (change.get_type() == ParameterType::PARAMETER_DOUBLE)
      number = change.as_double();
    else if (change.get_type() == ParameterType::PARAMETER_INTEGER)
      number = static_cast<double>(change.as_int());
    if (!key->range->holds(number)) change = rclcpp::Parameter(change.get_name(), options::show(number));
  }
}

SetParametersResult refused(const std::string& reason) {
  SetParametersResult result;
  result.successful = false;
  result.reason = reason;
  return result;
}

}  // namespace

NodeParameters::NodeParameters(rclcpp_lifecycle::LifecycleNode& node, Owner owner)
    : node_(node), owner_(std::move(owner)) {
  declare();
  before_ = node_.add_pre_set_parameters_callback(leave_to_engine);
  check_ = node_.add_on_set_parameters_callback(
      [this](const std::vector<rclcpp::Parameter>& changes) { return check(changes); });
}

void NodeParameters::declare() {
  for (const auto& [name, value] : node_.get_node_parameters_interface()->get_parameter_overrides()) {
    if (node_.has_parameter(name) || name.rfind("qos_overrides.", 0) == 0) continue;
    if (find_parameter(name) != nullptr) {
      given_[name] = from_ros(value);
    } else {
      RCLCPP_WARN(node_.get_logger(), "there is no parameter '%s'; %s", name.c_str(),
                  meant_parameter(name).c_str());
    }
  }
  Parameters shown = given_;
  try {
    shown.merge(parameters_of(settings()));
  } catch (const InputError& e) {
    // Missing parameters may be set before the node is configured.
    if (!given_.empty()) RCLCPP_ERROR(node_.get_logger(), "%s", e.what());
  }
  for (const options::Key& key : parameter_keys()) {
    if (node_.has_parameter(key.path)) continue;
    node_.declare_parameter(key.path, to_ros(shown[key.path]), descriptor_of(key), true);
  }
}

bool NodeParameters::autostart() const {
  rclcpp::Parameter given;
  return node_.get_parameter("autostart", given) && given.get_type() == rclcpp::PARAMETER_BOOL &&
         given.as_bool();
}

void NodeParameters::show(const NodeSettings& settings) {
  std::vector<rclcpp::Parameter> changed;
  for (const auto& [name, value] : parameters_of(settings)) {
    if (given_.contains(name)) continue;
    rclcpp::Parameter parameter(name, to_ros(value));
    if (node_.get_parameter(name) != parameter) changed.push_back(std::move(parameter));
  }
  showing_ = true;
  if (!changed.empty()) node_.set_parameters_atomically(changed);
  showing_ = false;
}

SetParametersResult NodeParameters::check(const std::vector<rclcpp::Parameter>& changes) {
  SetParametersResult good;
  good.successful = true;
  if (showing_) return good;
  Parameters given = given_;
  std::set<std::string> names;
  for (const rclcpp::Parameter& change : changes) {
    if (find_parameter(change.get_name()) == nullptr) continue;
    names.insert(change.get_name());
    given[change.get_name()] = from_ros(change.get_parameter_value());
  }
  if (names.empty()) return good;
  const bool configured = owner_.configured();
  for (const std::string& name : names) {
    if (!configured || is_receivers(name)) continue;
    return refused("parameter '" + name + "': it is read when the node is configured; run cleanup first");
  }
  try {
    owner_.change(read_settings(given));
  } catch (const InputError& e) {
    // Other parameters may still be missing before the node is configured.
    const bool own = std::any_of(names.begin(), names.end(), [&](const std::string& name) {
      return e.problem().rfind("parameter '" + name + "'", 0) == 0;
    });
    if (own || configured) return refused(e.what());
  }
  given_ = std::move(given);
  return good;
}

}  // namespace canyon::adapters::ros2
