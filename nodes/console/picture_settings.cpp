#include "nodes/console/picture_settings.hpp"

#include <stdexcept>
#include <utility>

#include "nodes/projector/output_config.hpp"
#include "nodes/verbs/projector_choice.hpp"

namespace afterglow::nodes {

void addPictureOptions(CLI::App& verb, PictureOptions& options) {
  verb.add_option("--config", options.config,
                  "What is projected where (assets/projector.yaml), for pictures of moments");
  verb.add_option("--calibration", options.calibration,
                  "Folder of the lens's file; without it, the configuration's folder");
  verb.add_option("--projector", options.projector,
                  "Which of several projectors of the configuration");
}

std::unique_ptr<PictureDesk> openDesk(const replay::Store& store, const PictureOptions& options,
                                      const ObserverOptions& observer) {
  if (options.config.empty()) {
    if (observer.isGiven()) throw std::runtime_error("pictures need --config");
    return nullptr;
  }
  PictureSettings settings;
  settings.config =
      ofProjector(loadProjectorConfig(options.config, options.calibration), options.projector);
  settings.lens = loadLens(settings.config.projectors[0]).lens;
  settings.observer = observer;
  return std::make_unique<PictureDesk>(store, std::move(settings));
}

}  // namespace afterglow::nodes
