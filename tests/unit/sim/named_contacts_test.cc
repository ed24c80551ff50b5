#include "sim/named_contacts.h"

#include <gmock/gmock.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "sim/prepared_scene.h"

namespace evalbus::sim::named_contacts_test {

using testing::HasSubstr;

class NamedContactsTest : public testing::Test {
 protected:
  static model_info_t Info() {
    SimOptions options;
    options.task = "rotate_valve";
    options.is_source = true;
    return ComposeScene(options).info;
  }
  static source_contact_t Contact(const std::string& a, const std::string& b, double depth = 0) {
    return {a, b, depth, {1, 2, 3}, {0, 0, 1}};
  }
  // Names of the geoms of a contact.
  using Names = std::pair<std::string, std::string>;
  Names Geoms(const contact_t& contact) const {
    return {info_.geom_name[static_cast<size_t>(contact.geom_a)],
            info_.geom_name[static_cast<size_t>(contact.geom_b)]};
  }

  const model_info_t info_ = Info();
  const NamedContacts names_{info_};
};

// Pads decide what a gripper holds, so one of the pads represents a finger.
TEST_F(NamedContactsTest, ABodyOrPartIsOneOfItsGeomsAFingerItsPad) {
  const std::vector<contact_t> contacts = names_.Convert({
      Contact("left/hand/left_finger", "first_valve/wheel"),
      Contact("world", "second_valve"),
      Contact("table", "left/link5_strut"),
  });
  ASSERT_EQ(contacts.size(), 3u);
  EXPECT_EQ(Geoms(contacts[0]), Names("floor", "second_valve/feet"));
  EXPECT_EQ(Geoms(contacts[1]), Names("left/link5_strut", "table/top"));
  const auto [pad, wheel] = Geoms(contacts[2]);
  EXPECT_EQ(wheel, "first_valve/rim");
  EXPECT_EQ(std::ranges::count(info_.gripper[0].pad_geom, contacts[2].geom_a), 1) << pad;
  // If a finger also has geoms that are not pads, its pad is used.
  model_info_t info = info_;
  std::erase(info.gripper[0].pad_geom, contacts[2].geom_a);
  const std::vector<contact_t> other =
      NamedContacts(info).Convert({Contact("left/hand/left_finger", "first_valve/wheel")});
  EXPECT_EQ(Geoms(other.at(0)), Names("left/hand/left_pad", "first_valve/rim"));
}

TEST_F(NamedContactsTest, TheNormalPointsFromAToBAndTheDeepestContactOfAPairIsKept) {
  const std::vector<contact_t> contacts = names_.Convert(
      {Contact("first_valve/wheel", "floor", 0.001), Contact("floor", "first_valve/rim", 0.003),
       Contact("floor", "first_valve/rim", 0.002), Contact("floor", "world")});
  ASSERT_EQ(contacts.size(), 1u) << "floor is a geom of world";
  EXPECT_EQ(contacts[0].distance_m, -0.003);
  EXPECT_EQ(contacts[0].normal[2], 1);
  const std::vector<contact_t> turned = names_.Convert({Contact("first_valve/wheel", "floor")});
  EXPECT_EQ(Geoms(turned.at(0)), Names("floor", "first_valve/rim"));
  EXPECT_EQ(turned[0].normal[2], -1);
  EXPECT_EQ(turned[0].position_m[1], 2);
}

TEST_F(NamedContactsTest, KnowsPartsBodiesAndGeomsButNoArms) {
  for (const char* name : {"world", "floor", "table", "first_valve", "left/link0", "left/stand/torso"})
    EXPECT_TRUE(names_.Has(name)) << name;
  EXPECT_FALSE(names_.Has("left"));
  EXPECT_FALSE(names_.Has(""));
  EXPECT_EQ(names_.Unknown("first_valv"),
            "there is no object, body or geom 'first_valv'; did you mean 'first_valve'?");
}

TEST_F(NamedContactsTest, RefusesImplausibleNumbers) {
  EXPECT_EQ(names_.Fault(Contact("floor", "table")), "");
  EXPECT_EQ(names_.Fault(Contact("floor", "table", 1)), "");
  EXPECT_EQ(names_.Fault(Contact("floor", "table", -0.01)),
            "the contact of floor and table has a penetration of -0.01 m, expected 0 to 1");
  EXPECT_THAT(names_.Fault(Contact("floor", "table", 1.1)), HasSubstr("a penetration of 1.1 m"));
  EXPECT_THAT(names_.Fault(Contact("floor", "table", std::nan(""))), HasSubstr("a penetration of nan m"));
  source_contact_t contact = Contact("floor", "table");
  contact.position_m[2] = std::numeric_limits<double>::infinity();
  EXPECT_THAT(names_.Fault(contact), HasSubstr("is at 1, 2, inf m, expected at most 1000 m"));
  contact = Contact("floor", "table");
  contact.normal[2] = 0;
  EXPECT_EQ(names_.Fault(contact), "the contact of floor and table has a normal of length 0, expected 1");
}

}  // namespace evalbus::sim::named_contacts_test
