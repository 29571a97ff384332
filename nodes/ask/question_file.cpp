#include "nodes/ask/question_file.hpp"

#include "nodes/tools/yaml_map.hpp"

namespace afterglow::nodes {
namespace {

/// A list of texts, none of them empty.
std::vector<std::string> textList(const YamlMap& map, const YAML::Node& list,
                                  const std::string& what) {
  if (!list.IsSequence() || list.size() == 0) map.fail(list, what + " should be a list of texts");
  std::vector<std::string> texts;
  for (const auto& entry : list) {
    if (!entry.IsScalar() || entry.Scalar().empty()) {
      map.fail(entry, "each of " + what + " should be a text");
    }
    texts.push_back(entry.Scalar());
  }
  return texts;
}

/// Checks that a phrasing has one slot at most, of the one kind that there is.
void checkPhrasing(const YamlMap& map, const YAML::Node& at, const std::string& phrasing) {
  const std::string slot = replay::kSlot;
  const std::size_t found = phrasing.find(slot);
  std::string rest = phrasing;
  if (found != std::string::npos) rest.erase(found, slot.size());
  if (rest.find_first_of("{}") != std::string::npos) {
    map.fail(at, "'" + phrasing + "' may have one " + slot + " and no other braces");
  }
}

replay::Question questionOf(const YamlMap& map) {
  replay::Question question;
  question.behavior = map.text("behavior");
  question.phrasings = textList(map, map.at("ask"), "'ask' of " + map.where());
  for (std::size_t i = 0; i < question.phrasings.size(); ++i) {
    checkPhrasing(map, map.at("ask")[i], question.phrasings[i]);
  }
  if (map.has("motion")) question.may_move = map.choice("motion", {"false", "true"}) == 1;
  if (map.has("answer")) question.in_words = map.choice("answer", {"replay", "words"}) == 1;
  return question;
}

void readSynonyms(const YamlMap& map, const YAML::Node& synonyms, replay::QuestionBook& book) {
  if (!synonyms.IsMap()) map.fail(synonyms, "'synonyms' should be a map of words");
  for (const auto& entry : synonyms) {
    if (!entry.first.IsScalar()) map.fail(entry.first, "a word of 'synonyms' is no text");
    const std::string word = entry.first.Scalar();
    for (const std::string& other : textList(map, entry.second, "the synonyms of '" + word + "'")) {
      book.synonyms[other] = word;
    }
  }
}

replay::QuestionBook bookOf(const std::string& path, const YAML::Node& root) {
  const YamlMap map(path, root, "the questions", {"fillers", "synonyms", "questions"});
  replay::QuestionBook book;
  if (map.has("fillers")) {
    for (const std::string& word : textList(map, map.at("fillers"), "'fillers'")) {
      book.fillers.insert(word);
    }
  }
  if (map.has("synonyms")) readSynonyms(map, map.at("synonyms"), book);
  const YAML::Node questions = map.at("questions");
  if (!questions.IsSequence()) map.fail(questions, "'questions' should be a list");
  for (std::size_t i = 0; i < questions.size(); ++i) {
    book.questions.push_back(questionOf(map.map(questions[i], "question " + std::to_string(i + 1),
                                                {"behavior", "ask", "motion", "answer"})));
  }
  return book;
}

}  // namespace

replay::QuestionBook readQuestions(const std::string& path) {
  if (!path.empty()) return bookOf(path, loadYaml(path));
  return bookOf("assets/questions.yaml", YAML::Load(kEmbeddedQuestions[0].text));
}

}  // namespace afterglow::nodes
