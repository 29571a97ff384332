/// \file
/// How the report looks.
#pragma once

namespace afterglow::calib {

/// CSS. No fonts or pictures of its own: the page is one file and opens without a network.
extern const char* const kReportStyle;

}  // namespace afterglow::calib
