#pragma once

#include <functional>
#include <string>
#include <vector>

#include "canyon/options/describe.hpp"
#include "cli/arguments.hpp"

namespace canyon::cli {

/// Reads the field `name` from its texts. What its list refuses is an InputError that names the flag.
void set_field(const std::string& flag, const std::string& name, const std::vector<std::string>& texts,
               const std::function<void(options::Visitor&)>& visit);
/// Adds `--flag VALUE` with help, unit, range and default of a field. @param take gets the texts
Option& add_option_of(Command& command, const std::string& flag, const options::Description& description,
                      const std::string& name, std::function<void(const std::vector<std::string>&)> take);
/// Adds `--flag VALUE` for the field `name` of a struct that `visit` visits: help, unit, range and default
/// are those of its list. What the list refuses is an InputError that names the flag.
Option& add_field(Command& command, const std::string& flag, const options::Description& description,
                  const std::string& name, const std::function<void(options::Visitor&)>& visit);
/// Changes of fields that are read later: what options on the command line put over a file's values.
template <typename Options>
using Changes = std::vector<std::function<void(Options&)>>;
/// @param changes gets one that sets the field; must live as long as the command
template <typename Options>
Option& add_change(Command& command, const std::string& flag, Changes<Options>& changes,
                   const std::string& name) {
  const options::Description description = options::describe<Options>();
  return add_option_of(command, flag, description, name,
                       [flag, name, &changes](const std::vector<std::string>& texts) {
                         changes.push_back([flag, name, texts](Options& fields) {
                           set_field(flag, name, texts, [&fields](options::Visitor& v) { visit(v, fields); });
                         });
                       });
}
/// @param fields must live as long as the command
template <typename Options>
Option& add_field(Command& command, const std::string& flag, Options& fields, const std::string& name) {
  return add_field(command, flag, options::describe(fields), name,
                   [&fields](options::Visitor& v) { visit(v, fields); });
}

}  // namespace canyon::cli
