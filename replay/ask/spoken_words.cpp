#include "replay/ask/spoken_words.hpp"

#include <cctype>

#include "replay/messages/topic_name.hpp"
#include "replay/query/nearest.hpp"

namespace afterglow::replay {
namespace {

/// "didn't" and "didnt": recognizers leave the apostrophe out.
bool isNegated(const std::string& word) {
  static const std::set<std::string> verbs{"did",  "do",  "does", "was",  "were",  "is",    "are",
                                           "have", "has", "had",  "could", "would", "should"};
  if (endsWith(word, "n't")) return verbs.count(word.substr(0, word.size() - 3)) > 0;
  return endsWith(word, "nt") && verbs.count(word.substr(0, word.size() - 2)) > 0;
}

void addWord(SpokenWords& words, const std::string& word) {
  static const std::vector<std::pair<std::string, std::string>> endings{
      {"'s", "is"}, {"'d", "did"}, {"'ve", "have"}, {"'re", "are"}};
  if (isNegated(word)) {
    words.push_back(word.substr(0, word.size() - (endsWith(word, "n't") ? 3 : 2)));
    words.push_back("not");
    return;
  }
  std::string stem = word, rest;
  for (const auto& [ending, meaning] : endings) {
    if (!endsWith(word, ending)) continue;
    stem = word.substr(0, word.size() - ending.size());
    rest = meaning;
  }
  std::string letters;
  for (const char c : stem) {
    if (c != '\'') letters += c;
  }
  if (!letters.empty()) words.push_back(letters);
  if (!rest.empty()) words.push_back(rest);
}

/// Typewritten apostrophes for typeset ones.
std::string withPlainApostrophes(std::string text) {
  for (const char* typeset : {"\u2019", "\u2018"}) {
    for (std::size_t at = 0; (at = text.find(typeset, at)) != std::string::npos;) {
      text.replace(at, std::string(typeset).size(), "'");
    }
  }
  return text;
}

}  // namespace

SpokenWords spokenWords(const std::string& text) {
  if (text.size() > kLongestQuestion) return {};
  const std::string plain = lowerCase(withPlainApostrophes(text));
  SpokenWords words;
  std::string word;
  for (std::size_t i = 0; i < plain.size(); ++i) {
    const auto c = static_cast<unsigned char>(plain[i]);
    const bool is_time = c == ':' && i > 0 && i + 1 < plain.size() &&
                         std::isdigit(static_cast<unsigned char>(plain[i - 1])) != 0 &&
                         std::isdigit(static_cast<unsigned char>(plain[i + 1])) != 0;
    if (c >= 0x80 || std::isalnum(c) != 0 || c == '\'' || is_time) {
      word += plain[i];
    } else if (!word.empty()) {
      addWord(words, word);
      word.clear();
    }
  }
  if (!word.empty()) addWord(words, word);
  return words;
}

SpokenWords plainWords(const SpokenWords& words, const QuestionBook& book) {
  SpokenWords plain;
  for (std::size_t i = 0; i < words.size(); ++i) {
    std::size_t taken = 1;
    std::string word = words[i], meaning;
    for (std::size_t length = 3; length >= 1; --length) {  // "for what reason" before "for"
      if (i + length > words.size()) continue;
      const std::string several =
          joined(SpokenWords(words.begin() + static_cast<std::ptrdiff_t>(i),
                             words.begin() + static_cast<std::ptrdiff_t>(i + length)));
      const auto found = book.synonyms.find(several);
      if (found == book.synonyms.end()) continue;
      word = found->second;
      taken = length;
      break;
    }
    if (taken > 1 || book.fillers.count(word) == 0) plain.push_back(word);
    i += taken - 1;
  }
  return plain;
}

std::string joined(const SpokenWords& words) {
  std::string text;
  for (const std::string& word : words) text += (text.empty() ? "" : " ") + word;
  return text;
}

}  // namespace afterglow::replay
