#include "sim/source_component.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <iterator>
#include <limits>
#include <utility>

#include "base/errors.h"
#include "base/input_file.h"
#include "base/text.h"
#include "bus/channels.h"
#include "lcmtypes/clock.h"
#include "lcmtypes/end_reason.h"
#include "lcmtypes/source.h"
#include "models/unlocated_parts.h"
#include "sim/jpeg_check.h"

namespace evalbus::sim {
namespace {

using std::chrono::steady_clock;

// Metrics gives up waiting for the ticks of a gap once a hundred later ticks are complete. Therefore, this
// many ticks are published after a gap without waiting for scores.
constexpr int64_t kGapWindowTicks = 120;
// A larger leap ends the episode. The limit is a little below the number of ticks that metrics can store.
constexpr int64_t kMaxLeapTicks = 4000;
// Maximum queue length, about a hundred megabytes. The queue grows if a source is faster than its scoring.
constexpr size_t kMaxWaiting = 100'000;

// If, over this many samples, the stamps advance by less than a hundredth of the stated period per sample,
// they are not in microseconds.
constexpr int64_t kSamplesForUnit = 20;
constexpr double kLeastShareOfPeriod = 0.01;

// Images are only shown to people, so a few small images are sufficient. With images of 50 kB, a minute with
// two cameras takes about 60 MB in the log.
constexpr size_t kMaxCameras = 8;
constexpr int kMaxImageBytes = 512 << 10;
constexpr int kMaxImagePixels = 2048;
constexpr size_t kMaxWaitingImageBytes = size_t{64} << 20;
// Minimum time between images of a camera; images in between are dropped. It allows 10 images per second,
// with a margin for the source's clock.
constexpr int64_t kLeastBetweenImagesUs = 95'000;

// Parses "left=open,right=closed": fixed openings of grippers that are not measured.
std::vector<std::optional<double>> FixedOpenings(const std::vector<std::string>& texts,
                                                 const model_info_t& info) {
  std::vector<std::optional<double>> openings(info.gripper.size());
  std::vector<std::string> names;
  for (const gripper_info_t& gripper : info.gripper) names.push_back(gripper.name);
  for (const std::string& text : texts) {
    const size_t equals = text.find('=');
    const std::string name = text.substr(0, equals),
                      how = equals == std::string::npos ? "" : text.substr(equals + 1);
    const auto found = std::ranges::find(names, name);
    if (found == names.end()) {
      throw InputError("--gripper " + text + ": there is no gripper '" + name + "'" +
                       Suggestion(name, names));
    }
    if (how != "open" && how != "closed")
      throw InputError("--gripper " + text + ": expected " + name + "=open or " + name + "=closed");
    auto& opening = openings[static_cast<size_t>(found - names.begin())];
    if (opening) throw InputError("--gripper " + text + ": '" + name + "' is given twice");
    opening = how == "open" ? 1 : 0;
  }
  return openings;
}

// Returns the difference of two stamps, limited to the largest representable number.
int64_t MicrosecondsSince(int64_t before_us, int64_t stamp_us) {
  int64_t us = 0;
  return __builtin_sub_overflow(stamp_us, before_us, &us) ? std::numeric_limits<int64_t>::max() : us;
}

// Rounds durations of at least 10 ms to whole milliseconds.
std::string MillisecondsText(double time_s) {
  const double ms = time_s * 1e3;
  return ms < 10 ? fmt::format("{:.3g}", ms) : fmt::format("{:.0f}", ms);
}

// Asks for the unit of the stamps if the time between two samples is about a thousand announced periods.
std::string UnitHint(double apart_s, double period_s) {
  const double periods = apart_s / period_s;
  if (periods < 900 || periods > 1100) return "";
  return "; is the unit milliseconds instead of seconds, or nanoseconds instead of microseconds?";
}

std::optional<SourceMap> MapOf(const SimOptions& options) {
  if (options.map.empty()) return std::nullopt;
  return ReadSourceMap(ReadInput(options.map, "map of a source"), options.map);
}

// Throws InputError if the task does not have a name in the map.
void CheckMap(const SourceMap& map, const model_info_t& info, const NamedContacts& contacts) {
  for (const auto& [name, joint] : map.joints) {
    if (std::ranges::find(info.joint_name, name) == info.joint_name.end())
      joint.where.Fail("there is no joint '" + Printable(name) + "'" + Suggestion(name, info.joint_name));
  }
  for (const auto& [name, object] : map.objects) {
    if (std::ranges::find(info.object_name, name) == info.object_name.end())
      object.where.Fail("there is no object '" + Printable(name) + "'" + Suggestion(name, info.object_name));
  }
  for (const auto& [its, contact] : map.contacts) {
    if (contacts.Has(contact.name)) continue;
    contact.where.Fail(contacts.Unknown(contact.name));
  }
}

SimOptions WithoutPhysics(SimOptions options) {
  options.is_source = true;
  return options;
}

}  // namespace

void CheckSourceOptions(const SimOptions& options, const model_info_t& info) {
  FixedOpenings(options.gripper, info);
  if (const auto map = MapOf(options)) CheckMap(*map, info, NamedContacts(info));
}

std::string SourceComponent::Running::SparseText() const {
  const SampleTicks::Sparse& sparse = ticks.sparse();
  const std::string shortest = MillisecondsText(sparse.shortest_s),
                    longest = MillisecondsText(sparse.longest_s);
  return fmt::format("samples are {} ms apart in {}, but SOURCE_ANNOUNCEMENT states a period of {} ms{}",
                     shortest == longest ? longest : shortest + " to " + longest,
                     Plural(sparse.pairs, "place"), MillisecondsText(period_s),
                     UnitHint(sparse.longest_s, period_s));
}

std::string SourceComponent::Running::Faults() const {
  std::vector<std::string> all;
  const int sparse = ticks.sparse().pairs;
  if (sparse > 0) all.push_back(SparseText());
  if (ticks.gaps() > sparse)
    all.push_back("samples are missing in " + Plural(ticks.gaps() - sparse, "place"));
  if (lost > 0) all.push_back(Plural(lost, "sample") + " never came");
  if (refused > 0) all.push_back(Plural(refused, "sample") + " refused, the first: " + first_fault);
  if (refused_images > 0)
    all.push_back(Plural(refused_images, "image") + " refused, the first: " + first_image_fault);
  if (beyond_range > 0) all.push_back(sim::BeyondRangeText(beyond_range, first_beyond_range));
  return fmt::format("{}", fmt::join(all, "; "));
}

SourceComponent::SourceComponent(Bus* bus, SimOptions options)
    : EpisodeComponent(bus, WithoutPhysics(options)),
      options_(WithoutPhysics(std::move(options))),
      tick_s_(ControlPeriod(prepared_.info)),
      opening_(FixedOpenings(options_.gripper, prepared_.info)),
      has_contacts_(options_.contacts == contacts_from::kSource),
      map_(MapOf(options_)) {
  if (has_contacts_ || map_) names_.emplace(prepared_.info);
  if (map_) CheckMap(*map_, prepared_.info, *names_);
  bus->Subscribe(channels::kSourceAnnouncement,
                 [this](const source_announcement_t& m) { OnAnnouncement(m); });
  bus->Subscribe(channels::kSourceState, [this](const source_state_t& m) { OnSample(m); });
  if (has_contacts_)
    bus->Subscribe(channels::kSourceContacts, [this](const source_contacts_t& m) { OnContacts(m); });
  bus->SubscribeRaw(
      channels::kSourceImage.name + std::string(".*"),
      [this](std::string_view channel, std::span<const uint8_t> data, int64_t) { OnImage(channel, data); });
  bus->Subscribe(channels::kCommand, [this](const command_t& m) { OnCommand(m); });
  bus->Subscribe(channels::kStatus, [this](const component_status_t& m) { OnStatus(m); });
  bus->Subscribe(channels::kPartial, [this](const partial_metrics_t& m) { OnPartial(m); });
}

void SourceComponent::OnAnnouncement(const source_announcement_t& announcement) {
  if (!source_announcement_) {
    Meet(announcement);
    source_announcement_bytes_.assign(bus().handled().begin(), bus().handled().end());
    return BeginIfMet();
  }
  if (!std::ranges::equal(bus().handled(), source_announcement_bytes_)) {
    throw InputError(fmt::format(
        "the SOURCE_ANNOUNCEMENT of source '{}' differs from the first one, of '{}': is a second source on "
        "this bus? If the source has changed, start a new 'evalbus watch'",
        Printable(announcement.source), source()));
  }
  // The source may not have received MODEL yet.
  if (phase_ != Phase::kRunning) PublishModel();
}

Measured SourceComponent::NamesOf(const source_announcement_t& announcement, const std::string& name) {
  Measured measured{announcement.joint_name, announcement.has_velocity != 0, announcement.object_name};
  joint_maps_.assign(measured.joints.size(), JointMap{});
  object_frames_.assign(measured.objects.size(), Pose{});
  if (!map_) return measured;
  const auto find = [&](const std::vector<std::string>& names, const std::string& its, const char* what,
                        const YamlValue& where) {
    const auto found = std::ranges::find(names, its);
    if (found != names.end()) return static_cast<size_t>(found - names.begin());
    where.Fail(
        fmt::format("source '{}' has no {} '{}'{}", name, what, Printable(its), Suggestion(its, names)));
  };
  for (const auto& [ours, joint] : map_->joints) {
    const size_t k = find(announcement.joint_name, joint.name, "joint", joint.where);
    measured.joints[k] = ours;
    joint_maps_[k] = joint;
  }
  for (const auto& [ours, object] : map_->objects) {
    const size_t k = find(announcement.object_name, object.name, "object", object.where);
    measured.objects[k] = ours;
    object_frames_[k] = object.frame;
  }
  return measured;
}

void SourceComponent::Meet(const source_announcement_t& announcement) {
  const std::string name = announcement.source.empty() ? "source" : Printable(announcement.source);
  if (name == source_name::kSim || name == source_name::kFile) {
    throw InputError("SOURCE_ANNOUNCEMENT: a source cannot have the name '" + name +
                     "', which evalbus itself uses");
  }
  if (announcement.period_us < 1 || announcement.period_us > 1'000'000) {
    throw InputError(fmt::format("SOURCE_ANNOUNCEMENT of '{}': period_us is {}, expected 1 to 1000000", name,
                                 announcement.period_us));
  }
  if (has_contacts_ != (announcement.has_contacts != 0)) {
    throw InputError("SOURCE_ANNOUNCEMENT of '" + name + "': it publishes " +
                     (has_contacts_ ? "no contacts, but --contacts source requires them"
                                    : "contacts; score with them with --contacts source"));
  }
  const Measured measured = NamesOf(announcement, name);
  try {
    scene_ = std::make_unique<MeasuredScene>(&prepared_, measured, name);
  } catch (const InputError& error) {
    throw InputError("SOURCE_ANNOUNCEMENT of '" + name + "': " + error.what());
  }
  for (size_t k = 0; k < opening_.size(); ++k) {
    const std::string& gripper = prepared_.info.gripper[k].name;
    const bool is_measured = !scene_->FingersOf(k).empty();
    if (is_measured && opening_[k]) {
      throw InputError(
          fmt::format("--gripper: the source '{}' measures finger joints of gripper '{}'; omit "
                      "this option for it",
                      name, gripper));
    }
    if (is_measured || opening_[k]) continue;
    throw InputError(
        fmt::format("SOURCE_ANNOUNCEMENT of '{}': no finger joint of gripper '{}' is measured; state its "
                    "constant position with --gripper {}=open or {}=closed",
                    name, gripper, gripper, gripper));
  }
  source_announcement_ = announcement;
  model_bytes_ = Encode(prepared_.info);
  std::vector<std::string> untracked;
  for (int k = 0; k < prepared_.info.num_objects; ++k) {
    if (!prepared_.info.object_is_tracked[k]) untracked.push_back(prepared_.info.object_name[k]);
  }
  std::ranges::copy(UnlocatedParts(prepared_.task, prepared_.info), std::back_inserter(untracked));
  log().Info("source '{}': {} joints at {:g} Hz, velocities {}, contacts {}{}", name, announcement.num_joints,
             1e6 / static_cast<double>(announcement.period_us),
             measured.has_velocity ? "measured" : "by differences",
             has_contacts_ ? "from the source" : "from the collision shapes",
             untracked.empty() ? "" : fmt::format("; not tracked: {}", fmt::join(untracked, ", ")));
}

void SourceComponent::OnCommand(const command_t& command) {
  if (command.kind == command_t::STOP) {
    if (phase_ == Phase::kRunning && running_ && running_->state)
      End(end_reason::kAborted, "stopped on command");
    done_ = true;
    return;
  }
  const bool is_same = command.episode == status_.episode;
  if (command.kind != command_t::START_EPISODE || (phase_ == Phase::kRunning && running_) ||
      (is_same && command.attempt <= status_.attempt)) {
    return;
  }
  command_ = command;
  BeginIfMet();
}

void SourceComponent::BeginIfMet() {
  if (!source_announcement_ || !command_) return;
  BeginEpisode(*command_);
  command_.reset();
  running_.reset();
  phase_ = Phase::kWaiting;
  AnnounceEpisode();
}

void SourceComponent::OnForeign(const std::string& what) {
  End(end_reason::kAborted,
      what + " that 'evalbus watch' did not publish: is a sim on this bus, or a log being played?");
}

void SourceComponent::OnStatus(const component_status_t& status) {
  if (!readiness_.Update(status)) ++status_.foreign_messages;
  if (phase_ == Phase::kIdle) return;
  if (!readiness_.twice().empty()) {
    return End(end_reason::kAborted, "two processes on this bus claim to be the " + readiness_.twice());
  }
  if (phase_ == Phase::kWaiting && readiness_.Missing().empty()) {
    phase_ = Phase::kRunning;
    PublishReady();
    log().Info("waiting for the source's next episode");
  }
  Advance();
}

std::string SourceComponent::FaultOf(const source_state_t& message, Sample* sample) const {
  if (newest_->first_stamp_us && message.stamp_us <= newest_->stamp_us) {
    return fmt::format("the time changes from {} us to {} us; it must increase", newest_->stamp_us,
                       message.stamp_us);
  }
  sample->time_s =
      Seconds(MicrosecondsSince(newest_->first_stamp_us.value_or(message.stamp_us), message.stamp_us));
  sample->position = message.joint_position_mixed;
  sample->velocity = message.joint_velocity_mixed;
  sample->object = message.object;
  sample->opening = opening_;
  for (size_t k = 0; k < joint_maps_.size(); ++k) {
    const double unit = map_ && !scene_->slides(k) ? map_->angle_unit : 1;
    sample->position[k] = joint_maps_[k].Position(sample->position[k]) * unit;
    if (!sample->velocity.empty()) sample->velocity[k] *= joint_maps_[k].sign * unit;
  }
  const std::string fault = scene_->SampleFault(*sample);
  if (!fault.empty()) return fault;
  // Frames are converted last, because this requires valid quaternions, which were checked above.
  for (size_t k = 0; map_ && k < object_frames_.size(); ++k)
    sample->object[k] = PoseInFrame(sample->object[k], object_frames_[k]);
  return newest_->first_stamp_us ? "" : scene_->FirstSampleFault(*sample);
}

void SourceComponent::OnContacts(const source_contacts_t& contacts) {
  if (contacts_) ++status_.foreign_messages;  // the sample of the previous contacts never arrived
  contacts_ = contacts;
}

std::string SourceComponent::TakeContacts(const source_state_t& message, Sample* sample) {
  if (!has_contacts_) return "";
  if (!contacts_ || contacts_->episode != message.episode || contacts_->sample != message.sample)
    return "SOURCE_CONTACTS of this sample did not arrive before its SOURCE_STATE";
  std::vector<source_contact_t> contacts = std::move(contacts_->contact);
  contacts_.reset();
  for (source_contact_t& contact : contacts) {
    for (std::string* name : {&contact.name_a, &contact.name_b}) {
      if (map_ && map_->contacts.contains(*name)) *name = map_->contacts.at(*name).name;
      if (names_->Has(*name)) continue;
      // An unknown name would recur in every later contact of this body. Therefore it ends the run, whereas
      // the faults below reject only this sample.
      throw InputError(fmt::format("source '{}', sample {}: contacts: {}", source(), message.sample,
                                   names_->Unknown(*name)));
    }
    if (const std::string fault = names_->Fault(contact); !fault.empty()) return fault;
  }
  sample->contacts = names_->Convert(contacts);
  return "";
}

void SourceComponent::CheckUnitOfStamps(int64_t samples, double time_s) const {
  const double expected_s = Seconds(samples * source_announcement_->period_us);
  if (time_s >= kLeastShareOfPeriod * expected_s) return;
  throw InputError(
      fmt::format("source '{}': {} samples took {:.3g} s by their stamp_us, expected about {:.3g} s with the "
                  "stated period_us of {}; are these microseconds?",
                  source(), samples, time_s, expected_s, source_announcement_->period_us));
}

void SourceComponent::OnSample(const source_state_t& message) {
  if (!source_announcement_) {
    ++status_.foreign_messages;
    if (!std::exchange(unknown_told_, true)) {
      log().Warn("ignoring SOURCE_STATE until SOURCE_ANNOUNCEMENT arrives: the joints are unknown");
    }
    return;
  }
  const auto check = [&](const char* what, int32_t has, int32_t expected) {
    if (has == expected) return;
    throw InputError(fmt::format("source '{}', sample {}: {} {}, SOURCE_ANNOUNCEMENT states {}", source(),
                                 message.sample, has, what, expected));
  };
  check("joint positions", message.num_joints, source_announcement_->num_joints);
  check("joint velocities", message.num_velocities,
        source_announcement_->has_velocity ? source_announcement_->num_joints : 0);
  check("object poses", message.num_objects, source_announcement_->num_objects);
  silence_ = Wait(steady_clock::now());

  const bool is_other = !newest_ || message.episode != newest_->number;
  // A restarted source counts from 0 again.
  const bool is_again = !is_other && message.sample == 0 && newest_->sample > 0;
  if (is_again && !newest_->is_over) {
    Arrive({newest_episode_, std::nullopt, 0, "the source restarted the episode", 0, true});
  }
  if (is_other || is_again) {
    newest_.emplace(Arriving{}).number = message.episode;
    ++newest_episode_;
  }
  if (newest_->is_over || newest_episode_ <= finished_)
    return;  // The episode is already scored, so its remaining messages are ignored.
  Arrived arrived{newest_episode_, Sample{}, message.sample, "", 0, message.is_last != 0};
  const int64_t expected = newest_->sample + 1;
  // If the first sample is missing, time 0 of the episode is unknown.
  const bool begins_late = expected == 0 && message.sample > 0;
  if (message.sample < 0) {
    arrived.fault = fmt::format("expected a sample number of at least 0, got {}", message.sample);
  } else if (message.sample < expected) {
    arrived.fault = fmt::format("sample {} was received after sample {}: is a second source on this bus?",
                                message.sample, newest_->sample);
  } else if (message.sample > kMaxTick) {
    arrived.fault = fmt::format("expected a sample number of at most {}, got {}", kMaxTick, message.sample);
  } else {
    arrived.lost = message.sample - expected;
    newest_->sample = message.sample;
    arrived.fault =
        begins_late ? "the episode's first sample did not arrive" : FaultOf(message, &*arrived.sample);
    if (arrived.fault.empty()) arrived.fault = TakeContacts(message, &*arrived.sample);
  }
  if (arrived.fault.empty()) {
    if (!newest_->first_stamp_us) newest_->first_stamp_us = message.stamp_us;
    const int64_t leap_us = MicrosecondsSince(newest_->stamp_us, message.stamp_us);
    const double longest_us =
        std::min(options_.source_timeout_s * 1e6, static_cast<double>(TimeOf(kMaxLeapTicks)));
    if (arrived.sample->time_s > 0 && static_cast<double>(leap_us) > longest_us) {
      arrived.fault = fmt::format("the source's clock jumps by {:.3g} s{}", Seconds(leap_us),
                                  UnitHint(Seconds(leap_us), Seconds(source_announcement_->period_us)));
      arrived.is_last = true;
    }
    newest_->stamp_us = message.stamp_us;
    // Sample kSamplesForUnit itself may be lost.
    if (newest_episode_ == 0 && message.sample >= kSamplesForUnit && !std::exchange(unit_is_checked_, true))
      CheckUnitOfStamps(message.sample, arrived.sample->time_s);
    const std::string beyond = scene_->BeyondRange(*arrived.sample);
    if (!beyond.empty()) arrived.beyond_range = fmt::format("sample {}: {}", message.sample, beyond);
  }
  if (!arrived.fault.empty()) {
    // A fault in the very first sample (units, order) probably also affects all later ones, so it ends the
    // run.
    if (newest_episode_ == 0 && !newest_->first_stamp_us && !begins_late) {
      throw InputError(fmt::format("source '{}', sample {}: {}", source(), message.sample, arrived.fault));
    }
    arrived.sample.reset();
  }
  newest_->is_over = arrived.is_last;
  Arrive(std::move(arrived));
  Advance();
}

std::string SourceComponent::FaultOf(const image_t& image, std::string_view channel) {
  const view_t& view = image.view;
  const auto is_plain = [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '/';
  };
  if (view.camera.empty() || view.camera.size() > 64 || !std::ranges::all_of(view.camera, is_plain)) {
    return fmt::format("camera '{}': expected 1 to 64 letters, digits, '_' and '/'", Printable(view.camera));
  }
  if (channels::ImageChannel(view.camera, channels::kSourceImage) != channel)
    return fmt::format("camera '{}' on channel {}, expected {}", view.camera, Printable(std::string(channel)),
                       channels::ImageChannel(view.camera, channels::kSourceImage));
  if (view.encoding != "jpeg") return fmt::format("encoding '{}': expected jpeg", Printable(view.encoding));
  if (std::min(view.width_px, view.height_px) < 1 ||
      std::max(view.width_px, view.height_px) > kMaxImagePixels) {
    return fmt::format("{}x{} pixels: expected 1 to {} per side", view.width_px, view.height_px,
                       kMaxImagePixels);
  }
  if (image.num_bytes > kMaxImageBytes)
    return fmt::format("{} bytes: expected at most {}", image.num_bytes, kMaxImageBytes);
  if (!cameras_.contains(view.camera) && cameras_.size() >= kMaxCameras)
    return fmt::format("camera '{}': the maximum of {} cameras is reached", view.camera, kMaxCameras);
  return JpegFault({image.data.data(), image.data.size()}, view.width_px, view.height_px);
}

void SourceComponent::OnImage(std::string_view channel, std::span<const uint8_t> data) {
  const auto image = std::make_shared<image_t>();
  if (!Decode(data, image.get())) return bus().CountDecodeError();
  // Before the episode's first sample, the image's time is unknown. After its end, the image does not belong
  // to it.
  if (!newest_ || newest_->is_over || !newest_->first_stamp_us || image->header.episode != newest_->number ||
      newest_episode_ <= finished_) {
    ++status_.foreign_messages;
    return;
  }
  // The stamp is arbitrary, so the subtraction uses wrapping arithmetic.
  const auto time_us = static_cast<int64_t>(static_cast<uint64_t>(image->header.sim_time_us) -
                                            static_cast<uint64_t>(*newest_->first_stamp_us));
  // Images from before the first sample do not belong to the episode.
  if (time_us < 0) return;
  const double ahead_s =
      (static_cast<double>(image->header.sim_time_us) - static_cast<double>(newest_->stamp_us)) / 1e6;
  const auto last = newest_->image_us.find(image->view.camera);
  const int64_t between_us = last == newest_->image_us.end() ? kLeastBetweenImagesUs : time_us - last->second;
  // Drops images beyond the rate limit. If the queue is almost full, samples take precedence.
  if ((between_us > 0 && between_us < kLeastBetweenImagesUs) || arrived_.size() + 1 >= kMaxWaiting) {
    return;
  }
  Arrived arrived{newest_episode_, std::nullopt};
  arrived.image = image;
  arrived.fault = between_us <= 0
                      ? fmt::format("camera '{}': the time changes from {} us to {} us; it must increase",
                                    Printable(image->view.camera), last->second, time_us)
                  : ahead_s > options_.source_timeout_s
                      ? fmt::format("camera '{}': its time is {:.3g} s ahead of the samples",
                                    Printable(image->view.camera), ahead_s)
                  : waiting_image_bytes_ + image->data.size() > kMaxWaitingImageBytes
                      ? "scoring is slower than the source"
                      : FaultOf(*image, channel);
  if (arrived.fault.empty()) {
    cameras_.insert(image->view.camera);
    newest_->image_us[image->view.camera] = time_us;
    image->header.sim_time_us = time_us;
    waiting_image_bytes_ += image->data.size();
  } else {
    image->data.clear();
  }
  Arrive(std::move(arrived));
  Advance();
}

void SourceComponent::ProcessImage(const Arrived& arrived) {
  Running& r = *running_;
  image_t& image = *arrived.image;
  if (!arrived.fault.empty()) {
    if (r.refused_images++ > 0) return;
    r.first_image_fault = arrived.fault;
    log().Warn("refused an image: {}", arrived.fault);
    return;
  }
  const int64_t time_us = image.header.sim_time_us;
  image.header = begin_.header;
  image.header.sim_time_us = time_us;
  image.header.tick = static_cast<int64_t>(Seconds(time_us) / tick_s_ + 1e-6);
  bus().Publish(
      Channel<image_t>{channels::ImageChannel(image.view.camera, channels::kCameraImage).c_str(), "sim"},
      image);
}

void SourceComponent::Arrive(Arrived arrived) {
  if (arrived_.size() >= kMaxWaiting) {
    overflowed_ = true;
    return;
  }
  if (std::exchange(overflowed_, false)) {
    arrived_.push_back({arrived.episode, std::nullopt, arrived.number, "scoring is slower than the source"});
  }
  arrived_.push_back(std::move(arrived));
}

void SourceComponent::ProcessArrived() {
  const auto pop = [this] {
    if (const auto& image = arrived_.front().image) waiting_image_bytes_ -= image->data.size();
    arrived_.pop_front();
  };
  for (; !arrived_.empty(); pop()) {
    Arrived& arrived = arrived_.front();
    if (arrived.episode <= finished_) continue;
    if (!running_) {
      running_.emplace(arrived.episode, tick_s_, Seconds(source_announcement_->period_us));
    }
    if (arrived.episode != running_->episode) {
      running_->is_over = true;
      return;
    }
    if (running_->is_over) continue;
    if (arrived.image) {
      ProcessImage(arrived);
      continue;
    }
    running_->lost += arrived.lost;
    running_->is_over = arrived.is_last;
    if (arrived.sample) {
      if (!arrived.beyond_range.empty() && running_->beyond_range++ == 0) {
        running_->first_beyond_range = arrived.beyond_range;
      }
      running_->ticks.Add(std::move(*arrived.sample), std::exchange(running_->after_refused, false),
                          arrived.lost > 0);
      continue;
    }
    running_->after_refused = true;
    const std::string fault = fmt::format("sample {}: {}", arrived.number, arrived.fault);
    if (running_->refused++ > 0) continue;
    running_->first_fault = fault;
    log().Warn("the episode is incomplete: {}", fault);
  }
}

bool SourceComponent::TimeIsUp() const {
  const int64_t now_us = running_->state->header.sim_time_us;
  return running_->success_us ? HasHeld(prepared_.info, *running_->success_us, now_us)
                              : now_us >= prepared_.info.time_limit_us;
}

void SourceComponent::EndInTime() {
  End(running_->success_us ? end_reason::kSuccess : end_reason::kTimeLimit);
}

bool SourceComponent::MayPublish() const {
  const Running& r = *running_;
  if (!r.state) return true;
  const int64_t tick = r.state->header.tick;
  const bool is_answered = r.is_scored() || (r.is_in_gap() && tick - r.behind_gap < kGapWindowTicks);
  return is_answered && readiness_.Lagging(tick).empty();
}

void SourceComponent::Advance() {
  while (phase_ == Phase::kRunning) {
    ProcessArrived();
    if (!running_) return;
    Running& r = *running_;
    if (r.state && TimeIsUp() && (r.is_scored() || r.is_in_gap())) return EndInTime();
    if (!MayPublish()) return;
    const bool was_sparse = r.ticks.sparse().pairs > 0;
    const auto tick = r.ticks.Next();
    if (!was_sparse && r.ticks.sparse().pairs > 0)
      log().Warn("{}; ticks between them are missing", r.SparseText());
    if (tick) {
      PublishState(*tick);
    } else if (!r.is_over) {
      return;
    } else if (r.state) {
      return End(end_reason::kEndOfData);
    } else {
      log().Warn("the source's episode has no usable sample: {}", r.Faults());
      finished_ = r.episode;
      running_.reset();
    }
  }
}

void SourceComponent::PublishState(const SampleTicks::Tick& tick) {
  Running& r = *running_;
  header_t header = begin_.header;
  header.tick = tick.number;
  header.sim_time_us = TimeOf(tick.number);
  if (tick.number > (r.state ? r.state->header.tick : -1) + 1) r.behind_gap = tick.number;
  r.state = scene_->At(*tick.before, *tick.behind, tick.share, r.state ? &*r.state : nullptr, header);
  r.contacts.header = header;
  r.contacts.contact = tick.before->contacts;
  r.contacts.num_contacts = static_cast<int32_t>(r.contacts.contact.size());
  r.contacts.clearance_robot_geom = r.contacts.clearance_scene_geom = -1;
  const auto now = steady_clock::now();
  unscored_ = Wait(now);
  unanswered_state_.MarkSent(now);
  Progress(header);
  SendState();
}

void SourceComponent::SendState() {
  if (has_contacts_) bus().Publish(channels::kMeasuredContacts, running_->contacts);
  bus().Publish(channels::kState, *running_->state);
}

void SourceComponent::OnPartial(const partial_metrics_t& partial) {
  if (phase_ != Phase::kRunning || !IsOurs(partial.header)) return;
  if (!running_ || !running_->state || partial.header.tick > running_->state->header.tick) {
    ++status_.foreign_messages;
    return;
  }
  Running& r = *running_;
  r.scored_tick = std::max(r.scored_tick, partial.header.tick);
  if (partial.verdict == partial_metrics_t::SUCCESS && !r.success_us)
    r.success_us = partial.header.sim_time_us;
  if (partial.verdict == partial_metrics_t::FAILURE) return End(end_reason::kFailure);
  Advance();
}

void SourceComponent::End(std::string reason, std::string detail, bool lacks_tick) {
  end_ = {};
  end_.header = running_ && running_->state ? running_->state->header : begin_.header;
  // KeepSuccess() may change the reason.
  const bool is_end_of_data = reason == end_reason::kEndOfData;
  if (running_) {
    if (running_->success_us) KeepSuccess(&reason, &detail);
    if (const std::string faults = running_->Faults(); !faults.empty()) {
      detail += (detail.empty() ? "" : "; ") + faults;
    }
    const bool is_broken = running_->after_refused || running_->ticks.is_broken();
    // The header names the last tick of the episode, so metrics counts the missing ticks before it.
    if (is_end_of_data) end_.header.tick = std::max(end_.header.tick, running_->ticks.next() - 1);
    if (lacks_tick || (is_end_of_data && is_broken)) ++end_.header.tick;
    end_.header.sim_time_us = TimeOf(end_.header.tick);
    finished_ = running_->episode;
    running_.reset();
  }
  phase_ = Phase::kIdle;
  end_.end_reason = reason;
  end_.detail = detail;
  if (detail.empty()) {
    log().Info("{}", EndText());
  } else {
    log().Warn("{}", EndText());
  }
  PublishEnd();
}

void SourceComponent::Poll(SteadyTime now) {
  EpisodeComponent::Poll(now);
  if (phase_ != Phase::kRunning) return;
  RepeatModel(now);
  CheckAnswerTimeouts(now);
}

void SourceComponent::CheckAnswerTimeouts(SteadyTime now) {
  const bool is_silent = silence_.Elapsed(now) > std::chrono::duration<double>(options_.source_timeout_s);
  const auto unscored = unscored_.Elapsed(now);
  if (!running_) return;
  Running& r = *running_;
  const bool has_all = !r.state || r.is_scored() || r.is_in_gap();
  if (is_silent && has_all && arrived_.empty() && !r.is_over) {
    r.is_over = true;
    if (r.state) {
      End(end_reason::kEndOfData,
          fmt::format("no message from the source for {:g} s", options_.source_timeout_s), true);
    } else {
      Advance();
    }
    return;
  }
  if (!r.state) return;
  const int64_t tick = r.state->header.tick;
  const std::string laggard = readiness_.Lagging(tick);
  if (has_all && laggard.empty()) return;
  const auto [lacking, from] = MissingScore(tick);
  if (!has_all && unanswered_state_.Due(now)) {
    log().Warn("no {} from {} for tick {}: resending STATE", lacking, from, tick);
    unanswered_state_.MarkSent(now);
    SendState();
  }
  if (unscored <= std::chrono::duration<double>(options_.metrics_timeout_s)) return;
  End(end_reason::kAborted, has_all ? fmt::format("{} does not keep up at tick {}", laggard, tick)
                                    : fmt::format("no {} for tick {} from {} within {:g} s", lacking, tick,
                                                  from, options_.metrics_timeout_s));
}

}  // namespace evalbus::sim
