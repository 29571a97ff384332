#include "replay/store/mongo/undo_log.hpp"

#include <utility>

#include "replay/store/store.hpp"

namespace afterglow::replay {

void UndoLog::transaction(const std::function<void()>& work) {
  if (is_running_) return work();
  is_running_ = true;
  const auto finish = [this] {
    is_running_ = false;
    on_failure_.clear();
    return std::exchange(on_success_, {});
  };
  try {
    work();
  } catch (...) {
    takeBack();
    finish();
    throw;
  }
  for (const auto& rest : finish()) rest();
}

void UndoLog::takeBack() const noexcept {
  for (auto undo = on_failure_.rbegin(); undo != on_failure_.rend(); ++undo) {
    try {
      (*undo)();
    } catch (const StoreError&) {  // the first error is the one to tell
    }
  }
}

void UndoLog::onFailure(std::function<void()> undo) {
  if (is_running_) on_failure_.push_back(std::move(undo));
}

void UndoLog::onSuccess(std::function<void()> rest) {
  if (!is_running_) return rest();
  on_success_.push_back(std::move(rest));
}

}  // namespace afterglow::replay
