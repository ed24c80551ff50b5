// Values of model_info_t.source that evalbus defines. All other values are names of external sources.
#pragma once

namespace evalbus::source_name {

inline constexpr char kSim[] = "sim";
inline constexpr char kFile[] = "file";

}  // namespace evalbus::source_name
