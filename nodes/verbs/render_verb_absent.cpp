// For builds without AFTERGLOW_WITH_GL.
#include <stdexcept>

#include "nodes/verbs/render_verb.hpp"

namespace afterglow::nodes {

void addRenderVerb(CLI::App& app) {
  CLI::App* verb = app.add_subcommand("render", kRenderHelp);
  verb->allow_extras();
  verb->callback([] {
    throw std::runtime_error("this build has no renderer (configure with AFTERGLOW_WITH_GL)");
  });
}

}  // namespace afterglow::nodes
