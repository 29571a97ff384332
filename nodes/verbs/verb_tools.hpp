/// \file
/// The common part of several verbs of `afterglow`: the store's option, behaviors as JSON and as
/// text, progress.
#pragma once

#include <CLI/App.hpp>
#include <chrono>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <optional>
#include <string>
#include <vector>

#include "nodes/verbs/terminal_text.hpp"
#include "replay/clock/worker_thread.hpp"
#include "replay/store/store.hpp"

namespace afterglow::nodes {

void addStoreOption(CLI::App& verb, std::string& uri);

/// "3", "the last failed pick", ... (replay/query/behavior_selector.hpp), which may be several
/// words of the command line. Throws StoreError, with the store's name in front, if there is none.
replay::Behavior findBehavior(const replay::Store& store, const std::string& uri,
                              const std::vector<std::string>& words);

/// Help for an argument that is such a behavior.
constexpr const char* kBehaviorHelp =
    "Which behavior: its id as list prints it, its name for the newest, or words such as "
    "\"last failed pick\", \"second last pick\", \"first pick\"";

/// A time (replay/query/time_text.hpp) of the command line; CLI::ValidationError if it is none.
std::optional<replay::Stamp> timeOption(const std::string& option, const std::string& text);

/// The begin of a behavior, or a time. Empty for an empty text; StoreError if it is neither.
std::optional<replay::Stamp> momentOption(const replay::Store& store, const std::string& uri,
                                          const std::string& text);

/// A field of a behavior that holds JSON; null, with a line on stderr, if it is damaged: one row of
/// a store does not keep the others from being shown.
nlohmann::ordered_json objectJson(const replay::Behavior& behavior, const std::string& field,
                                  const std::string& text);

/// The stable form of `list --json`: id, name, tree_path, parent, attempt, outcome, begin_ns,
/// end_ns (null while it runs; both strings, as JSON readers round such numbers), robot,
/// parameters, tags, topics: {topic: {type, count}}. A topic with messages of several types has the
/// count of all and the type of most.
nlohmann::ordered_json behaviorJson(const replay::Behavior& behavior,
                                    const std::vector<replay::TopicSummary>& topics);

/// Writes JSON of any origin as text, on one line: no exception for strings that are no UTF-8.
std::string dumpJson(const nlohmann::ordered_json& json, int indent = -1);

/// Returns the duration from begin to end, or to the last message of a behavior without an end.
double durationSeconds(const replay::Behavior& behavior,
                       const std::vector<replay::TopicSummary>& topics);

/// "812 B", "4.20 MB"
std::string sizeText(std::uint64_t bytes);

/// Returns true if a word means a file, not a behavior: one that is there, a path, a bag's ending.
bool looksLikeFile(const std::string& what);

/// Columns as wide as their widest cell, the numbers in them to the right. On a terminal that is
/// narrower, text goes on in another line of its column.
class TextTable {
 public:
  enum class Align { Left, Right };
  explicit TextTable(const std::vector<std::pair<std::string, Align>>& columns);
  void add(std::vector<std::string> row);
  /// Returns the text; every line begins with `indent`. `width`: columns of the terminal; 0: any.
  std::string text(const std::string& indent = "", std::size_t width = terminalWidth()) const;

 private:
  std::vector<std::size_t> widths(std::size_t most) const;

  std::vector<Align> alignments_;
  std::vector<std::vector<std::string>> rows_;
};

/// A line on stderr, if there were any: what a reader must know of a damaged store.
void tellOfDamage(std::size_t messages);

/// "3 min 20 s left", from the seconds that a share (0 to 1) of the work has taken; empty while
/// that tells too little.
std::string timeLeft(double share, double taken_s);

/// A line on stderr that says for how long something has taken, from the first second on, if stderr
/// is a terminal; gone afterwards.
class Waiting {
 public:
  explicit Waiting(std::string doing);
  Waiting(const Waiting&) = delete;
  Waiting& operator=(const Waiting&) = delete;
  ~Waiting();

 private:
  void tell();

  const std::string doing_;
  int seconds_ = 0;
  replay::RepeatingThread thread_{std::chrono::seconds(1), [this] { tell(); }};
};

/// A line on stderr that counts up and says how long it will still take, if stderr is a terminal;
/// gone afterwards. From the first of them on a signal to stop ends the verb by update(), so that
/// what is half written goes; a second one ends the process.
class Progress {
 public:
  /// `counted`: of what done and total are so many; empty: of nothing that people count.
  explicit Progress(std::string doing, std::string counted = "messages");
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  ~Progress();
  /// Throws std::runtime_error once somebody has asked to stop.
  void update(std::uint64_t done, std::uint64_t total);

 private:
  const std::string doing_, counted_;
  const bool is_terminal_;
  const std::chrono::steady_clock::time_point begin_;
  std::chrono::steady_clock::time_point next_;
};

}  // namespace afterglow::nodes
