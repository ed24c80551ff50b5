#include "models/mjcf_part.h"

#include <cmath>

#include "models/mjcf_xml.h"
#include "tests/unit/models/models_test_util.h"

namespace evalbus::mjcf::mjcf_part_test {

using tinyxml2::XMLElement;

// A part that is read from a file with this text.
struct PartOf {
  explicit PartOf(const std::string& text) : part(folder.Write("part.xml", text), &warnings) {}
  // Returns the only element with this name. All tests have exactly one.
  XMLElement* Only(const char* name) {
    XMLElement* found = nullptr;
    ForEach(part.root(), [&](XMLElement* element) {
      if (Is(element, name)) found = element;
    });
    EXPECT_TRUE(found) << name;
    return found;
  }
  TempFolder folder;
  std::vector<std::string> warnings;
  Part part;
};

TEST(MjcfPart, PrefixesNamesAndReferencesButNotOtherText) {
  PartOf file(
      "<mujoco model='m'><default><default class='c'><geom size='1'/></default></default>"
      "<worldbody><body name='b' childclass='c'><joint name='j' type='slide'/><geom material='shiny'/></body>"
      "</worldbody><equality><weld body1='b'/></equality><actuator><motor joint='j'/></actuator>"
      "<contact><exclude body1='world' body2='b'/></contact></mujoco>");
  file.part.Prefix("pot/", "pot", {});
  EXPECT_EQ(Get(file.Only("body"), "name"), "pot/b");
  EXPECT_EQ(Get(file.Only("body"), "childclass"), "pot/c");
  EXPECT_EQ(Get(file.Only("joint"), "name"), "pot/j");
  EXPECT_EQ(Get(file.Only("joint"), "type"), "slide");
  EXPECT_EQ(Get(file.Only("geom"), "material"), "pot/shiny");
  EXPECT_EQ(Get(file.Only("motor"), "joint"), "pot/j");
  EXPECT_EQ(Get(file.Only("exclude"), "body1"), "pot");
  EXPECT_EQ(Get(file.Only("exclude"), "body2"), "pot/b");
  EXPECT_EQ(Get(file.Only("weld"), "body2"), "pot");
  EXPECT_EQ(Get(file.part.root(), "model"), "m");
}

TEST(MjcfPart, AnglesAreRadiansWhereTheJointTurns) {
  PartOf file(
      "<mujoco><default><joint range='-90 90'/></default><worldbody><body><joint name='turns'/></body>"
      "</worldbody></mujoco>");
  file.part.Normalize();
  EXPECT_EQ(file.part.MainDefault()->FirstChildElement("joint")->Attribute("range"), std::string("-90 90"));
  const XMLElement* body = file.part.Sections("worldbody")[0]->FirstChildElement();
  const std::vector<double> range =
      ParseNumbers(body, "range", body->FirstChildElement("joint")->Attribute("range"), 2);
  EXPECT_DOUBLE_EQ(range[1], std::acos(0.0));

  PartOf slides("<mujoco><worldbody><body><joint type='slide' range='-90 90'/></body></worldbody></mujoco>");
  slides.part.Normalize();
  EXPECT_EQ(Get(slides.Only("joint"), "range"), "-90 90");
  PartOf radians(
      "<mujoco><compiler angle='radian'/><worldbody><body><joint range='-1 1'/></body></worldbody></mujoco>");
  radians.part.Normalize();
  EXPECT_EQ(Get(radians.Only("joint"), "range"), "-1 1");
}

TEST(MjcfPart, DefaultSectionsBecomeOne) {
  PartOf file(
      "<mujoco><default><geom size='1'/></default><default class='main'><geom size='2'/><site rgba='1 0 0 "
      "1'/>"
      "<default class='c'/></default></mujoco>");
  const XMLElement* main = file.part.MainDefault();
  EXPECT_EQ(Get(main, "class"), "main");
  EXPECT_EQ(file.part.Sections("default").size(), 1u);
  EXPECT_EQ(Get(main->FirstChildElement("geom"), "size"), "2");
  EXPECT_TRUE(main->FirstChildElement("site"));
  EXPECT_TRUE(main->FirstChildElement("default"));
}

TEST(MjcfXml, NumbersReadBackAsTheyWere) {
  for (const double value : {1.0 / 3, 0.1, 1e-300, -2.5e17, 0.0})
    EXPECT_EQ(std::stod(NumberText(value)), value);
  EXPECT_EQ(NumberText(0.1), "0.1");
  EXPECT_EQ(Join(std::vector<double>{1, -0.5}), "1 -0.5");
}

}  // namespace evalbus::mjcf::mjcf_part_test
