/// \file
/// A transaction on a server that has none. Internal to replay/store.
#pragma once

#include <functional>
#include <utility>
#include <vector>

#include "replay/store/store.hpp"

namespace afterglow::replay {

/// Writes take effect at once; each says how it is taken back, should the transaction fail. Used
/// under the lock of the store that writes.
class UndoLog {
 public:
  /// Runs `work`. When it throws, its writes are taken back, the last one first, and the exception
  /// goes on; what cannot be taken back stays. A transaction within another is a part of that one.
  void transaction(const std::function<void()>& work) {
    if (is_running_) return work();
    is_running_ = true;
    try {
      work();
    } catch (...) {
      takeBack();
      finish();
      throw;
    }
    for (const auto& rest : finish()) rest();
  }
  bool isRunning() const { return is_running_; }
  /// Takes back the write that was just made, if it is part of a transaction that fails.
  void onFailure(std::function<void()> undo) {
    if (is_running_) on_failure_.push_back(std::move(undo));
  }
  /// Called when the transaction has succeeded; at once outside of one.
  void onSuccess(std::function<void()> rest) {
    if (!is_running_) return rest();
    on_success_.push_back(std::move(rest));
  }

 private:
  void takeBack() const noexcept {
    for (auto undo = on_failure_.rbegin(); undo != on_failure_.rend(); ++undo) {
      try {
        (*undo)();
      } catch (const StoreError&) {  // the first error is the one to tell
      }
    }
  }
  std::vector<std::function<void()>> finish() {
    is_running_ = false;
    on_failure_.clear();
    return std::exchange(on_success_, {});
  }

  bool is_running_ = false;
  std::vector<std::function<void()>> on_failure_, on_success_;
};

}  // namespace afterglow::replay
