#include "nodes/console/foxglove_server.hpp"

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>

#include "calib/number_text.hpp"
#include "nodes/console/foxglove_playback.hpp"
#include "replay/messages/text.hpp"
#include "replay/query/behavior_selector.hpp"

namespace afterglow::nodes {
namespace {

/// Returns the newest protocol of those that the client offers. Throws HttpError.
std::string protocolOf(const HttpRequest& request) {
  std::set<std::string_view> offered;
  const auto parts = replay::splitAt(',', request.header("sec-websocket-protocol"));
  for (const std::string& part : parts) offered.insert(replay::trimmed(part));
  for (const char* known : {kFoxgloveSdk, kFoxgloveWebSocket}) {
    if (offered.count(known) > 0) return known;
  }
  throw HttpError(
      400, std::string("a WebSocket here speaks ") + kFoxgloveSdk + " or " + kFoxgloveWebSocket);
}

double numberOf(const HttpRequest& request, const std::string& name, double otherwise) {
  const std::string& text = request.parameter(name);
  if (text.empty()) return otherwise;
  const auto number = calib::numberFromText(text);
  if (!number || !std::isfinite(*number) || std::abs(*number) > 1e9) {
    throw HttpError(400, name + " should be a number");
  }
  return *number;
}

}  // namespace

OpenedSocket FoxgloveServer::open(const HttpRequest& request,
                                  const std::shared_ptr<FrameQueue>& frames) const {
  if (const auto refused = access_.socketRefusal(request)) {
    throw HttpError(refused->status, nlohmann::json::parse(refused->body).value("error", ""));
  }
  const std::string protocol = protocolOf(request);
  return {protocol, serviceAt(request, protocol, frames)};
}

std::shared_ptr<SocketService> FoxgloveServer::serviceAt(
    const HttpRequest& request, const std::string& protocol,
    const std::shared_ptr<FrameQueue>& frames) const {
  const std::string folder = "/behavior/";
  const bool is_stored = replay::beginsWith(request.path, folder);
  if (!is_stored && request.path != "/") {
    throw HttpError(404, "a WebSocket's address is / or /behavior/ID");
  }
  if (!is_stored && live_) return live_(frames);
  const std::string wanted = is_stored ? request.path.substr(folder.size()) : "last";
  try {
    return std::make_shared<FoxglovePlayback>(
        store_, replay::selectBehavior(store_, wanted), frames,
        PlaybackStart{numberOf(request, "t", 0), numberOf(request, "rate", 1),
                      protocol == kFoxgloveSdk});
  } catch (const HttpError&) {
    throw;
  } catch (const replay::StoreError& error) {
    throw HttpError(404, error.what());
  } catch (const std::runtime_error& error) {
    throw HttpError(400, error.what());
  }
}

}  // namespace afterglow::nodes
