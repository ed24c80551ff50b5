#include "policy_bridge/remote/chunk.h"

#include <fmt/format.h>

#include <algorithm>

#include "base/text.h"

namespace evalbus::policy {
namespace {

[[noreturn]] void Fail(const std::string& what) { throw ServerError(ServerError::Kind::kReply, what); }

// Upper bound of the number of values in an action chunk, far above what any policy needs. It limits memory,
// because a byte of an answer may become several doubles.
constexpr size_t kMaxValues = 1'000'000;

struct Block {
  size_t num_steps = 0, num_values = 0;
  const Array* array = nullptr;
};

Block FindBlock(const std::string& key, const Value& reply, bool is_alone) {
  const Value* value = reply.Find(key);
  if (!value) Fail(fmt::format("the answer has no '{}': {}", key, Describe(reply)));
  const Array* array = value->As<Array>();
  if (!array) Fail(fmt::format("'{}' of the answer is not an array: {}", key, Describe(*value)));
  const auto& shape = array->shape;
  if (shape.empty() || shape.size() > 2) {
    Fail(fmt::format("'{}' of the answer: expected steps x values, got {}", key, Describe(*value)));
  }
  const auto first = static_cast<size_t>(shape.front()), last = static_cast<size_t>(shape.back());
  if (shape.size() == 2) return {first, last, array};
  return is_alone ? Block{1, first, array} : Block{first, 1, array};
}

// Finds the arrays of the action chunk. Checks their sizes, and that all have the same number of steps.
std::vector<Block> FindBlocks(const Contract& contract, const Value& reply) {
  std::vector<Block> blocks;
  size_t num_values = 0;
  for (const std::string& key : contract.action_keys) {
    const Block& block = blocks.emplace_back(FindBlock(key, reply, contract.action_keys.size() == 1));
    num_values += std::min(ItemCount(block.array->shape).value_or(kMaxValues + 1), kMaxValues + 1);
    if (num_values > kMaxValues || block.num_steps > kMaxValues) {
      Fail(fmt::format("'{}' of the answer: more than a million values: {}", key, Describe(*block.array)));
    }
    if (block.num_steps != blocks.front().num_steps) {
      Fail(fmt::format("'{}' of the answer has {} steps, '{}' has {}", key, block.num_steps,
                       contract.action_keys.front(), blocks.front().num_steps));
    }
  }
  return blocks;
}

}  // namespace

Chunk ReadChunk(const Contract& contract, const Value& reply) {
  Chunk chunk;
  for (const Block& block : FindBlocks(contract, reply)) {
    chunk.rows.resize(block.num_steps);
    const std::vector<double> numbers = Numbers(*block.array);
    for (size_t i = 0; i < block.num_steps; ++i) {
      const auto row = numbers.begin() + static_cast<std::ptrdiff_t>(i * block.num_values);
      chunk.rows[i].insert(chunk.rows[i].end(), row, row + static_cast<std::ptrdiff_t>(block.num_values));
    }
  }
  const size_t num_steps = chunk.rows.size(), num_values = num_steps == 0 ? 0 : chunk.rows[0].size();
  if (num_steps == 0 || num_values != static_cast<size_t>(contract.actions.num_values)) {
    Fail(fmt::format("the answer has {} of {}, the contract expects {} (action.values)",
                     Plural(static_cast<int64_t>(num_steps), "step"),
                     Plural(static_cast<int64_t>(num_values), "value"),
                     Plural(contract.actions.num_values, "value")));
  }
  if (contract.chunk_steps && num_steps != static_cast<size_t>(*contract.chunk_steps)) {
    Fail(fmt::format("the answer has {}, the contract expects {} (action.chunk_steps)",
                     Plural(static_cast<int64_t>(num_steps), "step"), *contract.chunk_steps));
  }
  if (num_steps < static_cast<size_t>(contract.execute_steps)) {
    Fail(fmt::format("the answer has {}, and {} are to be executed (action.execute_steps)",
                     Plural(static_cast<int64_t>(num_steps), "step"), contract.execute_steps));
  }
  return chunk;
}

}  // namespace evalbus::policy
