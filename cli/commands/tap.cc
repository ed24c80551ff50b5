// evalbus tap: the numbers of a run that goes on, for PlotJuggler's UDP server.

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

// Between two episodes, since what is drawn goes on where they begin again.
constexpr double kGap_s = 1;

struct TapOptions {
  Address address;
  std::string plotjuggler;
};

// Sends datagrams; one that nobody takes is lost, and nobody waits.
class UdpSender {
 public:
  // Throws InputError: not HOST:PORT, or no such host.
  explicit UdpSender(const std::string& address) {
    const size_t colon = address.rfind(':');
    addrinfo hints{}, *found = nullptr;
    hints.ai_socktype = SOCK_DGRAM;
    const std::string host = address.substr(0, colon);
    if (colon == address.npos || host.empty() ||
        getaddrinfo(host.c_str(), address.c_str() + colon + 1, &hints, &found) != 0) {
      throw InputError(fmt::format("--plotjuggler {}: expected HOST:PORT, as localhost:9870", address));
    }
    const std::unique_ptr<addrinfo, void (*)(addrinfo*)> addresses(found, freeaddrinfo);
    fd_ = socket(found->ai_family, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    if (fd_ < 0 || connect(fd_, found->ai_addr, found->ai_addrlen) != 0) {
      throw InputError(fmt::format("--plotjuggler {}: cannot be reached", address));
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

// Returns the exit code. Throws InputError, EnvironmentError.
int Tap(const TapOptions& options) {
  // In the network that we are in now: the run's may be one of its own.
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
    encoder.Hear(channel, data);
  });
  bus.SetMaxBatchDelay(std::chrono::milliseconds(20));
  fmt::print("sending {} to {}\n", attached.url, options.plotjuggler);
  std::fflush(stdout);
  while (!stop_requested()) bus.Handle(std::chrono::steady_clock::now() + std::chrono::milliseconds(100));
  return 0;
}

}  // namespace

Action AddTap(CLI::App* app) {
  const auto options = std::make_shared<TapOptions>();
  AddAddressOptions(app, &options->address);
  app->add_option("--plotjuggler", options->plotjuggler,
                  "HOST:PORT of its UDP server (JSON, timestamp field: timestamp)")
      ->required();
  return [options] { return Tap(*options); };
}

}  // namespace evalbus::commands
