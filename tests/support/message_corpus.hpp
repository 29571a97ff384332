/// \file
/// Messages of every type of the installed ROS message packages, as ROS's own Python filled and
/// serialized them (make_message_corpus.py).
#pragma once

#include <sys/wait.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "replay/messages/message.hpp"
#include "tests/support/temp_folder.hpp"

namespace afterglow::test {

struct MessageCorpus {
  struct Sample {
    replay::Bytes bytes;
    nlohmann::json values;
  };
  struct Type {
    std::string name;
    std::string definition;
    std::string md5;
    std::vector<Sample> samples;
  };
  std::vector<Type> types;                    ///< empty if this machine has no ROS Python
  std::vector<std::string> missing_packages;  ///< of those that are asked for
};

inline replay::Bytes bytesFromHex(const std::string& digits) {
  const auto value = [&](std::size_t i) {
    return digits[i] <= '9' ? digits[i] - '0' : digits[i] - 'a' + 10;
  };
  replay::Bytes bytes;
  for (std::size_t i = 0; i < digits.size(); i += 2) {
    bytes.push_back(static_cast<std::uint8_t>(value(i) * 16 + value(i + 1)));
  }
  return bytes;
}

/// Runs the script with `python`, from the repository's root. Throws std::runtime_error if it fails
/// for another reason than a missing ROS.
inline MessageCorpus makeMessageCorpus(const std::string& python) {
  constexpr int kNoRos = 3;
  const TempFolder folder;
  const std::string path = folder.path("corpus.jsonl");
  const std::string command = python + " tests/support/make_message_corpus.py " + path;
  const int status = WEXITSTATUS(std::system(command.c_str()));
  MessageCorpus corpus;
  if (status == kNoRos) return corpus;
  if (status != 0) throw std::runtime_error(command + " ended with " + std::to_string(status));
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    const auto entry = nlohmann::json::parse(line);
    if (entry.contains("missing")) {
      corpus.missing_packages = entry["missing"].get<std::vector<std::string>>();
      continue;
    }
    MessageCorpus::Type type{entry["type"], entry["definition"], entry["md5"], {}};
    for (const auto& message : entry["messages"]) {
      type.samples.push_back({bytesFromHex(message["bytes"]), message["values"]});
    }
    corpus.types.push_back(std::move(type));
  }
  return corpus;
}

}  // namespace afterglow::test
