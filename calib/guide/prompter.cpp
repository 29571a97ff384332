#include "calib/guide/prompter.hpp"

#include <utility>

namespace afterglow::calib {
namespace {

constexpr std::int64_t kMillisecond = 1'000'000;
constexpr std::int64_t kWrittenAfter = 400 * kMillisecond;  // a board on its way is no news
constexpr std::int64_t kPause = 4000 * kMillisecond;        // a sentence, and time to act on it
constexpr std::int64_t kRepeatedAfter = 15000 * kMillisecond;

}  // namespace

void Prompter::tell(const std::string& text, std::int64_t now_ns) {
  const bool is_stale =
      text == told_ && now_ns >= told_at_ns_ && now_ns - told_at_ns_ < kRepeatedAfter;
  waiting_.push_back({text, !is_stale, false});
  if (!is_stale) {
    told_ = text;
    told_at_ns_ = spoken_at_ns_ = now_ns;
  }
  written_.clear();
  spoken_.clear();
}

bool Prompter::advise(const std::string& text, std::int64_t now_ns) {
  if (text != candidate_ || now_ns < candidate_since_ns_) {
    candidate_ = text;
    candidate_since_ns_ = now_ns;
  }
  if (now_ns < spoken_at_ns_) spoken_at_ns_ = now_ns;  // the stamps have jumped back
  if (now_ns - candidate_since_ns_ < kWrittenAfter) return false;
  const bool is_repeated = text == spoken_ && now_ns - spoken_at_ns_ >= kRepeatedAfter;
  const bool is_new = text != spoken_ && now_ns - spoken_at_ns_ >= kPause;
  if (is_new || is_repeated) {
    waiting_.push_back({text, true, true});
    written_ = spoken_ = text;
    spoken_at_ns_ = now_ns;
  } else if (text != written_) {
    waiting_.push_back({text, false, true});
    written_ = text;
  }
  return is_repeated;
}

std::vector<Utterance> Prompter::take() { return std::exchange(waiting_, {}); }

}  // namespace afterglow::calib
