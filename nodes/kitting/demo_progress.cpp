#include "nodes/kitting/demo_progress.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace afterglow::nodes {
namespace {

using namespace std::chrono_literals;

constexpr int kBarWidth = 24;
constexpr int kStageWidth = 46;
constexpr double kFullest = 0.98;  // a stage that takes longer than expected is not yet done

void print(std::FILE* out, const std::string& text) {
  std::fputs(text.c_str(), out);
  std::fflush(out);
}

std::string bar(double share) {
  const int full = static_cast<int>(std::clamp(share, 0.0, kFullest) * kBarWidth);
  std::string text = "\x1b[38;5;208m";
  for (int i = 0; i < full; ++i) text += "\u2501";
  text += "\x1b[38;5;240m";
  for (int i = full; i < kBarWidth; ++i) text += "\u2501";
  return text + "\x1b[0m";
}

}  // namespace

DemoProgress::DemoProgress(std::FILE* out, bool is_terminal)
    : out_(out), is_terminal_(is_terminal) {
  if (is_terminal_) ticker_ = std::thread([this] { tick(); });
}

DemoProgress::~DemoProgress() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    is_closing_ = true;
  }
  wake_.notify_all();
  if (ticker_.joinable()) ticker_.join();
}

void DemoProgress::tick() {
  std::unique_lock<std::mutex> lock(mutex_);
  while (!is_closing_) {
    if (is_running_) draw("\x1b[38;5;208m\u203a\x1b[0m", bar(elapsed() / expected_s_));
    wake_.wait_for(lock, 100ms);
  }
}

double DemoProgress::elapsed() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin_).count();
}

// One line, redrawn in place.
void DemoProgress::draw(const char* mark, const std::string& rest) {
  print(out_, fmt::format("\r\x1b[2K  {} {:<{}} {:>5.1f} s  {}", mark, stage_, kStageWidth,
                          elapsed(), rest));
}

void DemoProgress::title(const std::string& text, const std::string& subtitle) {
  const std::lock_guard<std::mutex> lock(mutex_);
  print(out_, is_terminal_
                  ? fmt::format("\n  \x1b[1m{}\x1b[0m  \x1b[38;5;245m{}\x1b[0m\n\n", text, subtitle)
                  : text + ": " + subtitle + "\n");
}

void DemoProgress::begin(const std::string& stage, double expected_s) {
  const std::lock_guard<std::mutex> lock(mutex_);
  stage_ = stage;
  expected_s_ = std::max(0.1, expected_s);
  begin_ = std::chrono::steady_clock::now();
  is_running_ = true;
}

void DemoProgress::done(const std::string& detail) {
  const std::lock_guard<std::mutex> lock(mutex_);
  is_running_ = false;
  if (is_terminal_) {
    draw("\x1b[32m\u2713\x1b[0m", "\x1b[38;5;245m" + detail + "\x1b[0m\n");
  } else {
    print(out_,
          fmt::format("done   {:<{}} {:>5.1f} s  {}\n", stage_, kStageWidth, elapsed(), detail));
  }
}

void DemoProgress::failed() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!is_running_) return;
  is_running_ = false;
  if (is_terminal_) {
    draw("\x1b[31m\u2717\x1b[0m", "\n");
  } else {
    print(out_, fmt::format("FAILED {:<{}} {:>5.1f} s\n", stage_, kStageWidth, elapsed()));
  }
}

void DemoProgress::line(const std::string& text) {
  const std::lock_guard<std::mutex> lock(mutex_);
  print(out_, (is_terminal_ ? "  " : "") + text + "\n");
}

}  // namespace afterglow::nodes
