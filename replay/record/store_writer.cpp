#include "replay/record/store_writer.hpp"

#include <new>

#include "replay/messages/field_edit.hpp"

namespace afterglow::replay {
namespace {

/// The store has waited itself before it says that it is busy.
constexpr std::chrono::milliseconds kBusyPause{100};

/// Empty for a definition that cannot be understood: its messages are recorded as bytes.
std::optional<Schema> parse(const Channel& channel) {
  try {
    return Schema::of(channel);
  } catch (const MessageError&) {
    return std::nullopt;
  }
}

std::optional<Stamp> stampOf(const Schema& schema, const Bytes& bytes) {
  try {
    return headerStamp(schema, bytes);
  } catch (const MessageError&) {
    return std::nullopt;  // bytes that do not fit their type are evidence, too
  }
}

/// Also where there is no memory for its text.
std::string reasonOf(const std::exception& error) {
  try {
    if (dynamic_cast<const std::bad_alloc*>(&error) == nullptr) return error.what();
  } catch (const std::bad_alloc&) {
  }
  return kNoMemory;
}

}  // namespace

void StoreRetry::insist(const std::function<void()>& work) {
  for (;;) {
    try {
      work();
      break;
    } catch (const StoreBusy& busy) {
      if (!wait(busy.what())) throw;
    }
  }
  const std::lock_guard<std::mutex> lock(mutex_);
  is_busy_ = false;
}

/// False: there is no time.
bool StoreRetry::wait(const std::string& why) {
  std::unique_lock<std::mutex> lock(mutex_);
  if (!std::exchange(is_busy_, true)) {
    lock.unlock();
    on_busy_(why);
    lock.lock();
  }
  hurried_.wait_for(lock, kBusyPause, [this] { return is_hurried_; });
  return !is_hurried_;
}

void StoreRetry::hurry() {
  const std::lock_guard<std::mutex> lock(mutex_);
  is_hurried_ = true;
  hurried_.notify_all();
}

bool StoreRetry::isBusy() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return is_busy_;
}

void WrittenChannels::add(Store& store, std::int64_t recording, const Channel& channel) {
  const std::pair key(recording, &channel);
  if (known_.count(key) != 0) return;
  Known known{store.addChannel(recording, channel), parse(channel), nullptr};
  if (known.schema) {
    auto references = std::make_unique<const FileReferences>(*known.schema);
    if (references->any()) known.references = std::move(references);
  }
  known_.emplace(key, std::move(known));
}

void WrittenChannels::examine(QueuedMessage& queued) const {
  const Known& known = known_.at({queued.recording, queued.channel});
  Message& message = queued.message;
  message.channel = known.id;
  if (!known.schema) return;
  message.header_stamp = stampOf(*known.schema, message.bytes);
  try {
    queued.is_unfit = !fits(*known.schema, message.bytes);
    if (known.references) queued.files = known.references->find(message.bytes);
  } catch (const std::exception&) {
    queued.is_unfit = true;
  }
}

StoreWriter::StoreWriter(Store& store, StoreRetry& retry, std::size_t most_bytes,
                         std::chrono::milliseconds batch_period, OnWritten on_written)
    : store_(store),
      retry_(retry),
      most_bytes_(most_bytes),
      batch_period_(batch_period),
      on_written_(std::move(on_written)),
      thread_([this] { run(); }) {}

StoreWriter::~StoreWriter() {
  retry_.hurry();
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_closing_ = true;
  }
  to_writer_.notify_all();
  thread_.join();
}

bool StoreWriter::push(QueuedMessage queued) {
  queued.size = queued.message.bytes.size() + sizeof(QueuedMessage);
  const std::lock_guard<std::mutex> lock(mutex_);
  if (failure_ || queued_bytes_ + queued.size > most_bytes_) return false;
  const bool was_half_full = isHalfFull();
  const std::size_t size = queued.size;
  queue_.push_back(std::move(queued));
  queued_bytes_ += size;
  ++pushed_;
  if (queue_.size() == 1 || isHalfFull() != was_half_full) to_writer_.notify_one();
  return true;
}

void StoreWriter::flush() {
  std::unique_lock<std::mutex> lock(mutex_);
  const std::uint64_t everything = pushed_;
  is_flushing_ = true;
  to_writer_.notify_one();
  from_writer_.wait(lock, [&] { return done_ >= everything; });
}

std::size_t StoreWriter::queuedBytes() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return queued_bytes_;
}

std::optional<std::string> StoreWriter::failure() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return failure_;
}

void StoreWriter::fail(const std::string& why) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!failure_) failure_ = why;
}

void StoreWriter::resume() {
  const std::lock_guard<std::mutex> lock(mutex_);
  failure_.reset();
}

void StoreWriter::run() {
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    to_writer_.wait(lock, [this] { return is_closing_ || is_flushing_ || !queue_.empty(); });
    // Let a batch gather; a flush, the end or a queue half full do not wait.
    to_writer_.wait_for(lock, batch_period_,
                        [this] { return is_closing_ || is_flushing_ || isHalfFull(); });
    is_flushing_ = false;
    queue_.swap(batch_);
    lock.unlock();
    writeBatch();
    lock.lock();
    for (const QueuedMessage& queued : batch_) queued_bytes_ -= queued.size;
    done_ += batch_.size();
    batch_.clear();
    from_writer_.notify_all();
    if (is_closing_ && queue_.empty()) return;
  }
}

void StoreWriter::writeBatch() noexcept {
  std::optional<std::string> reason;
  try {
    reason = failure();
    if (!reason && !batch_.empty()) write(batch_);
  } catch (const std::exception& error) {
    reason = reasonOf(error);
  }
  try {
    if (reason) fail(*reason);
    on_written_(batch_, reason);
  } catch (const std::bad_alloc&) {
    fail(kNoMemory);  // counts are too low
  }
}

void StoreWriter::write(std::deque<QueuedMessage>& batch) {
  retry_.insist([&] {
    for (const QueuedMessage& queued : batch) {
      channels_.add(store_, queued.recording, *queued.channel);
    }
  });
  std::vector<Message> messages;
  std::vector<QueuedMessage*> queued_as;
  messages.reserve(batch.size());
  for (QueuedMessage& queued : batch) {
    channels_.examine(queued);
    messages.push_back(std::move(queued.message));  // stamp and sequence stay, for the counts
    queued_as.push_back(&queued);
  }
  for (;;) {
    try {
      return retry_.insist([&] { store_.append(messages); });
    } catch (const MessageRefused& refusal) {
      const auto at = static_cast<std::ptrdiff_t>(refusal.place());
      queued_as.at(refusal.place())->refusal = refusal.what();
      messages.erase(messages.begin() + at);
      queued_as.erase(queued_as.begin() + at);
    }
  }
}

}  // namespace afterglow::replay
