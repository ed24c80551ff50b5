// What a policy server is shown: made of states and images as a contract says.
#pragma once

#include <deque>
#include <map>
#include <string>
#include <vector>

#include "evalbus/image_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/observation_t.hpp"
#include "policy_bridge/contract/contract.h"

namespace evalbus::policy {

class ObservationBuilder {
 public:
  // Throws InputError for signals that this model has not. `contract` must outlive this object.
  ObservationBuilder(const Contract& contract, const mjModel& model, const model_info_t& info);

  // An episode begins: history is forgotten.
  void Begin();

  // Views that the policy sees, each once; empty where it does not look. Needed where it is asked and, with a
  // history of images, at every tick.
  const std::vector<view_t>& views() const { return views_; }
  bool needs_every_image() const { return needs_every_image_; }
  // With a history of anything every tick is added.
  bool needs_every_tick() const { return needs_every_tick_; }

  // A tick: its state and, if they were needed, the images of views(), in their order.
  void Add(const state_t& state, const std::vector<image_t>& images);

  // The observation of the last tick added, and what the log has of it (header, prompt, arrays, digests).
  // Before there is enough history the oldest tick stands for what was before it.
  Value Build(observation_t* record);

  // Images of the last Build() as they were sent, for people.
  struct Sent {
    std::string key;
    Array array;
    bool is_chw = false, is_bgr = false;
  };
  std::vector<Sent> ImagesSent() const;

 private:
  struct Entry {
    const ObservationEntry* form;
    SignalReader signals;
    // Of views_.
    size_t view = 0;
    // Of the ticks that its history reaches back to, the newest last.
    std::deque<Array> ticks;
    size_t reach = 1;
  };

  Array Stacked(const Entry& entry) const;

  std::string prompt_;
  std::vector<view_t> views_;
  bool needs_every_tick_ = false, needs_every_image_ = false;
  std::vector<Entry> entries_;
  header_t header_{};
  // Observations built in this episode.
  int64_t num_built_ = 0;
};

}  // namespace evalbus::policy
