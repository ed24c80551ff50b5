// Implements `evalbus bridge plotjuggler`, which sends the values of an active run to PlotJuggler's UDP
// server.

#include <fmt/format.h>
#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <memory>
#include <span>

#include "base/errors.h"
#include "bus/attach.h"
#include "bus/bus.h"
#include "bus/host.h"
#include "cli/commands/commands.h"
#include "export/plotjuggler.h"

namespace evalbus::commands {
namespace {

// Gap between consecutive episodes on PlotJuggler's time axis.
constexpr double kGap_s = 1;

struct BridgeOptions {
  Address address;
  std::string plotjuggler;  // HOST:PORT
};

// Sends datagrams without waiting. They are lost if nothing receives them.
class UdpSender {
 public:
  // Throws InputError if the address is not HOST:PORT, or if the host is unknown or cannot be reached.
  explicit UdpSender(const std::string& address) {
    const size_t colon = address.rfind(':');
    addrinfo hints{}, *found = nullptr;
    hints.ai_socktype = SOCK_DGRAM;
    const std::string host = address.substr(0, colon);
    if (colon == address.npos || host.empty() ||
        getaddrinfo(host.c_str(), address.c_str() + colon + 1, &hints, &found) != 0) {
      throw InputError(
          fmt::format("{}: expected HOST:PORT of PlotJuggler with a host that can be resolved, for example "
                      "localhost:9870",
                      address));
    }
    const std::unique_ptr<addrinfo, void (*)(addrinfo*)> addresses(found, freeaddrinfo);
    fd_ = socket(found->ai_family, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd_ < 0 || connect(fd_, found->ai_addr, found->ai_addrlen) != 0) {
      throw InputError(fmt::format("PlotJuggler at {} cannot be reached", address));
    }
  }
  ~UdpSender() {
    if (fd_ >= 0) close(fd_);
  }
  UdpSender(const UdpSender&) = delete;
  UdpSender& operator=(const UdpSender&) = delete;

  void Send(const std::string& datagram) { send(fd_, datagram.data(), datagram.size(), MSG_NOSIGNAL); }

 private:
  int fd_ = -1;
};

// Returns the exit code. Throws InputError or EnvironmentError.
int Stream(const BridgeOptions& options) {
  // The socket must be created before this process joins the run's network namespace, from which the receiver
  // may not be reachable.
  UdpSender sender(options.plotjuggler);
  const Attached attached = Attach(options.address);
  InstallStopSignals();
  Bus bus(attached.url);
  double begin = 0, last = 0;
  bool has_sent = false;
  exports::Encoder encoder(
      [&](const exports::Message& message) {
        if (message.topic == exports::kEpisode && message.time_ns == 0 && has_sent) begin = last + kGap_s;
        constexpr exports::TopicId kTexts[] = {exports::kTransforms, exports::kScene, exports::kContactMarks,
                                               exports::kEvents,     exports::kLog,   exports::kEpisode};
        if (std::ranges::find(kTexts, message.topic) != std::end(kTexts)) return;
        const double time = begin + static_cast<double>(message.time_ns) * 1e-9;
        last = std::max(last, time);
        has_sent = true;
        for (const std::string& datagram :
             exports::Datagrams(encoder.topics()[message.topic].name, time, *message.json)) {
          sender.Send(datagram);
        }
      },
      {});
  bus.SubscribeRaw("EVALBUS_.*", [&](std::string_view channel, std::span<const uint8_t> data, int64_t) {
    encoder.Receive(channel, data);
  });
  bus.SetMaxBatchDelay(std::chrono::milliseconds(20));
  fmt::print("forwarding {} to {}\n", attached.url, options.plotjuggler);
  std::fflush(stdout);
  while (!stop_requested()) bus.Handle(std::chrono::steady_clock::now() + std::chrono::milliseconds(100));
  return 0;
}

}  // namespace

Action AddPlotjugglerBridge(CLI::App* app) {
  const auto options = std::make_shared<BridgeOptions>();
  app->add_option("address", options->plotjuggler,
                  "HOST:PORT of PlotJuggler's UDP server (JSON, timestamp field: timestamp)")
      ->required();
  AddAddressOptions(app, &options->address);
  return [options] { return Stream(*options); };
}

}  // namespace evalbus::commands
