#pragma once

#include <optional>
#include <string>

namespace canyon::buildings {

struct HttpReply {
  int status = 0;  ///< 200, 404, ...
  std::string body;
  std::optional<double> retry_after_s;  ///< of the Retry-After header, as seconds or as a date; not negative
};

/// Posts a form field `data` to an http or https address and returns the reply, whatever its status. One
/// request, following at most five redirects; User-Agent names Canyon. Throws InputError: unreachable host,
/// refused, timed out, connection closed before the whole reply was there, reply over 1 GiB.
/// @param timeout_s of the whole request, > 0
[[nodiscard]] HttpReply http_post(const std::string& url, const std::string& data, int timeout_s);

}  // namespace canyon::buildings
