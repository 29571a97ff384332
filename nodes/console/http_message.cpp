#include "nodes/console/http_message.hpp"

#include <algorithm>
#include <nlohmann/json.hpp>

namespace afterglow::nodes {
namespace {

const std::string kNone;

const std::string& valueIn(const std::map<std::string, std::string>& values,
                           const std::string& name) {
  const auto found = values.find(name);
  return found == values.end() ? kNone : found->second;
}

int hexDigit(char letter) {
  if (letter >= '0' && letter <= '9') return letter - '0';
  if (letter >= 'a' && letter <= 'f') return letter - 'a' + 10;
  if (letter >= 'A' && letter <= 'F') return letter - 'A' + 10;
  return -1;
}

enum class PlusSign { IsPlus, IsBlank };

std::string unescaped(const std::string& text, PlusSign plus) {
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '+' && plus == PlusSign::IsBlank) {
      result += ' ';
    } else if (text[i] == '%') {
      const int high = i + 2 < text.size() ? hexDigit(text[i + 1]) : -1;
      const int low = i + 2 < text.size() ? hexDigit(text[i + 2]) : -1;
      if (high < 0 || low < 0) throw HttpError(400, "the address has a % without two hex digits");
      result += static_cast<char>(high * 16 + low);
      i += 2;
    } else {
      result += text[i];
    }
    if (result.back() == '\0') throw HttpError(400, "the address has a NUL in it");
  }
  return result;
}

void readQuery(const std::string& text, HttpRequest& request) {
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find('&', begin), text.size());
    const std::string pair = text.substr(begin, end - begin);
    begin = end + 1;
    if (pair.empty()) continue;
    const std::size_t equals = std::min(pair.find('='), pair.size());
    const std::string value = equals < pair.size() ? pair.substr(equals + 1) : "";
    request.query[unescaped(pair.substr(0, equals), PlusSign::IsBlank)] =
        unescaped(value, PlusSign::IsBlank);
  }
}

}  // namespace

const std::string& HttpRequest::header(const std::string& name) const {
  return valueIn(headers, name);
}

const std::string& HttpRequest::parameter(const std::string& name) const {
  return valueIn(query, name);
}

HttpResponse errorResponse(int status, const std::string& text) {
  std::string line = text;
  for (char& letter : line) {
    if (letter == '\n' || letter == '\r') letter = ' ';
  }
  const nlohmann::json json = {{"error", line}};
  return {status, "application/json",
          json.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)};
}

void readTarget(const std::string& target, HttpRequest& request) {
  if (target.empty() || target[0] != '/') throw HttpError(400, "the address is no path");
  const std::size_t end = std::min(target.find('#'), target.size());
  const std::size_t mark = std::min(target.find('?'), end);
  request.path = unescaped(target.substr(0, mark), PlusSign::IsPlus);
  request.query.clear();
  if (mark < end) readQuery(target.substr(mark + 1, end - mark - 1), request);
}

}  // namespace afterglow::nodes
