#include "cli/field_option.hpp"

#include <algorithm>
#include <cassert>
#include <cctype>

#include "canyon/options/read.hpp"
#include "cli/commands.hpp"

namespace canyon::cli {

void set_field(const std::string& flag, const std::string& name, const std::vector<std::string>& texts,
               const std::function<void(options::Visitor&)>& visit) {
  using options::Node;
  Node list{Node::Kind::List, 0, {}, {}, {}};
  for (const std::string& text : texts) list.items.push_back({Node::Kind::Scalar, 0, text, {}, {}});
  const Node root{Node::Kind::Mapping, 0, {}, {}, {{name, 0, texts.size() == 1 ? list.items[0] : list}}};
  options::Document document;
  document.known = {name};
  for_option(flag, [&] {
    options::Reader reader(root, document);
    visit(reader);
  });
}

Option& add_option_of(Command& command, const std::string& flag, const options::Description& description,
                      const std::string& name, std::function<void(const std::vector<std::string>&)> take) {
  const auto key = std::find_if(description.keys.begin(), description.keys.end(),
                                [&name](const options::Key& each) { return each.path == name; });
  assert(key != description.keys.end());
  std::string help = key->meaning;
  if (!key->values().empty()) help += ", " + key->values();
  if (!key->default_value.empty()) help += " (" + key->default_value + ")";
  std::string unit = key->unit.empty() ? (key->range ? "n" : "text") : key->unit;
  std::transform(unit.begin(), unit.end(), unit.begin(), [](unsigned char c) { return std::toupper(c); });
  Option& option = command.options.emplace_back(Option{flag, std::move(take), unit, help}).repeated();
  option.takes_one = key->type != options::Type::Texts;
  return option;
}

Option& add_field(Command& command, const std::string& flag, const options::Description& description,
                  const std::string& name, const std::function<void(options::Visitor&)>& visit) {
  return add_option_of(
      command, flag, description, name,
      [flag, name, visit](const std::vector<std::string>& texts) { set_field(flag, name, texts, visit); });
}

}  // namespace canyon::cli
