/// \file
/// The demo's face on a terminal: stages with a bar and a check mark; plain lines where the output
/// is no terminal.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <mutex>
#include <string>
#include <thread>

namespace afterglow::nodes {

/// One stage at a time. Draws from a thread of its own, so that a stage need not report. Any
/// thread.
class DemoProgress {
 public:
  /// `is_terminal`: draw bars and colors. Text goes to `out`, which must outlive this.
  DemoProgress(std::FILE* out, bool is_terminal);
  ~DemoProgress();
  DemoProgress(const DemoProgress&) = delete;
  DemoProgress& operator=(const DemoProgress&) = delete;

  void title(const std::string& text, const std::string& subtitle);
  /// A stage that should take about `expected_s` begins.
  void begin(const std::string& stage, double expected_s);
  /// The stage went well; `detail` says what came of it.
  void done(const std::string& detail);
  /// The stage, if there is one, went wrong.
  void failed();
  void line(const std::string& text);

 private:
  void tick();
  void draw(const char* mark, const std::string& rest);
  double elapsed() const;

  std::FILE* out_;
  const bool is_terminal_;
  std::mutex mutex_;
  std::condition_variable wake_;
  bool is_closing_ = false;
  bool is_running_ = false;
  std::string stage_;
  double expected_s_ = 0;
  std::chrono::steady_clock::time_point begin_;
  std::thread ticker_;
};

}  // namespace afterglow::nodes
