// Tests numbers for PlotJuggler.
#include "export/plotjuggler.h"

#include <gmock/gmock.h>

#include <nlohmann/json.hpp>

namespace evalbus::exports::plotjuggler_test {

using nlohmann::json;
using testing::ElementsAre;
using testing::IsEmpty;
using testing::SizeIs;

TEST(PlotJuggler, TakesNumbersAlone) {
  const auto datagrams =
      Datagrams("/t", 1.25, R"({"timestamp":{"sec":1,"nsec":250000000},"a":{"left":0.5,"x":"no"},
      "is":true,"joints":[{"name":"j1","position":2}],"contacts":[{"a":"no","distance_m":1}]})");
  ASSERT_THAT(datagrams, SizeIs(1));
  EXPECT_EQ(json::parse(datagrams[0]),
            json::parse(R"({"timestamp":1.25,"/t/a/left":0.5,"/t/is":1,"/t/joints/j1/position":2})"));
  EXPECT_THAT(Datagrams("/t", 0, R"({"timestamp":{"sec":0,"nsec":0},"text":"x"})"), IsEmpty());
}

TEST(PlotJuggler, SplitsWhatIsTooLong) {
  json many = json::object();
  for (int i = 0; i < 300; ++i) many["number_" + std::to_string(i)] = i;
  const auto datagrams = Datagrams("/t", 2, many.dump());
  EXPECT_GT(datagrams.size(), 3U);
  json all = json::object();
  for (const std::string& datagram : datagrams) {
    EXPECT_LE(datagram.size(), kDatagramBytes);
    const json one = json::parse(datagram);
    EXPECT_EQ(one["timestamp"], 2);
    all.update(one);
  }
  EXPECT_EQ(all.size(), 301U);
  EXPECT_EQ(all["/t/number_299"], 299);
}

}  // namespace evalbus::exports::plotjuggler_test
