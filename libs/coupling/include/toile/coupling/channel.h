// A connection that carries one message at a time, over ZeroMQ.
#pragma once

#include "toile/base/fields.h"
#include "toile/base/result.h"

#include <functional>
#include <memory>
#include <string>
#include <string_view>

namespace toile::coupling {

/// Who may connect to the side that listens.
enum class Reach {
  loopback,  ///< programs of this machine
  network,   ///< whoever reaches the address
};

constexpr const char* default_endpoint = "tcp://127.0.0.1:7117";

struct ChannelOptions {
  std::string endpoint = default_endpoint;
  double timeout = 60;  ///< for a message to come, the first one included [s]
  Reach reach = Reach::loopback;
  static void describe(auto& f) {
    f(&ChannelOptions::endpoint, {.key = "endpoint", .doc = "address of ZeroMQ at which the two programs meet: tcp://127.0.0.1:PORT, or ipc://FILE", .local = true});
    f(&ChannelOptions::timeout, {.key = "timeout", .doc = "how long the other side may take to come, and for any answer", .unit = "s", .min = 1e-3, .max = 1e6, .local = true});
    f(&ChannelOptions::reach, {.key = "reach", .doc = "loopback: addresses of this machine only; network: any, for whoever can reach it (nothing is encrypted, nobody has to prove who he is)", .local = true});
  }
};

/// The two ends are alike once they have met. Move only; closing sends what is still on its way (for a second at most).
class Channel {
 public:
  /// Waits at the endpoint for one peer; `tcp://127.0.0.1:*` takes a free port.
  /// error  "bad_endpoint" (also one that is not of this machine without Reach::network, or taken), "no_messaging" in a build without ZeroMQ
  static Result<Channel> listen(const ChannelOptions& options);
  /// Goes to the endpoint; nobody need be there yet.
  static Result<Channel> call(const ChannelOptions& options);
  Channel(Channel&&) noexcept;
  Channel& operator=(Channel&&) noexcept;
  ~Channel();

  /// With the port that was taken.
  const std::string& endpoint() const;
  /// Asked ten times a second while the channel waits: true ends the waiting.
  void set_interrupted(std::function<bool()> interrupted);

  /// error  "no_peer" when nobody has come in time, "peer_gone", "interrupted"
  Issues send(std::string_view bytes);
  /// error  "peer_late" when nothing has come in time, "peer_gone" when the other end died or closed, "interrupted"
  Result<std::string> receive();

 private:
  struct Socket;
  explicit Channel(std::unique_ptr<Socket> socket);
  std::unique_ptr<Socket> socket_;
};

}  // namespace toile::coupling

template <>
struct toile::Choices<toile::coupling::Reach> {
  static constexpr std::array names{std::pair{"loopback", toile::coupling::Reach::loopback}, std::pair{"network", toile::coupling::Reach::network}};
};
