// Tests the component on an in-process bus with handwritten messages.
#include "collision/collision_component.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <limits>

#include "base/errors.h"
#include "base/sha256.h"
#include "bus/channels.h"
#include "models/scene.h"
#include "tests/unit/collision/collision_scene.h"
#include "tests/unit/temporary_folder.h"

namespace evalbus::collision::collision_component_test {

const char kScene[] = R"(<mujoco><worldbody><geom name="floor" type="plane" size="1 1 1"/>
  <body name="robot"><joint type="slide" axis="0 0 1"/><geom name="ball" size=".1"/></body>
  <body name="fixture" pos="1 0 0"><geom name="post" type="box" size=".1 .1 .1"/></body></worldbody></mujoco>)";

class CollisionComponentTest : public testing::Test {
 protected:
  explicit CollisionComponentTest(bool source_decides = false)
      : scene_(kScene), bus_("memq://"), dut_(&bus_, source_decides) {
    std::filesystem::create_directory(file_.parent_path());
    mj_saveModel(scene_.model.get(), file_.c_str(), nullptr, 0);
    model_ = scene_.info;
    // Every list of a message must have the length that its count states.
    model_.num_entities = static_cast<int32_t>(model_.entity_name.size());
    model_.body_name.assign(model_.num_bodies, "");
    model_.geom_name.assign(model_.num_geoms, "");
    model_.geom_body.assign(scene_.model->geom_bodyid, scene_.model->geom_bodyid + model_.num_geoms);
    model_.physics_file = file_;
    model_.physics_sha256 = Sha256File(file_);
    model_.timestep_us = 2000;
    model_.substeps = 10;
    bus_.Subscribe(channels::kContacts, [this](const contacts_t& m) { contacts_.push_back(m); });
  }
  void Run() {
    while (bus_.Handle()) {
    }
  }
  void Begin(int episode, int attempt = 0) {
    episode_begin_t begin{};
    begin.header.episode = episode;
    begin.header.attempt = attempt_ = attempt;
    bus_.Publish(channels::kEpisodeBegin, begin);
    Run();
  }
  void Model() {
    bus_.Publish(channels::kModel, model_);
    Run();
  }
  void State(int episode, int64_t tick, double height, int num_bodies = 3) {
    state_t state{};
    state.header.episode = episode;
    state.header.attempt = attempt_;
    state.header.tick = tick;
    state.header.sim_time_us = 20000 * tick;
    state.num_bodies = num_bodies;
    state.body = {{{0, 0, 0}, {1, 0, 0, 0}}, {{0, 0, height}, {1, 0, 0, 0}}, {{1, 0, 0}, {1, 0, 0, 0}}};
    state.body.resize(num_bodies);
    bus_.Publish(channels::kState, state);
    Run();
  }

  // Attempt of the most recent episode. Messages are sent for it.
  int attempt_ = 0;
  CollisionScene scene_;
  Bus bus_;
  CollisionComponent dut_;
  TemporaryFolder folder_;
  const std::filesystem::path file_ = folder_.path() / "model/physics.mjb";
  model_info_t model_{};
  std::vector<contacts_t> contacts_;
};

TEST_F(CollisionComponentTest, AnswersEveryStateAndPublishesEverySmallerClearance) {
  Begin(4);  // not ready, because MODEL was not received
  EXPECT_EQ(dut_.status().state, component_status_t::IDLE);
  Model();
  Begin(4);
  EXPECT_EQ(dut_.status().state, component_status_t::READY);
  EXPECT_EQ(dut_.status().episode, 4);
  // A ball has a radius of 0.1. The clearance at tick 0, which is not a sample, is smaller than at ticks 1 to
  // 5. Ticks 1, 2 and 4 have smaller clearances than all samples before them. The ball touches at ticks 6 and
  // 7. Ticks 5 and 10 are a tenth of a second apart.
  const double height[] = {0.15, 0.3, 0.25, 0.26, 0.2, 0.22, 0.08, 0.09, 0.2, 0.2, 0.2};
  const bool is_there[] = {true, true, true, false, true, true, true, true, false, false, true};
  for (int tick = 0; tick < 11; ++tick) State(4, tick, height[tick]);
  ASSERT_EQ(contacts_.size(), 11u);
  for (int tick = 0; tick < 11; ++tick) {
    SCOPED_TRACE(tick);
    const contacts_t& m = contacts_[tick];
    EXPECT_EQ(m.header.episode, 4);
    EXPECT_EQ(m.header.tick, tick);
    EXPECT_EQ(m.header.sim_time_us, 20000 * tick);
    EXPECT_EQ(m.num_contacts, tick == 6 || tick == 7);
    EXPECT_EQ(m.has_clearance, is_there[tick]);
    EXPECT_NEAR(m.clearance_m, is_there[tick] ? height[tick] - 0.1 : 0, 1e-12);
    EXPECT_EQ(m.clearance_robot_geom, is_there[tick] ? scene_.Geom("ball") : -1);
    EXPECT_EQ(m.clearance_scene_geom, is_there[tick] ? scene_.Geom("floor") : -1);
  }
  EXPECT_EQ(contacts_[6].contact[0].geom_a, scene_.Geom("floor"));
  EXPECT_EQ(contacts_[6].contact[0].geom_b, scene_.Geom("ball"));
  EXPECT_NEAR(contacts_[6].contact[0].distance_m, -0.02, 1e-12);
  EXPECT_EQ(dut_.status().last_tick, 10);
  EXPECT_EQ(dut_.status().missing_ticks, 0);
  EXPECT_EQ(dut_.status().foreign_messages, 0);
}

