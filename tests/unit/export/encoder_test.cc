#include "export/encoder.h"

#include <gtest/gtest.h>

#include "bus/channels.h"
#include "bus/message.h"
#include "tests/unit/small_world.h"

namespace evalbus::exports::encoder_test {

// A plan evaluates two tasks with two policies, so their MODELs alternate on one bus. Foxglove's server
// removes the first "/metrics" when the second one arrives.
TEST(Encoder, AReplacedTopicIsNotUsedAgain) {
  std::vector<size_t> used;
  Encoder encoder(
      [&](const Message& message) {
        if (message.topic >= kFixedTopics) used.push_back(message.topic);
      },
      nullptr);
  int runs = 0;
  const auto score = [&](const std::string& metric) {
    model_info_t model = small_world::Model();
    model.run_id = std::to_string(runs++);
    encoder.Receive(channels::kModel, Encode(model));
    encoder.Receive(channels::kState, Encode(small_world::State(0)));
    partial_metrics_t partial{};
    partial.header = small_world::Header(0);
    partial.extended.num_values = 1;
    partial.extended.name = {metric};
    partial.extended.unit = {"m"};
    partial.extended.value_mixed = {1};
    encoder.Receive(channels::kPartial, Encode(partial));
  };
  for (const char* metric : {"a_m", "a_m", "b_m", "a_m"}) score(metric);
  const size_t first = kFixedTopics;
  EXPECT_EQ(used, (std::vector{first, first, first + 1, first + 2}));
  ASSERT_EQ(encoder.topics().size(), first + 3);
  EXPECT_EQ(encoder.topics()[first].schema, encoder.topics()[first + 2].schema);
}

}  // namespace evalbus::exports::encoder_test
