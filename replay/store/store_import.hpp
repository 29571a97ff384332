/// \file
/// An import into a store: many appends that show together, or not at all. Internal to replay.
#pragma once

#include <cstdint>
#include <string>

#include "replay/store/store.hpp"

namespace afterglow::replay {

/// Takes back what was appended if it goes before finish() has returned. One whose program dies is
/// taken back by the next one.
class StoreImport {
 public:
  StoreImport(Store& store, const std::string& source) : store_(store) {
    store.dropUnfinished();
    recording_ = store.beginImport({0, "", source, ""});
  }
  StoreImport(const StoreImport&) = delete;
  StoreImport& operator=(const StoreImport&) = delete;
  ~StoreImport() {
    if (is_finished_) return;
    try {
      store_.dropRecording(recording_);
    } catch (const StoreError&) {
      // The store is what failed: dropUnfinished() will do it.
    }
  }

  std::int64_t recording() const { return recording_; }
  /// `work` adds the behaviors.
  template <typename Work>
  void finish(const Work& work) {
    store_.transaction([&] {
      work();
      store_.finishImport(recording_);
    });
    is_finished_ = true;
  }

 private:
  Store& store_;
  std::int64_t recording_ = 0;
  bool is_finished_ = false;
};

}  // namespace afterglow::replay