TEST_F(CollisionComponentTest, CountsGapsAndForeignMessages) {
  Model();
  Begin(0);
  State(0, 0, 1);
  State(0, 3, 1);     // ticks 1 and 2 are lost
  State(0, 3, 1);     // a repeated STATE, whose answer is also repeated
  State(1, 4, 1);     // another episode
  State(0, 4, 1, 2);  // another model
  State(0, 4, std::numeric_limits<double>::quiet_NaN());
  EXPECT_EQ(contacts_.size(), 3u);
  EXPECT_EQ(dut_.status().missing_ticks, 2);
  EXPECT_EQ(dut_.status().foreign_messages, 4);
  // A retry of the same episode starts over.
  Begin(0, 1);
  EXPECT_EQ(dut_.status().state, component_status_t::READY);
  State(0, 0, 1);
  EXPECT_EQ(contacts_.size(), 4u);
}

TEST_F(CollisionComponentTest, EachEpisodeHasASmallestClearanceOfItsOwn) {
  Model();
  Begin(0);
  for (int tick = 0; tick < 3; ++tick) State(0, tick, 0.2);
  EXPECT_FALSE(contacts_.back().has_clearance);
  Begin(1);
  for (int tick = 0; tick < 2; ++tick) State(1, tick, 0.3);
  EXPECT_TRUE(contacts_.back().has_clearance);
}

class ContactsOfASource : public CollisionComponentTest {
 protected:
  ContactsOfASource() : CollisionComponentTest(true) {}
  void Measured(int64_t tick, std::vector<contact_t> contacts, int episode = 0) {
    contacts_t message{};
    message.header.episode = episode;
    message.header.tick = tick;
    message.contact = std::move(contacts);
    message.num_contacts = static_cast<int32_t>(message.contact.size());
    bus_.Publish(channels::kMeasuredContacts, message);
    Run();
  }
  contact_t Contact(const char* a, const char* b, double distance) const {
    return {scene_.Geom(a), scene_.Geom(b), distance, {0, 0, 0.1}, {0, 0, 1}};
  }
};

TEST_F(ContactsOfASource, ReplaceTheComputedOnesAndTheClearanceIsKept) {
  Model();
  Begin(0);
  Measured(0, {});
  State(0, 0, 0.08);  // the shapes touch
  Measured(1, {Contact("ball", "post", -0.003)});
  State(0, 1, 0.3);
  ASSERT_EQ(contacts_.size(), 2u);
  EXPECT_EQ(contacts_[0].num_contacts, 0);
  EXPECT_NEAR(contacts_[0].clearance_m, -0.02, 1e-12);
  ASSERT_EQ(contacts_[1].num_contacts, 1);
  EXPECT_EQ(contacts_[1].header.tick, 1);
  EXPECT_EQ(contacts_[1].contact[0].geom_b, scene_.Geom("post"));
  EXPECT_EQ(contacts_[1].contact[0].distance_m, -0.003);
  EXPECT_NEAR(contacts_[1].clearance_m, 0.2, 1e-12);
}

TEST_F(ContactsOfASource, PairsThatAreNotCheckedAreLeftOut) {
  Model();
  Begin(0);
  Measured(0, {Contact("floor", "ball", 0), Contact("floor", "post", 0)});
  State(0, 0, 0.3);
  ASSERT_EQ(contacts_.at(0).num_contacts, 1) << "floor and post do not move";
  EXPECT_EQ(contacts_[0].contact[0].geom_b, scene_.Geom("ball"));
}

TEST_F(ContactsOfASource, AStateWithoutThemIsNotAnswered) {
  Model();
  Begin(0);
  State(0, 0, 0.08);
  Measured(0, {}, 1);  // another episode
  State(0, 0, 0.08);
  Measured(1, {});
  State(0, 0, 0.08);
  Measured(0, {contact_t{0, 99, 0, {0, 0, 0}, {0, 0, 1}}});  // not a geom
  State(0, 0, 0.08);
  EXPECT_TRUE(contacts_.empty());
  EXPECT_EQ(dut_.status().last_tick, -1);
  Measured(0, {});
  State(0, 0, 0.08);
  EXPECT_EQ(contacts_.size(), 1u);
  State(0, 0, 0.08);  // repeated: the answer is also repeated
  EXPECT_EQ(contacts_.size(), 2u);
}

TEST_F(CollisionComponentTest, IgnoresMeasuredContactsUnlessTheSourceDecides) {
  Model();
  Begin(0);
  contacts_t measured{};
  bus_.Publish(channels::kMeasuredContacts, measured);
  State(0, 0, 0.08);
  EXPECT_EQ(contacts_.at(0).num_contacts, 1);
}

TEST_F(CollisionComponentTest, RefusesAnotherModelFile) {
  std::ofstream(file_, std::ios::app) << "x";
  Model();
  EXPECT_THROW(Begin(0), InputError);
  EXPECT_NE(dut_.status().state, component_status_t::READY);
}

TEST_F(CollisionComponentTest, RefusesAnotherMessageVersionAlsoInMidRun) {
  Model();
  Begin(0);
  EXPECT_EQ(dut_.status().state, component_status_t::READY);
  ++model_.message_version;
  Model();
  EXPECT_THROW(Begin(1), InputError);
}

TEST_F(CollisionComponentTest, RefusesAMissingModelFile) {
  model_.physics_file = "/nonexistent/model/physics.mjb";
  Model();
  EXPECT_THROW(Begin(0), InputError);
}

TEST_F(CollisionComponentTest, RefusesAFileThatIsNoModel) {
  std::ofstream(file_) << "hello";
  model_.physics_sha256 = Sha256File(file_);
  Model();
  EXPECT_THROW(Begin(0), InputError);
}

}  // namespace evalbus::collision::collision_component_test
