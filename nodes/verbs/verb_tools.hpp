/// \file
/// What several verbs of `afterglow` share: the store's option, behaviors as JSON and as text,
/// progress.
#pragma once

#include <CLI/App.hpp>
#include <chrono>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "replay/store/store.hpp"

namespace afterglow::nodes {

void addStoreOption(CLI::App& verb, std::string& uri);

/// Throws StoreError if the store has none of that id.
replay::Behavior findBehavior(const replay::Store& store, const std::string& uri, std::int64_t id);

/// The stable form of `list --json`: id, name, tree_path, parent, attempt, outcome, begin_ns,
/// end_ns (null while it runs), robot, parameters, tags, topics: {topic: {type, count}}. A topic
/// with messages of several types has the count of all and the type of most.
nlohmann::ordered_json behaviorJson(const replay::Behavior& behavior,
                                    const std::vector<replay::TopicSummary>& topics);

/// As text, one line for JSON of any origin: no exception for strings that are no UTF-8.
std::string dumpJson(const nlohmann::ordered_json& json, int indent = -1);

/// From begin to end, or to the last message of one without an end.
double durationSeconds(const replay::Behavior& behavior,
                       const std::vector<replay::TopicSummary>& topics);

std::string fixedText(double value, int decimals);

/// Columns as wide as their widest cell, the numbers in them to the right.
class TextTable {
 public:
  enum class Align { Left, Right };
  explicit TextTable(std::vector<std::pair<std::string, Align>> columns);
  void add(std::vector<std::string> row);
  /// Every line begins with `indent`.
  std::string text(const std::string& indent = "") const;

 private:
  std::vector<Align> alignments_;
  std::vector<std::vector<std::string>> rows_;
};

/// A line on stderr that counts up, if stderr is a terminal; gone afterwards.
class Progress {
 public:
  explicit Progress(std::string doing);
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  ~Progress();
  void update(std::uint64_t done, std::uint64_t total);

 private:
  std::string doing_;
  bool is_terminal_;
  std::chrono::steady_clock::time_point next_;
};

}  // namespace afterglow::nodes
