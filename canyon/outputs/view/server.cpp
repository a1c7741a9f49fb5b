#include "canyon/outputs/view/server.hpp"

#include <fcntl.h>
#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <deque>
#include <future>
#include <list>
#include <optional>
#include <set>
#include <system_error>
#include <thread>
#include <utility>  // which some of Boost.Asio's headers lack

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/post.hpp>
#include <boost/asio/steady_timer.hpp>
#include <boost/asio/thread_pool.hpp>
#include <boost/beast/core/basic_stream.hpp>
#include <boost/beast/core/buffers_to_string.hpp>
#include <boost/beast/core/flat_buffer.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket/rfc6455.hpp>
#include <boost/beast/websocket/stream.hpp>

#include "canyon/base/input_error.hpp"
#include "canyon/outputs/view/page.hpp"

namespace canyon::view {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
namespace http = beast::http;
namespace websocket = beast::websocket;
using asio::ip::tcp;
using boost::system::error_code;
// One executor, and no compression, which the server does not offer: each more takes seconds to compile.
using Executor = asio::io_context::executor_type;
using Stream = beast::basic_stream<tcp, Executor>;
using WebSocket = websocket::stream<Stream, false>;

constexpr std::string_view kFolder = "/view/";
constexpr const char* kMessages = "/messages";

std::string_view view_of(beast::string_view text) {
  return {text.data(), text.size()};
}

/// A message, shared by its receivers.
using Text = std::shared_ptr<const std::string>;

class Socket;
class Connection;

/// State that all connections share; used on the server's thread alone, but for the counters.
struct Shared {
  ServedSite site;
  ServerOptions options;
  int port = 0;
  std::set<Socket*> sockets;
  std::list<Connection*> idle;  ///< HTTP connections without a request, the longest first
  std::vector<Text> greeting;
  asio::thread_pool* work = nullptr;
  std::atomic<std::size_t> clients{0}, dropped{0};

  /// "127.0.0.1:PORT" or "localhost:PORT": another name that leads here is a foreign page's.
  [[nodiscard]] bool is_here(std::string_view host) const {
    return host == fmt::format("127.0.0.1:{}", port) || host == fmt::format("localhost:{}", port);
  }
  [[nodiscard]] bool is_own_origin(std::string_view origin) const {
    constexpr std::string_view kScheme = "http://";
    return origin.substr(0, kScheme.size()) == kScheme && is_here(origin.substr(kScheme.size()));
  }
};

/// Counts a connection for as long as it lives.
std::shared_ptr<void> counted(const std::shared_ptr<Shared>& shared) {
  ++shared->clients;
  return {nullptr, [shared](void*) { --shared->clients; }};
}

/// A WebSocket client.
class Socket : public std::enable_shared_from_this<Socket> {
 public:
  Socket(Stream stream, std::shared_ptr<Shared> shared, std::shared_ptr<void> count)
      : stream_(std::move(stream)), shared_(std::move(shared)), counted_(std::move(count)) {}
  ~Socket() { shared_->sockets.erase(this); }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;

  void accept(const http::request<http::empty_body>& request) {
    beast::get_lowest_layer(stream_).expires_never();  // the WebSocket has clocks of its own
    websocket::stream_base::timeout clocks{};
    clocks.handshake_timeout = shared_->options.timeout;
    clocks.idle_timeout = shared_->options.timeout;
    clocks.keep_alive_pings = true;
    stream_.set_option(clocks);
    stream_.read_message_max(shared_->options.max_message_bytes);
    stream_.async_accept(request, [self = shared_from_this()](error_code error) {
      if (error) return;
      self->shared_->sockets.insert(self.get());
      for (const Text& text : self->shared_->greeting) self->send(text, true);
      self->read();
    });
  }

