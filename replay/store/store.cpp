#include "replay/store/store.hpp"

#include <algorithm>
#include <cstdlib>
#include <iterator>
#include <nlohmann/json.hpp>
#include <random>
#include <utility>

#include "replay/messages/foreign_json.hpp"

namespace afterglow::replay {
namespace {

constexpr const char* kScheme = "sqlite:";

/// How the URI of a server's store begins. A new kind of store is named here and opened by
/// openStore().
constexpr const char* kServerSchemes[] = {"mongodb://", "mongodb+srv://"};

std::string defaultUri() {
  if (const char* uri = std::getenv("AFTERGLOW_STORE"); uri && *uri) return uri;
  const char* home = std::getenv("HOME");
  if (!home || !*home) {
    throw StoreError(
        "no store: neither --store nor AFTERGLOW_STORE names one, and HOME is not set");
  }
  return std::string(home) + "/.local/share/afterglow/afterglow.db";
}

}  // namespace

bool isServerUri(const std::string& uri) {
  return std::any_of(std::begin(kServerSchemes), std::end(kServerSchemes),
                     [&](const std::string& scheme) { return uri.rfind(scheme, 0) == 0; });
}

std::string fullStoreUri(const std::string& uri) {
  const std::string named = uri.empty() ? defaultUri() : uri;
  if (named.rfind(kScheme, 0) == 0) {
    if (named == kScheme) throw StoreError("sqlite: names no file");
    return named;
  }
  if (isServerUri(named)) return named;
  if (const auto scheme_end = named.find("://"); scheme_end != std::string::npos) {
    throw StoreError(named + ": there is no store of the kind \"" + named.substr(0, scheme_end) +
                     "\"; a store is sqlite:PATH or mongodb://...");
  }
  return kScheme + named;
}

std::string storeUri(const std::string& uri) {
  std::string named = fullStoreUri(uri);
  if (!isServerUri(named)) return named;
  named = named.substr(0, named.find('?'));
  const auto host = named.find("://") + 3;
  const auto at = named.find('@');
  if (at < named.find('/', host)) named.erase(host, at + 1 - host);
  return named;
}

std::string storePath(const std::string& uri) {
  const std::string named = fullStoreUri(uri);
  if (isServerUri(named)) throw StoreError("a MongoDB server's store has no file");
  return named.substr(std::string(kScheme).size());
}

void checkObjects(const Behavior& behavior, const std::string& store) {
  for (const auto& [what, text] : {std::pair("parameters", &behavior.parameters),
                                   std::pair("calibration", &behavior.calibration),
                                   std::pair("snapshot", &behavior.snapshot)}) {
    if (!isShallowJson(*text)) {
      throw StoreError(store + ": " + what + " of behavior \"" + behavior.name +
                       "\": nested too deep");
    }
    if (!nlohmann::json::parse(*text, nullptr, false).is_object()) {
      throw StoreError(store + ": " + what + " of behavior \"" + behavior.name +
                       "\": no JSON object");
    }
  }
}

void endIncomplete(Behavior& behavior, std::optional<std::int64_t> last_message_ns) {
  const Stamp end = last_message_ns ? Stamp{*last_message_ns + 1} : behavior.begin;
  behavior.end = std::max(behavior.begin, end);
  behavior.outcome = kIncomplete;
  behavior.remarks.emplace_back("Its recorder died; it ends with the last message stored.");
}

std::string newKey() {
  constexpr const char* kDigits = "0123456789abcdef";
  std::random_device random;
  std::string key;
  for (int i = 0; i < 32; ++i) key += kDigits[random() % 16];
  return key;
}

}  // namespace afterglow::replay
