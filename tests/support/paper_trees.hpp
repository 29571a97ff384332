/// \file
/// The trees of the paper's sample in our own words: a robot detects a gearbox bottom, picks it up,
/// and places it into a caddy; names hold spaces.
#pragma once

#include <string>
#include <vector>

namespace afterglow::test {

inline std::vector<std::string> paperLeaves() {
  return {"tilt projector for navigation",
          "look at table",
          "detect gearbox bottom",
          "detect caddy",
          "project point cloud",
          "visualize pose",
          "convert to grasp pose",
          "scan scene",
          "look at",
          "open gripper",
          "close gripper",
          "reach object",
          "lift torso",
          "say",
          "allow partial collision",
          "retreat arm",
          "place object",
          "ask for help"};
}

inline std::string paperTrees() {
  return R"(
  <BehaviorTree ID="MainTree">
    <Sequence name="collect a gearbox bottom">
      <Action ID="tilt projector for navigation"/>
      <SubTree ID="go pick gearbox bottom"/>
      <SubTree ID="go place gearbox part"/>
    </Sequence>
  </BehaviorTree>
  <BehaviorTree ID="go pick gearbox bottom">
    <Fallback>
      <Sequence>
        <RetryUntilSuccesful num_attempts="3">
          <Sequence>
            <Sequence name="detect">
              <Action ID="look at table"/>
              <Action ID="detect gearbox bottom" object="{object pose}"/>
              <Action ID="project point cloud"/>
            </Sequence>
            <Fallback name="pick">
              <Sequence>
                <Action ID="convert to grasp pose" object="{object pose}"/>
                <Action ID="scan scene"/>
                <Action ID="look at"/>
                <Action ID="open gripper"/>
                <Action ID="reach object" distance="0.1"/>
                <Action ID="say" what="I take a gearbox bottom from here."/>
                <Action ID="say" what="Here."/>
                <Action ID="allow partial collision"/>
                <Action ID="reach object" distance="-0.03"/>
                <Action ID="close gripper"/>
                <Action ID="reach object" distance="0.025"/>
                <Action ID="retreat arm"/>
              </Sequence>
              <ForceFailure>
                <Action ID="retreat arm"/>
              </ForceFailure>
            </Fallback>
          </Sequence>
        </RetryUntilSuccesful>
      </Sequence>
      <Action ID="ask for help" what="I cannot pick it up."/>
    </Fallback>
  </BehaviorTree>
  <BehaviorTree ID="go place gearbox part">
    <Sequence>
      <Action ID="close gripper"/>
      <Action ID="lift torso"/>
      <Action ID="look at table"/>
      <Action ID="detect caddy" what="gears compartment"/>
      <Action ID="visualize pose"/>
      <Action ID="place object"/>
    </Sequence>
  </BehaviorTree>)";
}

}  // namespace afterglow::test
