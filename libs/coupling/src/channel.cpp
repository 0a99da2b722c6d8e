#include "toile/coupling/channel.h"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstring>
#include <optional>

#if TOILE_HAS_ZMQ
#include <zmq.h>
#endif

namespace toile::coupling {

#if TOILE_HAS_ZMQ

namespace {

constexpr long slice = 100;                      // between looks at `interrupted` [ms]
constexpr std::int64_t largest = 4 << 20;        // bytes of a message; a longer one ends the connection

bool of_this_machine(const std::string& endpoint) {
  if (endpoint.starts_with("ipc://")) return true;
  for (const char* prefix : {"tcp://127.", "tcp://localhost:", "tcp://[::1]:"}) {
    if (endpoint.starts_with(prefix)) return true;
  }
  return false;
}

}  // namespace

struct Channel::Socket {
  ChannelOptions options;
  std::string endpoint;
  bool listens = false;
  void* context = nullptr;
  void* socket = nullptr;
  void* monitor = nullptr;
  std::function<bool()> interrupted;
  bool connected = false;       // calling side: the handshake of the transport is done
  std::optional<int> peer;      // descriptor of the peer's connection, once it has spoken
  bool gone = false;
  std::vector<int> closed;      // connections that ended before anybody spoke

  ~Socket() {
    // In this order: an event without anybody to take it would block the context for ever.
    if (socket) zmq_socket_monitor(socket, nullptr, 0);
    if (monitor) zmq_close(monitor);
    if (socket) {
      const int none = 0;
      if (gone || !(connected || peer)) zmq_setsockopt(socket, ZMQ_LINGER, &none, sizeof none);
      zmq_close(socket);
    }
    if (context) zmq_ctx_term(context);
  }

  Issue bad_endpoint(const std::string& what, const std::string& remedy) const { return {"bad_endpoint", {.item = "endpoint"}, what, remedy}; }

  Issues open() {
    if (options.reach == Reach::loopback && !of_this_machine(options.endpoint)) {
      return {bad_endpoint(fmt::format("'{}' is not an address of this machine alone", options.endpoint), "write tcp://127.0.0.1:PORT or ipc://FILE, or `reach: network` if others may connect")};
    }
    context = zmq_ctx_new();
    socket = zmq_socket(context, ZMQ_PAIR);
    const auto set = [&](int option, int value) { zmq_setsockopt(socket, option, &value, sizeof value); };
    set(ZMQ_LINGER, 1000);
    set(ZMQ_IPV6, options.endpoint.find('[') != std::string::npos);
    set(ZMQ_HEARTBEAT_IVL, 2000);
    set(ZMQ_HEARTBEAT_TIMEOUT, 20000);
    set(ZMQ_RECONNECT_IVL, 50);
    zmq_setsockopt(socket, ZMQ_MAXMSGSIZE, &largest, sizeof largest);
    static std::atomic<int> count{0};
    const std::string events = fmt::format("inproc://events-{}", count++);
    if (zmq_socket_monitor(socket, events.c_str(), ZMQ_EVENT_ACCEPTED | ZMQ_EVENT_HANDSHAKE_SUCCEEDED | ZMQ_EVENT_DISCONNECTED) == 0) {
      monitor = zmq_socket(context, ZMQ_PAIR);
      const int none = 0;
      zmq_setsockopt(monitor, ZMQ_LINGER, &none, sizeof none);
      zmq_connect(monitor, events.c_str());
    }
    const int failed = listens ? zmq_bind(socket, options.endpoint.c_str()) : zmq_connect(socket, options.endpoint.c_str());
    if (failed) {
      const int reason = zmq_errno();
      return {bad_endpoint(fmt::format("'{}' can not be {}: {}", options.endpoint, listens ? "listened at" : "called", zmq_strerror(reason)),
                           reason == EADDRINUSE ? "end the program that has it, or take another port" : "write it as tcp://127.0.0.1:PORT or ipc://FILE")};
    }
    endpoint = options.endpoint;
    char name[1024];
    std::size_t length = sizeof name;
    if (listens && zmq_getsockopt(socket, ZMQ_LAST_ENDPOINT, name, &length) == 0) endpoint = name;
    return {};
  }

  /// Takes note of what the transport reports.
  void look() {
    while (monitor) {
      zmq_msg_t event, address;
      zmq_msg_init(&event);
      if (zmq_msg_recv(&event, monitor, ZMQ_DONTWAIT) < 0) {
        zmq_msg_close(&event);
        return;
      }
      std::uint16_t kind = 0;
      std::int32_t value = 0;
      if (zmq_msg_size(&event) >= 6) {
        std::memcpy(&kind, zmq_msg_data(&event), 2);
        std::memcpy(&value, static_cast<const char*>(zmq_msg_data(&event)) + 2, 4);
      }
      zmq_msg_close(&event);
      zmq_msg_init(&address);
      zmq_msg_recv(&address, monitor, 0);
      zmq_msg_close(&address);
      if (kind == ZMQ_EVENT_HANDSHAKE_SUCCEEDED) {
        connected = true;
      } else if (kind == ZMQ_EVENT_ACCEPTED) {
        std::erase(closed, value);  // descriptors are used again
      } else if (kind == ZMQ_EVENT_DISCONNECTED) {
        // The listening side knows its peer by the first message; others may come and go. The calling side has one connection.
        if (listens ? peer == value : connected) gone = true;
        if (listens && !peer) closed.push_back(value);
      }
    }
  }

