// What a difference between a run and its baseline comes to.
#pragma once

namespace evalbus::viz {

// kDiffers: there is a difference, and nothing says which side is the better one.
enum class Judgement { kNone, kBetter, kWorse, kDiffers };

// For people; empty for none.
inline const char* Word(Judgement judgement) {
  switch (judgement) {
    case Judgement::kBetter:
      return "better";
    case Judgement::kWorse:
      return "worse";
    case Judgement::kDiffers:
      return "differs";
    case Judgement::kNone:
      break;
  }
  return "";
}

}  // namespace evalbus::viz
