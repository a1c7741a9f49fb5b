#include "canyon/heatmap/cells/understood_options.hpp"

#include <algorithm>
#include <iterator>
#include <string>
#include <vector>

#include "canyon/base/text.hpp"
#include "canyon/options/values.hpp"

namespace canyon::heatmap {

bool differs_only_in(const receiver::ReceiverOptions& options,
                     std::initializer_list<std::string_view> understood) {
  const std::string text = options::exact_text(options);
  const std::string default_text = options::exact_text(receiver::ReceiverOptions());
  std::vector<std::string_view> lines = split(text, '\n'), defaults = split(default_text, '\n'), changed;
  std::sort(lines.begin(), lines.end());
  std::sort(defaults.begin(), defaults.end());
  std::set_symmetric_difference(lines.begin(), lines.end(), defaults.begin(), defaults.end(),
                                std::back_inserter(changed));
  return std::all_of(changed.begin(), changed.end(), [&](std::string_view line) {
    const std::string_view path = line.substr(0, line.find(": "));
    return std::any_of(understood.begin(), understood.end(), [&](std::string_view list) {
      const std::vector<std::string_view> names = split_blanks(list);
      return std::any_of(names.begin(), names.end(), [&](std::string_view name) {
        return name.back() == '.' ? path.starts_with(name) : path == name;
      });
    });
  });
}

}  // namespace canyon::heatmap
