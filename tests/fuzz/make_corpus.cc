// Writes CORPUS/{messages,components,event_log}: the inputs that consist of messages. Run it when a type
// changes.
#include <filesystem>
#include <fstream>

#include "bus/channels.h"
#include "bus/event_log.h"
#include "tests/unit/all_messages.h"
#include "tests/unit/small_world.h"

namespace evalbus {
namespace {

using Bytes = std::vector<uint8_t>;

template <class Message>
Bytes Encode(const Message& message) {
  Bytes bytes(static_cast<size_t>(message.getEncodedSize()));
  message.encode(bytes.data(), 0, static_cast<int>(bytes.size()));
  return bytes;
}

void Write(const std::filesystem::path& file, const Bytes& bytes) {
  std::filesystem::create_directories(file.parent_path());
  std::ofstream(file, std::ios::binary)
      .write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
}

void WriteAll(const std::filesystem::path& corpus) {
  int type = 0;
  ForEachMessage([&]<class Message>(const Message& empty) {
    Bytes bytes = Encode(empty);
    bytes.erase(bytes.begin(), bytes.begin() + 7);
    bytes[0] = static_cast<uint8_t>(type++);
    Write(corpus / "messages" / Message::getTypeName(), bytes);
  });

  // An episode of three ticks, as a conversation and as a log.
  const char* const channels[] = {channels::kModel, channels::kEpisodeBegin, channels::kEpisodeEnd,
                                  channels::kState, channels::kContacts};
  Bytes conversation;
  std::filesystem::create_directories(corpus / "event_log");
  const auto file = corpus / "event_log" / "episode";
  std::filesystem::remove(file);
  EventLogWriter log(file);
  const auto say = [&](int channel, const Bytes& message) {
    log.Write(channels[channel], message, 0);
    if (channel == 0) return;  // the metrics target says it itself
    const size_t length = message.size() - 8;
    conversation.insert(conversation.end(), {static_cast<uint8_t>(channel), static_cast<uint8_t>(length >> 8),
                                             static_cast<uint8_t>(length)});
    conversation.insert(conversation.end(), message.begin() + 8, message.end());
  };
  say(0, Encode(small_world::Model()));
  say(1, Encode(episode_begin_t{}));
  for (int64_t tick = 0; tick < 3; ++tick) {
    say(3, Encode(small_world::State(tick)));
    say(4, Encode(small_world::Contacts(tick)));
  }
  episode_end_t end{};
  end.header = small_world::Header(2);
  end.end_reason = "time_limit";
  say(2, Encode(end));
  log.Close();
  Write(corpus / "components" / "episode", conversation);
}

}  // namespace
}  // namespace evalbus

int main(int argc, char** argv) {
  if (argc != 2) return 1;
  evalbus::WriteAll(argv[1]);
}
