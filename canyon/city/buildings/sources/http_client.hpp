#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

namespace canyon::buildings {

struct HttpAnswer {
  int status = 0;  ///< 200, 404, ...; 0: no answer
  std::string body;
  std::optional<double> retry_after_s;  ///< of the Retry-After header, as seconds or as a date; not negative
  /// How long the reply may be kept (Cache-Control). 0: not beyond its use. Empty: the server does not say.
  std::optional<double> keep_s;
  std::string problem;  ///< where there is no whole answer: which server, and why; no query and no key
};

/// Posts a form field `data` to an http or https address and returns the reply, whatever its status. One
/// request, following at most five redirects, to other servers too; User-Agent names Canyon. Throws
/// InputError: unreachable host, refused, timed out, connection closed before the whole reply was there,
/// reply over 1 GiB, a redirect that http_get_all() does not follow either.
/// @param timeout_s of the whole request, > 0
[[nodiscard]] HttpAnswer http_post(const std::string& url, const std::string& data, int timeout_s);

struct HttpGetOptions {
  int timeout_s = 30;                              ///< of a connection, and of a server that sends nothing
  int connections = 8;                             ///< at a time
  std::uint64_t largest = std::uint64_t{1} << 30;  ///< bytes of a reply
  bool elsewhere = false;                          ///< follow redirects to other servers
};

/// Gets http or https addresses, several at a time, each following at most five redirects: on the same server
/// and from http to https there, to others where options say so; never from https to http, nor from a public
/// address to a private one. `done` is called for each, by its number, in the order in which they end. Throws
/// what `done` throws; what goes wrong with one address is in its answer.
void http_get_all(const std::vector<std::string>& urls, const HttpGetOptions& options,
                  const std::function<void(std::size_t, HttpAnswer&&)>& done);

/// Whether an IP address is of this machine or a network that is not the Internet (RFC 1918, 3927, 4193,
/// 6598); false for what is none.
[[nodiscard]] bool is_private_address(const std::string& ip);

/// The address that a relative one means on the page `base` (RFC 3986, 5). Throws InputError where it is not
/// an http or https address; the message has no query.
[[nodiscard]] std::string resolve_url(const std::string& base, const std::string& relative);

/// The folder to keep downloads in: `cache`, else $XDG_CACHE_HOME/canyon or ~/.cache/canyon. Throws
/// InputError where none is named.
[[nodiscard]] std::filesystem::path downloads_folder(const std::filesystem::path& cache);

}  // namespace canyon::buildings
