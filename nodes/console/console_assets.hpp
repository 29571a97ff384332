/// \file
/// The files of the console's page, embedded from assets/console.
#pragma once

#include <optional>
#include <string>

#include "nodes/console/http_message.hpp"

namespace afterglow::nodes {

struct EmbeddedConsole {
  const char* name;  ///< nullptr ends the list
  const char* text;
};
extern const EmbeddedConsole kEmbeddedConsole[];

/// "/" is index.html, "/console/NAME" one of the others; nothing: there is no such file. A browser
/// that names the ETag of what it has is told 304.
std::optional<HttpResponse> consoleAsset(const HttpRequest& request);

}  // namespace afterglow::nodes
