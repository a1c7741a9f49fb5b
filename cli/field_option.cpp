#include "cli/field_option.hpp"

#include <algorithm>
#include <cassert>
#include <cctype>

#include "canyon/base/options/read.hpp"
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

Option& field_option(Command& command, const FieldFlag& field,
                     const std::function<void(const std::vector<std::string>&)>& take) {
  const auto& keys = field.description.keys;
  const auto key = std::find_if(keys.begin(), keys.end(),
                                [&field](const options::Key& each) { return each.path == field.name; });
  assert(key != keys.end());
  std::string help = key->meaning;
  if (field.is_switch) {
    const std::function<void()> set = [take] { take({"true"}); };
    return command.options.emplace_back(Option{field.flag, set, {}, help});
  }
  if (!key->values().empty()) help += ", " + key->values();
  const std::string absent = field.absent != nullptr ? field.absent : key->default_value;
  if (!absent.empty()) help += " (" + absent + ")";
  const bool files = key->type == options::Type::Files;
  std::string unit = files ? "file" : key->range ? "n" : "text";
  if (!key->unit.empty()) unit = key->unit;
  std::transform(unit.begin(), unit.end(), unit.begin(), [](unsigned char c) { return std::toupper(c); });
  Option& option = command.options.emplace_back(Option{field.flag, take, unit, help});
  option.words = key->words;
  option.takes_one = key->type != options::Type::Texts && !files;
  option.one_at_a_time = !files;  // *.sp3 of a shell
  return option;
}

}  // namespace canyon::cli
