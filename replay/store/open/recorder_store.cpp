#include "replay/store/open/recorder_store.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <random>
#include <utility>

#include "replay/store/checksum.hpp"
#include "replay/store/mongo/mongo_open.hpp"
#include "replay/store/open/open_store.hpp"
#include "replay/store/sync.hpp"

namespace afterglow::replay {
namespace {

/// An answer may be of the moment: so often the server is asked before it is taken for a refusal.
constexpr int kAttempts = 3;

/// Thrown out of a copy for which there is no time any more.
struct OutOfTime {};

}  // namespace

std::string recorderFile(const std::string& server) {
  std::string folder;
  if (const char* named = std::getenv("AFTERGLOW_SPOOL"); named && *named) {
    folder = named;
  } else if (const std::string home = homeFolder(); !home.empty()) {
    folder = home + "/.local/share/afterglow";
  } else {
    throw StoreError("no place for what is recorded: neither AFTERGLOW_SPOOL nor HOME is set");
  }
  const std::string name = storeUri(server);  // without password and options, which may change
  const auto hash = checksumOf(reinterpret_cast<const std::uint8_t*>(name.data()), name.size());
  return fmt::format("{}/spool-{:016x}.db", folder, static_cast<std::uint64_t>(hash));
}

RecorderStore::RecorderStore(const std::string& uri, SendOptions options)
    : uri_(uri), options_(std::move(options)) {
  const std::string full = fullStoreUri(uri);
  if (!isServerUri(full)) {
    local_ = openStore(uri, OpenMode::Record);
    return;
  }
  status_.path = options_.path.empty() ? recorderFile(full) : options_.path;
  convertSpool(status_.path);
  local_ = openStore(status_.path, OpenMode::Record);
  reader_ = openStore(status_.path, OpenMode::ReadOnly);
  thread_ = std::thread([this] { run(); });
}

std::int64_t RecorderStore::newBehaviorId() const {
  if (!status()) return 0;
  std::random_device random;
  const std::uint64_t drawn = (std::uint64_t{random()} << 32 | random()) >> 12;
  return (std::int64_t{1} << 40) + static_cast<std::int64_t>(drawn);
}

void RecorderStore::tend(std::function<void(Store&)> work) {
  if (!status()) return work(*local_);
  const std::lock_guard<std::mutex> lock(mutex_);
  tend_ = std::move(work);
}

std::optional<SendStatus> RecorderStore::status() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return status_.path.empty() ? std::nullopt : std::optional(status_);
}

std::optional<SendStatus> RecorderStore::finish() {
  if (thread_.joinable()) {
    std::unique_lock<std::mutex> lock(mutex_);
    is_ending_ = true;
    changed_.notify_all();
    changed_.wait_for(lock, options_.farewell, [&] { return is_stopped_; });
    is_stopped_ = true;
    changed_.notify_all();
    lock.unlock();
    thread_.join();
  }
  return status();
}

/// A tree of behaviors goes as a whole, as the server is told of a parent by its child in the file.
void RecorderStore::removeSent(Stamp ended_before) {
  if (!status()) return;
  std::map<std::int64_t, Behavior> here;
  for (Behavior& behavior : local_->behaviors({})) here.emplace(behavior.id, std::move(behavior));
  const auto rootOf = [&](std::int64_t id) {
    for (std::size_t i = 0; i < here.size(); ++i) {
      const std::int64_t parent = here.at(id).parent;
      if (parent == 0 || here.count(parent) == 0) break;
      id = parent;
    }
    return id;
  };
  std::set<std::int64_t> staying;
  for (const auto& [id, behavior] : here) {
    const std::lock_guard<std::mutex> lock(mutex_);
    const auto sent = sent_.find(id);
    const bool is_there = sent != sent_.end() && sent->second;
    if (!is_there || !(behavior.end.value_or(kEndOfTime) < ended_before)) {
      staying.insert(rootOf(id));
    }
  }
  for (const auto& [id, behavior] : here) {
    if (staying.count(rootOf(id)) > 0) continue;
    local_->removeBehavior(id);
    const std::lock_guard<std::mutex> lock(mutex_);
    sent_.erase(id);
  }
}

// ------------------------------------------------------------------------------------- the thread

