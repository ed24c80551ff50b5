#include "models/inferred_inertials.h"

#include <gtest/gtest.h>

#include <string>

#include "models/mujoco_ptr.h"

namespace evalbus::inferred_inertials_test {

constexpr const char* kScene = R"(<mujoco>
    <worldbody>
        <body name="given">
            <inertial mass="3" pos="0 0 0" diaginertia="1 1 1"/>
            <freejoint/>
            <body name="box" pos="1 0 0">
                <geom type="box" size="0.5 1 1.5" mass="12"/>
            </body>
        </body>
    </worldbody>
</mujoco>
)";

std::string Text(const tinyxml2::XMLDocument& document) {
  tinyxml2::XMLPrinter printer;
  document.Print(&printer);
  return printer.CStr();
}

ModelPtr Compile(const std::string& xml) {
  const VfsPtr vfs = MakeVfs();
  AddToVfs("scene.xml", xml, vfs.get());
  char message[500] = "";
  ModelPtr model(mj_loadXML("scene.xml", vfs.get(), message, sizeof(message)));
  EXPECT_TRUE(model) << message;
  return model;
}

TEST(InferredInertials, AreAddedMarkedAndRemoved) {
  tinyxml2::XMLDocument document;
  ASSERT_EQ(document.Parse(kScene), tinyxml2::XML_SUCCESS);
  tinyxml2::XMLElement* worldbody = document.RootElement()->FirstChildElement("worldbody");
  const std::string original = Text(document);

  EXPECT_FALSE(mjcf::RemoveInferredInertials(worldbody));
  mjcf::AddInferredInertials(worldbody, *Compile(original));
  tinyxml2::XMLElement* given = worldbody->FirstChildElement("body");
  EXPECT_STREQ(given->FirstChildElement("inertial")->Attribute("mass"), "3");
  tinyxml2::XMLElement* inferred = given->FirstChildElement("body")->FirstChildElement("inertial");
  ASSERT_TRUE(inferred);
  EXPECT_STREQ(inferred->Attribute("mass"), "12");

  // With a massless geom, the result shows that the added values are used: m / 12 * (sums of squared edges).
  given->FirstChildElement("body")->FirstChildElement("geom")->SetAttribute("mass", "0");
  const ModelPtr model = Compile(Text(document));
  EXPECT_NEAR(model->body_mass[2], 12, 1e-12);
  double sum = 0;
  for (int i = 0; i < 3; ++i) sum += model->body_inertia[6 + i];
  EXPECT_NEAR(sum, 13 + 10 + 5, 1e-9);

  given->FirstChildElement("body")->FirstChildElement("geom")->SetAttribute("mass", "12");
  EXPECT_TRUE(mjcf::RemoveInferredInertials(worldbody));
  EXPECT_EQ(Text(document), original);
}

}  // namespace evalbus::inferred_inertials_test
