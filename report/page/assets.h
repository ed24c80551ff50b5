// Style and script of a report: report.css and report.js, embedded as text by CMake.
#pragma once

namespace evalbus::report {

extern const char* const kReportCss;
extern const char* const kReportJs;

}  // namespace evalbus::report
