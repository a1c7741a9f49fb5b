#include "canyon/buildings/sources/http_client.hpp"

#include <curl/curl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <string_view>

#include "canyon/base/input_error.hpp"
#include "canyon/base/text.hpp"

namespace canyon::buildings {
namespace {

constexpr std::size_t kMaxBody = std::size_t{1} << 30;
constexpr long kMaxConnect_s = 30;
constexpr const char* kUserAgent = "Canyon/0.1 (GNSS receiver emulator; builds cities from OpenStreetMap)";

struct Collected {
  HttpReply reply;
  std::uint64_t largest = kMaxBody;
  bool too_large = false;
  std::optional<double> keep_s = {};
};

extern "C" std::size_t canyon_http_body(char* data, std::size_t size, std::size_t count, void* user) {
  auto& collected = *static_cast<Collected*>(user);
  const std::size_t bytes = size * count;
  if (bytes > collected.largest - collected.reply.body.size()) {
    collected.too_large = true;
    return 0;  // ends the transfer
  }
  collected.reply.body.append(data, bytes);
  return bytes;
}

/// The age that a header "Cache-Control: private, max-age=60" allows [s]; 0 where nothing may be stored.
std::optional<double> cache_seconds(const std::string& line) {
  const std::string lower = lower_case(line);
  if (lower.rfind("cache-control:", 0) != 0) return std::nullopt;
  if (lower.find("no-store") != std::string::npos || lower.find("no-cache") != std::string::npos) return 0;
  const std::size_t age = lower.find("max-age=");
  if (age == std::string::npos) return std::nullopt;
  const std::size_t begin = age + 8;
  const auto seconds =
      parse_integer(lower.substr(begin, lower.find_first_not_of("0123456789", begin) - begin));
  return seconds ? std::optional<double>(static_cast<double>(*seconds)) : std::nullopt;
}

extern "C" std::size_t canyon_http_header(char* data, std::size_t size, std::size_t count, void* user) {
  auto& reply = static_cast<Collected*>(user)->reply;
  const std::string_view line(data, size * count);
  if (const auto keep_s = cache_seconds(std::string(line))) static_cast<Collected*>(user)->keep_s = keep_s;
  constexpr std::string_view kName = "retry-after:";
  if (line.substr(0, 5) == "HTTP/") reply.retry_after_s.reset();  // of a reply that redirects
  const bool found = line.size() > kName.size() &&
                     std::equal(kName.begin(), kName.end(), line.begin(),
                                [](char a, char b) { return a == b || (a >= 'a' && a - 'a' + 'A' == b); });
  if (!found) return line.size();
  const std::string value(trim(line.substr(kName.size())));
  if (const auto seconds = parse_integer(value)) {
    reply.retry_after_s = static_cast<double>(std::max(*seconds, 0LL));
  } else if (const std::time_t date = curl_getdate(value.c_str(), nullptr); date != -1) {
    reply.retry_after_s = std::max(0.0, std::difftime(date, std::time(nullptr)));
  }
  return line.size();
}

void require_curl() {
  // Called once, before the first handle. Never cleaned up: other users of libcurl may live in the process.
  static const CURLcode code = curl_global_init(CURL_GLOBAL_DEFAULT);
  if (code != CURLE_OK) {
    throw InputError(fmt::format("libcurl cannot start: {}", curl_easy_strerror(code)));
  }
}

std::string host_of(const std::string& url) {
  const std::unique_ptr<CURLU, decltype(&curl_url_cleanup)> parsed(curl_url(), &curl_url_cleanup);
  char* host = nullptr;
  if (!parsed || curl_url_set(parsed.get(), CURLUPART_URL, url.c_str(), 0) != CURLUE_OK ||
      curl_url_get(parsed.get(), CURLUPART_HOST, &host, 0) != CURLUE_OK) {
    return url;
  }
  const std::unique_ptr<char, decltype(&curl_free)> owner(host, &curl_free);
  return host;
}

[[noreturn]] void fail(CURLcode code, const std::string& url, std::string_view detail,
                       const Collected& collected, int timeout_s) {
  const std::string host = host_of(url);
  switch (code) {
    case CURLE_COULDNT_RESOLVE_HOST:
    case CURLE_COULDNT_RESOLVE_PROXY:
    case CURLE_COULDNT_CONNECT:
      throw InputError(fmt::format("cannot reach {}: {}", host, detail), "check the network, or give a file");
    case CURLE_OPERATION_TIMEDOUT:
      throw InputError(fmt::format("{} did not answer within {} s: {}", host, timeout_s, detail),
                       "try again later, ask for a smaller box, or give a file");
    case CURLE_PARTIAL_FILE:
    case CURLE_RECV_ERROR:
    case CURLE_GOT_NOTHING:
    case CURLE_HTTP2_STREAM:
      throw InputError(fmt::format("the answer of {} ended early: {}", host, detail), "try again");
    case CURLE_URL_MALFORMAT:
    case CURLE_UNSUPPORTED_PROTOCOL:
      throw InputError(fmt::format("'{}' is not a web address: {}", url, detail),
                       "give one that begins with https:// or http://");
    case CURLE_WRITE_ERROR:
      if (collected.too_large) {
        throw InputError(fmt::format("the answer of {} is larger than {} bytes", host, kMaxBody),
                         "ask for a smaller box, or give a file");
      }
      break;
    default:
      break;
  }
  throw InputError(fmt::format("the request to {} failed: {}", host, detail),
                   "check the network, or give a file");
}

void set_what_all_requests_have(CURL* curl, Collected& collected, char* detail) {
  curl_easy_setopt(curl, CURLOPT_USERAGENT, kUserAgent);
  curl_easy_setopt(curl, CURLOPT_ACCEPT_ENCODING, "");  // all that libcurl can unpack
  curl_easy_setopt(curl, CURLOPT_FOLLOWLOCATION, 1L);
  curl_easy_setopt(curl, CURLOPT_MAXREDIRS, 5L);
#if LIBCURL_VERSION_NUM >= 0x075500
  curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(curl, CURLOPT_REDIR_PROTOCOLS_STR, "http,https");
#else
  curl_easy_setopt(curl, CURLOPT_PROTOCOLS, static_cast<long>(CURLPROTO_HTTP | CURLPROTO_HTTPS));
  curl_easy_setopt(curl, CURLOPT_REDIR_PROTOCOLS, static_cast<long>(CURLPROTO_HTTP | CURLPROTO_HTTPS));
#endif
  curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(curl, CURLOPT_ERRORBUFFER, detail);
  curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, &canyon_http_body);
  curl_easy_setopt(curl, CURLOPT_WRITEDATA, &collected);
  curl_easy_setopt(curl, CURLOPT_HEADERFUNCTION, &canyon_http_header);
  curl_easy_setopt(curl, CURLOPT_HEADERDATA, &collected);
}

using CurlEasy = std::unique_ptr<CURL, decltype(&curl_easy_cleanup)>;

/// One request of http_get_all(). Its place in memory must not change: libcurl writes into it.
struct Get {
  Get(std::size_t which, const std::string& url, const HttpGetOptions& options)
      : number(which), handle(curl_easy_init(), &curl_easy_cleanup) {
    if (!handle) throw InputError("libcurl cannot make a request");
    collected.largest = options.largest;
    set_what_all_requests_have(handle.get(), collected, detail.data());
    curl_easy_setopt(handle.get(), CURLOPT_URL, url.c_str());
    curl_easy_setopt(handle.get(), CURLOPT_CONNECTTIMEOUT,
                     std::min(static_cast<long>(options.timeout_s), kMaxConnect_s));
    curl_easy_setopt(handle.get(), CURLOPT_LOW_SPEED_LIMIT, 1L);
    curl_easy_setopt(handle.get(), CURLOPT_LOW_SPEED_TIME, static_cast<long>(options.timeout_s));
    // A server that sends a byte a second ends here.
    curl_easy_setopt(handle.get(), CURLOPT_TIMEOUT, 20L * options.timeout_s);
    curl_easy_setopt(handle.get(), CURLOPT_PRIVATE, this);
  }