  /// @param must it is never dropped: a response, or the greeting
  /// @param response the next message is read once it is sent
  void send(Text text, bool must, bool response = false) {
    if (!must && waiting_.size() >= shared_->options.max_queued) {
      // The first may be on its way.
      const auto oldest =
          std::find_if(waiting_.begin() + 1, waiting_.end(), [](const Waiting& w) { return !w.must; });
      if (oldest != waiting_.end()) waiting_.erase(oldest);
      ++shared_->dropped;
      if (waiting_.size() >= shared_->options.max_queued) return;
    }
    waiting_.push_back({std::move(text), must, response});
    if (waiting_.size() == 1) write();
  }
  /// Nothing waits to be sent.
  [[nodiscard]] bool idle() const { return waiting_.empty(); }

 private:
  struct Waiting {
    Text text;
    bool must = false, response = false;
  };

  void read() {
    stream_.async_read(buffer_, [self = shared_from_this()](error_code error, std::size_t) {
      if (error) return self->leave();
      std::string message = beast::buffers_to_string(self->buffer_.data());
      self->buffer_.consume(self->buffer_.size());
      self->submit(std::move(message));
    });
  }

  /// Reads the next message when the response to this one is sent. A client that floods is queued; a client
  /// that stops reading is not served.
  void submit(std::string message) {
    if (!shared_->site.handle_message) return read();
    asio::post(*shared_->work, [self = shared_from_this(), message = std::move(message)]() mutable {
      std::string response;
      try {
        response = self->shared_->site.handle_message(message);
      } catch (const std::exception&) {  // the response to a message reports its errors
      }
      // Handed back whole, since a connection's data belong to the server's thread.
      const auto home = self->stream_.get_executor();
      asio::post(home, [self = std::move(self), response = std::move(response)]() mutable {
        if (response.empty()) return self->read();
        self->send(std::make_shared<const std::string>(std::move(response)), true, true);
      });
    });
  }

  void write() {
    stream_.text(true);
    stream_.async_write(asio::buffer(*waiting_.front().text),
                        [self = shared_from_this()](error_code error, std::size_t) {
                          if (error) return self->leave();
                          const bool answered = self->waiting_.front().response;
                          self->waiting_.pop_front();
                          if (!self->waiting_.empty()) self->write();
                          if (answered) self->read();
                        });
  }

  void leave() {
    shared_->sockets.erase(this);
    beast::get_lowest_layer(stream_).close();
  }

  WebSocket stream_;
  std::shared_ptr<Shared> shared_;
  std::shared_ptr<void> counted_;
  beast::flat_buffer buffer_;
  std::deque<Waiting> waiting_;
};

/// An HTTP connection.
class Connection : public std::enable_shared_from_this<Connection> {
 public:
  Connection(Stream::socket_type socket, std::shared_ptr<Shared> shared)
      : stream_(std::move(socket)), shared_(std::move(shared)), counted_(counted(shared_)) {}
  ~Connection() { shared_->idle.remove(this); }
  Connection(const Connection&) = delete;
  Connection& operator=(const Connection&) = delete;

  void read() {
    shared_->idle.push_back(this);
    parser_.emplace();
    parser_->header_limit(static_cast<std::uint32_t>(shared_->options.max_header_bytes));
    parser_->body_limit(0);
    stream_.expires_after(shared_->options.timeout);
    http::async_read(stream_, buffer_, *parser_, [self = shared_from_this()](error_code error, std::size_t) {
      self->shared_->idle.remove(self.get());
      if (!error) return self->handle();
      // Bad HTTP gets an error; a silent or closed connection is dropped.
      if (error == http::error::end_of_stream || error == beast::error::timeout ||
          error.category() != make_error_code(http::error::bad_method).category())
        return self->close();
      self->refuse(http::status::bad_request, "Canyon does not take this request", true);
    });
  }

  void close() {
    shared_->idle.remove(this);
    error_code error;
    stream_.socket().shutdown(tcp::socket::shutdown_send, error);
    stream_.close();
  }

 private:
  using Request = http::request<http::empty_body>;

