// Runs sim, collision, metrics and policy, each on its own bus. A simulated network between them loses,
// repeats, reorders and damages messages and injects foreign ones. A scored episode either has the
// undisturbed episode's result or is marked incomplete. All components run in one process, from a fixed seed.
#include <algorithm>
#include <array>
#include <deque>
#include <random>
#include <set>

#include "base/errors.h"
#include "bus/channels.h"
#include "collision/collision_component.h"
#include "evalbus/component_status_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/state_t.hpp"
#include "metrics/metrics_component.h"
#include "policy_bridge/policy_component.h"
#include "sim/sim_component.h"
#include "tests/integration/harness.h"

namespace evalbus::lossy_bus_test {

using Bytes = std::vector<uint8_t>;

struct Message {
  std::string channel;
  Bytes data;
};

struct Faults {
  // Probabilities per message and receiver.
  double lose = 0, repeat = 0, damage = 0;
  // Messages are delivered in a random order within a window of this many.
  size_t window = 1;
  // Foreign messages, injected in this order, each after a random number of deliveries up to `pause`.
  std::vector<Message> foreign = {};
  int pause = 3;
};

class Network {
 public:
  Network(const std::filesystem::path& task, const std::string& policy, int64_t seed, const Faults& faults,
          uint32_t random_seed = 1)
      : faults_(faults), random_(random_seed) {
    sim::SimOptions options;
    options.task = task;
    options.out = folder_.path();
    options.seed = seed;
    options.episodes = 1;
    Add([](Bus* bus) { return std::make_unique<collision::CollisionComponent>(bus); });
    Add([](Bus* bus) { return std::make_unique<metrics::MetricsComponent>(bus); });
    Add([&](Bus* bus) {
      return std::make_unique<policy::PolicyComponent>(bus, policy::PolicyOptions{policy});
    });
    Add([&](Bus* bus) { return std::make_unique<sim::SimComponent>(bus, options); });
  }

  // Returns the score of the episode; nullopt if the episode stalls or a component rejects a message.
  std::optional<episode_summary_t> Run() {
    int64_t tick = -1;
    // The limits are far above what an episode takes.
    for (int stalls = 0, silent = 0; stalls < 3000 && silent < 40; ++stalls, ++silent) {
      try {
        DeliverAll();
      } catch (const InputError&) {
        return std::nullopt;
      }
      if (summary_) return summary_;
      // No message is in flight, so advances time until a component resends what was lost.
      if (std::exchange(tick, status(kSim).last_tick) != status(kSim).last_tick) silent = 0;
      const auto now = std::chrono::steady_clock::now() + silent * std::chrono::milliseconds(700);
      for (Node& node : nodes_) {
        for (int look = 0; look < 7; ++look)
          node.component->Poll(now + look * std::chrono::milliseconds(100));
      }
    }
    return std::nullopt;
  }

  const std::vector<Message>& said() const { return said_; }
  int64_t decode_errors() const { return nodes_[1].bus.decode_errors(); }

 private:
  static constexpr size_t kSim = 3;

  struct Node {
    Bus bus{"memq://"};
    std::unique_ptr<Component> component;
    // Messages delivered to this node, which its own subscription is about to receive.
    std::multiset<std::pair<std::string, Bytes>> delivered;
  };
  struct Delivery {
    Node* to;
    Message message;
  };

  template <class Make>
  void Add(const Make& make) {
    Node& node = nodes_.emplace_back();
    node.bus.SubscribeRaw(".*",
                          [this, &node](std::string_view channel, std::span<const uint8_t> data, int64_t) {
                            Receive(&node, {std::string(channel), {data.begin(), data.end()}});
                          });
    node.component = make(&node.bus);
  }

  const component_status_t& status(size_t node) const { return nodes_[node].component->status(); }

  bool Chance(double probability) { return std::uniform_real_distribution<>()(random_) < probability; }

  void Receive(Node* from, const Message& message) {
    const auto ours = from->delivered.find({message.channel, message.data});
    if (ours != from->delivered.end()) {
      from->delivered.erase(ours);
      return;
    }
    said_.push_back(message);
    if (message.channel == channels::kEpisodeSummary) Decode(message.data, &summary_.emplace());
    Send(from, message);
  }

  void Send(const Node* from, const Message& message) {
    for (Node& to : nodes_) {
      if (&to == from || Chance(faults_.lose)) continue;
      for (int copies = 1 + Chance(faults_.repeat); copies > 0; --copies)
        in_flight_.push_back({&to, message});
      if (Chance(faults_.damage)) in_flight_.push_back({&to, Damaged(message)});
    }
  }

