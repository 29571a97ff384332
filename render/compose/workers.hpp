/// \file
/// Threads that share the work of one image: the caller's, and others that wait in between.
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace afterglow::render {

/// Used from one thread at a time.
class Workers {
 public:
  /// The most workers; otherwise there are as many as processors that this process may use.
  static constexpr int kMost = 16;
  static int usualCount();

  explicit Workers(int count = usualCount());
  ~Workers();
  Workers(const Workers&) = delete;
  Workers& operator=(const Workers&) = delete;

  int count() const { return static_cast<int>(helpers_.size()) + 1; }
  /// job(0) here and job(1) to job(count() - 1) beside; returns when all are done. Throws an
  /// exception that one of them threw.
  template <typename Job>
  void run(const Job& job) {
    runAll([](const void* all, int worker) { (*static_cast<const Job*>(all))(worker); }, &job);
  }

  /// Few items are not worth waking the others for.
  static bool areMany(std::size_t items) { return items >= kFewItems; }
  /// Returns the number of workers that share so many items.
  int sharers(std::size_t items) const { return areMany(items) ? count() : 1; }
  /// job(worker, begin, end) of every sharer's part of the items, as run() does.
  template <typename Job>
  void share(std::size_t items, const Job& job) {
    const auto parts = static_cast<std::size_t>(sharers(items));
    if (parts == 1) return job(0, std::size_t{0}, items);
    run([&](int worker) {
      const auto part = static_cast<std::size_t>(worker);
      job(worker, items * part / parts, items * (part + 1) / parts);
    });
  }

 private:
  static constexpr std::size_t kFewItems = 4000;  // some 100 ns each: waking takes 50 us
  using Call = void (*)(const void* job, int worker);
  void runAll(Call call, const void* job);
  void help(int worker);
  void work(int worker) noexcept;

  std::mutex mutex_;
  std::condition_variable started_, done_;
  Call call_ = nullptr;
  const void* job_ = nullptr;
  std::uint64_t jobs_ = 0;   ///< so many have been started
  std::size_t at_work_ = 0;  ///< helpers that are not done with the last one
  std::exception_ptr failure_;
  bool is_ending_ = false;
  std::vector<std::thread> helpers_;  ///< last: they use all of the above
};

}  // namespace afterglow::render
