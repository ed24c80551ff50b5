// Recorder options that `evalbus run` and `evalbus-recorder` share.
#pragma once

#include <filesystem>
#include <string>
#include <tuple>

#include "base/options.h"

namespace evalbus {

struct RecorderOptions {
  // See ParseLogForm.
  std::string log = "plain";

  // The run folder. Not stored in run.json.
  std::filesystem::path out;
};

template <class Options, class F>
requires std::is_same_v<std::remove_const_t<Options>, RecorderOptions>
void ForEachOption(Options& options, const F& f) {
  ForEachRow(
      std::tuple{
          Option{
              &RecorderOptions::log, "log",
              "plain, or zstd: logs in a third of the space, which all of evalbus reads; 'zstd -d' unpacks "
              "them\n"
              "for LCM's own tools"},
      },
      options, f);
}

}  // namespace evalbus
