#include "bus/event_log.h"

#include <gtest/gtest.h>
#include <sys/resource.h>

#include <csignal>
#include <fstream>
#include <lcm/lcm-cpp.hpp>
#include <set>

#include "base/errors.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::event_log_test {

std::vector<uint8_t> Payload(int i) {
  return std::vector<uint8_t>(static_cast<size_t>(i % 40), static_cast<uint8_t>(i));
}

class EventLog : public testing::Test {
 protected:
  void WriteLog(int events) {
    EventLogWriter writer(file_);
    for (int i = 0; i < events; ++i) writer.Write("CHANNEL_" + std::to_string(i % 3), Payload(i), 1000 * i);
    writer.Close();
  }
  std::string Bytes() {
    std::ifstream stream(file_, std::ios::binary);
    return {std::istreambuf_iterator<char>(stream), {}};
  }
  void SetBytes(const std::string& bytes) { std::ofstream(file_, std::ios::binary) << bytes; }

  struct Contents {
    std::vector<int64_t> numbers;
    int64_t damaged_bytes = 0, damaged_places = 0;
  };
  // Reads the file and expects every event to equal one that was written.
  Contents Read() {
    Contents contents;
    EventLogReader reader(file_);
    LogEvent event;
    while (reader.Next(&event)) {
      const int i = static_cast<int>(event.number);
      EXPECT_EQ(event.time_us, 1000 * i);
      EXPECT_EQ(event.channel, "CHANNEL_" + std::to_string(i % 3));
      const auto payload = Payload(i);
      EXPECT_TRUE(std::equal(event.data.begin(), event.data.end(), payload.begin(), payload.end()));
      contents.numbers.push_back(event.number);
    }
    contents.damaged_bytes = reader.damaged_bytes();
    contents.damaged_places = reader.damaged_places();
    return contents;
  }

  TemporaryFolder folder_;
  std::filesystem::path file_ = folder_.path() / "events.lcmlog";
};

TEST_F(EventLog, ReadsWhatWasWritten) {
  WriteLog(100);
  const Contents contents = Read();
  EXPECT_EQ(contents.numbers.size(), 100u);
  EXPECT_EQ(contents.damaged_bytes, 0);
}

TEST_F(EventLog, IsReadByLcmItself) {
  WriteLog(100);
  lcm::LogFile log(file_, "r");
  ASSERT_TRUE(log.good());
  for (int i = 0; i < 100; ++i) {
    const lcm::LogEvent* event = log.readNextEvent();
    ASSERT_NE(event, nullptr);
    EXPECT_EQ(event->eventnum, i);
    EXPECT_EQ(event->timestamp, 1000 * i);
    EXPECT_EQ(event->channel, "CHANNEL_" + std::to_string(i % 3));
    EXPECT_EQ(event->datalen, i % 40);
  }
  EXPECT_EQ(log.readNextEvent(), nullptr);
}

TEST_F(EventLog, CutAnywhereKeepsEveryWholeEventBefore) {
  WriteLog(5);
  const std::string whole = Bytes();
  size_t last = 0;
  for (size_t size = 1; size <= whole.size(); ++size) {
    SetBytes(whole.substr(0, size));
    const Contents contents = Read();
    EXPECT_GE(contents.numbers.size(), last);
    last = contents.numbers.size();
    for (size_t i = 0; i < contents.numbers.size(); ++i)
      EXPECT_EQ(contents.numbers[i], static_cast<int64_t>(i));
    // Bytes that are not part of an event are counted as damage.
    size_t complete = 0;
    for (size_t i = 0; i < contents.numbers.size(); ++i) complete += 28 + 9 + i % 40;
    EXPECT_EQ(contents.damaged_bytes, static_cast<int64_t>(size - complete));
  }
  EXPECT_EQ(last, 5u);
}

TEST_F(EventLog, DamageInTheMiddleCostsOnlyTheEventsHit) {
  WriteLog(100);
  std::string bytes = Bytes();
  const auto offset = [](int event) {
    size_t sum = 0;
    for (int i = 0; i < event; ++i) sum += 28 + 9 + Payload(i).size();
    return sum;
  };
  bytes[offset(3)] ^= 0x40;  // one flipped bit in a magic number
  for (size_t i = offset(50); i < offset(53); ++i)
    bytes[i] = '\xED';  // three events are overwritten with the first byte of the magic number
  SetBytes(bytes);
  const Contents contents = Read();
  EXPECT_EQ(contents.damaged_places, 2);
  EXPECT_EQ(contents.damaged_bytes, static_cast<int64_t>(offset(4) - offset(3) + offset(53) - offset(50)));
  EXPECT_EQ(contents.numbers.size(), 96u);
  EXPECT_EQ(contents.numbers.back(), 99);
}

TEST_F(EventLog, AbsurdLengthsAreDamage) {
  WriteLog(3);
  std::string bytes = Bytes();
  bytes[24] = 0x7F;  // data length of event 0
  SetBytes(bytes);
  const Contents contents = Read();
  EXPECT_EQ(contents.numbers, (std::vector<int64_t>{1, 2}));
}