  void handle() {
    const Request& request = parser_->get();
    // Given twice, it is not valid.
    if (request.count(http::field::host) != 1 || !shared_->is_here(view_of(request[http::field::host])))
      return refuse(http::status::forbidden, "ask for this server by its own address, 127.0.0.1");
    const auto origins = request.count(http::field::origin);
    if (origins > 1 || (origins == 1 && !shared_->is_own_origin(view_of(request[http::field::origin]))))
      return refuse(http::status::forbidden, "pages of other origins are not served");
    if (request.method() != http::verb::get && request.method() != http::verb::head)
      return refuse(http::status::method_not_allowed, "only GET and HEAD are answered");
    std::string_view target = view_of(request.target());
    if (websocket::is_upgrade(request)) {
      if (target != kMessages) return refuse(http::status::not_found, "there is nothing of this name");
      std::make_shared<Socket>(std::move(stream_), shared_, counted_)->accept(request);
      return;
    }
    target = target.substr(0, target.find('?'));
    if (target == "/") return give_page();
    if (target.substr(0, kFolder.size()) == kFolder) {
      const std::string_view name = target.substr(kFolder.size());
      if (is_served_name(name)) return give_file(shared_->site.folder / name);
    }
    refuse(http::status::not_found, "there is nothing of this name");
  }

  template <typename Body>
  [[nodiscard]] http::response<Body> response(http::status status, const char* type) const {
    const auto version = parser_->get().version();
    http::response<Body> response{status, version == 10 ? 10U : 11U};
    response.set(http::field::server, "canyon");
    response.set(http::field::content_type, type);
    response.set(http::field::cache_control, "no-store");
    response.set("Referrer-Policy", "no-referrer");
    response.set("X-Content-Type-Options", "nosniff");
    response.set("Cross-Origin-Resource-Policy", "same-origin");
    response.set(
        "Content-Security-Policy",
        fmt::format(
            "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: "
            "blob:; connect-src 'self' ws://127.0.0.1:{0} ws://localhost:{0}; base-uri 'none'; "
            "form-action 'none'; frame-ancestors 'none'",
            shared_->port));
    response.keep_alive(parser_->get().keep_alive());
    return response;
  }

  void give_page() {
    auto page = response<http::string_body>(http::status::ok, "text/html; charset=utf-8");
    if (parser_->get().method() == http::verb::get) page.body() = shared_->site.page;
    page.content_length(shared_->site.page.size());
    write(std::move(page));
  }

  void give_file(const std::filesystem::path& path) {
    std::error_code missing;
    if (!std::filesystem::is_regular_file(std::filesystem::symlink_status(path, missing)))
      return refuse(http::status::not_found, "there is nothing of this name");
    const char* type = path.extension() == ".json" ? "application/json" : "application/octet-stream";
    auto file = response<http::file_body>(http::status::ok, type);
    error_code error;
    file.body().open(path.c_str(), beast::file_mode::scan, error);
    if (error) return refuse(http::status::not_found, "there is nothing of this name");
    const auto size = file.body().size();
    if (parser_->get().method() == http::verb::head) {
      auto head = response<http::string_body>(http::status::ok, type);
      head.content_length(size);
      return write(std::move(head));
    }
    file.content_length(size);
    write(std::move(file));
  }

  void refuse(http::status status, const char* why, bool last = false) {
    auto refusal = response<http::string_body>(status, "text/plain; charset=utf-8");
    refusal.body() = fmt::format("{}\n", why);
    refusal.prepare_payload();
    if (last) refusal.keep_alive(false);
    write(std::move(refusal));
  }

  template <typename Body>
  void write(http::response<Body>&& response) {
    const auto kept = std::make_shared<http::response<Body>>(std::move(response));
    const auto serializer = std::make_shared<http::response_serializer<Body>>(*kept);
    stream_.expires_after(shared_->options.timeout);
    http::async_write(stream_, *serializer,
                      [self = shared_from_this(), kept, serializer](error_code error, std::size_t) {
                        if (error || !kept->keep_alive()) return self->close();
                        self->read();
                      });
  }

  Stream stream_;
  std::shared_ptr<Shared> shared_;
  std::shared_ptr<void> counted_;
  beast::flat_buffer buffer_;
  std::optional<http::request_parser<http::empty_body>> parser_;
};

}  // namespace

