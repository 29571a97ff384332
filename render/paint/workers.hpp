/// \file
/// Two threads that share the work of one frame: the caller's, and one that waits in between.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <mutex>
#include <thread>
#include <type_traits>

namespace afterglow::render {

/// Used from one thread at a time.
class Workers {
 public:
  /// Two: the machines this is for have two cores, and others have work for the rest.
  static constexpr int kCount = 2;
  static constexpr std::size_t kFewItems = 4000;  ///< some 100 ns each: waking takes 50 us

  Workers();
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  /// job(0) here and job(1) beside; returns when both are done. Throws what either threw. What
  /// handles fewer items than are worth waking the other for is all done here.
  template <typename Job>
  void run(const Job& job, std::size_t items = ~std::size_t{0}) {
    if (items < kFewItems) {
      for (int worker = 0; worker < kCount; ++worker) job(worker);
      return;
    }
    runBoth([](const void* both, int worker) { (*static_cast<const Job*>(both))(worker); }, &job);
  }

 private:
  using Call = void (*)(const void* job, int worker);
  void runBoth(Call call, const void* job);
  void help();

  std::mutex mutex_;
  std::condition_variable changed_;
  Call call_ = nullptr;  ///< there while the helper has something to do
  const void* job_ = nullptr;
  std::exception_ptr failure_;
  bool is_ending_ = false;
  std::thread helper_;  ///< last: uses all of the above
};

}  // namespace afterglow::render
