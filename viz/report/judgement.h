// What a difference between a run and its baseline comes to.
#pragma once

namespace evalbus {

// kDiffers: there is a difference, and nothing says which side is the better one.
enum class Judgement { kNone, kBetter, kWorse, kDiffers };

}  // namespace evalbus
