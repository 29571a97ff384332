#include "render/paint/workers.hpp"

#include <utility>

namespace afterglow::render {

Workers::Workers() : helper_([this] { help(); }) {}

Workers::~Workers() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_ending_ = true;
  }
  changed_.notify_all();
  helper_.join();
}

void Workers::runBoth(Call call, const void* job) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    call_ = call;
    job_ = job;
  }
  changed_.notify_all();
  std::exception_ptr own_failure;
  try {
    call(job, 0);
  } catch (...) {
    own_failure = std::current_exception();  // the helper still uses the job
  }
  std::unique_lock<std::mutex> lock(mutex_);
  changed_.wait(lock, [this] { return call_ == nullptr; });
  const std::exception_ptr helpers_failure = std::exchange(failure_, nullptr);
  lock.unlock();
  if (own_failure) std::rethrow_exception(own_failure);
  if (helpers_failure) std::rethrow_exception(helpers_failure);
}

void Workers::help() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (true) {
    changed_.wait(lock, [this] { return call_ != nullptr || is_ending_; });
    if (call_ == nullptr) return;
    lock.unlock();
    std::exception_ptr failure;
    try {
      call_(job_, 1);
    } catch (...) {
      failure = std::current_exception();
    }
    lock.lock();
    failure_ = failure;
    call_ = nullptr;
    changed_.notify_all();
  }
}

}  // namespace afterglow::render
