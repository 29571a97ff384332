/// \file
/// What `afterglow console` and console_node share at their start.
#pragma once

#include <cstdint>
#include <string>

namespace afterglow::nodes {

/// A file's first line, else $AFTERGLOW_CONSOLE_TOKEN, else, beyond loopback, one that is made.
/// Empty: none is needed. Throws std::runtime_error, one line, for one that is too short or has
/// what headers cannot hold.
std::string consoleToken(const std::string& address, const std::string& token_file);

/// "http://127.0.0.1:8080/"
std::string consoleUrl(const std::string& address, std::uint16_t port);

}  // namespace afterglow::nodes
