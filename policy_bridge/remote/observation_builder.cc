#include "policy_bridge/remote/observation_builder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <functional>
#include <iterator>
#include <numeric>
#include <stdexcept>
#include <utility>

#include "base/errors.h"
#include "base/sha256.h"
#include "lcmtypes/message_equality.h"

namespace evalbus::policy {
namespace {

using Source = ObservationEntry::Source;

template <class Number>
std::vector<uint8_t> BytesOf(const std::vector<double>& values) {
  std::vector<uint8_t> bytes(values.size() * sizeof(Number));
  for (size_t i = 0; i < values.size(); ++i) {
    const auto number = static_cast<Number>(values[i]);
    std::memcpy(bytes.data() + i * sizeof number, &number, sizeof number);
  }
  return bytes;
}

Array StateArray(const ObservationEntry& entry, const std::vector<double>& values) {
  Array array;
  array.dtype = entry.dtype;
  const auto size = static_cast<int64_t>(values.size());
  array.shape = entry.shape.value_or(std::vector{size});
  if (const auto wanted =
          std::accumulate(array.shape.begin(), array.shape.end(), int64_t{1}, std::multiplies());
      wanted != size) {
    throw InputError(fmt::format("observation '{}': its signals have {} values, expected {} as in its shape",
                                 entry.KeyText(), size, wanted));
  }
  if (entry.dtype == "|u1") {
    const auto [least, most] = std::ranges::minmax(values);
    if (least < 0 || most > 255)
      throw InputError(fmt::format("observation '{}': uint8 takes values from 0 to 255, got {:g}",
                                   entry.KeyText(), least < 0 ? least : most));
  }
  array.data = entry.dtype == "<f8"   ? BytesOf<double>(values)
               : entry.dtype == "|u1" ? BytesOf<uint8_t>(values)
                                      : BytesOf<float>(values);
  return array;
}

// Inserts a value at its key path, and creates the maps that contain it if they are missing.
void Put(std::span<const std::string> key, Value value, Map* map) {
  if (key.size() == 1) {
    map->emplace_back(key[0], std::move(value));
    return;
  }
  auto found = std::ranges::find(*map, key[0], &Map::value_type::first);
  if (found == map->end()) found = map->insert(found, {key[0], Map{}});
  Map* inner = found->second.As<Map>();
  Put(key.subspan(1), std::move(value), inner);
}

void Record(const std::string& key, std::vector<double> numbers, observation_t* record) {
  const auto count = static_cast<int32_t>(numbers.size());
  record->array.push_back({key, count, std::move(numbers)});
}

}  // namespace

ObservationBuilder::ObservationBuilder(const Contract& contract, const mjModel& model,
                                       const model_info_t& info)
    : prompt_(contract.PromptFor(info.task, info.instruction)), num_values_(contract.actions.num_values) {
  for (const ObservationEntry& form : contract.observation) {
    Entry entry{.form = &form, .signals = SignalReader(form.signals, model, info), .ticks = {}};
    if (!form.history_ticks.empty()) entry.reach = 1 - form.history_ticks.front();
    needs_every_tick_ |= entry.reach > 1;
    if (form.is_image()) {
      const auto known =
          std::ranges::find_if(views_, [&](const view_t& view) { return SameView(view, form.image.view); });
      entry.view = static_cast<size_t>(known - views_.begin());
      if (known == views_.end()) views_.push_back(form.image.view);
      needs_every_image_ |= entry.reach > 1;
    }
    entries_.push_back(std::move(entry));
  }
}

void ObservationBuilder::Begin() {
  for (Entry& entry : entries_) entry.ticks.clear();
  num_built_ = 0;
}

void ObservationBuilder::Add(const state_t& state, const std::vector<image_t>& images) {
  header_ = state.header;
  for (Entry& entry : entries_) {
    if (entry.form->source == Source::kState) {
      entry.Add(header_.tick, StateArray(*entry.form, entry.signals.Read(state)));
    } else if (entry.form->is_image() && !images.empty()) {
      entry.Add(header_.tick, FormImage(entry.form->image, images.at(entry.view)));
    }
  }
}

void ObservationBuilder::Entry::Add(int64_t tick, Array array) {
  ticks.push_back({tick, std::move(array)});
  while (ticks.size() > 1 && ticks[1].tick <= tick - reach + 1) ticks.pop_front();
}

const Array& ObservationBuilder::Entry::At(int64_t tick) const {
  const auto after = std::ranges::upper_bound(ticks, tick, {}, &Tick::tick);
  return after == ticks.begin() ? after->array : std::prev(after)->array;
}

Array ObservationBuilder::Stacked(const Entry& entry) const {
  const auto& ticks = entry.ticks;
  if (ticks.empty()) throw std::logic_error("an observation without a tick");
  const auto& [now, newest] = ticks.back();
  if (entry.form->history_ticks.empty()) return newest;
  Array stacked{newest.dtype, newest.shape, {}};
  stacked.shape.insert(stacked.shape.begin(), static_cast<int64_t>(entry.form->history_ticks.size()));
  for (const int before : entry.form->history_ticks) {
    const Array& tick = entry.At(now + before);
    stacked.data.insert(stacked.data.end(), tick.data.begin(), tick.data.end());
  }
  return stacked;
}

Value ObservationBuilder::Build(const Committed& committed, observation_t* record) {
  Map observation;
  *record = {};
  record->header = header_;
  for (const Entry& entry : entries_) {
    const ObservationEntry& form = *entry.form;
    if (form.source == Source::kPrompt) {
      record->prompt = prompt_;
      Put(form.key, prompt_, &observation);
      continue;
    }
    if (form.source == Source::kConstant) {
      Put(form.key, form.constant, &observation);
      continue;
    }
    if (form.source == Source::kCounter) {
      const int64_t value = form.counter == ObservationEntry::Counter::kEpisode ? header_.episode
                            : form.counter == ObservationEntry::Counter::kTick  ? header_.tick
                                                                                : num_built_;
      Record(form.KeyText(), {static_cast<double>(value)}, record);
      Put(form.key, value, &observation);
      continue;
    }
    if (form.source == Source::kCommitted && form.committed == ObservationEntry::Committed::kDelaySteps) {
      Record(form.KeyText(), {static_cast<double>(committed.delay_steps)}, record);
      Put(form.key, committed.delay_steps, &observation);
      continue;
    }
    if (form.source == Source::kCommitted) {
      std::vector<double> numbers;
      for (const auto& row : committed.rows) numbers.insert(numbers.end(), row.begin(), row.end());
      Put(form.key, FloatArray(numbers, {static_cast<int64_t>(committed.rows.size()), num_values_}),
          &observation);
      Record(form.KeyText(), std::move(numbers), record);
      continue;
    }
    Array array = Stacked(entry);
    if (form.source == Source::kState) {
      seen_array_t seen{};
      seen.key = form.KeyText();
      seen.value_mixed = Numbers(array);
      seen.num_values = static_cast<int32_t>(seen.value_mixed.size());
      record->array.push_back(std::move(seen));
    } else {
      observation_image_t seen{};
      seen.key = form.KeyText();
      seen.view = form.image.view;
      seen.sha256 = Sha256Text({reinterpret_cast<const char*>(array.data.data()), array.data.size()});
      seen.sent_bytes = static_cast<int32_t>(array.data.size());
      record->image.push_back(std::move(seen));
    }
    Put(form.key, std::move(array), &observation);
  }
  record->num_arrays = static_cast<int32_t>(record->array.size());
  record->num_images = static_cast<int32_t>(record->image.size());
  ++num_built_;
  return observation;
}

std::vector<ObservationBuilder::Sent> ObservationBuilder::ImagesSent() const {
  std::vector<Sent> sent;
  for (const Entry& entry : entries_) {
    if (entry.form->source != Source::kCamera) continue;
    sent.push_back(
        {entry.form->KeyText(), entry.ticks.back().array, entry.form->image.chw, entry.form->image.bgr});
  }
  return sent;
}

}  // namespace evalbus::policy
