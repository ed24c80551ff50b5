// Options of commands that make videos. They determine which part of an episode is shown, and how fast.
#pragma once

#include <CLI/CLI.hpp>

#include "viz/images/video_timing.h"

namespace evalbus::commands {

// Adds --highlight, --speed and --trim. CheckVideoTiming checks their ranges. Parsing throws InputError if
// --trim is malformed.
void AddVideoTiming(CLI::App* app, viz::VideoTiming* timing);

}  // namespace evalbus::commands
