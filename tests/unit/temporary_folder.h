// A folder that is removed at the end of the test.
#pragma once

#include "base/scratch.h"

namespace evalbus {

using TemporaryFolder = Scratch;

}  // namespace evalbus
