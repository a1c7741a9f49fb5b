#pragma once

#include <functional>
#include <string>

#include "canyon/options/describe.hpp"
#include "cli/arguments.hpp"

namespace canyon::cli {

/// Adds `--flag VALUE` for the field `name` of a struct that `visit` visits: help, unit, range and default
/// are those of its list. What the list refuses is an InputError that names the flag.
Option& add_field(Command& command, const std::string& flag, const options::Description& description,
                  const std::string& name, const std::function<void(options::Visitor&)>& visit);
/// @param fields must live as long as the command
template <typename Options>
Option& add_field(Command& command, const std::string& flag, Options& fields, const std::string& name) {
  return add_field(command, flag, options::describe(fields), name,
                   [&fields](options::Visitor& v) { visit(v, fields); });
}

}  // namespace canyon::cli
