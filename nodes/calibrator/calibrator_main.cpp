#include "nodes/calibrator/calibrator_node.hpp"
#include "nodes/calibrator/pattern_window.hpp"
#include "nodes/tools/node_main.hpp"
#include "nodes/tools/stop_signal.hpp"

int main(int argc, char** argv) {
  using namespace afterglow::nodes;
  const NodeText text{"calibrator_node", "calibrates a projector with a camera.",
                      "calibrator.launch"};
  return runNode(argc, argv, text, [](const ros::NodeHandle& own, const auto&) {
    const CalibratorOptions options = CalibratorOptions::read(own);
    CalibratorNode node(options);
    ros::AsyncSpinner spinner(1);
    spinner.start();
    PatternWindow{options.window, options.mirror, [] { return ros::ok() && !isStopRequested(); },
                  [&node](const std::string& words) { node.tell(words); }, [&node] { node.stop(); }}
        .show(node.screen());
    letMessagesLeave();
    spinner.stop();
  });
}
