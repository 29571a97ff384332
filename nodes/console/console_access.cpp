#include "nodes/console/console_access.hpp"

#include <arpa/inet.h>
#include <openssl/crypto.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <utility>

#include "calib/file_replacement.hpp"
#include "replay/messages/foreign_json.hpp"
#include "replay/query/nearest.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {
namespace {

constexpr const char* kCookie = "afterglow_token";
constexpr const char* kBearer = "Bearer ";

bool isAddress(const std::string& text) {
  std::array<unsigned char, sizeof(in6_addr)> bytes{};
  return inet_pton(AF_INET, text.c_str(), bytes.data()) == 1 ||
         inet_pton(AF_INET6, text.c_str(), bytes.data()) == 1;
}

/// Returns the host without port and brackets, in small letters.
std::string nameOf(const std::string& host) {
  std::string name = replay::lowerCase(host);
  if (!name.empty() && name[0] == '[') {
    const std::size_t end = name.find(']');
    return end == std::string::npos ? "" : name.substr(1, end - 1);
  }
  name = name.substr(0, name.find(':'));
  if (!name.empty() && name.back() == '.') name.pop_back();
  return name;
}

std::string ownName() {
  std::array<char, 256> name{};
  return gethostname(name.data(), name.size() - 1) == 0 ? replay::lowerCase(name.data()) : "";
}

/// The value of our cookie among "a=1; afterglow_token=T".
std::string cookieIn(const std::string& cookies) {
  const std::string wanted = std::string(kCookie) + "=";
  for (std::size_t begin = 0; begin < cookies.size();) {
    const std::size_t end = std::min(cookies.find(';', begin), cookies.size());
    begin = std::min(cookies.find_first_not_of(' ', begin), end);
    if (cookies.compare(begin, wanted.size(), wanted) == 0) {
      return cookies.substr(begin + wanted.size(), end - begin - wanted.size());
    }
    begin = end + 1;
  }
  return "";
}

/// Returns true for a page of this very server; the scheme is whatever a proxy before it speaks.
bool isOwnOrigin(const HttpRequest& request) {
  const std::string origin = replay::lowerCase(request.header("origin"));
  const std::string host = replay::lowerCase(request.header("host"));
  return origin.empty() || origin == "http://" + host || origin == "https://" + host;
}

bool isJson(const std::string& type) {
  return replay::lowerCase(type.substr(0, type.find(';'))) == "application/json";
}

HttpResponse unknownHost() {
  return errorResponse(403, "this server is not called that; --host NAME allows a name");
}

HttpResponse unknownToken() { return errorResponse(401, "the token is missing or wrong"); }

constexpr std::size_t kShortestToken = 16;
constexpr const char* kTokenVariable = "AFTERGLOW_CONSOLE_TOKEN";

std::string firstLine(const std::string& path) {
  std::ifstream file = calib::openRegularFile(path);
  std::string line;
  if (!std::getline(file, line)) throw std::runtime_error(path + ": cannot be read, or is empty");
  return line;
}

}  // namespace

bool isLoopback(const std::string& address) {
  return address == "::1" || (isAddress(address) && address.rfind("127.", 0) == 0);
}

std::string consoleToken(const std::string& address, const std::string& token_file) {
  const char* variable = std::getenv(kTokenVariable);
  const std::string given = !token_file.empty() ? firstLine(token_file) : variable ? variable : "";
  if (given.empty()) return isLoopback(address) ? "" : replay::newKey();
  for (const char letter : given) {
    const bool is_plain = letter > ' ' && letter < 0x7F && letter != ';' && letter != ',';
    if (!is_plain) throw std::runtime_error("the token should be plain letters and digits");
  }
  if (given.size() >= kShortestToken) return given;
  throw std::runtime_error("the token should have at least " + std::to_string(kShortestToken) +
                           " letters");
}

ConsoleAccess::ConsoleAccess(std::string token, std::vector<std::string> hosts,
                             std::vector<std::string> origins)
    : token_(std::move(token)), hosts_(std::move(hosts)), origins_(std::move(origins)) {
  for (std::string& host : hosts_) host = replay::lowerCase(host);
  for (std::string& origin : origins_) origin = replay::lowerCase(origin);
  origins_.emplace_back("file://");
  hosts_.emplace_back("localhost");
  const std::string name = ownName();
  if (!name.empty()) hosts_.insert(hosts_.end(), {name, name + ".local"});
}

bool ConsoleAccess::isKnownHost(const std::string& host) const {
  const std::string name = nameOf(host);
  return isAddress(name) || std::count(hosts_.begin(), hosts_.end(), name) > 0;
}

bool ConsoleAccess::isToken(const std::string& text) const {
  return text.size() == token_.size() &&
         CRYPTO_memcmp(text.data(), token_.data(), token_.size()) == 0;
}

bool ConsoleAccess::hasTokenHeader(const HttpRequest& request) const {
  const std::string& bearer = request.header("authorization");
  return bearer.rfind(kBearer, 0) == 0 && isToken(bearer.substr(std::strlen(kBearer)));
}

std::optional<HttpResponse> ConsoleAccess::refusal(const HttpRequest& request) const {
  if (!isKnownHost(request.header("host"))) return unknownHost();
  if (request.method != "GET" && request.method != "POST") {
    return errorResponse(405, "only GET and POST are understood");
  }
  if (request.method == "POST") {
    if (!isOwnOrigin(request)) return errorResponse(403, "the request comes from another site");
    if (!isJson(request.header("content-type"))) {
      return errorResponse(415, "Content-Type has to be application/json");
    }
  }
  const bool is_open = request.path.rfind("/api/", 0) != 0 || request.path == "/api/login";
  if (token_.empty() || is_open || hasTokenHeader(request)) return std::nullopt;
  if (isToken(cookieIn(request.header("cookie")))) return std::nullopt;
  return unknownToken();
}

std::optional<HttpResponse> ConsoleAccess::socketRefusal(const HttpRequest& request) const {
  if (!isKnownHost(request.header("host"))) return unknownHost();
  const bool knows_token = hasTokenHeader(request) || isToken(request.parameter("token"));
  if (!token_.empty() && knows_token) return std::nullopt;
  const std::string origin = replay::lowerCase(request.header("origin"));
  if (!isOwnOrigin(request) && std::count(origins_.begin(), origins_.end(), origin) == 0) {
    return errorResponse(
        403, "pages of " + origin + " may not read here; --origin " + origin + " allows it");
  }
  if (token_.empty() || isToken(cookieIn(request.header("cookie")))) return std::nullopt;
  return unknownToken();
}

HttpResponse ConsoleAccess::login(const HttpRequest& request) const {
  const auto json = replay::parseForeignJson<nlohmann::json>(request.body);
  const auto token = json.is_object() ? json.find("token") : json.end();
  if (!json.is_object() || token == json.end() || !token->is_string()) {
    return errorResponse(400, "the body should be {\"token\": \"...\"}");
  }
  if (!token_.empty() && !isToken(*token)) return errorResponse(401, "the token is wrong");
  HttpResponse response{200, "application/json", "{}"};
  if (!token_.empty()) {
    response.headers.emplace_back("Set-Cookie", std::string(kCookie) + "=" + token_ +
                                                    "; HttpOnly; SameSite=Strict; Path=/");
  }
  return response;
}

}  // namespace afterglow::nodes
