#include "canyon/simulation/motion/xml_tags.hpp"

#include <algorithm>

#include "canyon/base/text.hpp"

namespace canyon::simulation {

bool XmlTags::next() {
  for (;;) {
    const std::size_t open = text_.find('<', at_);
    if (open == std::string_view::npos) return false;
    if (skip(open, "<!--", "-->") || skip(open, "<![CDATA[", "]]>") || skip(open, "<?", "?>")) continue;
    const std::size_t close = text_.find('>', open);
    if (close == std::string_view::npos) return false;  // see ends_early()
    count_lines(open);
    std::string_view tag = text_.substr(open + 1, close - open - 1);
    name = tag.substr(0, tag.find_first_of(" \t\r\n"));
    attributes = tag.substr(name.size());
    if (!name.empty() && name.back() == '/') name.remove_suffix(1);
    const std::size_t colon = name.find(':');
    if (colon != std::string_view::npos) {
      const bool ends = name.front() == '/';
      name.remove_prefix(colon + 1);
      if (ends) name = end_ = "/" + std::string(name);
    }
    at_ = close + 1;
    content = text_until("<");
    constexpr std::string_view kCdata = "<![CDATA[";
    if (content.empty() &&
        text_.compare(at_ = std::min(text_.find('<', at_), text_.size()), kCdata.size(), kCdata) == 0) {
      at_ += kCdata.size();
      content = text_until("]]>");
      at_ = std::min(text_.find("]]>", at_), text_.size());
    }
    return true;
  }
}

std::string_view XmlTags::attribute(std::string_view key) const {
  for (std::size_t at = attributes.find(key); at != std::string_view::npos;
       at = attributes.find(key, at + 1)) {
    std::size_t from = at + key.size();
    const bool begins = at > 0 && (attributes[at - 1] == ' ' || attributes[at - 1] == '\t' ||
                                   attributes[at - 1] == '\n' || attributes[at - 1] == '\r');
    from = attributes.find_first_not_of(" \t\r\n", from);
    if (!begins || from == std::string_view::npos || attributes[from] != '=') continue;
    from = attributes.find_first_of("\"'", from);
    if (from == std::string_view::npos) return {};
    const std::size_t to = attributes.find(attributes[from], from + 1);
    return to == std::string_view::npos ? std::string_view() : attributes.substr(from + 1, to - from - 1);
  }
  return {};
}

std::string_view XmlTags::text_until(std::string_view end) const {
  return trim(text_.substr(at_, std::min(text_.find(end, at_), text_.size()) - at_));
}

bool XmlTags::skip(std::size_t open, std::string_view begin, std::string_view end) {
  if (text_.compare(open, begin.size(), begin) != 0) return false;
  const std::size_t close = text_.find(end, open + begin.size());
  at_ = close == std::string_view::npos ? text_.size() : close + end.size();
  return true;
}

void XmlTags::count_lines(std::size_t to) {
  line_ += static_cast<int>(std::count(text_.begin() + static_cast<std::ptrdiff_t>(counted_),
                                       text_.begin() + static_cast<std::ptrdiff_t>(to), '\n'));
  counted_ = to;
}

bool ends_early(std::string_view text, std::string_view root) {
  const std::string name(root);
  if (text.find('<' + name) == std::string_view::npos && text.find(':' + name) == std::string_view::npos)
    return false;
  std::size_t end = text.rfind("</" + name);
  const std::size_t prefixed = text.rfind(':' + name);
  if (end == std::string_view::npos && prefixed != std::string_view::npos) {
    const std::size_t open = text.rfind('<', prefixed);
    if (open != std::string_view::npos && text.substr(open, 2) == "</") end = open;
  }
  return end == std::string_view::npos || text.find('>', end) == std::string_view::npos;
}

}  // namespace canyon::simulation
