#include "adapters/gazebo_classic/ros_master.hpp"

#include <curl/curl.h>

#include <memory>
#include <string_view>

#include "canyon/base/text.hpp"

namespace canyon::adapters::gazebo_classic {
namespace {

std::size_t append(const char* bytes, std::size_t size, std::size_t count, void* result) {
  constexpr std::size_t kMax = 1 << 16;  // a master's response has some hundred bytes
  auto& text = *static_cast<std::string*>(result);
  if (text.size() + size * count > kMax) return 0;
  text.append(bytes, size * count);
  return size * count;
}

/// The body of the response to a request; empty if there is none.
std::string post(const std::string& uri, const std::string& body, std::chrono::milliseconds timeout,
                 int stop_fd) {
  static const CURLcode started = curl_global_init(CURL_GLOBAL_DEFAULT);
  const std::unique_ptr<CURLM, decltype(&curl_multi_cleanup)> all(curl_multi_init(), &curl_multi_cleanup);
  const std::unique_ptr<CURL, decltype(&curl_easy_cleanup)> one(curl_easy_init(), &curl_easy_cleanup);
  const std::unique_ptr<curl_slist, decltype(&curl_slist_free_all)> head(
      curl_slist_append(nullptr, "Content-Type: text/xml"), &curl_slist_free_all);
  if (started != CURLE_OK || !all || !one || !head) return {};
  std::string response;
  curl_easy_setopt(one.get(), CURLOPT_URL, uri.c_str());
  curl_easy_setopt(one.get(), CURLOPT_HTTP_VERSION, static_cast<long>(CURL_HTTP_VERSION_1_0));
  curl_easy_setopt(one.get(), CURLOPT_HTTPHEADER, head.get());
  curl_easy_setopt(one.get(), CURLOPT_POSTFIELDS, body.c_str());
  curl_easy_setopt(one.get(), CURLOPT_NOPROXY, "*");
  curl_easy_setopt(one.get(), CURLOPT_NOSIGNAL, 1L);
  curl_easy_setopt(one.get(), CURLOPT_TIMEOUT_MS, static_cast<long>(timeout.count()));
  curl_easy_setopt(one.get(), CURLOPT_WRITEFUNCTION, &append);
  curl_easy_setopt(one.get(), CURLOPT_WRITEDATA, &response);
  curl_multi_add_handle(all.get(), one.get());
  curl_waitfd stop{stop_fd, CURL_WAIT_POLLIN, 0};
  constexpr int kLook_ms = 1000;
  for (int running = 1; stop.revents == 0;
       curl_multi_poll(all.get(), &stop, stop_fd < 0 ? 0 : 1, kLook_ms, nullptr))
    if (curl_multi_perform(all.get(), &running) != CURLM_OK || running == 0) break;
  int left = 0;
  const CURLMsg* const done = curl_multi_info_read(all.get(), &left);
  const bool whole = done != nullptr && done->data.result == CURLE_OK;
  curl_multi_remove_handle(all.get(), one.get());
  return whole ? response : std::string();
}

/// The response is [code, message, value]; code 1 is success, 0 and -1 are failures.
MasterReply parse_answer(const std::string& response) {
  if (response.empty()) return MasterReply::None;
  for (const std::string_view tag : {"<int>", "<i4>"}) {
    const std::size_t begin = response.find(tag);
    if (begin == std::string::npos) continue;
    const std::string_view rest = std::string_view(response).substr(begin + tag.size());
    return trim(rest.substr(0, rest.find('<'))) == "1" ? MasterReply::Registered : MasterReply::Unknown;
  }
  return MasterReply::None;
}

}  // namespace

std::string MasterAddress::uri() const {
  return "http://" + host + ':' + std::to_string(port) + '/';
}

std::optional<MasterAddress> parse_master_uri(const std::string& uri) {
  constexpr std::string_view kScheme = "http://";
  std::string_view rest = uri;
  if (rest.substr(0, kScheme.size()) != kScheme) return std::nullopt;
  rest.remove_prefix(kScheme.size());
  if (!rest.empty() && rest.back() == '/') rest.remove_suffix(1);
  const std::size_t colon = rest.find(':');
  if (colon == 0 || colon == std::string_view::npos) return std::nullopt;
  const std::string_view host = rest.substr(0, colon);
  if (host.find_first_of("/ \t\r\n<>") != std::string_view::npos) return std::nullopt;
  const auto port = parse_integer(rest.substr(colon + 1));
  if (!port || *port < 1 || *port > 65535) return std::nullopt;
  return MasterAddress{std::string(host), static_cast<std::uint16_t>(*port)};
}

MasterReply query_master(const MasterAddress& master, const std::string& node,
                         std::chrono::milliseconds timeout, int stop_fd) noexcept {
  try {
    const std::string name = "<param><value><string>" + node + "</string></value></param>";
    const std::string body =
        "<?xml version=\"1.0\"?><methodCall><methodName>lookupNode</methodName><params>" + name + name +
        "</params></methodCall>";
    return parse_answer(post(master.uri(), body, timeout, stop_fd));
  } catch (...) {  // out of memory
    return MasterReply::None;
  }
}

}  // namespace canyon::adapters::gazebo_classic
