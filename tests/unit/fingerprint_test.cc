// A changed type would decode old logs wrongly or not at all: a changed fingerprint must be a deliberate act.
// To accept one, replace its line in tests/data/fingerprints.txt by what this test prints.
#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <map>
#include <set>

#include "evalbus/action_t.hpp"
#include "evalbus/arm_info_t.hpp"
#include "evalbus/arm_state_t.hpp"
#include "evalbus/command_t.hpp"
#include "evalbus/component_status_t.hpp"
#include "evalbus/condition_t.hpp"
#include "evalbus/contact_t.hpp"
#include "evalbus/contacts_t.hpp"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/explanation_t.hpp"
#include "evalbus/extended_metrics_t.hpp"
#include "evalbus/gripper_info_t.hpp"
#include "evalbus/gripper_state_t.hpp"
#include "evalbus/header_t.hpp"
#include "evalbus/image_t.hpp"
#include "evalbus/metric_values_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/object_event_t.hpp"
#include "evalbus/observation_t.hpp"
#include "evalbus/partial_metrics_t.hpp"
#include "evalbus/run_summary_t.hpp"
#include "evalbus/state_t.hpp"

namespace evalbus {
namespace {

std::map<std::string, uint64_t> Fingerprints() {
  std::map<std::string, uint64_t> all;
  const auto add = [&]<class Message>(const Message&) {
    all[Message::getTypeName()] = static_cast<uint64_t>(Message::getHash());
  };
  add(action_t{});
  add(arm_info_t{});
  add(arm_state_t{});
  add(command_t{});
  add(component_status_t{});
  add(condition_t{});
  add(contact_t{});
  add(contacts_t{});
  add(episode_begin_t{});
  add(episode_end_t{});
  add(episode_summary_t{});
  add(explanation_t{});
  add(extended_metrics_t{});
  add(gripper_info_t{});
  add(gripper_state_t{});
  add(header_t{});
  add(image_t{});
  add(metric_values_t{});
  add(model_info_t{});
  add(object_event_t{});
  add(observation_t{});
  add(partial_metrics_t{});
  add(run_summary_t{});
  add(state_t{});
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

}  // namespace
}  // namespace evalbus
