#include "nodes/console/http_message.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <utility>

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

// -------------------------------------------------------------------------------------------- body

nlohmann::json bodyOf(const HttpRequest& request) {
  const auto body = nlohmann::json::parse(request.body, nullptr, false);
  if (!body.is_object()) throw HttpError(400, "the body is no JSON object");
  return body;
}

std::string textIn(const nlohmann::json& asked, const char* name) {
  const auto found = asked.find(name);
  if (found == asked.end() || found->is_null()) return "";
  if (!found->is_string()) throw HttpError(400, std::string(name) + " should be a text");
  return found->get<std::string>();
}

bool flagIn(const nlohmann::json& asked, const char* name) {
  const auto found = asked.find(name);
  if (found == asked.end()) return false;
  if (!found->is_boolean()) throw HttpError(400, std::string(name) + " is true or false");
  return found->get<bool>();
}

double numberIn(const nlohmann::json& asked, const char* name, std::optional<double> otherwise) {
  const auto found = asked.find(name);
  if (otherwise && (found == asked.end() || found->is_null())) return *otherwise;
  const double value = found != asked.end() && found->is_number() ? found->get<double>() : NAN;
  if (!std::isfinite(value)) throw HttpError(400, std::string(name) + " should be a number");
  return value;
}

// ------------------------------------------------------------------------------------------ events

void EventStream::push(const std::string& text) {
  bool is_too_slow = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (is_closed_) return;
    is_too_slow = waiting_.size() + text.size() > kMostWaiting;
    if (!is_too_slow) waiting_ += text;
  }
  is_too_slow ? close() : wake();
}

void EventStream::close() {
  std::function<void()> on_gone;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (is_closed_) return;
    is_closed_ = true;
    waiting_.clear();
    on_gone = std::exchange(on_gone_, nullptr);
  }
  wake();
  if (on_gone) on_gone();
}

bool EventStream::isClosed() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return is_closed_;
}

void EventStream::attach(std::function<void()> wake) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    wake_ = std::move(wake);
  }
  this->wake();
}

std::string EventStream::take() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return std::exchange(waiting_, {});
}

void EventStream::wake() {
  std::function<void()> wake;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    wake = wake_;
    if (is_closed_) wake_ = nullptr;  // which holds the connection
  }
  if (wake) wake();
}

void FrameQueue::push(SocketFrame frame) {
  bool is_too_slow = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (is_closed_) return;
    is_too_slow = kept_bytes_ > 0 && kept_bytes_ + frame.bytes.size() > kMostKept;
    if (!is_too_slow) {
      kept_bytes_ += frame.bytes.size();
      waiting_.push_back({std::move(frame), false});
    }
  }
  is_too_slow ? close() : wake();
}

std::size_t FrameQueue::pushLive(std::string bytes) {
  std::size_t dropped = 0;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (is_closed_) return 0;
    auto oldest = waiting_.begin();
    while (live_bytes_ > 0 && live_bytes_ + bytes.size() > kMostLive) {
      oldest =
          std::find_if(oldest, waiting_.end(), [](const auto& frame) { return frame.is_live; });
      live_bytes_ -= oldest->frame.bytes.size();
      oldest = waiting_.erase(oldest);
      ++dropped;
    }
    live_bytes_ += bytes.size();
    waiting_.push_back({{false, std::move(bytes)}, true});
  }
  wake();
  return dropped;
}

bool FrameQueue::hasRoom() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return kept_bytes_ < kMostAhead;
}

void FrameQueue::close() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (is_closed_) return;
    is_closed_ = true;
    waiting_.clear();
    kept_bytes_ = live_bytes_ = 0;
  }
  wake();
}

bool FrameQueue::isClosed() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return is_closed_;
}

void FrameQueue::attach(std::function<void()> wake) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    wake_ = std::move(wake);
  }
  this->wake();
}

std::optional<SocketFrame> FrameQueue::take() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (waiting_.empty()) return std::nullopt;
  Waiting oldest = std::move(waiting_.front());
  waiting_.pop_front();
  (oldest.is_live ? live_bytes_ : kept_bytes_) -= oldest.frame.bytes.size();
  return std::move(oldest.frame);
}

void FrameQueue::wake() {
  std::function<void()> wake;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    wake = wake_;
  }
  if (wake) wake();
}

}  // namespace afterglow::nodes
