#include "nodes/verbs/projector_choice.hpp"

#include <fmt/format.h>

#include <stdexcept>
#include <vector>

namespace afterglow::nodes {

ProjectorConfig ofProjector(ProjectorConfig config, const std::string& name) {
  std::vector<std::string> names;
  for (const OutputConfig& projector : config.projectors) {
    if (projector.name == name || (name.empty() && config.projectors.size() == 1)) {
      config.projectors = {OutputConfig(projector)};
      return config;
    }
    if (!projector.name.empty()) names.push_back(projector.name);
  }
  const std::string known = fmt::format("{}", fmt::join(names, ", "));
  if (name.empty()) throw std::runtime_error("--projector is needed, one of: " + known);
  throw std::runtime_error("no projector '" + name + "' in the configuration" +
                           (known.empty() ? ", its only one has no name" : "; known: " + known));
}

}  // namespace afterglow::nodes
