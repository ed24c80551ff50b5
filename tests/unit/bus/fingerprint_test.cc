// A changed message type would decode old logs wrongly or not at all, so a fingerprint must change only on
// purpose. To accept a change, replace the line in tests/data/fingerprints.txt with the line that this test
// prints.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "evalbus/all_messages.hpp"

namespace evalbus::fingerprint_test {

std::map<std::string, uint64_t> Fingerprints() {
  std::map<std::string, uint64_t> all;
  ForEachMessage([&]<class Message>(const Message&) {
    all[Message::getTypeName()] = static_cast<uint64_t>(Message::getHash());
  });
  return all;
}

TEST(Fingerprints, AreThePinnedOnes) {
  std::map<std::string, uint64_t> pinned;
  std::ifstream stream(EVALBUS_SOURCE_DIR "/tests/data/fingerprints.txt");
  std::string name;
  uint64_t value = 0;
  while (stream >> name >> std::hex >> value) pinned[name] = value;
  const auto current = Fingerprints();
  EXPECT_EQ(current, pinned);
  if (current == pinned) return;
  for (const auto& [type, hash] : current) std::printf("%s %016lx\n", type.c_str(), hash);
}

TEST(Fingerprints, CoverEveryTypeFile) {
  std::set<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(EVALBUS_SOURCE_DIR "/lcmtypes")) {
    if (entry.path().extension() == ".lcm") files.insert(entry.path().stem());
  }
  std::set<std::string> types;
  for (const auto& [type, hash] : Fingerprints()) types.insert(type);
  EXPECT_EQ(types, files);
}

TEST(Fingerprints, AllDiffer) {
  std::set<uint64_t> values;
  for (const auto& [type, hash] : Fingerprints()) values.insert(hash);
  EXPECT_EQ(values.size(), Fingerprints().size());
}

}  // namespace evalbus::fingerprint_test
