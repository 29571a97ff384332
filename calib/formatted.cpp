#include "calib/formatted.hpp"

#include <cstdarg>
#include <cstdio>

namespace afterglow::calib {

std::string formatted(const char* format, ...) {
  char buffer[512];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(buffer, sizeof buffer, format, arguments);
  va_end(arguments);
  return buffer;
}

}  // namespace afterglow::calib