  Issue peer_gone() const {
    if (!listens && !peer) {
      return {"peer_gone", {.item = "endpoint"}, fmt::format("the program at {} closed the connection before it said anything", endpoint), "look whether it is toile-simulate, and whether another program is connected to it already"};
    }
    return {"peer_gone", {.item = "endpoint"}, fmt::format("the other program at {} died or closed the connection", endpoint), "see what it wrote last, and start both again"};
  }
  Issue stopped() const { return {"interrupted", {}, "stopped while waiting for the other program", "start both again", Category::interrupted}; }

  /// Waits until the socket is ready for `events`; false when the time is over.
  Result<bool> wait(short events) {
    using Clock = std::chrono::steady_clock;
    const auto until = Clock::now() + std::chrono::duration<double>(options.timeout);
    while (true) {
      zmq_pollitem_t items[2] = {{socket, 0, events, 0}, {monitor, 0, ZMQ_POLLIN, 0}};
      const double left = std::chrono::duration<double, std::milli>(until - Clock::now()).count();
      const int ready = zmq_poll(items, monitor ? 2 : 1, std::clamp(static_cast<long>(left) + 1, 0L, slice));
      if (ready > 0 && (items[0].revents & events)) return true;
      if (ready > 0) look();
      if (interrupted && interrupted()) return stopped();
      if (gone) {
        // A last message may still be there.
        zmq_pollitem_t last[1] = {{socket, 0, events, 0}};
        if (events == ZMQ_POLLIN && zmq_poll(last, 1, 20) > 0) return true;
        return peer_gone();
      }
      if (left <= 0) return false;
    }
  }

  Issue late() const {
    return {"peer_late", {.item = "timeout"}, fmt::format("nothing came from the other program at {} within {:g} s", endpoint, options.timeout), "give it more time with `timeout`, or see why it waits"};
  }
  Issue absent() const {
    return {"no_peer", {.item = "endpoint"}, fmt::format("no program came to {} within {:g} s", endpoint, options.timeout),
            listens ? "start the mechanism (toile-drive) with this endpoint" : "start toile-simulate with `couple` and this endpoint"};
  }
};

Result<Channel> Channel::listen(const ChannelOptions& options) {
  auto socket = std::make_unique<Socket>();
  socket->options = options;
  socket->listens = true;
  if (Issues issues = socket->open(); !issues.empty()) return issues;
  return Channel(std::move(socket));
}

Result<Channel> Channel::call(const ChannelOptions& options) {
  auto socket = std::make_unique<Socket>();
  socket->options = options;
  if (Issues issues = socket->open(); !issues.empty()) return issues;
  return Channel(std::move(socket));
}

Issues Channel::send(std::string_view bytes) {
  Socket& s = *socket_;
  s.look();
  if (s.gone) return {s.peer_gone()};
  const auto ready = s.wait(ZMQ_POLLOUT);
  if (!ready) return ready.issues();
  if (!*ready) return {s.absent()};
  while (zmq_send(s.socket, bytes.data(), bytes.size(), ZMQ_DONTWAIT) < 0) {
    if (zmq_errno() == EINTR) continue;
    s.look();
    return {s.peer_gone()};
  }
  return {};
}

Result<std::string> Channel::receive() {
  Socket& s = *socket_;
  const auto ready = s.wait(ZMQ_POLLIN);
  if (!ready) return ready.issues();
  if (!*ready) return s.peer || s.connected ? s.late() : s.absent();
  zmq_msg_t message;
  zmq_msg_init(&message);
  while (zmq_msg_recv(&message, s.socket, ZMQ_DONTWAIT) < 0) {
    if (zmq_errno() == EINTR) continue;
    zmq_msg_close(&message);
    s.look();
    return s.peer_gone();
  }
  std::string bytes(static_cast<const char*>(zmq_msg_data(&message)), zmq_msg_size(&message));
  if (!s.peer) {
    s.peer = zmq_msg_get(&message, ZMQ_SRCFD);
    // It may have ended before its message was read.
    s.look();
    if (s.listens && std::find(s.closed.begin(), s.closed.end(), *s.peer) != s.closed.end()) s.gone = true;
  }
  // A message of several parts is none of ours.
  const bool more = zmq_msg_more(&message) != 0;
  zmq_msg_close(&message);
  if (more) bytes.clear();
  while (more) {
    zmq_msg_init(&message);
    const bool got = zmq_msg_recv(&message, s.socket, ZMQ_DONTWAIT) >= 0;
    const bool again = got && zmq_msg_more(&message) != 0;
    zmq_msg_close(&message);
    if (!again) break;
  }
  return bytes;
}

#else

struct Channel::Socket {
  std::string endpoint;
  std::function<bool()> interrupted;
};

namespace {
Issue no_messaging() { return {"no_messaging", {.item = "endpoint"}, "this build has no messaging", "install libzmq3-dev, configure and build again"}; }
}  // namespace

Result<Channel> Channel::listen(const ChannelOptions&) { return no_messaging(); }
Result<Channel> Channel::call(const ChannelOptions&) { return no_messaging(); }
Issues Channel::send(std::string_view) { return {no_messaging()}; }
Result<std::string> Channel::receive() { return no_messaging(); }

#endif

Channel::Channel(std::unique_ptr<Socket> socket) : socket_(std::move(socket)) {}
Channel::Channel(Channel&&) noexcept = default;
Channel& Channel::operator=(Channel&&) noexcept = default;
Channel::~Channel() = default;
const std::string& Channel::endpoint() const { return socket_->endpoint; }
void Channel::set_interrupted(std::function<bool()> interrupted) { socket_->interrupted = std::move(interrupted); }

}  // namespace toile::coupling
