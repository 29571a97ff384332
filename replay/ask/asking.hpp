/// \file
/// A person asks what the robot did: which behavior answers, or what is asked back.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "replay/ask/phrase_match.hpp"
#include "replay/ask/spoken_time.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

struct AskAnswer {
  enum class Kind {
    Found,      ///< a behavior answers
    AskedBack,  ///< the question which of `candidates` is meant; the next sentence may answer it
                ///< The next sentence may say
    Unknown,    ///< nothing does
  };

  Kind kind = Kind::Unknown;
  Behavior behavior;      ///< the answer of Found
  bool may_move = false;  ///< the question allows it; whether the player does is not known here
  bool in_words = false;  ///< `sentence` is the answer
  std::string sentence;   ///< a sentence to be spoken
  std::string why;        ///< "matched 'what did you pick' -> pick"
  std::vector<std::string> candidates;  ///< names of the behaviors of AskedBack
};

/// Returns the robot's sentences in a behavior, in order.
using SentencesOf = std::function<std::vector<std::string>(const Behavior&)>;

/// A conversation: it remembers what it asked back, and the last answer for "before that". No text
/// makes it throw, or take long.
class Asking {
 public:
  explicit Asking(QuestionBook book) : book_(std::move(book)) {}

  /// `behaviors`: the newest first. `now`: the wall clock. Throws what `said` throws.
  AskAnswer ask(const std::string& text, const std::vector<Behavior>& behaviors,
                const SentencesOf& said, Stamp now);

 private:
  struct Candidate {
    std::size_t question = 0;
    Behavior behavior;
    bool may_move = false;
    std::string why;
  };
  struct Asked {
    const std::vector<Behavior>& behaviors;
    const SentencesOf& said;
    Stamp now;
    SpokenTime time;
  };

  std::optional<AskAnswer> answerBack(const SpokenWords& words, const Asked& asked);
  std::optional<Candidate> chosen(const SpokenWords& words) const;
  AskAnswer askAnew(const SpokenWords& words, const Asked& asked);
  std::vector<Behavior> behaviorsOf(const PhraseMatch& match, const Asked& asked) const;
  std::optional<Behavior> pickOne(const std::vector<Behavior>& fitting, const Asked& asked) const;
  bool isAtTime(const Behavior& behavior, const Asked& asked) const;
  bool names(const Behavior& behavior, const SpokenWords& slot, const SentencesOf& said) const;
  AskAnswer found(const Candidate& candidate, const Asked& asked);
  AskAnswer askBack(std::vector<Candidate> candidates, Stamp now);
  AskAnswer unknown(const std::string& sentence) const;
  std::string known() const;

  QuestionBook book_;
  std::vector<Candidate> pending_;  ///< the candidates that were asked back
  Stamp asked_back_;
  std::optional<Behavior> last_;  ///< the last behavior that answered
};

/// Returns the wall clock's time at its beginning.
Stamp wallBegin(const Behavior& behavior);

/// "12 minutes ago"
std::string ageText(Stamp then, Stamp now);

}  // namespace afterglow::replay