Store& RecorderStore::server() {
  if (!server_) server_ = openStore(uri_, OpenMode::Record);
  return *server_;
}

bool RecorderStore::isStopped() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return is_stopped_;
}

void RecorderStore::run() {
  auto pause = options_.pause;
  std::unique_lock<std::mutex> lock(mutex_);
  while (!is_stopped_) {
    const bool is_last = is_ending_;
    lock.unlock();
    std::string error;
    try {
      sendAll();
    } catch (const std::exception& failure) {
      error = failure.what();
    } catch (const OutOfTime&) {
    }
    lock.lock();
    status_.last_error = error;
    if (!error.empty()) {
      changed_.wait_for(lock, pause, [&] { return is_stopped_; });
      pause = std::min(2 * pause, 32 * options_.pause);
      continue;
    }
    pause = options_.pause;
    if (is_last) break;
    changed_.wait_for(lock, options_.look, [&] { return is_ending_ || is_stopped_; });
  }
  is_stopped_ = true;
  changed_.notify_all();
}

void RecorderStore::sendAll() {
  for (const Behavior& behavior : unsent()) send(behavior);
  std::unique_lock<std::mutex> lock(mutex_);
  const auto work = std::exchange(tend_, nullptr);
  lock.unlock();
  if (work) work(server());
}

/// Returns those that have ended, the oldest first, so that parents come before their children.
std::vector<Behavior> RecorderStore::unsent() {
  std::unique_lock<std::shared_mutex> nobody_ends(ending_);
  std::vector<Behavior> all = reader_->behaviors({});
  nobody_ends.unlock();
  std::reverse(all.begin(), all.end());
  std::vector<Behavior> wanted;
  std::size_t unsent = 0;
  std::unique_lock<std::mutex> lock(mutex_);
  for (Behavior& behavior : all) {
    if (isOpen(behavior) || refused_.count(behavior.id) > 0) continue;
    const auto sent = sent_.find(behavior.id);
    if (sent == sent_.end()) ++unsent;
    const bool is_done = sent != sent_.end() && (sent->second || runsStill(behavior.parent));
    if (!is_done) wanted.push_back(std::move(behavior));
  }
  status_.unsent = unsent;
  return wanted;
}

bool RecorderStore::runsStill(std::int64_t parent) const {
  const auto behavior = parent == 0 ? std::nullopt : reader_->behavior(parent);
  return behavior && isOpen(*behavior);
}

/// Returns true if the server has this parent, or will never have it.
bool RecorderStore::isSettled(std::int64_t parent) const {
  if (parent == 0 || !reader_->behavior(parent)) return true;
  const std::lock_guard<std::mutex> lock(mutex_);
  return sent_.count(parent) > 0 || refused_.count(parent) > 0;
}

void RecorderStore::send(const Behavior& behavior) {
  SyncTerms terms;
  terms.is_sending = true;
  terms.leaves_out_refused = failures_[behavior.id] + 1 >= kAttempts;
  const bool has_parent = isSettled(behavior.parent);
  Store& there = server();  // throws while it cannot be opened, which is no behavior's fault
  SyncReport report;
  try {
    report = syncBehaviors(*reader_, there, {behavior}, terms, [this](auto&&...) {
      if (isStopped()) throw OutOfTime{};
    });
  } catch (const StoreAway&) {
    throw;
  } catch (const StoreBusy&) {
    throw;
  } catch (const StoreError& error) {
    if (++failures_[behavior.id] < kAttempts) throw;
    return keep(behavior.id, error.what());
  }
  failures_.erase(behavior.id);
  if (report.damaged > 0) report.last_refusal = "damaged messages were left out";
  if (!report.last_refusal.empty()) return keep(behavior.id, report.last_refusal);
  const std::lock_guard<std::mutex> lock(mutex_);
  const bool is_new = sent_.insert_or_assign(behavior.id, has_parent).second;
  if (is_new) --status_.unsent;
}

void RecorderStore::keep(std::int64_t id, const std::string& why) {
  const std::lock_guard<std::mutex> lock(mutex_);
  refused_.insert(id);
  --status_.unsent;
  status_.refused = refused_.size();
  status_.last_refusal = fmt::format("behavior {}: {}", id, why);
}

}  // namespace afterglow::replay
