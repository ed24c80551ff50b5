// A run as its subscribers receive it. Scripted messages of the small world go to a RunWatch.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "bus/channels.h"
#include "bus/message.h"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_end_t.hpp"
#include "tests/unit/small_world.h"
#include "viz/watch/run_watch.h"

namespace evalbus::viz {

using namespace small_world;

class ScriptedRun {
 public:
  template <class Message>
  void Publish(const Channel<Message>& channel, const Message& message) {
    watch_.Receive(channel.name, Encode(message), now_);
  }
  void PublishLog(int8_t level, const std::string& text) {
    log_t line{};
    line.header = Header(127, 2);
    line.component = "sim";
    line.level = level;
    line.text = text;
    Publish(channels::kLog, line);
  }
  void PublishModel() {
    model_info_t model = small_world::Model();
    model.variation = "position";
    model.robot = "two_arms";
    model.clock = "realtime";
    model.run_id = "a_run";
    model.time_limit_us = 5'000'000;
    Publish(channels::kModel, model);
  }
  void PublishBegin(int episode, int attempt = 0) {
    episode_begin_t begin{};
    begin.header = Header(0, episode);
    begin.header.attempt = attempt;
    begin.seed = 77;
    Publish(channels::kEpisodeBegin, begin);
  }
  void PublishStatus(const std::string& name, int episode, int64_t tick,
                     int8_t state = component_status_t::READY) {
    component_status_t status{};
    status.component = name;
    status.state = state;
    status.episode = episode;
    status.last_tick = tick;
    Publish(channels::kStatus, status);
  }
  static metric_values_t Metrics() {
    metric_values_t m{};
    m.tracks_vel_sync = m.tracks_vertical_sync = m.tracks_slippage = m.tracks_collisions = 1;
    m.tracks_cartesian_jerk = m.tracks_joint_jerk = m.tracks_cartesian_path_length = 1;
    m.tracks_joint_path_length = m.tracks_orientation_path_length = 1;
    m.completion_time_s = 2.5;
    m.stage_index = {1, 2};
    m.stage_name = {"held", "lifted"};
    m.stage_reached = {1, 0};
    m.num_stages = 2;
    m.subtask_progress = 0.5;
    m.target_distance_name = {"lift", "left_gripper_to_pot"};
    m.target_distance_m = {0.1234, 0.25};
    m.num_target_distances = 2;
    m.pose_error_name = {""};
    m.object_pose_error_rad = {0.031};
    m.num_pose_errors = 1;
    m.slip_count = 3;
    m.object_name = {"pot"};
    m.slip_count_per_object = {3};
    m.num_objects = 1;
    m.env_collision_count = 2;
    m.bimanual_arm_velocity_difference_radps = 0.5;
    m.bimanual_gripper_vertical_difference_m = 0.0121;
    m.arm_name = {"left", "right"};
    m.num_arms = 2;
    m.cartesian_path_length_m = {1.25, 0.75};
    m.joint_path_length_rad = {10.5, 4};
    m.orientation_path_length_rad = {2, 1};
    m.avg_cartesian_jerk_mps3 = {100.5, 80};
    m.rms_cartesian_jerk_mps3 = {150, 90};
    m.avg_joint_jerk_radps3 = {1000, 12345};
    m.rms_joint_jerk_radps3 = {2000, 123456};
    m.overall_avg_cartesian_jerk_mps3 = 90.25;
    m.overall_rms_cartesian_jerk_mps3 = 125;
    m.overall_avg_joint_jerk_radps3 = 6000;
    m.overall_rms_joint_jerk_radps3 = 70000;
    return m;
  }
  static extended_metrics_t Extended() {
    extended_metrics_t e{};
    const auto add = [&e](const std::string& name, const std::string& unit, double value) {
      e.name.push_back(name);
      e.unit.push_back(unit);
      e.value_mixed.push_back(value);
      ++e.num_values;
    };
    add("min_clearance_m", "m", 0.012);
    add("min_clearance_time_s", "s", 0.84);
    add("peak_penetration_m", "m", 0.0004);
    add("contact_time_s", "s", 0.06);
    add("mechanical_work_J.left", "J", 5);
    add("mechanical_work_J.right", "J", 2.5);
    add("peak_wrist_speed_mps.left", "m/s", 0.31);
    add("peak_wrist_speed_mps.right", "m/s", 0.3);
    add("min_joint_limit_margin_rad", "rad", 0.2);
    e.stage_time_s = {0.52, -1};
    e.num_stages = 2;
    e.deadline_misses = 4;
    return e;
  }
  // Publishes all messages of one tick.
  void PublishTick(int episode, int64_t tick, bool with_clearance = false) {
    Publish(channels::kState, State(tick, episode));
    contacts_t contacts = Contacts(tick, {{kLeftPad, kLidGeom}, {kTop, kWall}}, episode);
    contacts.contact[0].distance_m = -0.0003;
    contacts.contact[1].distance_m = -0.0002;
    contacts.has_clearance = with_clearance;
    contacts.clearance_m = with_clearance ? 0.041 : 0;
    contacts.clearance_robot_geom = with_clearance ? int{kRightLink} : -1;
    contacts.clearance_scene_geom = with_clearance ? int{kTop} : -1;
    Publish(channels::kContacts, contacts);
    partial_metrics_t partial{};
    partial.header = Header(tick, episode);
    partial.metrics = Metrics();
    partial.extended = Extended();
    Publish(channels::kPartial, partial);
  }
  void PublishSummary(int episode, const std::string& reason) {
    episode_end_t end{};
    end.header = Header(75, episode);
    end.end_reason = reason;
    Publish(channels::kEpisodeEnd, end);
    episode_summary_t summary{};
    summary.header = end.header;
    summary.end_reason = reason;
    summary.failure_reason = reason == "time_limit" ? "grasp_slip" : reason == "success" ? "" : "dropped";
    summary.complete = 1;
    summary.metrics = Metrics();
    summary.extended = Extended();
    Publish(channels::kEpisodeSummary, summary);
    run_summary_t run{};
    run.num_episodes = run.num_complete = episode + 1;
    run.num_success = 1;
    run.success_rate = 1.0 / (episode + 1);
    run.success_rate_anytime_lower = 0.0945;
    run.success_rate_anytime_upper = 0.9055;
    Publish(channels::kRunSummary, run);
  }
  // Publishes 2.5 simulated seconds of episode 2 at 50 Hz in real time, after two other episodes.
  void Play() {
    PublishModel();
    for (const int episode : {0, 1}) {
      PublishBegin(episode);
      PublishTick(episode, 0);
      PublishSummary(episode, episode == 0 ? "success" : "time_limit");
    }
    now_ += std::chrono::milliseconds(1000);
    PublishBegin(2);
    for (int64_t tick = 0; tick <= 125; ++tick) {
      PublishTick(2, tick, tick % 5 == 0);
      if (tick % 20 == 0) {
        for (const char* name : {"collision", "metrics", "policy", "recorder", "run"})
          PublishStatus(name, 2, tick);
        PublishStatus("recorder", 2, std::max<int64_t>(0, tick - 12));
        PublishStatus("sim", 2, tick);
      }
      now_ += std::chrono::milliseconds(20);
    }
    PublishTick(2, 126);  // not every tick has a clearance
  }

  SteadyTime now_{std::chrono::hours(1)};
  RunWatch watch_{10};
};

}  // namespace evalbus::viz