  HttpAnswer answer(CURLcode code, const std::string& url, const HttpGetOptions& options) {
    HttpAnswer out;
    if (code != CURLE_OK) {
      try {
        const std::string_view said(detail.data());
        fail(code, "http://" + host_of(url), said.empty() ? std::string_view(curl_easy_strerror(code)) : said,
             collected, options.timeout_s);
      } catch (const InputError& error) {
        out.problem = error.problem();
      }
      return out;
    }
    long status = 0;
    curl_easy_getinfo(handle.get(), CURLINFO_RESPONSE_CODE, &status);
    out.status = static_cast<int>(status);
    out.body = std::move(collected.reply.body);
    out.retry_after_s = collected.reply.retry_after_s;
    out.keep_s = collected.keep_s;
    return out;
  }

  std::size_t number;
  Collected collected;
  std::array<char, CURL_ERROR_SIZE> detail{};
  CurlEasy handle;
};

/// The requests of http_get_all() that run.
class Gets {
 public:
  Gets() : multi_(curl_multi_init(), &curl_multi_cleanup) {
    if (!multi_) throw InputError("libcurl cannot make requests");
  }
  ~Gets() {
    for (const auto& get : running_) curl_multi_remove_handle(multi_.get(), get->handle.get());
  }
  Gets(const Gets&) = delete;
  Gets& operator=(const Gets&) = delete;

