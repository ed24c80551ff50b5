#include "bus/bus.h"

#include <gtest/gtest.h>

#include <thread>

#include "base/errors.h"
#include "bus/channels.h"
#include "bus/component.h"
#include "evalbus/command_t.hpp"
#include "evalbus/header_t.hpp"
#include "evalbus/state_t.hpp"

namespace evalbus::bus_test {

constexpr Channel<header_t> kChannel{"T", "test"};

header_t Header(int32_t episode, int64_t tick) {
  header_t header{};
  header.episode = episode;
  header.tick = tick;
  return header;
}

void HandleAll(Bus* bus) {
  while (bus->Handle()) {
  }
}

TEST(Bus, DeliversEveryMessageInOrderToASlowSubscriber) {
  Bus bus("memq://");
  std::vector<int64_t> ticks;
  bus.Subscribe(kChannel, [&](const header_t& header) { ticks.push_back(header.tick); });
  // LCM's default queue holds 30 messages.
  for (int i = 0; i < 1000; ++i) bus.Publish(kChannel, Header(0, i));
  HandleAll(&bus);
  ASSERT_EQ(ticks.size(), 1000u);
  for (int i = 0; i < 1000; ++i) EXPECT_EQ(ticks[static_cast<size_t>(i)], i);
}

// Without the event, the wait would last until the test's time limit.
TEST(Bus, AWakeEventEndsTheWaitForAMessage) {
  const auto far = std::chrono::steady_clock::now() + std::chrono::hours(1);
  Bus bus("memq://");
  bus.wake_event()->Set();
  EXPECT_FALSE(bus.Handle()) << "there is no message";
  EXPECT_FALSE(bus.Handle(far)) << "set before the wait";
  std::thread other([event = bus.wake_event()] { event->Set(); });
  EXPECT_FALSE(bus.Handle(far)) << "set during the wait";
  other.join();
  // A message takes precedence over the event.
  int received = 0;
  bus.Subscribe(kChannel, [&](const header_t&) { ++received; });
  bus.wake_event()->Set();
  bus.Publish(kChannel, Header(0, 0));
  EXPECT_TRUE(bus.Handle(far));
  EXPECT_EQ(received, 1);
  EXPECT_FALSE(bus.Handle(far));
}

TEST(Bus, OfASessionReceivesOnlyItsSession) {
  constexpr Channel<action_t> kAction = channels::kAction;
  Bus bus("memq://", 7);
  std::vector<action_t> received;
  int raw = 0;
  bus.Subscribe(kAction, [&](const action_t& action) { received.push_back(action); });
  bus.SubscribeRaw("EVALBUS_.*", [&](std::string_view, std::span<const uint8_t>, int64_t) { ++raw; });
  action_t action{};
  for (const int64_t session : {0, 8, 7}) {
    action.header.session = session;
    action.header.tick = session;
    bus.PublishRaw(kAction.name, Encode(action));
  }
  HandleAll(&bus);
  ASSERT_EQ(received.size(), 1u);
  EXPECT_EQ(received[0].header.tick, 7);
  EXPECT_EQ(raw, 1);
  // A message that matches two subscriptions is counted once.
  EXPECT_EQ(bus.foreign_messages(), 2);
  // A bus sets its own session in all messages that it publishes.
  action.header.session = 8;
  bus.Publish(kAction, action);
  HandleAll(&bus);
  ASSERT_EQ(received.size(), 2u);
  EXPECT_EQ(received[1].header.session, 7);
}

TEST(Bus, WithoutASessionPassesEverySessionOn) {
  Bus bus("memq://");
  std::vector<int64_t> sessions;
  bus.Subscribe(channels::kAction, [&](const action_t& m) { sessions.push_back(m.header.session); });
  action_t action{};
  action.header.session = 8;
  bus.Publish(channels::kAction, action);
  HandleAll(&bus);
  EXPECT_EQ(sessions, std::vector<int64_t>{8});
  EXPECT_EQ(bus.foreign_messages(), 0);
}

TEST(Bus, CountsMessagesThatDoNotDecodeAndDropsThem) {
  Bus bus("memq://");
  int received = 0;
  bus.Subscribe(kChannel, [&](const header_t&) { ++received; });
  bus.PublishRaw(kChannel.name, Encode(command_t{}));  // another type
  const uint8_t rubbish[] = {1, 2, 3};
  bus.PublishRaw("T", rubbish);
  bus.PublishRaw("T", {rubbish, 0});
  std::vector<uint8_t> bytes(static_cast<size_t>(Header(1, 2).getEncodedSize()));
  Header(1, 2).encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  bus.PublishRaw("T", {bytes.data(), bytes.size() - 1});  // truncated
  bytes.push_back(0);
  bus.PublishRaw("T", bytes);  // too long
  bus.Publish(kChannel, Header(1, 2));
  HandleAll(&bus);
  EXPECT_EQ(bus.decode_errors(), 5);
  EXPECT_EQ(received, 1);
}

TEST(Bus, RefusesNegativeCountsInAMessage) {
  state_t state{};
  std::vector<uint8_t> bytes(static_cast<size_t>(state.getEncodedSize()));
  state.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  // num_qpos follows fingerprint and header.
  bytes[8 + static_cast<size_t>(header_t{}._getEncodedSizeNoHash())] = 0xFF;
  EXPECT_FALSE(Decode(bytes, &state));
}

TEST(Bus, CarriesAnExceptionOutOfAHandler) {
  Bus bus("memq://");
  int received = 0;
  bus.Subscribe(kChannel, [&](const header_t& header) {
    ++received;
    if (header.tick == 1) throw std::runtime_error("tick 1");
  });
  for (int i = 0; i < 3; ++i) bus.Publish(kChannel, Header(0, i));
  EXPECT_TRUE(bus.Handle());
  EXPECT_THROW(bus.Handle(), std::runtime_error);
  EXPECT_TRUE(bus.Handle());
  EXPECT_FALSE(bus.Handle());
  EXPECT_EQ(received, 3);
}

TEST(Bus, RefusesUrlsThatAreNone) {
  EXPECT_THROW(Bus("tcp://localhost"), InputError);
  EXPECT_THROW(Bus(""), InputError);
  EXPECT_THROW(Bus("udpm://not-an-address:7667"), InputError);
}

TEST(Bus, SelfCheckPassesInOneProcess) {
  Bus bus("memq://");
  EXPECT_NO_THROW(bus.SelfCheck());
}

class Probe : public Component {
 public:
  explicit Probe(Bus* bus, int64_t window = 0) : Component(bus, "probe", window) {}
  using Component::EnterEpisode;
  using Component::IsOurs;
  using Component::Progress;
  using Component::PublishReady;
};

TEST(Component, AnswersARepeatedEpisodeBeginWithoutPreparingAgain) {
  Bus bus("memq://");
  Probe probe(&bus);
  std::vector<component_status_t> received;
  bus.Subscribe(channels::kStatus, [&](const component_status_t& s) { received.push_back(s); });
  episode_begin_t begin{};
  begin.header.episode = 7;
  begin.header.attempt = 2;
  EXPECT_TRUE(probe.EnterEpisode(begin));
  probe.PublishReady();
  EXPECT_FALSE(probe.EnterEpisode(begin));
  begin.header.attempt = 3;
  EXPECT_TRUE(probe.EnterEpisode(begin));
  HandleAll(&bus);
  ASSERT_EQ(received.size(), 2u);
  for (const auto& status : received) {
    EXPECT_EQ(status.component, "probe");
    EXPECT_EQ(status.state, component_status_t::READY);
    EXPECT_EQ(status.episode, 7);
    EXPECT_EQ(status.attempt, 2);
  }
}

TEST(Component, CountsMessagesOfOtherEpisodes) {
  Bus bus("memq://");
  Probe probe(&bus);
  episode_begin_t begin{};
  begin.header.episode = 7;
  probe.EnterEpisode(begin);
  EXPECT_TRUE(probe.IsOurs(Header(7, 0)));
  EXPECT_FALSE(probe.IsOurs(Header(6, 0)));
  EXPECT_EQ(probe.status().foreign_messages, 1);
}

TEST(Component, ReportsProgressTwicePerLagWindow) {
  Bus bus("memq://");
  Probe probe(&bus, 100);
  std::vector<int64_t> received;
  bus.Subscribe(channels::kStatus, [&](const component_status_t& s) { received.push_back(s.last_tick); });
  for (int tick = 0; tick < 200; ++tick) probe.Progress(Header(0, tick));
  HandleAll(&bus);
  EXPECT_EQ(received, (std::vector<int64_t>{49, 99, 149, 199}));
}

}  // namespace evalbus::bus_test
