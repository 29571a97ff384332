#include <fmt/format.h>

#include <iostream>
#include <memory>

#include "nodes/ask/question_file.hpp"
#include "nodes/verbs/command.hpp"
#include "nodes/verbs/verb_tools.hpp"
#include "replay/ask/asking.hpp"
#include "replay/ask/said.hpp"
#include "replay/query/time_text.hpp"
#include "replay/store/open/open_store.hpp"

namespace afterglow::nodes {
namespace {

constexpr std::size_t kRemembered = 500;  // behaviors, the newest

struct AskOptions {
  std::vector<std::string> words;
  std::string store, questions;
  bool json = false;
  bool is_dry_run = false;
};

const char* nameOf(replay::AskAnswer::Kind kind) {
  switch (kind) {
    case replay::AskAnswer::Kind::Found:
      return "found";
    case replay::AskAnswer::Kind::AskedBack:
      return "asked_back";
    default:
      return "unknown";
  }
}

void printAnswer(const replay::AskAnswer& answer, const AskOptions& options) {
  const bool is_found = answer.kind == replay::AskAnswer::Kind::Found;
  if (options.json) {
    nlohmann::ordered_json json = {{"answer", nameOf(answer.kind)},
                                   {"behavior", nullptr},
                                   {"motion", answer.may_move},
                                   {"in_words", answer.in_words},
                                   {"sentence", answer.sentence},
                                   {"why", answer.why},
                                   {"candidates", answer.candidates}};
    if (is_found) json["behavior"] = answer.behavior.id;
    std::cout << dumpJson(json, 2) << "\n";
    return;
  }
  if (options.is_dry_run) std::cout << answer.why << "\n";
  std::cout << answer.sentence << "\n";
  if (is_found && !answer.in_words) {
    std::cout << fmt::format("shown by: afterglow play {} --only ar,speech\n", answer.behavior.id);
  }
}

void runAsk(const AskOptions& options) {
  const auto store = replay::openStore(options.store, replay::OpenMode::ReadOnly);
  replay::Asking asking(readQuestions(options.questions));
  std::string text;
  for (const std::string& word : options.words) text += (text.empty() ? "" : " ") + word;
  replay::BehaviorFilter newest;
  newest.limit = kRemembered;
  const auto said = [&](const replay::Behavior& behavior) {
    return replay::saidIn(*store, behavior);
  };
  printAnswer(asking.ask(text, store->behaviors(newest), said, replay::wallNow()), options);
}

}  // namespace

void addAskVerb(CLI::App& app) {
  auto options = std::make_shared<AskOptions>();
  CLI::App* verb = addVerb(app, "ask");
  verb->add_option("question", options->words,
                   "What a person asks: \"why did you not go straight?\"")
      ->required();
  verb->add_option("--questions", options->questions,
                   "A file of phrasings as assets/questions.yaml, which is built in");
  verb->add_flag("--dry-run", options->is_dry_run, "Also say which phrasing it matched");
  verb->add_flag("--json", options->json,
                 "As a JSON object of {answer: found, asked_back or unknown; behavior, motion, "
                 "in_words, sentence, why, candidates}");
  addStoreOption(*verb, options->store);
  verb->callback([options] { runAsk(*options); });
}

}  // namespace afterglow::nodes
