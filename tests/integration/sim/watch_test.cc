// Tests `evalbus watch` with a C++ source over a real bus. A run that is reduced to what a robot can measure
// keeps its scores.
#include <cmath>
#include <map>

#include "bus/channels.h"
#include "evalbus/episode_summary_t.hpp"
#include "tests/integration/harness.h"

namespace evalbus::watch_test {

namespace fs = std::filesystem;

// A source that publishes SOURCE_ANNOUNCEMENT until it receives MODEL, and then its measurements. Unlike a
// robot, it waits for each STATE.
class Source {
 public:
  explicit Source(const std::string& url) : bus_(url) {
    bus_.Subscribe(channels::kModel, [this](const model_info_t&) { is_met_ = true; });
    bus_.Subscribe(channels::kState, [this](const state_t& state) { tick_ = state.header.tick; });
    bus_.Subscribe(channels::kEpisodeEnd, [this](const episode_end_t& end) { ended_ = end.header.episode; });
  }
  // Announces a source that measures the joints of the arms and fingers of `model` and, if requested, the
  // poses of all its objects. Returns true once the announcement is accepted.
  bool Meet(const model_info_t& model, bool with_objects, bool with_contacts = false) {
    announcement_.has_contacts = with_contacts;
    announcement_.source = "a recorded robot";
    announcement_.period_us = model.timestep_us * model.substeps;
    for (size_t k = 0; k < model.joint_name.size(); ++k) {
      const std::string& name = model.joint_name[k];
      if (!name.starts_with("left/") && !name.starts_with("right/")) continue;
      announcement_.joint_name.push_back(name);
      qpos_.push_back(model.joint_qpos_index[k]);
    }
    announcement_.num_joints = static_cast<int32_t>(announcement_.joint_name.size());
    if (with_objects) announcement_.object_name = model.object_name;
    announcement_.num_objects = static_cast<int32_t>(announcement_.object_name.size());
    for (const std::string& object : announcement_.object_name) {
      body_.push_back(std::ranges::find(model.body_name, object) - model.body_name.begin());
    }
    auto said = std::chrono::steady_clock::time_point{};
    return Until([&] {
      if (const auto now = std::chrono::steady_clock::now(); now - said > std::chrono::milliseconds(500)) {
        said = now;
        bus_.Publish(channels::kSourceAnnouncement, announcement_);
      }
      return is_met_;
    });
  }
  // Publishes the states of a recorded episode as its own `episode`.
  bool Play(const std::vector<state_t>& states, int32_t episode,
            const std::function<void(source_state_t*)>& change,
            const std::function<source_contacts_t(size_t)>& contacts = {}) {
    tick_ = ended_ = -1;
    for (size_t k = 0; k < states.size(); ++k) {
      source_state_t sample{};
      sample.episode = episode;
      sample.sample = static_cast<int64_t>(k);
      // The timestamps come from another machine's clock.
      sample.stamp_us = 1'700'000'000'000'000 + states[k].header.sim_time_us;
      for (const int index : qpos_)
        sample.joint_position_mixed.push_back(states[k].qpos_mixed[static_cast<size_t>(index)]);
      sample.num_joints = announcement_.num_joints;
      for (const auto body : body_) sample.object.push_back(states[k].body[static_cast<size_t>(body)]);
      sample.num_objects = announcement_.num_objects;
      sample.is_last = k + 1 == states.size();
      if (change) change(&sample);
      if (contacts) {
        source_contacts_t message = contacts(k);
        message.episode = episode;
        message.sample = sample.sample;
        message.num_contacts = static_cast<int32_t>(message.contact.size());
        bus_.Publish(channels::kSourceContacts, message);
      }
      bus_.Publish(channels::kSourceState, sample);
      if (!change && !Until([&] { return tick_ == static_cast<int64_t>(k) || ended_ == episode; }))
        return false;
    }
    return Until([&] { return ended_ == episode; });
  }

 private:
  bool Until(const std::function<bool()>& condition) {
    return WaitFor([&] {
      while (bus_.Handle()) {
      }
      return condition();
    });
  }

