#include "nodes/kitting/demo_story.hpp"

#include "nodes/tools/yaml_map.hpp"

namespace afterglow::nodes {
namespace {

BehaviorStory readBehavior(const std::string& file, const YAML::Node& name,
                           const YAML::Node& node) {
  const YamlMap values(file, node, "behavior '" + name.Scalar() + "'",
                       {"title", "caption", "question", "explanation", "says", "moments"});
  BehaviorStory story;
  story.name = name.Scalar();
  story.title = values.text("title");
  story.caption = values.text("caption");
  story.question = values.text("question");
  story.explanation = values.text("explanation");
  story.says = values.text("says");
  const YAML::Node moments = values.at("moments");
  if (!moments.IsMap()) values.fail(moments, "'moments' should be a map of names and texts");
  for (const auto& moment : moments) {
    if (!moment.second.IsScalar()) values.fail(moment.second, "a moment should have a text");
    story.moments.emplace_back(moment.first.Scalar(), moment.second.Scalar());
  }
  return story;
}

}  // namespace

DemoStory loadDemoStory(const std::string& path) {
  const YamlMap values(path, loadYaml(path), "the story", {"title", "subtitle", "behaviors"});
  DemoStory story;
  story.title = values.text("title");
  story.subtitle = values.text("subtitle");
  const YAML::Node behaviors = values.at("behaviors");
  if (!behaviors.IsMap()) values.fail(behaviors, "'behaviors' should be a map of names");
  for (const auto& behavior : behaviors) {
    story.behaviors.push_back(readBehavior(path, behavior.first, behavior.second));
  }
  return story;
}

}  // namespace afterglow::nodes
