#include "nodes/console/play_wish.hpp"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "nodes/console/http_message.hpp"
#include "replay/plan/modality_options.hpp"
#include "replay/plan/play_plan.hpp"

namespace afterglow::nodes {
namespace {

double numberOf(const nlohmann::json& asked, const char* name, double otherwise, double least) {
  const auto found = asked.find(name);
  if (found == asked.end() || found->is_null()) return otherwise;
  const double value = found->is_number() ? found->get<double>() : NAN;
  if (std::isfinite(value) && value >= least) return value;
  throw HttpError(400, std::string(name) + " is no such number");
}

}  // namespace

bool PlayWish::isWithoutBody() const {
  const std::set<replay::Modality> asked = replay::parseModalities(only);
  return !asked.empty() && asked.count(replay::Modality::Body) == 0;
}

std::vector<std::string> PlayWish::options() const {
  std::vector<std::string> options{fmt::format("rate={}", rate)};
  if (!only.empty()) options.push_back("only=" + only);
  if (start != 0) options.push_back(fmt::format("start={}", start));
  if (is_looping) options.push_back("loop");
  return options;
}

std::string PlayWish::key() const {
  return fmt::format("{} {}", behavior, fmt::join(options(), " "));
}

PlayWish readWish(const nlohmann::json& asked) {
  PlayWish wish;
  const auto behavior = asked.find("behavior");
  if (behavior == asked.end() || !behavior->is_number_integer()) {
    throw HttpError(400, "behavior is missing: its id");
  }
  wish.behavior = behavior->get<std::int64_t>();
  const auto only = asked.find("only");
  const bool has_only = only != asked.end() && !only->is_null();
  if (has_only && !only->is_string()) throw HttpError(400, "only should be \"body,ar,speech\"");
  if (has_only) wish.only = only->get<std::string>();
  try {
    (void)wish.isWithoutBody();
  } catch (const std::invalid_argument& error) {
    throw HttpError(400, error.what());
  }
  wish.rate = numberOf(asked, "rate", 1, 1e-3);
  wish.start = numberOf(asked, "start", 0, 0);
  const auto loop = asked.find("loop");
  if (loop != asked.end() && !loop->is_boolean()) throw HttpError(400, "loop is true or false");
  wish.is_looping = loop != asked.end() && loop->get<bool>();
  return wish;
}

}  // namespace afterglow::nodes
