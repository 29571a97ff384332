#include "nodes/console/console_events.hpp"

#include <utility>
#include <vector>

namespace afterglow::nodes {
namespace {

/// Then a comment, by which a connection that is gone is noticed.
constexpr int kPeriodsOfSilence = 5;

}  // namespace

ConsoleEvents::ConsoleEvents(Sources sources)
    : sources_(std::move(sources)), total_(sources_.total()) {
  thread_.begin();
}

ConsoleEvents::~ConsoleEvents() {
  thread_.stop();
  std::map<std::uint64_t, Page> pages;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    pages.swap(pages_);
  }
  for (const auto& [number, page] : pages) page.stream->close();
}

HttpResponse ConsoleEvents::open(const std::string& session) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (pages_.size() >= kMostPages) throw HttpError(503, "too many pages listen");
  const std::uint64_t number = ++pages_ever_;
  auto stream = std::make_shared<EventStream>([this, number] { close(number); });
  pages_[number] = {session, stream};
  HttpResponse response{200, "text/event-stream", "retry: 500\n\n" + newest_};
  response.events = stream;
  return response;
}

bool ConsoleEvents::isListening(const std::string& session) const {
  if (session.empty()) return false;
  const std::lock_guard<std::mutex> lock(mutex_);
  for (const auto& [number, page] : pages_) {
    if (page.session == session) return true;
  }
  return false;
}

void ConsoleEvents::close(std::uint64_t page) {
  const std::lock_guard<std::mutex> lock(mutex_);
  pages_.erase(page);
}

/// A stream that is too slow closes itself, which needs the lock.
void ConsoleEvents::tell(const std::string& text) {
  std::vector<std::shared_ptr<EventStream>> streams;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    for (const auto& [number, page] : pages_) streams.push_back(page.stream);
  }
  for (const auto& stream : streams) stream->push(text);
}

void ConsoleEvents::look() {
  const std::string state = "event: state\ndata: " + sources_.state() + "\n\n";
  const std::size_t total = sources_.total();
  bool is_new = false;
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_new = state != newest_;
    newest_ = state;
  }
  if (is_new) tell(state);
  if (total != total_) {
    tell("event: behaviors\ndata: {\"total\":" + std::to_string(total) + "}\n\n");
  }
  total_ = total;
  silent_ = is_new ? 0 : silent_ + 1;
  if (silent_ % kPeriodsOfSilence == kPeriodsOfSilence - 1) tell(":\n\n");
}

}  // namespace afterglow::nodes
