#include "canyon/city/buildings/sources/http_client.hpp"

#include <arpa/inet.h>
#include <curl/curl.h>
#include <fmt/format.h>
#include <netdb.h>
#include <sys/socket.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <ctime>
#include <map>
#include <memory>
#include <string_view>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

namespace canyon::buildings {
namespace {

constexpr long kMaxConnect_s = 30;
constexpr const char* kUserAgent = "Canyon/0.1 (GNSS receiver emulator; reads maps and 3D Tiles of cities)";

/// A reply during reception.
struct Incoming {
  HttpResponse response;
  std::uint64_t largest = 0;
  bool too_large = false;
  bool allow_external = false;  ///< redirects to other servers are followed
  std::string url;              ///< of the current reply, after redirects
  bool redirects = false;       ///< its status is 3xx
  bool from_public = false;     ///< a redirect came from a public address
  std::string refused;          ///< why a redirect is not followed
  CURL* handle = nullptr;

  /// Handles a Location header. False if it is not followed.
  bool redirect(const std::string& to);
};

/// A part of an address, resolved against a relative one; empty if it has none.
std::string part_of(const std::string& url, CURLUPart part, const std::string& relative = {}) {
  const std::unique_ptr<CURLU, decltype(&curl_url_cleanup)> parsed(curl_url(), &curl_url_cleanup);
  const unsigned flags = part == CURLUPART_PORT ? CURLU_DEFAULT_PORT : 0;
  char* text = nullptr;
  if (!parsed || curl_url_set(parsed.get(), CURLUPART_URL, url.c_str(), 0) != CURLUE_OK ||
      (!relative.empty() &&
       curl_url_set(parsed.get(), CURLUPART_URL, relative.c_str(), CURLU_URLENCODE) != CURLUE_OK) ||
      curl_url_get(parsed.get(), part, &text, flags) != CURLUE_OK)
    return {};
  const std::unique_ptr<char, decltype(&curl_free)> owner(text, &curl_free);
  return text;
}

bool Incoming::redirect(const std::string& to) {
  const std::string next = part_of(url, CURLUPART_URL, to);
  const auto parts = [](const std::string& of) {
    return std::array{part_of(of, CURLUPART_SCHEME), lower_case(part_of(of, CURLUPART_HOST)),
                      part_of(of, CURLUPART_PORT)};
  };
  const auto [scheme, host, port] = parts(url);
  const auto [next_scheme, next_host, next_port] = parts(next);
  const bool upgrade = scheme == "http" && port == "80" && next_scheme == "https" && next_port == "443";
  const bool same = next_host == host && (upgrade || (next_scheme == scheme && next_port == port));
  if (scheme == "https" && next_scheme != "https") refused = "from https to http";
  if (!same && !allow_external) refused = fmt::format("to another server, {}", next_host);
  const char* ip = nullptr;
  curl_easy_getinfo(handle, CURLINFO_PRIMARY_IP, &ip);
  from_public = from_public || (ip != nullptr && *ip != '\0' && !is_private_address(ip));
  url = next;
  return refused.empty();
}

/// Opens a connection, but none from a public address to a private one.
extern "C" curl_socket_t canyon_http_socket(void* user, curlsocktype /*purpose*/, struct curl_sockaddr* to) {
  auto& incoming = *static_cast<Incoming*>(user);
  std::array<char, NI_MAXHOST> ip{};
  const bool known =
      getnameinfo(&to->addr, to->addrlen, ip.data(), ip.size(), nullptr, 0, NI_NUMERICHOST) == 0;
  if (incoming.from_public && (!known || is_private_address(ip.data()))) {
    incoming.refused = "from a public address to a private one";
    return CURL_SOCKET_BAD;
  }
  return socket(to->family, to->socktype | SOCK_CLOEXEC, to->protocol);
}

extern "C" std::size_t canyon_http_body(char* data, std::size_t size, std::size_t count, void* user) {
  auto& incoming = *static_cast<Incoming*>(user);
  const std::size_t bytes = size * count;
  if (bytes > incoming.largest - incoming.response.body.size()) {
    incoming.too_large = true;
    return 0;  // aborts the transfer
  }
  incoming.response.body.append(data, bytes);
  return bytes;
}

extern "C" std::size_t canyon_http_header(char* data, std::size_t size, std::size_t count, void* user) {
  auto& incoming = *static_cast<Incoming*>(user);
  HttpResponse& response = incoming.response;
  const std::string line(data, size * count);
  const std::string name = lower_case(std::string_view(line).substr(0, line.find(':')));
  const std::string value(trim(std::string_view(line).substr(std::min(name.size() + 1, line.size()))));
  if (line.starts_with("HTTP/")) {
    response.retry_after_s.reset();  // of a reply that redirects
    incoming.redirects = line.find(" 3") == line.find(' ');
  }
  if (name == "location" && incoming.redirects && !incoming.redirect(value)) return 0;  // aborts the transfer
  if (name == "retry-after") {
    if (const auto seconds = parse_integer(value))
      response.retry_after_s = static_cast<double>(std::max(*seconds, 0LL));
    else if (const std::time_t date = curl_getdate(value.c_str(), nullptr); date != -1)
      response.retry_after_s = std::max(0.0, std::difftime(date, std::time(nullptr)));
  } else if (name == "cache-control") {  // "private, max-age=60"
    const std::string directives = lower_case(value);
    for (const std::string_view word : split(directives, ',')) {
      const std::string_view directive = trim(word);
      const auto seconds =
          directive.starts_with("max-age=") ? parse_integer(directive.substr(8)) : std::nullopt;
      if (seconds && response.keep_s != 0) response.keep_s = static_cast<double>(*seconds);
      if (directive == "no-store" || directive == "no-cache") response.keep_s = 0;
    }
  }
  return line.size();
}

void require_curl() {
  // Called once, before the first handle. Never cleaned up, because the process may have other users of
  // libcurl.
  static const CURLcode code = curl_global_init(CURL_GLOBAL_DEFAULT);
  if (code != CURLE_OK) throw InputError(fmt::format("libcurl cannot start: {}", curl_easy_strerror(code)));
}

/// One request. It must not be moved in memory: libcurl writes into it.
struct Request {
  Request(std::size_t which, std::string address, const HttpGetOptions& options)
      : number(which),
        url(std::move(address)),
        timeout_s(options.timeout_s),
        handle(curl_easy_init(), &curl_easy_cleanup) {
    if (!handle) throw InputError("libcurl cannot make a request");
    incoming.largest = options.largest;
    incoming.allow_external = options.allow_external;
    incoming.url = url;
    incoming.handle = handle.get();
    set(CURLOPT_URL, url.c_str());
    set(CURLOPT_CONNECTTIMEOUT, std::min(static_cast<long>(timeout_s), kMaxConnect_s));
    set(CURLOPT_USERAGENT, kUserAgent);
    set(CURLOPT_ACCEPT_ENCODING, "");  // all encodings that libcurl can unpack
    set(CURLOPT_FOLLOWLOCATION, 1L);
    set(CURLOPT_MAXREDIRS, 5L);
#if LIBCURL_VERSION_NUM >= 0x075500
    set(CURLOPT_PROTOCOLS_STR, "http,https");
    set(CURLOPT_REDIR_PROTOCOLS_STR, "http,https");
#else
    set(CURLOPT_PROTOCOLS, static_cast<long>(CURLPROTO_HTTP | CURLPROTO_HTTPS));
    set(CURLOPT_REDIR_PROTOCOLS, static_cast<long>(CURLPROTO_HTTP | CURLPROTO_HTTPS));
#endif
    set(CURLOPT_NOSIGNAL, 1L);
    set(CURLOPT_ERRORBUFFER, detail.data());
    set(CURLOPT_WRITEFUNCTION, &canyon_http_body);
    set(CURLOPT_WRITEDATA, &incoming);
    set(CURLOPT_HEADERFUNCTION, &canyon_http_header);
    set(CURLOPT_HEADERDATA, &incoming);
    set(CURLOPT_OPENSOCKETFUNCTION, &canyon_http_socket);
    set(CURLOPT_OPENSOCKETDATA, &incoming);
  }

