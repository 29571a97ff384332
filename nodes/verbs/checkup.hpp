/// \file
/// The findings of `afterglow doctor`: one line a check.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace afterglow::nodes {

struct Checkup {
  enum class Level { Ok, Advice, Problem };
  std::string name;  ///< name of the check: "gpu"
  Level level = Level::Ok;
  std::string found;
  std::string advice;  ///< advice in one clause; empty: there is nothing to do

  static Checkup ok(std::string name, std::string found) {
    return {std::move(name), Level::Ok, std::move(found), {}};
  }
  static Checkup advise(std::string name, std::string found, std::string advice) {
    return {std::move(name), Level::Advice, std::move(found), std::move(advice)};
  }
  static Checkup problem(std::string name, std::string found, std::string advice) {
    return {std::move(name), Level::Problem, std::move(found), std::move(advice)};
  }

  /// "advice   sound: no device; connect one".
  std::string words() const;
  nlohmann::ordered_json json() const;  ///< {name, level, found, advice}
};

std::size_t countOf(Checkup::Level level, const std::vector<Checkup>& findings);

}  // namespace afterglow::nodes
