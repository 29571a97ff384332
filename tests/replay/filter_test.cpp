#include "replay/query/filter.hpp"

#include <gtest/gtest.h>

#include "replay/query/nearest.hpp"
#include "tests/support/store_samples.hpp"

namespace afterglow::replay::filter_test {
namespace {

using nlohmann::json;

bool matches(const std::string& filter, const std::string& document) {
  return Filter::parse(filter, Filter::Over::Messages).matches(json::parse(document));
}

std::string errorOf(const std::string& filter, Filter::Over over = Filter::Over::Behaviors) {
  try {
    Filter::parse(filter, over);
  } catch (const FilterError& error) {
    return error.what();
  }
  return "";
}

struct Case {
  const char* filter;
  const char* document;
  bool matches;
};

// What MongoDB's manual says of each operator ("Query and Projection Operators"), of arrays
// ("Query an Array") and of null ("Query for Null or Missing Fields").
const Case kCases[] = {
    {R"({})", R"({"a": 1})", true},
    {R"({"a": 1})", R"({"a": 1})", true},
    {R"({"a": 1})", R"({"a": 1.0})", true},
    {R"({"a": 1})", R"({"a": "1"})", false},
    {R"({"a": true})", R"({"a": 1})", false},
    {R"({"a": {"b": 1}})", R"({"a": {"b": 1}})", true},
    {R"({"a": {"b": 1}})", R"({"a": {"b": 1, "c": 2}})", false},
    {R"({"a": 1, "b": 2})", R"({"a": 1, "b": 3})", false},
    // comparisons, like with like
    {R"({"a": {"$gt": 2}})", R"({"a": 2})", false},
    {R"({"a": {"$gte": 2}})", R"({"a": 2})", true},
    {R"({"a": {"$lt": 2}})", R"({"a": "1"})", false},
    {R"({"a": {"$lt": "b"}})", R"({"a": "abc"})", true},
    {R"({"a": {"$gt": "b"}})", R"({"a": 5})", false},
    {R"({"a": {"$gt": false}})", R"({"a": true})", true},
    {R"({"a": {"$gt": 1, "$lt": 3}})", R"({"a": 2})", true},
    {R"({"a": {"$gt": 1}})", R"({})", false},
    {R"({"a": {"$lt": 1}})", R"({"a": null})", false},
    {R"({"a": {"$lte": null}})", R"({"a": null})", true},
    {R"({"a": 9007199254740993})", R"({"a": 9007199254740992})", false},
    {R"({"a": {"$gt": 18446744073709551614}})", R"({"a": 18446744073709551615})", true},
    {R"({"a": {"$gt": -1}})", R"({"a": 18446744073709551615})", true},
    // numbers that JSON lacks
    {R"({"a": {"$gt": 5}})", R"({"a": "inf"})", true},
    {R"({"a": {"$lt": 5}})", R"({"a": "-inf"})", true},
    {R"({"a": {"$lt": 5}})", R"({"a": "nan"})", false},
    {R"({"a": {"$gt": 5}})", R"({"a": "nan"})", false},
    {R"({"a": "nan"})", R"({"a": "nan"})", true},
    {R"({"a": {"$ne": "nan"}})", R"({"a": 5})", true},
    {R"({"a": {"$lt": "inf"}})", R"({"a": 5})", true},
    {R"({"a": {"$gte": "nan"}})", R"({"a": "nan"})", true},
    // negations hold for what is not there
    {R"({"a": {"$ne": 1}})", R"({})", true},
    {R"({"a": {"$ne": 1}})", R"({"a": [1, 2]})", false},
    {R"({"a": {"$nin": [1, 2]}})", R"({"a": 3})", true},
    {R"({"a": {"$nin": [1, 2]}})", R"({"a": [3, 2]})", false},
    {R"({"a": {"$not": {"$gt": 1}}})", R"({})", true},
    {R"({"a": {"$not": {"$gt": 1}}})", R"({"a": "x"})", true},
    {R"({"a": {"$not": {"$gt": 1, "$lt": 3}}})", R"({"a": 5})", true},
    {R"({"$not": {"a": 1, "b": 2}})", R"({"a": 1, "b": 3})", true},
    {R"({"a": {"$in": [1, "x", null]}})", R"({"a": "x"})", true},
    {R"({"a": {"$in": [1, "x", null]}})", R"({})", true},
    {R"({"a": {"$in": []}})", R"({"a": 1})", false},
    // null and what is not there
    {R"({"a": null})", R"({})", true},
    {R"({"a": null})", R"({"a": null})", true},
    {R"({"a": null})", R"({"a": 0})", false},
    {R"({"a": {"$ne": null}})", R"({"a": 0})", true},
    {R"({"a": {"$exists": true}})", R"({"a": null})", true},
    {R"({"a": {"$exists": false}})", R"({"a": null})", false},
    {R"({"a": {"$exists": 0}})", R"({})", true},
    {R"({"a.b": {"$exists": true}})", R"({"a": [{"b": 1}]})", true},
    {R"({"a.b": null})", R"({"a": [{"b": 1}, {}]})", true},
    {R"({"a.b": null})", R"({"a": []})", false},
    {R"({"a.b": null})", R"({"a": 5})", true},
    // arrays: an element, or the whole
    {R"({"a": 2})", R"({"a": [1, 2]})", true},
    {R"({"a": [1, 2]})", R"({"a": [1, 2]})", true},
    {R"({"a": [2, 1]})", R"({"a": [1, 2]})", false},
    {R"({"a": [1, 2]})", R"({"a": [[1, 2], 3]})", true},
    {R"({"a": {"$gt": 1, "$lt": 1}})", R"({"a": [0, 5]})", true},
    {R"({"a.1": 2})", R"({"a": [1, 2]})", true},
    {R"({"a.0": 2})", R"({"a": [1, 2]})", false},
    {R"({"a.5": null})", R"({"a": [1, 2]})", false},
    {R"({"a.0.b": 1})", R"({"a": [{"b": 1}, {"b": 2}]})", true},
    {R"({"a.1.b": 1})", R"({"a": [{"b": 1}, {"b": 2}]})", false},
    {R"({"a.b": 2})", R"({"a": [{"b": 1}, {"b": [2, 3]}]})", true},
    {R"({"a.b": 1})", R"({"a": [[{"b": 1}]]})", false},
    {R"({"a.0.b": 1})", R"({"a": [[{"b": 1}]]})", true},
    {R"({"a": {"$elemMatch": {"$gt": 1, "$lt": 5}}})", R"({"a": [0, 7]})", false},
    {R"({"a": {"$elemMatch": {"$gt": 1, "$lt": 5}}})", R"({"a": [0, 3]})", true},
    {R"({"a": {"$elemMatch": {"b": 1, "c": 2}}})", R"({"a": [{"b": 1}, {"c": 2}]})", false},
    {R"({"a": {"$elemMatch": {"b": 1, "c": 2}}})", R"({"a": [{"b": 1, "c": 2}]})", true},
    {R"({"a": {"$elemMatch": {"$or": [{"b": 1}, {"b": 2}]}}})", R"({"a": [{"b": 2}]})", true},
    {R"({"a": {"$elemMatch": {"$gt": 1}}})", R"({"a": 3})", false},
    // groups
    {R"({"$or": [{"a": 1}, {"b": 1}]})", R"({"b": 1})", true},
    {R"({"$nor": [{"a": 1}, {"b": 1}]})", R"({"b": 1})", false},
    {R"({"$nor": [{"a": 1}, {"b": 1}]})", R"({})", true},
    {R"({"$and": [{"a": {"$gt": 1}}, {"a": {"$lt": 3}}]})", R"({"a": 2})", true},
    // patterns
    {R"({"a": {"$regex": "^ab"}})", R"({"a": "abc"})", true},
    {R"({"a": {"$regex": "^AB"}})", R"({"a": "abc"})", false},
    {R"({"a": {"$regex": "^AB", "$options": "i"}})", R"({"a": "abc"})", true},
    {R"({"a": {"$regex": "^b", "$options": "m"}})", R"({"a": "a\nb"})", true},
    {R"({"a": {"$regex": "a.b", "$options": "s"}})", R"({"a": "a\nb"})", true},
    {R"({"a": {"$regex": "a b", "$options": "x"}})", R"({"a": "ab"})", true},
    {R"({"a": {"$regex": "1"}})", R"({"a": 1})", false},
    {R"({"a": {"$regex": "c$"}})", R"({"a": ["x", "abc"]})", true},
    {R"({"a": {"$not": {"$regex": "^a"}}})", R"({"a": "b"})", true},
    {R"({"a": {"$regex": "^gr.n$"}})", R"({"a": "grün"})", true},
};

TEST(EditDistance, countsChangedCharacters) {
  EXPECT_EQ(editDistance("colour", "color"), 1u);
  EXPECT_EQ(editDistance("", "abc"), 3u);
  EXPECT_EQ(editDistance("kitten", "sitting"), 3u);
  EXPECT_EQ(editDistance("same", "same"), 0u);
  EXPECT_EQ(editDistance("Pick", "pick"), 0u) << "capitals aside";
}

TEST(Filter, answersAsMongoDbDoes) {
  for (const Case& c : kCases) {
    EXPECT_EQ(matches(c.filter, c.document), c.matches) << c.filter << " on " << c.document;
  }
}

TEST(Filter, saysWhatIsWrongAndWhere) {
  EXPECT_EQ(errorOf(R"({"attempt": {"$gth": 1}})"),
            "filter, at attempt > $gth: there is no operator $gth; did you mean $gt?");
  EXPECT_EQ(errorOf(R"({"nme": "pick"})"),
            "filter, at nme: behaviors have no field nme; did you mean name?");
  EXPECT_EQ(errorOf(R"({"$and": {"name": "pick"}})"),
            "filter, at $and: expected an array of filters");
  EXPECT_EQ(errorOf(R"({"name": {"$regex": "a("}})"),
            "filter, at name > $regex: $regex \"a(\", at character 2: missing closing parenthesis");
  EXPECT_EQ(errorOf(R"({"name": {"$gt": [1]}})"),
            "filter, at name > $gt: compares with a number, a string, true or false");
  EXPECT_EQ(errorOf(R"({"/t": 5})"),
            "filter, at /t: a topic takes a filter over its messages, such as {\"data\": "
            "\"done\"}, not 5");
  EXPECT_NE(errorOf(R"({"name": )").find("filter: no JSON: parse error at line 1"),
            std::string::npos);
  EXPECT_NE(errorOf(R"({"attempt": 1e999})").find("filter: no JSON: number overflow"),
            std::string::npos);
  EXPECT_NE(errorOf(R"({"begin": {"$gt": "gestern"}})").find("\"gestern\" is no time"),
            std::string::npos);
  for (const char* wrong :
       {"5", "[]", R"({"a": {"$in": 5}})", R"({"a": {"$options": "i"}})", R"({"$or": []})",
        R"({"a": {"$gt": 1, "b": 2}})", R"({"a": {"$eq": {"$gt": 1}}})", R"({"$elem": 1})",
        R"({"a": {"$exists": "yes"}})", R"({"a": {"$regex": "a", "$options": "g"}})",
        R"({"a": {"$not": 5}})", R"({"a": {"$elemMatch": 5}})", R"({"": 1})"}) {
    EXPECT_NE(errorOf(wrong, Filter::Over::Messages), "") << wrong;
  }
}

TEST(Filter, refusesWhatNestsWithoutEnd) {
  std::string filter = "{\"a\": 1}";
  for (int i = 0; i < 10'000; ++i) filter = "{\"$not\": " + filter + "}";
  EXPECT_EQ(errorOf(filter).substr(0, 31), "the filter nests deeper than 10");
}

TEST(Filter, refusesAPatternThatNeverEnds) {
  const Filter filter = Filter::parse(R"({"a": {"$regex": "^(a+)+$"}})", Filter::Over::Messages);
  EXPECT_THROW(filter.matches({{"a", std::string(64, 'a') + "b"}}), FilterError);
}

Behavior pick() {
  Behavior behavior = test::sampleBehavior(1, {"/said"}, 1'000'000'000, 3'500'000'000);
  behavior.parameters = R"({"object": {"color": "red"}})";
  behavior.tags = {"demo", "grasp"};
  return behavior;
}

bool matchesPick(const std::string& filter) {
  return Filter::parse(filter).matches(pick(), [](const std::string& topic, const Condition& c) {
    return topic == "/said" && c.matches({{"data", "done"}});
  });
}

TEST(Filter, looksAtTheFieldsOfABehavior) {
  EXPECT_TRUE(matchesPick(R"({"name": "pick", "parameters.object.color": "red"})"));
  EXPECT_TRUE(matchesPick(R"({"tags": "grasp", "duration_s": {"$gt": 2.4, "$lt": 2.6}})"));
  EXPECT_TRUE(matchesPick(R"({"begin": {"$gte": "1970-01-01T00:00:01Z"}, "end_ns": 3500000000})"));
  EXPECT_FALSE(matchesPick(R"({"begin": {"$gt": "1970-01-01T00:00:01Z"}})"));
  EXPECT_TRUE(matchesPick(R"({"topics": "/said", "robot": {"$exists": true}})"));
}

TEST(Filter, asksForTheMessagesOfATopic) {
  EXPECT_TRUE(matchesPick(R"({"/said": {"data": "done"}})"));
  EXPECT_FALSE(matchesPick(R"({"/said": {"data": "never"}})"));
  EXPECT_TRUE(matchesPick(R"({"/heard": {"$exists": false}})"));
  EXPECT_TRUE(matchesPick(R"({"/said": {"$exists": true}})"));
  EXPECT_TRUE(matchesPick(R"({"$or": [{"/heard": {}}, {"$not": {"/said": {"data": "x"}}}]})"));
}

TEST(Filter, asksForNoMessageWhenTheBehaviorTells) {
  const Filter filter = Filter::parse(R"({"/said": {"data": "done"}, "name": "place"})");
  const auto never = [](const std::string&, const Condition&) -> bool {
    throw std::logic_error("asked for messages");
  };
  EXPECT_FALSE(filter.matches(pick(), never));
}

}  // namespace
}  // namespace afterglow::replay::filter_test
