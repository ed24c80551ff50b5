// Equality of messages that identify a tick or an image.
#pragma once

#include "evalbus/header_t.hpp"
#include "evalbus/view_t.hpp"

namespace evalbus {

inline bool SameTick(const header_t& a, const header_t& b) {
  return a.episode == b.episode && a.attempt == b.attempt && a.tick == b.tick &&
         a.sim_time_us == b.sim_time_us;
}

inline bool SameView(const view_t& a, const view_t& b) {
  return a.camera == b.camera && a.width_px == b.width_px && a.height_px == b.height_px &&
         a.fovy_deg == b.fovy_deg && a.shadows == b.shadows && a.encoding == b.encoding;
}

}  // namespace evalbus
