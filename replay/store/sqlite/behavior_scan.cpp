#include "replay/store/sqlite/behavior_scan.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <atomic>
#include <future>
#include <memory>
#include <thread>
#include <utility>

#include "replay/store/sqlite/sqlite_cursor.hpp"
#include "replay/store/sqlite/sqlite_schema.hpp"

namespace afterglow::replay {
namespace {

constexpr std::size_t kMostThreads = 8;
/// The behaviors that are looked at with a limit before it is known whether more are needed.
constexpr std::size_t kRound = 64;

/// Says of behaviors whether they match; of one thread.
class BehaviorMatcher {
 public:
  /// Matches with a connection of its own if `connection` is null.
  BehaviorMatcher(SqliteConnection* connection, const std::string& path, const Filter& filter)
      : own_(connection ? nullptr : openSqliteStore(path, OpenMode::ReadOnly)),
        connection_(connection ? *connection : *own_),
        filter_(filter) {}

  bool matches(const Behavior& behavior) {
    return filter_.matches(behavior, [&](const std::string& topic, const Condition& condition) {
      // It does not own the condition, which the filter keeps.
      const std::shared_ptr<const Condition> where(std::shared_ptr<void>(), &condition);
      SqliteCursor cursor(connection_, behavior, {{topic}}, where, 1);
      const bool is_any = cursor.next().has_value();
      looked_ += cursor.looked();
      return is_any;
    });
  }
  std::uint64_t looked() const { return looked_; }  ///< number of messages that were looked at

 private:
  std::unique_ptr<SqliteConnection> own_;
  SqliteConnection& connection_;
  const Filter& filter_;
  std::uint64_t looked_ = 0;
};

/// Returns which of the behaviors match, each looked at by the next matcher that is free.
std::vector<char> matchesOf(std::vector<BehaviorMatcher>& matchers, const Behavior* behaviors,
                            std::size_t count) {
  std::vector<char> matches(count);
  std::atomic<std::size_t> next{0};
  const auto work = [&](BehaviorMatcher& matcher) {
    for (std::size_t i = next++; i < count; i = next++) matches[i] = matcher.matches(behaviors[i]);
  };
  std::vector<std::future<void>> others;
  for (std::size_t i = 1; i < matchers.size(); ++i) {
    others.push_back(std::async(std::launch::async, work, std::ref(matchers[i])));
  }
  work(matchers.front());
  for (std::future<void>& other : others) other.get();
  return matches;
}

std::vector<BehaviorMatcher> makeMatchers(SqliteConnection* connection, const std::string& path,
                                          const Filter& filter, std::size_t behaviors) {
  const std::size_t processors = std::max(1u, std::thread::hardware_concurrency());
  const std::size_t count = connection ? 1 : std::min({behaviors, kMostThreads, processors});
  std::vector<BehaviorMatcher> matchers;
  for (std::size_t i = 0; i < count; ++i) {
    matchers.emplace_back(connection, path, filter);
  }
  return matchers;
}

}  // namespace

void filterBehaviors(SqliteConnection* connection, const std::string& path,
                     const BehaviorFilter& filter, std::vector<Behavior>& found,
                     std::vector<std::string>* steps) {
  auto matchers = makeMatchers(connection, path, *filter.where, found.size());
  const std::size_t most = filter.limit.value_or(found.size());
  std::size_t looked = 0, kept = 0;
  while (looked < found.size() && kept < most) {
    const std::size_t rest = found.size() - looked;
    const std::size_t count = filter.limit ? std::min(rest, kRound) : rest;
    const std::vector<char> matches = matchesOf(matchers, &found[looked], count);
    for (std::size_t i = 0; i < count && kept < most; ++i, ++looked) {
      if (!matches[i]) continue;
      if (kept != looked) found[kept] = std::move(found[looked]);
      ++kept;
    }
  }
  found.resize(kept);
  if (!steps) return;
  std::uint64_t messages = 0;
  for (const BehaviorMatcher& matcher : matchers) messages += matcher.looked();
  steps->push_back(
      fmt::format("filter: {} of {} match; messages read: {}", kept, looked, messages));
}

}  // namespace afterglow::replay