  [[nodiscard]] std::size_t size() const { return running_.size(); }
  void add(std::unique_ptr<Get> get) {
    curl_multi_add_handle(multi_.get(), get->handle.get());
    running_.push_back(std::move(get));
  }
  /// Waits a moment; calls `ended` for each request that has ended, and forgets it.
  template <typename Ended>
  void work(const Ended& ended) {
    int count = 0;
    curl_multi_perform(multi_.get(), &count);
    if (count == static_cast<int>(size())) curl_multi_poll(multi_.get(), nullptr, 0, 200, nullptr);
    int left = 0;
    while (const CURLMsg* message = curl_multi_info_read(multi_.get(), &left)) {
      if (message->msg != CURLMSG_DONE) continue;
      const CURLcode code = message->data.result;
      Get* get = nullptr;
      curl_easy_getinfo(message->easy_handle, CURLINFO_PRIVATE, &get);
      curl_multi_remove_handle(multi_.get(), message->easy_handle);
      const auto found = std::find_if(running_.begin(), running_.end(),
                                      [get](const auto& each) { return each.get() == get; });
      const std::unique_ptr<Get> owned = std::move(*found);
      running_.erase(found);
      ended(*owned, code);
    }
  }

 private:
  std::unique_ptr<CURLM, decltype(&curl_multi_cleanup)> multi_;
  std::vector<std::unique_ptr<Get>> running_;
};

}  // namespace

void http_get_all(const std::vector<std::string>& urls, const HttpGetOptions& options,
                  const std::function<void(std::size_t, HttpAnswer&&)>& done) {
  require_curl();
  Gets gets;
  for (std::size_t next = 0; next < urls.size() || gets.size() > 0;) {
    while (next < urls.size() && gets.size() < static_cast<std::size_t>(options.connections)) {
      gets.add(std::make_unique<Get>(next, urls[next], options));
      ++next;
    }
    gets.work(
        [&](Get& get, CURLcode code) { done(get.number, get.answer(code, urls[get.number], options)); });
  }
}

std::string resolve_url(const std::string& base, const std::string& relative) {
  const std::unique_ptr<CURLU, decltype(&curl_url_cleanup)> parsed(curl_url(), &curl_url_cleanup);
  char* whole = nullptr;
  if (!parsed || curl_url_set(parsed.get(), CURLUPART_URL, base.c_str(), 0) != CURLUE_OK ||
      curl_url_set(parsed.get(), CURLUPART_URL, relative.c_str(), CURLU_URLENCODE) != CURLUE_OK ||
      curl_url_get(parsed.get(), CURLUPART_URL, &whole, 0) != CURLUE_OK) {
    throw InputError(fmt::format("'{}' is not a web address", relative.substr(0, relative.find('?'))));
  }
  const std::unique_ptr<char, decltype(&curl_free)> owner(whole, &curl_free);
  std::string url = whole;
  if (url.rfind("http://", 0) != 0 && url.rfind("https://", 0) != 0) {
    throw InputError(
        fmt::format("'{}' is not an http or https address", relative.substr(0, relative.find('?'))));
  }
  return url;
}

HttpReply http_post(const std::string& url, const std::string& data, int timeout_s) {
  require_curl();
  const CurlEasy handle(curl_easy_init(), &curl_easy_cleanup);
  if (!handle) throw InputError("libcurl cannot make a request");
  CURL* curl = handle.get();
  const std::unique_ptr<char, decltype(&curl_free)> escaped(
      curl_easy_escape(curl, data.c_str(), static_cast<int>(data.size())), &curl_free);
  const std::string form = std::string("data=") + (escaped ? escaped.get() : "");

  Collected collected;
  std::array<char, CURL_ERROR_SIZE> detail{};
  set_what_all_requests_have(curl, collected, detail.data());
  curl_easy_setopt(curl, CURLOPT_URL, url.c_str());
  curl_easy_setopt(curl, CURLOPT_POSTFIELDS, form.c_str());
  curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE, static_cast<long>(form.size()));
  curl_easy_setopt(curl, CURLOPT_POSTREDIR, static_cast<long>(CURL_REDIR_POST_ALL));
  curl_easy_setopt(curl, CURLOPT_TIMEOUT, static_cast<long>(timeout_s));
  curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT, std::min(static_cast<long>(timeout_s), kMaxConnect_s));

  const CURLcode code = curl_easy_perform(curl);
  if (code != CURLE_OK) {
    const std::string_view said(detail.data());
    fail(code, url, said.empty() ? std::string_view(curl_easy_strerror(code)) : said, collected, timeout_s);
  }
  long status = 0;
  curl_easy_getinfo(curl, CURLINFO_RESPONSE_CODE, &status);
  collected.reply.status = static_cast<int>(status);
  return std::move(collected.reply);
}

std::filesystem::path downloads_folder(const std::filesystem::path& cache) {
  if (!cache.empty()) return cache;
  const char* xdg = std::getenv("XDG_CACHE_HOME");
  if (xdg != nullptr && *xdg != '\0') return std::filesystem::path(xdg) / "canyon";
  const char* home = std::getenv("HOME");
  if (home != nullptr && *home != '\0') return std::filesystem::path(home) / ".cache" / "canyon";
  throw InputError("there is no folder to keep downloads in",
                   "set HOME or XDG_CACHE_HOME, or name a cache folder");
}

}  // namespace canyon::buildings
