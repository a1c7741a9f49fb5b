#include "canyon/base/options/values.hpp"

#include <fmt/format.h>
#include <algorithm>

namespace canyon::options {

void Checker::field(const Field& field, Value& value) {
  if (value.in_range()) return;
  std::string name;
  for (const std::string& section : path_) name += section + ".";
  name += field.name;
  if (value.is_angle()) name.replace(name.size() - 4, 4, "_rad");
  const bool prefix = !what_.empty() && what_.back() == '.';
  const std::string owner = what_.empty() || prefix ? "" : fmt::format(" of the {}", what_);
  const std::string unit = value.is_angle() || field.unit.empty() || value.words().size() > 0
                               ? ""
                               : fmt::format(" {}", field.unit);
  throw InputError(fmt::format("{}{}{} is {}", prefix ? what_ : "", name, owner, value.shown()),
                   fmt::format("it must be {}{}", value.bound(), unit));
}

bool Checker::begin(std::string_view name) {
  path_.emplace_back(name);
  return true;
}

std::optional<std::size_t> Checker::begin_list(std::string_view name, std::size_t count) {
  path_.emplace_back(name);
  return count;
}

void Checker::begin_item(std::size_t index) {
  path_.push_back(fmt::format("{}", index));
}

bool Writer::begin(std::string_view name) {
  path_.push_back({std::string(name)});
  return true;
}

std::optional<std::size_t> Writer::begin_list(std::string_view name, std::size_t count) {
  if (form_ == Form::Dotted) return std::nullopt;
  path_.push_back({std::string(name)});
  return count;
}

void Writer::begin_item(std::size_t index) {
  path_.push_back({form_ == Form::Lines ? fmt::format("{}", index) : ""});
}

void Writer::field(const Field& field, Value& value) {
  if (form_ != Form::Lines && (!value.given() || field.help.empty())) return;
  if (form_ != Form::Yaml) {
    for (const Level& level : path_) text_ += level.name + ".";
    text_ += fmt::format("{}: {}\n", field.name, form_ == Form::Lines ? value.exact() : value.text());
  } else {
    write_line(fmt::format("{}: {}", field.name, value.text()));
  }
}

// Names of sections are written with their first line.
void Writer::write_line(const std::string& line) {
  std::string indent;
  bool dash = false;
  const auto write = [&](const std::string& text) {
    std::string begin = indent;
    if (dash) begin.replace(begin.size() - 2, 2, "- ");
    text_ += begin + text + "\n";
    dash = false;
  };
  for (Level& level : path_) {
    if (!level.written) {
      if (level.name.empty())
        dash = true;
      else
        write(level.name + ":");
      level.written = true;
    }
    indent += "  ";
  }
  write(line);
}

void check_folder_name(Visitor& v, std::string_view key, const std::string& name) {
  const bool plain = std::all_of(name.begin(), name.end(), [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_' || c == '.';
  });
  if (!plain || name.empty() || name.front() == '.' || name.size() > 60) {
    throw v.fault(key, fmt::format("'{}' cannot name a folder", name),
                  "use at most 60 letters, digits, '-', '_' and '.', a dot not first");
  }
}

void visit_switch(Visitor& v, const Field& field, Switch& value) {
  if (v.leaves_out_defaults() && !value.is_set()) return;
  bool on = value;
  v.boolean(field, on);
  if (v.reads() && v.has(field.name)) value = on;
}

}  // namespace canyon::options
