#include "nodes/projector/dark_reasons.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace afterglow::nodes {
namespace {

/// "3 beside it" and so on: why drawables are dark.
std::string darkParts(const render::LayerCensus& census, std::size_t invisible) {
  std::vector<std::string> parts;
  const auto add = [&](std::size_t count, const char* words) {
    if (count > 0) parts.push_back(fmt::format("{} {}", count, words));
  };
  add(census.outside, "beside it");
  add(census.behind, "behind the projector");
  add(census.clipped, "beside the surface's outline or in its shade");
  add(census.black, "black");
  add(census.transparent + invisible, "of alpha 0");
  add(census.flat, "without extent, as the projector sees it");
  add(census.blank, "of blank text");
  add(census.empty, "without points");
  return fmt::format("{}", fmt::join(parts, ", "));
}

}  // namespace

std::string lightWords(const render::LayerCensus& census, std::size_t invisible) {
  const std::size_t all = census.drawables + invisible;
  const std::string parts = darkParts(census, invisible);
  return fmt::format("{} of {} {} inside the light", census.lit, all,
                     all == 1 ? "drawable" : "drawables") +
         (parts.empty() ? "" : " (" + parts + ")");
}

std::vector<std::string> darkReasons(const LayerStatus& layer,
                                     const std::optional<render::LayerCensus>& light) {
  std::vector<std::string> reasons;
  if (!layer.missing.empty()) reasons.push_back(layer.missing);
  if (light && light->lit < light->drawables + layer.invisible) {
    reasons.push_back(lightWords(*light, layer.invisible));
  }
  if (light && light->thinned > 0) {
    reasons.push_back(fmt::format(
        "{} of more large things than are drawn (a million corners): some are left out",
        light->thinned));
  }
  if (!layer.nothing.empty()) {
    reasons.push_back("its newest message shows nothing: " + layer.nothing);
  }
  for (const auto& [reason, count] : layer.dropped) {
    reasons.push_back(fmt::format("{} dropped ({})", count, reason));
  }
  for (const auto& [reason, count] : layer.remarks) {
    reasons.push_back(fmt::format("{} shown, but odd ({})", count, reason));
  }
  return reasons;
}

std::vector<std::string> darkReasons(std::vector<std::string> problems,
                                     const std::vector<LayerStatus>& layers,
                                     const std::vector<render::LayerCensus>& light) {
  for (const LayerStatus& layer : layers) {
    const auto own = std::find_if(light.begin(), light.end(), [&](const auto& census) {
      return census.name == layer.topic;
    });
    for (const std::string& reason :
         darkReasons(layer, own == light.end() ? std::nullopt : std::optional(*own))) {
      const std::string line = layer.topic + ": " + reason;
      if (std::count(problems.begin(), problems.end(), line) == 0) problems.push_back(line);
    }
  }
  return problems;
}

}  // namespace afterglow::nodes
