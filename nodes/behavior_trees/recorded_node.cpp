#include "afterglow/recorded_node.hpp"

#include <algorithm>
#include <utility>

namespace afterglow::nodes {

RecordedNode::RecordedNode(std::shared_ptr<RecorderClient> recorder)
    : recorder_(std::move(recorder)) {}

void RecordedNode::begin(RecordingOptions options) {
  const std::uint64_t enclosing = EnclosingRecording::current();
  if (std::exchange(enclosing_, enclosing) != enclosing) {
    failures_ = 0;
  }
  if (options.attempt == 0) {
    options.attempt = failures_ + 1;
  }
  waits_ = std::exchange(options.wait, false);
  is_required_ = options.required;
  running_.emplace(std::move(options), recorder_);
}

bool RecordedNode::mayGo() const { return !waits_ || running_->isSettled(); }

bool RecordedNode::isRefused() const { return is_required_ && !running_->problem().empty(); }

void RecordedNode::end(const std::string& outcome) {
  if (!running_) {
    failures_ = 0;  // a tree that is halted halts every node
    return;
  }
  const auto is_done = [](const BehaviorRecording& recording) { return recording.isDone(); };
  ending_.erase(std::remove_if(ending_.begin(), ending_.end(), is_done), ending_.end());
  running_->end(outcome);
  ending_.push_back(std::move(*running_));
  running_.reset();
  failures_ = outcome == "failure" ? failures_ + 1 : 0;
}

}  // namespace afterglow::nodes
