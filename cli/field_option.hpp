#pragma once

#include <functional>
#include <string>
#include <vector>

#include "canyon/base/options/describe.hpp"
#include "cli/arguments.hpp"

// Options of commands that are fields of structs: help, units, ranges and defaults come from the fields'
// lists, which check the values. An invalid value is an InputError that names the flag.

namespace canyon::cli {

/// Changes of fields that are applied later: those of a command line, to the values of a file.
template <typename Options>
using Changes = std::vector<std::function<void(Options&)>>;
template <typename Options>
void make(const Changes<Options>& changes, Options& options) {
  for (const auto& change : changes) change(options);
}

/// The list of a struct's fields, or a part of it.
template <typename Options>
using FieldList = void (*)(options::Visitor&, Options&);
template <typename Options>
void all_fields(options::Visitor& v, Options& options) {
  visit(v, options);
}

/// A field and the flag that sets it.
struct FieldFlag {
  std::string flag, name;
  const options::Description& description;
  const char* absent = nullptr;  ///< the default's text in the help, instead of the field's
  bool is_switch = false;        ///< has no value and sets a Boolean
};
/// Adds the option. @param take receives its texts
Option& field_option(Command& command, const FieldFlag& field,
                     const std::function<void(const std::vector<std::string>&)>& take);
/// Reads the field `name` from its texts.
void set_field(const std::string& flag, const std::string& name, const std::vector<std::string>& texts,
               const std::function<void(options::Visitor&)>& visit);

/// Adds `flag` for the field `name` of a struct.
/// @param fields must live as long as the command
template <typename Options>
Option& add_field(Command& command, const std::string& flag, Options& fields, const std::string& name,
                  const char* absent = nullptr, bool is_switch = false) {
  const options::Description description = options::describe(fields);
  return field_option(command, {flag, name, description, absent, is_switch},
                      [flag, name, &fields](const std::vector<std::string>& texts) {
                        set_field(flag, name, texts, [&fields](options::Visitor& v) { visit(v, fields); });
                      });
}
/// The same for a field that is set later. @param changes a change that sets the field is added; must live as
/// long as the command
template <typename Options>
Option& add_change(Command& command, const std::string& flag, Changes<Options>& changes,
                   const std::string& name, FieldList<Options> list = all_fields<Options>,
                   const char* absent = nullptr, bool is_switch = false) {
  options::Describer describer;
  Options defaults;
  list(describer, defaults);
  const options::Description description = std::move(describer).take();
  return field_option(command, {flag, name, description, absent, is_switch},
                      [flag, name, list, &changes](const std::vector<std::string>& texts) {
                        changes.push_back([flag, name, list, texts](Options& fields) {
                          set_field(flag, name, texts, [&](options::Visitor& v) { list(v, fields); });
                        });
                      });
}
/// The same for a Boolean that only the flag sets.
template <typename Options>
Option& add_switch(Command& command, const std::string& flag, Changes<Options>& changes,
                   const std::string& name) {
  return add_change(command, flag, changes, name, all_fields<Options>, nullptr, true);
}

}  // namespace canyon::cli