// The events before and after the damaged one are read, whatever length results from the flipped bit.
TEST_F(EventLog, DamagedLengthsCostOneEvent) {
  WriteLog(8);
  const std::string whole = Bytes();
  size_t start = 0;
  for (int i = 0; i < 3; ++i) start += 28 + 9 + Payload(i).size();
  for (size_t byte = 20; byte < 28; ++byte) {
    for (int bit = 0; bit < 8; ++bit) {
      std::string bytes = whole;
      bytes[start + byte] = static_cast<char>(bytes[start + byte] ^ (1 << bit));
      SetBytes(bytes);
      EventLogReader reader(file_);
      std::set<int64_t> numbers;
      for (LogEvent event; reader.Next(&event);) numbers.insert(event.number);
      for (const int64_t other : {0, 1, 2, 4, 5, 6, 7}) {
        EXPECT_TRUE(numbers.contains(other)) << "byte " << byte << ", bit " << bit << ", event " << other;
      }
    }
  }
}

TEST_F(EventLog, ManyFalseStartsAreReadInLinearTime) {
  // The file has half a million headers that claim 1 MiB of data. No event starts where this data would end.
  std::string header("\xED\xA1\xDA\x01", 4);
  header += std::string(18, '\0') + std::string("\0\x01\0\x10\0\0", 6);
  std::string bytes;
  for (int i = 0; i < 500'000; ++i) bytes += header;
  SetBytes(bytes);
  EventLogReader reader(file_);
  LogEvent event;
  while (reader.Next(&event)) {
  }
  EXPECT_GT(reader.damaged_bytes(), 0);
}

// The log shrinks while it is read, as with 'rsync --inplace' or on a file server. If it were mapped into
// memory, this would kill the process.
TEST_F(EventLog, OneThatBecomesShorterIsAnError) {
  {
    EventLogWriter writer(file_);
    for (int i = 0; i < 300; ++i) writer.Write("CHANNEL", std::vector<uint8_t>(10'000), i);
    writer.Close();
  }
  EventLogReader reader(file_);
  LogEvent event;
  ASSERT_TRUE(reader.Next(&event));
  std::filesystem::resize_file(file_, 4096);
  try {
    while (reader.Next(&event)) EXPECT_EQ(event.data.size(), 10'000u);
    FAIL() << event.number;
  } catch (const InputError& error) {
    const std::string what = error.what();
    EXPECT_TRUE(what.starts_with(file_.string() + ": cannot read the log: it shrank while it was read"))
        << what;
  }
}

TEST_F(EventLog, OneThatGrowsEndsWhereItWas) {
  WriteLog(3);
  const std::string three = Bytes();
  std::filesystem::remove(file_);
  WriteLog(5);
  const std::string five = Bytes();
  SetBytes(three);
  EventLogReader reader(file_);
  std::ofstream(file_, std::ios::binary | std::ios::app) << five.substr(three.size());
  int events = 0;
  for (LogEvent event; reader.Next(&event);) ++events;
  EXPECT_EQ(events, 3);
  EXPECT_EQ(Read().numbers.size(), 5u);
}

// Some events are longer than the read buffer, with shorter ones between them. One short event is damaged.
TEST_F(EventLog, ReadsEventsOfAnyLength) {
  constexpr int kDamaged = 7;
  std::vector<size_t> begins = {0};
  const auto payload = [](int i) {
    std::vector<uint8_t> bytes(i % 5 == 3 ? 700'000 + i : 90'000 / (i + 1));
    for (size_t k = 0; k < bytes.size(); ++k)
      bytes[k] = static_cast<uint8_t>(k * 31 + static_cast<size_t>(i));
    return bytes;
  };
  {
    EventLogWriter writer(file_);
    for (int i = 0; i < 60; ++i) {
      writer.Write("CHANNEL", payload(i), i);
      begins.push_back(begins.back() + 28 + 7 + payload(i).size());
    }
    writer.Close();
  }
  std::string bytes = Bytes();
  bytes[begins[kDamaged]] = 0;
  SetBytes(bytes);
  EventLogReader reader(file_);
  EXPECT_EQ(reader.size(), bytes.size());
  int events = 0;
  for (LogEvent event; reader.Next(&event); ++events) {
    const auto expected = payload(static_cast<int>(event.number));
    EXPECT_NE(event.number, kDamaged);
    EXPECT_EQ(event.channel, "CHANNEL");
    EXPECT_TRUE(std::equal(event.data.begin(), event.data.end(), expected.begin(), expected.end()))
        << event.number;
  }
  EXPECT_EQ(events, 59);
  EXPECT_EQ(reader.damaged_places(), 1);
  EXPECT_EQ(reader.damaged_bytes(), static_cast<int64_t>(begins[kDamaged + 1] - begins[kDamaged]));
}

TEST_F(EventLog, AnEmptyFileHasNoEvents) {
  SetBytes("");
  EXPECT_TRUE(Read().numbers.empty());
}

TEST_F(EventLog, RefusesToOverwriteAndToReadWhatIsNotThere) {
  WriteLog(1);
  EXPECT_THROW(EventLogWriter{file_}, EnvironmentError);
  EXPECT_THROW(EventLogReader{folder_.path() / "none"}, InputError);
  EXPECT_THROW(EventLogReader{folder_.path()}, InputError);
}

TEST_F(EventLog, AFullDiskIsAnError) {
  // A file size limit makes writes fail like a full disk.
  signal(SIGXFSZ, SIG_IGN);
  rlimit before{};
  getrlimit(RLIMIT_FSIZE, &before);
  const rlimit small{4096, before.rlim_max};
  setrlimit(RLIMIT_FSIZE, &small);
  EXPECT_THROW(
      {
        EventLogWriter writer(file_);
        for (int i = 0; i < 1000; ++i) writer.Write("CHANNEL", Payload(39), i);
        writer.Close();
      },
      EnvironmentError);
  setrlimit(RLIMIT_FSIZE, &before);
}

}  // namespace evalbus::event_log_test
