// A list of figures that is partly folded at first.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "report/page/markup.h"

namespace evalbus::report {

// Shows the first `shown` figures in an element of class css_class. The others are in an expandable element
// with the label `what`; if there are at most two others, all are shown.
void Folded(const std::vector<std::function<void()>>& figures, size_t shown, const std::string& what,
            const char* css_class, Markup* html);

}  // namespace evalbus::report
