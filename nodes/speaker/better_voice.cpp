#include "nodes/speaker/better_voice.hpp"

#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <vector>

#include "nodes/tools/program.hpp"

namespace afterglow::nodes {
namespace {

bool isEnglish(const std::string& voice) { return voice.rfind("en", 0) == 0; }

/// A file for a WAV, gone with the object. pico2wave demands the ending.
class WavFile {
 public:
  WavFile() {
    const int file = ::mkstemps(path_.data(), 4);
    if (file < 0) throw std::runtime_error("cannot make " + path_ + " for speech");
    ::close(file);
  }
  WavFile(const WavFile&) = delete;
  WavFile& operator=(const WavFile&) = delete;
  ~WavFile() { ::unlink(path_.c_str()); }
  const std::string& path() const { return path_; }

 private:
  std::error_code no_folder_;  ///< then making the file fails, and says where
  std::string path_ =
      (std::filesystem::temp_directory_path(no_folder_) / "afterglow_speech_XXXXXX.wav").string();
};

/// Speaks by a program that takes the WAV file to write, and what to say, as these two take them.
Sound sayBy(std::vector<std::string> command, const std::string& text) {
  const WavFile file;
  for (const std::string& word : {std::string("-w"), file.path(), std::string("--"), text}) {
    command.push_back(word);
  }
  const ProgramResult result = runProgram(command);
  if (result.status != 0) {
    throw std::runtime_error(command.front() + " ended with status " +
                             std::to_string(result.status) + " on \"" + text + "\"");
  }
  return readWav(file.path());
}

}  // namespace

std::string mbrolaVoice() {
  if (!hasProgram("mbrola")) return "";
  for (const std::string name : {"us1", "en1", "us2", "us3"}) {
    if (std::filesystem::exists("/usr/share/mbrola/" + name + "/" + name)) return "mb-" + name;
  }
  return "";
}

SpeechEngine chooseEngine(const std::string& wanted, const std::string& voice) {
  if (wanted == "espeak") return SpeechEngine::Espeak;
  const bool is_auto = wanted.empty() || wanted == "auto";
  if (is_auto && !isEnglish(voice)) return SpeechEngine::Espeak;
  if ((is_auto || wanted == "pico") && hasProgram("pico2wave")) return SpeechEngine::Pico;
  if ((is_auto || wanted == "mbrola") && !mbrolaVoice().empty()) return SpeechEngine::Mbrola;
  if (is_auto) return SpeechEngine::Espeak;
  const bool is_known = wanted == "pico" || wanted == "mbrola";
  throw std::runtime_error("~engine is \"" + wanted + "\", " +
                           (is_known ? "which is not installed"
                                     : "and has to be auto, pico, mbrola or espeak"));
}

bool hasEspeakVoice(const std::string& voice) {
  if (!hasProgram("espeak-ng")) {
    throw std::runtime_error("espeak-ng is not installed (package espeak-ng): nothing can be said");
  }
  return runProgram({"espeak-ng", "-q", "-v", voice, "--", ""}).status == 0;
}

Sound sayByEspeak(const std::string& text, const std::string& voice, int words_per_minute) {
  const std::string utf8 = "1";
  return sayBy({"espeak-ng", "-b", utf8, "-v", voice, "-s", std::to_string(words_per_minute)},
               text);
}

Sound sayByPico(const std::string& text, const std::string& voice) {
  return sayBy({"pico2wave", "-l", voice.rfind("en-gb", 0) == 0 ? "en-GB" : "en-US"}, text);
}

}  // namespace afterglow::nodes