  // Returns the message truncated, too long, of another type, or with impossible counts. Numbers are not
  // damaged, because only UDP's checksum could detect that.
  Message Damaged(Message message) {
    switch (random_() % 4) {
      case 0:
        message.data.resize(random_() % message.data.size());
        break;
      case 1:
        message.data.resize(message.data.size() + 1 + random_() % 70'000);
        break;
      case 2:
        message.data[random_() % 8] ^= 0x10;
        break;
      default:
        for (size_t i = 28; i < message.data.size(); ++i) message.data[i] = 0xFF;
        message.data.push_back(0);
    }
    return message;
  }

  void DeliverAll() {
    for (bool more = true; more && !summary_;) {
      more = false;
      for (Node& node : nodes_) {
        while (node.bus.Handle()) more = true;
      }
      if (!in_flight_.empty()) {
        const auto next = in_flight_.begin() + static_cast<std::ptrdiff_t>(
                                                   random_() % std::min(in_flight_.size(), faults_.window));
        const Delivery delivery = *next;
        in_flight_.erase(next);
        delivery.to->delivered.insert({delivery.message.channel, delivery.message.data});
        delivery.to->bus.PublishRaw(delivery.message.channel.c_str(), delivery.message.data);
        more = true;
      }
      if (more && next_foreign_ < faults_.foreign.size() && --pause_ <= 0) {
        pause_ = static_cast<int>(random_() % static_cast<uint32_t>(faults_.pause)) + 1;
        Send(nullptr, faults_.foreign[next_foreign_++]);
      }
    }
  }

  Faults faults_;
  std::mt19937 random_;
  TemporaryFolder folder_;
  std::deque<Node> nodes_;
  std::deque<Delivery> in_flight_;
  std::vector<Message> said_;
  size_t next_foreign_ = 0;
  int pause_ = 1;
  std::optional<episode_summary_t> summary_;
};

class LossyBus : public testing::Test {
 protected:
  static constexpr int64_t kSeed = 3;

  void SetUp() override {
    task_ = ShortTask(folder_.path(), 1);
    Network network(task_, "expert", kSeed, {});
    const auto summary = network.Run();
    ASSERT_TRUE(summary);
    ASSERT_TRUE(summary->complete);
    ASSERT_EQ(summary->end_reason, "time_limit");
    reference_ = Encode(*summary);
    ours_ = network.said();
  }

  // Runs disturbed episodes. Returns how many have the reference's result. Fails the test if a complete
  // episode has a different result.
  int Equal(const Faults& faults, int episodes) {
    int equal = 0;
    for (int i = 0; i < episodes; ++i) {
      Network network(task_, "expert", kSeed, faults, static_cast<uint32_t>(i));
      const auto summary = network.Run();
      if (!summary || !summary->complete) {
        EXPECT_FALSE(summary && summary->end_detail.empty() && summary->extended.missing_ticks == 0)
            << "not complete, without a reason";
        continue;
      }
      EXPECT_EQ(Encode(*summary), reference_) << "episode " << i << ": complete, with another result";
      ++equal;
    }
    return equal;
  }

  std::vector<Message> OldLog(int64_t seed, const std::string& policy) {
    Network& network = kept_.emplace_back(task_, policy, seed, Faults{});
    EXPECT_TRUE(network.Run());
    return network.said();
  }

  TemporaryFolder folder_;
  std::filesystem::path task_;
  Bytes reference_;
  std::vector<Message> ours_;
  // Kept alive because logs name their model files.
  std::deque<Network> kept_;
};

TEST_F(LossyBus, RepeatedAndReorderedMessagesChangeNothing) {
  EXPECT_EQ(Equal({.repeat = 0.3}, 2), 2);
  EXPECT_EQ(Equal({.window = 6}, 2), 2);
  EXPECT_EQ(Equal({.repeat = 0.3, .window = 12}, 2), 2);
}

TEST_F(LossyBus, LostMessagesAreRepeated) {
  EXPECT_EQ(Equal({.lose = 0.01}, 4), 4);
  EXPECT_GT(Equal({.lose = 0.1, .repeat = 0.1, .window = 4}, 4), 0);
}

TEST_F(LossyBus, DamagedCopiesAreDropped) {
  EXPECT_EQ(Equal({.damage = 0.3, .window = 3}, 2), 2);
  Network network(task_, "expert", kSeed, {.damage = 0.3});
  ASSERT_TRUE(network.Run());
  EXPECT_GT(network.decode_errors(), 10);
}

TEST_F(LossyBus, OurOwnOldLogIsHarmless) {
  std::vector<Message> log = ours_;
  // Only these channels are kept. The new run publishes the same messages on them, so the old ones are
  // harmless.
  std::erase_if(log, [](const Message& message) {
    return message.channel != channels::kContacts && message.channel != channels::kAction &&
           message.channel != channels::kPartial;
  });
  EXPECT_GT(Equal({.foreign = log}, 2) + Equal({.foreign = log, .pause = 40}, 2), 0);
  Equal({.foreign = ours_}, 2);
}

TEST_F(LossyBus, OldLogsOfOtherEpisodesAreNeverTakenForOurs) {
  for (const auto& [seed, policy] : {std::pair(kSeed + 1, "expert"), std::pair(kSeed, "random")}) {
    const std::vector<Message> log = OldLog(seed, policy);
    for (const int pause : {1, 20}) Equal({.foreign = log, .pause = pause}, 1);
    // Each of these runs receives only one channel of the log.
    std::set<std::string> channels;
    for (const Message& message : log) channels.insert(message.channel);
    EXPECT_GE(channels.size(), 9u);
    for (const std::string& channel : channels) {
      SCOPED_TRACE(channel);
      std::vector<Message> part;
      for (const Message& message : log) {
        if (message.channel == channel) part.push_back(message);
      }
      if (channel != channels::kStatus) Equal({.foreign = part, .pause = 4}, 1);
    }
  }
}

}  // namespace evalbus::lossy_bus_test
