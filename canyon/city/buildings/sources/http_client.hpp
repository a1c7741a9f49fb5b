#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace canyon::buildings {

struct HttpResponse {
  int status = 0;  ///< 200, 404, ...; 0: no response
  std::string body;
  std::optional<double> retry_after_s;  ///< of the Retry-After header, as seconds or as a date; not negative
  /// How long the reply may be cached (Cache-Control). 0: not beyond its use. Empty: not given by the server.
  std::optional<double> keep_s;
  std::string problem;  ///< if the response is incomplete: the server and the reason; no query and no key
};

/// Posts a form field `data` to an http or https address and returns the reply, whatever its status. One
/// request, following at most five redirects, also to other servers; the User-Agent is Canyon. Throws
/// InputError: unreachable host, refused, timed out, connection closed before the end of the reply, reply
/// over 1 GiB, a redirect that http_get_all() does not follow either.
/// @param timeout_s of the whole request, > 0
[[nodiscard]] HttpResponse http_post(const std::string& url, const std::string& data, int timeout_s);

struct HttpGetOptions {
  int timeout_s = 30;                              ///< of a connection, and of a server that stops sending
  int connections = 8;                             ///< in parallel
  std::uint64_t largest = std::uint64_t{1} << 30;  ///< maximum bytes of a reply
  bool allow_external = false;                     ///< follow redirects to other servers
};

/// Gets http or https addresses, several in parallel, each following at most five redirects: on the same
/// server and from http to https there, to other servers if the options allow it; never from https to http,
/// nor from a public address to a private one. `done` is called with the number of each address, in the order
/// of completion. Throws exceptions of `done`; the problem of a single address is in its response.
void http_get_all(const std::vector<std::string>& urls, const HttpGetOptions& options,
                  const std::function<void(std::size_t, HttpResponse&&)>& done);

/// Whether an IP address is of this machine or a private network (RFC 1918, 3927, 4193, 6598); else false.
[[nodiscard]] bool is_private_address(const std::string& ip);

/// Resolves a relative address against the page `base` (RFC 3986, 5). Throws InputError if the result is not
/// an http or https address; the message has no query.
[[nodiscard]] std::string resolve_url(const std::string& base, const std::string& relative);

/// The folder for downloads: `cache`, else $XDG_CACHE_HOME/canyon or ~/.cache/canyon. Throws
/// InputError if there is none of these.
[[nodiscard]] std::filesystem::path downloads_folder(const std::filesystem::path& cache);

}  // namespace canyon::buildings
