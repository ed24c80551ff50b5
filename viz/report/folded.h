// Figures of which not all are seen at once.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "viz/report/markup.h"

namespace evalbus::viz {

// The first `shown` of them at once, in an element of this class, the others on demand, called `what`.
void Folded(const std::vector<std::function<void()>>& figures, size_t shown, const std::string& what,
            const char* css_class, Markup* html);

}  // namespace evalbus::viz
