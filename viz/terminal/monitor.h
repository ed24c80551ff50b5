// evalbus monitor: displays a run or replay. It publishes nothing, so it cannot delay the run.
#pragma once

#include "bus/attach.h"

namespace evalbus::viz {

// Shows a screen if stdout is a terminal; otherwise prints lines. Ends after q, SIGINT or SIGTERM or, if it
// prints lines, when the run has ended or is silent, or when stdout is closed. Returns the exit code.
// Throws InputError and EnvironmentError.
int Monitor(const Address& address);

}  // namespace evalbus::viz
