// Every message type, for tests of what holds for all of them (Fingerprints.CoverEveryTypeFile: none is
// missing).
#pragma once

#include "evalbus/action_t.hpp"
#include "evalbus/arm_info_t.hpp"
#include "evalbus/arm_state_t.hpp"
#include "evalbus/command_t.hpp"
#include "evalbus/component_status_t.hpp"
#include "evalbus/condition_t.hpp"
#include "evalbus/contact_t.hpp"
#include "evalbus/contacts_t.hpp"
#include "evalbus/episode_begin_t.hpp"
#include "evalbus/episode_end_t.hpp"
#include "evalbus/episode_summary_t.hpp"
#include "evalbus/explanation_t.hpp"
#include "evalbus/extended_metrics_t.hpp"
#include "evalbus/gripper_info_t.hpp"
#include "evalbus/gripper_state_t.hpp"
#include "evalbus/header_t.hpp"
#include "evalbus/image_t.hpp"
#include "evalbus/metric_values_t.hpp"
#include "evalbus/model_info_t.hpp"
#include "evalbus/object_event_t.hpp"
#include "evalbus/observation_t.hpp"
#include "evalbus/partial_metrics_t.hpp"
#include "evalbus/run_summary_t.hpp"
#include "evalbus/state_t.hpp"

namespace evalbus {

// Calls function with an empty message of each type.
template <class Function>
void ForEachMessage(const Function& function) {
  function(action_t{});
  function(arm_info_t{});
  function(arm_state_t{});
  function(command_t{});
  function(component_status_t{});
  function(condition_t{});
  function(contact_t{});
  function(contacts_t{});
  function(episode_begin_t{});
  function(episode_end_t{});
  function(episode_summary_t{});
  function(explanation_t{});
  function(extended_metrics_t{});
  function(gripper_info_t{});
  function(gripper_state_t{});
  function(header_t{});
  function(image_t{});
  function(metric_values_t{});
  function(model_info_t{});
  function(object_event_t{});
  function(observation_t{});
  function(partial_metrics_t{});
  function(run_summary_t{});
  function(state_t{});
}

}  // namespace evalbus
