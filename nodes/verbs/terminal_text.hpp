/// \file
/// The safe text for a terminal: names and texts of a store, of the network, of a file may hold
/// escape sequences, which change its title, its colors, what it answers.
#pragma once

#include <cstddef>
#include <iosfwd>
#include <memory>
#include <streambuf>
#include <string>
#include <vector>

namespace afterglow::nodes {

/// Makes one line: control characters, also those of Unicode (U+0080 to U+009F), line breaks and
/// the marks that turn the direction of writing stand as `\u001b`; so they do in JSON's strings.
std::string oneLine(const std::string& text);

/// While it lives, whatever the program writes to std::cout and std::cerr is as oneLine() has it,
/// but for line breaks and tabs, which stay.
class SafeOutput {
 public:
  SafeOutput();
  SafeOutput(const SafeOutput&) = delete;
  SafeOutput& operator=(const SafeOutput&) = delete;
  ~SafeOutput();

 private:
  std::unique_ptr<std::streambuf> out_, errors_;
  std::streambuf* const own_out_;
  std::streambuf* const own_errors_;
};

/// Replaces the line on a terminal's standard error; `text`, as oneLine() has it, or nothing. This
/// and replaceLines() are the places that write escape sequences.
void replaceLine(const std::string& text);

/// Returns the columns of the terminal that standard output is; 0: it is none.
std::size_t terminalWidth();

/// Breaks lines that are longer than `width` (0: any width) between words; what goes on begins
/// below the second column of a line that has two, else below its first letter.
std::string wrapped(const std::string& text, std::size_t width);

/// Replaces the last `before` lines on a terminal's standard output by others, each as oneLine()
/// has it and cut to the terminal's width; as many as its height has room for. Returns how many.
std::size_t replaceLines(const std::vector<std::string>& lines, std::size_t before);

}  // namespace afterglow::nodes