  Bus bus_;
  source_announcement_t announcement_{};
  std::vector<int> qpos_;
  std::vector<ptrdiff_t> body_;
  bool is_met_ = false;
  int64_t tick_ = -1;
  int32_t ended_ = -1;
};

class Watch : public testing::Test {
 protected:
  void SetUp() override {
    EVALBUS_NEEDS_BUS();
    Evaluate({"lift_pot/position", "--policy", "expert", "--episodes", "1", "--seed", "3", "--in-process"},
             original());
    const RecordedLog log = ReadLog(LogFile(original(), 0));
    model_ = log.Messages(channels::kModel).at(0);
    states_ = log.Messages(channels::kState);
  }
  fs::path original() const { return folder_.path() / "original"; }
  fs::path out() const { return folder_.path() / "watched"; }
  std::unique_ptr<Program> Begin(const std::string& url, const std::vector<std::string>& more = {}) {
    std::vector<std::string> command = {"evalbus", "watch", "lift_pot/position", "--out", out(),
                                        "--url",   url};
    command.insert(command.end(), more.begin(), more.end());
    return std::make_unique<Program>(command);
  }

  TemporaryFolder folder_;
  model_info_t model_{};
  std::vector<state_t> states_;
};

// Expects the numbers that occur in both documents to be equal within the tolerance.
void ExpectAgree(const nlohmann::ordered_json& a, const nlohmann::ordered_json& b, double tolerance,
                 const std::string& at) {
  if (a.is_object()) {
    for (const auto& [key, value] : a.items()) {
      if (b.contains(key)) ExpectAgree(value, b[key], tolerance, at + "." + key);
    }
  } else if (a.is_number()) {
    ASSERT_TRUE(b.is_number()) << at;
    EXPECT_NEAR(a.get<double>(), b.get<double>(), tolerance * std::max(1.0, std::abs(a.get<double>()))) << at;
  }
}

TEST_F(Watch, ARunStrippedToWhatATrackedRobotKnowsGetsItsScores) {
  const std::string url = UniqueUrl();
  const auto watch = Begin(url, {"--episodes", "2"});
  Source source(url);
  ASSERT_TRUE(source.Meet(model_, true)) << watch->out() << watch->err();
  for (int episode = 0; episode < 2; ++episode) {
    ASSERT_TRUE(source.Play(states_, episode, {})) << watch->out() << watch->err();
  }
  ASSERT_EQ(watch->Wait(), 0) << watch->out() << watch->err();
  const auto before = Episodes(original()).at(0), after = Episodes(out()).at(0);
  EXPECT_EQ(after["end_reason"], "success");
  EXPECT_EQ(after["complete"], true);
  EXPECT_EQ(after["metrics"]["success"], before["metrics"]["success"]);
  EXPECT_EQ(after["metrics"]["completion_time"], before["metrics"]["completion_time"]);
  EXPECT_EQ(after["metrics"]["env_collision_count"], before["metrics"]["env_collision_count"]);
  EXPECT_EQ(after["metrics"]["slip_count"], before["metrics"]["slip_count"]);
  for (const char* key :
       {"cartesian_path_length", "joint_path_length", "orientation_path_length", "subtask_progress"}) {
    ASSERT_TRUE(after["metrics"].contains(key)) << key;
    ExpectAgree(before["metrics"][key], after["metrics"][key], 1e-9, key);
  }
  EXPECT_FALSE(after["extended"].contains("mechanical_work_J"));
  // Bodies and contacts are at the recorded positions.
  const RecordedLog log = ReadLog(LogFile(out(), 0));
  const auto states = log.Messages(channels::kState);
  ASSERT_EQ(states.size(), states_.size());
  for (size_t k = 0; k < states.size(); ++k) {
    for (size_t body = 0; body < states[k].body.size(); ++body) {
      for (int i = 0; i < 3; ++i) {
        ASSERT_NEAR(states[k].body[body].position_m[i], states_[k].body[body].position_m[i], 1e-9)
            << model_.body_name[body] << " at tick " << k;
      }
    }
  }
  // Rescoring gives the same scores, and all other commands accept the folder.
  EXPECT_EQ(Episodes(out()).at(1)["metrics"], after["metrics"]);
  for (const std::vector<std::string>& reader :
       {std::vector<std::string>{"evalbus", "rescore", out()},
        {"evalbus", "report", out()},
        {"evalbus", "compare", out(), original()},
        {"evalbus", "export", out(), "--csv", folder_.path() / "table.csv"}}) {
    const Result result = RunProgram(reader);
    EXPECT_EQ(result.code, 0) << reader[1] << result.out << result.err;
  }
}

// Nothing is simulated, so the rate need not fit the physics step.
TEST_F(Watch, AnyRateIsExactAndNoLockstep) {
  const std::string url = UniqueUrl();
  const auto watch = Begin(url, {"--hz", "30"});
  Source source(url);
  ASSERT_TRUE(source.Meet(model_, true));
  ASSERT_TRUE(source.Play(states_, 0, [](source_state_t*) {}));
  ASSERT_EQ(watch->Wait(), 0) << watch->err();
  EXPECT_NE(watch->out().find("source 30 Hz"), std::string::npos) << watch->out();
  EXPECT_EQ(watch->out().find("lockstep"), std::string::npos) << watch->out();
  EXPECT_EQ(watch->out().find("control rate"), std::string::npos) << watch->out();
  EXPECT_EQ(nlohmann::json::parse(ReadText(out() / "run.json"))["control_hz"], 30);
  const RecordedLog log = ReadLog(LogFile(out(), 0));
  EXPECT_EQ(log.Messages(channels::kModel).at(0).clock, "source");
  const auto states = log.Messages(channels::kState);
  ASSERT_GT(states.size(), 90u);
  EXPECT_EQ(states[90].header.sim_time_us, 3'000'000);
  // The times differ by at most one tick of each run.
  const double before = Episodes(original()).at(0)["metrics"]["completion_time"],
               after = Episodes(out()).at(0)["metrics"]["completion_time"];
  EXPECT_NEAR(before, after, 1.0 / 30 + 0.02);
  const Result rescored = RunProgram({"evalbus", "rescore", out()});
  EXPECT_EQ(rescored.code, 0) << rescored.out << rescored.err;
  EXPECT_NE(rescored.out.find("have scores bit-identical to the recorded ones"), std::string::npos)
      << rescored.out;
}

TEST_F(Watch, WithoutObjectsTheyAreNotMentioned) {
  const std::string url = UniqueUrl();
  const auto watch = Begin(url);
  Source source(url);
  ASSERT_TRUE(source.Meet(model_, false));
  ASSERT_TRUE(source.Play(states_, 0, {}));
  ASSERT_EQ(watch->Wait(), 0) << watch->err();
  const auto before = Episodes(original()).at(0), after = Episodes(out()).at(0);
  EXPECT_EQ(after["failure_reason"], "not_judged");
  EXPECT_FALSE(after["metrics"].contains("success"));
  EXPECT_FALSE(after["metrics"].contains("slip_count"));
  EXPECT_EQ(after["end_reason"], "end_of_data");
  ExpectAgree(before["metrics"]["cartesian_path_length"], after["metrics"]["cartesian_path_length"], 1e-9,
              "path");
}

TEST_F(Watch, ANaNAndAGapLeaveTheEpisodeIncomplete) {
  const std::string url = UniqueUrl();
  const auto watch = Begin(url);
  Source source(url);
  ASSERT_TRUE(source.Meet(model_, true));
  const std::vector<state_t> states(states_.begin(), states_.begin() + 60);
  ASSERT_TRUE(source.Play(states, 0, [](source_state_t* sample) {
    if (sample->sample == 30) sample->joint_position_mixed[2] = std::nan("");
    if (sample->sample > 40) sample->stamp_us += 1'000'000;
  }));
  ASSERT_EQ(watch->Wait(), 0) << watch->err();
  const auto episode = Episodes(out()).at(0);
  EXPECT_EQ(episode["complete"], false);
  // The tick of the NaN is missing, and the gap of 51 periods lacks 50 ticks.
  EXPECT_EQ(episode["extended"]["missing_ticks"], 51);
  EXPECT_NE(watch->out().find("the episode is incomplete: sample 30: left/joint3 is nan"), std::string::npos)
      << watch->out();
}

// With the contacts of the recorded simulation, by names of geoms, the scores are the same. Without contacts,
// nothing is held.
TEST_F(Watch, ContactsOfTheSourceDecide) {
  const auto recorded = ReadLog(LogFile(original(), 0)).Messages(channels::kContacts);
  ASSERT_EQ(recorded.size(), states_.size());
  const std::string url = UniqueUrl();
  const auto watch = Begin(url, {"--episodes", "2", "--contacts", "source"});
  Source source(url);
  ASSERT_TRUE(source.Meet(model_, true, true)) << watch->out() << watch->err();
  const auto named = [&](size_t k) {
    source_contacts_t contacts{};
    for (const contact_t& contact : recorded[k].contact) {
      source_contact_t& out = contacts.contact.emplace_back();
      out.name_a = model_.geom_name[static_cast<size_t>(contact.geom_a)];
      out.name_b = model_.geom_name[static_cast<size_t>(contact.geom_b)];
      out.penetration_m = std::max(0.0, -contact.distance_m);
      std::ranges::copy(contact.position_m, out.position_m);
      std::ranges::copy(contact.normal, out.normal);
    }
    return contacts;
  };
  ASSERT_TRUE(source.Play(states_, 0, {}, named)) << watch->out() << watch->err();
  ASSERT_TRUE(source.Play(states_, 1, {}, [](size_t) { return source_contacts_t{}; }))
      << watch->out() << watch->err();
  ASSERT_EQ(watch->Wait(), 0) << watch->out() << watch->err();
  EXPECT_NE(watch->out().find("contacts: from the source\n"), std::string::npos) << watch->out();
  EXPECT_EQ(nlohmann::json::parse(ReadText(out() / "run.json"))["contacts"], "source");
  const auto before = Episodes(original()).at(0), after = Episodes(out()).at(0);
  EXPECT_EQ(after["end_reason"], "success");
  EXPECT_EQ(after["complete"], true);
  for (const char* key :
       {"success", "completion_time", "task_stage_reached", "env_collision_count", "slip_count"})
    EXPECT_EQ(after["metrics"][key], before["metrics"][key]) << key;
  EXPECT_EQ(Episodes(out()).at(1)["metrics"]["task_stage_reached"]["1"], false);
  const auto found = ReadLog(LogFile(out(), 0)).Messages(channels::kContacts);
  ASSERT_EQ(found.size(), recorded.size());
  for (size_t k = 0; k < found.size(); ++k) {
    ASSERT_EQ(found[k].num_contacts, recorded[k].num_contacts) << k;
    for (size_t i = 0; i < found[k].contact.size(); ++i) {
      EXPECT_EQ(found[k].contact[i].geom_a, recorded[k].contact[i].geom_a) << k;
      EXPECT_EQ(found[k].contact[i].geom_b, recorded[k].contact[i].geom_b) << k;
      EXPECT_NEAR(found[k].contact[i].distance_m, recorded[k].contact[i].distance_m, 2e-8) << k;
    }
    if (found[k].has_clearance && recorded[k].has_clearance) {
      EXPECT_NEAR(found[k].clearance_m, recorded[k].clearance_m, 1e-6) << k;
    }
  }
  const Result rescored = RunProgram({"evalbus", "rescore", out()});
  EXPECT_NE(rescored.out.find("have scores bit-identical to the recorded ones"), std::string::npos)
      << rescored.out << rescored.err;
}

TEST_F(Watch, AnInvalidContactLeavesTheEpisodeIncomplete) {
  const std::string url = UniqueUrl();
  const auto watch = Begin(url, {"--contacts", "source"});
  Source source(url);
  ASSERT_TRUE(source.Meet(model_, true, true));
  const std::vector<state_t> states(states_.begin(), states_.begin() + 60);
  ASSERT_TRUE(source.Play(
      states, 0, [](source_state_t*) {},
      [](size_t k) {
        source_contacts_t contacts{};
        // A contact with an invalid number.
        if (k == 30) contacts.contact.push_back({"floor", "pot", -1, {0, 0, 0}, {0, 0, 1}});
        return contacts;
      }));
  ASSERT_EQ(watch->Wait(), 0) << watch->err();
  const auto episode = Episodes(out()).at(0);
  EXPECT_EQ(episode["complete"], false);
  EXPECT_EQ(episode["extended"]["missing_ticks"], 1);
  EXPECT_NE(watch->out().find("the episode is incomplete: sample 30: the contact of floor and pot has a "
                              "penetration of -1 m"),
            std::string::npos)
      << watch->out();
}

TEST_F(Watch, AMapIsCheckedBeforeTheRunBegins) {
  const fs::path map = folder_.path() / "map.yaml";
  WriteText(map, "joints:\n  unit: grad\n");
  const Result unit = RunProgram({"evalbus", "watch", "lift_pot/position", "--out", out(), "--map", map});
  EXPECT_EQ(unit.code, 1);
  EXPECT_EQ(unit.err, "error: " + map.string() + ":2: key 'unit': expected deg or rad, got 'grad'\n");
  EXPECT_FALSE(fs::exists(out()));
  const Result missing = RunProgram({"evalbus", "watch", "lift_pot/position", "--map", "missing.yaml"});
  EXPECT_EQ(missing.code, 1);
  EXPECT_EQ(missing.err, "error: missing.yaml: cannot read the map of a source: No such file or directory\n");
  const Result contacts = RunProgram({"evalbus", "watch", "lift_pot/position", "--contacts", "sauce"});
  EXPECT_EQ(contacts.code, 1);
  EXPECT_EQ(contacts.err, "error: --contacts: expected shapes or source, got 'sauce'\n");
  const Result name = RunProgram({"evalbus", "watch", "lift_pot/position", "--policy-name", "a\nb"});
  EXPECT_EQ(name.code, 1);
  EXPECT_EQ(name.err, "error: --policy-name: expected text without control characters\n");
}

// The source publishes the recorded joints with different names, zeros and frames.
TEST_F(Watch, AMapConvertsNamesZerosAndFrames) {
  const fs::path map = folder_.path() / "map.yaml";
  WriteText(map, R"(joints:
  unit: rad
  columns: {left/joint1: {column: left/joint2, sign: -1, zero: 0.25}, left/joint2: left/joint1}
objects:
  pot: {frame: {position_m: [0, 0, -0.1], quaternion_wxyz: [0, 0, 0, 1]}}
)");
  const std::string url = UniqueUrl();
  const auto watch = Begin(url, {"--map", map});
  Source source(url);
  ASSERT_TRUE(source.Meet(model_, true));
  const auto index = [&](const char* name) {
    return std::ranges::find(model_.joint_name, name) - model_.joint_name.begin();
  };
  const auto first = static_cast<size_t>(index("left/joint1")),
             second = static_cast<size_t>(index("left/joint2"));
  ASSERT_TRUE(source.Play(states_, 0, [&](source_state_t* sample) {
    const double q0 = sample->joint_position_mixed[first];
    sample->joint_position_mixed[first] = sample->joint_position_mixed[second];
    sample->joint_position_mixed[second] = 0.25 - q0;
    // The source reports the pot rotated by 180 degrees about its z axis and shifted by 0.1 m along it.
    auto& [position, quat] = sample->object[0];
    const double w = quat[0], x = quat[1], y = quat[2], z = quat[3];
    const double up[3] = {2 * (x * z + w * y), 2 * (y * z - w * x), w * w - x * x - y * y + z * z};
    for (int i = 0; i < 3; ++i) position[i] += 0.1 * up[i];
    const double turned[4] = {-z, y, -x, w};
    std::ranges::copy(turned, quat);
  }));
  ASSERT_EQ(watch->Wait(), 0) << watch->err();
  EXPECT_NE(watch->out().find("contacts: from the collision shapes of lift_pot\n"), std::string::npos);
  const auto before = Episodes(original()).at(0), after = Episodes(out()).at(0);
  EXPECT_EQ(after["metrics"]["success"], before["metrics"]["success"]);
  for (const char* key :
       {"joint_path_length", "cartesian_path_length", "object_pose_error", "target_distance"})
    ExpectAgree(before["metrics"][key], after["metrics"][key], 1e-9, key);
}

TEST_F(Watch, WhatDoesNotFitIsOneLine) {
  const std::string url = UniqueUrl();
  const auto watch = Begin(url);
  Bus bus(url);
  source_announcement_t announcement{};
  announcement.source = "mine";
  announcement.period_us = 20'000;
  announcement.joint_name = {"left/joint_1"};
  announcement.num_joints = 1;
  ASSERT_TRUE(WaitFor([&] {
    bus.Publish(channels::kSourceAnnouncement, announcement);
    return !watch->running();
  }));
  EXPECT_EQ(watch->Wait(), 1);
  EXPECT_EQ(watch->err(),
            "error: SOURCE_ANNOUNCEMENT of 'mine': there is no joint 'left/joint_1'; did you mean "
            "'left/joint1'?\n");
  EXPECT_FALSE(fs::exists(out()));
}

}  // namespace evalbus::watch_test
