// Recorder options that `evalbus run` and `evalbus-recorder` share.
#pragma once

#include <filesystem>
#include <string>
#include <tuple>

#include "base/options.h"

namespace evalbus {

struct RecorderOptions {
  // Form of the logs; see ParseLogForm().
  std::string log = "plain";

  // The run folder. It is not stored in run.json.
  std::filesystem::path out;
};

template <class Options, class F>
requires std::is_same_v<std::remove_const_t<Options>, RecorderOptions>
void ForEachOption(Options& options, const F& f) {
  ForEachRow(
      std::tuple{
          Option{&RecorderOptions::log, "log",
                 "format of the logs: plain, or zstd (a third of the size); all evalbus commands read both; "
                 "'zstd -d'\nunpacks a log for LCM's own tools"},
      },
      options, f);
}

}  // namespace evalbus