  template <typename Value>
  void set(CURLoption option, Value value) {
    curl_easy_setopt(handle.get(), option, value);
  }

  /// The reply of a completed request. Throws InputError if it is incomplete.
  HttpResponse response(CURLcode code) {
    if (code != CURLE_OK) fail(code);
    long status = 0;
    curl_easy_getinfo(handle.get(), CURLINFO_RESPONSE_CODE, &status);
    incoming.response.status = static_cast<int>(status);
    return std::move(incoming.response);
  }

  std::size_t number;
  std::string url;
  int timeout_s;
  Incoming incoming;
  std::array<char, CURL_ERROR_SIZE> detail{};
  std::unique_ptr<CURL, decltype(&curl_easy_cleanup)> handle;

 private:
  /// The messages contain only the server: the rest of an address may contain a key.
  [[noreturn]] void fail(CURLcode code) const {
    const std::string known = part_of(url, CURLUPART_HOST), host = known.empty() ? url : known;
    if (!incoming.refused.empty()) {
      throw InputError(fmt::format("{} redirects {}, which is not followed", host, incoming.refused),
                       "if you trust it, give the redirected address");
    }
    const std::string logged = detail[0] != '\0' ? detail.data() : curl_easy_strerror(code);
    switch (code) {
      case CURLE_COULDNT_RESOLVE_HOST:
      case CURLE_COULDNT_RESOLVE_PROXY:
      case CURLE_COULDNT_CONNECT:
        throw InputError(fmt::format("cannot reach {}: {}", host, logged),
                         "check the network, or give a file");
      case CURLE_OPERATION_TIMEDOUT:
        throw InputError(fmt::format("{} did not respond within {} s: {}", host, timeout_s, logged),
                         "try again later, request a smaller box, or give a file");
      case CURLE_PARTIAL_FILE:
      case CURLE_RECV_ERROR:
      case CURLE_GOT_NOTHING:
      case CURLE_HTTP2_STREAM:
        throw InputError(fmt::format("the response of {} ended early: {}", host, logged), "try again");
      default:
        break;
    }
    if (incoming.too_large) {
      throw InputError(fmt::format("the response of {} is larger than {} bytes", host, incoming.largest),
                       "request a smaller box, or give a file");
    }
    throw InputError(fmt::format("the request to {} failed: {}", host, logged),
                     "check the address and the network, or give a file");
  }
};

}  // namespace

void http_get_all(const std::vector<std::string>& urls, const HttpGetOptions& options,
                  const std::function<void(std::size_t, HttpResponse&&)>& done) {
  require_curl();
  const std::unique_ptr<CURLM, decltype(&curl_multi_cleanup)> multi(curl_multi_init(), &curl_multi_cleanup);
  if (!multi) throw InputError("libcurl cannot make requests");
  std::map<CURL*, std::unique_ptr<Request>> running;  // remaining handles are removed from `multi` at the end
  for (std::size_t next = 0; next < urls.size() || !running.empty();) {
    while (next < urls.size() && running.size() < static_cast<std::size_t>(options.connections)) {
      auto request = std::make_unique<Request>(next, urls[next], options);
      ++next;
      request->set(CURLOPT_LOW_SPEED_LIMIT, 1L);
      request->set(CURLOPT_LOW_SPEED_TIME, static_cast<long>(options.timeout_s));
      // Limits a server that sends a byte a second.
      request->set(CURLOPT_TIMEOUT, 20L * options.timeout_s);
      CURL* const handle = request->handle.get();
      curl_multi_add_handle(multi.get(), handle);
      running.emplace(handle, std::move(request));
    }
    int count = 0;
    curl_multi_perform(multi.get(), &count);
    if (count == static_cast<int>(running.size())) curl_multi_poll(multi.get(), nullptr, 0, 200, nullptr);
    int left = 0;
    while (const CURLMsg* message = curl_multi_info_read(multi.get(), &left)) {
      if (message->msg != CURLMSG_DONE) continue;
      const CURLcode code = message->data.result;
      const auto ended = running.extract(message->easy_handle);
      curl_multi_remove_handle(multi.get(), ended.key());
      HttpResponse response;
      try {
        response = ended.mapped()->response(code);
      } catch (const InputError& error) {
        response.problem = error.problem();
      }
      done(ended.mapped()->number, std::move(response));
    }
  }
}

bool is_private_address(const std::string& ip) {
  std::array<unsigned char, 16> a{};
  const bool six = inet_pton(AF_INET6, ip.substr(0, ip.find('%')).c_str(), a.data()) == 1;
  if (!six && inet_pton(AF_INET, ip.c_str(), &a[12]) != 1) return false;
  const bool mapped = std::all_of(a.begin(), a.begin() + 10, [](unsigned char c) { return c == 0; }) &&
                      ((a[10] == 0 && a[11] == 0) || (a[10] == 0xFF && a[11] == 0xFF));
  if (six && !mapped) return (a[0] & 0xFE) == 0xFC || (a[0] == 0xFE && (a[1] & 0xC0) == 0x80);
  return a[12] == 0 || a[12] == 10 || a[12] == 127 || (a[12] == 100 && (a[13] & 0xC0) == 64) ||
         (a[12] == 169 && a[13] == 254) || (a[12] == 172 && (a[13] & 0xF0) == 16) ||
         (a[12] == 192 && a[13] == 168);
}

std::string resolve_url(const std::string& base, const std::string& relative) {
  std::string url = part_of(base, CURLUPART_URL, relative);
  if (!url.starts_with("http://") && !url.starts_with("https://")) {
    throw InputError(
        fmt::format("'{}' is not an http or https address", relative.substr(0, relative.find('?'))));
  }
  return url;
}

HttpResponse http_post(const std::string& url, const std::string& data, int timeout_s) {
  require_curl();
  HttpGetOptions options;
  options.timeout_s = timeout_s;
  options.allow_external = true;
  Request request(0, url, options);
  CURL* curl = request.handle.get();
  const std::unique_ptr<char, decltype(&curl_free)> escaped(
      curl_easy_escape(curl, data.c_str(), static_cast<int>(data.size())), &curl_free);
  const std::string form = std::string("data=") + (escaped ? escaped.get() : "");
  request.set(CURLOPT_POSTFIELDS, form.c_str());
  request.set(CURLOPT_POSTFIELDSIZE, static_cast<long>(form.size()));
  request.set(CURLOPT_POSTREDIR, static_cast<long>(CURL_REDIR_POST_ALL));
  request.set(CURLOPT_TIMEOUT, static_cast<long>(timeout_s));
  return request.response(curl_easy_perform(curl));
}

std::filesystem::path downloads_folder(const std::filesystem::path& cache) {
  if (!cache.empty()) return cache;
  const char* xdg = std::getenv("XDG_CACHE_HOME");
  if (xdg != nullptr && *xdg != '\0') return std::filesystem::path(xdg) / "canyon";
  const char* home = std::getenv("HOME");
  if (home != nullptr && *home != '\0') return std::filesystem::path(home) / ".cache" / "canyon";
  throw InputError("there is no folder for downloads", "set HOME or XDG_CACHE_HOME, or name a cache folder");
}

}  // namespace canyon::buildings
