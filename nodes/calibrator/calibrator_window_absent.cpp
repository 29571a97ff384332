// A build without the renderer (AFTERGLOW_WITH_GL=OFF): ~pattern is all there is.
#include <stdexcept>

#include "nodes/calibrator/calibrator_window.hpp"
#include "nodes/tools/stop_signal.hpp"

namespace afterglow::nodes {

void showUntilStopped(CalibratorNode& node, const CalibratorOptions& options) {
  const WindowChoice& choice = options.window;
  if (choice.mode == WindowMode::Always || !choice.monitor.empty()) {
    throw std::runtime_error(
        "no window: this build has no renderer; show ~pattern on the projector and set ~window to "
        "false");
  }
  waitForStop();
  node.stop();
}

}  // namespace afterglow::nodes
