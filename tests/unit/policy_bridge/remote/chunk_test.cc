#include "policy_bridge/remote/chunk.h"

#include <gmock/gmock.h>

#include "tests/unit/policy_bridge/wire/server_failure.h"

namespace evalbus::policy::chunk_test {

Contract ContractOf(int num_values) {
  Contract contract;
  contract.action_keys = {"actions"};
  contract.actions.num_values = num_values;
  return contract;
}

// Returns an array of zeros of one byte each.
Value Zeros(std::vector<int64_t> shape) {
  Array array{"|u1", std::move(shape), {}};
  array.data.resize(*ItemCount(array.shape));
  return Map{{"actions", std::move(array)}};
}

TEST(ReadChunk, TakesRowsOfTheContractsWidth) {
  const Chunk chunk =
      ReadChunk(ContractOf(2), Map{{"actions", Array{"<f4", {2, 2}, FloatArray({1, 2, 3, 4}, {2, 2}).data}}});
  EXPECT_EQ(chunk.rows, (std::vector<std::vector<double>>{{1, 2}, {3, 4}}));
  EXPECT_EQ(ReadChunk(ContractOf(8), Zeros({125'000, 8})).rows.size(), 125'000u);
}

// Without this limit, one byte of an answer could need up to forty bytes of memory, several times over.
TEST(ReadChunk, RefusesMoreThanAMillionValuesBeforeItConvertsThem) {
  for (const auto& shape : std::vector<std::vector<int64_t>>{
           {125'001, 8}, {1'000'001}, {1'000'001, 1}, {1, 1'000'001}, {2'000'000, 0}}) {
    const int width = static_cast<int>(shape.back());
    EXPECT_THAT(FailureOf([&] { ReadChunk(ContractOf(width), Zeros(shape)); }),
                FailsAs(ServerError::Kind::kReply, "more than a million values"))
        << shape.front();
  }
}

TEST(ReadChunk, TheLimitIsOfAllArraysTogether) {
  Contract contract = ContractOf(2);
  contract.action_keys = {"arm", "hand"};
  const Array column{"|u1", {600'000}, Bytes(600'000)};
  EXPECT_THAT(FailureOf([&] {
                ReadChunk(contract, Map{{"arm", column}, {"hand", column}});
              }),
              FailsAs(ServerError::Kind::kReply, "more than a million values"));
}

}  // namespace evalbus::policy::chunk_test
