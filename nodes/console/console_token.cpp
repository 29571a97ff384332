#include "nodes/console/console_token.hpp"

#include <cstddef>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

#include "calib/regular_file.hpp"
#include "nodes/console/console_access.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::size_t kShortestToken = 16;
constexpr const char* kTokenVariable = "AFTERGLOW_CONSOLE_TOKEN";

std::string firstLine(const std::string& path) {
  std::ifstream file = calib::openRegularFile(path);
  std::string line;
  if (!std::getline(file, line)) throw std::runtime_error(path + ": cannot be read, or is empty");
  return line;
}

}  // namespace

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

std::string consoleUrl(const std::string& address, std::uint16_t port) {
  const bool is_v6 = address.find(':') != std::string::npos;
  return "http://" + (is_v6 ? "[" + address + "]" : address) + ":" + std::to_string(port) + "/";
}

}  // namespace afterglow::nodes
