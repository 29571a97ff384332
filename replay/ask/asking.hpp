/// \file
/// A person asks what the robot did: which behavior answers, or what is asked back.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "replay/ask/phrase_match.hpp"
#include "replay/ask/spoken_words.hpp"
#include "replay/store/store.hpp"

namespace afterglow::replay {

struct AskAnswer {
  enum class Kind {
    Found,      ///< a behavior answers
    AskedBack,  ///< the question which of `candidates` is meant; the next sentence may answer it
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
/// makes it throw, or take long. A question that is none of the book's is answered by the behaviors
/// whose names and tags, or else also sentences, hold all that it names: "why did you wave", "show
/// me the wave".
class Asking {
 public:
  explicit Asking(QuestionBook book) : book_(std::move(book)) {}

  /// `behaviors`: the newest first. `now`: the wall clock. Throws what `said` throws.
  AskAnswer ask(const std::string& text, const std::vector<Behavior>& behaviors,
                const SentencesOf& said, Stamp now);

 private:
  struct Candidate {
    Behavior behavior;
    bool may_move = false, in_words = false;
    std::string why;
  };
  /// The candidates of a sentence, and whether no word of it is left over or guessed.
  struct Matches {
    std::vector<Candidate> candidates;
    bool is_sure = false, is_known = false;  ///< known: a phrasing is near
  };
  struct Asked {
    const std::vector<Behavior>& behaviors;
    const SentencesOf& said;
    Stamp now;
    SpokenTime time;
    SpokenWords named;  ///< the words that name what is asked about; empty: it is no question
  };

  std::optional<AskAnswer> answerBack(const SpokenWords& words, const Asked& asked);
  std::optional<Candidate> chosen(const SpokenWords& words) const;
  AskAnswer askAnew(const SpokenWords& words, const Asked& asked);
  Matches matchBook(const SpokenWords& words, const Asked& asked) const;
  std::vector<Candidate> matchBehaviors(const Asked& asked, bool with_said) const;
  std::vector<Behavior> behaviorsOf(const PhraseMatch& match, const Asked& asked) const;
  std::vector<Behavior> newestOfEach(const std::vector<Behavior>& fitting,
                                     const Asked& asked) const;
  std::optional<Behavior> pickOne(const std::vector<Behavior>& fitting, const Asked& asked) const;
  bool isAtTime(const Behavior& behavior, const Asked& asked) const;
  static std::string ownWords(const Behavior& behavior, const Asked& asked, bool with_said);
  bool names(const std::string& text, const SpokenWords& slot) const;
  AskAnswer found(const Candidate& candidate, const Asked& asked);
  AskAnswer askBack(std::vector<Candidate> candidates, Stamp now);
  AskAnswer unknown(const std::string& sentence) const;
  std::string known(const Asked& asked) const;

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