struct Server::Impl {
  asio::io_context io{1};
  std::shared_ptr<Shared> shared = std::make_shared<Shared>();
  asio::basic_socket_acceptor<tcp, Executor> acceptor{io};
  asio::steady_timer pause{io};
  asio::thread_pool work{1};  // behind io: what waits there holds connections
  std::thread thread;

  void listen() {
    if (shared->options.port < 0 || shared->options.port > 65535) {
      throw InputError(fmt::format("port {} does not exist", shared->options.port),
                       "use a port of 1024 to 65535, or 0 for a free one");
    }
    error_code error;
    acceptor.open(tcp::v4(), error);
    if (!error) acceptor.set_option(asio::socket_base::reuse_address(true), error);
    const auto port = static_cast<unsigned short>(shared->options.port);
    if (!error) acceptor.bind({asio::ip::address_v4::loopback(), port}, error);
    if (!error) acceptor.listen(asio::socket_base::max_listen_connections, error);
    if (error) {
      throw InputError(fmt::format("port {} of 127.0.0.1 cannot be opened: {}", port, error.message()),
                       "leave --port out, or take another one that no other program uses");
    }
    // A browser that this program starts must not hold the port.
    fcntl(acceptor.native_handle(), F_SETFD, FD_CLOEXEC);
    shared->port = acceptor.local_endpoint().port();
  }

  void accept() {
    acceptor.async_accept([this](error_code error, Stream::socket_type socket) {
      if (error == asio::error::operation_aborted) return;
      if (error) {  // no descriptor is free: the next try is soon enough
        pause.expires_after(std::chrono::milliseconds(100));
        pause.async_wait([this](error_code ended) {
          if (!ended) accept();
        });
        return;
      }
      bool free = shared->clients < shared->options.max_clients;
      if (!free && !shared->idle.empty()) {
        shared->idle.front()->close();
        free = true;
      }
      if (free) {
        error_code ignored;
        socket.set_option(tcp::no_delay(true), ignored);
        std::make_shared<Connection>(std::move(socket), shared)->read();
      }
      accept();
    });
  }
};

Server::Server(ServedSite site, const ServerOptions& options) : impl_(std::make_unique<Impl>()) {
  impl_->shared->site = std::move(site);
  impl_->shared->options = options;
  impl_->shared->work = &impl_->work;
  impl_->listen();
  impl_->accept();
  impl_->thread = std::thread([this] { impl_->io.run(); });
}

Server::~Server() {
  impl_->work.stop();
  impl_->work.join();
  impl_->io.stop();
  impl_->thread.join();
}

int Server::port() const {
  return impl_->shared->port;
}

std::string Server::address() const {
  return fmt::format("http://127.0.0.1:{}/", impl_->shared->port);
}

void Server::greet(std::vector<std::string> messages) {
  asio::post(impl_->io, [shared = impl_->shared, messages = std::move(messages)]() mutable {
    shared->greeting.clear();
    for (std::string& message : messages)
      shared->greeting.push_back(std::make_shared<const std::string>(std::move(message)));
  });
}

void Server::send(std::string message) {
  asio::post(impl_->io,
             [shared = impl_->shared, text = std::make_shared<const std::string>(std::move(message))] {
               // One whose write fails at once leaves the set.
               const std::vector<Socket*> sockets(shared->sockets.begin(), shared->sockets.end());
               for (Socket* socket : sockets) socket->send(text, false);
             });
}

bool Server::flush(std::chrono::milliseconds maximum) {
  const auto until = std::chrono::steady_clock::now() + maximum;
  const auto idle = [shared = impl_->shared] {
    return std::all_of(shared->sockets.begin(), shared->sockets.end(),
                       [](const Socket* s) { return s->idle(); });
  };
  for (;;) {
    std::promise<bool> result;
    asio::post(impl_->io, [&] { result.set_value(idle()); });
    if (result.get_future().get()) return true;
    if (std::chrono::steady_clock::now() >= until) return false;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
  }
}

std::size_t Server::clients() const {
  return impl_->shared->clients;
}

std::size_t Server::dropped() const {
  return impl_->shared->dropped;
}

}  // namespace canyon::view
