// Version and commit, set at build time (cmake/version.cmake).
#pragma once

namespace evalbus {

extern const char* const kVersion;
// kGitCommit: commit of the source; "unknown" outside a git checkout. kGitDirty: true if there were
// uncommitted changes.
extern const char* const kGitCommit;
extern const bool kGitDirty;

}  // namespace evalbus
