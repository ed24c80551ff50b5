// Builds the observations for a policy server from states and images, as described by a contract.
#pragma once

#include <deque>
#include <span>
#include <string>
#include <vector>

#include "evalbus/image_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/observation_t.hpp"
#include "policy_bridge/contract/contract.h"

namespace evalbus::policy {

class ObservationBuilder {
 public:
  // Throws InputError if the contract uses signals that this model does not have. `contract` must outlive
  // this object.
  ObservationBuilder(const Contract& contract, const mjModel& model, const model_info_t& info);

  // Begins an episode: clears the history.
  void Begin();

  // Views that the policy uses, without duplicates. Their images are needed at every tick with an observation
  // or, if the contract has a history of images (needs_every_image()), at every tick.
  const std::vector<view_t>& views() const { return views_; }
  bool needs_every_image() const { return needs_every_image_; }
  // Returns whether every tick must be added, because the contract has a history of images or of signals.
  bool needs_every_tick() const { return needs_every_tick_; }

  // Adds the state of a tick and, if needed, its images in the order of views(). Throws InputError if values
  // do not fit the shape or the dtype of their entry.
  void Add(const state_t& state, const std::vector<image_t>& images);

  // Rows that the robot executes while the policy computes (see ObservationEntry::Committed).
  struct Committed {
    std::span<const std::vector<double>> rows;
    int64_t delay_steps = 0;
  };
  // Builds the observation of the tick that was added last. *record: its data for the log (header, prompt,
  // arrays, digests). While the history is too short, its oldest tick is repeated. A tick that was not added
  // is replaced by the one before.
  Value Build(const Committed& committed, observation_t* record);

  // An image of the last Build() as it was sent, for display.
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
    // Index in views_.
    size_t view = 0;
    // Arrays of the last `reach` ticks, and of the newest tick before them, in the order of their ticks.
    struct Tick {
      int64_t tick;
      Array array;
    };
    std::deque<Tick> ticks;
    int64_t reach = 1;

    void Add(int64_t tick, Array array);
    // Returns the array of a tick or, if this tick was not added, of the one before.
    const Array& At(int64_t tick) const;
  };

  Array Stacked(const Entry& entry) const;

  std::string prompt_;
  // Number of values in a row of an action chunk.
  int64_t num_values_;
  std::vector<view_t> views_;
  bool needs_every_tick_ = false, needs_every_image_ = false;
  std::vector<Entry> entries_;
  header_t header_{};
  // Number of observations built in this episode.
  int64_t num_built_ = 0;
};

}  // namespace evalbus::policy
