#include "nodes/kitting/demo_progress.hpp"

#include <algorithm>

namespace afterglow::nodes {
namespace {

using namespace std::chrono_literals;

constexpr int kBarWidth = 24;
constexpr int kStageWidth = 46;
constexpr double kFullest = 0.98;  // a stage that takes longer than expected is not yet done

std::string padded(std::string text, std::size_t width) {
  if (text.size() < width) text.append(width - text.size(), ' ');
  return text;
}

std::string seconds(double value) {
  char text[32];
  std::snprintf(text, sizeof(text), "%5.1f s", value);
  return text;
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
  std::fprintf(out_, "\r\x1b[2K  %s %s %s  %s", mark, padded(stage_, kStageWidth).c_str(),
               seconds(elapsed()).c_str(), rest.c_str());
  std::fflush(out_);
}

void DemoProgress::title(const std::string& text, const std::string& subtitle) {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::fprintf(out_,
               is_terminal_ ? "\n  \x1b[1m%s\x1b[0m  \x1b[38;5;245m%s\x1b[0m\n\n" : "%s: %s\n",
               text.c_str(), subtitle.c_str());
  std::fflush(out_);
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
    std::fprintf(out_, "done   %s %s  %s\n", padded(stage_, kStageWidth).c_str(),
                 seconds(elapsed()).c_str(), detail.c_str());
    std::fflush(out_);
  }
}

void DemoProgress::failed() {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (!is_running_) return;
  is_running_ = false;
  if (is_terminal_) {
    draw("\x1b[31m\u2717\x1b[0m", "\n");
  } else {
    std::fprintf(out_, "FAILED %s %s\n", padded(stage_, kStageWidth).c_str(),
                 seconds(elapsed()).c_str());
    std::fflush(out_);
  }
}

void DemoProgress::line(const std::string& text) {
  const std::lock_guard<std::mutex> lock(mutex_);
  std::fprintf(out_, "%s%s\n", is_terminal_ ? "  " : "", text.c_str());
  std::fflush(out_);
}

}  // namespace afterglow::nodes
