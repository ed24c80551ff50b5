// Colors that have one meaning in all videos, based on the Okabe-Ito palette. viz/viewer/page/viewer.css
// defines the same colors for the page. An outcome is also shown by a check mark, a cross or a word.
#pragma once

#include "viz/images/canvas.h"

namespace evalbus::viz {

inline constexpr Color kSuccessColor{0, 0.62, 0.451}, kFailureColor{0.835, 0.369, 0};
// Color of success on a dark panel.
inline constexpr Color kSuccessOnDark{0.173, 0.761, 0.584};
inline constexpr Color kLeftArmColor{0, 0.447, 0.698}, kRightArmColor{0.816, 0.514, 0};

}  // namespace evalbus::viz
