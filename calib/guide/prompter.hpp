/// \file
/// When to say what to the person who holds the board: events at once, advice only when it has
/// lasted, and not over and over.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace afterglow::calib {

struct Utterance {
  std::string text;
  bool is_spoken = true;   ///< else only written
  bool is_advice = false;  ///< what to do; else what has happened
};

/// Times are the frames' stamps; no clock of its own.
class Prompter {
 public:
  /// Something has happened: written and spoken, but not spoken twice in a row within seconds.
  void tell(const std::string& text, std::int64_t now_ns);
  /// What to do next, frame by frame. True if the same advice has now been given for so long in
  /// vain that it was repeated, and another should be tried.
  bool advise(const std::string& text, std::int64_t now_ns);
  /// What is to be said since the last call.
  std::vector<Utterance> take();

 private:
  std::vector<Utterance> waiting_;
  std::string candidate_, written_, spoken_;
  std::string told_;
  std::int64_t candidate_since_ns_ = 0, spoken_at_ns_ = 0, told_at_ns_ = 0;
};

}  // namespace afterglow::calib
