#include "canyon/buildings/sources/http_client.hpp"

#include <curl/curl.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
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
  bool too_large = false;
};

extern "C" std::size_t canyon_http_body(char* data, std::size_t size, std::size_t count, void* user) {
  auto& collected = *static_cast<Collected*>(user);
  const std::size_t bytes = size * count;
  if (bytes > kMaxBody - collected.reply.body.size()) {
    collected.too_large = true;
    return 0;  // ends the transfer
  }
  collected.reply.body.append(data, bytes);
  return bytes;
}

extern "C" std::size_t canyon_http_header(char* data, std::size_t size, std::size_t count, void* user) {
  auto& reply = static_cast<Collected*>(user)->reply;
  const std::string_view line(data, size * count);
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
  // Once, before the first handle; never cleaned up, since other users of libcurl may live in the process.
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

}  // namespace

HttpReply http_post(const std::string& url, const std::string& data, int timeout_s) {
  require_curl();
  const std::unique_ptr<CURL, decltype(&curl_easy_cleanup)> handle(curl_easy_init(), &curl_easy_cleanup);
  if (!handle) throw InputError("libcurl cannot make a request");
  CURL* curl = handle.get();
  const std::unique_ptr<char, decltype(&curl_free)> escaped(
      curl_easy_escape(curl, data.c_str(), static_cast<int>(data.size())), &curl_free);
  const std::string form = std::string("data=") + (escaped ? escaped.get() : "");

  Collected collected;
  std::array<char, CURL_ERROR_SIZE> detail{};
  curl_easy_setopt(curl, CURLOPT_URL, url.c_str());
  curl_easy_setopt(curl, CURLOPT_POSTFIELDS, form.c_str());
  curl_easy_setopt(curl, CURLOPT_POSTFIELDSIZE, static_cast<long>(form.size()));
  curl_easy_setopt(curl, CURLOPT_USERAGENT, kUserAgent);
  curl_easy_setopt(curl, CURLOPT_ACCEPT_ENCODING, "");  // all that libcurl can unpack
  curl_easy_setopt(curl, CURLOPT_FOLLOWLOCATION, 1L);
  curl_easy_setopt(curl, CURLOPT_MAXREDIRS, 5L);
  curl_easy_setopt(curl, CURLOPT_POSTREDIR, static_cast<long>(CURL_REDIR_POST_ALL));
#if LIBCURL_VERSION_NUM >= 0x075500
  curl_easy_setopt(curl, CURLOPT_PROTOCOLS_STR, "http,https");
  curl_easy_setopt(curl, CURLOPT_REDIR_PROTOCOLS_STR, "http,https");
#else
  curl_easy_setopt(curl, CURLOPT_PROTOCOLS, static_cast<long>(CURLPROTO_HTTP | CURLPROTO_HTTPS));
  curl_easy_setopt(curl, CURLOPT_REDIR_PROTOCOLS, static_cast<long>(CURLPROTO_HTTP | CURLPROTO_HTTPS));
#endif
  curl_easy_setopt(curl, CURLOPT_TIMEOUT, static_cast<long>(timeout_s));
  curl_easy_setopt(curl, CURLOPT_CONNECTTIMEOUT, std::min(static_cast<long>(timeout_s), kMaxConnect_s));
  curl_easy_setopt(curl, CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(curl, CURLOPT_ERRORBUFFER, detail.data());
  curl_easy_setopt(curl, CURLOPT_WRITEFUNCTION, &canyon_http_body);
  curl_easy_setopt(curl, CURLOPT_WRITEDATA, &collected);
  curl_easy_setopt(curl, CURLOPT_HEADERFUNCTION, &canyon_http_header);
  curl_easy_setopt(curl, CURLOPT_HEADERDATA, &collected);

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

}  // namespace canyon::buildings
