// evalbus monitor: watches a run or a replay. Only listens: nothing is published, so nobody can wait for it.
#pragma once

#include "bus/attach.h"

namespace evalbus::viz {

// A screen where stdout is a terminal, else lines; until q, SIGINT or SIGTERM, lines also until the run is
// over. Returns the exit code. Throws InputError, EnvironmentError.
int Monitor(const Address& address);

}  // namespace evalbus::viz
