#include "replay/store/store.hpp"

#include <pwd.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <random>
#include <string_view>
#include <utility>

#include "replay/messages/foreign_json.hpp"

namespace afterglow::replay {
namespace {

constexpr const char* kScheme = "sqlite:";

/// The begin of a URI of a server's store. A new kind of store is named here and opened by
/// openStore().
constexpr const char* kServerSchemes[] = {"mongodb://", "mongodb+srv://"};

constexpr std::size_t kLongestUri = 4096;

std::string defaultUri() {
  if (const char* uri = std::getenv("AFTERGLOW_STORE"); uri && *uri) return uri;
  const std::string home = homeFolder();
  if (home.empty()) {
    throw StoreError(
        "no store: neither --store nor AFTERGLOW_STORE names one, and this account has no HOME");
  }
  return home + "/.local/share/afterglow/afterglow.db";
}

/// Returns the user of a URI's authority, "USER:PASSWORD@" with the @; empty without one. A
/// password may hold an
/// @ or a slash, though they should be written %40 and %2F: no part of it must be shown.
std::string_view userOf(std::string_view uri) {
  const auto scheme = uri.find("://");
  if (scheme == uri.npos) return {};
  const std::string_view rest = uri.substr(scheme + 3);
  const auto end = std::min(rest.find_first_of("/?"), rest.size());
  const auto colon = rest.find(':');
  const bool has_port = colon + 1 < end && std::isdigit(static_cast<unsigned char>(rest[colon + 1]));
  auto at = rest.substr(0, end).rfind('@');
  if (at == rest.npos && colon < end && !has_port) at = rest.rfind('@');
  return at == rest.npos ? std::string_view() : rest.substr(0, at + 1);
}

std::string withoutUser(std::string uri) {
  if (const auto user = userOf(uri).size(); user > 0) uri.erase(uri.find("://") + 3, user);
  return uri;
}

std::string withoutOptions(const std::string& uri) { return uri.substr(0, uri.find('?')); }

/// "@FILE": its first line.
std::string readIfFile(const std::string& uri) {
  if (uri.empty() || uri.front() != '@') return uri;
  std::error_code error;
  // A pipe would be waited for.
  const bool is_file = std::filesystem::is_regular_file(uri.substr(1), error);
  std::ifstream file(is_file ? uri.substr(1) : "");
  std::string line(kLongestUri, '\0');
  file.read(line.data(), static_cast<std::streamsize>(line.size()));
  line.resize(static_cast<std::size_t>(file.gcount()));
  line.erase(std::min(line.find('\n'), line.size()));
  if (!is_file || file.bad() || file.gcount() == 0) {
    throw StoreError("no store: the file " + uri.substr(1) + " that is to name it cannot be read");
  }
  line.erase(line.find_last_not_of(" \t\r") + 1);
  // It may be any file: what stands in it is nobody's to print, nor to make a file of.
  const bool is_store = line.rfind(kScheme, 0) == 0 || line.rfind('/', 0) == 0 || isServerUri(line);
  if (!is_store) {
    throw StoreError("no store: the first line of " + uri.substr(1) +
                     " is none; it has to be sqlite:PATH, a path that begins with /, or "
                     "mongodb://...");
  }
  return line;
}

}  // namespace

std::optional<double> TopicSummary::rate_hz() const {
  if (count < 2 || last <= first) return std::nullopt;
  return static_cast<double>(count - 1) * 1e9 / static_cast<double>(last.ns - first.ns);
}

/// A program that systemd starts has no HOME.
std::string homeFolder() {
  if (const char* home = std::getenv("HOME"); home && *home) return home;
  std::array<char, 4096> text{};
  passwd account{};
  passwd* found = nullptr;
  const bool is_known = getpwuid_r(geteuid(), &account, text.data(), text.size(), &found) == 0;
  return is_known && found && account.pw_dir ? account.pw_dir : "";
}

void refusePassword(const std::string& where, const std::string& uri) {
  if (userOf(uri).find(':') == std::string_view::npos) return;
  throw StoreError(where + " holds a password, which everybody on the network can read there; give "
                   "@FILE, a file whose first line is the URI, or $AFTERGLOW_STORE");
}

bool isServerUri(const std::string& uri) {
  return std::any_of(std::begin(kServerSchemes), std::end(kServerSchemes),
                     [&](const std::string& scheme) { return uri.rfind(scheme, 0) == 0; });
}

std::string fullStoreUri(const std::string& uri) {
  const std::string named = readIfFile(uri.empty() ? defaultUri() : uri);
  if (named.rfind(kScheme, 0) == 0) {
    if (named == kScheme) throw StoreError("sqlite: names no file");
    return named;
  }
  if (isServerUri(named)) return named;
  if (const auto scheme_end = named.find("://"); scheme_end != std::string::npos) {
    throw StoreError(withoutUser(named) + ": there is no store of the kind \"" + named.substr(0, scheme_end) +
                     "\"; a store is sqlite:PATH or mongodb://...");
  }
  return kScheme + named;
}

std::string storeUri(const std::string& uri) {
  std::string named = fullStoreUri(uri);
  if (!isServerUri(named)) return named;
  return withoutOptions(withoutUser(named));
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
