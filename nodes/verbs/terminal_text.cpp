#include "nodes/verbs/terminal_text.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <iostream>
#include <mutex>
#include <sstream>

namespace afterglow::nodes {
namespace {

/// The bytes of a character that are held back: of U+0080 to U+009F (C2 ..) two, of the marks of
/// direction (E2 80 8E/8F/AA-AE, E2 81 A6-A9) three.
class Escaper {
 public:
  explicit Escaper(bool keeps_lines) : keeps_lines_(keeps_lines) {}

  void take(unsigned char c, std::string& out) {
    if (held_.empty() && c >= ' ' && c < 0x7f) {
      out += static_cast<char>(c);
      return;
    }
    held_ += static_cast<char>(c);
    if (isBeginning()) return;
    const int code = codeToEscape();
    if (code >= 0) {
      std::array<char, 16> escape{};
      std::snprintf(escape.data(), escape.size(), "\\u%04x", static_cast<unsigned>(code));
      out += escape.data();
    } else {
      out += held_;
    }
    held_.clear();
  }
  void end(std::string& out) {
    out += held_;
    held_.clear();
  }

 private:
  unsigned char at(std::size_t i) const { return static_cast<unsigned char>(held_[i]); }

  bool isBeginning() const {
    if (held_.size() == 1) return at(0) == 0xc2 || at(0) == 0xe2;
    return held_.size() == 2 && at(0) == 0xe2 && (at(1) == 0x80 || at(1) == 0x81);
  }

  /// -1: none is needed.
  int codeToEscape() const {
    if (held_.size() == 1) {
      const bool is_kept = keeps_lines_ && (at(0) == '\n' || at(0) == '\t');
      return (at(0) < ' ' && !is_kept) || at(0) == 0x7f ? at(0) : -1;
    }
    if (at(0) == 0xc2) return at(1) >= 0x80 && at(1) < 0xa0 ? at(1) : tailCode();
    if (held_.size() < 3) return tailCode();
    const int code = 0x2000 + ((at(1) & 0x3f) << 6) + (at(2) & 0x3f);
    const bool is_mark = code == 0x200e || code == 0x200f || (code >= 0x202a && code <= 0x202e) ||
                         (code >= 0x2066 && code <= 0x2069);
    return is_mark && at(2) >= 0x80 && at(2) < 0xc0 ? code : tailCode();
  }

  /// No character: its last byte may be a control character all the same.
  int tailCode() const {
    const unsigned char last = at(held_.size() - 1);
    return last < ' ' || last == 0x7f ? last : -1;
  }

  bool keeps_lines_;
  std::string held_;
};

class SafeBuffer : public std::streambuf {
 public:
  explicit SafeBuffer(std::streambuf* to) : to_(to) {}

 protected:
  int_type overflow(int_type c) override {
    if (traits_type::eq_int_type(c, traits_type::eof())) return traits_type::not_eof(c);
    const char letter = traits_type::to_char_type(c);
    return xsputn(&letter, 1) == 1 ? c : traits_type::eof();
  }

  std::streamsize xsputn(const char* text, std::streamsize size) override {
    const std::lock_guard<std::mutex> lock(mutex_);
    std::string safe;
    for (std::streamsize i = 0; i < size; ++i) {
      escaper_.take(static_cast<unsigned char>(text[i]), safe);
    }
    const auto length = static_cast<std::streamsize>(safe.size());
    return to_->sputn(safe.data(), length) == length ? size : 0;
  }

  int sync() override { return to_->pubsync(); }

 private:
  std::streambuf* const to_;
  std::mutex mutex_;
  Escaper escaper_{true};
};

/// Returns the size of the terminal that standard output is; 0 columns: it is none.
winsize terminalSize() {
  winsize size{};
  return ::ioctl(STDOUT_FILENO, TIOCGWINSZ, &size) == 0 ? size : winsize{};
}

/// Returns the column below which a line goes on.
std::size_t hangingIndent(const std::string& line, std::size_t width) {
  const std::size_t first = std::min(line.find_first_not_of(' '), line.size());
  const std::size_t gap = line.find("  ", first);
  const std::size_t second = gap == line.npos ? line.npos : line.find_first_not_of(' ', gap);
  return second < width / 2 ? second : first;
}

}  // namespace

std::string oneLine(const std::string& text) {
  Escaper escaper(false);
  std::string safe;
  for (const char c : text) escaper.take(static_cast<unsigned char>(c), safe);
  escaper.end(safe);
  return safe;
}

SafeOutput::SafeOutput()
    : out_(std::make_unique<SafeBuffer>(std::cout.rdbuf())),
      errors_(std::make_unique<SafeBuffer>(std::cerr.rdbuf())),
      own_out_(std::cout.rdbuf(out_.get())),
      own_errors_(std::cerr.rdbuf(errors_.get())) {}

SafeOutput::~SafeOutput() {
  std::cout.flush();
  std::cerr.flush();
  std::cout.rdbuf(own_out_);
  std::cerr.rdbuf(own_errors_);
}

void replaceLine(const std::string& text) {
  std::cerr.flush();
  const std::string line = "\r\033[K" + oneLine(text);
  if (::write(STDERR_FILENO, line.data(), line.size()) < 0) return;  // it was only for the eye
}

std::size_t terminalWidth() { return terminalSize().ws_col; }

std::string wrapped(const std::string& text, std::size_t width) {
  if (width == 0) return text;
  std::string result;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    const std::size_t indent = hangingIndent(line, width);
    while (line.size() > width) {
      std::size_t blank = line.rfind(' ', width);
      if (blank == line.npos || blank <= indent) blank = line.find(' ', width);
      if (blank == line.npos) break;
      result += line.substr(0, blank) + "\n";
      line = std::string(indent, ' ') + line.substr(blank + 1);
    }
    result += line + "\n";
  }
  return result;
}

std::size_t replaceLines(const std::vector<std::string>& lines, std::size_t before) {
  std::cout.flush();
  const winsize size = terminalSize();
  const std::size_t width = size.ws_col > 0 ? size.ws_col : 80;
  const std::size_t height = size.ws_col > 0 && size.ws_row > 1 ? size.ws_row - 1u : 24;
  const std::size_t count = std::min(lines.size(), height);
  std::string text = before > 0 ? "\033[" + std::to_string(before) + "A\r\033[J" : "";
  for (std::size_t i = 0; i < count; ++i) text += oneLine(lines[i]).substr(0, width - 1) + "\n";
  if (::write(STDOUT_FILENO, text.data(), text.size()) < 0) return 0;  // it was only for the eye
  return count;
}

}  // namespace afterglow::nodes
