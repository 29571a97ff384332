#include "nodes/console/console_assets.hpp"

#include <fmt/format.h>

#include <functional>
#include <string_view>

namespace afterglow::nodes {
namespace {

std::string typeOf(const std::string& name) {
  const std::string ending = name.substr(name.rfind('.') + 1);
  if (ending == "html") return "text/html; charset=utf-8";
  if (ending == "js") return "text/javascript; charset=utf-8";
  if (ending == "css") return "text/css; charset=utf-8";
  if (ending == "svg") return "image/svg+xml";
  return "text/plain; charset=utf-8";
}

}  // namespace

std::optional<HttpResponse> consoleAsset(const HttpRequest& request) {
  const std::string folder = "/console/";
  const bool is_in_folder = request.path.rfind(folder, 0) == 0;
  if (request.method != "GET" || (!is_in_folder && request.path != "/")) return std::nullopt;
  const std::string name = is_in_folder ? request.path.substr(folder.size()) : "index.html";
  for (const EmbeddedConsole* file = kEmbeddedConsole; file->name; ++file) {
    if (name != file->name) continue;
    const std::string tag = fmt::format("\"{:x}\"", std::hash<std::string_view>()(file->text));
    HttpResponse response{200, typeOf(name), file->text, {{"ETag", tag}}};
    response.headers.emplace_back("Cache-Control", "no-cache");
    if (request.header("if-none-match") != tag) return response;
    response.status = 304;
    response.body.clear();
    return response;
  }
  return std::nullopt;
}

}  // namespace afterglow::nodes
