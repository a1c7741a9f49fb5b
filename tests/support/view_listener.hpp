#pragma once

#include <string>
#include <utility>  // which some of Boost.Asio's headers lack

#include <boost/asio.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/websocket.hpp>

#include "canyon/outputs/view/server.hpp"

namespace canyon::test {

/// A WebSocket client of a viewer's server.
class Listener {
 public:
  explicit Listener(const view::Server& server, const std::string& origin = "") : socket_(io_) {
    socket_.next_layer().connect(
        {boost::asio::ip::address_v4::loopback(), static_cast<unsigned short>(server.port())});
    const std::string at = "127.0.0.1:" + std::to_string(server.port());
    socket_.set_option(
        boost::beast::websocket::stream_base::decorator([=](boost::beast::websocket::request_type& request) {
          request.set(boost::beast::http::field::origin, origin.empty() ? "http://" + at : origin);
        }));
    socket_.handshake(at, "/messages", error);
  }
  std::string read() {
    boost::beast::flat_buffer buffer;
    socket_.read(buffer, error);
    return error ? "" : boost::beast::buffers_to_string(buffer.data());
  }
  void write(const std::string& text) { socket_.write(boost::asio::buffer(text), error); }
  boost::system::error_code error;

 private:
  boost::asio::io_context io_;
  boost::beast::websocket::stream<boost::asio::ip::tcp::socket> socket_;
};

}  // namespace canyon::test
