#include "render/compose/workers.hpp"

#include <sched.h>

#include <algorithm>
#include <system_error>
#include <utility>

namespace afterglow::render {

int Workers::usualCount() {
  cpu_set_t usable;
  CPU_ZERO(&usable);
  // Fails where there are more processors than the set holds.
  const bool is_known = sched_getaffinity(0, sizeof(usable), &usable) == 0;
  const int count =
      is_known ? CPU_COUNT(&usable) : static_cast<int>(std::thread::hardware_concurrency());
  return std::clamp(count, 1, kMost);
}

Workers::Workers(int count) {
  try {
    for (int worker = 1; worker < count; ++worker) {
      helpers_.emplace_back([this, worker] { help(worker); });
    }
  } catch (const std::system_error&) {
    // No more threads are to be had: those that there are do the work.
  }
}

Workers::~Workers() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_ending_ = true;
  }
  started_.notify_all();
  for (std::thread& helper : helpers_) helper.join();
}

void Workers::runAll(Call call, const void* job) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    call_ = call;
    job_ = job;
    ++jobs_;
    at_work_ = helpers_.size();
  }
  started_.notify_all();
  work(0);
  std::unique_lock<std::mutex> lock(mutex_);
  done_.wait(lock, [this] { return at_work_ == 0; });
  const std::exception_ptr failure = std::exchange(failure_, nullptr);
  lock.unlock();
  if (failure) std::rethrow_exception(failure);
}

void Workers::work(int worker) noexcept {
  try {
    call_(job_, worker);
  } catch (...) {
    const std::lock_guard<std::mutex> lock(mutex_);
    failure_ = std::current_exception();
  }
}

void Workers::help(int worker) {
  std::uint64_t known = 0;
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    started_.wait(lock, [&] { return jobs_ != known || is_ending_; });
    if (is_ending_) return;
    known = jobs_;
    lock.unlock();
    work(worker);
    lock.lock();
    if (--at_work_ == 0) done_.notify_one();
  }
}

}  // namespace afterglow::render
