// The table of channels in docs/messages.md must equal the table in bus/channels.h.
#include "bus/channels.h"

#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>

namespace evalbus::channels_test {

struct Row {
  std::string channel, type, from;
  auto operator<=>(const Row&) const = default;
};

std::string Trimmed(std::string text) {
  std::erase(text, '`');
  const size_t first = text.find_first_not_of(' ');
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(' ') - first + 1);
}

// Rows have the form "| `EVALBUS_X` | `x_t` | publisher | ...".
std::set<Row> Documented() {
  std::ifstream stream(EVALBUS_SOURCE_DIR "/docs/messages.md");
  std::set<Row> rows;
  for (std::string line; std::getline(stream, line);) {
    if (!line.starts_with("| `EVALBUS_")) continue;
    std::istringstream cells(line.substr(1));
    Row row;
    std::getline(cells, row.channel, '|');
    std::getline(cells, row.type, '|');
    std::getline(cells, row.from, '|');
    rows.insert({Trimmed(row.channel), Trimmed(row.type), Trimmed(row.from)});
  }
  return rows;
}

TEST(Channels, AreThoseOfTheDocumentation) {
  std::set<Row> table;
  channels::ForEach([&]<class Message>(const Channel<Message>& channel) {
    std::string name = channel.name;
    if (name.ends_with("_")) name += "<camera>";
    table.insert({name, Message::getTypeName(), std::string(channel.from)});
  });
  const std::set<Row> documented = Documented();
  for (const Row& row : table)
    EXPECT_TRUE(documented.contains(row)) << row.channel << " " << row.type << " " << row.from;
  EXPECT_EQ(documented.size(), table.size());
}

TEST(Channels, WhatIsForLookersOnIsNotRecorded) {
  EXPECT_EQ(channels::RecordedOf("EVALBUS_IMAGE_front"), Recorded::kNo);
  EXPECT_EQ(channels::RecordedOf("EVALBUS_SOURCE_IMAGE_front"), Recorded::kNo);
  EXPECT_EQ(channels::RecordedOf("EVALBUS_CAMERA_front"), Recorded::kYes);
  EXPECT_EQ(channels::RecordedOf("EVALBUS_LOG"), Recorded::kNo);
  EXPECT_EQ(channels::RecordedOf("EVALBUS_STATE"), Recorded::kOncePerTick);
  EXPECT_EQ(channels::RecordedOf("EVALBUS_EPISODE_END"), Recorded::kOncePerEpisode);
  EXPECT_EQ(channels::RecordedOf("EVALBUS_MODEL"), Recorded::kYes);
  EXPECT_EQ(channels::RecordedOf("SOMEBODY_ELSES"), Recorded::kYes);
}

TEST(Channels, MessagesBeginWithTheSessionButThoseOfASource) {
  std::set<std::string> without;
  channels::ForEach([&]<class Message>(const Channel<Message>& channel) {
    const bool carries = channels::CarriesSession(channel.name);
    if (!carries) without.insert(channel.name);
    if constexpr (HasSession<Message>) {
      Message message{};
      if constexpr (requires { message.session; }) {
        message.session = 0x123456789abcdef;
      } else {
        message.header.session = 0x123456789abcdef;
      }
      std::vector<uint8_t> data = Encode(message);
      EXPECT_EQ(SessionOf(data), 0x123456789abcdef) << channel.name;
      SetSession(0, data);
      EXPECT_EQ(data, Encode(Message{})) << channel.name;
    } else {
      EXPECT_FALSE(carries) << channel.name;
    }
  });
  EXPECT_EQ(without, (std::set<std::string>{"EVALBUS_SOURCE_ANNOUNCEMENT", "EVALBUS_SOURCE_STATE",
                                            "EVALBUS_SOURCE_CONTACTS", "EVALBUS_SOURCE_IMAGE_"}));
  EXPECT_TRUE(channels::CarriesSession("EVALBUS_IMAGE_front"));
  EXPECT_TRUE(channels::CarriesSession("EVALBUS_CAMERA_front"));
  EXPECT_FALSE(channels::CarriesSession("EVALBUS_SOURCE_IMAGE_front"));
  EXPECT_FALSE(channels::CarriesSession("SOMEBODY_ELSES"));
  EXPECT_EQ(SessionOf({}), 0);
}

TEST(Channels, OfACameraCarryImagesAndNothingElse) {
  channels::Messages messages;
  EXPECT_TRUE(channels::MatchesChannelType("EVALBUS_CAMERA_front", Encode(image_t{}), &messages));
  EXPECT_FALSE(channels::MatchesChannelType("EVALBUS_CAMERA_front", Encode(header_t{}), &messages));
}

}  // namespace evalbus::channels_test
