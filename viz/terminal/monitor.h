// evalbus monitor: displays a run or replay. It publishes nothing, so it cannot delay the run.
#pragma once

#include "bus/attach.h"

namespace evalbus::viz {

// Shows a screen if stdout is a terminal, else prints lines. Returns the exit code after q, SIGINT or
// SIGTERM; when printing lines, also when the run has ended. Throws InputError, EnvironmentError.
int Monitor(const Address& address);

}  // namespace evalbus::viz
