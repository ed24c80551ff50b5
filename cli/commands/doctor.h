// evalbus doctor: what this machine offers, and how to mend what it lacks.
#pragma once

namespace evalbus::commands {

// Prints one line per check. Returns 0 if runs with separate processes work, else 2.
int Doctor();

}  // namespace evalbus::commands
