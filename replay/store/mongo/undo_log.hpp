/// \file
/// A transaction on a server that has none. Internal to replay/store.
#pragma once

#include <functional>
#include <vector>

namespace afterglow::replay {

/// Writes take effect at once; each says how it is taken back, should the transaction fail. Used
/// under the lock of the store that writes.
class UndoLog {
 public:
  /// Runs `work`. When it throws, its writes are taken back, the last one first, and the exception
  /// goes on; what cannot be taken back stays. A transaction within another is a part of that one.
  void transaction(const std::function<void()>& work);
  /// Takes back the write that was just made, if it is part of a transaction that fails.
  void onFailure(std::function<void()> undo);
  /// Called when the transaction has succeeded; at once outside of one.
  void onSuccess(std::function<void()> rest);

 private:
  void takeBack() const noexcept;

  bool is_running_ = false;
  std::vector<std::function<void()>> on_failure_, on_success_;
};

}  // namespace afterglow::replay
