// Metrics and sim on a bus where anybody says anything. An input is a sequence of messages: channel, length,
// bytes. The fingerprint is put in front where the channel's highest bit is not set. What a component refuses
// ends the input.
#include <filesystem>
#include <iostream>
#include <vector>

#include "bus/channels.h"
#include "evalbus/episode_summary_t.hpp"
#include "metrics/metrics_component.h"
#include "sim/sim_component.h"
#include "tests/fuzz/scratch_file.h"
#include "tests/unit/small_world.h"

namespace evalbus {
namespace {

struct Channel {
  const char* name;
  int64_t fingerprint;
};

const Channel kChannels[] = {{channels::kModel, model_info_t::getHash()},
                             {channels::kEpisodeBegin, episode_begin_t::getHash()},
                             {channels::kEpisodeEnd, episode_end_t::getHash()},
                             {channels::kState, state_t::getHash()},
                             {channels::kContacts, contacts_t::getHash()},
                             {channels::kAction, action_t::getHash()},
                             {channels::kPartial, partial_metrics_t::getHash()},
                             {channels::kEpisodeSummary, episode_summary_t::getHash()},
                             {channels::kStatus, component_status_t::getHash()},
                             {channels::kCommand, command_t::getHash()}};

// Composing the scene takes longer than anything that follows.
class Sim {
 public:
  Sim() {
    SimOptions options;
    options.task = "lift_pot";
    options.out = folder_.path();
    sim_.emplace(&bus, options);
  }
  void Poll() { sim_->Poll(std::chrono::steady_clock::now()); }

  Bus bus{"memq://"};

 private:
  ScratchFolder folder_;
  std::optional<SimComponent> sim_;
};

void Drain(Bus* bus) {
  // An answer may be answered.
  for (int i = 0; i < 1000 && bus->Handle(); ++i) {
  }
}

void Say(Bus* bus, const uint8_t* data, size_t size) {
  while (size >= 3) {
    const Channel& channel = kChannels[(*data & 0x7F) % std::size(kChannels)];
    std::vector<uint8_t> message;
    if (*data < 0x80) {
      for (int shift = 56; shift >= 0; shift -= 8)
        message.push_back(static_cast<uint8_t>(channel.fingerprint >> shift));
    }
    const size_t length = std::min<size_t>(size - 3, static_cast<size_t>(data[1] << 8 | data[2]));
    message.insert(message.end(), data + 3, data + 3 + length);
    bus->PublishRaw(channel.name, message);
    Drain(bus);
    data += 3 + length;
    size -= 3 + length;
  }
}

}  // namespace
}  // namespace evalbus

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace evalbus;
  try {
    Bus bus("memq://");
    MetricsComponent metrics(&bus);
    bus.Publish(channels::kModel, small_world::Model());
    Drain(&bus);
    Say(&bus, data, size);
    metrics.Poll(std::chrono::steady_clock::now() + std::chrono::hours(1));
  } catch (const std::exception&) {
  }
  static Sim sim;
  static int episode = 0;
  try {
    command_t command{};
    command.kind = command_t::START_EPISODE;
    command.episode = episode++;
    sim.bus.Publish(channels::kCommand, command);
    Drain(&sim.bus);
    Say(&sim.bus, data, size);
    sim.Poll();
  } catch (const std::exception&) {
  }
  return 0;
}
