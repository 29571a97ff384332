// In place of speech.cpp in builds without eSpeak NG: whoever wants to speak is told so.
#include <stdexcept>

#include "nodes/speaker/speech.hpp"

namespace afterglow::nodes {
namespace {

[[noreturn]] void refuse() {
  throw std::runtime_error("this build has no eSpeak NG: install libespeak-ng-dev and build again");
}

}  // namespace

Speech::Speech(const SpeechOptions& options) : options_(options), engine_(SpeechEngine::Espeak) {
  refuse();
}

std::shared_ptr<const Sound> Speech::say(const std::string& /*text*/,
                                         const std::string& /*voice*/) {
  refuse();
}

std::string Speech::defaultVoice() const { refuse(); }

}  // namespace afterglow::nodes
