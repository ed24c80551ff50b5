// Version and commit, set at build time (cmake/version.cmake).
#pragma once

namespace evalbus {

extern const char* const kVersion;
// Commit of the source, "unknown" outside a git checkout; dirty: with uncommitted changes.
extern const char* const kGitCommit;
extern const bool kGitDirty;

}  // namespace evalbus
