// Options of several commands: the names of files that a command writes, and which part of an episode a video
// shows, and how fast.
#pragma once

#include <CLI/CLI.hpp>
#include <string>

#include "viz/images/video_timing.h"

namespace evalbus::commands {

// Returns an error if the command would replace a file of a run, a suite or a plan, such as its
// episodes.jsonl or the log of an episode. Otherwise returns an empty string, as CLI::Option::check()
// expects.
std::string CheckOutputFile(const std::string& name);

// Adds --highlight, --speed and --trim. CheckVideoTiming checks their ranges. Parsing throws InputError if
// --trim is malformed.
void AddVideoTiming(CLI::App* app, viz::VideoTiming* timing);

}  // namespace evalbus::commands
