#include "nodes/verbs/verb_tools.hpp"

#include <fmt/format.h>
#include <unistd.h>

#include <CLI/Error.hpp>
#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <map>
#include <numeric>
#include <stdexcept>

#include "nodes/tools/stop_signal.hpp"
#include "replay/messages/foreign_json.hpp"
#include "replay/query/behavior_selector.hpp"
#include "replay/query/time_text.hpp"

namespace afterglow::nodes {

void addStoreOption(CLI::App& verb, std::string& uri) {
  verb.add_option("--store", uri,
                  "The store: sqlite:PATH, PATH, mongodb://..., or @FILE, a file whose first line is "
                  "that (passwords: others see a command line). Default: $AFTERGLOW_STORE, else "
                  "~/.local/share/afterglow/afterglow.db");
}

replay::Behavior findBehavior(const replay::Store& store, const std::string& uri,
                              const std::vector<std::string>& words) {
  try {
    return replay::selectBehavior(store, fmt::format("{}", fmt::join(words, " ")));
  } catch (const replay::StoreError& error) {
    const std::string what = error.what();
    const std::string name = replay::storeUri(uri);
    throw replay::StoreError(what.rfind(name, 0) == 0 ? what : name + ": " + what);
  }
}

std::optional<replay::Stamp> timeOption(const std::string& option, const std::string& text) {
  if (text.empty()) return std::nullopt;
  const auto stamp = replay::parseTime(text);
  if (!stamp) {
    throw CLI::ValidationError(option, "\"" + text + "\" is no time; " + replay::kTimesUnderstood);
  }
  return stamp;
}

std::optional<replay::Stamp> momentOption(const replay::Store& store, const std::string& uri,
                                          const std::string& text) {
  if (text.empty()) return std::nullopt;
  // A short number is an id: nobody was recorded in 1970.
  const bool is_id = text.size() < 9 && text.find_first_not_of("0123456789") == std::string::npos;
  const auto stamp = is_id ? std::nullopt : replay::parseTime(text);
  return stamp ? *stamp : findBehavior(store, uri, {text}).begin;
}

nlohmann::ordered_json objectJson(const replay::Behavior& behavior, const std::string& field,
                                  const std::string& text) {
  auto json = replay::parseForeignJson<nlohmann::ordered_json>(text);
  if (!json.is_discarded()) return json;
  std::cerr << "behavior " << behavior.id << ": its " << field
            << " are no JSON, or nested too deep: shown as null\n";
  return nullptr;
}

nlohmann::ordered_json behaviorJson(const replay::Behavior& behavior,
                                    const std::vector<replay::TopicSummary>& topics) {
  nlohmann::ordered_json json = {{"id", behavior.id},
                                 {"name", behavior.name},
                                 {"tree_path", behavior.tree_path},
                                 {"parent", behavior.parent},
                                 {"attempt", behavior.attempt},
                                 {"outcome", behavior.outcome},
                                 {"begin_ns", std::to_string(behavior.begin.ns)},
                                 {"end_ns", nullptr},
                                 {"robot", behavior.robot},
                                 {"parameters", objectJson(behavior, "parameters", behavior.parameters)},
                                 {"tags", behavior.tags},
                                 {"topics", nlohmann::ordered_json::object()}};
  if (behavior.end) json["end_ns"] = std::to_string(behavior.end->ns);
  std::map<std::string, std::uint64_t> largest;
  for (const replay::TopicSummary& topic : topics) {
    auto& entry = json["topics"][topic.topic];
    if (topic.count > largest[topic.topic]) {
      largest[topic.topic] = topic.count;
      entry["type"] = topic.type;
    }
    entry["count"] = entry.value("count", std::uint64_t{0}) + topic.count;
  }
  return json;
}

std::string dumpJson(const nlohmann::ordered_json& json, int indent) {
  return json.dump(indent, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

double durationSeconds(const replay::Behavior& behavior,
                       const std::vector<replay::TopicSummary>& topics) {
  replay::Stamp end = behavior.end.value_or(behavior.begin);
  if (!behavior.end) {
    for (const replay::TopicSummary& topic : topics) end = std::max(end, topic.last);
  }
  return static_cast<double>(end.ns - behavior.begin.ns) * 1e-9;
}

std::string sizeText(std::uint64_t bytes) {
  if (bytes < 10'000) return std::to_string(bytes) + " B";
  const double megabytes = static_cast<double>(bytes) * 1e-6;
  return fmt::format("{:.{}f} MB", megabytes, megabytes < 10 ? 2 : 0);
}

bool looksLikeFile(const std::string& what) {
  namespace fs = std::filesystem;
  const std::string extension = fs::path(what).extension().string();
  const bool is_bag = extension == ".bag" || extension == ".mcap" || extension == ".db3";
  std::error_code ignored;
  const bool is_there = fs::is_regular_file(what, ignored) ||
                        fs::exists(fs::path(what) / "metadata.yaml", ignored);  // a bag of ROS 2
  return what.find('/') != what.npos || is_bag || is_there;
}

// ------------------------------------------------------------------------------------------ tables

TextTable::TextTable(const std::vector<std::pair<std::string, Align>>& columns) {
  rows_.emplace_back();
  for (const auto& [title, align] : columns) {
    rows_.front().push_back(title);
    alignments_.push_back(align);
  }
}

void TextTable::add(std::vector<std::string> row) {
  for (std::string& cell : row) cell = oneLine(cell);
  rows_.push_back(std::move(row));
}

namespace {

/// Takes the beginning of a cell that fits a column: to a blank, slash or comma, or a whole letter.
std::string takePiece(std::string& cell, std::size_t width) {
  std::size_t cut = cell.size();
  if (cut > width) {
    cut = cell.find_last_of(" /,", width - 1) + 1;  // 0 without one
    if (cut <= width / 2) cut = width;
    while (cut > 1 && (static_cast<unsigned char>(cell[cut]) & 0xc0) == 0x80) --cut;
  }
  const std::string piece = cell.substr(0, cut);
  cell.erase(0, cut);
  return piece;
}

}  // namespace

std::vector<std::size_t> TextTable::widths(std::size_t most) const {
  constexpr std::size_t kNarrowest = 12;
  std::vector<std::size_t> widths(alignments_.size(), 0);
  for (const auto& row : rows_) {
    for (std::size_t i = 0; i < row.size(); ++i) widths[i] = std::max(widths[i], row[i].size());
  }
  while (std::accumulate(widths.begin(), widths.end(), 2 * (widths.size() - 1)) > most) {
    std::size_t* widest = nullptr;
    for (std::size_t i = 0; i < widths.size(); ++i) {
      const bool is_wider = widest == nullptr || widths[i] > *widest;
      if (alignments_[i] == Align::Left && is_wider) widest = &widths[i];
    }
    if (widest == nullptr || *widest <= kNarrowest) break;
    --*widest;
  }
  return widths;
}

std::string TextTable::text(const std::string& indent, std::size_t width) const {
  const std::size_t room = std::max(width, indent.size()) - indent.size();
  const auto fitting = widths(width == 0 ? std::string::npos : room);
  std::string text;
  for (std::vector<std::string> row : rows_) {
    do {  // a line of the row
      std::string line = indent;
      for (std::size_t i = 0; i < row.size(); ++i) {
        const std::string piece = takePiece(row[i], fitting[i]);
        const std::string padding(fitting[i] - piece.size(), ' ');
        line += (alignments_[i] == Align::Left ? piece + padding : padding + piece) + "  ";
      }
      line.erase(line.find_last_not_of(' ') + 1);
      text += line + "\n";
    } while (std::any_of(row.begin(), row.end(), [](const auto& rest) { return !rest.empty(); }));
  }
  return text;
}

// ---------------------------------------------------------------------------------------- progress

Waiting::Waiting(std::string doing) : doing_(std::move(doing)) {
  if (isatty(STDERR_FILENO) == 1) thread_.begin();
}

Waiting::~Waiting() {
  thread_.stop();
  if (seconds_ > 1) replaceLine("");
}

void Waiting::tell() {
  if (seconds_ > 0) replaceLine(doing_ + " ... " + std::to_string(seconds_) + " s");
  ++seconds_;
}

std::string timeLeft(double share, double taken_s) {
  if (share < 0.01 || taken_s < 2) return "";
  const auto left_s = static_cast<long>(std::ceil(taken_s * (1 - std::min(share, 1.0)) / share));
  if (left_s < 60) return fmt::format("{} s left", left_s);
  if (left_s < 3600) return fmt::format("{} min {} s left", left_s / 60, left_s % 60);
  return fmt::format("{} h {} min left", left_s / 3600, left_s / 60 % 60);
}

Progress::Progress(std::string doing, std::string counted)
    : doing_(std::move(doing)),
      counted_(std::move(counted)),
      is_terminal_(isatty(STDERR_FILENO) == 1),
      begin_(std::chrono::steady_clock::now()),
      next_(begin_) {
  catchStopSignals();
}

Progress::~Progress() {
  if (is_terminal_) replaceLine("");
}

void Progress::update(std::uint64_t done, std::uint64_t total) {
  if (isStopRequested()) throw std::runtime_error("stopped before its end");
  const auto now = std::chrono::steady_clock::now();
  if (!is_terminal_ || now < next_) return;
  next_ = now + std::chrono::milliseconds(100);
  std::string line = doing_ + " ";
  if (!counted_.empty()) line += fmt::format("{} of {} {}, ", done, total, counted_);
  const double share = total == 0 ? 1 : static_cast<double>(done) / static_cast<double>(total);
  const std::string left = timeLeft(share, std::chrono::duration<double>(now - begin_).count());
  replaceLine(line + fmt::format("{:.0f} %", std::floor(100 * share)) +
              (left.empty() ? "" : ", " + left));
}

void tellOfDamage(std::size_t messages) {
  if (messages == 0) return;
  std::cerr << messages << (messages == 1 ? " damaged message is" : " damaged messages are")
            << " left out; afterglow store check names what is damaged\n";
}

}  // namespace afterglow::nodes
